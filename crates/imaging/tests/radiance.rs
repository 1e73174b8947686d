//! The Radiance decoder against pictures encoded here in every way that the format knows.

use lookmatch_imaging::{Image, read};
use std::fs;

const WIDTH: usize = 13;
const HEIGHT: usize = 3;

/// Bytes of the pixel in column x, row y: some runs, some variety, never the marker (1, 1, 1).
fn rgbe(x: usize, y: usize) -> [u8; 4] {
    if x < 6 { [200, 0, y as u8 + 7, 130] } else { [128 + x as u8, 90, 17 * y as u8, 127 + y as u8] }
}

fn linear([r, g, b, e]: [u8; 4]) -> [f32; 3] {
    [r, g, b].map(|m| f32::from(m) * 2_f32.powi(i32::from(e) - 136))
}

fn expected() -> Image {
    Image::from_fn(WIDTH, HEIGHT, |x, y| linear(rgbe(x, y)))
}

fn file(header: &str, data: &[u8]) -> Result<Image, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.hdr");
    fs::write(&path, [header.as_bytes(), data].concat()).unwrap();
    let result = read(&path).map_err(|error| error.to_string());
    if let Err(text) = &result {
        assert!(text.contains("a.hdr"), "{text}");
    }
    result
}

const HEADER: &str = "#?RADIANCE\n# a comment\nFORMAT=32-bit_rle_rgbe\n\n";

fn standard(data: &[u8]) -> Result<Image, String> {
    file(&format!("{HEADER}-Y {HEIGHT} +X {WIDTH}\n"), data)
}

/// Runs of three and more become runs, everything else literals.
fn encode_channel(values: &[u8], out: &mut Vec<u8>) {
    let mut rest = values;
    while let Some(&first) = rest.first() {
        let run = rest.iter().take_while(|&&value| value == first).count().min(127);
        if run > 2 {
            out.extend([128 + run as u8, first]);
            rest = &rest[run..];
        } else {
            out.extend([1, first]);
            rest = &rest[1..];
        }
    }
}

fn run_length_coded() -> Vec<u8> {
    let mut data = Vec::new();
    for y in 0..HEIGHT {
        data.extend([2, 2, 0, WIDTH as u8]);
        for channel in 0..4 {
            let values: Vec<u8> = (0..WIDTH).map(|x| rgbe(x, y)[channel]).collect();
            encode_channel(&values, &mut data);
        }
    }
    data
}

fn flat(pixel: impl Fn(usize, usize) -> [u8; 4], width: usize, height: usize) -> Vec<u8> {
    (0..width * height).flat_map(|i| pixel(i % width, i / width)).collect()
}

#[test]
fn run_lengths() {
    assert_eq!(standard(&run_length_coded()).unwrap(), expected());
}

#[test]
fn flat_pixels() {
    assert_eq!(standard(&flat(rgbe, WIDTH, HEIGHT)).unwrap(), expected());
}

#[test]
fn old_run_lengths() {
    let mut data = Vec::new();
    for y in 0..HEIGHT {
        data.extend(rgbe(0, y));
        data.extend([1, 1, 1, 5]);
        (6..WIDTH).for_each(|x| data.extend(rgbe(x, y)));
    }
    assert_eq!(standard(&data).unwrap(), expected());
    // 300 = 44 + 1 · 256 repetitions after the first pixel.
    let data = [[9, 9, 9, 130], [1, 1, 1, 44], [1, 1, 1, 1]].concat();
    let image = file(&format!("{HEADER}-Y 1 +X 301\n"), &data).unwrap();
    assert!(image.pixels().iter().all(|&pixel| pixel == linear([9, 9, 9, 130])));
}

#[test]
fn all_eight_orientations() {
    for (y_sign, x_sign) in [("-", "+"), ("-", "-"), ("+", "+"), ("+", "-")] {
        let row = |y| if y_sign == "-" { y } else { HEIGHT - 1 - y };
        let column = |x| if x_sign == "+" { x } else { WIDTH - 1 - x };
        let rows_first = format!("{HEADER}{y_sign}Y {HEIGHT} {x_sign}X {WIDTH}\n");
        let data = flat(|x, y| rgbe(column(x), row(y)), WIDTH, HEIGHT);
        assert_eq!(file(&rows_first, &data).unwrap(), expected(), "{rows_first}");
        let columns_first = format!("{HEADER}{x_sign}X {WIDTH} {y_sign}Y {HEIGHT}\n");
        let data = flat(|y, x| rgbe(column(x), row(y)), HEIGHT, WIDTH);
        assert_eq!(file(&columns_first, &data).unwrap(), expected(), "{columns_first}");
    }
}

#[test]
fn exposure_is_undone() {
    let header = "#?RGBE\nEXPOSURE=2.0\nEXPOSURE= 4\nCOLORCORR= 1 2 .5\n\n-Y 1 +X 1\n";
    let image = file(header, &[128, 128, 128, 136]).unwrap();
    assert_eq!(image.get(0, 0), [16.0, 8.0, 32.0]);
}

#[test]
fn exponent_zero_is_black() {
    let image = file(&format!("{HEADER}-Y 1 +X 1\n"), &[255, 255, 255, 0]).unwrap();
    assert_eq!(image.get(0, 0), [0.0; 3]);
}

#[test]
fn what_is_wrong_is_said() {
    let full = run_length_coded();
    for (header, data, words) in [
        ("", &[][..], "starts with `#?RADIANCE`"),
        ("#?RADIANCE\n", &[], "ends within its header"),
        ("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 3 +X 13\n", &full, "32-bit_rle_xyze"),
        ("#?RADIANCE\nEXPOSURE=0\n\n-Y 3 +X 13\n", &full, "greater than 0"),
        ("#?RADIANCE\nEXPOSURE=a\n\n-Y 3 +X 13\n", &full, "not made of numbers"),
        ("#?RADIANCE\n\n-Y 3 +Y 13\n", &full, "resolution line"),
        ("#?RADIANCE\n\n-Y -3 +X 13\n", &full, "resolution line"),
        ("#?RADIANCE\n\n-Y 0 +X 13\n", &full, "at least 1 x 1"),
        ("#?RADIANCE\n\n-Y 16000 +X 16000\n", &full, "too short for that"),
        ("#?RADIANCE\n\n-Y 99999999999 +X 99999999999\n", &full, "at most"),
        ("#?RADIANCE\n\n-Y 3 +X 14\n", &full, "13 pixels long instead of 14"),
        ("#?RADIANCE\n\n-Y 4 +X 13\n", &full, "scan line 4 of 4: the file ends too early"),
        ("#?RADIANCE\n\n-Y 1 +X 3\n", &[1, 1, 1, 2], "repetition of nothing"),
        ("#?RADIANCE\n\n-Y 1 +X 3\n", &[5, 5, 5, 130, 1, 1, 1, 9], "the 2 pixels that are left"),
        ("#?RADIANCE\n\n-Y 1 +X 8\n", &[2, 2, 0, 8, 137, 0], "where 1 to 8 fit"),
    ] {
        let text = file(header, data).unwrap_err();
        assert!(text.contains(words), "{header:?}: {text}");
    }
}
