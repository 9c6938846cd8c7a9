//! Fits.

use crate::convert::{array1, array2, array3, rows};
use crate::effects::{EffectTuple, settings};
use crate::entry::{CancelToken, InputError, detached, flag, input_error};
use crate::robot::Robot;
use crate::simulation::IntegratorSpec;
use axisight_core::robot::{Parameter, RobotDescription};
use axisight_identification::logs::{
    BlockGram, Column as Shared, Courses as Runs, Fit, FitOptions, FitParameter, InverseDynamics,
    Linearization as Point, Loss, MotionRecord, Problem, ProblemError, Record,
    SimulationErrorProblem, SimulationInput, SimulationOutput, Target, fit,
};
use axisight_numerics::Weighting;
use axisight_numerics::descent::Status;
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray2};
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

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
/// Log, axis, start and length of a block.
type BlockTuple = (usize, usize, usize, usize);
/// Number of a parameter and its Jacobian column.
type WarmColumn<'py> = (usize, Bound<'py, Column>);

/// A column of a Jacobian, kept where it was computed for other fits to use.
#[pyclass(frozen, module = "axisight._core")]
pub struct Column {
    shared: Shared,
}

#[pymethods]
impl Column {
    /// A copy.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.shared.to_vec())
    }
}

/// Rows of a matrix from columns that are kept apart.
fn stacked(columns: &[Shared]) -> Vec<f64> {
    columns.iter().flat_map(|c| c.iter().copied()).collect()
}

/// Result of a fit; arrays are copies.
#[pyclass(frozen, module = "axisight._core")]
pub struct FitResult {
    fit: Fit,
}

#[pymethods]
impl FitResult {
    #[getter]
    fn status(&self) -> &'static str {
        self.fit.status.name()
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
        array2(py, stacked(&self.fit.columns), self.fit.n_residuals)
    }
    /// The same, kept where they are.
    #[getter]
    fn columns(&self) -> Vec<Column> {
        let shared = self.fit.columns.iter().map(Arc::clone);
        shared.map(|shared| Column { shared }).collect()
    }
    #[getter]
    fn blocks(&self) -> Vec<BlockTuple> {
        places(&self.fit.blocks)
    }
    #[getter]
    fn block_matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        matrices(py, &self.fit.blocks, self.fit.free.len())
    }
    #[getter]
    fn block_gradient<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        gradients(py, &self.fit.blocks, self.fit.free.len())
    }
    #[getter]
    fn block_loss<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        losses(py, &self.fit.blocks)
    }
}

/// A problem at given parameters; arrays are copies.
#[pyclass(frozen, module = "axisight._core")]
pub struct Linearization {
    at: Point,
}

#[pymethods]
impl Linearization {
    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.at.theta.clone())
    }
    #[getter]
    fn loss(&self) -> f64 {
        self.at.loss
    }
    #[getter]
    fn free(&self) -> Vec<usize> {
        self.at.free.clone()
    }
    #[getter]
    fn at_bound(&self) -> Vec<usize> {
        self.at.at_bound.clone()
    }
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.at.residual.clone())
    }
    /// Jacobian columns of the free parameters, `(n_free, n_residuals)`.
    #[getter]
    fn jacobian<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array2(py, stacked(&self.at.columns), self.at.residual.len())
    }
    #[getter]
    fn blocks(&self) -> Vec<BlockTuple> {
        places(&self.at.blocks)
    }
    #[getter]
    fn block_matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        matrices(py, &self.at.blocks, self.at.free.len())
    }
    #[getter]
    fn block_gradient<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        gradients(py, &self.at.blocks, self.at.free.len())
    }
    #[getter]
    fn block_loss<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        losses(py, &self.at.blocks)
    }
}

/// Blocks as rows (log, axis, start, length).
fn places(blocks: &[BlockGram]) -> Vec<BlockTuple> {
    let blocks = blocks.iter().map(|g| g.block);
    blocks.map(|b| (b.record, b.axis, b.start, b.len)).collect()
}

/// `J^T W J` by block, `(n_blocks, n_free, n_free)`.
fn matrices<'py>(
    py: Python<'py>,
    blocks: &[BlockGram],
    n: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat = blocks.iter().flat_map(|g| g.matrix.iter().copied());
    array3(py, flat.collect(), n, n)
}

/// `J^T W r` by block, `(n_blocks, n_free)`.
fn gradients<'py>(
    py: Python<'py>,
    blocks: &[BlockGram],
    n: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat = blocks.iter().flat_map(|g| g.gradient.iter().copied());
    array2(py, flat.collect(), n)
}

/// Loss by block.
fn losses<'py>(py: Python<'py>, blocks: &[BlockGram]) -> Bound<'py, PyArray1<f64>> {
    array1(py, blocks.iter().map(|g| g.loss).collect())
}

/// What to mind of every status that is no convergence: pairs of status and advice.
#[pyfunction]
pub fn status_advice() -> Vec<(&'static str, &'static str)> {
    let all = Status::ALL.iter();
    all.filter_map(|s| Some((s.name(), s.advice()?))).collect()
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

fn loss(spec: &OptionSpec) -> PyResult<Loss> {
    match spec.loss.as_str() {
        "squared" => Ok(Loss::Squared),
        "huber" => Ok(Loss::Huber(spec.loss_scale)),
        "soft_l1" => Ok(Loss::SoftL1(spec.loss_scale)),
        other => {
            let text = format!("loss: expected squared, huber or soft_l1, got {other}");
            Err(InputError::new_err(text))
        }
    }
}

fn options(spec: &OptionSpec) -> PyResult<FitOptions> {
    Ok(FitOptions {
        max_iterations: spec.max_iterations,
        loss_tolerance: spec.loss_tolerance,
        step_tolerance: spec.step_tolerance,
        loss: loss(spec)?,
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

fn warm_columns(warm: &[WarmColumn<'_>]) -> Vec<(usize, Shared)> {
    let shared = |(i, c): &WarmColumn<'_>| (*i, Arc::clone(&c.get().shared));
    warm.iter().map(shared).collect()
}

fn problem_error(e: ProblemError) -> PyErr {
    match e {
        ProblemError::Cancelled => pyo3::exceptions::PyKeyboardInterrupt::new_err("cancelled"),
        other => input_error(other),
    }
}

fn solve<P: Problem + Send>(
    py: Python<'_>,
    cancel: &AtomicBool,
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

fn linearize<P: Problem + Send>(
    py: Python<'_>,
    cancel: &AtomicBool,
    problem: &P,
    parameters: &[FitParameter],
    loss: Loss,
    warm: &[WarmColumn<'_>],
) -> PyResult<Linearization> {
    let warm = warm_columns(warm);
    let at = detached(py, cancel, || Point::new(problem, parameters, loss, &warm))?;
    Ok(Linearization {
        at: at.map_err(problem_error)?,
    })
}

/// Pairs (input, target) of arrays `(n, n_axes)`.
type RecordTuple<'py> = (PyReadonlyArray2<'py, f64>, PyReadonlyArray2<'py, f64>);

/// What an error of simulation is made of, as Python hands it over.
struct SimulationSpec<'a, 'py> {
    robot: &'a Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<ParameterSpec>,
    records: Vec<RecordTuple<'py>>,
    weighting: Vec<WeightingTuple>,
    options: &'a OptionSpec,
    input: &'a str,
    output: &'a str,
    courses: Option<&'a Courses>,
}

/// Runs of a model over all logs, for models close to it.
#[pyclass(frozen, module = "axisight._core")]
pub struct Courses {
    /// Nothing where the arm cannot be linearised along runs.
    runs: Option<Arc<Runs>>,
}

impl SimulationSpec<'_, '_> {
    fn problem(self, cancel: &Arc<AtomicBool>) -> PyResult<SimulationErrorProblem> {
        let (robot, options) = (&self.robot.description, self.options);
        let n_axes = robot.n_axes();
        let record = |(i, t): &RecordTuple<'_>| {
            Ok(Record {
                input: rows(i, "input", n_axes)?,
                target: rows(t, "target", n_axes)?,
            })
        };
        let problem = SimulationErrorProblem {
            robot: robot.clone(),
            effects: settings(self.effects),
            parameters: parameters(self.parameters, robot)?,
            records: self.records.iter().map(record).collect::<PyResult<_>>()?,
            input: match self.input {
                "reference" => SimulationInput::Reference,
                "torque" => SimulationInput::Torque,
                "tracking" => SimulationInput::Tracking,
                other => {
                    let text = "expected reference, torque or tracking";
                    return Err(input_error(format!("input: {text}, got {other}")));
                }
            },
            output: match self.output {
                "torque" => SimulationOutput::Torque,
                "position" => SimulationOutput::Position,
                other => {
                    let text = format!("output: expected torque or position, got {other}");
                    return Err(input_error(text));
                }
            },
            weighting: weightings(self.weighting),
            method: options.integrator.method()?,
            block_s: options.block_s,
            courses: self.courses.and_then(|c| c.runs.clone()),
            cancel: Some(Arc::clone(cancel)),
        };
        problem.validate().map_err(problem_error)?;
        Ok(problem)
    }
}

/// Fit the simulation of logs. `records` are pairs (input, target) of `(n, n_axes)` arrays.
#[pyfunction]
#[pyo3(signature = (robot, effects, parameters, records, weighting, options, *, input="reference", output="torque", warm=Vec::new(), courses=None, cancel=None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn fit_simulation(
    py: Python<'_>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<ParameterSpec>,
    records: Vec<RecordTuple<'_>>,
    weighting: Vec<WeightingTuple>,
    options: OptionSpec,
    input: &str,
    output: &str,
    warm: Vec<WarmColumn<'_>>,
    courses: Option<&Bound<'_, Courses>>,
    cancel: Option<&Bound<'_, CancelToken>>,
) -> PyResult<FitResult> {
    let cancel = flag(cancel);
    let spec = SimulationSpec {
        robot,
        effects,
        parameters,
        records,
        weighting,
        options: &options,
        input,
        output,
        courses: courses.map(Bound::get),
    };
    let problem = spec.problem(&cancel)?;
    let options = self::options(&options)?;
    let parameters = &problem.parameters;
    solve(py, &cancel, &problem, parameters, options, &warm)
}

/// The simulation of logs at the initial values of the parameters.
#[pyfunction]
#[pyo3(signature = (robot, effects, parameters, records, weighting, options, *, input="reference", output="torque", warm=Vec::new(), courses=None, cancel=None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn evaluate_simulation(
    py: Python<'_>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<ParameterSpec>,
    records: Vec<RecordTuple<'_>>,
    weighting: Vec<WeightingTuple>,
    options: OptionSpec,
    input: &str,
    output: &str,
    warm: Vec<WarmColumn<'_>>,
    courses: Option<&Bound<'_, Courses>>,
    cancel: Option<&Bound<'_, CancelToken>>,
) -> PyResult<Linearization> {
    let cancel = flag(cancel);
    let spec = SimulationSpec {
        robot,
        effects,
        parameters,
        records,
        weighting,
        options: &options,
        input,
        output,
        courses: courses.map(Bound::get),
    };
    let problem = spec.problem(&cancel)?;
    let loss = loss(&options)?;
    let parameters = &problem.parameters;
    linearize(py, &cancel, &problem, parameters, loss, &warm)
}

/// Runs of a model over all logs, along which the arm of models close to it may be linearised.
#[pyfunction]
#[pyo3(signature = (robot, effects, parameters, records, weighting, options, *, input="reference", output="torque", cancel=None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn courses(
    py: Python<'_>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<ParameterSpec>,
    records: Vec<RecordTuple<'_>>,
    weighting: Vec<WeightingTuple>,
    options: OptionSpec,
    input: &str,
    output: &str,
    cancel: Option<&Bound<'_, CancelToken>>,
) -> PyResult<Courses> {
    let cancel = flag(cancel);
    let spec = SimulationSpec {
        robot,
        effects,
        parameters,
        records,
        weighting,
        options: &options,
        input,
        output,
        courses: None,
    };
    let problem = spec.problem(&cancel)?;
    let theta: Vec<f64> = problem.parameters.iter().map(|p| p.initial).collect();
    let runs = detached(py, &cancel, || Runs::new(&problem, &theta))?;
    let runs = runs.map_err(problem_error)?.map(Arc::new);
    Ok(Courses { runs })
}

/// A motion as (position, velocity, acceleration, torque), each `(n, n_axes)`, motor side.
type MotionTuple<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
);

fn inverse_dynamics(
    robot: &RobotDescription,
    effects: Vec<EffectTuple>,
    specs: Vec<ParameterSpec>,
    records: &[MotionTuple<'_>],
    weighting: Vec<WeightingTuple>,
    block_s: f64,
) -> PyResult<InverseDynamics> {
    let n_axes = robot.n_axes();
    let record = |(q, v, a, t): &MotionTuple<'_>| {
        Ok(MotionRecord {
            position: rows(q, "position", n_axes)?,
            velocity: rows(v, "velocity", n_axes)?,
            acceleration: rows(a, "acceleration", n_axes)?,
            torque: rows(t, "torque", n_axes)?,
        })
    };
    let problem = InverseDynamics {
        robot: robot.clone(),
        effects: settings(effects),
        parameters: parameters(specs, robot)?,
        records: records.iter().map(record).collect::<PyResult<_>>()?,
        weighting: weightings(weighting),
        block_s,
    };
    problem.validate().map_err(problem_error)?;
    Ok(problem)
}

/// Fit the torque predicted from measured motions.
#[pyfunction]
#[pyo3(signature = (robot, effects, parameters, records, weighting, options, *, warm=Vec::new(), cancel=None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn fit_inverse_dynamics(
    py: Python<'_>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<ParameterSpec>,
    records: Vec<MotionTuple<'_>>,
    weighting: Vec<WeightingTuple>,
    options: OptionSpec,
    warm: Vec<WarmColumn<'_>>,
    cancel: Option<&Bound<'_, CancelToken>>,
) -> PyResult<FitResult> {
    let (robot, block_s) = (&robot.description, options.block_s);
    let problem = inverse_dynamics(robot, effects, parameters, &records, weighting, block_s)?;
    let options = self::options(&options)?;
    let parameters = &problem.parameters;
    solve(py, &flag(cancel), &problem, parameters, options, &warm)
}

/// The torque predicted from measured motions at the initial values of the parameters.
#[pyfunction]
#[pyo3(signature = (robot, effects, parameters, records, weighting, options, *, warm=Vec::new(), cancel=None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn evaluate_inverse_dynamics(
    py: Python<'_>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<ParameterSpec>,
    records: Vec<MotionTuple<'_>>,
    weighting: Vec<WeightingTuple>,
    options: OptionSpec,
    warm: Vec<WarmColumn<'_>>,
    cancel: Option<&Bound<'_, CancelToken>>,
) -> PyResult<Linearization> {
    let (robot, block_s) = (&robot.description, options.block_s);
    let problem = inverse_dynamics(robot, effects, parameters, &records, weighting, block_s)?;
    let loss = loss(&options)?;
    let parameters = &problem.parameters;
    linearize(py, &flag(cancel), &problem, parameters, loss, &warm)
}
