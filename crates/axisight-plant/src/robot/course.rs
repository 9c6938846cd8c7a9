//! Equations of motion of the arm, linearised about a run.
//!
//! Let `q0, v0, a0` be the angles, rates and accelerations of the run, and `h = M(q) a0 + c(q, v)`.
//! Then `M(q0) q'' = F - [c(q0, v0) + p + B_q (q - q0) + B_v (v - v0)]`. `B_q` and `B_v` are the
//! derivatives of `h` on the run. `p` are the additional forces that an arm of other masses needs
//! on the run. The neglected terms are of second order in the distance from the run and in the
//! change of the masses. Everything but the arm (motors, gears, effects) stays nonlinear.
//!
//! For `n` joints an evaluation takes `n^2` multiplications, and `2 n^2` more once a sample, all by
//! numbers without derivatives. The full equations take about `30 n^2` multiplications of numbers
//! with derivatives.

use super::along::{Along, Course, FORCING_STRIDE};
use super::chain::Chain;
use super::dynamics::Dynamics;
use axisight_scalar::{Dual, Scalar};
use std::sync::Arc;

/// Longest time over which the matrices are interpolated linearly [s].
const LONGEST_STRIDE_S: f64 = 8e-3;
/// Number of derivatives per evaluation.
const SEEDS: usize = 4;

impl<R: Scalar> Course<R> {
    /// A course for the arm `chain`; `states` holds the joint angles and rates of each sample.
    pub fn new(chain: &Chain<R>, sample_time: f64, states: &[R]) -> Self {
        let n = chain.len();
        let dynamics = Dynamics::new(chain);
        let samples = states.len() / (2 * n).max(1);
        let mut motion = Vec::with_capacity(3 * n * samples);
        let mut scratch = dynamics.scratch();
        for state in states.chunks_exact((2 * n).max(1)) {
            let (q, v) = state.split_at(n);
            dynamics.place(q, &mut scratch);
            dynamics.add_rates(v, &mut scratch);
            motion.extend_from_slice(state);
            motion.extend_from_slice(&scratch.forces()[..n]);
        }
        // A stride is a small positive number of samples.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let stride = ((LONGEST_STRIDE_S / sample_time) as usize).max(1);
        let mut course = Self {
            chain: chain.clone(),
            sample_time,
            samples,
            motion,
            stride,
            nodes: Vec::new(),
        };
        course.linearize(&dynamics);
        course
    }

    /// Accelerations at a sample, from the rates of its neighbours.
    fn acceleration(&self, sample: usize) -> Vec<R> {
        let (before, after) = (sample.saturating_sub(1), (sample + 1).min(self.samples - 1));
        let time = (after - before).max(1) as f64 * self.sample_time;
        let rates = self.part(after, 1).iter().zip(self.part(before, 1));
        rates.map(|(b, a)| (*b - *a) * (1.0 / time)).collect()
    }

    fn linearize(&mut self, dynamics: &Dynamics<R>) {
        if self.samples == 0 {
            return;
        }
        let n = self.joints();
        let lifted = Dynamics::new(&self.chain.lifted::<Dual<R, SEEDS>>());
        let (mut plain, mut dual) = (dynamics.scratch(), lifted.scratch());
        let mut force = vec![Dual::<R, SEEDS>::zero(); n];
        // One node after the last sample, for the interpolation up to it.
        for node in 0..=self.samples.div_ceil(self.stride) {
            let sample = (node * self.stride).min(self.samples - 1);
            let (q, v) = (self.part(sample, 0), self.part(sample, 1));
            let a = self.acceleration(sample);
            let mut matrices = vec![R::zero(); 3 * n * n];
            let (inverse, derivatives) = matrices.split_at_mut(n * n);
            dynamics.place(q, &mut plain);
            dynamics.factorize(&mut plain);
            for j in 0..n {
                plain.forces().fill(R::zero());
                plain.forces()[j] = R::one();
                dynamics.solve(&mut plain);
                for i in 0..n {
                    inverse[i * n + j] = plain.forces()[i];
                }
            }
            // Seeds along the angles, then along the rates.
            for first in (0..2 * n).step_by(SEEDS) {
                let seeded = |offset: usize, x: &[R]| -> Vec<Dual<R, SEEDS>> {
                    let seed = |(i, x): (usize, &R)| {
                        let x = Dual::from_real(*x);
                        match (offset + i).checked_sub(first) {
                            Some(seed) if seed < SEEDS => x.seeded(seed),
                            _ => x,
                        }
                    };
                    x.iter().enumerate().map(seed).collect()
                };
                let (q, v, a) = (seeded(0, q), seeded(n, v), seeded(2 * n + SEEDS, &a));
                lifted.forces_along(&q, &v, &a, &mut dual, &mut force);
                for column in first..(first + SEEDS).min(2 * n) {
                    let (matrix, j) = (column / n, column % n);
                    for (i, force) in force.iter().enumerate() {
                        derivatives[(matrix * n + i) * n + j] = force.partials[column - first];
                    }
                }
            }
            self.nodes.extend_from_slice(&matrices);
        }
    }

    /// Forces that `chain` needs on the run, minus those of the run's own arm, node by node. `None`
    /// for the same arm or an empty run.
    fn forcing<S: Scalar<Real = R>>(&self, chain: &Chain<S>) -> Option<Vec<S>> {
        let same = !chain.carries_derivatives() && chain.same_masses(&self.chain);
        if same || self.samples == 0 {
            return None;
        }
        let n = self.joints();
        let (own, other) = (Dynamics::new(&self.chain), Dynamics::new(chain));
        let (mut own_scratch, mut scratch) = (own.scratch(), other.scratch());
        let (mut own_force, mut force) = (vec![R::zero(); n], vec![S::zero(); n]);
        let mut out = Vec::new();
        for node in 0..=self.samples.div_ceil(FORCING_STRIDE) {
            let sample = (node * FORCING_STRIDE).min(self.samples - 1);
            let (q, v) = (self.part(sample, 0), self.part(sample, 1));
            let a = self.acceleration(sample);
            own.forces_along(q, v, &a, &mut own_scratch, &mut own_force);
            let [q, v, a] =
                [q, v, &a[..]].map(|x| -> Vec<S> { x.iter().map(|x| S::from_real(*x)).collect() });
            other.forces_along(&q, &v, &a, &mut scratch, &mut force);
            let both = force.iter().zip(&own_force);
            out.extend(both.map(|(f, own)| *f - S::from_real(*own)));
        }
        Some(out)
    }
}

impl<S: Scalar> Along<S> {
    /// The arm `chain` on `course`.
    pub fn new(course: &Arc<Course<S::Real>>, chain: &Chain<S>) -> Self {
        let n = course.joints();
        let mut along = Self {
            forcing: course.forcing(chain),
            course: Arc::clone(course),
            sample: 0,
            at: 0.0,
            matrices: vec![S::Real::zero(); 3 * n * n],
            off: vec![S::zero(); n],
            held: vec![S::zero(); n],
            is_held: false,
            copy: vec![S::zero(); n],
        };
        along.enter(0);
        along
    }
}
