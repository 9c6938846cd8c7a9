//! Effects at their places in a plant, with their own states.

use crate::effect::Kernel;
use std::ops::Range;
use std::sync::Arc;

/// An effect, with the range of its own states among those of all effects.
#[derive(Clone)]
pub(super) struct Own<S> {
    pub(super) kernel: Arc<dyn Kernel<S>>,
    pub(super) internal: Range<usize>,
}

/// An effect between two axes.
#[derive(Clone)]
pub(super) struct OnPair<S> {
    pub(super) axes: [usize; 2],
    pub(super) own: Own<S>,
}
