//! Triangular factors of `[Phi | tau]`, row by row and block by block of samples.
//!
//! The rows of different axes have separate factors. An axis feels only the links beyond it, so
//! this halves the work, and the weights of axes can change without another pass over the data.
//! Blocks of samples also have separate factors; their scatter gives the covariance if residuals
//! are coloured.

use super::evaluate::{LANES, Motion, Regressor};
use super::householder::{Column, EMPTY, PIECE, Triangle};
use super::{RegressorError, check_rows};
use axisight_scalar::Scalar;
use rayon::prelude::*;

/// Input of [`Regressor::factors`].
#[derive(Debug, Clone, Copy)]
pub struct FactorRequest<'a> {
    /// Torque, row-major `(n_samples, n_rows)` [Nm].
    pub torque: &'a [f64],
    /// Weights of residuals, row-major `(n_samples, n_rows)`; all one if absent.
    pub weight: Option<&'a [f64]>,
    /// Columns to keep, increasing.
    pub columns: &'a [usize],
    /// Known values of parameters whose torque is subtracted; zero for all other parameters.
    pub known: &'a [f64],
    /// Number of blocks of samples. Their lengths are as equal as possible.
    pub blocks: usize,
}

/// Upper triangular factors.
#[derive(Debug, Clone, PartialEq)]
pub struct Factors {
    /// Row-major `(n_blocks, n_rows, k + 1, k + 1)` for k columns. The last column is the torque.
    pub factor: Vec<f64>,
    /// Number of samples in each block.
    pub lengths: Vec<usize>,
}

/// One row of the regressor, as requested.
struct Plan {
    /// Pairs of a place among the kept columns and an entry of the row.
    kept: Vec<(usize, usize)>,
    /// Pairs of an entry of the row and a value.
    known: Vec<(usize, f64)>,
}

impl Regressor {
    /// Accumulate the factors. The memory does not grow with the number of samples.
    ///
    /// # Errors
    /// [`RegressorError`] if an array has the wrong size or is not finite, the columns are out of
    /// order or out of range, or the number of blocks is not between 1 and the number of samples.
    pub fn factors(
        &self,
        motion: &Motion<'_>,
        request: &FactorRequest<'_>,
    ) -> Result<Factors, RegressorError> {
        let n_samples = self.check(motion)?;
        self.check_request(request, n_samples)?;
        let plans: Vec<Plan> = (0..self.n_rows()).map(|r| self.plan(r, request)).collect();
        let ends = |b: usize| b * n_samples / request.blocks;
        let ranges: Vec<(usize, usize)> = (0..request.blocks)
            .map(|b| (ends(b), ends(b + 1)))
            .collect();
        let order = request.columns.len() + 1;
        let mut factor = vec![0.0; request.blocks * self.n_rows() * order * order];
        factor
            .par_chunks_mut(self.n_rows() * order * order)
            .zip(&ranges)
            .for_each(|(out, range)| self.block(motion, request, &plans, *range, out));
        Ok(Factors {
            factor,
            lengths: ranges.iter().map(|(from, to)| to - from).collect(),
        })
    }

    fn check_request(
        &self,
        request: &FactorRequest<'_>,
        n_samples: usize,
    ) -> Result<(), RegressorError> {
        check_rows("torque", request.torque, n_samples, self.n_rows())?;
        if let Some(weight) = request.weight {
            check_rows("weight", weight, n_samples, self.n_rows())?;
        }
        let p = self.n_parameters();
        check_rows("known", request.known, 1, p)?;
        let increasing = request.columns.windows(2).all(|pair| pair[0] < pair[1]);
        if !increasing || request.columns.last().is_some_and(|last| *last >= p) {
            let expected = format!("increasing numbers below {p}");
            let got = format!("{:?}", request.columns);
            return Err(RegressorError::new("columns", expected, &got));
        }
        if request.blocks == 0 || request.blocks > n_samples {
            let expected = format!("1 to {n_samples} blocks");
            return Err(RegressorError::new("blocks", expected, &request.blocks));
        }
        Ok(())
    }

    fn plan(&self, row: usize, request: &FactorRequest<'_>) -> Plan {
        let mut plan = Plan {
            kept: Vec::new(),
            known: Vec::new(),
        };
        for (i, entry) in self.rows[row].iter().enumerate() {
            if let Ok(place) = request.columns.binary_search(&entry.column) {
                plan.kept.push((place, i));
            }
            let value = request.known[entry.column];
            if value != 0.0 {
                plan.known.push((i, value));
            }
        }
        plan.kept.sort_unstable();
        plan
    }

    /// Factors of all rows over one range of samples.
    fn block(
        &self,
        motion: &Motion<'_>,
        request: &FactorRequest<'_>,
        plans: &[Plan],
        (from, to): (usize, usize),
        out: &mut [f64],
    ) {
        let n_rows = self.n_rows();
        let mut scratch = self.scratch();
        let mut triangles: Vec<Triangle> = plans
            .iter()
            .map(|plan| Triangle::new(plan.kept.len() + 1))
            .collect();
        let mut pieces: Vec<Vec<Column>> = plans
            .iter()
            .map(|plan| vec![EMPTY; plan.kept.len() + 1])
            .collect();
        for start in (from..to).step_by(PIECE) {
            let end = to.min(start + PIECE);
            for piece in &mut pieces {
                piece.fill(EMPTY);
            }
            for first in (start..end).step_by(LANES) {
                let lanes = LANES.min(end - first);
                self.sweep(&mut scratch, motion, first);
                for (r, (plan, piece)) in plans.iter().zip(&mut pieces).enumerate() {
                    let sample = |x: &[f64], lane: usize| x[(first + lane) * n_rows + r];
                    // The weight is zero in lanes without a sample.
                    let mut weight = [0.0; LANES];
                    for (lane, weight) in weight.iter_mut().enumerate().take(lanes) {
                        *weight = request.weight.map_or(1.0, |weight| sample(weight, lane));
                    }
                    let mut rest = [0.0; LANES];
                    for (lane, rest) in rest.iter_mut().enumerate().take(lanes) {
                        *rest = sample(request.torque, lane);
                    }
                    for (entry, value) in &plan.known {
                        let column = self.rows[r][*entry].value(&scratch);
                        for (lane, rest) in rest.iter_mut().enumerate() {
                            *rest = (-value).mul_add(column.lane(lane), *rest);
                        }
                    }
                    let row = &self.rows[r];
                    let values = plan.kept.iter().map(|(_, i)| row[*i].value(&scratch).0);
                    let at = (first - start) / LANES;
                    for (column, value) in piece.iter_mut().zip(values.chain([rest])) {
                        for lane in 0..LANES {
                            column[at][lane] = value[lane] * weight[lane];
                        }
                    }
                }
            }
            for (triangle, piece) in triangles.iter_mut().zip(&mut pieces) {
                triangle.update(piece);
            }
        }
        spread(plans, &triangles, request.columns.len() + 1, out);
    }
}

/// Copy the triangles of the rows, which hold their own columns only, to their places.
fn spread(plans: &[Plan], triangles: &[Triangle], order: usize, out: &mut [f64]) {
    let blocks = out.chunks_exact_mut(order * order);
    for ((plan, triangle), out) in plans.iter().zip(triangles).zip(blocks) {
        let n = plan.kept.len() + 1;
        let places: Vec<usize> = plan
            .kept
            .iter()
            .map(|(p, _)| *p)
            .chain([order - 1])
            .collect();
        let rows = triangle.factor.chunks_exact(n);
        for (row, out) in rows.zip(out.chunks_exact_mut(order)) {
            for (x, place) in row.iter().zip(&places) {
                out[*place] = *x;
            }
        }
    }
}
