//! The numbers the plant is compiled for.
//!
//! A generic function is compiled in the first crate that asks for it, and crates above use that
//! copy as long as it is not inlined. Asked for here, the dynamics and the integrators are
//! compiled once, and not anew whenever a crate that simulates or fits is.

use crate::plant::{Plant, equilibrium};
use crate::robot::Dynamics;
use crate::simulation::{Sample, Stepper, simulate};
use axisight_scalar::Scalar;
use std::hint::black_box;

/// Call `$keep` for every scalar: one run; runs in lock-step; both with derivatives along one, two
/// or four parameters for fits; eight derivatives of one run for Jacobians.
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

/// Everything that crates above call, for every scalar.
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
