//! Means, covariances, standard errors and quantiles from accumulators.

use axisight_numerics::SmallSolver;
use axisight_spectra::ensemble::{MergeError, Moments, QuantileSketch};
use nalgebra::Complex;

type C = Complex<f64>;

/// Statistics of an ensemble of responses. Every vector covers `(line, output, input)`.
///
/// A value is NaN if there is no response, or if there is only one and the value needs two.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Number of responses.
    pub count: Vec<u64>,
    /// Arithmetic mean, Wernholt (2004), (7.7).
    pub arithmetic_mean: Vec<C>,
    /// Logarithmic mean, with the magnitude (7.8). The phase is that of the mean direction instead
    /// of (7.10), which would depend on where the phase wraps.
    pub log_mean: Vec<C>,
    /// Harmonic mean, the inverse of the mean inverse matrix.
    pub harmonic_mean: Vec<C>,
    /// Sample variance of the real part.
    pub variance_real: Vec<f64>,
    /// Sample variance of the imaginary part.
    pub variance_imag: Vec<f64>,
    /// Sample covariance of real and imaginary part.
    pub covariance: Vec<f64>,
    /// Standard error of the arithmetic mean, `sqrt((var re + var im) / n)`.
    pub standard_error: Vec<f64>,
    /// Standard error of the mean log magnitude [1]; multiply by 8.686 for dB.
    pub log_standard_error: Vec<f64>,
    /// Magnitude quantiles, `(quantile, line, output, input)`.
    pub quantiles: Vec<f64>,
}

/// Accumulators of a study, merged block by block.
#[derive(Debug, Clone)]
pub struct Ensemble {
    n_axes: usize,
    moments: Moments,
    sketch: QuantileSketch,
}

impl Ensemble {
    /// An empty ensemble of `lines` matrices with `n_axes` rows.
    ///
    /// # Errors
    /// [`axisight_spectra::ensemble::SketchError`] if the accuracy is out of range.
    pub fn new(
        lines: usize,
        n_axes: usize,
        relative_accuracy: f64,
    ) -> Result<Self, axisight_spectra::ensemble::SketchError> {
        let size = lines * n_axes * n_axes;
        Ok(Self {
            n_axes,
            moments: Moments::new(size),
            sketch: QuantileSketch::new(size, relative_accuracy)?,
        })
    }

    /// Add the accumulators of a block.
    ///
    /// # Errors
    /// [`MergeError`] if the shapes differ. The ensemble is then unchanged.
    pub fn merge(&mut self, moments: &Moments, sketch: &QuantileSketch) -> Result<(), MergeError> {
        let mut merged = self.moments.clone();
        merged.merge(moments)?;
        self.sketch.merge(sketch)?;
        self.moments = merged;
        Ok(())
    }

    /// The statistics so far.
    pub fn summary(&self, quantiles: &[f64]) -> Summary {
        let m = &self.moments;
        let size = m.size();
        let value = |s: usize, e: usize| m.values[s * size + e];
        // Zero divided by zero is NaN, the value of an element without responses.
        let counted = |e: usize, x: f64| if m.count[e] == 0 { f64::NAN } else { x };
        let complex = |e: usize, re: f64, im: f64| C::new(counted(e, re), counted(e, im));
        let over = |s: usize, e: usize, n: f64| {
            if m.count[e] < 2 {
                f64::NAN
            } else {
                value(s, e) / n
            }
        };
        let all = |f: &dyn Fn(usize) -> f64| (0..size).map(f).collect::<Vec<_>>();
        let n = |e: usize| m.count[e] as f64;
        let sample = |s: usize| all(&|e| over(s, e, n(e) - 1.0));
        let log_mean = |e: usize| {
            let direction = C::new(value(7, e), value(8, e));
            let magnitude = value(5, e).exp();
            let mean = C::from_polar(magnitude, direction.arg());
            complex(e, mean.re, mean.im)
        };
        Summary {
            count: m.count.clone(),
            arithmetic_mean: (0..size)
                .map(|e| complex(e, value(0, e), value(1, e)))
                .collect(),
            log_mean: (0..size).map(log_mean).collect(),
            harmonic_mean: self.harmonic_mean(),
            variance_real: sample(2),
            variance_imag: sample(3),
            covariance: sample(4),
            standard_error: all(&|e| {
                let both = over(2, e, 1.0) + over(3, e, 1.0);
                (both / (n(e) * (n(e) - 1.0))).sqrt()
            }),
            log_standard_error: all(&|e| (over(6, e, 1.0) / (n(e) * (n(e) - 1.0))).sqrt()),
            quantiles: quantiles
                .iter()
                .flat_map(|q| (0..size).map(move |e| self.sketch.quantile(e, *q)))
                .collect(),
        }
    }

    fn harmonic_mean(&self) -> Vec<C> {
        let (m, per_line) = (&self.moments, self.n_axes * self.n_axes);
        let size = m.size();
        let mut out = vec![C::new(f64::NAN, f64::NAN); size];
        let mut solver = SmallSolver::new(self.n_axes);
        for (line, mean) in out.chunks_exact_mut(per_line).enumerate() {
            let elements = line * per_line..(line + 1) * per_line;
            if m.inverse_count[elements.clone()].contains(&0) {
                continue;
            }
            let inverse: Vec<C> = elements
                .map(|e| C::new(m.values[9 * size + e], m.values[10 * size + e]))
                .collect();
            // If the mean is singular, the NaN stays in place.
            let _ = solver.invert(&inverse, mean);
        }
        out
    }
}
