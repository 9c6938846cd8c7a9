//! Motions, wrenches and moments of links about the base origin, in base axes.

use super::super::chain::Body;
use super::super::vector::{Mat3, Vec3, shift_inertia};
use axisight_scalar::Scalar;

/// A motion (turn, shift) or a wrench (moment, force) about the base origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Screw<S> {
    pub(super) angular: Vec3<S>,
    pub(super) linear: Vec3<S>,
}

impl<S: Scalar> Screw<S> {
    pub(super) fn zero() -> Self {
        Self {
            angular: Vec3::zero(),
            linear: Vec3::zero(),
        }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, other: &Self) {
        self.angular += other.angular;
        self.linear += other.linear;
    }

    #[inline(always)]
    pub(super) fn scale(&self, s: S) -> Self {
        Self {
            angular: self.angular.scale(s),
            linear: self.linear.scale(s),
        }
    }

    /// `sum +=` the rate of change of `motion`, which is fixed in a body that moves with `self`.
    #[inline(always)]
    pub(super) fn turn_add(&self, motion: &Self, sum: &mut Self) {
        sum.angular = self.angular.cross_add(&motion.angular, &sum.angular);
        sum.linear = self.angular.cross_add(&motion.linear, &sum.linear);
        sum.linear = self.linear.cross_add(&motion.angular, &sum.linear);
    }

    /// `sum +=` the rate of change of a momentum or wrench that is fixed in such a body.
    #[inline(always)]
    pub(super) fn turn_momentum_add(&self, momentum: &Self, sum: &mut Self) {
        sum.angular = self.angular.cross_add(&momentum.angular, &sum.angular);
        sum.angular = self.linear.cross_add(&momentum.linear, &sum.angular);
        sum.linear = self.angular.cross_add(&momentum.linear, &sum.linear);
    }

    /// Power of a wrench along a motion.
    #[inline(always)]
    pub(super) fn dot(&self, other: &Self) -> S {
        let angular = self.angular.dot(&other.angular);
        self.linear.dot_add(&other.linear, angular)
    }
}

/// Mass, first and second moment of links about a point [kg, kg m, kg m^2].
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments<S> {
    pub(super) mass: S,
    pub(super) first: Vec3<S>,
    pub(super) second: [S; 6],
}

impl<S: Scalar> Moments<S> {
    pub(super) fn zero() -> Self {
        Self {
            mass: S::zero(),
            first: Vec3::zero(),
            second: [S::zero(); 6],
        }
    }

    /// Moments of a link about its joint, in link axes.
    pub(super) fn of(body: &Body<S>) -> Self {
        let com = Vec3(body.com);
        let mut second = body.inertia;
        shift_inertia(&mut second, &com, &Vec3::zero(), body.mass);
        Self {
            mass: body.mass,
            first: com.scale(body.mass),
            second,
        }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.first += other.first;
        for (a, b) in self.second.iter_mut().zip(&other.second) {
            *a += *b;
        }
    }

    /// Wrench that accelerates the links by a unit motion.
    #[inline(always)]
    pub(super) fn wrench(&self, motion: &Screw<S>) -> Screw<S> {
        let spun = Mat3::symmetric(&self.second).apply(&motion.angular);
        let pushed = motion.linear.scale(self.mass);
        Screw {
            angular: self.first.cross_add(&motion.linear, &spun),
            linear: motion.angular.cross_add(&self.first, &pushed),
        }
    }

    /// Refer the moments to the point `-d`, relative to the present point.
    #[inline(always)]
    pub(super) fn shift(&mut self, d: &Vec3<S>) {
        shift_inertia(&mut self.second, d, &self.first, self.mass);
        self.first = d.scale_add(self.mass, &self.first);
    }
}
