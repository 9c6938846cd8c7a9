//! Scalars for which effects by name and the linear plant are compiled.
//!
//! Later crates use these copies; see [`axisight_plant::compiled`].

use crate::plant::{assemble, stepper};
use crate::simulation::simulate_linear;
use axisight_plant::simulation::Sample;
use axisight_scalar::{Lanes, Scalar};
use std::hint::black_box;

/// Reference every function that later crates call, for the scalars of
/// [`axisight_plant::compiled`]. The linear plant has no derivatives.
#[inline(never)] // or it would be compiled above, where it is not called
pub fn compiled() {
    axisight_plant::for_compiled_scalars!(effects);
    linear::<f64>();
    linear::<Lanes<4>>();
    linear::<Lanes<8>>();
}

fn effects<S: Scalar>() {
    black_box(assemble::<S> as fn(_, _, _) -> _);
}

fn linear<S: Scalar>() {
    black_box(stepper::<S> as fn(_, _, _) -> _);
    black_box(simulate_linear::<S> as fn(_, _, &mut dyn FnMut(&Sample<'_, S>)) -> _);
}
