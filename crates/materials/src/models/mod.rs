//! The catalogue. A model is one file of this folder and one line of the table below.

use crate::MaterialError;
use crate::error::nearest;
use crate::model::Model;

pub mod ashikhmin_shirley;
pub mod beckmann;
pub mod beckmann_conductor;
pub mod ggx;
pub mod ggx_conductor;
pub mod kulla_conty;
pub mod lambert;
pub mod openpbr;
pub mod principled;
mod shared;
pub mod standard_surface;
pub mod ward;

/// The catalogue, in the order in which it is shown.
static MODELS: &[&Model] = &[
    &lambert::MODEL,
    &ward::MODEL,
    &ggx::MODEL,
    &beckmann::MODEL,
    &ggx_conductor::MODEL,
    &beckmann_conductor::MODEL,
    &ashikhmin_shirley::MODEL,
    &kulla_conty::MODEL,
    &openpbr::MODEL,
    &standard_surface::MODEL,
    &principled::MODEL,
];

/// All models.
pub fn registry() -> &'static [&'static Model] {
    MODELS
}

/// The model of a name.
///
/// # Errors
/// [`MaterialError::UnknownModel`] with the nearest name.
pub fn by_name(name: &str) -> Result<&'static Model, MaterialError> {
    registry().iter().find(|m| m.name == name).copied().ok_or_else(|| MaterialError::UnknownModel {
        name: name.to_owned(),
        nearest: nearest(name, registry().iter().map(|m| m.name)),
        known: registry().iter().map(|m| m.name).collect::<Vec<_>>().join(", "),
    })
}
