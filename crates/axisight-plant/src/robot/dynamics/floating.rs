//! Equations of motion of a chain or tree on a floating base.
//!
//! All quantities are in the axes of the base link about its origin, seen from a frame that falls
//! freely and has, at this instant, the velocity of that origin. There is no gravity in this frame,
//! and the base has no linear velocity. What is left of the base's motion is what an inertial
//! measurement unit at the origin measures: angular velocity, and acceleration minus gravity.
//!
//! The six coordinates of the base come first: three shifts along its axes, three turns about them
//! (Featherstone 2008, chapter 9). The axes, moments and composite inertias are those of the sweep
//! of [`Dynamics::place`] over the joints, which does not know of the base.

use super::{Dynamics, DynamicsScratch, LinkMotion, Moments, Screw};
use crate::robot::chain::{Body, Chain};
use crate::robot::description::RobotDescription;
use crate::robot::linear_algebra::{factorize, solve_factorized};
use crate::robot::rigid_body::{ShapeError, check_numbers};
use crate::robot::vector::Vec3;

/// Number of coordinates of a floating base.
pub const BASE_COORDINATES: usize = 6;

/// Largest number of coordinates: those of the base, and all joints.
const MOST: usize = super::MOST_JOINTS + BASE_COORDINATES;

/// Motion of a floating base in its own axes, at its origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseMotion {
    /// Angular velocity [rad/s].
    pub angular_velocity: [f64; 3],
    /// Angular acceleration [rad/s^2].
    pub angular_acceleration: [f64; 3],
    /// Acceleration of the origin minus gravity [m/s^2].
    pub proper_acceleration: [f64; 3],
}

/// Dynamics of all joints, driven and elastic, together with a floating base.
#[derive(Debug, Clone)]
pub struct FloatingBody {
    dynamics: Dynamics<f64>,
    parents: Vec<Option<usize>>,
    base: Moments<f64>,
}

/// The moments that act on the base as three forces and three moments, in this order.
fn wrench_of(screw: &Screw<f64>) -> [f64; BASE_COORDINATES] {
    let ([fx, fy, fz], [mx, my, mz]) = (screw.linear.0, screw.angular.0);
    [fx, fy, fz, mx, my, mz]
}

/// The unit motion of a coordinate of the base.
fn unit_motion(coordinate: usize) -> Screw<f64> {
    let axis = |first: usize| {
        Vec3(std::array::from_fn(|k| {
            f64::from(u8::from(first + k == coordinate))
        }))
    };
    Screw {
        linear: axis(0),
        angular: axis(3),
    }
}

impl FloatingBody {
    /// The dynamics of a robot; `None` if its base is fixed.
    pub fn new(robot: &RobotDescription) -> Option<Self> {
        let base = Moments::of(&Body::from(robot.floating_base.as_ref()?));
        let chain = Chain::new(robot);
        Some(Self {
            dynamics: Dynamics::new(&chain),
            parents: chain.joints.iter().map(|joint| joint.parent).collect(),
            base,
        })
    }

    /// Number of coordinates: six of the base, and the joints.
    pub fn n_coordinates(&self) -> usize {
        BASE_COORDINATES + self.dynamics.len()
    }

    /// Scratch memory, for evaluating one state after another.
    pub fn scratch(&self) -> DynamicsScratch<f64> {
        self.dynamics.scratch()
    }

    /// Inertia matrix at the joint positions `q` [rad or m], row-major, in all coordinates.
    ///
    /// # Errors
    /// [`ShapeError`] for a wrong length or non-finite value (as for all methods here).
    pub fn inertia_matrix(
        &self,
        q: &[f64],
        scratch: &mut DynamicsScratch<f64>,
        out: &mut [f64],
    ) -> Result<(), ShapeError> {
        let n = self.n_coordinates();
        self.place(q, scratch)?;
        self.upper(scratch, |i, j, value| {
            out[i * n + j] = value;
            out[j * n + i] = value;
        });
        Ok(())
    }

    /// Forces in all coordinates along a motion: the wrench on the base (force [N], then moment
    /// [Nm]), and the joint forces. `motion` are joint positions, rates and accelerations.
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn inverse_dynamics(
        &self,
        motion: [&[f64]; 3],
        base: &BaseMotion,
        scratch: &mut DynamicsScratch<f64>,
        out: &mut [f64],
    ) -> Result<(), ShapeError> {
        let [q, v, a] = motion;
        self.check("v", v)?;
        self.check("a", a)?;
        self.place(q, scratch)?;
        self.forces(v, a, base, scratch, out);
        Ok(())
    }

    /// Accelerations in all coordinates under the forces `tau`: the proper acceleration [m/s^2] and
    /// angular acceleration [rad/s^2] of the base, then those of the joints.
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn forward_dynamics(
        &self,
        [q, v, tau]: [&[f64]; 3],
        angular_velocity: [f64; 3],
        scratch: &mut DynamicsScratch<f64>,
        out: &mut [f64],
    ) -> Result<(), ShapeError> {
        let n = self.n_coordinates();
        self.check("v", v)?;
        check_numbers("tau", tau, n, "a base wrench and joint forces")?;
        check_numbers("base", &angular_velocity, 3, "an angular velocity")?;
        self.place(q, scratch)?;
        let mut inertia = [[0.0; MOST]; MOST];
        self.upper(scratch, |i, j, value| inertia[i][j] = value);
        let base = BaseMotion {
            angular_velocity,
            angular_acceleration: [0.0; 3],
            proper_acceleration: [0.0; 3],
        };
        let mut bias = vec![0.0; n];
        self.forces(v, &vec![0.0; v.len()], &base, scratch, &mut bias);
        let mut x = [0.0; MOST];
        for (x, (tau, bias)) in x.iter_mut().zip(tau.iter().zip(&bias)) {
            *x = tau - bias;
        }
        factorize(&mut inertia, n);
        solve_factorized(&inertia, &mut x, n);
        for (out, x) in out.iter_mut().zip(x) {
            *out = x;
        }
        Ok(())
    }

    fn check(&self, field: &'static str, x: &[f64]) -> Result<(), ShapeError> {
        check_numbers(field, x, self.dynamics.len(), "joint values")
    }

    fn place(&self, q: &[f64], scratch: &mut DynamicsScratch<f64>) -> Result<(), ShapeError> {
        self.check("q", q)?;
        if self.dynamics.len() > super::MOST_JOINTS {
            return Err(ShapeError {
                field: "robot",
                expected: format!("at most {} joints", super::MOST_JOINTS),
                got: self.dynamics.len().to_string(),
            });
        }
        self.dynamics.place(q, scratch);
        Ok(())
    }

    /// Hand the upper triangle of the inertia matrix to `set`, after [`Self::place`].
    fn upper(&self, scratch: &DynamicsScratch<f64>, mut set: impl FnMut(usize, usize, f64)) {
        let mut all = self.base;
        for (segment, moments) in self.dynamics.segments.iter().zip(&scratch.moments) {
            if segment.body.is_some() {
                all.add(moments);
            }
        }
        for j in 0..BASE_COORDINATES {
            let wrench = wrench_of(&all.wrench(&unit_motion(j)));
            for (i, value) in wrench.into_iter().enumerate().take(j + 1) {
                set(i, j, value);
            }
        }
        let (joints, stride) = (self.dynamics.len(), scratch.bias.len());
        for j in 0..joints {
            // The wrench that accelerates all outer links by the unit motion of joint j.
            for (i, value) in wrench_of(&scratch.wrenches[j]).into_iter().enumerate() {
                set(i, BASE_COORDINATES + j, value);
            }
            for i in 0..=j {
                let value = scratch.inertia[i * stride + j];
                set(BASE_COORDINATES + i, BASE_COORDINATES + j, value);
            }
        }
    }

    /// Recursive Newton-Euler with a moving base, after [`Self::place`].
    fn forces(
        &self,
        v: &[f64],
        a: &[f64],
        base: &BaseMotion,
        scratch: &mut DynamicsScratch<f64>,
        out: &mut [f64],
    ) {
        let start = LinkMotion {
            velocity: Screw {
                angular: Vec3(base.angular_velocity),
                linear: Vec3::zero(),
            },
            acceleration: Screw {
                angular: Vec3(base.angular_acceleration),
                linear: Vec3(base.proper_acceleration),
            },
        };
        let mut moved: Vec<LinkMotion<f64>> = Vec::with_capacity(v.len());
        let joints = self.dynamics.segments.iter().zip(&self.parents);
        for (i, ((segment, parent), (v, a))) in joints.zip(v.iter().zip(a)).enumerate() {
            let mut motion = parent.map_or(start, |parent| moved[parent]);
            let axis = &scratch.axes[i];
            motion
                .velocity
                .turn_add(&axis.scale(*v), &mut motion.acceleration);
            motion.acceleration.add(&axis.scale(*a));
            motion.velocity.add(&axis.scale(*v));
            scratch.wrenches[i] = if segment.body.is_some() {
                wrench_along(&scratch.moments[i], &motion)
            } else {
                Screw::zero()
            };
            moved.push(motion);
        }
        let mut total = wrench_along(&self.base, &start);
        let (of_base, of_joints) = out.split_at_mut(BASE_COORDINATES);
        for (i, force) in of_joints.iter_mut().enumerate().rev() {
            let wrench = scratch.wrenches[i];
            *force = scratch.axes[i].dot(&wrench);
            match self.parents[i] {
                None => total.add(&wrench),
                Some(parent) => scratch.wrenches[parent].add(&wrench),
            }
        }
        of_base.copy_from_slice(&wrench_of(&total));
    }
}

/// Wrench that a link needs for its motion.
fn wrench_along(moments: &Moments<f64>, motion: &LinkMotion<f64>) -> Screw<f64> {
    let mut wrench = moments.wrench(&motion.acceleration);
    let momentum = moments.wrench(&motion.velocity);
    motion.velocity.turn_momentum_add(&momentum, &mut wrench);
    wrench
}
