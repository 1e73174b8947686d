//! The scalar type that every lobe is written for: once, for `f64` (exact) and `f32` (fast).

use num_traits::Float;

/// A floating-point type with what material models need beyond [`Float`].
pub trait Real: Float + Send + Sync + 'static {
    /// Rounds a double-precision constant to this type.
    fn of(value: f64) -> Self;
    /// The error function.
    fn erf(self) -> Self;
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn erf(self) -> Self {
        libm::erf(self)
    }
}

impl Real for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }
    fn erf(self) -> Self {
        libm::erff(self)
    }
}
