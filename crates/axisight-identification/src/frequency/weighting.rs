//! Criteria (3.42) to (3.44): the compared quantity, and the weight of a deviation.

use super::error::FrequencyFitError;
use crate::logs::OwnValue;
use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// The compared quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// `G(theta) - G`, see (3.42) and (3.43).
    Linear,
    /// `log(G(theta) / G)`: log magnitude and phase, see (3.44).
    Logarithmic,
}

/// What is known about the error of a measured response.
#[derive(Debug, Clone)]
pub enum Uncertainty {
    /// Nothing.
    Unknown,
    /// `E|dG|^2` of every element, in the order of the response. An infinite variance leaves the
    /// element out.
    Variance(Vec<f64>),
    /// `E|dG|^2` from few realizations. Each element is weighted by another variance, which does
    /// not depend on its own estimate.
    Pooled {
        /// Estimated `E|dG|^2`, from which the covariance of the parameters is computed.
        stated: Vec<f64>,
        /// Variance for the weights.
        weighing: Vec<f64>,
    },
    /// Covariance of the elements of each line, `(line, elements, elements)`, Hermitian.
    Covariance(Vec<C>),
}

/// A measured response at one operating point.
#[derive(Debug, Clone)]
pub struct PoseResponse {
    /// Angles of the driven joints [rad; m if prismatic].
    pub joint_angle: Vec<f64>,
    /// Frequencies of the lines [Hz].
    pub frequency_hz: Vec<f64>,
    /// Measured response, `(line, output, input)`.
    pub response: Vec<C>,
    /// Error of the response.
    pub uncertainty: Uncertainty,
    /// Reference of the relative error of a logarithm; `None` for the response itself. Weights by
    /// the measured magnitude favour lines where the error increases it, while weights by a model's
    /// response do not.
    pub reference: Option<Vec<C>>,
    /// Derivative of the motor angle that is the output: 0, 1 or 2.
    pub order: u8,
    /// Effect parameters whose values hold at this operating point only, such as its load.
    pub own: Vec<OwnValue>,
}

/// Factors that turn deviations of a line into residuals of unit variance.
pub(super) enum Whitening {
    /// One factor for every element.
    Elements(Vec<f64>),
    /// One lower triangular matrix for every line.
    Lines(Vec<DMatrix<C>>),
}

/// The whitening of a response, and the variance of real and imaginary part of each residual due to
/// the uncertainty (`None` if unknown).
pub(super) fn whitening(
    pose: &PoseResponse,
    criterion: Criterion,
    weighted: bool,
    number: usize,
) -> Result<(Whitening, Option<Vec<f64>>), FrequencyFitError> {
    let reference = pose.reference.as_ref().unwrap_or(&pose.response);
    let size = |k: usize| match criterion {
        Criterion::Linear => C::new(1.0, 0.0),
        Criterion::Logarithmic => reference[k],
    };
    let relative = |k: usize| size(k).norm();
    let variance = diagonal(pose);
    let known = |k: usize| variance.as_ref().map_or(1.0, |v| v[k]);
    if !weighted {
        let used = |k| f64::from(u8::from(known(k) < f64::INFINITY));
        let factor = (0..pose.response.len()).map(used).collect();
        let left = variance.as_ref().map(|v| {
            let half = |(k, v): (usize, &f64)| 0.5 * v / relative(k).powi(2);
            v.iter()
                .enumerate()
                .map(half)
                .map(|x| if x.is_finite() { x } else { 0.0 })
                .collect()
        });
        return Ok((Whitening::Elements(factor), left));
    }
    match &pose.uncertainty {
        Uncertainty::Unknown => Err(FrequencyFitError::NoVariance { pose: number + 1 }),
        Uncertainty::Variance(v) => {
            let factor = |(k, v): (usize, &f64)| relative(k) * (2.0 / v).sqrt();
            let factors = v.iter().enumerate().map(factor).collect();
            Ok((Whitening::Elements(factors), Some(vec![1.0; v.len()])))
        }
        Uncertainty::Pooled { stated, weighing } => {
            let factor = |(k, v): (usize, &f64)| relative(k) * (2.0 / v).sqrt();
            let factors = weighing.iter().enumerate().map(factor).collect();
            let left = |(v, w): (&f64, &f64)| if w.is_finite() { v / w } else { 0.0 };
            let left = stated.iter().zip(weighing).map(left).collect();
            Ok((Whitening::Elements(factors), Some(left)))
        }
        Uncertainty::Covariance(all) => {
            let n = pose.response.len() / pose.frequency_hz.len().max(1);
            let line = |line: usize| {
                let block = &all[line * n * n..(line + 1) * n * n];
                let own = |i: usize| size(line * n + i);
                let matrix = DMatrix::from_fn(n, n, |i, j| {
                    block[i * n + j] * 0.5 / (own(i) * own(j).conj())
                });
                inverse_factor(matrix).ok_or(FrequencyFitError::Covariance {
                    pose: number + 1,
                    line: line + 1,
                })
            };
            let lines = (0..pose.frequency_hz.len())
                .map(line)
                .collect::<Result<_, _>>()?;
            Ok((
                Whitening::Lines(lines),
                Some(vec![1.0; pose.response.len()]),
            ))
        }
    }
}

/// The inverse of the Cholesky factor `L` of a matrix `L L^H`; `None` if the matrix is not positive
/// definite.
fn inverse_factor(matrix: DMatrix<C>) -> Option<DMatrix<C>> {
    let n = matrix.nrows();
    let lower = matrix.cholesky()?.l();
    // The complex square root of a negative pivot is imaginary, so check for it.
    if (0..n).any(|i| !(lower[(i, i)].re > 0.0 && lower[(i, i)].im.abs() < lower[(i, i)].re)) {
        return None;
    }
    let inverse = lower.solve_lower_triangular(&DMatrix::identity(n, n))?;
    inverse
        .iter()
        .all(|x| x.re.is_finite() && x.im.is_finite())
        .then_some(inverse)
}

fn diagonal(pose: &PoseResponse) -> Option<Vec<f64>> {
    match &pose.uncertainty {
        Uncertainty::Unknown => None,
        Uncertainty::Variance(v) | Uncertainty::Pooled { stated: v, .. } => Some(v.clone()),
        Uncertainty::Covariance(all) => {
            let n = pose.response.len() / pose.frequency_hz.len().max(1);
            let entry = |k: usize| all[(k / n) * n * n + (k % n) * (n + 1)].re;
            Some((0..pose.response.len()).map(entry).collect())
        }
    }
}
