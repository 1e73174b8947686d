//! Arithmetic of linear RGB colours.

/// The mean of the channels: of a grey, its value to the last digit.
pub(crate) fn mean([r, g, b]: [f64; 3]) -> f64 {
    if r == g && g == b { r } else { (r + g + b) / 3.0 }
}

/// The largest channel.
pub(crate) fn largest(colour: [f64; 3]) -> f64 {
    colour.into_iter().fold(0.0, f64::max)
}

/// A colour divided by its largest channel; white for black.
pub fn hue(colour: [f64; 3]) -> [f64; 3] {
    let largest = largest(colour);
    if largest > 0.0 { colour.map(|v| v / largest) } else { [1.0; 3] }
}
