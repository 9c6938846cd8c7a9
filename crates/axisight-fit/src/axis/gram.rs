//! Residuals with their derivatives, sample by sample, and their normal equations.

use super::numbers::LANES;
use axisight_numerics::descent::Normal;

/// Residuals of one data set, with their derivatives.
pub(super) struct Rows {
    /// Residual at each sample.
    pub residual: Vec<f64>,
    /// Derivatives in passes of eight parameters: all samples of the first pass, then of the next.
    pub partials: Vec<[f64; LANES]>,
    slots: Vec<usize>,
}

impl Rows {
    /// Empty rows for the free parameters with the numbers `slots`. Reuses `memory` if there is
    /// any.
    pub fn new(slots: Vec<usize>, samples: usize, memory: Option<Self>) -> Self {
        let (mut residual, mut partials) = memory.map_or_else(
            || {
                let passes = slots.len().div_ceil(LANES).max(1);
                (
                    Vec::with_capacity(samples),
                    Vec::with_capacity(samples * passes),
                )
            },
            |m| (m.residual, m.partials),
        );
        residual.clear();
        partials.clear();
        Self {
            residual,
            partials,
            slots,
        }
    }

    fn pass(&self, pass: usize) -> &[[f64; LANES]] {
        let n = self.residual.len();
        self.partials.get(pass * n..(pass + 1) * n).unwrap_or(&[])
    }

    /// Filter by `1 + a_1 q^-1 + ..`. The first samples become zero, because their past is unknown.
    pub fn whiten(&mut self, coefficients: &[f64]) {
        if coefficients.is_empty() {
            return;
        }
        let (n, order) = (self.residual.len(), coefficients.len());
        for part in self.partials.chunks_mut(n) {
            for k in (0..n).rev() {
                let mut sum = part[k];
                for (i, a) in coefficients.iter().enumerate().take(k) {
                    let past = part[k - 1 - i];
                    for (s, p) in sum.iter_mut().zip(past) {
                        *s = a.mul_add(p, *s);
                    }
                }
                part[k] = if k < order { [0.0; LANES] } else { sum };
            }
        }
        for k in (0..n).rev() {
            let past = coefficients.iter().enumerate().take(k);
            let sum: f64 = past.map(|(i, a)| a * self.residual[k - 1 - i]).sum();
            self.residual[k] = if k < order {
                0.0
            } else {
                self.residual[k] + sum
            };
        }
    }

    /// Multiply all rows by the square root of a weight.
    pub fn weigh(&mut self, root: f64) {
        self.residual.iter_mut().for_each(|r| *r *= root);
        self.partials
            .as_flattened_mut()
            .iter_mut()
            .for_each(|p| *p *= root);
    }

    /// Append the derivatives with respect to free parameter `slot`; zeros if it does not act here.
    pub fn append_column(&self, slot: usize, out: &mut Vec<f64>) {
        match self.slots.iter().position(|s| *s == slot) {
            Some(place) => {
                let part = self.pass(place / LANES);
                out.extend(part.iter().map(|p| p[place % LANES]));
            }
            None => out.resize(out.len() + self.residual.len(), 0.0),
        }
    }

    /// Gradients of blocks of about `block` samples over `n` free parameters, block by block.
    pub fn block_gradients(&self, block: usize, n: usize) -> Vec<f64> {
        let len = self.residual.len();
        let count = (len / block.max(1)).max(1);
        let mut out = vec![0.0; count * n];
        for (i, gradient) in out.chunks_mut(n.max(1)).enumerate() {
            let range = i * len / count..(i + 1) * len / count;
            for (pass, slots) in self.slots.chunks(LANES).enumerate() {
                let part = self.pass(pass).get(range.clone()).unwrap_or(&[]);
                let sum = weighted_sum(part, &self.residual[range.clone()]);
                for (slot, g) in slots.iter().zip(sum) {
                    gradient[*slot] = g;
                }
            }
        }
        out
    }

    /// Normal equations over `n` free parameters.
    pub fn normal(&self, n: usize) -> Normal {
        let mut out = Normal::zero(n);
        out.loss = self.residual.iter().map(|r| r * r).sum();
        let passes = self.slots.len().div_ceil(LANES);
        for a in 0..passes {
            let gradient = weighted_sum(self.pass(a), &self.residual);
            for (i, g) in self.slots.iter().skip(a * LANES).zip(gradient) {
                out.gradient[*i] = g;
            }
            for b in 0..=a {
                let products = products(self.pass(a), self.pass(b));
                for (i, row) in self.slots.iter().skip(a * LANES).zip(products) {
                    for (j, x) in self.slots.iter().skip(b * LANES).zip(row) {
                        out.matrix[(*i, *j)] = x;
                        out.matrix[(*j, *i)] = x;
                    }
                }
            }
        }
        out
    }
}

fn weighted_sum(part: &[[f64; LANES]], weight: &[f64]) -> [f64; LANES] {
    let mut sum = [0.0; LANES];
    for (p, w) in part.iter().zip(weight) {
        for i in 0..LANES {
            sum[i] = p[i].mul_add(*w, sum[i]);
        }
    }
    sum
}

/// Sum of the outer products of rows.
fn products(a: &[[f64; LANES]], b: &[[f64; LANES]]) -> [[f64; LANES]; LANES] {
    let mut sum = [[0.0; LANES]; LANES];
    // Two halves keep the sums in registers.
    for half in 0..2 {
        let mut part = [[0.0; LANES]; LANES / 2];
        for (x, y) in a.iter().zip(b) {
            for i in 0..LANES / 2 {
                for j in 0..LANES {
                    part[i][j] = x[half * (LANES / 2) + i].mul_add(y[j], part[i][j]);
                }
            }
        }
        sum[half * (LANES / 2)..(half + 1) * (LANES / 2)].copy_from_slice(&part);
    }
    sum
}
