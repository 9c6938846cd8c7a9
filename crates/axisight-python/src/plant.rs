//! The equations of a robot at single states, for external simulators.

use crate::convert::{array1, array2, rows};
use crate::effects::{EffectTuple, settings};
use crate::entry::input_error;
use crate::robot::Robot;
use axisight_core::plant::{assemble, equilibrium};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

/// Rates of states `(m, n_states)` under delivered motor torques `(n_axes,)`, the same for all
/// states.
#[pyfunction]
pub fn state_rates<'py>(
    py: Python<'py>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    state: PyReadonlyArray2<'py, f64>,
    torque: Vec<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let n_axes = robot.description.n_axes();
    if torque.len() != n_axes {
        let got = torque.len();
        return Err(input_error(format!(
            "torque: expected {n_axes} numbers, got {got}"
        )));
    }
    let plant =
        assemble::<f64>(&robot.description, &[], &settings(effects)).map_err(input_error)?;
    let width = plant.n_states();
    let states = rows(&state, "state", width)?;
    let mut scratch = plant.scratch();
    let mut rates = vec![0.0; states.len()];
    for (state, out) in states
        .chunks_exact(width)
        .zip(rates.chunks_exact_mut(width))
    {
        plant.derivative(state, &torque, &torque, &mut scratch, out);
    }
    array2(py, rates, width)
}

/// State of a robot at rest at joint angles, including the states of effects.
#[pyfunction]
pub fn state_at_rest<'py>(
    py: Python<'py>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    joint_angle: Vec<f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let plant =
        assemble::<f64>(&robot.description, &[], &settings(effects)).map_err(input_error)?;
    let rest = equilibrium(&plant, &joint_angle).map_err(input_error)?;
    Ok(array1(py, plant.state_at_rest(&rest)))
}
