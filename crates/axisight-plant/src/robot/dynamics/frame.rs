//! Poses of the links, from joint to joint outwards.

use super::super::vector::{Mat3, Vec3, rotate_inertia, rotation};
use super::{Moments, Screw};
use axisight_scalar::Scalar;
use std::array::from_fn;

/// Pose of a link.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame<S> {
    columns: [Vec3<S>; 3],
    pub(super) position: Vec3<S>,
}

impl<S: Scalar> Frame<S> {
    #[inline(always)]
    pub(super) fn base() -> Self {
        let (zero, one) = (S::zero(), S::one());
        Self {
            columns: [
                Vec3([one, zero, zero]),
                Vec3([zero, one, zero]),
                Vec3([zero, zero, one]),
            ],
            position: Vec3::zero(),
        }
    }

    /// Rotate about column `K`, and write the joint axis to `screw`.
    #[inline(always)]
    pub(super) fn turn<const K: usize>(
        &mut self,
        reversed: bool,
        (s, c): (S, S),
        screw: &mut Screw<S>,
    ) {
        let (axis, s) = if reversed {
            (self.columns[K].negate(), -s)
        } else {
            (self.columns[K], s)
        };
        let (a, b) = (self.columns[(K + 1) % 3], self.columns[(K + 2) % 3]);
        self.columns[(K + 1) % 3] = b.scale_add(s, &a.scale(c));
        self.columns[(K + 2) % 3] = a.scale_sub(s, &b.scale(c));
        screw.angular = axis;
        screw.linear = self.position.cross(&axis);
    }

    #[inline(never)]
    pub(super) fn turn_about(&mut self, axis: &[f64; 3], (s, c): (S, S), screw: &mut Screw<S>) {
        let turned = rotation(axis, s, c);
        let axis = self.apply_constant(axis);
        let r = self.matrix();
        self.columns = from_fn(|j| r.apply(&Vec3(from_fn(|i| turned[i][j]))));
        screw.angular = axis;
        screw.linear = self.position.cross(&axis);
    }

    #[inline(never)]
    pub(super) fn slide(&mut self, axis: &[f64; 3], q: S, screw: &mut Screw<S>) {
        let axis = self.apply_constant(axis);
        self.position += axis.scale(q);
        screw.angular = Vec3::zero();
        screw.linear = axis;
    }

    /// The vector with these constant components in this frame. Zero components cost nothing.
    #[inline(always)]
    pub(super) fn apply_constant(&self, v: &[f64; 3]) -> Vec3<S> {
        let mut out = Vec3::zero();
        for (column, x) in self.columns.iter().zip(v) {
            if *x != 0.0 {
                out = column.scale_add(S::constant(*x), &out);
            }
        }
        out
    }

    /// The vector with these components in this frame.
    pub(super) fn apply(&self, v: &[S; 3]) -> Vec3<S> {
        let columns = self.columns.iter().zip(v);
        columns.fold(Vec3::zero(), |sum, (column, x)| column.scale_add(*x, &sum))
    }

    #[inline(always)]
    fn matrix(&self) -> Mat3<S> {
        let [x, y, z] = &self.columns;
        let row = |i: usize| [x.0[i], y.0[i], z.0[i]];
        Mat3([row(0), row(1), row(2)])
    }

    /// Moments of a link about the base origin.
    #[inline(always)]
    pub(super) fn moments(&self, body: &Moments<S>) -> Moments<S> {
        let r = self.matrix();
        let mut moments = Moments {
            mass: body.mass,
            first: r.apply(&body.first),
            second: rotate_inertia(&r, &body.second),
        };
        moments.shift(&self.position);
        moments
    }
}
