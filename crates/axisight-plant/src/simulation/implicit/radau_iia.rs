//! Radau IIA method of three stages and order 5 (Hairer, Wanner 1996, *Solving Ordinary
//! Differential Equations II*, sections IV.5 and IV.8), L-stable and stiffly accurate.
//!
//! The stage equations are decoupled by the eigenvectors of the inverse Runge-Kutta matrix
//! into one real and one complex system of the size of the plant, and solved by simplified
//! Newton iterations.

use super::linear::Shifted;
use super::{OneStep, Slopes, Step, Trial};
use crate::simulation::dormand_prince::{SMALLEST_STATE, largest_relative};
use crate::simulation::method::Effort;
use nalgebra::{Complex, DMatrix, DVector};

const ROOT_6: f64 = 2.449_489_742_783_178;
const NODE: [f64; 3] = [(4.0 - ROOT_6) / 10.0, (4.0 + ROOT_6) / 10.0, 1.0];

// Eigenvalues of the inverse Runge-Kutta matrix, and its real eigenvectors: columns belong to
// the real eigenvalue, and to the real and imaginary part of the complex one.
const REAL: f64 = 3.637_834_252_744_495_7;
const COMPLEX: Complex<f64> = Complex::new(2.681_082_873_627_752, -3.050_430_199_247_410_6);
const FROM_MODES: [[f64; 3]; 3] = [
    [
        0.094_438_762_488_975_24,
        -0.141_255_295_020_954_2,
        0.030_029_194_105_147_424,
    ],
    [
        0.250_213_122_965_333_3,
        0.204_129_352_293_799_93,
        -0.382_942_112_757_261_94,
    ],
    [1.0, 1.0, 0.0],
];
const TO_MODES: [[f64; 3]; 3] = [
    [
        4.178_718_591_551_905,
        0.327_682_820_761_062_4,
        0.523_376_445_499_449_5,
    ],
    [
        -4.178_718_591_551_905,
        -0.327_682_820_761_062_4,
        0.476_623_554_500_550_5,
    ],
    [
        0.502_872_634_945_786_9,
        -2.571_926_949_855_605,
        0.596_039_204_828_224_9,
    ],
];

/// Weights of the embedded error estimate of order 3.
const ERROR: [f64; 3] = [
    (-13.0 - 7.0 * ROOT_6) / 3.0,
    (-13.0 + 7.0 * ROOT_6) / 3.0,
    -1.0 / 3.0,
];

const MOST_ITERATIONS: usize = 8;

/// Factorized systems for one step length.
struct Factors {
    length: f64,
    real: Shifted<f64>,
    complex: Shifted<Complex<f64>>,
}

pub(super) struct RadauIia {
    n: usize,
    jacobian: Option<DMatrix<f64>>,
    fresh: bool,
    factors: Option<Factors>,
    /// Changes of the stages from the start of the step, and their mode coordinates.
    stages: [Vec<f64>; 3],
    modes: [Vec<f64>; 3],
    slopes: [Vec<f64>; 3],
    start_slope: Vec<f64>,
    probe: Vec<f64>,
    real: DVector<f64>,
    complex: DVector<Complex<f64>>,
}

impl RadauIia {
    pub(super) fn new(n: usize) -> Self {
        let zeros = || std::array::from_fn(|_| vec![0.0; n]);
        Self {
            n,
            jacobian: None,
            fresh: false,
            factors: None,
            stages: zeros(),
            modes: zeros(),
            slopes: zeros(),
            start_slope: vec![0.0; n],
            probe: vec![0.0; n],
            real: DVector::zeros(n),
            complex: DVector::zeros(n),
        }
    }

    fn factorize(&mut self, step: &Step<'_>, slopes: &mut Slopes, x: &[f64], effort: &mut Effort) {
        let jacobian = self.jacobian.get_or_insert_with(|| {
            let mut jacobian = DMatrix::zeros(self.n, self.n);
            slopes.jacobian_at(step, x, &mut jacobian, &mut self.probe);
            effort.jacobians += 1;
            self.fresh = true;
            jacobian
        });
        let known = self.factors.as_ref().map(|f| f.length);
        // Equal lengths of consecutive steps differ by the rounding of the sample fractions.
        if known.is_none_or(|length| (length / step.length - 1.0).abs() > 1e-9) {
            let rate = 1.0 / step.length;
            self.factors = Some(Factors {
                length: step.length,
                real: Shifted::new(jacobian, &(REAL * rate)),
                complex: Shifted::new(jacobian, &(COMPLEX * rate)),
            });
            effort.factorizations += 2;
        }
    }

    /// Simplified Newton iteration. Returns true if it converges.
    fn iterate(
        &mut self,
        step: &Step<'_>,
        slopes: &mut Slopes,
        x: &[f64],
        effort: &mut Effort,
    ) -> bool {
        for z in self.stages.iter_mut().chain(&mut self.modes) {
            z.fill(0.0);
        }
        let mut last: Option<f64> = None;
        for iteration in 0..MOST_ITERATIONS {
            for k in 0..3 {
                for i in 0..self.n {
                    self.probe[i] = x[i] + self.stages[k][i];
                }
                slopes.evaluate(step, NODE[k], &self.probe, &mut self.slopes[k]);
                effort.evaluations += 1;
            }
            let Some(change) = self.newton_step(step, x) else {
                return false;
            };
            if !change.is_finite() {
                return false;
            }
            // Estimate the rate from this step alone: after a corner of the plant, the rate of the
            // last step is meaningless, and one iteration with the old Jacobian may have a large
            // error.
            if let Some(last) = last {
                let rate = change / last;
                if rate >= 1.0 {
                    return false;
                }
                let remains = rate / (1.0 - rate) * change;
                if remains <= 1.0 {
                    return true;
                }
                // The iterations that are left cannot reach the tolerance.
                let left = i32::try_from(MOST_ITERATIONS - 1 - iteration).unwrap_or(0);
                if remains * rate.powi(left) > 1.0 {
                    return false;
                }
            }
            if change <= 1e-3 {
                return true;
            }
            last = Some(change);
        }
        false
    }

    /// One Newton update. Returns its size in units of the iteration's tolerance.
    fn newton_step(&mut self, step: &Step<'_>, x: &[f64]) -> Option<f64> {
        let factors = self.factors.as_ref()?;
        let rate = 1.0 / step.length;
        for i in 0..self.n {
            let f = |row: usize| {
                (0..3)
                    .map(|k| TO_MODES[row][k] * self.slopes[k][i])
                    .sum::<f64>()
            };
            self.real[i] = f(0) - REAL * rate * self.modes[0][i];
            let mode = Complex::new(self.modes[1][i], self.modes[2][i]);
            self.complex[i] = Complex::new(f(1), f(2)) - COMPLEX * rate * mode;
        }
        if !(factors.real.solve(&mut self.real) && factors.complex.solve(&mut self.complex)) {
            return None;
        }
        let mut size: f64 = 0.0;
        for i in 0..self.n {
            self.modes[0][i] += self.real[i];
            self.modes[1][i] += self.complex[i].re;
            self.modes[2][i] += self.complex[i].im;
            for k in 0..3 {
                let z: f64 = (0..3).map(|m| FROM_MODES[k][m] * self.modes[m][i]).sum();
                let scale = step.iteration_tolerance * x[i].abs().max(SMALLEST_STATE);
                let change = (z - self.stages[k][i]).abs() / scale;
                size = if change.is_nan() {
                    change
                } else {
                    size.max(change)
                };
                self.stages[k][i] = z;
                if size.is_nan() {
                    return Some(size);
                }
            }
        }
        Some(size)
    }

    /// Local error in units of the tolerance. A filter with the real system keeps it bounded for
    /// stiff parts.
    fn error(
        &mut self,
        step: &Step<'_>,
        slopes: &mut Slopes,
        x: &[f64],
        effort: &mut Effort,
    ) -> f64 {
        let rate = 1.0 / step.length;
        let Some(factors) = &self.factors else {
            return f64::NAN;
        };
        let estimate = |i: usize| (0..3).map(|k| ERROR[k] * self.stages[k][i]).sum::<f64>() * rate;
        let mut slope = &self.start_slope;
        let mut error = f64::INFINITY;
        for again in [false, true] {
            if again {
                // The first estimate is pessimistic for stiff parts, so estimate again at the
                // corrected state.
                for i in 0..self.n {
                    self.probe[i] = x[i] + self.real[i];
                }
                slopes.evaluate(step, 0.0, &self.probe, &mut self.slopes[0]);
                effort.evaluations += 1;
                slope = &self.slopes[0];
            }
            for i in 0..self.n {
                self.real[i] = slope[i] + estimate(i);
            }
            if !factors.real.solve(&mut self.real) {
                return f64::NAN;
            }
            error = largest_relative(self.real.as_slice(), x) / step.tolerance;
            if error <= 1.0 {
                return error;
            }
        }
        error
    }
}

impl OneStep for RadauIia {
    const ORDER: f64 = 4.0;

    fn attempt(
        &mut self,
        step: &Step<'_>,
        slopes: &mut Slopes,
        x: &mut [f64],
        effort: &mut Effort,
    ) -> Trial {
        self.factorize(step, slopes, x, effort);
        slopes.evaluate(step, 0.0, x, &mut self.start_slope);
        effort.evaluations += 1;
        if !self.iterate(step, slopes, x, effort) {
            return Trial::NoConvergence;
        }
        let error = self.error(step, slopes, x, effort);
        if error <= 1.0 {
            for (x, z) in x.iter_mut().zip(&self.stages[2]) {
                *x += z;
            }
            self.fresh = false;
        }
        Trial::Error(error)
    }

    fn refresh(&mut self) {
        if !self.fresh {
            self.jacobian = None;
            self.factors = None;
        }
    }

    fn is_fresh(&self) -> bool {
        self.fresh
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The constants diagonalize the inverse of the Radau IIA matrix.
    #[test]
    fn modes_belong_to_the_method() {
        let r = ROOT_6;
        let a = nalgebra::Matrix3::new(
            (88.0 - 7.0 * r) / 360.0,
            (296.0 - 169.0 * r) / 1800.0,
            (-2.0 + 3.0 * r) / 225.0,
            (296.0 + 169.0 * r) / 1800.0,
            (88.0 + 7.0 * r) / 360.0,
            (-2.0 - 3.0 * r) / 225.0,
            (16.0 - r) / 36.0,
            (16.0 + r) / 36.0,
            1.0 / 9.0,
        );
        let matrix = |m: [[f64; 3]; 3]| nalgebra::Matrix3::from_fn(|i, j| m[i][j]);
        let (to, from) = (matrix(TO_MODES), matrix(FROM_MODES));
        let inverse = a.try_inverse().expect("regular");
        let got = to * inverse * from;
        let (re, im) = (COMPLEX.re, COMPLEX.im);
        let want = nalgebra::Matrix3::new(REAL, 0.0, 0.0, 0.0, re, -im, 0.0, im, re);
        assert!((to * from - nalgebra::Matrix3::identity()).amax() < 1e-14);
        assert!((got - want).amax() < 1e-13, "{got}");
    }
}
