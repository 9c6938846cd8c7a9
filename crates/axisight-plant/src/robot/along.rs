//! The arm along a run, as the integrators call it; how a run is linearised stands in `course`.

use super::chain::Chain;
use axisight_scalar::Scalar;
use std::sync::Arc;

/// Samples over which forces of other masses are taken as straight lines.
pub(super) const FORCING_STRIDE: usize = 2;

/// A run, and the arm linearised along it.
#[derive(Debug, Clone)]
pub struct Course<R> {
    pub(super) chain: Chain<R>,
    pub(super) sample_time: f64,
    pub(super) samples: usize,
    /// By sample: angles, rates, bias forces.
    pub(super) motion: Vec<R>,
    /// Samples from node to node.
    pub(super) stride: usize,
    /// By node: inverse of the inertia matrix, `B_q`, `B_v`, row-major.
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
    /// By node of [`FORCING_STRIDE`] samples.
    pub(super) forcing: Option<Vec<S>>,
    pub(super) sample: usize,
    /// Fraction of the sample.
    pub(super) at: f64,
    /// In the middle of the sample: inverse of the inertia matrix, `B_q`, `B_v`.
    pub(super) matrices: Vec<S::Real>,
    /// `q - q0`.
    pub(super) off: Vec<S>,
    /// `B_q (q - q0) + B_v (v - v0)` at the start of the sample: against a gear spring a
    /// thousandth, and it changes little until the next.
    pub(super) held: Vec<S>,
    pub(super) is_held: bool,
    pub(super) copy: Vec<S>,
}

impl<S: Scalar> Along<S> {
    /// Number of samples the course has.
    pub fn samples(&self) -> usize {
        self.course.samples
    }

    /// Go to a sample.
    pub fn enter(&mut self, sample: usize) {
        self.sample = sample;
        self.is_held = false;
        let (course, size) = (&self.course, self.matrices.len());
        let node = sample / course.stride;
        let share = ((sample % course.stride) as f64 + 0.5) / course.stride as f64;
        let share = S::Real::constant(share);
        // A run without samples has none; it is refused before the first step.
        let Some(pair) = course.nodes.get(node * size..(node + 2) * size) else {
            return;
        };
        let (from, to) = pair.split_at(size);
        for ((out, from), to) in self.matrices.iter_mut().zip(from).zip(to) {
            *out = (*to - *from).fma(share, *from);
        }
    }

    /// Go to a fraction of the sample.
    #[inline(always)]
    pub fn go_to(&mut self, at: f64) {
        self.at = at;
    }

    /// A part of the motion at the present instant.
    #[inline(always)]
    fn motion(&self, which: usize) -> impl Iterator<Item = S::Real> {
        let at = S::Real::constant(self.at);
        let from = self.course.part(self.sample, which);
        let to = self.course.part(self.sample + 1, which);
        from.iter().zip(to).map(move |(a, b)| (*b - *a).fma(at, *a))
    }

    /// Take joint angles.
    #[inline(always)]
    pub(super) fn place(&mut self, q: &[S]) {
        if !self.is_held {
            let mut off = std::mem::take(&mut self.off);
            self.subtract(0, q, &mut off);
            self.off = off;
        }
    }

    /// `out = x - x0` for a part of the motion.
    fn subtract(&self, which: usize, x: &[S], out: &mut [S]) {
        for ((out, x), on) in out.iter_mut().zip(x).zip(self.motion(which)) {
            *out = *x - S::from_real(on);
        }
    }

    /// Forces without acceleration at rates `v` and the angles last placed.
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

    /// What being off the run takes at rates `v`.
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

    /// Forces to accelerations.
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
