//! The arm linearised along a run, as the integrators call it. See `course` for the linearization.

use super::chain::Chain;
use axisight_scalar::Scalar;
use std::sync::Arc;

/// Samples over which the forces of changed masses are interpolated linearly.
pub(super) const FORCING_STRIDE: usize = 2;

/// A run with the arm linearised along it.
#[derive(Debug, Clone)]
pub struct Course<R> {
    pub(super) chain: Chain<R>,
    pub(super) sample_time: f64,
    pub(super) samples: usize,
    /// For each sample: angles, rates, bias forces.
    pub(super) motion: Vec<R>,
    /// Number of samples between nodes.
    pub(super) stride: usize,
    /// For each node: inverse of the inertia matrix, `B_q`, `B_v`, row-major.
    pub(super) nodes: Vec<R>,
}

impl<R: Scalar> Course<R> {
    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.chain.len()
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.samples
    }

    pub(super) fn part(&self, sample: usize, which: usize) -> &[R] {
        let n = self.joints();
        let first = (3 * sample.min(self.samples - 1) + which) * n;
        &self.motion[first..first + n]
    }
}

/// An arm on a [`Course`], as the integrators call it.
#[derive(Debug, Clone)]
pub struct Along<S: Scalar> {
    pub(super) course: Arc<Course<S::Real>>,
    /// Forces of changed masses, for each node of [`FORCING_STRIDE`] samples.
    pub(super) forcing: Option<Vec<S>>,
    pub(super) sample: usize,
    /// Time within the sample, as a fraction.
    pub(super) at: f64,
    /// Inverse of the inertia matrix, `B_q`, `B_v` in the middle of the sample.
    pub(super) matrices: Vec<S::Real>,
    /// `q - q0`.
    pub(super) off: Vec<S>,
    /// `B_q (q - q0) + B_v (v - v0)` at the start of the sample. It is a thousandth of a gear
    /// spring's force and changes little until the next sample.
    pub(super) held: Vec<S>,
    pub(super) is_held: bool,
    pub(super) copy: Vec<S>,
}

impl<S: Scalar> Along<S> {
    /// Number of samples of the course.
    pub fn samples(&self) -> usize {
        self.course.samples
    }

    /// Move to a sample.
    pub fn enter(&mut self, sample: usize) {
        self.sample = sample;
        self.is_held = false;
        let (course, size) = (&self.course, self.matrices.len());
        let node = sample / course.stride;
        let share = ((sample % course.stride) as f64 + 0.5) / course.stride as f64;
        let share = S::Real::constant(share);
        // A run without samples has no nodes. It is refused before the first step.
        let Some(pair) = course.nodes.get(node * size..(node + 2) * size) else {
            return;
        };
        let (from, to) = pair.split_at(size);
        for ((out, from), to) in self.matrices.iter_mut().zip(from).zip(to) {
            *out = (*to - *from).fma(share, *from);
        }
    }

    /// Move to a fraction of the sample.
    #[inline(always)]
    pub fn go_to(&mut self, at: f64) {
        self.at = at;
    }

    /// A part of the run's motion (0: angles, 1: rates, 2: bias forces) at the present time.
    #[inline(always)]
    fn motion(&self, which: usize) -> impl Iterator<Item = S::Real> {
        let at = S::Real::constant(self.at);
        let from = self.course.part(self.sample, which);
        let to = self.course.part(self.sample + 1, which);
        from.iter().zip(to).map(move |(a, b)| (*b - *a).fma(at, *a))
    }

    /// Set the joint angles.
    #[inline(always)]
    pub(super) fn place(&mut self, q: &[S]) {
        if !self.is_held {
            let mut off = std::mem::take(&mut self.off);
            self.subtract(0, q, &mut off);
            self.off = off;
        }
    }

    /// Compute `out = x - x0` for a part of the run's motion.
    fn subtract(&self, which: usize, x: &[S], out: &mut [S]) {
        for ((out, x), on) in out.iter_mut().zip(x).zip(self.motion(which)) {
            *out = *x - S::from_real(on);
        }
    }

    /// Forces without acceleration, at rates `v` and the angles set last.
    #[inline(always)]
    pub(super) fn bias(&mut self, v: &[S], out: &mut [S]) {
        if !self.is_held {
            self.hold(v);
        }
        for ((out, on), held) in out.iter_mut().zip(self.motion(2)).zip(&self.held) {
            *out = *held + S::from_real(on);
        }
        if let Some(forcing) = &self.forcing {
            let n = self.off.len();
            let place = (self.sample % FORCING_STRIDE) as f64 + self.at;
            let share = S::Real::constant(place / FORCING_STRIDE as f64);
            let first = self.sample / FORCING_STRIDE * n;
            let (from, to) = forcing[first..first + 2 * n].split_at(n);
            for ((out, from), to) in out.iter_mut().zip(from).zip(to) {
                *out += (*to - *from).fma_real(share, *from);
            }
        }
    }

    /// Compute the forces of the distance from the run, at rates `v`.
    fn hold(&mut self, v: &[S]) {
        let n = self.off.len();
        let mut faster = std::mem::take(&mut self.copy);
        self.subtract(1, v, &mut faster);
        let (by_angle, by_rate) = self.matrices[n * n..].split_at(n * n);
        let rows = by_angle.chunks_exact(n).zip(by_rate.chunks_exact(n));
        for (out, (by_angle, by_rate)) in self.held.iter_mut().zip(rows) {
            let mut sum = S::zero();
            for ((a, off), (b, faster)) in by_angle
                .iter()
                .zip(&self.off)
                .zip(by_rate.iter().zip(&faster))
            {
                sum = faster.fma_real(*b, off.fma_real(*a, sum));
            }
            *out = sum;
        }
        self.copy = faster;
        self.is_held = true;
    }

    /// Replace forces by accelerations.
    #[inline(always)]
    pub(super) fn accelerate(&mut self, force: &mut [S]) {
        let n = self.copy.len();
        self.copy.copy_from_slice(&force[..n]);
        let rows = self.matrices.chunks_exact(n.max(1));
        for (out, row) in force[..n].iter_mut().zip(rows) {
            let sum = row.iter().zip(&self.copy);
            *out = sum.fold(S::zero(), |sum, (a, f)| f.fma_real(*a, sum));
        }
    }
}
