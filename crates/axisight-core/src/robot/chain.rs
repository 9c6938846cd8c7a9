//! Rigid-body algorithms of a serial chain, written in the base frame.
//!
//! One sweep from base to tip gives poses and velocity-product accelerations,
//! one sweep back gives bias forces (recursive Newton-Euler) and the inertia
//! matrix (composite rigid bodies); see Featherstone (2008), *Rigid Body
//! Dynamics Algorithms*, chapters 5 and 6. Massless links and joints that share
//! an origin, common in elastic robot models, cost next to nothing: what is
//! structurally zero is skipped.

use super::description::{Joint, Link, Motion, RobotDescription};
use super::vector::{Mat3, Vec3, rotate_about, rotate_inertia, shift_inertia};
use crate::scalar::Scalar;

/// Mass properties of one link, differentiable.
#[derive(Debug, Clone, Copy)]
pub struct Body<S> {
    /// Mass [kg].
    pub mass: S,
    /// Centre of mass in the link frame [m].
    pub com: [S; 3],
    /// Inertia about the centre of mass, link axes: Ixx Iyy Izz Ixy Ixz Iyz [kg m^2].
    pub inertia: [S; 6],
}

impl<S: Scalar> From<&Link> for Body<S> {
    fn from(link: &Link) -> Self {
        Self {
            mass: S::constant(link.mass),
            com: link.com.map(S::constant),
            inertia: link.inertia.map(S::constant),
        }
    }
}

/// One joint and the link it moves.
#[derive(Debug, Clone)]
pub struct ChainJoint<S> {
    motion: Motion,
    origin: Option<[f64; 3]>,
    axis: [f64; 3],
    /// Mass properties of the link; `None` is massless.
    pub body: Option<Body<S>>,
}

impl<S: Scalar> From<&Joint> for ChainJoint<S> {
    fn from(joint: &Joint) -> Self {
        Self {
            motion: joint.motion,
            origin: joint
                .origin
                .iter()
                .any(|x| *x != 0.0)
                .then_some(joint.origin),
            axis: joint.axis,
            body: joint.link.as_ref().map(Body::from),
        }
    }
}

/// A serial chain with differentiable mass properties.
#[derive(Debug, Clone)]
pub struct Chain<S> {
    gravity: [f64; 3],
    /// Joints from base to tip.
    pub joints: Vec<ChainJoint<S>>,
}

/// Scratch and results of one evaluation.
#[derive(Debug, Clone)]
pub struct ChainState<S> {
    /// Inertia matrix, row-major, `n * n`.
    pub inertia: Vec<S>,
    /// Coriolis, centrifugal and gravity forces `c(q, q') + g(q)`.
    pub bias: Vec<S>,
    /// Pose of every link frame: rotation and origin in the base frame.
    pub rotation: Vec<Mat3<S>>,
    /// Origin of every link frame [m].
    pub position: Vec<Vec3<S>>,
    /// Joint axis in the base frame.
    pub axis: Vec<Vec3<S>>,
    offset: Vec<Option<Vec3<S>>>,
    force: Vec<Vec3<S>>,
    moment: Vec<Vec3<S>>,
    composite: Vec<Composite<S>>,
}

/// Mass, first and second moment of a set of links about a joint origin.
#[derive(Debug, Clone, Copy)]
struct Composite<S> {
    mass: S,
    first: Vec3<S>,
    second: [S; 6],
}

/// Velocity, and acceleration without joint accelerations, of a link frame.
#[derive(Clone, Copy)]
struct Motion6<S> {
    angular: Vec3<S>,
    angular_acc: Vec3<S>,
    linear_acc: Vec3<S>,
}

impl<S: Scalar> ChainState<S> {
    /// Scratch for a chain of `n` joints.
    pub fn new(n: usize) -> Self {
        let zero3 = Vec3::zero();
        Self {
            inertia: vec![S::zero(); n * n],
            bias: vec![S::zero(); n],
            rotation: vec![Mat3::identity(); n],
            position: vec![zero3; n],
            axis: vec![zero3; n],
            offset: vec![None; n],
            force: vec![zero3; n],
            moment: vec![zero3; n],
            composite: vec![Composite::empty(); n],
        }
    }
}

impl<S: Scalar> Composite<S> {
    fn empty() -> Self {
        Self {
            mass: S::zero(),
            first: Vec3::zero(),
            second: [S::zero(); 6],
        }
    }

    /// Add `other`, whose reference point lies at `offset` from this one's.
    fn add(&mut self, other: &Self, offset: Option<&Vec3<S>>) {
        self.mass += other.mass;
        self.first = self.first + other.first;
        for (a, b) in self.second.iter_mut().zip(&other.second) {
            *a += *b;
        }
        if let Some(d) = offset {
            shift_inertia(&mut self.second, d, &other.first, other.mass);
            self.first = self.first + d.scale(other.mass);
        }
    }
}

impl<S: Scalar> Chain<S> {
    /// The chain of a robot description.
    pub fn new(robot: &RobotDescription) -> Self {
        Self {
            gravity: robot.gravity,
            joints: robot.joints.iter().map(ChainJoint::from).collect(),
        }
    }

    /// Number of joints.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Whether the chain has no joints.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Inertia matrix, bias forces and poses at joint angles `q` and rates `v`.
    pub fn evaluate(&self, q: &[S], v: &[S], state: &mut ChainState<S>) {
        self.sweep_out(q, v, state);
        self.sweep_back(state);
    }

    fn sweep_out(&self, q: &[S], v: &[S], state: &mut ChainState<S>) {
        let mut rotation = Mat3::identity();
        let mut position = Vec3::zero();
        let mut motion = Motion6 {
            angular: Vec3::zero(),
            angular_acc: Vec3::zero(),
            linear_acc: Vec3::constant(self.gravity.map(|g| -g)),
        };
        for (i, joint) in self.joints.iter().enumerate() {
            let axis = rotation.apply_constant(&joint.axis);
            let offset = joint.offset(&rotation, &axis, q[i]);
            if let Some(d) = &offset {
                position = position + *d;
                let w = &motion.angular;
                motion.linear_acc =
                    motion.linear_acc + motion.angular_acc.cross(d) + w.cross(&w.cross(d));
            }
            let rate = axis.scale(v[i]);
            match joint.motion {
                Motion::Revolute => {
                    rotation = rotate_about(&rotation, &joint.axis, q[i]);
                    motion.angular_acc = motion.angular_acc + motion.angular.cross(&rate);
                    motion.angular = motion.angular + rate;
                }
                Motion::Prismatic => {
                    let coriolis = motion.angular.cross(&rate).scale(S::constant(2.0));
                    motion.linear_acc = motion.linear_acc + coriolis;
                }
            }
            state.axis[i] = axis;
            state.offset[i] = offset;
            state.rotation[i] = rotation;
            state.position[i] = position;
            joint.body_wrench(i, &rotation, &motion, state);
        }
    }

    fn sweep_back(&self, state: &mut ChainState<S>) {
        let n = self.len();
        for i in (0..n).rev() {
            let axis = state.axis[i];
            let (force, mut moment) = match self.joints[i].motion {
                Motion::Revolute => {
                    state.bias[i] = axis.dot(&state.moment[i]);
                    let c = &state.composite[i];
                    (
                        axis.cross(&c.first),
                        Mat3::symmetric(&c.second).apply(&axis),
                    )
                }
                Motion::Prismatic => {
                    state.bias[i] = axis.dot(&state.force[i]);
                    let c = &state.composite[i];
                    (axis.scale(c.mass), c.first.cross(&axis))
                }
            };
            for j in (0..=i).rev() {
                let entry = match self.joints[j].motion {
                    Motion::Revolute => state.axis[j].dot(&moment),
                    Motion::Prismatic => state.axis[j].dot(&force),
                };
                state.inertia[i * n + j] = entry;
                state.inertia[j * n + i] = entry;
                if let Some(d) = &state.offset[j] {
                    moment = moment + d.cross(&force);
                }
            }
            if i > 0 {
                Self::pass_down(i, state);
            }
        }
    }

    /// Hand wrench and composite of joint `i` to its parent.
    fn pass_down(i: usize, state: &mut ChainState<S>) {
        let offset = state.offset[i];
        let force = state.force[i];
        let mut moment = state.moment[i];
        if let Some(d) = &offset {
            moment = moment + d.cross(&force);
        }
        state.force[i - 1] = state.force[i - 1] + force;
        state.moment[i - 1] = state.moment[i - 1] + moment;
        let child = state.composite[i];
        state.composite[i - 1].add(&child, offset.as_ref());
    }
}

impl<S: Scalar> ChainJoint<S> {
    /// From the parent's origin to this joint's, in the base frame; `None` when they coincide.
    fn offset(&self, parent: &Mat3<S>, axis: &Vec3<S>, q: S) -> Option<Vec3<S>> {
        let fixed = self.origin.as_ref().map(|o| parent.apply_constant(o));
        match self.motion {
            Motion::Revolute => fixed,
            Motion::Prismatic => {
                let slide = axis.scale(q);
                Some(fixed.map_or(slide, |f| f + slide))
            }
        }
    }

    /// Inertial wrench of the link about its joint origin, and its mass moments.
    fn body_wrench(&self, i: usize, r: &Mat3<S>, motion: &Motion6<S>, state: &mut ChainState<S>) {
        let Some(body) = &self.body else {
            state.force[i] = Vec3::zero();
            state.moment[i] = Vec3::zero();
            state.composite[i] = Composite::empty();
            return;
        };
        let c = r.apply(&Vec3(body.com));
        let second = rotate_inertia(r, &body.inertia);
        let inertia = Mat3::symmetric(&second);
        let w = &motion.angular;
        let acc = motion.linear_acc + motion.angular_acc.cross(&c) + w.cross(&w.cross(&c));
        let force = acc.scale(body.mass);
        let spin = inertia.apply(&motion.angular_acc) + w.cross(&inertia.apply(w));
        state.force[i] = force;
        state.moment[i] = spin + c.cross(&force);
        let mut composite = Composite {
            mass: body.mass,
            first: c.scale(body.mass),
            second,
        };
        shift_inertia(&mut composite.second, &c, &Vec3::zero(), body.mass);
        state.composite[i] = composite;
    }
}
