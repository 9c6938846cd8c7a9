//! Equations of motion of a chain or a tree of joints, as the integrators call them.
//!
//! The terms that depend on the joint angles alone come first: joint axes, masses and the inertia
//! matrix (composite rigid bodies). The rates then give the bias forces (recursive Newton-Euler),
//! which can be evaluated again at the same angles. The method is that of Featherstone (2008),
//! *Rigid Body Dynamics Algorithms*, chapters 5 and 6.
//!
//! All quantities are in base-frame axes about the base origin, so that only sums, cross products
//! and inner products remain. Massless links and coinciding joints, which are common in elastic
//! robot models, are skipped. The nominal robot (7 joints, 3 bodies) takes about 1,400
//! multiply-adds, 350 of them for the rates.
//!
//! The code is compiled for a few numbers of joints, so that its loops are unrolled. A chain just
//! below one of these numbers is padded with joints that move nothing. Longer chains share the code
//! for any number of joints. So do trees, and numbers with derivatives, because their arithmetic
//! takes much longer than the loops. Only this code looks for branches.

mod branches;
mod floating;
mod frame;
mod spatial;
mod specific_force;

use self::branches::{Branch, Fork, LinkMotion, Start, branches};
pub use self::floating::{BASE_COORDINATES, BaseMotion, FloatingBody};
use self::frame::Frame;
use self::spatial::{Moments, Screw};
use super::along::Along;
use super::chain::{Chain, ChainJoint};
use super::description::Motion;
use super::linear_algebra::{factorize, solve_factorized};
use axisight_scalar::Scalar;

/// How a joint moves its link. Separate cases for coordinate axes save two thirds of the work.
#[derive(Debug, Clone, Copy)]
enum Turn {
    X { reversed: bool },
    Y { reversed: bool },
    Z { reversed: bool },
    About([f64; 3]),
    Along([f64; 3]),
}

impl Turn {
    fn new(motion: Motion, axis: [f64; 3]) -> Self {
        match (motion, axis) {
            (Motion::Prismatic, _) => Self::Along(axis),
            (Motion::Revolute, [x, 0.0, 0.0]) => Self::X { reversed: x < 0.0 },
            (Motion::Revolute, [0.0, y, 0.0]) => Self::Y { reversed: y < 0.0 },
            (Motion::Revolute, [0.0, 0.0, z]) => Self::Z { reversed: z < 0.0 },
            (Motion::Revolute, _) => Self::About(axis),
        }
    }
}

/// One joint with the link that it moves, prepared for the sweeps.
#[derive(Debug, Clone)]
struct Segment<S> {
    branch: Branch,
    turn: Turn,
    origin: Option<[f64; 3]>,
    shift: Option<[S; 3]>,
    zero: S,
    body: Option<Moments<S>>,
}

impl<S: Scalar> Segment<S> {
    fn new(joint: &ChainJoint<S>, branch: Branch) -> Self {
        Self {
            branch,
            turn: Turn::new(joint.motion, joint.axis),
            origin: joint.origin,
            shift: joint.shift,
            zero: joint.zero,
            body: joint.body.as_ref().map(Moments::of),
        }
    }
}

/// Equations of motion of a chain or tree with fixed mass properties.
#[derive(Debug, Clone)]
pub struct Dynamics<S> {
    gravity: [S; 3],
    segments: Vec<Segment<S>>,
    /// Whether some joint does not sit on the link before it.
    is_tree: bool,
    /// Number of links that carry such joints.
    n_forks: usize,
}

/// Scratch memory and results of one evaluation, padded to a compiled size.
#[derive(Debug, Clone)]
pub struct DynamicsScratch<S: Scalar> {
    /// The run along which the arm is linearised, if any.
    pub(crate) along: Option<Along<S>>,
    /// Inertia matrix M(q): entry (i, j) for `i <= j`, row-major. Padding has unit inertia.
    inertia: Vec<S>,
    /// Coriolis, centrifugal and gravity forces `c(q, q') + g(q)`; zero for padding.
    bias: Vec<S>,
    angles: Vec<S>,
    trigonometry: Vec<(S, S)>,
    axes: Vec<Screw<S>>,
    /// Moments of the links about the base origin, in base axes.
    moments: Vec<Moments<S>>,
    wrenches: Vec<Screw<S>>,
    forks: Vec<Fork<S>>,
}

/// View of the scratch memory with a compiled size.
struct Sized<'a, S, const N: usize> {
    /// Number of joints, padding included: `N`, unless the code serves any number.
    n: usize,
    inertia: &'a mut [[S; N]; N],
    bias: &'a mut [S; N],
    angles: &'a mut [S; N],
    trigonometry: &'a mut [(S, S); N],
    axes: &'a mut [Screw<S>; N],
    moments: &'a mut [Moments<S>; N],
    wrenches: &'a mut [Screw<S>; N],
    /// Empty for chains.
    forks: &'a mut [Fork<S>],
}

impl<S: Scalar> DynamicsScratch<S> {
    /// Forces on the joints, padding included. They are bias forces after [`Dynamics::add_rates`]
    /// and accelerations after [`Dynamics::solve`].
    pub fn forces(&mut self) -> &mut [S] {
        &mut self.bias
    }

    /// Add the inertia of a rotor that turns with a joint, before [`Dynamics::factorize`].
    pub fn add_inertia(&mut self, joint: usize, inertia: S) {
        let n = self.bias.len();
        if let Some(entry) = self.inertia.get_mut(joint * n + joint) {
            *entry += inertia;
        }
    }

    /// View for a chain of `len` joints; `None` if the scratch was made for another size.
    #[inline(always)]
    fn sized<const N: usize>(&mut self, len: usize) -> Option<Sized<'_, S, N>> {
        Some(Sized {
            n: rows::<N>(len),
            inertia: self.inertia.as_chunks_mut().0.first_chunk_mut()?,
            bias: self.bias.first_chunk_mut()?,
            angles: self.angles.first_chunk_mut()?,
            trigonometry: self.trigonometry.first_chunk_mut()?,
            axes: self.axes.first_chunk_mut()?,
            wrenches: self.wrenches.first_chunk_mut()?,
            moments: self.moments.first_chunk_mut()?,
            forks: if branched::<N>() {
                &mut self.forks
            } else {
                &mut []
            },
        })
    }

    /// The number of used rows, the inertia matrix and the forces. A view of the whole scratch
    /// would take as long as a solve.
    #[inline(always)]
    #[allow(clippy::type_complexity)] // seen twice, ten lines below
    fn system<const N: usize>(
        &mut self,
        len: usize,
    ) -> Option<(usize, &mut [[S; N]; N], &mut [S; N])> {
        let inertia = self.inertia.as_chunks_mut().0.first_chunk_mut()?;
        Some((rows::<N>(len), inertia, self.bias.first_chunk_mut()?))
    }
}

/// Number of used rows for a chain of `len` joints, padding included.
const fn rows<const N: usize>(len: usize) -> usize {
    if N == MOST_JOINTS { len } else { N }
}

/// Whether the code for `N` joints serves trees.
const fn branched<const N: usize>() -> bool {
    N == MOST_JOINTS
}

/// Inertia matrix and bias forces, for callers outside of the integrators.
#[derive(Debug, Clone)]
pub struct DynamicsState<S> {
    /// Inertia matrix M(q), row-major `n * n`.
    pub inertia: Vec<S>,
    /// Coriolis, centrifugal and gravity forces `c(q, q') + g(q)`.
    pub bias: Vec<S>,
}

/// Largest number of joints. Code of this size serves any number of joints, and trees.
pub const MOST_JOINTS: usize = 32;

/// Call `$method::<N>($arguments)` for the smallest compiled size that holds the joints.
macro_rules! sized {
    ($object:ident . $method:ident ( $($argument:expr),* )) => {
        if const { S::PARTIALS > 0 } || $object.is_tree {
            $object.$method::<MOST_JOINTS>($($argument),*)
        } else {
            match $object.len() {
                0..=1 => $object.$method::<1>($($argument),*),
                2..=3 => $object.$method::<3>($($argument),*),
                4..=7 => $object.$method::<7>($($argument),*),
                _ => $object.$method::<MOST_JOINTS>($($argument),*),
            }
        }
    };
}

impl<S: Scalar> Dynamics<S> {
    /// Equations of motion of `chain`.
    pub fn new(chain: &Chain<S>) -> Self {
        let branches = branches(&chain.joints);
        let forks = branches.iter().filter(|branch| branch.fork.is_some());
        let n_forks = forks.count();
        let is_tree = branches.iter().any(|branch| branch.start.is_some());
        let joints = chain.joints.iter().zip(branches);
        Self {
            gravity: chain.gravity,
            segments: joints
                .map(|(joint, branch)| Segment::new(joint, branch))
                .collect(),
            is_tree,
            n_forks,
        }
    }

    /// Number of joints.
    pub fn len(&self) -> usize {
        self.segments.len()
    }

    /// Whether the chain has no joints.
    pub fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// Inertia matrix and bias forces at joint angles `q` [rad or m] and rates `v`.
    #[inline(never)]
    pub fn evaluate(&self, q: &[S], v: &[S]) -> DynamicsState<S> {
        let n = self.len();
        let mut scratch = self.scratch();
        self.place(q, &mut scratch);
        self.add_rates(v, &mut scratch);
        let padded = scratch.bias.len();
        let entry = |i: usize, j: usize| scratch.inertia[i.min(j) * padded + i.max(j)];
        DynamicsState {
            inertia: (0..n * n).map(|k| entry(k / n, k % n)).collect(),
            bias: scratch.bias[..n].to_vec(),
        }
    }

    /// Forces on the joints along a motion, `M(q) a + c(q, v) + g(q)`, written to `force`.
    #[inline(never)]
    pub fn forces_along(
        &self,
        q: &[S],
        v: &[S],
        a: &[S],
        scratch: &mut DynamicsScratch<S>,
        force: &mut [S],
    ) {
        self.place(q, scratch);
        self.add_rates(v, scratch);
        let padded = scratch.bias.len();
        for (i, force) in force.iter_mut().enumerate() {
            let entry = |j: usize| scratch.inertia[i.min(j) * padded + i.max(j)];
            let accelerated = a.iter().enumerate();
            *force = accelerated.fold(scratch.bias[i], |sum, (j, a)| entry(j).fma(*a, sum));
        }
    }

    /// Accelerations of the joints under the forces `tau` [Nm or N], written to `acceleration`.
    pub fn accelerate(
        &self,
        q: &[S],
        v: &[S],
        tau: &[S],
        scratch: &mut DynamicsScratch<S>,
        acceleration: &mut [S],
    ) {
        self.place(q, scratch);
        self.add_rates(v, scratch);
        self.factorize(scratch);
        for (i, f) in scratch.bias.iter_mut().enumerate() {
            *f = tau.get(i).map_or_else(S::zero, |t| *t - *f);
        }
        self.solve(scratch);
        for (out, a) in acceleration.iter_mut().zip(&scratch.bias) {
            *out = *a;
        }
    }

    /// Scratch memory for an evaluation.
    pub fn scratch(&self) -> DynamicsScratch<S> {
        let n = sized!(self.padded_size());
        DynamicsScratch {
            along: None,
            inertia: vec![S::zero(); n * n],
            bias: vec![S::zero(); n],
            angles: vec![S::zero(); n],
            trigonometry: vec![(S::zero(), S::zero()); n],
            axes: vec![Screw::zero(); n],
            moments: vec![Moments::zero(); n],
            wrenches: vec![Screw::zero(); n],
            forks: vec![Fork::new(); self.n_forks],
        }
    }

    #[allow(clippy::unused_self)] // called like the other sized methods
    fn padded_size<const N: usize>(&self) -> usize {
        N
    }

    /// Compute the inertia matrix at angles `q`, with everything that [`Dynamics::add_rates`]
    /// needs.
    pub fn place(&self, q: &[S], scratch: &mut DynamicsScratch<S>) {
        if let Some(along) = &mut scratch.along {
            return along.place(q);
        }
        sized!(self.place_sized(q, scratch));
    }

    /// Compute the bias forces at rates `v` and the angles set last.
    pub fn add_rates(&self, v: &[S], scratch: &mut DynamicsScratch<S>) {
        if let Some(along) = &mut scratch.along {
            return along.bias(v, &mut scratch.bias);
        }
        sized!(self.add_rates_sized(v, scratch));
    }

    /// Factorize the inertia matrix in place.
    pub fn factorize(&self, scratch: &mut DynamicsScratch<S>) {
        if scratch.along.is_some() {
            return;
        }
        sized!(self.factorize_sized(scratch));
    }

    /// Replace forces by accelerations, with the factorized inertia matrix.
    pub fn solve(&self, scratch: &mut DynamicsScratch<S>) {
        if let Some(along) = &mut scratch.along {
            return along.accelerate(&mut scratch.bias);
        }
        sized!(self.solve_sized(scratch));
    }

    #[inline(never)]
    fn factorize_sized<const N: usize>(&self, scratch: &mut DynamicsScratch<S>) {
        if let Some((n, inertia, _)) = scratch.system::<N>(self.len()) {
            factorize(inertia, n);
        }
    }

    #[inline(never)]
    fn solve_sized<const N: usize>(&self, scratch: &mut DynamicsScratch<S>) {
        if let Some((n, inertia, forces)) = scratch.system::<N>(self.len()) {
            solve_factorized(inertia, forces, n);
        }
    }

    #[inline(never)]
    fn place_sized<const N: usize>(&self, q: &[S], scratch: &mut DynamicsScratch<S>) {
        for ((angle, q), segment) in scratch.angles.iter_mut().zip(q).zip(&self.segments) {
            *angle = *q + segment.zero;
        }
        if let Some(mut sized) = scratch.sized::<N>(self.len()) {
            self.sweep_out(&mut sized);
            self.compose(&mut sized);
        }
    }

    #[inline(never)]
    fn add_rates_sized<const N: usize>(&self, v: &[S], scratch: &mut DynamicsScratch<S>) {
        let Some(sized) = scratch.sized::<N>(self.len()) else {
            return;
        };
        let base = LinkMotion::base(&self.gravity);
        let LinkMotion {
            mut velocity,
            mut acceleration,
        } = base;
        for (i, (segment, v)) in self.segments.iter().zip(v).enumerate().take(N) {
            if branched::<N>()
                && let Some(start) = segment.branch.start
            {
                LinkMotion {
                    velocity,
                    acceleration,
                } = match start {
                    Start::Base => base,
                    Start::Fork(fork) => sized.forks[fork].motion,
                };
            }
            let motion = sized.axes[i].scale(*v);
            velocity.turn_add(&motion, &mut acceleration);
            velocity.add(&motion);
            if segment.body.is_some() {
                let moments = &sized.moments[i];
                let mut wrench = moments.wrench(&acceleration);
                velocity.turn_momentum_add(&moments.wrench(&velocity), &mut wrench);
                sized.wrenches[i] = wrench;
            }
            if branched::<N>()
                && let Some(fork) = segment.branch.fork
            {
                sized.forks[fork].motion = LinkMotion {
                    velocity,
                    acceleration,
                };
                sized.forks[fork].wrench = Screw::zero();
            }
        }
        let mut tip = Screw::zero();
        for (i, segment) in self.segments.iter().enumerate().take(N).rev() {
            if branched::<N>()
                && let Some(fork) = segment.branch.fork
            {
                tip.add(&sized.forks[fork].wrench);
            }
            if segment.body.is_some() {
                tip.add(&sized.wrenches[i]);
            }
            sized.bias[i] = sized.axes[i].dot(&tip);
            if branched::<N>()
                && let Some(start) = segment.branch.start
            {
                if let Start::Fork(fork) = start {
                    sized.forks[fork].wrench.add(&tip);
                }
                tip = Screw::zero();
            }
        }
    }

    #[inline(always)]
    fn sweep_out<const N: usize>(&self, sized: &mut Sized<'_, S, N>) {
        let n = sized.n.min(N);
        S::sin_cos_each(&sized.angles[..n], &mut sized.trigonometry[..n]);
        let mut frame = Frame::base();
        for (i, segment) in self.segments.iter().enumerate().take(N) {
            if branched::<N>()
                && let Some(start) = segment.branch.start
            {
                frame = match start {
                    Start::Base => Frame::base(),
                    Start::Fork(fork) => sized.forks[fork].frame,
                };
            }
            if let Some(origin) = &segment.origin {
                frame.position += frame.apply_constant(origin);
            }
            if let Some(shift) = &segment.shift {
                frame.position += frame.apply(shift);
            }
            let (turned, screw) = (sized.trigonometry[i], &mut sized.axes[i]);
            match segment.turn {
                Turn::X { reversed } => frame.turn::<0>(reversed, turned, screw),
                Turn::Y { reversed } => frame.turn::<1>(reversed, turned, screw),
                Turn::Z { reversed } => frame.turn::<2>(reversed, turned, screw),
                Turn::About(axis) => frame.turn_about(&axis, turned, screw),
                Turn::Along(axis) => frame.slide(&axis, sized.angles[i], screw),
            }
            if let Some(body) = &segment.body {
                sized.moments[i] = frame.moments(body);
            }
            if branched::<N>()
                && let Some(fork) = segment.branch.fork
            {
                sized.forks[fork].frame = frame;
                sized.forks[fork].moments = Moments::zero();
            }
        }
    }

    /// Clear the inertia between joints of which none moves the other.
    #[inline(never)]
    fn clear_apart<const N: usize>(&self, sized: &mut Sized<'_, S, N>) {
        for (j, segment) in self.segments.iter().enumerate() {
            for i in (0..j).filter(|i| !segment.branch.is_moved_by(*i)) {
                sized.inertia[i][j] = S::zero();
            }
        }
    }

    #[inline(always)]
    fn compose<const N: usize>(&self, sized: &mut Sized<'_, S, N>) {
        let mut tip = Moments::zero();
        // The wrench on all outer links for a unit acceleration of each joint.
        for (i, segment) in self.segments.iter().enumerate().take(N).rev() {
            if branched::<N>()
                && let Some(fork) = segment.branch.fork
            {
                tip.add(&sized.forks[fork].moments);
            }
            if segment.body.is_some() {
                tip.add(&sized.moments[i]);
            }
            sized.wrenches[i] = tip.wrench(&sized.axes[i]);
            if branched::<N>()
                && let Some(start) = segment.branch.start
            {
                if let Start::Fork(fork) = start {
                    sized.forks[fork].moments.add(&tip);
                }
                tip = Moments::zero();
            }
        }
        for i in 0..sized.n {
            for j in i..sized.n {
                sized.inertia[i][j] = sized.axes[i].dot(&sized.wrenches[j]);
            }
        }
        if branched::<N>() && self.is_tree {
            self.clear_apart(sized);
        }
        for i in self.len()..sized.n {
            sized.inertia[i][i] = S::one();
        }
    }
}
