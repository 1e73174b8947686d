//! Textures of material parameters through a probe: from maps of a source's parameters to maps of its target's.
//!
//! A probe is baked into tables ([`Lut`]), which say what [`lookmatch_remap::apply`] would for each texel. Files are read, mapped
//! and written in bands of rows, by a thread for each file ([`convert`]).

mod bake;
mod carried;
mod convert;
mod encoding;
mod error;
mod files;
mod lut;
mod report;
mod stream;
mod udim;

pub use carried::TOLERANCE;
pub use convert::{Progress, Request, convert};
pub use encoding::Encoding;
pub use error::TextureError;
pub use files::{Channel, Container, Depth, Format};
pub use lut::{Between, Lut, LutError, MAX_INPUTS};
pub use report::Report;
