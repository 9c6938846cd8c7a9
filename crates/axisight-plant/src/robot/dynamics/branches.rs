//! Branches: where a sweep leaves one link and goes on at another.
//!
//! The sweeps go over the joints in order. As long as each joint sits on the link before it, the
//! state of the sweep is in registers. A *fork* is a link that also carries a joint further on in
//! the order. The sweeps outwards keep their state there, and the sweeps inwards add up there what
//! comes from its branches.

use super::{Frame, Moments, Screw};
use crate::robot::chain::ChainJoint;
use crate::robot::vector::Vec3;
use axisight_scalar::Scalar;

/// Where a joint that does not sit on the link before it begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Start {
    /// On the base.
    Base,
    /// On the link of the fork with this number.
    Fork(usize),
}

/// The place of a joint in the tree.
#[derive(Debug, Clone, Default)]
pub(super) struct Branch {
    /// Where it begins; `None` on the link before it.
    pub(super) start: Option<Start>,
    /// Number of the fork that its link is.
    pub(super) fork: Option<usize>,
    /// The joints that move its link, itself included, one bit each.
    path: u64,
}

impl Branch {
    /// Whether joint `i` moves the link of this joint.
    #[inline(always)]
    pub(super) fn is_moved_by(&self, i: usize) -> bool {
        self.path >> i & 1 == 1
    }
}

/// The places of all joints. Links before them in the order carry them.
pub(super) fn branches<S>(joints: &[ChainJoint<S>]) -> Vec<Branch> {
    let mut out = vec![Branch::default(); joints.len()];
    let mut forks = 0;
    for (i, joint) in joints.iter().enumerate() {
        let before = joint.parent.map_or(0, |parent| out[parent].path);
        // Dynamics has no more joints than bits; `Plant` refuses longer chains.
        let own = u32::try_from(i).ok().and_then(|bit| 1_u64.checked_shl(bit));
        out[i].path = before | own.unwrap_or(0);
        if joint.parent == i.checked_sub(1) {
            continue;
        }
        let Some(parent) = joint.parent else {
            out[i].start = Some(Start::Base);
            continue;
        };
        let fork = *out[parent].fork.get_or_insert(forks);
        forks = forks.max(fork + 1);
        out[i].start = Some(Start::Fork(fork));
    }
    out
}

/// State of the sweeps at a fork.
#[derive(Debug, Clone)]
pub(super) struct Fork<S> {
    pub(super) frame: Frame<S>,
    pub(super) motion: LinkMotion<S>,
    /// Moments of the branches that have been swept.
    pub(super) moments: Moments<S>,
    /// Wrench on these branches.
    pub(super) wrench: Screw<S>,
}

impl<S: Scalar> Fork<S> {
    pub(super) fn new() -> Self {
        Self {
            frame: Frame::base(),
            motion: LinkMotion::base(&[S::zero(); 3]),
            moments: Moments::zero(),
            wrench: Screw::zero(),
        }
    }
}

/// Motion of a link in a sweep outwards.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinkMotion<S> {
    pub(super) velocity: Screw<S>,
    /// Acceleration minus gravity.
    pub(super) acceleration: Screw<S>,
}

impl<S: Scalar> LinkMotion<S> {
    /// Motion of the base: gravity enters as an acceleration.
    #[inline(always)]
    pub(super) fn base(gravity: &[S; 3]) -> Self {
        Self {
            velocity: Screw::zero(),
            acceleration: Screw {
                angular: Vec3::zero(),
                linear: Vec3(gravity.map(|g| -g)),
            },
        }
    }
}
