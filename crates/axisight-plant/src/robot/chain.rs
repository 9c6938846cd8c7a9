//! A chain or tree of joints with differentiable mass properties, and its poses.

use super::description::{Joint, Link, Motion, RobotDescription};
use super::vector::{Mat3, Vec3, rotation};
use axisight_scalar::Scalar;

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

/// One joint with the link that it moves.
#[derive(Debug, Clone)]
pub struct ChainJoint<S> {
    /// Index of the joint whose link carries this joint, below its own index; `None` is the base.
    pub parent: Option<usize>,
    /// Kind of motion of the joint.
    pub motion: Motion,
    /// Position in the parent link's frame [m]; `None` is its origin.
    pub origin: Option<[f64; 3]>,
    /// Change of the position in the parent link's frame [m]; `None` for no change.
    pub shift: Option<[S; 3]>,
    /// Unit vector of the axis in the parent link's frame.
    pub axis: [f64; 3],
    /// Angle [rad] or displacement [m] of the joint at its zero reading.
    pub zero: S,
    /// Mass properties of the link; `None` is massless.
    pub body: Option<Body<S>>,
}

impl<S: Scalar> From<&Joint> for ChainJoint<S> {
    fn from(joint: &Joint) -> Self {
        Self {
            parent: joint.parent,
            motion: joint.motion,
            origin: joint
                .origin
                .iter()
                .any(|x| *x != 0.0)
                .then_some(joint.origin),
            shift: None,
            axis: joint.axis,
            zero: S::zero(),
            body: joint.link.as_ref().map(Body::from),
        }
    }
}

/// A chain, or a tree, of joints with differentiable mass properties.
#[derive(Debug, Clone)]
pub struct Chain<S> {
    /// Gravity in the base frame [m/s^2].
    pub gravity: [S; 3],
    /// Joints, every one behind its parent.
    pub joints: Vec<ChainJoint<S>>,
}

/// Pose of a link frame and axis of its joint, in the base frame.
#[derive(Debug, Clone, Copy)]
pub struct Pose<S> {
    /// Rotation from link to base axes.
    pub rotation: Mat3<S>,
    /// Origin [m].
    pub position: Vec3<S>,
    /// Joint axis.
    pub axis: Vec3<S>,
}

impl<S: Scalar> Chain<S> {
    /// The chain of a robot description.
    pub fn new(robot: &RobotDescription) -> Self {
        Self {
            gravity: robot.gravity.map(S::constant),
            joints: robot.joints.iter().map(ChainJoint::from).collect(),
        }
    }

    /// The same chain over a scalar `D` whose plain numbers are `S`.
    pub fn lifted<D: Scalar<Real = S>>(&self) -> Chain<D> {
        let body = |b: &Body<S>| Body {
            mass: D::from_real(b.mass),
            com: b.com.map(D::from_real),
            inertia: b.inertia.map(D::from_real),
        };
        let joint = |j: &ChainJoint<S>| ChainJoint {
            parent: j.parent,
            motion: j.motion,
            origin: j.origin,
            shift: j.shift.map(|d| d.map(D::from_real)),
            axis: j.axis,
            zero: D::from_real(j.zero),
            body: j.body.as_ref().map(body),
        };
        Chain {
            gravity: self.gravity.map(D::from_real),
            joints: self.joints.iter().map(joint).collect(),
        }
    }

    /// Whether gravity, joint zeros, joint shifts and all masses equal those of `other` bit for
    /// bit, without regard to derivatives.
    pub fn same_masses(&self, other: &Chain<S::Real>) -> bool {
        let same =
            |a: &S, b: &S::Real| (0..S::LANES).all(|l| a.lane(l).to_bits() == b.lane(l).to_bits());
        let all = |a: &[S], b: &[S::Real]| a.iter().zip(b).all(|(a, b)| same(a, b));
        let bodies = |a: &ChainJoint<S>, b: &ChainJoint<S::Real>| match (&a.body, &b.body) {
            (None, None) => true,
            (Some(a), Some(b)) => {
                same(&a.mass, &b.mass) && all(&a.com, &b.com) && all(&a.inertia, &b.inertia)
            }
            _ => false,
        };
        let shifts = |a: &Option<[S; 3]>, b: &Option<[S::Real; 3]>| match (a, b) {
            (None, None) => true,
            (Some(a), Some(b)) => all(a, b),
            _ => false,
        };
        let mut joints = self.joints.iter().zip(&other.joints);
        all(&self.gravity, &other.gravity)
            && joints
                .all(|(a, b)| same(&a.zero, &b.zero) && shifts(&a.shift, &b.shift) && bodies(a, b))
    }

    /// Number of joints.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Whether the chain has no joints.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Whether each joint sits on the link of the joint before it, and the first one on the base.
    pub fn is_chain(&self) -> bool {
        let mut joints = self.joints.iter().enumerate();
        joints.all(|(i, joint)| joint.parent == i.checked_sub(1))
    }

    /// The joints that move link `joint`, from it to the base.
    pub fn path(&self, joint: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(joint), |i| self.joints[*i].parent)
    }

    /// Whether any number of the chain carries derivatives.
    pub fn carries_derivatives(&self) -> bool {
        let depends = |x: &S| {
            (0..S::PARTIALS).any(|seed| (0..S::LANES).any(|lane| x.partial(seed, lane) != 0.0))
        };
        let bodies = self.joints.iter().filter_map(|joint| joint.body.as_ref());
        let mut numbers = bodies.flat_map(|b| [b.mass].into_iter().chain(b.com).chain(b.inertia));
        let mut zeros = self.joints.iter().map(|joint| &joint.zero);
        let mut shifts = self
            .joints
            .iter()
            .flat_map(|joint| joint.shift.iter().flatten());
        numbers.any(|x| depends(&x))
            || self.gravity.iter().any(depends)
            || zeros.any(depends)
            || shifts.any(depends)
    }

    /// Pose of every link frame at joint angles `q`.
    pub fn poses(&self, q: &[S]) -> Vec<Pose<S>> {
        let base = Pose {
            rotation: Mat3::identity(),
            position: Vec3::zero(),
            axis: Vec3::zero(),
        };
        let mut out: Vec<Pose<S>> = Vec::with_capacity(self.len());
        for (joint, q) in self.joints.iter().zip(q) {
            let mut pose = joint.parent.map_or(base, |parent| out[parent]);
            pose.axis = pose.rotation.apply_constant(&joint.axis);
            if let Some(origin) = &joint.origin {
                pose.position += pose.rotation.apply_constant(origin);
            }
            if let Some(shift) = joint.shift {
                pose.position += pose.rotation.apply(&Vec3(shift));
            }
            match joint.motion {
                Motion::Revolute => {
                    let (s, c) = (*q + joint.zero).sin_cos();
                    let turn = rotation(&joint.axis, s, c);
                    pose.rotation = pose.rotation.times(&turn);
                }
                Motion::Prismatic => pose.position += pose.axis.scale(*q + joint.zero),
            }
            out.push(pose);
        }
        out
    }
}
