//! The catalogue. A model is one file of this folder and one line of the table below.

use crate::MaterialError;
use crate::error::nearest;
use crate::model::Model;

pub mod ashikhmin_shirley;
pub mod ashikhmin_shirley_2000;
pub mod beckmann;
pub mod beckmann_conductor;
pub mod blinn_phong;
pub mod cook_torrance;
pub mod disney;
pub mod ggx;
pub mod ggx_conductor;
pub mod gltf;
pub mod gltf_spec_gloss;
pub mod lafortune;
pub mod lambert;
pub mod low_abc;
pub mod low_smooth;
mod measured;
pub mod merl;
pub mod merl_file;
pub mod mitsuba_principled;
pub mod oren_nayar;
pub mod phong;
pub mod rough_plastic;
mod shared;
pub mod usd_preview_surface;
pub mod ward;

/// The catalogue, in the order in which it is shown.
static MODELS: &[&Model] = &[
    &lambert::MODEL,
    &oren_nayar::MODEL,
    &phong::MODEL,
    &blinn_phong::MODEL,
    &lafortune::MODEL,
    &ward::MODEL,
    &ggx::MODEL,
    &beckmann::MODEL,
    &ggx_conductor::MODEL,
    &beckmann_conductor::MODEL,
    &ashikhmin_shirley::MODEL,
    &disney::MODEL,
    &mitsuba_principled::MODEL,
    &gltf::MODEL,
    &gltf_spec_gloss::MODEL,
    &usd_preview_surface::MODEL,
    &merl::MODEL,
    &merl_file::MODEL,
    &ashikhmin_shirley_2000::MODEL,
    &cook_torrance::MODEL,
    &low_abc::MODEL,
    &low_smooth::MODEL,
    &rough_plastic::MODEL,
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
