//! Specific forces on points of the links: their acceleration minus gravity.
//!
//! The velocities and accelerations of the links are those of the recursive Newton-Euler method,
//! about the base origin (Featherstone 2008, section 5.3). Gravity enters as an acceleration of the
//! base. A point `p` of a link with the velocity `(w, v)` and the acceleration `(w', a)` has the
//! velocity `u = v + w x p` and the acceleration `a + w' x p + w x u`.

use super::super::accelerometer::{Accelerometer, JointMotion};
use super::{Dynamics, Frame, LinkMotion, Screw, Start, Turn};
use crate::robot::vector::Vec3;
use axisight_scalar::Scalar;

impl<S: Scalar> Dynamics<S> {
    /// What `accelerometers` measure along a motion of the joints [m/s^2], written to `out`: the
    /// directions of the first one, then of the next one.
    #[inline(never)]
    pub fn specific_force(
        &self,
        motion: JointMotion<'_, S>,
        accelerometers: &[Accelerometer],
        out: &mut [S],
    ) {
        let base = (Frame::base(), LinkMotion::base(&self.gravity));
        let mut forks = vec![base; self.n_forks];
        let (
            mut frame,
            LinkMotion {
                mut velocity,
                mut acceleration,
            },
        ) = base;
        let last = accelerometers.iter().map(|a| a.joint).max().unwrap_or(0);
        let rates = motion.v.iter().zip(motion.a);
        let joints = self.segments.iter().zip(motion.q).zip(rates);
        for (joint, ((segment, q), (v, a))) in joints.enumerate().take(last + 1) {
            if let Some(start) = segment.branch.start {
                (
                    frame,
                    LinkMotion {
                        velocity,
                        acceleration,
                    },
                ) = match start {
                    Start::Base => base,
                    Start::Fork(fork) => forks[fork],
                };
            }
            let axis = segment.advance(*q, &mut frame);
            velocity.turn_add(&axis.scale(*v), &mut acceleration);
            acceleration.add(&axis.scale(*a));
            velocity.add(&axis.scale(*v));
            if let Some(fork) = segment.branch.fork {
                let motion = LinkMotion {
                    velocity,
                    acceleration,
                };
                forks[fork] = (frame, motion);
            }
            let mut slot = 0;
            for one in accelerometers {
                let end = slot + one.directions.len();
                if one.joint == joint {
                    let force = at_point(&frame, &one.position, &velocity, &acceleration);
                    for (out, direction) in out[slot..end].iter_mut().zip(&one.directions) {
                        *out = frame.apply_constant(direction).dot(&force);
                    }
                }
                slot = end;
            }
        }
    }
}

/// Specific force on a point of a link, in the base frame.
fn at_point<S: Scalar>(
    frame: &Frame<S>,
    position: &[f64; 3],
    velocity: &Screw<S>,
    acceleration: &Screw<S>,
) -> Vec3<S> {
    let point = frame.position + frame.apply_constant(position);
    let speed = velocity.angular.cross_add(&point, &velocity.linear);
    let force = acceleration.angular.cross_add(&point, &acceleration.linear);
    velocity.angular.cross_add(&speed, &force)
}

impl<S: Scalar> super::Segment<S> {
    /// Move `frame` from the parent link to this link at joint angle `q`. Returns the joint axis.
    fn advance(&self, q: S, frame: &mut Frame<S>) -> Screw<S> {
        if let Some(origin) = &self.origin {
            frame.position += frame.apply_constant(origin);
        }
        if let Some(shift) = &self.shift {
            frame.position += frame.apply(shift);
        }
        let angle = q + self.zero;
        let mut axis = Screw::zero();
        match self.turn {
            Turn::X { reversed } => frame.turn::<0>(reversed, angle.sin_cos(), &mut axis),
            Turn::Y { reversed } => frame.turn::<1>(reversed, angle.sin_cos(), &mut axis),
            Turn::Z { reversed } => frame.turn::<2>(reversed, angle.sin_cos(), &mut axis),
            Turn::About(about) => frame.turn_about(&about, angle.sin_cos(), &mut axis),
            Turn::Along(along) => frame.slide(&along, angle, &mut axis),
        }
        axis
    }
}
