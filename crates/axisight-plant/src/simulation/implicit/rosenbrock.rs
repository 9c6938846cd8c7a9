//! Rosenbrock method RODAS of order 4(3) with six stages (Hairer, Wanner 1996, *Solving
//! Ordinary Differential Equations II*, section IV.7), L-stable and stiffly accurate.
//!
//! A step takes one factorization, six solves and no iteration. The order requires a new Jacobian
//! for every step. The method is cheap if a few digits suffice.

use super::linear::Shifted;
use super::{OneStep, Slopes, Step, Trial};
use crate::simulation::dormand_prince::largest_relative;
use crate::simulation::method::Effort;
use nalgebra::{DMatrix, DVector};

const STAGES: usize = 6;
const GAMMA: f64 = 0.25;
const NODE: [f64; STAGES] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
/// Weights of the change of the torque over the step.
const DRIFT: [f64; STAGES] = [0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0];
const FORWARD: [[f64; 5]; STAGES] = [
    [0.0; 5],
    [1.544, 0.0, 0.0, 0.0, 0.0],
    [0.9466785280815826, 0.2557011698983284, 0.0, 0.0, 0.0],
    [
        3.314825187068521,
        2.896124015972201,
        0.9986419139977817,
        0.0,
        0.0,
    ],
    [
        1.221224509226641,
        6.019134481288629,
        12.53708332932087,
        -0.6878860361058950,
        0.0,
    ],
    [
        1.221224509226641,
        6.019134481288629,
        12.53708332932087,
        -0.6878860361058950,
        1.0,
    ],
];
const COUPLING: [[f64; 5]; STAGES] = [
    [0.0; 5],
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0],
    [
        -0.1073529058151375,
        -9.594562251023355,
        -20.47028614809616,
        0.0,
        0.0,
    ],
    [
        7.496443313967647,
        -10.24680431464352,
        -33.99990352819905,
        11.70890893206160,
        0.0,
    ],
    [
        8.083246795921522,
        -7.981132988064893,
        -31.52159432874371,
        16.31930543123136,
        -6.058818238834054,
    ],
];

pub(super) struct Rosenbrock {
    jacobian: DMatrix<f64>,
    drift: Vec<f64>,
    increments: [DVector<f64>; STAGES],
    probe: Vec<f64>,
    slope: Vec<f64>,
    /// Whether the Jacobian belongs to the present state.
    fresh: bool,
}

impl Rosenbrock {
    pub(super) fn new(n: usize) -> Self {
        Self {
            jacobian: DMatrix::zeros(n, n),
            drift: vec![0.0; n],
            increments: std::array::from_fn(|_| DVector::zeros(n)),
            probe: vec![0.0; n],
            slope: vec![0.0; n],
            fresh: false,
        }
    }

    /// Write `x + sum_j FORWARD[stage][j] u_j` to the probe.
    fn look_ahead(&mut self, x: &[f64], stage: usize) {
        self.probe.copy_from_slice(x);
        for (weight, u) in FORWARD[stage].iter().zip(&self.increments).take(stage) {
            for (p, u) in self.probe.iter_mut().zip(u.iter()) {
                *p += weight * u;
            }
        }
    }
}

impl OneStep for Rosenbrock {
    const ORDER: f64 = 4.0;

    fn attempt(
        &mut self,
        step: &Step<'_>,
        slopes: &mut Slopes,
        x: &mut [f64],
        effort: &mut Effort,
    ) -> Trial {
        // The change of the torque differs from step to step, so compute it each time.
        slopes.jacobian_at(step, x, &mut self.jacobian, &mut self.drift);
        effort.jacobians += 1;
        effort.factorizations += 1;
        self.fresh = true;
        let rate = 1.0 / step.length;
        let system = Shifted::new(&self.jacobian, &(rate / GAMMA));
        for stage in 0..STAGES {
            self.look_ahead(x, stage);
            slopes.evaluate(step, NODE[stage], &self.probe, &mut self.slope);
            effort.evaluations += 1;
            let (done, open) = self.increments.split_at_mut(stage);
            let Some(u) = open.first_mut() else {
                return Trial::NoConvergence;
            };
            for (i, u) in u.iter_mut().enumerate() {
                let coupled: f64 = COUPLING[stage]
                    .iter()
                    .zip(&*done)
                    .map(|(c, d)| c * d[i])
                    .sum();
                *u = self.slope[i] + rate * coupled + DRIFT[stage] * self.drift[i];
            }
            if !system.solve(u) {
                return Trial::NoConvergence;
            }
        }
        // The last increment is both the error estimate and the last correction.
        self.look_ahead(x, STAGES - 1);
        let last = &self.increments[STAGES - 1];
        for (p, u) in self.probe.iter_mut().zip(last.iter()) {
            *p += u;
        }
        let error = largest_relative(last.as_slice(), &self.probe) / step.tolerance;
        if error <= 1.0 {
            x.copy_from_slice(&self.probe);
            self.fresh = false;
        }
        Trial::Error(error)
    }

    fn refresh(&mut self) {}

    fn is_fresh(&self) -> bool {
        self.fresh
    }
}
