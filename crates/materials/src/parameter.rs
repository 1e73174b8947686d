//! Parameters as data: everything that the command line, the lattices, the strategies and the documents know of one.

use serde::{Deserialize, Serialize};

/// What a parameter does to the appearance; strategies, baselines and losses pair parameters of two models by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Albedo of an uncoupled Lambert term: what a scene may replace by a colour of its subject's own.
    DiffuseReflectance,
    /// Colour of the body: of the diffuse reflection of a dielectric, and of the reflectance of a metal.
    BaseColour,
    /// Scale of the body's colour.
    BaseWeight,
    /// Roughness of the diffuse reflection.
    DiffuseRoughness,
    /// Scale of the specular lobe; its reflectance at normal incidence where the model has no Fresnel term.
    SpecularReflectance,
    /// Height of a lobe that is not normalised: what it reflects depends on its width, too.
    LobeHeight,
    /// Reflectance at normal incidence, F0, itself.
    NormalReflectance,
    /// Reflectance at normal incidence as a level from 0 to 1: F0 is 0.08 times it.
    SpecularLevel,
    /// Tint of the specular lobe, 1 for none.
    SpecularColour,
    /// Width of the specular lobe: the microfacet α.
    Roughness,
    /// Width of the specular lobe, as the square root of the microfacet α.
    PerceptualRoughness,
    /// One minus the square root of the microfacet α.
    Glossiness,
    /// Narrowness of the specular lobe: the power of a cosine.
    Exponent,
    /// How much longer the lobe is along one axis than along the other, 0 for not at all.
    Anisotropy,
    /// Share of the metal, 0 to 1.
    Metalness,
    /// Index of refraction of a dielectric, inside over outside.
    RefractiveIndex,
    /// Real part of a conductor's complex index.
    ConductorIndex,
    /// Imaginary part of a conductor's complex index.
    Extinction,
    /// Weight of a clear layer above all others.
    Coat,
    /// Colour of what such a layer lets through.
    CoatColour,
    /// Width of its lobe, as the square root of the microfacet α.
    CoatRoughness,
    /// Its index of refraction.
    CoatIndex,
    /// What else it is like.
    CoatShape,
    /// Weight of a layer of fibres or dust.
    Sheen,
    /// Colour of such a layer.
    SheenColour,
    /// Its roughness.
    SheenRoughness,
    /// What else it is like.
    SheenShape,
    /// What a lobe is like beyond its width.
    LobeShape,
    /// Which measured material.
    Measurement,
    /// A choice between formulas.
    Variant,
}

/// How a target parameter follows a source parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trend {
    /// More of one is more of the other.
    Rising,
    /// More of one is less of the other.
    Falling,
}

impl Role {
    /// The role in words.
    pub fn title(self) -> &'static str {
        match self {
            Self::DiffuseReflectance => "diffuse reflectance",
            Self::BaseColour => "base colour",
            Self::BaseWeight => "base weight",
            Self::DiffuseRoughness => "diffuse roughness",
            Self::SpecularReflectance => "specular reflectance",
            Self::LobeHeight => "height of the lobe",
            Self::NormalReflectance => "reflectance at normal incidence",
            Self::SpecularLevel => "specular level",
            Self::SpecularColour => "specular tint",
            Self::Roughness => "roughness (α)",
            Self::PerceptualRoughness => "roughness (√α)",
            Self::Glossiness => "glossiness (1 − √α)",
            Self::Exponent => "exponent",
            Self::Anisotropy => "anisotropy",
            Self::Metalness => "metalness",
            Self::RefractiveIndex => "index of refraction",
            Self::ConductorIndex => "conductor index",
            Self::Extinction => "extinction",
            Self::Coat => "coat",
            Self::CoatColour => "colour of the coat",
            Self::CoatRoughness => "roughness of the coat",
            Self::CoatIndex => "index of the coat",
            Self::CoatShape => "shape of the coat",
            Self::Sheen => "sheen",
            Self::SheenColour => "colour of the sheen",
            Self::SheenRoughness => "roughness of the sheen",
            Self::SheenShape => "shape of the sheen",
            Self::LobeShape => "shape of the lobe",
            Self::Measurement => "measurement",
            Self::Variant => "variant",
        }
    }

    /// True for what decides the colour of the diffuse reflection.
    pub fn is_body(self) -> bool {
        matches!(self, Self::DiffuseReflectance | Self::BaseColour)
    }

    /// True for what belongs to a layer above the specular lobe: the same in all models that have it, more or less.
    pub fn is_layer(self) -> bool {
        matches!(
            self,
            Self::Coat
                | Self::CoatColour
                | Self::CoatRoughness
                | Self::CoatIndex
                | Self::Sheen
                | Self::SheenColour
                | Self::SheenRoughness
        )
    }

    /// True for what decides the width of the specular lobe.
    pub fn is_width(self) -> bool {
        self.alpha(0.5).is_some()
    }

    /// True for what decides the specular reflectance at normal incidence.
    pub fn is_reflectance(self) -> bool {
        matches!(
            self,
            Self::SpecularReflectance
                | Self::LobeHeight
                | Self::NormalReflectance
                | Self::SpecularLevel
                | Self::RefractiveIndex
        )
    }

    /// The microfacet α that a value of this role stands for; `None` where it stands for no width. A power n of a cosine
    /// is as wide as a Beckmann lobe of `α = √(2/(n + 2))` (Walter *et al.* 2007, 5).
    pub fn alpha(self, value: f64) -> Option<f64> {
        match self {
            Self::Roughness => Some(value),
            Self::PerceptualRoughness => Some(value * value),
            Self::Glossiness => Some((1.0 - value) * (1.0 - value)),
            Self::Exponent => Some((2.0 / (value + 2.0)).sqrt()),
            _ => None,
        }
    }

    /// The inverse of [`Role::alpha`].
    pub fn from_alpha(self, alpha: f64) -> Option<f64> {
        match self {
            Self::Roughness => Some(alpha),
            Self::PerceptualRoughness => Some(alpha.sqrt()),
            Self::Glossiness => Some(1.0 - alpha.sqrt()),
            Self::Exponent => Some((2.0 / (alpha * alpha) - 2.0).max(0.0)),
            _ => None,
        }
    }

    /// How a target parameter must follow a source parameter of this role; `None` where nothing is known
    /// (Guarnera *et al.* 2018, 3.4 and 5.2: roughness with roughness, specular reflectance with the index).
    pub fn trend(self, target: Role) -> Option<Trend> {
        let narrow = |role| matches!(role, Self::Glossiness | Self::Exponent);
        if self.is_width() && target.is_width() {
            return Some(if narrow(self) == narrow(target) { Trend::Rising } else { Trend::Falling });
        }
        (self == target || self.is_reflectance() && target.is_reflectance()).then_some(Trend::Rising)
    }
}

/// An interval of the real line, closed at the top; open or closed at the bottom.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Lower end.
    pub min: f64,
    /// Upper end, included.
    pub max: f64,
    /// True where `min` itself is excluded.
    #[serde(default)]
    pub open: bool,
}

impl Interval {
    /// `[min, max]`.
    pub const fn closed(min: f64, max: f64) -> Self {
        Self { min, max, open: false }
    }

    /// `]min, max]`.
    pub const fn open_below(min: f64, max: f64) -> Self {
        Self { min, max, open: true }
    }

    /// True where `value` lies inside; never for NaN.
    pub fn contains(&self, value: f64) -> bool {
        value <= self.max && if self.open { value > self.min } else { value >= self.min }
    }
}

impl Interval {
    /// The value inside that lies nearest to `value`; just above an excluded end.
    pub fn nearest(&self, value: f64) -> f64 {
        let least = if self.open { self.min + 1e-6 * (self.max - self.min) } else { self.min };
        value.clamp(least, self.max)
    }
}

impl std::fmt::Display for Interval {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}, {}]", if self.open { ']' } else { '[' }, self.min, self.max)
    }
}

/// A regular lattice: `min, min + step, …, max`, or `min, min · step, …, max` where the scale is logarithmic.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Levels {
    /// First level.
    pub min: f64,
    /// Last level, included when it lies on the lattice.
    pub max: f64,
    /// Distance between levels, above 0; their ratio, above 1, where the scale is logarithmic.
    pub step: f64,
}

impl Levels {
    /// A lattice from its ends and its step.
    pub const fn new(min: f64, max: f64, step: f64) -> Self {
        Self { min, max, step }
    }
}

/// How equal steps of a parameter are to be spaced and drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// Equal differences.
    Linear,
    /// Equal ratios.
    Logarithmic,
}

/// Where a numeric parameter may lie, and where it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Range {
    /// What the formula is defined for; anything else is refused.
    pub valid: Interval,
    /// Where real materials lie (Guarnera *et al.* 2018, Table 3, for the paper's models).
    pub plausible: Interval,
    /// Spacing of equal steps.
    pub scale: Scale,
    /// Levels that a search visits when the model is a target.
    pub search: Levels,
    /// Levels that a remap tabulates when the model is a source.
    pub survey: Levels,
}

/// The kind of value that a parameter takes, with its range and default.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Kind {
    /// One number.
    Number {
        /// Accepted and plausible values.
        range: Range,
        /// Value where none is given.
        default: f64,
    },
    /// Linear RGB, each channel within the range; one number stands for grey.
    Colour {
        /// Accepted and plausible values per channel.
        range: Range,
        /// Value where none is given.
        default: [f64; 3],
    },
    /// One number for each of several lobes; all lists of a material have the same length, or one number for all.
    List {
        /// Accepted and plausible values of each.
        range: Range,
        /// Values where none are given.
        default: &'static [f64],
    },
    /// One of several formulas.
    Choice {
        /// Accepted names, the default first.
        options: &'static [&'static str],
    },
    /// A file of measurements; there is no default.
    File {
        /// What it has to hold.
        content: &'static str,
    },
}

/// One parameter of a model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Symbol in formulas and tables.
    pub symbol: &'static str,
    /// What it does.
    pub role: Role,
    /// Unit; `1` for a plain number.
    pub unit: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// Kind, range and default.
    #[serde(flatten)]
    pub kind: Kind,
}

impl Parameter {
    /// The numeric range; `None` for a choice or a file.
    pub fn range(&self) -> Option<&Range> {
        match &self.kind {
            Kind::Number { range, .. } | Kind::Colour { range, .. } | Kind::List { range, .. } => Some(range),
            Kind::Choice { .. } | Kind::File { .. } => None,
        }
    }
}
