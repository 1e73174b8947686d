//! The catalogue. A model is one file of this folder and one line of the list below.

use crate::MaterialError;
use crate::error::nearest;
use crate::foreign::{adopted, names_of};
use crate::model::Model;

mod measured;
mod shared;

/// Declares the modules of the models, and the catalogue, in the order in which it is shown.
macro_rules! catalogue {
    ($($model:ident,)*) => {
        $(pub mod $model;)*
        static MODELS: &[&Model] = &[$(&$model::MODEL,)*];
    };
}

catalogue! {
    lambert,
    oren_nayar,
    phong,
    blinn_phong,
    lafortune,
    ward,
    cook_torrance,
    ggx,
    beckmann,
    ggx_conductor,
    beckmann_conductor,
    ashikhmin_shirley,
    ashikhmin_shirley_2000,
    low_abc,
    low_smooth,
    rough_plastic,
    kulla_conty,
    disney,
    mitsuba_principled,
    gltf,
    gltf_spec_gloss,
    usd_preview_surface,
    openpbr,
    standard_surface,
    principled,
    merl,
    merl_file,
}

/// All models.
pub fn registry() -> &'static [&'static Model] {
    MODELS
}

/// The model of a name: ours, or `RENDERER:MODEL` of a renderer that described its own.
///
/// # Errors
/// [`MaterialError::UnknownModel`] with the nearest name.
pub fn by_name(name: &str) -> Result<&'static Model, MaterialError> {
    let ours = registry().iter().find(|m| m.name == name).copied();
    ours.or_else(|| adopted(name)).ok_or_else(|| {
        let of_renderer = name.split_once(':').map(|(renderer, _)| names_of(renderer)).unwrap_or_default();
        let known = match of_renderer[..] {
            [] => registry().iter().map(|m| m.name).collect(),
            _ => of_renderer,
        };
        let nearest = nearest(name, known.iter().copied());
        MaterialError::UnknownModel { name: name.to_owned(), nearest, known: known.join(", ") }
    })
}
