//! The fitness function of the paper: one number for how different a material looks in two renderers.
//!
//! Guarnera, Guarnera, Toscani, Glencross, Li, Hardeberg and Gegenfurtner, "Perceptually validated cross-renderer analytical BRDF
//! parameter remapping", IEEE TVCG 2018, equation 3:
//!
//! ```text
//! f = w_D (α ‖D_S,point - D_T,point‖ + β ‖D_S,env - D_T,env‖)
//!   + w_S (γ ‖S_S,point - S_T,point‖ + δ ‖S_S,env - S_T,env‖)
//! ```
//!
//! with D the diffuse image and S = full - diffuse the specular one, of the source and target renderer. The paper leaves
//! open which norm is meant and whether images are compared as CIELAB or linear RGB: [`Reduce`] and [`Space`].

use super::{check_counts, exact_pixels, exact_weights};
use crate::colour::{delta_e76, lab_from_linear_srgb};
use crate::{Image, ImageError, Mask};
use serde::{Deserialize, Serialize};

/// The colour space in which images are subtracted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Space {
    /// CIELAB, so that a pixel's difference is ΔE*76. What the paper's text implies.
    #[default]
    Lab,
    /// Linear RGB.
    Linear,
}

/// How the differences of an image's pixels become one number; d is a pixel's difference (three components)
/// and w its mask weight, 1 without a mask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reduce {
    /// `sqrt(Σ w²|d|²)`: the literal L2 norm, which grows with the number of pixels.
    Frobenius,
    /// `sqrt(Σ w²|d|² / pixels)`: the same, independent of resolution. All pixels count, masked or not.
    #[default]
    Rms,
    /// `Σ w|d| / pixels`: in CIELAB the mean ΔE*76.
    Mean,
}

/// The weights of equation 3, all finite and not negative. The default is the paper's (section 4).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitnessWeights {
    /// w_D: both diffuse terms.
    pub diffuse: f64,
    /// w_S: both specular terms, which are about ten times smaller for dielectrics.
    pub specular: f64,
    /// α: diffuse image under the point light.
    pub diffuse_point: f64,
    /// β: diffuse image under the environment.
    pub diffuse_environment: f64,
    /// γ: specular image under the point light.
    pub specular_point: f64,
    /// δ: specular image under the environment.
    pub specular_environment: f64,
}

impl Default for FitnessWeights {
    fn default() -> Self {
        Self::of(0.25, 0.025, 0.025)
    }
}

impl FitnessWeights {
    /// The weights of the paper's three numbers (section 4): w_S = 1 - w_D, β = 1 - α, δ = 1 - γ.
    pub fn of(diffuse: f64, diffuse_point: f64, specular_point: f64) -> Self {
        Self {
            diffuse,
            specular: 1.0 - diffuse,
            diffuse_point,
            diffuse_environment: 1.0 - diffuse_point,
            specular_point,
            specular_environment: 1.0 - specular_point,
        }
    }

    /// Equation 3, given its norms.
    pub fn sum(&self, terms: &FitnessTerms) -> f64 {
        let diffuse =
            self.diffuse_point * terms.diffuse_point + self.diffuse_environment * terms.diffuse_environment;
        let specular = self.specular_point * terms.specular_point
            + self.specular_environment * terms.specular_environment;
        self.diffuse * diffuse + self.specular * specular
    }

    fn check(&self) -> Result<(), ImageError> {
        let named = [
            ("diffuse", self.diffuse),
            ("specular", self.specular),
            ("diffuse_point", self.diffuse_point),
            ("diffuse_environment", self.diffuse_environment),
            ("specular_point", self.specular_point),
            ("specular_environment", self.specular_environment),
        ];
        match named.into_iter().find(|(_, value)| !(value.is_finite() && *value >= 0.0)) {
            Some((name, value)) => Err(ImageError::Weight { name, value }),
            None => Ok(()),
        }
    }
}

/// The four norms of equation 3, which [`FitnessWeights::sum`] adds up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FitnessTerms {
    /// Diffuse images under the point light.
    pub diffuse_point: f64,
    /// Diffuse images under the environment.
    pub diffuse_environment: f64,
    /// Specular images under the point light.
    pub specular_point: f64,
    /// Specular images under the environment.
    pub specular_environment: f64,
}

/// The four renderings of one material: diffuse part alone and everything, each under two lights.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeImages {
    /// Diffuse part, point light.
    pub diffuse_point: Image,
    /// Diffuse part, environment.
    pub diffuse_environment: Image,
    /// Diffuse and specular, point light.
    pub full_point: Image,
    /// Diffuse and specular, environment.
    pub full_environment: Image,
}

/// [`ProbeImages`] as plain `f64` pixels, linear RGB in any fixed order.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbePixels {
    /// Diffuse part, point light.
    pub diffuse_point: Vec<[f64; 3]>,
    /// Diffuse part, environment.
    pub diffuse_environment: Vec<[f64; 3]>,
    /// Diffuse and specular, point light.
    pub full_point: Vec<[f64; 3]>,
    /// Diffuse and specular, environment.
    pub full_environment: Vec<[f64; 3]>,
}

impl From<&ProbeImages> for ProbePixels {
    fn from(images: &ProbeImages) -> Self {
        Self {
            diffuse_point: exact_pixels(&images.diffuse_point),
            diffuse_environment: exact_pixels(&images.diffuse_environment),
            full_point: exact_pixels(&images.full_point),
            full_environment: exact_pixels(&images.full_environment),
        }
    }
}

/// Equation 3 with its choices; [`Fitness::default`] is CIELAB, RMS and the paper's weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Fitness {
    /// Where images are subtracted.
    pub space: Space,
    /// How pixels are summed up.
    pub reduce: Reduce,
    /// How the four terms are added.
    pub weights: FitnessWeights,
}

impl Fitness {
    /// Equation 3 in `f64`: 0 for equal renderings, larger the more they differ.
    ///
    /// All eight images must have one size, which is also the mask's. The mask multiplies each pixel's difference, in
    /// all four terms. The specular image is formed in linear RGB, before any conversion, and may be negative.
    ///
    /// # Errors
    /// Different sizes, with the names of the images; a negative or non-finite weight.
    pub fn evaluate(
        &self,
        source: &ProbeImages,
        target: &ProbeImages,
        mask: Option<&Mask>,
    ) -> Result<f64, ImageError> {
        let reference = &source.diffuse_point;
        for (what, image) in [
            ("source diffuse_point and source diffuse_environment", &source.diffuse_environment),
            ("source diffuse_point and source full_point", &source.full_point),
            ("source diffuse_point and source full_environment", &source.full_environment),
            ("source diffuse_point and target diffuse_point", &target.diffuse_point),
            ("source diffuse_point and target diffuse_environment", &target.diffuse_environment),
            ("source diffuse_point and target full_point", &target.full_point),
            ("source diffuse_point and target full_environment", &target.full_environment),
        ] {
            reference.check_same_size(image).map_err(|error| error.in_image(what))?;
        }
        let weights = exact_weights(mask, reference)?;
        self.evaluate_pixels(&source.into(), &target.into(), weights.as_deref())
    }

    /// [`Fitness::evaluate`] for pixels held in `f64`, with one mask weight per pixel or none.
    ///
    /// # Errors
    /// Lists of different length or without pixels; a negative or non-finite weight.
    pub fn evaluate_pixels(
        &self,
        source: &ProbePixels,
        target: &ProbePixels,
        mask: Option<&[f64]>,
    ) -> Result<f64, ImageError> {
        self.weights.check()?;
        let specular =
            |full: &[[f64; 3]], diffuse: &[[f64; 3]], other_full: &[[f64; 3]], other_diffuse: &[[f64; 3]]| {
                self.norm(&subtract(full, diffuse)?, &subtract(other_full, other_diffuse)?, mask)
            };
        let terms = FitnessTerms {
            diffuse_point: self.norm(&source.diffuse_point, &target.diffuse_point, mask)?,
            diffuse_environment: self.norm(&source.diffuse_environment, &target.diffuse_environment, mask)?,
            specular_point: specular(
                &source.full_point,
                &source.diffuse_point,
                &target.full_point,
                &target.diffuse_point,
            )?,
            specular_environment: specular(
                &source.full_environment,
                &source.diffuse_environment,
                &target.full_environment,
                &target.diffuse_environment,
            )?,
        };
        Ok(self.weights.sum(&terms))
    }

    /// ‖a - b‖ of two linear RGB images.
    fn norm(&self, a: &[[f64; 3]], b: &[[f64; 3]], mask: Option<&[f64]>) -> Result<f64, ImageError> {
        check_counts(a.len(), b.len())?;
        check_counts(a.len(), mask.map_or(a.len(), <[f64]>::len))?;
        let weighted = (0..a.len()).map(|i| {
            let difference = match self.space {
                Space::Lab => delta_e76(lab_from_linear_srgb(a[i]), lab_from_linear_srgb(b[i])),
                Space::Linear => distance(a[i], b[i]),
            };
            mask.map_or(1.0, |w| w[i]) * difference
        });
        let pixels = a.len() as f64;
        Ok(match self.reduce {
            Reduce::Frobenius => weighted.map(|d| d * d).sum::<f64>().sqrt(),
            Reduce::Rms => (weighted.map(|d| d * d).sum::<f64>() / pixels).sqrt(),
            Reduce::Mean => weighted.sum::<f64>() / pixels,
        })
    }
}

/// Euclidean distance of two colours.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

fn subtract(a: &[[f64; 3]], b: &[[f64; 3]]) -> Result<Vec<[f64; 3]>, ImageError> {
    check_counts(a.len(), b.len())?;
    Ok(a.iter().zip(b).map(|(a, b)| [a[0] - b[0], a[1] - b[1], a[2] - b[2]]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probe(value: f32) -> ProbeImages {
        let image = |v: f32| Image::from_fn(3, 2, |x, _| [v, v * x as f32, v]);
        ProbeImages {
            diffuse_point: image(value),
            diffuse_environment: image(value * 2.0),
            full_point: image(value * 3.0),
            full_environment: image(value * 4.0),
        }
    }

    #[test]
    fn equal_probes_have_fitness_zero_and_it_is_symmetric() {
        for space in [Space::Lab, Space::Linear] {
            for reduce in [Reduce::Frobenius, Reduce::Rms, Reduce::Mean] {
                let fitness = Fitness { space, reduce, ..Fitness::default() };
                let value = |a, b| fitness.evaluate(&probe(a), &probe(b), None).unwrap();
                assert_eq!(value(0.3, 0.3), 0.0);
                assert_eq!(value(0.3, 0.4), value(0.4, 0.3));
                assert!(value(0.3, 0.5) > value(0.3, 0.4));
            }
        }
    }

    #[test]
    fn errors_name_the_image_and_the_weight() {
        let mut odd = probe(1.0);
        odd.full_environment = Image::new(2, 3);
        let fitness = Fitness::default();
        let error = fitness.evaluate(&probe(1.0), &odd, None).unwrap_err().to_string();
        assert!(error.contains("target full_environment") && error.contains("2 x 3"), "{error}");
        let mut negative = fitness;
        negative.weights.specular_point = -1.0;
        let error = negative.evaluate(&probe(1.0), &probe(1.0), None).unwrap_err().to_string();
        assert!(error.contains("`specular_point` is -1"), "{error}");
    }

    #[test]
    fn three_numbers_make_all_weights() {
        let paper = FitnessWeights::default();
        assert_eq!((paper.diffuse, paper.specular), (0.25, 0.75));
        assert_eq!((paper.diffuse_point, paper.diffuse_environment), (0.025, 0.975));
        assert_eq!((paper.specular_point, paper.specular_environment), (0.025, 0.975));
        let terms = FitnessTerms {
            diffuse_point: 1.0,
            diffuse_environment: 10.0,
            specular_point: 100.0,
            specular_environment: 1000.0,
        };
        let expected = 0.5 * (0.25 + 7.5) + 0.5 * (75.0 + 250.0);
        assert_eq!(FitnessWeights::of(0.5, 0.25, 0.75).sum(&terms), expected);
    }

    #[test]
    fn serde_uses_lowercase_names_and_the_papers_defaults() {
        let fitness: Fitness =
            serde_json::from_str(r#"{"reduce":"mean","weights":{"diffuse":0.5}}"#).unwrap();
        assert_eq!((fitness.space, fitness.reduce), (Space::Lab, Reduce::Mean));
        assert_eq!((fitness.weights.diffuse, fitness.weights.specular), (0.5, 0.75));
        assert!(serde_json::to_string(&fitness).unwrap().contains(r#""space":"lab""#));
        assert!(serde_json::from_str::<Fitness>(r#"{"reduse":"mean"}"#).is_err());
    }
}
