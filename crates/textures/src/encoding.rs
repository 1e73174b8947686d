//! Linear or sRGB: what a texture says of itself, and what its values betray.
//!
//! Parameters are numbers, so their maps are linear. A map that was saved "as a picture" is not, and every value in it is too
//! large: that is said, never guessed away.

use std::path::Path;

use lookmatch_imaging::{srgb_decode, srgb_encode};
use serde::Serialize;

/// How numbers become samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// As they are.
    Linear,
    /// With the transfer function of sRGB.
    Srgb,
}

impl Encoding {
    /// The encoding of a name.
    pub fn parse(name: &str) -> Option<Self> {
        match name {
            "linear" => Some(Self::Linear),
            "srgb" => Some(Self::Srgb),
            _ => None,
        }
    }
}

/// Decodes in place; values beyond 0 to 1 follow the function's own continuation.
pub(crate) fn decode(plane: &mut [f32], is_byte: bool) {
    if is_byte {
        let table: Vec<f32> = (0..=255u8).map(|code| srgb_decode(f32::from(code) / 255.0)).collect();
        plane.iter_mut().for_each(|v| *v = table[code(*v)]);
    } else {
        plane.iter_mut().for_each(|v| *v = srgb_decode(*v));
    }
}

/// Encodes in place.
pub(crate) fn encode(plane: &mut [f32]) {
    plane.iter_mut().for_each(|v| *v = srgb_encode(v.clamp(0.0, 1.0)));
}

fn code(value: f32) -> usize {
    (value * 255.0).round() as u8 as usize
}

/// True for the profile of sRGB, by its name: profiles differ in all else.
pub(crate) fn icc_is_srgb(profile: &[u8]) -> bool {
    // Names are ASCII in version 2 and big-endian UTF-16 in version 4.
    let text: Vec<u8> = profile.iter().copied().filter(|b| *b != 0).collect();
    text.windows(4).any(|w| w.eq_ignore_ascii_case(b"srgb"))
}

/// Why a file's name says that it is sRGB-encoded.
pub(crate) fn named_srgb(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    let words: Vec<&str> = name.split(|c: char| !c.is_ascii_alphanumeric()).collect();
    words.contains(&"srgb").then(|| "its name says so".to_owned())
}

/// Which codes of 8 bits occur in a map.
#[derive(Clone, Debug)]
pub(crate) struct Codes([bool; 256]);

impl Default for Codes {
    fn default() -> Self {
        Self([false; 256])
    }
}

impl Codes {
    pub(crate) fn add(&mut self, plane: &[f32]) {
        plane.iter().for_each(|v| self.0[code(*v)] = true);
    }

    /// True where the codes have the gaps that sRGB encoding tears into maps of 8 bits.
    ///
    /// Encoding stretches the dark codes, so that some 70 of the 256 are never reached. A linear map with many codes, among them
    /// enough that could fall into the gaps, does not miss them all by chance: with 24 codes below the middle, where half
    /// are gaps, once in 10⁷.
    pub(crate) fn look_encoded(&self) -> bool {
        let mut reached = [false; 256];
        for linear in 0..=255u8 {
            reached[code(srgb_encode(f32::from(linear) / 255.0))] = true;
        }
        let fits = self.0.iter().zip(&reached).all(|(occurs, reached)| !occurs || *reached);
        fits && self.0[1..128].iter().filter(|occurs| **occurs).count() >= 24
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoded_maps_of_8_bits_betray_themselves_and_others_do_not() {
        let linear: Vec<f32> = (0..=200u8).map(|c| f32::from(c) / 255.0).collect();
        let encoded: Vec<f32> = linear.iter().map(|v| (srgb_encode(*v) * 255.0).round() / 255.0).collect();
        let looks = |plane: &[f32]| {
            let mut codes = Codes::default();
            codes.add(plane);
            codes.look_encoded()
        };
        assert!(looks(&encoded));
        assert!(!looks(&linear));
        // Few values tell nothing.
        assert!(!looks(&encoded[..10]));
    }

    #[test]
    fn bytes_are_decoded_as_by_the_formula() {
        let mut plane: Vec<f32> = (0..=255u8).map(|c| f32::from(c) / 255.0).collect();
        let expected: Vec<f32> = plane.iter().map(|v| srgb_decode(*v)).collect();
        decode(&mut plane, true);
        assert_eq!(plane, expected);
        encode(&mut plane);
        assert!(plane.iter().enumerate().all(|(c, v)| code(*v) == c));
    }

    #[test]
    fn names_and_profiles() {
        assert!(named_srgb(Path::new("rough_sRGB.1001.png")).is_some());
        assert!(named_srgb(Path::new("rough.png")).is_none());
        assert!(icc_is_srgb(b"....desc....sRGB IEC61966-2.1") && icc_is_srgb(b"\0s\0R\0G\0B"));
        assert!(!icc_is_srgb(b"desc Adobe RGB"));
    }
}
