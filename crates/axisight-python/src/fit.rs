//! Fits.

use crate::convert::{array1, array2, array3, rows};
use crate::effects::{EffectTuple, settings};
use crate::entry::{CancelToken, InputError, detached, flag, input_error};
use crate::robot::Robot;
use crate::simulation::IntegratorSpec;
use axisight_core::identification::{
    Fit, FitOptions, FitParameter, FitStatus, InverseDynamics, Loss, MotionRecord, Problem,
    ProblemError, Record, SimulationErrorProblem, SimulationInput, SimulationOutput, Target, fit,
};
use axisight_core::robot::{Parameter, RobotDescription};
use axisight_core::signal::Weighting;
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

/// One parameter to fit, as Python hands it over.
#[derive(FromPyObject)]
pub struct ParameterSpec {
    /// Robot parameter name, or None for an effect parameter.
    robot: Option<String>,
    /// Position of the effect in the list, then of the parameter in its table.
    effect: Option<(usize, usize)>,
    initial: f64,
    lower: f64,
    upper: f64,
    scale: f64,
    prior: Option<(f64, f64)>,
    frozen: bool,
    nuisance: bool,
}

/// Settings of a fit, as Python hands them over.
#[derive(FromPyObject)]
pub struct OptionSpec {
    max_iterations: usize,
    loss_tolerance: f64,
    step_tolerance: f64,
    loss: String,
    loss_scale: f64,
    nuisance_refreshes: usize,
    block_s: f64,
    integrator: IntegratorSpec,
}

/// Frequencies [Hz], weights and decimation of one axis.
type WeightingTuple = (Vec<f64>, Vec<f64>, usize);
/// Number of a parameter and its Jacobian column.
type WarmColumn<'py> = (usize, PyReadonlyArray1<'py, f64>);

/// Result of a fit; arrays are copies.
#[pyclass(frozen, module = "axisight._core")]
pub struct FitResult {
    fit: Fit,
}

#[pymethods]
impl FitResult {
    #[getter]
    fn status(&self) -> &'static str {
        match self.fit.status {
            FitStatus::LossConverged => "loss_converged",
            FitStatus::StepConverged => "step_converged",
            FitStatus::MaxIterations => "max_iterations",
            FitStatus::Stalled => "stalled",
        }
    }
    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.fit.theta.clone())
    }
    #[getter]
    fn loss(&self) -> f64 {
        self.fit.loss
    }
    #[getter]
    fn initial_loss(&self) -> f64 {
        self.fit.initial_loss
    }
    #[getter]
    fn n_residuals(&self) -> usize {
        self.fit.n_residuals
    }
    #[getter]
    fn iterations(&self) -> usize {
        self.fit.iterations
    }
    #[getter]
    fn evaluations(&self) -> usize {
        self.fit.evaluations
    }
    #[getter]
    fn free(&self) -> Vec<usize> {
        self.fit.free.clone()
    }
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array2(py, self.fit.covariance.clone(), self.fit.free.len())
    }
    #[getter]
    fn sandwich<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array2(py, self.fit.sandwich.clone(), self.fit.free.len())
    }
    #[getter]
    fn condition(&self) -> f64 {
        self.fit.condition
    }
    #[getter]
    fn at_bound(&self) -> Vec<usize> {
        self.fit.at_bound.clone()
    }
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.fit.residual.clone())
    }
    /// Jacobian columns of the free parameters, `(n_free, n_residuals)`.
    #[getter]
    fn jacobian<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array2(py, self.fit.columns.concat(), self.fit.n_residuals)
    }
    /// Blocks as rows (log, axis, start, length).
    #[getter]
    fn blocks(&self) -> Vec<(usize, usize, usize, usize)> {
        let blocks = self.fit.blocks.iter().map(|g| g.block);
        blocks.map(|b| (b.record, b.axis, b.start, b.len)).collect()
    }
    /// `J^T W J` by block, `(n_blocks, n_free, n_free)`.
    #[getter]
    fn block_matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let n = self.fit.free.len();
        array3(
            py,
            self.fit
                .blocks
                .iter()
                .flat_map(|g| g.matrix.clone())
                .collect(),
            n,
            n,
        )
    }
    /// `J^T W r` by block, `(n_blocks, n_free)`.
    #[getter]
    fn block_gradient<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let n = self.fit.free.len();
        array2(
            py,
            self.fit
                .blocks
                .iter()
                .flat_map(|g| g.gradient.clone())
                .collect(),
            n,
        )
    }
    /// Loss by block.
    #[getter]
    fn block_loss<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.fit.blocks.iter().map(|g| g.loss).collect())
    }
}

fn parameters(specs: Vec<ParameterSpec>, robot: &RobotDescription) -> PyResult<Vec<FitParameter>> {
    specs
        .into_iter()
        .enumerate()
        .map(|(i, s)| {
            let target = match (&s.robot, s.effect) {
                (Some(name), None) => {
                    Target::Robot(Parameter::parse(name, robot).map_err(input_error)?)
                }
                (None, Some((e, j))) => Target::Effect(e, j),
                _ => {
                    let text = "expected either a robot parameter or an effect parameter";
                    return Err(InputError::new_err(format!("parameters[{i}]: {text}")));
                }
            };
            Ok(FitParameter {
                target,
                initial: s.initial,
                lower: s.lower,
                upper: s.upper,
                scale: s.scale,
                prior: s.prior,
                frozen: s.frozen,
                nuisance: s.nuisance,
            })
        })
        .collect()
}

fn options(spec: &OptionSpec) -> PyResult<FitOptions> {
    let loss = match spec.loss.as_str() {
        "squared" => Loss::Squared,
        "huber" => Loss::Huber(spec.loss_scale),
        "soft_l1" => Loss::SoftL1(spec.loss_scale),
        other => {
            let text = format!("loss: expected squared, huber or soft_l1, got {other}");
            return Err(InputError::new_err(text));
        }
    };
    Ok(FitOptions {
        max_iterations: spec.max_iterations,
        loss_tolerance: spec.loss_tolerance,
        step_tolerance: spec.step_tolerance,
        loss,
        nuisance_refreshes: spec.nuisance_refreshes,
    })
}

fn weightings(specs: Vec<WeightingTuple>) -> Vec<Weighting> {
    specs
        .into_iter()
        .map(|(frequency_hz, weight, decimation)| Weighting {
            frequency_hz,
            weight,
            decimation,
        })
        .collect()
}

fn warm_columns(warm: &[WarmColumn<'_>]) -> Vec<(usize, Vec<f64>)> {
    warm.iter()
        .map(|(i, c)| (*i, c.as_array().to_vec()))
        .collect()
}

fn problem_error(e: ProblemError) -> PyErr {
    match e {
        ProblemError::Cancelled => pyo3::exceptions::PyKeyboardInterrupt::new_err("cancelled"),
        other => input_error(other),
    }
}

fn solve<P: Problem + Send>(
    py: Python<'_>,
    cancel: &std::sync::atomic::AtomicBool,
    problem: &P,
    parameters: &[FitParameter],
    options: FitOptions,
    warm: &[WarmColumn<'_>],
) -> PyResult<FitResult> {
    let warm = warm_columns(warm);
    let fit = detached(py, cancel, || fit(problem, parameters, options, &warm))?;
    Ok(FitResult {
        fit: fit.map_err(problem_error)?,
    })
}

/// Fit the simulation of logs. `records` are pairs (input, target) of `(n, n_axes)` arrays.
#[pyfunction]
#[pyo3(signature = (robot, effects, parameters, records, weighting, options, *, input="reference", output="torque", warm=Vec::new(), cancel=None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn fit_simulation(
    py: Python<'_>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<ParameterSpec>,
    records: Vec<(PyReadonlyArray2<'_, f64>, PyReadonlyArray2<'_, f64>)>,
    weighting: Vec<WeightingTuple>,
    options: OptionSpec,
    input: &str,
    output: &str,
    warm: Vec<WarmColumn<'_>>,
    cancel: Option<&Bound<'_, CancelToken>>,
) -> PyResult<FitResult> {
    let n_axes = robot.description.n_axes();
    let cancel = flag(cancel);
    let problem = SimulationErrorProblem {
        robot: robot.description.clone(),
        effects: settings(effects),
        parameters: self::parameters(parameters, &robot.description)?,
        records: records
            .iter()
            .map(|(i, t)| {
                Ok(Record {
                    input: rows(i, "input", n_axes)?,
                    target: rows(t, "target", n_axes)?,
                })
            })
            .collect::<PyResult<_>>()?,
        input: match input {
            "reference" => SimulationInput::Reference,
            "torque" => SimulationInput::Torque,
            "tracking" => SimulationInput::Tracking,
            _ => {
                return Err(input_error(format!(
                    "input: expected reference, torque or tracking, got {input}"
                )));
            }
        },
        output: match output {
            "torque" => SimulationOutput::Torque,
            "position" => SimulationOutput::Position,
            _ => {
                return Err(input_error(format!(
                    "output: expected torque or position, got {output}"
                )));
            }
        },
        weighting: weightings(weighting),
        method: options.integrator.method()?,
        block_s: options.block_s,
        cancel: Some(cancel.clone()),
    };
    problem.validate().map_err(problem_error)?;
    let fit_options = self::options(&options)?;
    solve(
        py,
        &cancel,
        &problem,
        &problem.parameters,
        fit_options,
        &warm,
    )
}

/// A motion as (position, velocity, acceleration, torque), each `(n, n_axes)`, motor side.
type MotionTuple<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
);

/// Fit the torque predicted from measured motions.
#[pyfunction]
#[pyo3(signature = (robot, effects, parameters, records, weighting, options, *, cancel=None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn fit_inverse_dynamics(
    py: Python<'_>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<ParameterSpec>,
    records: Vec<MotionTuple<'_>>,
    weighting: Vec<WeightingTuple>,
    options: OptionSpec,
    cancel: Option<&Bound<'_, CancelToken>>,
) -> PyResult<FitResult> {
    let n_axes = robot.description.n_axes();
    let problem = InverseDynamics {
        robot: robot.description.clone(),
        effects: settings(effects),
        parameters: self::parameters(parameters, &robot.description)?,
        records: records
            .iter()
            .map(|(q, v, a, t)| {
                Ok(MotionRecord {
                    position: rows(q, "position", n_axes)?,
                    velocity: rows(v, "velocity", n_axes)?,
                    acceleration: rows(a, "acceleration", n_axes)?,
                    torque: rows(t, "torque", n_axes)?,
                })
            })
            .collect::<PyResult<_>>()?,
        weighting: weightings(weighting),
        block_s: options.block_s,
    };
    problem.validate().map_err(problem_error)?;
    let fit_options = self::options(&options)?;
    solve(
        py,
        &flag(cancel),
        &problem,
        &problem.parameters,
        fit_options,
        &[],
    )
}
