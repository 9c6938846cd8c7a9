//! Simulation of one run.

use crate::convert::{array2, rows};
use crate::effects::{EffectTuple, settings};
use crate::entry::{CancelToken, detached, flag, input_error};
use crate::robot::Robot;
use axisight_core::robot::Plant;
use axisight_core::simulation::{
    self, Drive, Effort, Method, Run, Sample, SimulationError, Status, Stepper,
};
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Integrator by name: `rk4` with sub-steps or `dopri5` with a tolerance.
pub fn method(name: &str, substeps: usize, tolerance: f64) -> PyResult<Method> {
    match name {
        "rk4" if substeps >= 1 => Ok(Method::RungeKutta4 { substeps }),
        "rk4" => Err(input_error(format!(
            "substeps: expected at least 1, got {substeps}"
        ))),
        "dopri5" if tolerance > 0.0 && tolerance < 1.0 => Ok(Method::DormandPrince { tolerance }),
        "dopri5" => Err(input_error(format!(
            "tolerance: expected between 0 and 1, got {tolerance}"
        ))),
        _ => Err(input_error(format!(
            "method: expected rk4 or dopri5, got {name}"
        ))),
    }
}

/// White position noise `(n_samples, n_axes)` as a function of seed and run.
#[pyfunction]
pub fn measurement_noise(
    py: Python<'_>,
    seed: u64,
    run: u64,
    n_samples: usize,
    n_axes: usize,
    std: f64,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    array2(
        py,
        simulation::measurement_noise(seed, run, n_samples, n_axes, std),
        n_axes,
    )
}

/// Everything a run records, row-major.
#[derive(Default)]
struct Traces {
    command: Vec<f64>,
    measured: Vec<f64>,
    motor: Vec<f64>,
    joint: Vec<f64>,
    torque_disturbance: Vec<f64>,
    position_disturbance: Vec<f64>,
}

struct Outcome {
    traces: Traces,
    status: Status,
    effort: Effort,
}

/// Simulate one run from rest; `reference` says whether `input` is a velocity reference
/// [rad/s] or a torque [Nm].
#[pyfunction]
#[pyo3(signature = (robot, effects, input, *, reference, noise=None, start=None, method="dopri5", substeps=1, tolerance=1e-7, cancel=None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn simulate<'py>(
    py: Python<'py>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    input: PyReadonlyArray2<'py, f64>,
    reference: bool,
    noise: Option<PyReadonlyArray2<'py, f64>>,
    start: Option<Vec<f64>>,
    method: &str,
    substeps: usize,
    tolerance: f64,
    cancel: Option<&Bound<'py, CancelToken>>,
) -> PyResult<Bound<'py, PyDict>> {
    let n_axes = robot.description.n_axes();
    let field = if reference { "velocity_ref" } else { "torque" };
    let input = rows(&input, field, n_axes)?;
    let noise = noise.map(|n| rows(&n, "noise", n_axes)).transpose()?;
    if noise.as_ref().is_some_and(|n| n.len() != input.len()) {
        return Err(input_error(format!("noise: expected the shape of {field}")));
    }
    let start = start.unwrap_or_else(|| robot.description.operating_point.clone());
    let method = self::method(method, substeps, tolerance)?;
    let plant =
        Plant::<f64>::new(&robot.description, &[], &settings(effects)).map_err(input_error)?;
    let cancel = flag(cancel);
    let (arrays, noises) = ([&input[..]], noise.as_deref().map(|n| [n]));
    let run = Run {
        controller: &robot.description.controller,
        sample_time: robot.description.sample_time,
        start: &start,
        drive: if reference {
            Drive::Reference(&arrays)
        } else {
            Drive::Torque(&arrays)
        },
        noise: noises.as_ref().map_or(&[], |n| &n[..]),
        method,
        cancel: Some(&*cancel),
    };
    let outcome = detached(py, &cancel, || record(&plant, &run))?.map_err(input_error)?;
    let out = PyDict::new(py);
    let traces = outcome.traces;
    out.set_item("torque_cmd_nm", array2(py, traces.command, n_axes)?)?;
    out.set_item("position_rad", array2(py, traces.measured, n_axes)?)?;
    out.set_item("motor_position_rad", array2(py, traces.motor, n_axes)?)?;
    out.set_item(
        "joint_position_rad",
        array2(py, traces.joint, robot.description.n_joints())?,
    )?;
    out.set_item(
        "torque_disturbance_nm",
        array2(py, traces.torque_disturbance, n_axes)?,
    )?;
    out.set_item(
        "position_disturbance_rad",
        array2(py, traces.position_disturbance, n_axes)?,
    )?;
    let (status, at) = match outcome.status {
        Status::Completed => ("completed", None),
        Status::Diverged(k) => ("diverged", Some(k)),
        Status::StepSizeCollapsed(k) => ("step_size_collapsed", Some(k)),
        Status::Cancelled(k) => ("cancelled", Some(k)),
    };
    out.set_item("status", status)?;
    out.set_item("stopped_at", at)?;
    let effort = outcome.effort;
    for (name, count) in [
        ("evaluations", effort.evaluations),
        ("steps", effort.steps),
        ("rejections", effort.rejections),
        ("jacobians", effort.jacobians),
        ("factorizations", effort.factorizations),
        ("implicit_samples", effort.implicit_samples),
    ] {
        out.set_item(name, count)?;
    }
    Ok(out)
}

fn record(plant: &Plant<f64>, run: &Run<'_>) -> Result<Outcome, SimulationError> {
    let mut traces = Traces::default();
    let mut stepper = Stepper::new(plant);
    let mut observe = |sample: &Sample<'_, f64>| {
        traces.command.extend(sample.command);
        traces.measured.extend(sample.measured);
        traces.motor.extend(
            plant
                .axes
                .iter()
                .map(|a| plant.motor_angle(a, sample.state)),
        );
        traces.joint.extend(plant.joint_angles(sample.state));
        traces.torque_disturbance.extend(sample.torque_disturbance);
        traces
            .position_disturbance
            .extend(sample.position_disturbance);
    };
    let status = simulation::simulate(plant, run, &mut stepper, &mut observe)?;
    Ok(Outcome {
        traces,
        status,
        effort: stepper.effort,
    })
}
