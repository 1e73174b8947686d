//! The Radiance picture format (Ward, "Real Pixels", Graphics Gems II, 1991; Radiance `color.c`), reading only.
//!
//! Mantissas are taken as they are, `m · 2^(e-136)`, like most readers do; Radiance itself adds ½ to each, which
//! would turn the zeros of saturated colours into light.

use super::{check_dimensions, undecodable};
use crate::{Image, ImageError};
use std::path::Path;

/// More pixels than this for each byte are not believed: a black line of 32768 pixels in the old run-length coding.
/// Wider black pictures are possible, but a damaged header is likelier.
const MAX_PIXELS_PER_BYTE: usize = 32768 / 12;

/// Decodes a whole file.
pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<Image, ImageError> {
    let fail = |reason: String| undecodable(path, reason);
    let mut data = Data { rest: bytes };
    let divisor = read_header(&mut data).map_err(fail)?;
    let layout = Layout::parse(&data.line().map_err(fail)?).map_err(fail)?;
    let plausible = data.rest.len().saturating_mul(MAX_PIXELS_PER_BYTE);
    check_dimensions(path, layout.width, layout.height, plausible)?;
    let mut image = Image::new(layout.width, layout.height);
    let (lines, length) = layout.lines();
    for i in 0..lines {
        let line = read_line(&mut data, length)
            .map_err(|reason| fail(format!("scan line {} of {lines}: {reason}", i + 1)))?;
        for (j, rgbe) in line.into_iter().enumerate() {
            image.pixels_mut()[layout.index(i, j)] = radiance(rgbe, divisor);
        }
    }
    Ok(image)
}

/// Linear RGB of a pixel with shared exponent. `f64` because 2^-135 is no normal `f32`.
fn radiance([r, g, b, exponent]: [u8; 4], divisor: [f64; 3]) -> [f32; 3] {
    if exponent == 0 {
        return [0.0; 3];
    }
    let scale = f64::powi(2.0, i32::from(exponent) - 136);
    [
        (f64::from(r) * scale / divisor[0]) as f32,
        (f64::from(g) * scale / divisor[1]) as f32,
        (f64::from(b) * scale / divisor[2]) as f32,
    ]
}

/// Reads the lines up to the first empty one. Returns what the pixels have been multiplied by.
fn read_header(data: &mut Data) -> Result<[f64; 3], String> {
    if !data.rest.starts_with(b"#?") {
        return Err("a Radiance picture starts with `#?RADIANCE`".into());
    }
    data.line()?;
    let mut divisor = [1.0; 3];
    loop {
        let line = data.line()?;
        match line.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
            Some(("FORMAT", "32-bit_rle_rgbe")) => {}
            Some(("FORMAT", other)) => {
                return Err(format!("its FORMAT is `{other}`; only `32-bit_rle_rgbe` is accepted"));
            }
            // Both may occur several times; each is another multiplication.
            Some(("EXPOSURE", value)) => multiply(&mut divisor, "EXPOSURE", &[value; 3])?,
            Some(("COLORCORR", value)) => {
                let values: Vec<&str> = value.split_whitespace().collect();
                multiply(&mut divisor, "COLORCORR", &values)?;
            }
            _ if line.is_empty() => return Ok(divisor),
            _ => {}
        }
    }
}

fn multiply(divisor: &mut [f64; 3], key: &str, values: &[&str]) -> Result<(), String> {
    let numbers: Vec<f64> = values.iter().filter_map(|value| value.parse().ok()).collect();
    let [r, g, b] = numbers[..] else {
        return Err(format!("`{key}={}` is not made of numbers", values.join(" ")));
    };
    for (divisor, factor) in divisor.iter_mut().zip([r, g, b]) {
        if !(factor.is_finite() && factor > 0.0) {
            return Err(format!("`{key}` is {factor}; it must be finite and greater than 0"));
        }
        *divisor *= factor;
    }
    Ok(())
}

/// How scan lines lie in the picture: `-Y 480 +X 640` is the usual one, top to bottom and left to right.
struct Layout {
    width: usize,
    height: usize,
    /// Scan lines are rows (the Y axis is named first), not columns.
    rows: bool,
    /// The first scan line, or first pixel of each, is the bottom one (`+Y`).
    from_bottom: bool,
    /// The same for the right-hand side (`-X`).
    from_right: bool,
}

impl Layout {
    fn parse(line: &str) -> Result<Self, String> {
        let invalid = || format!("its resolution line is `{line}`; one such as `-Y 480 +X 640` is accepted");
        let tokens: Vec<&str> = line.split_whitespace().collect();
        let [first, first_size, second, second_size] = tokens[..] else { return Err(invalid()) };
        let size = |text: &str| text.parse::<usize>().map_err(|_| invalid());
        let (first_size, second_size) = (size(first_size)?, size(second_size)?);
        let (rows, y, x) = match (first, second) {
            ("-Y" | "+Y", "-X" | "+X") => (true, first, second),
            ("-X" | "+X", "-Y" | "+Y") => (false, second, first),
            _ => return Err(invalid()),
        };
        let (height, width) = if rows { (first_size, second_size) } else { (second_size, first_size) };
        Ok(Self { width, height, rows, from_bottom: y == "+Y", from_right: x == "-X" })
    }

    /// Number of scan lines and pixels in each.
    fn lines(&self) -> (usize, usize) {
        if self.rows { (self.height, self.width) } else { (self.width, self.height) }
    }

    /// Where pixel `j` of scan line `i` belongs in a row-major image.
    fn index(&self, i: usize, j: usize) -> usize {
        let (y, x) = if self.rows { (i, j) } else { (j, i) };
        let y = if self.from_bottom { self.height - 1 - y } else { y };
        let x = if self.from_right { self.width - 1 - x } else { x };
        y * self.width + x
    }
}

/// One scan line; its first bytes tell how it is coded.
fn read_line(data: &mut Data, length: usize) -> Result<Vec<[u8; 4]>, String> {
    match data.rest {
        // A flat pixel never starts like this, because then its mantissas would be smaller than 128.
        &[2, 2, high, low, ..] if (8..0x8000).contains(&length) && high < 128 => {
            let stated = usize::from(high) << 8 | usize::from(low);
            if stated != length {
                return Err(format!("it is {stated} pixels long instead of {length}"));
            }
            data.take(4)?;
            read_runs(data, length)
        }
        _ => read_pixels(data, length),
    }
}

/// New run-length coding: the four bytes of all pixels in turn, as runs (count above 128) and literals.
fn read_runs(data: &mut Data, length: usize) -> Result<Vec<[u8; 4]>, String> {
    let mut line = vec![[0; 4]; length];
    for channel in 0..4 {
        let mut x = 0;
        while x < length {
            let code = usize::from(data.byte()?);
            let count = if code > 128 { code - 128 } else { code };
            if count == 0 || count > length - x {
                return Err(format!("a run of {count} pixels where 1 to {} fit", length - x));
            }
            let run = &mut line[x..x + count];
            if code > 128 {
                let value = data.byte()?;
                run.iter_mut().for_each(|pixel| pixel[channel] = value);
            } else {
                let values = data.take(count)?;
                run.iter_mut().zip(values).for_each(|(pixel, &value)| pixel[channel] = value);
            }
            x += count;
        }
    }
    Ok(line)
}

/// Flat pixels, among which (1, 1, 1, n) repeats the one before n times; such repeats in a row are the digits,
/// lowest first, of a number to base 256.
fn read_pixels(data: &mut Data, length: usize) -> Result<Vec<[u8; 4]>, String> {
    let mut line: Vec<[u8; 4]> = Vec::with_capacity(length);
    let mut shift = 0;
    while line.len() < length {
        let bytes = data.take(4)?;
        let pixel = [bytes[0], bytes[1], bytes[2], bytes[3]];
        let [1, 1, 1, digit] = pixel else {
            line.push(pixel);
            shift = 0;
            continue;
        };
        let Some(&previous) = line.last() else {
            return Err("it starts with a repetition of nothing".into());
        };
        let room = length - line.len();
        // Four digits exceed any picture; without a limit the shift would overflow.
        let count = if shift < 32 { usize::from(digit) << shift } else { usize::MAX };
        if count > room {
            return Err(format!("a repetition longer than the {room} pixels that are left"));
        }
        line.extend(std::iter::repeat_n(previous, count));
        shift += 8;
    }
    Ok(line)
}

/// The part of the file that is not yet read.
struct Data<'a> {
    rest: &'a [u8],
}

impl<'a> Data<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let Some((taken, rest)) = self.rest.split_at_checked(count) else {
            return Err("the file ends too early".into());
        };
        self.rest = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, String> {
        Ok(self.take(1)?[0])
    }

    /// A header line without its end.
    fn line(&mut self) -> Result<String, String> {
        let Some(length) = self.rest.iter().position(|&byte| byte == b'\n') else {
            return Err("the file ends within its header".into());
        };
        let line = self.take(length + 1)?;
        Ok(String::from_utf8_lossy(line).trim_end().to_owned())
    }
}
