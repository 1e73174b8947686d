//! Inner products and distances of many vectors with many others, as one matrix product.
//!
//! As in [`crate::lab`], additions have a fixed order and are never fused with products: the same bits on every processor.

use multiversion::multiversion;

/// Columns side by side in a panel: one AVX-512 register.
const LANES: usize = 16;
/// Rows that pass a panel together: with 16 columns, as many sums as fit the registers of AVX2.
const ROWS: usize = 6;
/// Products added in `f32` before their sum moves to `f64`.
const SPAN: usize = 16;
/// Squared distances below this part of `|a|² + |b|²` are summed directly: see [`Columns::squared_distances`].
const NEAR: f64 = 1.0 / 8.0;

/// Vectors of one length, packed to be multiplied with many others.
#[derive(Clone, Debug)]
pub struct Columns {
    length: usize,
    count: usize,
    /// Groups of [`LANES`] columns, one after the other; each holds the first values of all its columns, then the second
    /// ones and so on. The last group is filled up with zeros.
    values: Vec<[f32; LANES]>,
    /// Squared lengths.
    squares: Vec<f64>,
}

impl Columns {
    /// Packs some vectors.
    ///
    /// # Panics
    /// Where one is not `length` long.
    pub fn new<V: AsRef<[f32]>>(length: usize, columns: &[V]) -> Self {
        let mut values = vec![[0.0; LANES]; length * columns.len().div_ceil(LANES)];
        for (k, column) in columns.iter().map(V::as_ref).enumerate() {
            assert_eq!(column.len(), length, "columns of one length are needed");
            let panel = &mut values[k / LANES * length..][..length];
            panel.iter_mut().zip(column).for_each(|(lanes, v)| lanes[k % LANES] = *v);
        }
        let squares = columns.iter().map(V::as_ref).map(|column| inner_product(column, column)).collect();
        Self { length, count: columns.len(), values, squares }
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True where there is no column.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Most by which a product may be off, over the product of both lengths `|a| |b|`: 17 roundings of `f32`.
    pub const PRODUCT_ERROR: f64 = (SPAN + 1) as f64 / (1u64 << 24) as f64;

    /// Most by which a squared distance may be off, over its value.
    pub const DISTANCE_ERROR: f64 = 1e-5;

    /// Inner products of rows with all columns, row after row, within [`Columns::PRODUCT_ERROR`].
    ///
    /// # Panics
    /// Where a row has another length than the columns.
    pub fn products(&self, rows: &[&[f32]]) -> Vec<f64> {
        let mut products = vec![0.0; rows.len() * self.count];
        if products.is_empty() {
            return products;
        }
        for (row, out) in rows.chunks(ROWS).zip(products.chunks_mut(ROWS * self.count)) {
            // Missing rows are stood in for by the first one.
            let tile: [&[f32]; ROWS] = std::array::from_fn(|r| *row.get(r).unwrap_or(&row[0]));
            tile.iter().for_each(|r| assert_eq!(r.len(), self.length, "rows as long as columns are needed"));
            for group in 0..self.count.div_ceil(LANES) {
                let mut sums = [[0.0; LANES]; ROWS];
                tile_dispatched(&tile, self.panel(group), &mut sums);
                let columns = group * LANES..self.count.min((group + 1) * LANES);
                for (out, sums) in out.chunks_mut(self.count).zip(&sums) {
                    out[columns.clone()].copy_from_slice(&sums[..columns.len()]);
                }
            }
        }
        products
    }

    /// Squared distances of rows to all columns, row after row, within [`Columns::DISTANCE_ERROR`] of their value.
    ///
    /// `|a|² + |b|² − 2 a·b` loses as many digits as the distance is smaller than the vectors. The error is at most
    /// [`Columns::PRODUCT_ERROR`] (1e-6) of `|a|² + |b|²`; pairs whose squared distance is less than 1/8 of that are
    /// therefore summed directly.
    ///
    /// # Panics
    /// Where a row has another length than the columns.
    pub fn squared_distances(&self, rows: &[&[f32]]) -> Vec<f64> {
        let mut distances = self.products(rows);
        for (row, out) in rows.iter().zip(distances.chunks_mut(self.count.max(1))) {
            let square = inner_product(row, row);
            let groups = out.chunks_mut(LANES).zip(self.squares.chunks(LANES)).enumerate();
            for (group, (out, squares)) in groups {
                let mut any_near = false;
                let near: [bool; LANES] = std::array::from_fn(|l| {
                    let (Some(out), Some(column)) = (out.get_mut(l), squares.get(l)) else { return false };
                    let scale = square + column;
                    *out = scale - 2.0 * *out;
                    any_near |= *out < NEAR * scale;
                    *out < NEAR * scale
                });
                if any_near {
                    let direct = direct_dispatched(row, self.panel(group));
                    let near = out.iter_mut().zip(direct).zip(near).filter(|(_, near)| *near);
                    near.for_each(|((out, direct), _)| *out = direct);
                }
            }
        }
        distances
    }

    fn panel(&self, group: usize) -> &[[f32; LANES]] {
        &self.values[group * self.length..][..self.length]
    }
}

/// Inner product of two vectors, each product and all sums in `f64`.
///
/// # Panics
/// If the lengths differ.
pub fn inner_product(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len(), "two vectors of one length are needed");
    inner_dispatched(a, b)
}

#[multiversion(targets = "simd")]
fn tile_dispatched(rows: &[&[f32]; ROWS], panel: &[[f32; LANES]], sums: &mut [[f64; LANES]; ROWS]) {
    tile(rows, panel, sums);
}

#[multiversion(targets = "simd")]
fn direct_dispatched(row: &[f32], panel: &[[f32; LANES]]) -> [f64; LANES] {
    direct(row, panel)
}

#[multiversion(targets = "simd")]
fn inner_dispatched(a: &[f32], b: &[f32]) -> f64 {
    inner(a, b)
}

#[inline(always)]
fn tile(rows: &[&[f32]; ROWS], panel: &[[f32; LANES]], sums: &mut [[f64; LANES]; ROWS]) {
    for (span, lanes) in panel.chunks(SPAN).enumerate() {
        let rows = rows.map(|row| &row[span * SPAN..][..lanes.len()]);
        let mut partial = [[0.0f32; LANES]; ROWS];
        for (i, lanes) in lanes.iter().enumerate() {
            for r in 0..ROWS {
                let value = rows[r][i];
                for l in 0..LANES {
                    partial[r][l] += value * lanes[l];
                }
            }
        }
        for r in 0..ROWS {
            for l in 0..LANES {
                sums[r][l] += f64::from(partial[r][l]);
            }
        }
    }
}

/// Squared distances of a row to the columns of a panel.
#[inline(always)]
fn direct(row: &[f32], panel: &[[f32; LANES]]) -> [f64; LANES] {
    let mut sums = [0.0; LANES];
    for (value, lanes) in row.iter().zip(panel) {
        for l in 0..LANES {
            let d = f64::from(*value) - f64::from(lanes[l]);
            sums[l] += d * d;
        }
    }
    sums
}

#[inline(always)]
fn inner(a: &[f32], b: &[f32]) -> f64 {
    let mut sums = [0.0; LANES];
    let (a_rows, a_tail) = a.as_chunks::<LANES>();
    let (b_rows, b_tail) = b.as_chunks::<LANES>();
    for (a, b) in a_rows.iter().zip(b_rows) {
        for l in 0..LANES {
            sums[l] += f64::from(a[l]) * f64::from(b[l]);
        }
    }
    for (sum, (a, b)) in sums.iter_mut().zip(a_tail.iter().zip(b_tail)) {
        *sum += f64::from(*a) * f64::from(*b);
    }
    sums.iter().sum()
}

#[cfg(test)]
#[path = "product_tests.rs"]
mod tests;
