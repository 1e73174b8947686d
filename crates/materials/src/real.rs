//! The scalar type that every lobe is written for: once, for `f64` (exact) and `f32` (fast).

use num_traits::Float;

/// A floating-point type with what material models need beyond [`Float`].
pub trait Real: Float + Send + Sync + 'static {
    /// True for double precision: where a table may not stand for the integral itself.
    const IS_DOUBLE: bool;
    /// Rounds a double-precision constant to this type.
    fn of(value: f64) -> Self;
    /// The error function.
    fn erf(self) -> Self;
}

impl Real for f64 {
    const IS_DOUBLE: bool = true;
    fn of(value: f64) -> Self {
        value
    }
    fn erf(self) -> Self {
        libm::erf(self)
    }
}

impl Real for f32 {
    const IS_DOUBLE: bool = false;
    fn of(value: f64) -> Self {
        value as f32
    }
    fn erf(self) -> Self {
        libm::erff(self)
    }
}
