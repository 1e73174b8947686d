//! Material models: what each one is called, what its parameters mean, and how it reflects light.
//!
//! A [`Model`] is a description ([`Parameter`]s as data) and a way to build a [`Bsdf`] from values.
//! A [`Material`] is a model with a value for each parameter; it is written
//! `ward:diffuse=0.3,specular=0.1,roughness=0.2` or as JSON.
//!
//! Frame and directions follow the field's habit: `z` is the macroscopic normal, `x` the tangent, `y` the
//! bitangent; `wi` points towards the light and `wo` towards the viewer, both away from the surface.
//! A BSDF value is in 1/sr, without the cosine.
//!
//! This crate reads the files of measurements that a material names, and nothing else.

pub mod albedo;
mod body;
pub mod bsdf;
pub mod burley;
mod canonical;
mod colour;
pub mod conformance;
pub mod distribution;
mod error;
mod foreign;
pub mod fresnel;
mod fuzz;
pub mod geometry;
mod layers;
pub mod lint;
pub mod masking;
mod material;
mod metals;
pub mod microfacet;
mod model;
pub mod models;
mod oren_nayar;
mod parameter;
mod physically_based;
mod presets;
mod quadrature;
mod real;
pub mod rough_interface;
mod sampling;
pub mod sheen;

pub use body::BlackBody;
pub use bsdf::{Bsdf, Lobe};
pub use canonical::Canonical;
pub use colour::hue;
pub use error::MaterialError;
pub use foreign::{Description, ParameterDescription};
pub use geometry::Geometry;
pub use material::{Material, MeasuredFile, Value, split_name};
pub use model::{Alias, Build, Family, Load, Model, Named, Preset, Values};
pub use models::{by_name, registry};
pub use parameter::{Interval, Kind, Levels, Parameter, Range, Role, Scale, Trend};
pub use real::Real;
pub use sampling::{Sampling, Technique};
