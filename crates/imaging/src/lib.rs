//! HDR images, their files, their colours and the numbers that say how far apart two of them look.
//!
//! Everything works on linear RGB with Rec. 709 / sRGB primaries and a D65 white ([`Image`]). Two paths lead to
//! a difference: the exact one in `f64` ([`Fitness`], [`nrmsd()`]) gives the numbers that are reported, and the
//! fast one in `f32` ([`lab_planes`], [`squared_distance`]) serves a search that compares thousands of images.

mod atomic;
mod colour;
mod error;
mod false_colour;
mod file;
mod image;
mod lab;
mod metrics;
mod noisy;
mod product;

pub use atomic::write_atomically;
pub use colour::{delta_e76, lab_from_linear_srgb, luminance, srgb_decode, srgb_encode};
pub use error::ImageError;
pub use false_colour::{error_map, error_scale};
pub use file::{MAX_PIXELS, decode, encode, read, write};
pub use image::Image;
pub use lab::{lab_planes, lab_planes_of, squared_distance, weighted_squared_distance};
pub use metrics::Plane;
pub use metrics::delta_e::{delta_e76_map, delta_e2000, delta_e2000_map};
pub use metrics::distance_correlation::distance_correlation;
pub use metrics::fitness::{Fitness, FitnessTerms, FitnessWeights, ProbeImages, ProbePixels, Reduce, Space};
pub use metrics::flip::{PIXELS_PER_DEGREE as FLIP_PIXELS_PER_DEGREE, flip_map, hdr_flip_map};
pub use metrics::gsm::{MEAN, gsm_map, gsm_of_greys};
pub use metrics::jod::{MODEL_VERSION as JOD_MODEL_VERSION, VIEWING, jod};
pub use metrics::luma::luma_255;
pub use metrics::mask::{Mask, disc_weight};
pub use metrics::nrmsd::{nrmsd, nrmsd_of_noise, nrmsd_pixels};
pub use metrics::registry::{Better, METRICS, Metric, Reading, read_metrics};
pub use metrics::ssim::ssim_map;
pub use metrics::verdict::{INDISTINGUISHABLE, NO_DIFFERENCE, NOTICEABLE, Verdict, share_choosing_correctly};
pub use noisy::{Estimate, Neighbourhoods, NoisyLab};
pub use product::{Columns, inner_product};
