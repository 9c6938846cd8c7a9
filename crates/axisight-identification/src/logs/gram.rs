//! Normal equations, separately for each block of data.
//!
//! A block is a section of one axis of one log. With `J^T J`, `J^T r` and `r^T r` of each block,
//! cross-validation, bootstrap and sandwich covariance need no further simulation and no stored
//! residuals.

use axisight_numerics::Weighting;

/// Place of a block in the residual vector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Block {
    /// Index of the log.
    pub record: usize,
    /// Index of the axis. Sensors on the arm, if compared, count as further axes.
    pub axis: usize,
    /// First entry in the residual vector.
    pub start: usize,
    /// Number of entries.
    pub len: usize,
}

/// Normal equations of one block, with the parameters in the order of the fit.
#[derive(Debug, Clone)]
pub struct BlockGram {
    /// The block.
    pub block: Block,
    /// `J^T W J`, row-major.
    pub matrix: Vec<f64>,
    /// `J^T W r`.
    pub gradient: Vec<f64>,
    /// Loss of the block.
    pub loss: f64,
}

/// Blocks of about `block_s` seconds for logs of `lengths` samples, ordered by log, axis and time.
pub(super) fn blocks<'a>(
    lengths: impl Iterator<Item = usize>,
    weighting: impl Iterator<Item = &'a Weighting>,
    sample_time: f64,
    block_s: f64,
) -> Vec<Block> {
    let weighting: Vec<&Weighting> = weighting.collect();
    let mut start = 0;
    let mut out = Vec::new();
    for (record, n_samples) in lengths.enumerate() {
        for (axis, weighting) in weighting.iter().enumerate() {
            let len = weighting.output_len(n_samples);
            let step = sample_time * weighting.decimation as f64;
            // Truncation is acceptable, because block lengths are approximate.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let block_len = (block_s / step) as usize;
            out.extend(cut(record, axis, start, len, block_len));
            start += len;
        }
    }
    out
}

/// Cut `len` entries of one axis of one log into blocks of about `block_len`.
fn cut(record: usize, axis: usize, start: usize, len: usize, block_len: usize) -> Vec<Block> {
    let count = (len / block_len.max(1)).max(1);
    (0..count)
        .map(|i| {
            let (from, to) = (i * len / count, (i + 1) * len / count);
            Block {
                record,
                axis,
                start: start + from,
                len: to - from,
            }
        })
        .collect()
}

impl BlockGram {
    /// Normal equations of `block` from residuals, weights and Jacobian columns.
    pub(super) fn new(
        block: Block,
        residual: &[f64],
        loss: f64,
        weight: &[f64],
        columns: &[&[f64]],
    ) -> Self {
        let range = block.start..block.start + block.len;
        let (r, w) = (&residual[range.clone()], &weight[range.clone()]);
        let n = columns.len();
        let mut matrix = vec![0.0; n * n];
        let mut gradient = vec![0.0; n];
        // Most effects act on one axis and have zero columns in the blocks of other axes.
        let acting: Vec<(usize, &[f64])> = columns
            .iter()
            .map(|c| &c[range.clone()])
            .enumerate()
            .filter(|(_, column)| column.iter().any(|x| *x != 0.0))
            .collect();
        for (slot, (i, column)) in acting.iter().enumerate() {
            let weighted: Vec<f64> = column.iter().zip(w).map(|(x, w)| x * w).collect();
            gradient[*i] = dot(&weighted, r);
            for (j, other) in &acting[..=slot] {
                let entry = dot(&weighted, other);
                matrix[i * n + j] = entry;
                matrix[j * n + i] = entry;
            }
        }
        Self {
            block,
            matrix,
            gradient,
            loss,
        }
    }
}

/// Inner product with eight partial sums, which becomes vector code and has smaller rounding
/// errors.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (chunks_a, chunks_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f64 = chunks_a
        .remainder()
        .iter()
        .zip(chunks_b.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in chunks_a.zip(chunks_b) {
        for i in 0..8 {
            sums[i] = x[i].mul_add(y[i], sums[i]);
        }
    }
    sums.iter().sum::<f64>() + tail
}
