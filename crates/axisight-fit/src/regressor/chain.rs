//! One sweep over the chain or tree: the effect of each link's parameters on each joint.
//!
//! All quantities are in the frame of the present link. Let w, e and a be the angular velocity, the
//! angular acceleration and the acceleration (minus gravity) of this frame. The link parameters m,
//! h, I give the force `m a + (e x + w x w x) h` and, about the origin of the frame, the moment
//! `I e + w x I w + h x a`. A joint with the unit motion (s, t) at this frame feels
//! `t . force + s . moment`.
//!
//! These are ten numbers for every joint that carries the link, at about 65 multiply-adds per
//! joint. The cost of a sample is proportional to its number of columns, not to a multiple of
//! inverse dynamics.

use axisight_plant::robot::{Joint, Mat3, Motion, RobotDescription, Vec3};
use axisight_scalar::Scalar;

/// Parameters of a link: m, m c (x y z), inertia about the link frame xx yy zz xy xz yz.
pub const LINK_PARAMETERS: usize = 10;

/// Geometry of one joint.
#[derive(Debug, Clone)]
pub(super) struct Segment {
    pub(super) parent: Option<usize>,
    motion: Motion,
    axis: [f64; 3],
    origin: [f64; 3],
}

impl From<&Joint> for Segment {
    fn from(joint: &Joint) -> Self {
        Self {
            parent: joint.parent,
            motion: joint.motion,
            axis: joint.axis,
            origin: joint.origin,
        }
    }
}

/// The chain or tree, prepared for the sweep.
#[derive(Debug, Clone)]
pub(super) struct Geometry {
    pub(super) gravity: [f64; 3],
    pub(super) segments: Vec<Segment>,
    /// Joints whose links have mass, in order.
    pub(super) links: Vec<usize>,
    /// Where joints do not sit on the link before them; `None` for a chain.
    pub(super) tree: Option<Tree>,
}

/// The branches of a tree.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    /// The joints that move each link, from the base to it.
    pub(super) paths: Vec<Vec<usize>>,
    /// Whether each link carries a joint that does not follow it directly.
    pub(super) is_fork: Vec<bool>,
}

impl Tree {
    /// The branches of `joints`; `None` if there are none.
    fn of(joints: &[Segment]) -> Option<Self> {
        let mut paths: Vec<Vec<usize>> = Vec::with_capacity(joints.len());
        let mut is_fork = vec![false; joints.len()];
        let mut is_chain = true;
        for (i, joint) in joints.iter().enumerate() {
            let mut path = joint.parent.map_or_else(Vec::new, |p| paths[p].clone());
            path.push(i);
            paths.push(path);
            if joint.follows(i) {
                continue;
            }
            is_chain = false;
            if let Some(parent) = joint.parent {
                is_fork[parent] = true;
            }
        }
        (!is_chain).then_some(Self { paths, is_fork })
    }
}

impl Geometry {
    pub(super) fn new(robot: &RobotDescription) -> Self {
        let floating = robot.floating_base.is_some();
        let on_joints = floating.then(|| robot.on_base_joints());
        let robot = on_joints.as_ref().unwrap_or(robot);
        let loaded = |(i, joint): (usize, &Joint)| joint.link.is_some().then_some(i);
        let segments: Vec<Segment> = robot.joints.iter().map(Segment::from).collect();
        Self {
            gravity: robot.gravity,
            tree: Tree::of(&segments),
            segments,
            links: robot.joints.iter().enumerate().filter_map(loaded).collect(),
        }
    }

    /// Whether joint `joint` moves link `link`.
    pub(super) fn moves(&self, joint: usize, link: usize) -> bool {
        match &self.tree {
            None => joint <= link,
            Some(tree) => tree.paths[link].contains(&joint),
        }
    }
}

/// The rotation of a vector from the parent's axes to the link's axes.
#[derive(Debug, Clone, Copy)]
pub(super) enum Turn<S> {
    None,
    X(S, S),
    Y(S, S),
    Z(S, S),
    Any(Mat3<S>),
}

impl<S: Scalar> Turn<S> {
    #[inline(always)]
    fn new(segment: &Segment, q: S) -> Self {
        if segment.motion == Motion::Prismatic {
            return Self::None;
        }
        let (s, c) = q.sin_cos();
        match segment.axis {
            [x, 0.0, 0.0] => Self::X(s * x, c),
            [0.0, y, 0.0] => Self::Y(s * y, c),
            [0.0, 0.0, z] => Self::Z(s * z, c),
            axis => Self::Any(inverse_rotation(&axis, s, c)),
        }
    }

    #[inline(always)]
    pub(super) fn apply(&self, v: &Vec3<S>) -> Vec3<S> {
        let [x, y, z] = v.0;
        match self {
            Self::None => *v,
            Self::X(s, c) => Vec3([x, c.fma(y, *s * z), c.fma(z, -(*s * y))]),
            Self::Y(s, c) => Vec3([c.fma(x, -(*s * z)), y, c.fma(z, *s * x)]),
            Self::Z(s, c) => Vec3([c.fma(x, *s * y), c.fma(y, -(*s * x)), z]),
            Self::Any(matrix) => matrix.apply(v),
        }
    }
}

/// The transpose of the rotation about a constant unit axis (Rodrigues).
#[inline(always)]
fn inverse_rotation<S: Scalar>(axis: &[f64; 3], s: S, c: S) -> Mat3<S> {
    let t = S::one() - c;
    let [x, y, z] = *axis;
    Mat3([
        [c + t * (x * x), t * (x * y) + s * z, t * (x * z) - s * y],
        [t * (x * y) - s * z, c + t * (y * y), t * (y * z) + s * x],
        [t * (x * z) + s * y, t * (y * z) - s * x, c + t * (z * z)],
    ])
}

/// Position, velocity and acceleration of one joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointMotion<S> {
    pub(super) q: S,
    pub(super) v: S,
    pub(super) a: S,
}

/// Unit motion of a joint at the frame of a link: rotation and translation.
#[derive(Debug, Clone, Copy)]
struct Unit<S> {
    turn: Vec3<S>,
    shift: Vec3<S>,
}

/// Scratch memory of a sweep.
#[derive(Debug, Clone)]
pub(super) struct Sweep<S> {
    /// Unit motions of the joints that move the present link, from the base to it.
    units: Vec<Unit<S>>,
    /// Unit motions and frames of the links that carry later joints, by link. Empty for a chain.
    forks: Vec<(Vec<Unit<S>>, Frame<S>)>,
    /// Entry `[(link * n_joints + joint) * 10 + parameter]`. Joints that do not move a link stay
    /// zero.
    pub(super) cells: Vec<S>,
}

impl<S: Scalar> Sweep<S> {
    pub(super) fn new(geometry: &Geometry) -> Self {
        let n = geometry.segments.len();
        Self {
            units: Vec::with_capacity(n),
            forks: match geometry.tree {
                None => Vec::new(),
                Some(_) => vec![(Vec::new(), Frame::base(geometry)); n],
            },
            cells: vec![S::zero(); geometry.links.len() * n * LINK_PARAMETERS],
        }
    }

    /// Fill the cells for one motion (or one per lane).
    #[inline(always)]
    pub(super) fn run(&mut self, geometry: &Geometry, motion: &[JointMotion<S>]) {
        let n = geometry.segments.len();
        self.units.clear();
        let mut frame = Frame::base(geometry);
        let mut links = geometry.links.iter().peekable();
        let mut blocks = self.cells.chunks_exact_mut(n * LINK_PARAMETERS);
        for (i, (segment, at)) in geometry.segments.iter().zip(motion).enumerate() {
            if geometry.tree.is_some() && !segment.follows(i) {
                frame = match segment.parent {
                    None => {
                        self.units.clear();
                        Frame::base(geometry)
                    }
                    Some(parent) => {
                        let (units, frame) = &self.forks[parent];
                        self.units.clone_from(units);
                        *frame
                    }
                };
            }
            let turn = Turn::new(segment, at.q);
            let offset = segment.offset(at.q);
            for unit in &mut self.units {
                let moved = unit.turn.cross_add(&offset, &unit.shift);
                unit.shift = turn.apply(&moved);
                unit.turn = turn.apply(&unit.turn);
            }
            frame.step(segment, &turn, &offset, at);
            let along = Vec3::constant(segment.axis);
            self.units.push(match segment.motion {
                Motion::Revolute => Unit {
                    turn: along,
                    shift: Vec3::zero(),
                },
                Motion::Prismatic => Unit {
                    turn: Vec3::zero(),
                    shift: along,
                },
            });
            if links.next_if_eq(&&i).is_some()
                && let Some(block) = blocks.next()
            {
                let stretch = frame.stretch();
                if let Some(tree) = &geometry.tree {
                    for (unit, joint) in self.units.iter().zip(&tree.paths[i]) {
                        let cells = &mut block[joint * LINK_PARAMETERS..][..LINK_PARAMETERS];
                        frame.columns(&stretch, unit, cells);
                    }
                } else {
                    let cells = block.chunks_exact_mut(LINK_PARAMETERS);
                    for (unit, cells) in self.units.iter().zip(cells) {
                        frame.columns(&stretch, unit, cells);
                    }
                }
            }
            if let Some(tree) = &geometry.tree
                && tree.is_fork[i]
            {
                let (units, kept) = &mut self.forks[i];
                units.clone_from(&self.units);
                *kept = frame;
            }
        }
    }
}

impl Segment {
    /// Whether this joint, the one with index `i`, sits on the link before it.
    pub(super) fn follows(&self, i: usize) -> bool {
        self.parent == i.checked_sub(1)
    }

    /// Position of the link's origin in the parent's axes.
    #[inline(always)]
    pub(super) fn offset<S: Scalar>(&self, q: S) -> Vec3<S> {
        let origin = Vec3::constant(self.origin);
        match self.motion {
            Motion::Revolute => origin,
            Motion::Prismatic => Vec3::constant(self.axis).scale_add(q, &origin),
        }
    }

    #[inline(always)]
    pub(super) fn turn<S: Scalar>(&self, q: S) -> Turn<S> {
        Turn::new(self, q)
    }

    /// Unit rotation and unit translation of the joint.
    #[inline(always)]
    pub(super) fn unit<S: Scalar>(&self) -> (Vec3<S>, Vec3<S>) {
        let along = Vec3::constant(self.axis);
        match self.motion {
            Motion::Revolute => (along, Vec3::zero()),
            Motion::Prismatic => (Vec3::zero(), along),
        }
    }
}

/// Motion of a link's frame, in its own axes.
#[derive(Debug, Clone, Copy)]
struct Frame<S> {
    rate: Vec3<S>,
    growth: Vec3<S>,
    /// Acceleration of the origin, minus gravity.
    acceleration: Vec3<S>,
}

impl<S: Scalar> Frame<S> {
    /// The base, which gravity accelerates.
    fn base(geometry: &Geometry) -> Self {
        Self {
            rate: Vec3::zero(),
            growth: Vec3::zero(),
            acceleration: Vec3::constant(geometry.gravity).negate(),
        }
    }

    #[inline(always)]
    fn step(&mut self, segment: &Segment, turn: &Turn<S>, offset: &Vec3<S>, at: &JointMotion<S>) {
        let swing = self.rate.cross(offset);
        let pushed = self.growth.cross_add(offset, &self.acceleration);
        self.acceleration = turn.apply(&self.rate.cross_add(&swing, &pushed));
        self.rate = turn.apply(&self.rate);
        self.growth = turn.apply(&self.growth);
        let along = Vec3::constant(segment.axis);
        let speed = along.scale(at.v);
        match segment.motion {
            Motion::Revolute => {
                self.growth = along.scale_add(at.a, &self.rate.cross_add(&speed, &self.growth));
                self.rate += speed;
            }
            Motion::Prismatic => {
                let twice = speed.scale(S::constant(2.0));
                let slid = self.rate.cross_add(&twice, &self.acceleration);
                self.acceleration = along.scale_add(at.a, &slid);
            }
        }
    }

    /// The transpose of `e x + w x w x`.
    #[inline(always)]
    fn stretch(&self) -> Mat3<S> {
        let [x, y, z] = self.rate.0;
        let [ex, ey, ez] = self.growth.0;
        let (xx, yy, zz) = (x * x, y * y, z * z);
        Mat3([
            [-(yy + zz), x.fma(y, ez), x.fma(z, -ey)],
            [x.fma(y, -ez), -(xx + zz), y.fma(z, ex)],
            [x.fma(z, ey), y.fma(z, -ex), -(xx + yy)],
        ])
    }

    /// Effect of the ten parameters on a joint with unit motion `unit`.
    #[inline(always)]
    fn columns(&self, stretch: &Mat3<S>, unit: &Unit<S>, out: &mut [S]) {
        let (s, w, e) = (&unit.turn.0, &self.rate.0, &self.growth.0);
        let u = unit.turn.cross(&self.rate).0;
        let first = self
            .acceleration
            .cross_add(&unit.turn, &stretch.apply(&unit.shift));
        let own = |k: usize| s[k].fma(e[k], u[k] * w[k]);
        let mixed =
            |i: usize, j: usize| s[i].fma(e[j], s[j].fma(e[i], u[i].fma(w[j], u[j] * w[i])));
        let values = [
            unit.shift.dot(&self.acceleration),
            first.0[0],
            first.0[1],
            first.0[2],
            own(0),
            own(1),
            own(2),
            mixed(0, 1),
            mixed(0, 2),
            mixed(1, 2),
        ];
        for (out, value) in out.iter_mut().zip(values) {
            *out = value;
        }
    }
}
