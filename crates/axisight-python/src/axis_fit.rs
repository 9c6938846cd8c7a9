//! Fits of one axis as a chain of masses.

use crate::convert::{array1, array2};
use crate::entry::{CancelToken, InputError, detached, flag, input_error};
use axisight_fit::axis::{
    AxisError, AxisModel, AxisProblem, AxisSet, Hold, Output, SearchOptions, SearchParameter,
    SearchResult, search,
};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// Structure of an axis model, from Python.
#[derive(FromPyObject)]
pub struct ModelSpec {
    masses: usize,
    output: String,
    hold: String,
    smoothing: f64,
    ripple_orders: Vec<f64>,
    substeps: usize,
}

/// One parameter: initial value, lower bound, upper bound, scale, whether it is free.
type ParameterTuple = (f64, f64, f64, f64, bool);
/// One data set: torque, output, sample time, weight, samples per block.
type SetTuple<'py> = (
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
    f64,
    f64,
    usize,
);

fn model(spec: ModelSpec) -> PyResult<AxisModel> {
    let wrong = |field: &str, expected: &str, got: &str| {
        Err(InputError::new_err(format!(
            "{field}: expected {expected}, got {got:?}"
        )))
    };
    let output = match spec.output.as_str() {
        "velocity" => Output::Velocity,
        "velocity_difference" => Output::VelocityDifference,
        "position" => Output::Position,
        other => return wrong("output", "velocity, velocity_difference or position", other),
    };
    let hold = match spec.hold.as_str() {
        "zero" => Hold::Zero,
        "first" => Hold::First,
        other => return wrong("hold", "zero or first", other),
    };
    Ok(AxisModel {
        masses: spec.masses,
        output,
        hold,
        smoothing: spec.smoothing,
        ripple_orders: spec.ripple_orders,
        substeps: spec.substeps,
    })
}

fn sets(data: &[SetTuple<'_>]) -> Vec<AxisSet> {
    let set =
        |(number, (torque, output, sample_time, weight, block)): (usize, &SetTuple<'_>)| AxisSet {
            number,
            torque: torque.as_array().to_vec(),
            output: output.as_array().to_vec(),
            sample_time: *sample_time,
            weight: *weight,
            block: *block,
        };
    data.iter().enumerate().map(set).collect()
}

fn parameters(tuples: &[ParameterTuple]) -> Vec<SearchParameter> {
    let one = |(initial, lower, upper, scale, free): &ParameterTuple| SearchParameter {
        initial: *initial,
        lower: *lower,
        upper: *upper,
        scale: *scale,
        free: *free,
    };
    tuples.iter().map(one).collect()
}

fn fit_error(error: AxisError) -> PyErr {
    match error {
        AxisError::Cancelled => PyKeyboardInterrupt::new_err("cancelled"),
        other => input_error(other),
    }
}

/// Result of a search: status, parameters, loss, initial loss, iterations, evaluations, normal
/// matrix over the free parameters, residuals, gradients of the blocks.
type Outcome<'py> = (
    &'static str,
    Bound<'py, PyArray1<f64>>,
    f64,
    f64,
    usize,
    usize,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
);

/// A vector over samples, and a matrix.
type VectorAndMatrix<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

fn outcome<'py>(py: Python<'py>, result: SearchResult) -> PyResult<Outcome<'py>> {
    let free = result.normal.gradient.len();
    Ok((
        result.status.name(),
        array1(py, result.theta),
        result.loss,
        result.initial_loss,
        result.iterations,
        result.evaluations,
        array2(py, result.normal.matrix.as_slice().to_vec(), free)?,
        array1(py, result.residual),
        array2(py, result.block_gradients, free)?,
    ))
}

/// Minimize the prediction error from one start.
#[pyfunction]
#[pyo3(signature = (model, sets, parameters, *, whitening, predicts, max_iterations, loss_tolerance, step_tolerance, cancel=None))]
#[allow(clippy::too_many_arguments)]
pub fn axis_fit<'py>(
    py: Python<'py>,
    model: ModelSpec,
    sets: Vec<SetTuple<'py>>,
    parameters: Vec<ParameterTuple>,
    whitening: Vec<f64>,
    predicts: bool,
    max_iterations: usize,
    loss_tolerance: f64,
    step_tolerance: f64,
    cancel: Option<&Bound<'py, CancelToken>>,
) -> PyResult<Outcome<'py>> {
    let cancel = flag(cancel);
    let model = self::model(model)?;
    let (data, parameters) = (self::sets(&sets), self::parameters(&parameters));
    let options = SearchOptions {
        max_iterations,
        loss_tolerance,
        step_tolerance,
    };
    let result = detached(py, &cancel, || {
        let problem = AxisProblem::new(model, data, whitening, predicts, &cancel)?;
        search(&problem, &parameters, options)
    })?;
    outcome(py, result.map_err(fit_error)?)
}

/// Return residuals `(n_residuals,)` and their derivatives `(n_free, n_residuals)`, data set by
/// data set.
#[pyfunction]
#[pyo3(signature = (model, sets, theta, free, *, whitening, predicts, cancel=None))]
#[allow(clippy::too_many_arguments)]
pub fn axis_linearize<'py>(
    py: Python<'py>,
    model: ModelSpec,
    sets: Vec<SetTuple<'py>>,
    theta: Vec<f64>,
    free: Vec<usize>,
    whitening: Vec<f64>,
    predicts: bool,
    cancel: Option<&Bound<'py, CancelToken>>,
) -> PyResult<VectorAndMatrix<'py>> {
    let cancel = flag(cancel);
    let model = self::model(model)?;
    let data = self::sets(&sets);
    let result = detached(py, &cancel, || {
        let problem = AxisProblem::new(model, data, whitening, predicts, &cancel)?;
        problem.linearize(&theta, &free)
    })?;
    let out = result.map_err(fit_error)?;
    let n = out.residual.len();
    Ok((
        array1(py, out.residual),
        array2(py, out.columns.concat(), n)?,
    ))
}

/// Run one data set. Return output `(n,)` and states `(n, 2 masses)`: motor angle, deflections,
/// speeds.
#[pyfunction]
#[pyo3(signature = (model, set, theta, *, predicts, cancel=None))]
pub fn axis_simulate<'py>(
    py: Python<'py>,
    model: ModelSpec,
    set: SetTuple<'py>,
    theta: Vec<f64>,
    predicts: bool,
    cancel: Option<&Bound<'py, CancelToken>>,
) -> PyResult<VectorAndMatrix<'py>> {
    let cancel = flag(cancel);
    let model = self::model(model)?;
    let columns = 2 * model.masses;
    let data = sets(std::slice::from_ref(&set));
    let result = detached(py, &cancel, || {
        let problem = AxisProblem::new(model, data, Vec::new(), predicts, &cancel)?;
        problem.trajectory(&theta, 0)
    })?;
    let out = result.map_err(fit_error)?;
    Ok((array1(py, out.output), array2(py, out.states, columns)?))
}
