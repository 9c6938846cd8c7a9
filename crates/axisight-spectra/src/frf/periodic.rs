//! `G = Y U^-1` from one period of as many experiments as inputs; Wernholt (2004), (3.52).

use axisight_numerics::SmallSolver;
use nalgebra::Complex;

type C = Complex<f64>;

/// The output motion of the response. Each is computed from the DFT of the position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// Position [rad].
    Position,
    /// Velocity: the position times `i w` [rad/s].
    Velocity,
    /// Acceleration: the position times `(i w)^2` [rad/s^2].
    Acceleration,
}

impl Output {
    /// `(i w)^p` at angular frequency `w` [rad/s].
    pub fn factor(self, w: f64) -> C {
        match self {
            Self::Position => C::new(1.0, 0.0),
            Self::Velocity => C::new(0.0, w),
            Self::Acceleration => C::new(-w * w, 0.0),
        }
    }
}

/// DFT lines of one experiment, row-major `(line, axis)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectra {
    /// Input: commanded torque [Nm].
    pub input: Vec<C>,
    /// Output: motor position, linear drift over the period removed [rad].
    pub output: Vec<C>,
}

/// Responses `(line, output, input)` from one experiment per axis, and the number of singular
/// lines.
///
/// At a singular line the experiments do not excite all inputs, and the response is NaN. `omega`
/// holds the angular frequency of each line [rad/s]. Without experiments there is no response.
pub fn response(experiments: &[Spectra], omega: &[f64], output: Output) -> (Vec<C>, usize) {
    let n = experiments.len();
    let mut solver = SmallSolver::new(n);
    let (mut y, mut u) = (vec![C::default(); n * n], vec![C::default(); n * n]);
    let nan = C::new(f64::NAN, f64::NAN);
    let mut out = vec![nan; omega.len() * n * n];
    let mut singular = 0;
    // Chunks of length zero panic; without experiments there is nothing to cut.
    for ((line, w), g) in omega
        .iter()
        .enumerate()
        .zip(out.chunks_exact_mut((n * n).max(1)))
    {
        let factor = output.factor(*w);
        for (e, spectra) in experiments.iter().enumerate() {
            for axis in 0..n {
                u[axis * n + e] = spectra.input[line * n + axis];
                y[axis * n + e] = spectra.output[line * n + axis] * factor;
            }
        }
        singular += usize::from(!solver.right_divide(&y, &u, g));
    }
    (out, singular)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_experiments_give_no_response() {
        assert_eq!(response(&[], &[1.0, 2.0], Output::Position), (vec![], 0));
    }

    /// An output of twice the input, at its second derivative.
    #[test]
    fn one_axis_is_a_ratio() {
        let (one, two) = (C::new(1.0, 0.5), C::new(2.0, 1.0));
        let experiment = Spectra {
            input: vec![one],
            output: vec![two],
        };
        let (g, singular) = response(&[experiment], &[3.0], Output::Acceleration);
        assert_eq!(singular, 0);
        assert!((g[0] - C::new(-18.0, 0.0)).norm() < 1e-14);
    }
}
