//! Scalars for which the plant is compiled.
//!
//! A generic function is compiled in the first crate that uses it with a type, and later crates use
//! that copy unless it is inlined. This module uses the dynamics and integrators, so they are
//! compiled once and not again with every change of a crate that simulates or fits.

use crate::plant::{Plant, equilibrium};
use crate::robot::Dynamics;
use crate::simulation::{Sample, Stepper, simulate};
use axisight_scalar::Scalar;
use std::hint::black_box;

/// Call `$keep` for every compiled scalar.
///
/// The scalars are: one run; runs in lock-step; runs in lock-step with derivatives along one, two
/// or four parameters, for fits; and one run with eight derivatives, for Jacobians.
#[macro_export]
macro_rules! for_compiled_scalars {
    ($keep:ident) => {
        $keep::<f64>();
        $keep::<axisight_scalar::Lanes<4>>();
        $keep::<axisight_scalar::Lanes<8>>();
        $keep::<axisight_scalar::Dual<f64, 8>>();
        $keep::<axisight_scalar::Dual<axisight_scalar::Lanes<4>, 1>>();
        $keep::<axisight_scalar::Dual<axisight_scalar::Lanes<4>, 2>>();
        $keep::<axisight_scalar::Dual<axisight_scalar::Lanes<4>, 4>>();
    };
}

/// Reference every function that later crates call, for every scalar.
#[inline(never)] // or it would be compiled above, where it is not called
pub fn compiled() {
    for_compiled_scalars!(keep);
}

fn keep<S: Scalar>() {
    black_box(simulate::<S> as fn(_, _, _, &mut dyn FnMut(&Sample<'_, S>)) -> _);
    black_box(equilibrium::<S> as fn(_, _) -> _);
    black_box(Plant::<S>::with_kernels as fn(_, _, _) -> _);
    black_box(Dynamics::<S>::evaluate as fn(_, _, _) -> _);
    black_box(Dynamics::<S>::forces_along as fn(_, _, _, _, _, _));
    black_box(Stepper::<S>::new as fn(_) -> _);
    black_box(Stepper::<S>::along as fn(_, _) -> _);
}
