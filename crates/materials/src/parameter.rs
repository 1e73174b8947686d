//! Parameters as data: everything that the command line, the lattices, the strategies and the documents know of one.

use serde::Serialize;

/// What a parameter does to the appearance; strategies and baselines pair parameters of two models by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Albedo of the Lambert term.
    DiffuseReflectance,
    /// Scale of the specular lobe; its reflectance at normal incidence where the model has no Fresnel term.
    SpecularReflectance,
    /// Width of the specular lobe.
    Roughness,
    /// Index of refraction of a dielectric, inside over outside.
    RefractiveIndex,
    /// Real part of a conductor's complex index.
    ConductorIndex,
    /// Imaginary part of a conductor's complex index.
    Extinction,
    /// A choice between formulas.
    Variant,
}

impl Role {
    /// The role in words.
    pub fn title(self) -> &'static str {
        match self {
            Self::DiffuseReflectance => "diffuse reflectance",
            Self::SpecularReflectance => "specular reflectance",
            Self::Roughness => "roughness",
            Self::RefractiveIndex => "index of refraction",
            Self::ConductorIndex => "conductor index",
            Self::Extinction => "extinction",
            Self::Variant => "variant",
        }
    }

    /// True where a larger value of `self` in a source can only mean a larger or equal value of `target`
    /// (Guarnera *et al.* 2018, 3.4 and 5.2: roughness with roughness, specular reflectance with the index).
    pub fn corresponds_to(self, target: Role) -> bool {
        self == target
            || matches!(
                (self, target),
                (Self::SpecularReflectance, Self::RefractiveIndex)
                    | (Self::RefractiveIndex, Self::SpecularReflectance)
            )
    }
}

/// An interval of the real line, closed at the top; open or closed at the bottom.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// Lower end.
    pub min: f64,
    /// Upper end, included.
    pub max: f64,
    /// True where `min` itself is excluded.
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

impl std::fmt::Display for Interval {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}, {}]", if self.open { ']' } else { '[' }, self.min, self.max)
    }
}

/// A regular lattice: `min, min + step, …, max`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Levels {
    /// First level.
    pub min: f64,
    /// Last level, included when it lies on the lattice.
    pub max: f64,
    /// Distance between levels, above 0.
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
    /// One of several formulas.
    Choice {
        /// Accepted names, the default first.
        options: &'static [&'static str],
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
    /// The numeric range; `None` for a choice.
    pub fn range(&self) -> Option<&Range> {
        match &self.kind {
            Kind::Number { range, .. } | Kind::Colour { range, .. } => Some(range),
            Kind::Choice { .. } => None,
        }
    }
}
