//! Products of a small constant matrix with vectors of lanes.

use axisight_scalar::Scalar;
use nalgebra::DMatrix;

/// Rows computed together. Eight independent sums of two-register lanes cover the latency of a
/// fused multiply-add, and fit the register file with the broadcast entries.
///
/// Registers of 512 bits are not faster, because latency, not width, limits the chain of harmonics.
const ROWS: usize = 4;

/// A matrix in tiles of [`ROWS`] rows. Each tile is stored column by column, and rows are padded
/// with zeros.
#[derive(Debug, Clone)]
pub(super) struct Tiles {
    columns: usize,
    data: Vec<[f64; ROWS]>,
}

impl Tiles {
    pub(super) fn new(matrix: &DMatrix<f64>) -> Self {
        let (rows, columns) = matrix.shape();
        let mut data = Vec::with_capacity(Self::padded(rows) / ROWS * columns);
        for first in (0..rows).step_by(ROWS) {
            for j in 0..columns {
                let entry = |r: usize| if r < rows { matrix[(r, j)] } else { 0.0 };
                data.push(std::array::from_fn(|r| entry(first + r)));
            }
        }
        Self { columns, data }
    }

    /// Length of an output of `rows` rows.
    pub(super) fn padded(rows: usize) -> usize {
        rows.next_multiple_of(ROWS)
    }

    /// Fused multiply-adds of one product, padding included.
    pub(super) fn operations(&self) -> usize {
        self.data.len() * ROWS
    }

    /// Compute `out = base + M x`, with zero for a missing `base`. Both `out` and `base` are
    /// padded.
    #[inline(always)]
    pub(super) fn multiply<S: Scalar>(&self, x: &[S], base: Option<&[S]>, out: &mut [S]) {
        let tiles = self.data.chunks_exact(self.columns);
        for (i, (tile, out)) in tiles.zip(out.chunks_exact_mut(ROWS)).enumerate() {
            let mut sum = [S::zero(); ROWS];
            if let Some(base) = base.and_then(|b| b.get(i * ROWS..(i + 1) * ROWS)) {
                sum.copy_from_slice(base);
            }
            for (column, value) in tile.iter().zip(x) {
                for r in 0..ROWS {
                    sum[r] = S::constant(column[r]).fma(*value, sum[r]);
                }
            }
            out.copy_from_slice(&sum);
        }
    }
}
