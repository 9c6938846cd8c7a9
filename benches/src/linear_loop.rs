//! The linear closed loop as one writes it first: plain arrays, the standard library's
//! sine and cosine for every harmonic, one run at a time.
//!
//! Same model, same exact propagation, and inside the sample the same order: torque ripple
//! at the start, the middle and the end of the sample, the parabola through them
//! propagated exactly, angles in the middle and at the end predicted with the straight line
//! through value and slope at the start.

use axisight_core::plant::linearize;
use axisight_core::robot::{Controller, EffectSetting, Place, RobotDescription};

const N: usize = 20;
const M: usize = 3;

/// `a cos(n phi) + b sin(n phi)`.
type Term = [f64; 3];

/// Matrices and tables of the robot of [`crate::preset`] with its ripple.
pub struct PlainLoop {
    sample_time: f64,
    phi: [[f64; N]; N],
    /// Torque and its slope to motor angle in the middle of the sample, and the free response.
    middle: [[f64; N + 2 * M]; M],
    /// Torque at start, middle and end of the sample to the state at its end.
    input: [[f64; 3 * M]; N],
    /// Torque and its slope to motor angle at the end.
    end: [[f64; 2 * M]; M],
    angle: [f64; M],
    torque: [f64; M],
    kp: [f64; M],
    ki: [f64; M],
    constant: [[Term; 3]; M],
    proportional: [Term; M],
    resolver: [[Term; 4]; M],
}

impl PlainLoop {
    /// `None` for a robot of another shape.
    pub fn new(robot: &RobotDescription, ripple: &[EffectSetting<f64>]) -> Option<Self> {
        let linear = linearize(robot, &[], &robot.operating_point).ok()?;
        let Controller::PiVelocity { kp, ki } = &robot.controller else {
            return None;
        };
        if linear.a.nrows() != N || linear.b.ncols() != M {
            return None;
        }
        let h = robot.sample_time;
        let (full, half) = (
            moments(&linear.a, &linear.b, h),
            moments(&linear.a, &linear.b, h / 2.0),
        );
        let g = |block: &[Vec<f64>], i: usize, k: usize, j: usize| block[i][N + k * M + j];
        let input = std::array::from_fn(|i| {
            std::array::from_fn(|c| {
                let (node, j) = (c / M, c % M);
                // Lagrange polynomials at 0, 1/2, 1 by their Taylor coefficients.
                let weights = [[1.0, -3.0, 4.0], [0.0, 4.0, -8.0], [0.0, -1.0, 4.0]][node];
                (0..3).map(|k| weights[k] * g(&full, i, k, j)).sum()
            })
        });
        let middle = std::array::from_fn(|i| {
            std::array::from_fn(|c| {
                if c < N {
                    half[i][c]
                } else {
                    half[i][c] * [1.0, 0.5][(c - N) / M]
                }
            })
        });
        let terms = |axis: usize, name: &str| -> Option<Vec<Term>> {
            let mine = |s: &&EffectSetting<f64>| s.place == Place::Axis(axis) && s.name == name;
            let setting = ripple.iter().find(mine)?;
            Some(
                setting
                    .parameters
                    .chunks_exact(3)
                    .map(|t| [t[0], t[1], t[2]])
                    .collect(),
            )
        };
        let mut out = Self {
            sample_time: h,
            phi: std::array::from_fn(|i| std::array::from_fn(|j| full[i][j])),
            middle,
            input,
            end: std::array::from_fn(|i| std::array::from_fn(|c| full[i][N + c])),
            angle: linear.equilibrium.motor_angle.try_into().ok()?,
            torque: linear.equilibrium.motor_torque.try_into().ok()?,
            kp: kp.clone().try_into().ok()?,
            ki: ki.clone().try_into().ok()?,
            constant: [[[0.0; 3]; 3]; M],
            proportional: [[0.0; 3]; M],
            resolver: [[[0.0; 3]; 4]; M],
        };
        for axis in 0..M {
            let (mut constant, resolver) = (
                terms(axis, "torque_ripple")?,
                terms(axis, "resolver_ripple")?,
            );
            out.proportional[axis] = constant.pop()?;
            out.constant[axis].copy_from_slice(constant.first_chunk::<3>()?);
            out.resolver[axis].copy_from_slice(resolver.first_chunk::<4>()?);
        }
        Some(out)
    }

    /// Simulate one run; calls `observe` with command, measurement and state deviation.
    pub fn simulate(
        &self,
        reference: &[f64],
        noise: &[f64],
        mut observe: impl FnMut(&[f64; M], &[f64; M], &[f64; N]),
    ) {
        let mut x = [0.0; N];
        let mut target = self.angle;
        let mut previous: Option<[f64; M]> = None;
        for (w_ref, e) in reference.chunks_exact(M).zip(noise.chunks_exact(M)) {
            let (mut measured, mut u) = ([0.0; M], [0.0; M]);
            for i in 0..M {
                let angle = self.angle[i] + x[i];
                measured[i] =
                    angle + e[i] + self.resolver[i].iter().map(|t| wave(t, angle)).sum::<f64>();
                let speed = previous.map_or(0.0, |p| (measured[i] - p[i]) / self.sample_time);
                u[i] = self.torque[i]
                    + self.kp[i] * (w_ref[i] - speed)
                    + self.ki[i] * (target[i] - measured[i]);
                target[i] += self.sample_time * w_ref[i];
            }
            previous = Some(measured);
            observe(&u, &measured, &x);
            self.advance(&mut x, &u);
        }
    }

    fn advance(&self, x: &mut [f64; N], u: &[f64; M]) {
        let mut start = [0.0; 2 * M];
        for i in 0..M {
            let angle = self.angle[i] + x[i];
            let (value, slope) = self.ripple(i, angle, u[i]);
            start[i] = u[i] - self.torque[i] + value;
            start[M + i] = slope * x[N / 2 + i] * self.sample_time;
        }
        let mut nodes = [0.0; 3 * M];
        nodes[..M].copy_from_slice(&start[..M]);
        let mut next = [0.0; N];
        for (next, row) in next.iter_mut().zip(&self.phi) {
            *next = row.iter().zip(&*x).map(|(a, b)| a * b).sum();
        }
        for i in 0..M {
            let row = &self.middle[i];
            let free: f64 = (0..N).map(|j| row[j] * x[j]).sum();
            let forced: f64 = (0..2 * M).map(|j| row[N + j] * start[j]).sum();
            let at_middle = self.angle[i] + free + forced;
            let at_end = self.angle[i]
                + next[i]
                + (0..2 * M).map(|j| self.end[i][j] * start[j]).sum::<f64>();
            nodes[M + i] = u[i] - self.torque[i] + self.ripple(i, at_middle, u[i]).0;
            nodes[2 * M + i] = u[i] - self.torque[i] + self.ripple(i, at_end, u[i]).0;
        }
        for i in 0..N {
            x[i] = next[i] + (0..3 * M).map(|j| self.input[i][j] * nodes[j]).sum::<f64>();
        }
    }

    fn ripple(&self, axis: usize, angle: f64, u: f64) -> (f64, f64) {
        let (mut value, mut slope) = (0.0, 0.0);
        for (term, factor) in self.constant[axis]
            .iter()
            .map(|t| (t, 1.0))
            .chain([(&self.proportional[axis], u)])
        {
            let (s, c) = (term[0] * angle).sin_cos();
            value += factor * (term[1] * c + term[2] * s);
            slope += factor * term[0] * (term[2] * c - term[1] * s);
        }
        (value, slope)
    }
}

fn wave(term: &Term, angle: f64) -> f64 {
    let (s, c) = (term[0] * angle).sin_cos();
    term[1] * c + term[2] * s
}

/// `[e^{A h}, G_0, G_1, G_2]` with `G_k = int e^{A h (1-s)} B h s^k / k! ds`.
fn moments(a: &Matrix, b: &Matrix, h: f64) -> Vec<Vec<f64>> {
    let mut joint = Matrix::zeros(N + 3 * M, N + 3 * M);
    joint.view_mut((0, 0), (N, N)).copy_from(&(a * h));
    joint.view_mut((0, N), (N, M)).copy_from(&(b * h));
    for i in 0..2 * M {
        joint[(N + i, N + M + i)] = 1.0;
    }
    let e = joint.exp();
    (0..N)
        .map(|i| (0..N + 3 * M).map(|j| e[(i, j)]).collect())
        .collect()
}

type Matrix = nalgebra::DMatrix<f64>;
