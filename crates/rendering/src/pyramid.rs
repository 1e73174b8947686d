//! Textures with a pyramid of averages, for look-ups of any footprint (Williams 1983).

use crate::Rgb;

/// A texture and its averages, each level half as large.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    levels: Vec<Level>,
    wraps: bool,
}

#[derive(Clone, Debug)]
struct Level {
    width: usize,
    height: usize,
    texels: Vec<Rgb>,
}

impl Pyramid {
    /// Builds the averages. `row_weight(v)` is the relative area of a texel at height `v` in `[0, 1]`; `wraps` says that
    /// the left edge continues at the right.
    pub(crate) fn new(
        width: usize,
        height: usize,
        texels: Vec<Rgb>,
        wraps: bool,
        row_weight: impl Fn(f64) -> f64,
    ) -> Self {
        let mut levels = vec![Level { width, height, texels }];
        while let Some(next) = levels.last().filter(|l| l.height > 1).map(|l| l.halved(&row_weight)) {
            levels.push(next);
        }
        Self { levels, wraps }
    }

    /// Texels of the finest level along the height.
    pub(crate) fn height(&self) -> usize {
        self.levels[0].height
    }

    /// Width, height and texels of the finest level that has at most this many columns, or of the coarsest.
    pub(crate) fn level_within(&self, most: usize) -> (usize, usize, &[Rgb]) {
        let level = self.levels.iter().position(|level| level.width <= most);
        let level = &self.levels[level.unwrap_or(self.levels.len() - 1)];
        (level.width, level.height, &level.texels)
    }

    /// Bilinear look-up at `u, v` in `[0, 1]` in one level, or the coarsest.
    #[inline(always)]
    pub(crate) fn at_level(&self, u: f32, v: f32, level: u32) -> Rgb {
        self.levels[(level as usize).min(self.levels.len() - 1)].bilinear(u, v, self.wraps)
    }

    /// Trilinear look-up at `u, v` in `[0, 1]` for a footprint of `texels` texels of the finest level.
    pub(crate) fn sample(&self, u: f32, v: f32, texels: f32) -> Rgb {
        let level = texels.max(1.0).log2().min((self.levels.len() - 1) as f32);
        let (low, t) = (level as usize, level.fract());
        let fine = self.levels[low].bilinear(u, v, self.wraps);
        if t == 0.0 {
            return fine;
        }
        fine.lerp(self.levels[low + 1].bilinear(u, v, self.wraps), t)
    }
}

impl Level {
    #[inline(always)]
    fn bilinear(&self, u: f32, v: f32, wraps: bool) -> Rgb {
        let (x, y) = (u * self.width as f32 - 0.5, v * self.height as f32 - 0.5);
        // Rounding down: the positions are -0.5 or more, and truncation, unlike `floor`, is one instruction.
        let down = |v: f32| (v + 1.0) as i32 - 1;
        let (x0, y0) = (down(x), down(y));
        let (tx, ty) = (x - x0 as f32, y - y0 as f32);
        let clamp = |i: i32, n: usize| i.clamp(0, n as i32 - 1) as usize;
        let (left, right) = if wraps {
            let last = self.width as i32 - 1;
            // u lies in [0, 1], so that one step beyond either edge is all that occurs.
            (if x0 < 0 { last } else { x0.min(last) } as usize, if x0 >= last { 0 } else { x0 + 1 } as usize)
        } else {
            (clamp(x0, self.width), clamp(x0 + 1, self.width))
        };
        let (top, bottom) = (clamp(y0, self.height) * self.width, clamp(y0 + 1, self.height) * self.width);
        let upper = self.texels[top + left].lerp(self.texels[top + right], tx);
        let lower = self.texels[bottom + left].lerp(self.texels[bottom + right], tx);
        upper.lerp(lower, ty)
    }

    fn halved(&self, row_weight: &impl Fn(f64) -> f64) -> Level {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let columns = overlaps(self.width, width);
        let rows = overlaps(self.height, height);
        let mut texels = Vec::with_capacity(width * height);
        for row in &rows {
            for column in &columns {
                let (mut sum, mut total) = (Rgb::ZERO, 0.0);
                for (y, wy) in row {
                    let wy = wy * row_weight((*y as f64 + 0.5) / self.height as f64);
                    for (x, wx) in column {
                        sum += self.texels[y * self.width + x] * (wx * wy) as f32;
                        total += wx * wy;
                    }
                }
                texels.push(sum / total as f32);
            }
        }
        Level { width, height, texels }
    }
}

/// For each of `to` equal intervals, the cells of a grid of `from` cells that it covers, with their shares.
fn overlaps(from: usize, to: usize) -> Vec<Vec<(usize, f64)>> {
    let scale = from as f64 / to as f64;
    let share = |cell: usize, start: f64, end: f64| end.min(cell as f64 + 1.0) - start.max(cell as f64);
    (0..to)
        .map(|i| {
            let (start, end) = (i as f64 * scale, (i + 1) as f64 * scale);
            let cells = start as usize..(end.ceil() as usize).min(from);
            cells.map(|c| (c, share(c, start, end))).filter(|(_, s)| *s > 1e-9).collect()
        })
        .collect()
}
