//! D-optimal choice of operating points from candidates.
//!
//! Every candidate gives an information matrix, and the choice maximizes `log det` of their sum.
//!
//! The relaxation to shares of a total is convex (Wernholt and Löfberg 2007; Wernholt and Moberg
//! 2011). The multiplicative algorithm (Silvey, Titterington, Torsney 1978) alternates with vertex
//! exchanges (Böhning 1986). The equivalence theorem of Kiefer and Wolfowitz (1960) bounds the
//! error: `f* - f <= max_i tr(M^-1 M_i) - sum_j w_j tr(M^-1 M_j)`.
//!
//! Exchanges then give whole numbers (Fedorov 1972), which are compared with that upper bound.

use nalgebra::{Cholesky, DMatrix, Dyn};

/// Settings of the choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DesignOptions {
    /// Number of operating points to choose.
    pub count: usize,
    /// Whether a candidate may be chosen several times.
    pub repeats: bool,
    /// Largest accepted error of the relaxation, in units of `log det`.
    pub gap_tolerance: f64,
    /// Largest number of iterations of the relaxation.
    pub max_iterations: usize,
}

/// A choice of operating points.
#[derive(Debug, Clone)]
pub struct Design {
    /// Share of each candidate in the relaxed optimum.
    pub weights: Vec<f64>,
    /// `tr(M^-1 M_i)` at the relaxed optimum, at most the number of parameters.
    pub sensitivity: Vec<f64>,
    /// Bound on the error of the relaxed `log det`.
    pub gap: f64,
    /// Upper bound on `log det` of any choice of `count` candidates.
    pub bound: f64,
    /// Chosen candidates, in ascending order.
    pub chosen: Vec<usize>,
    /// `log det` of the information of the chosen candidates.
    pub log_det: f64,
    /// Number of iterations of the relaxation.
    pub iterations: usize,
}

/// Error: all candidates together leave a combination of parameters unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("candidates: expected operating points that together determine all parameters")]
pub struct DesignError;

/// Choose `count` of the candidates with the information `matrices`, in addition to the `prior`
/// information.
///
/// # Errors
/// [`DesignError`] if the sum of all matrices is singular.
pub fn design(
    matrices: &[DMatrix<f64>],
    prior: &DMatrix<f64>,
    options: DesignOptions,
) -> Result<Design, DesignError> {
    let count = options.count as f64;
    let mut relaxed = Relaxed::new(matrices, prior / count)?;
    let mut iterations = 0;
    while relaxed.gap() > options.gap_tolerance && iterations < options.max_iterations {
        relaxed.multiply()?;
        relaxed.exchange()?;
        iterations += 1;
    }
    let p = prior.nrows() as f64;
    let gap = relaxed.gap().max(0.0);
    let bound = relaxed.log_det() + gap + p * count.ln();
    let (chosen, log_det) = whole(matrices, prior, &relaxed.weights, options)?;
    Ok(Design {
        sensitivity: relaxed.sensitivity(),
        weights: relaxed.weights,
        gap,
        bound,
        chosen,
        log_det,
        iterations,
    })
}

fn log_det(factor: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * factor
        .l_dirty()
        .diagonal()
        .iter()
        .map(|x| x.ln())
        .sum::<f64>()
}

/// `tr(A B)` of symmetric matrices.
fn trace(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    a.iter().zip(b.iter()).map(|(x, y)| x * y).sum()
}

struct Relaxed<'a> {
    matrices: &'a [DMatrix<f64>],
    prior: DMatrix<f64>,
    weights: Vec<f64>,
    factor: Cholesky<f64, Dyn>,
    inverse: DMatrix<f64>,
}

impl<'a> Relaxed<'a> {
    fn new(matrices: &'a [DMatrix<f64>], prior: DMatrix<f64>) -> Result<Self, DesignError> {
        let weights = vec![1.0 / matrices.len() as f64; matrices.len()];
        let factor = factor(matrices, &prior, &weights)?;
        let inverse = factor.inverse();
        Ok(Self {
            matrices,
            prior,
            weights,
            factor,
            inverse,
        })
    }

    fn renew(&mut self) -> Result<(), DesignError> {
        self.factor = factor(self.matrices, &self.prior, &self.weights)?;
        self.inverse = self.factor.inverse();
        Ok(())
    }

    fn log_det(&self) -> f64 {
        log_det(&self.factor)
    }

    fn sensitivity(&self) -> Vec<f64> {
        self.matrices
            .iter()
            .map(|m| trace(&self.inverse, m))
            .collect()
    }

    /// Bound on the error of the relaxed `log det`.
    fn gap(&self) -> f64 {
        let sensitivity = self.sensitivity();
        let mean: f64 = sensitivity
            .iter()
            .zip(&self.weights)
            .map(|(d, w)| d * w)
            .sum();
        sensitivity
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max)
            - mean
    }

    fn multiply(&mut self) -> Result<(), DesignError> {
        let sensitivity = self.sensitivity();
        let mean: f64 = sensitivity
            .iter()
            .zip(&self.weights)
            .map(|(d, w)| d * w)
            .sum();
        for (w, d) in self.weights.iter_mut().zip(&sensitivity) {
            *w *= d / mean;
        }
        self.renew()
    }

    /// Move weight from the least useful candidate in use to the most useful one.
    fn exchange(&mut self) -> Result<(), DesignError> {
        let sensitivity = self.sensitivity();
        let order = |i: &usize, j: &usize| sensitivity[*i].total_cmp(&sensitivity[*j]);
        let used = (0..self.weights.len())
            .filter(|i| self.weights[*i] > 0.0)
            .min_by(order);
        let (Some(from), Some(to)) = (used, (0..self.weights.len()).max_by(order)) else {
            return Ok(());
        };
        if from == to {
            return Ok(());
        }
        let change = &self.matrices[to] - &self.matrices[from];
        let most = self.weights[from];
        let (mut low, mut high) = (0.0, most);
        // The slope falls along the move, so bisection finds its zero.
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            let mut weights = self.weights.clone();
            weights[from] -= middle;
            weights[to] += middle;
            let rising = factor(self.matrices, &self.prior, &weights)
                .is_ok_and(|f| trace(&f.inverse(), &change) > 0.0);
            if rising { low = middle } else { high = middle }
        }
        let step = if high < most { low } else { most };
        let before = (self.weights.clone(), self.log_det());
        self.weights[from] -= step;
        self.weights[to] += step;
        if self.renew().is_err() || self.log_det() < before.1 {
            self.weights = before.0;
            self.renew()?;
        }
        Ok(())
    }
}

fn factor(
    matrices: &[DMatrix<f64>],
    prior: &DMatrix<f64>,
    weights: &[f64],
) -> Result<Cholesky<f64, Dyn>, DesignError> {
    let mut sum = prior.clone();
    for (matrix, weight) in matrices.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
        sum.zip_apply(matrix, |s, m| *s += m * weight);
    }
    sum.cholesky().ok_or(DesignError)
}

/// Whole numbers near `weights`, improved by exchanges of single candidates.
fn whole(
    matrices: &[DMatrix<f64>],
    prior: &DMatrix<f64>,
    weights: &[f64],
    options: DesignOptions,
) -> Result<(Vec<usize>, f64), DesignError> {
    let n = matrices.len();
    let most = if options.repeats { options.count } else { 1 };
    let mut counts = vec![0_usize; n];
    for _ in 0..options.count {
        // The next candidate is the one furthest below its share.
        let behind = |i: &usize| weights[*i] * options.count as f64 - counts[*i] as f64;
        let open = (0..n).filter(|i| counts[*i] < most);
        if let Some(next) = open.max_by(|i, j| behind(i).total_cmp(&behind(j))) {
            counts[next] += 1;
        }
    }
    let value = |counts: &[usize]| {
        let weights: Vec<f64> = counts.iter().map(|c| *c as f64).collect();
        factor(matrices, prior, &weights).map_or(f64::NEG_INFINITY, |f| log_det(&f))
    };
    let mut best = value(&counts);
    loop {
        let mut found = None;
        for from in (0..n).filter(|i| counts[*i] > 0) {
            for to in (0..n).filter(|i| *i != from && counts[*i] < most) {
                let mut trial = counts.clone();
                trial[from] -= 1;
                trial[to] += 1;
                let result = value(&trial);
                if result > best + 1e-12 * best.abs().max(1.0)
                    || best == f64::NEG_INFINITY && result > best
                {
                    best = result;
                    found = Some(trial);
                }
            }
        }
        match found {
            Some(better) => counts = better,
            None => break,
        }
    }
    if best == f64::NEG_INFINITY {
        return Err(DesignError);
    }
    let chosen = counts
        .iter()
        .enumerate()
        .flat_map(|(i, c)| std::iter::repeat_n(i, *c));
    Ok((chosen.collect(), best))
}
