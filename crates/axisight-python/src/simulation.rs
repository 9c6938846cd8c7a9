//! Simulation of many runs. A single run is a batch of one.

use crate::convert::{array2, array3, planes};
use crate::effects::{EffectTuple, settings};
use crate::entry::{CancelToken, detached, flag, input_error};
use crate::robot::Robot;
use axisight_core::robot::n_readings;
use axisight_core::simulation::{
    self, Batch, BatchError, BatchInput, Beside, Effort, Method, Model, Moment, Outcome, Status,
    Traces,
};
use numpy::{PyArray1, PyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Mutex;

/// Integrator, from Python.
#[derive(FromPyObject)]
pub struct IntegratorSpec {
    method: String,
    pub substeps: usize,
    tolerance: f64,
}

impl IntegratorSpec {
    /// The method: `rk4` and `rkn4` take sub-steps, the others a tolerance.
    pub fn method(&self) -> PyResult<Method> {
        let (substeps, tolerance) = (self.substeps, self.tolerance);
        let controlled = match self.method.as_str() {
            "rk4" if substeps >= 1 => return Ok(Method::RungeKutta4 { substeps }),
            "rkn4" if substeps >= 1 => return Ok(Method::Nystrom4 { substeps }),
            "rk4" | "rkn4" => {
                return Err(input_error(format!(
                    "substeps: expected at least 1, got {substeps}"
                )));
            }
            "dopri5" => Method::DormandPrince { tolerance },
            "radau5" => Method::RadauIia { tolerance },
            "rodas4" => Method::Rosenbrock { tolerance },
            "auto" => Method::Automatic { tolerance },
            name => {
                return Err(input_error(format!(
                    "method: expected rk4, rkn4, dopri5, radau5, rodas4 or auto, got {name}"
                )));
            }
        };
        // Below this tolerance, states cannot even be represented.
        if (1e-14..1.0).contains(&tolerance) {
            Ok(controlled)
        } else {
            Err(input_error(format!(
                "tolerance: expected between 1e-14 and 1, got {tolerance}"
            )))
        }
    }
}

/// Refuse an invalid integrator.
#[pyfunction]
pub fn check_integrator(integrator: IntegratorSpec) -> PyResult<()> {
    integrator.method().map(|_| ())
}

/// Equations of the plant, by name.
pub fn model(name: &str) -> PyResult<Model> {
    match name {
        "nonlinear" => Ok(Model::Nonlinear),
        "linear" => Ok(Model::Linear),
        _ => Err(input_error(format!(
            "model: expected nonlinear or linear, got {name}"
        ))),
    }
}

/// Position noise `(n_samples, n_axes)` as a function of seed and run: white, or of first order
/// with a cutoff.
#[pyfunction]
#[pyo3(signature = (seed, run, n_samples, n_axes, std, *, cutoff_hz=None, sample_time=None))]
#[allow(clippy::too_many_arguments)] // arguments of a binding
pub fn measurement_noise(
    py: Python<'_>,
    seed: u64,
    run: u64,
    n_samples: usize,
    n_axes: usize,
    std: f64,
    cutoff_hz: Option<f64>,
    sample_time: Option<f64>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let noise = match (cutoff_hz, sample_time) {
        (None, _) => simulation::measurement_noise(seed, run, n_samples, n_axes, std),
        (Some(cutoff), Some(step)) if cutoff > 0.0 && step > 0.0 => {
            simulation::coloured_noise(seed, run, n_samples, n_axes, std, cutoff, step)
        }
        _ => {
            return Err(input_error(
                "cutoff_hz, sample_time: expected both positive",
            ));
        }
    };
    array2(py, noise, n_axes)
}

/// Options of a simulation, apart from inputs.
struct Options {
    reference: bool,
    start: Option<Vec<Vec<f64>>>,
    method: Method,
    model: Model,
    resolution: f64,
    threads: usize,
    beside: Option<Py<PyAny>>,
}

/// Simulate runs from rest, with inputs of the shape `(n_runs, n_samples, n_axes)`.
#[pyfunction]
#[pyo3(signature = (robot, effects, input, *, reference, integrator, noise=None, start=None, model="nonlinear", resolution=0.0, threads=0, beside=None, cancel=None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn simulate_batch<'py>(
    py: Python<'py>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    input: PyReadonlyArray3<'py, f64>,
    reference: bool,
    integrator: IntegratorSpec,
    noise: Option<PyReadonlyArray3<'py, f64>>,
    start: Option<Vec<Vec<f64>>>,
    model: &str,
    resolution: f64,
    threads: usize,
    beside: Option<Py<PyAny>>,
    cancel: Option<&Bound<'py, CancelToken>>,
) -> PyResult<Bound<'py, PyDict>> {
    let n_axes = robot.description.n_axes();
    let field = if reference { "velocity_ref" } else { "torque" };
    let input = planes(&input, field, n_axes)?;
    let noise = match noise {
        Some(n) => planes(&n, "noise", n_axes)?,
        None => Vec::new(),
    };
    let options = Options {
        reference,
        start,
        method: integrator.method()?,
        model: self::model(model)?,
        resolution,
        threads,
        beside,
    };
    let (traces, outcomes) = run(py, robot, effects, &input, &noise, options, cancel)?;
    many(py, robot, traces, &outcomes)
}

fn run(
    py: Python<'_>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    input: &[Vec<f64>],
    noise: &[Vec<f64>],
    options: Options,
    cancel: Option<&Bound<'_, CancelToken>>,
) -> PyResult<(Traces, Vec<Outcome>)> {
    if !noise.is_empty() && !noise.iter().map(Vec::len).eq(input.iter().map(Vec::len)) {
        return Err(input_error("noise: expected the shape of the input"));
    }
    let cancel = flag(cancel);
    let settings = settings(effects);
    let operating_point = || vec![robot.description.operating_point.clone()];
    let start = options.start.clone().unwrap_or_else(operating_point);
    let raised = Mutex::new(None);
    let ask = |now: &Moment| beside_at(options.beside.as_ref()?, now, &raised);
    let batch = Batch {
        robot: &robot.description,
        settings: &settings,
        start: &start,
        input: if options.reference {
            BatchInput::Reference(input)
        } else {
            BatchInput::Torque(input)
        },
        noise,
        resolution: options.resolution,
        model: options.model,
        method: options.method,
        beside: options.beside.as_ref().map(|_| Beside(&ask)),
        cancel: Some(&*cancel),
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()
        .map_err(input_error)?;
    let done: Result<(Traces, Vec<Outcome>), BatchError> = detached(py, &cancel, || {
        pool.install(|| simulation::simulate_batch(&batch))
    })?;
    if let Some(error) = raised.into_inner().unwrap_or_default() {
        return Err(error);
    }
    done.map_err(input_error)
}

/// Torques of the Python function `beside` at a moment; its exception goes to `raised`.
fn beside_at(beside: &Py<PyAny>, now: &Moment, raised: &Mutex<Option<PyErr>>) -> Option<Vec<f64>> {
    let torque: PyResult<Vec<f64>> = Python::attach(|py| {
        let state = [&now.angle, &now.speed, &now.acceleration, &now.load];
        let [angle, speed, acceleration, load] = state.map(|x| PyArray1::from_slice(py, x));
        beside
            .call1(py, (now.time, angle, speed, acceleration, load))?
            .extract(py)
    });
    match torque {
        Ok(torque) => Some(torque),
        Err(error) => {
            if let Ok(mut raised) = raised.lock() {
                raised.get_or_insert(error);
            }
            None
        }
    }
}

/// Name of a status, and the sample to which it refers.
fn status(status: Status) -> (&'static str, Option<usize>) {
    match status {
        Status::Completed => ("completed", None),
        Status::Diverged(k) => ("diverged", Some(k)),
        Status::StepSizeCollapsed(k) => ("step_size_collapsed", Some(k)),
        Status::Cancelled(k) => ("cancelled", Some(k)),
    }
}

fn counters(effort: Effort) -> [(&'static str, u64); 6] {
    [
        ("evaluations", effort.evaluations),
        ("steps", effort.steps),
        ("rejections", effort.rejections),
        ("jacobians", effort.jacobians),
        ("factorizations", effort.factorizations),
        ("implicit_samples", effort.implicit_samples),
    ]
}

/// Signals by name, with their columns.
fn signals(traces: Traces, robot: &Robot) -> [(&'static str, Vec<f64>, usize); 7] {
    let (n_axes, n_joints) = (robot.description.n_axes(), robot.description.n_joints());
    let n_readings = n_readings(&robot.description.accelerometers);
    [
        ("torque_cmd_nm", traces.command, n_axes),
        ("position_rad", traces.measured, n_axes),
        ("motor_position_rad", traces.motor, n_axes),
        ("joint_position_rad", traces.joint, n_joints),
        ("torque_disturbance_nm", traces.torque_disturbance, n_axes),
        (
            "position_disturbance_rad",
            traces.position_disturbance,
            n_axes,
        ),
        ("acceleration_m_s2", traces.specific_force, n_readings),
    ]
}

fn many<'py>(
    py: Python<'py>,
    robot: &Robot,
    traces: Traces,
    outcomes: &[Outcome],
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let ends: Vec<_> = outcomes.iter().map(|o| status(o.status)).collect();
    out.set_item("status", ends.iter().map(|e| e.0).collect::<Vec<_>>())?;
    out.set_item("stopped_at", ends.iter().map(|e| e.1).collect::<Vec<_>>())?;
    for (i, (name, _)) in counters(Effort::default()).iter().enumerate() {
        let counts: Vec<u64> = outcomes.iter().map(|o| counters(o.effort)[i].1).collect();
        out.set_item(name, counts)?;
    }
    let n_samples = traces.n_samples;
    for (name, data, columns) in signals(traces, robot).into_iter().filter(|s| s.2 > 0) {
        out.set_item(name, array3(py, data, n_samples, columns)?)?;
    }
    Ok(out)
}
