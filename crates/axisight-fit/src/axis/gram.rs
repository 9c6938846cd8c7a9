//! Residuals with their derivatives, sample by sample, and the normal equations they sum to.

use super::numbers::LANES;

/// Residuals of one data set and their derivatives.
pub(super) struct Rows {
    /// Residual at each sample.
    pub residual: Vec<f64>,
    /// Derivatives, eight parameters at a time: all samples of the first pass, then the next.
    pub partials: Vec<[f64; LANES]>,
    slots: Vec<usize>,
}

/// Loss, half its gradient, and the Gauss-Newton matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Normal {
    /// `r^T r`.
    pub loss: f64,
    /// `J^T r`.
    pub gradient: Vec<f64>,
    /// `J^T J`, row by row.
    pub matrix: Vec<f64>,
    /// Number of residuals.
    pub count: usize,
}

impl Normal {
    pub(super) fn zero(n: usize) -> Self {
        Self {
            loss: 0.0,
            gradient: vec![0.0; n],
            matrix: vec![0.0; n * n],
            count: 0,
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.loss += other.loss;
        self.count += other.count;
        for (a, b) in self.gradient.iter_mut().zip(&other.gradient) {
            *a += b;
        }
        for (a, b) in self.matrix.iter_mut().zip(&other.matrix) {
            *a += b;
        }
    }
}

impl Rows {
    /// No rows yet, for the free parameters number `slots`, in the memory of earlier ones.
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

    /// Filter by `1 + a_1 q^-1 + ..`; the first samples, whose past is unknown, count nothing.
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

    /// Multiply by the root of a weight.
    pub fn weigh(&mut self, root: f64) {
        self.residual.iter_mut().for_each(|r| *r *= root);
        self.partials
            .as_flattened_mut()
            .iter_mut()
            .for_each(|p| *p *= root);
    }

    /// Derivatives with respect to free parameter number `slot`, zero if it does not act here.
    pub fn append_column(&self, slot: usize, out: &mut Vec<f64>) {
        match self.slots.iter().position(|s| *s == slot) {
            Some(place) => {
                let part = self.pass(place / LANES);
                out.extend(part.iter().map(|p| p[place % LANES]));
            }
            None => out.resize(out.len() + self.residual.len(), 0.0),
        }
    }

    /// Gradients of blocks of about `block` samples over `n` free parameters, one after the other.
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

    /// Normal equations of `n` free parameters.
    pub fn normal(&self, n: usize) -> Normal {
        let mut out = Normal::zero(n);
        out.count = self.residual.len();
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
                        out.matrix[i * n + j] = x;
                        out.matrix[j * n + i] = x;
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
    // Two halves, so that the sums stay in registers.
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
