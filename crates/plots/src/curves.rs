//! Curves in a grid of charts.

use std::path::Path;

use plotters::prelude::*;

use crate::PlotError;
use crate::sheet::{self, Area, Drawing, Drawn, short};

/// Colours of the series, by turns: told apart by those who see no red or no green (Okabe and Ito 2008).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// What they are; empty where there is but one.
    pub name: String,
    /// By x.
    pub points: Vec<(f64, f64)>,
}

/// A chart with its axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Above it.
    pub title: String,
    /// What the horizontal axis says.
    pub x: String,
    /// What the vertical axis says.
    pub y: String,
    /// What is drawn.
    pub series: Vec<Series>,
}

/// Charts, row by row, into a .png or .svg file; `panel` is the size of each in pixels of the layout.
///
/// # Errors
/// Another ending, no points at all, a file that cannot be written.
pub fn draw_charts(
    charts: &[Chart],
    columns: usize,
    panel: (u32, u32),
    path: &Path,
) -> Result<(), PlotError> {
    let columns = columns.max(1);
    let rows = charts.len().div_ceil(columns).max(1);
    sheet::write(path, (columns as u32 * panel.0, rows as u32 * panel.1), &Grid { charts, rows, columns })
}

struct Grid<'a> {
    charts: &'a [Chart],
    rows: usize,
    columns: usize,
}

impl Drawing for Grid<'_> {
    fn draw<B: DrawingBackend>(&self, root: &Area<B>, scale: u32) -> Drawn {
        let told = |e: DrawingAreaErrorKind<B::ErrorType>| e.to_string();
        root.fill(&WHITE).map_err(told)?;
        for (area, chart) in root.split_evenly((self.rows, self.columns)).iter().zip(self.charts) {
            curves(chart, area, scale).map_err(told)?;
        }
        root.present().map_err(told)
    }
}

/// The range of some numbers with a little room about them.
fn room(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let finite = values.filter(|v| v.is_finite());
    let (min, max) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    match max - min {
        span if span > 0.0 => min - 0.05 * span..max + 0.05 * span,
        0.0 => min - 0.5..max + 0.5,
        _ => 0.0..1.0,
    }
}

fn curves<B: DrawingBackend>(
    chart: &Chart,
    area: &Area<B>,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let all = || chart.series.iter().flat_map(|series| &series.points);
    let font = |size: u32| ("sans-serif", f64::from(size * scale));
    let mut context = ChartBuilder::on(area)
        .caption(&chart.title, font(13))
        .margin(8 * scale)
        .x_label_area_size(36 * scale)
        .y_label_area_size(52 * scale)
        .build_cartesian_2d(room(all().map(|p| p.0)), room(all().map(|p| p.1)))?;
    context
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_desc(&chart.x)
        .y_desc(&chart.y)
        .x_labels(6)
        .y_labels(5)
        .x_label_formatter(&|v| short(*v))
        .y_label_formatter(&|v| short(*v))
        .label_style(font(11))
        .axis_desc_style(font(12))
        .draw()?;
    for (series, colour) in chart.series.iter().zip(COLOURS.iter().cycle()) {
        let style = colour.stroke_width(2 * scale);
        let points: Vec<(f64, f64)> = series.points.iter().copied().filter(|p| p.1.is_finite()).collect();
        let drawn = context.draw_series([PathElement::new(points.clone(), style)])?;
        if !series.name.is_empty() {
            let width = 16 * scale as i32;
            drawn.label(&series.name).legend(move |(x, y)| PathElement::new([(x, y), (x + width, y)], style));
        }
        context.draw_series(points.iter().map(|at| Circle::new(*at, 2 * scale, colour.filled())))?;
    }
    if chart.series.iter().any(|series| !series.name.is_empty()) {
        context
            .configure_series_labels()
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.2))
            .label_font(font(11))
            .draw()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_name_their_axes_and_series() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("chart.svg");
        let series = |name: &str, slope: f64| Series {
            name: name.into(),
            points: (0..5).map(|x| (f64::from(x), slope * f64::from(x))).collect(),
        };
        let chart = Chart {
            title: "a title".into(),
            x: "roughness".into(),
            y: "error".into(),
            series: vec![series("probe", 1.0), series("copy", 2.0)],
        };
        draw_charts(&[chart.clone(), chart], 2, (320, 240), &path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        for word in ["a title", "roughness", "error", "probe", "copy", "width=\"640\""] {
            assert!(text.contains(word), "{word}");
        }
        let wrong = draw_charts(&[], 1, (100, 100), &folder.path().join("chart.gif")).unwrap_err();
        assert!(wrong.is_usage() && wrong.to_string().contains(".png or .svg"), "{wrong}");
    }
}
