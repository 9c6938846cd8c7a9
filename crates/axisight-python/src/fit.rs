//! Fits.

use crate::convert::rows;
use crate::effects::{EffectTuple, settings};
use crate::entry::{CancelToken, InputError, detached, flag, input_error};
use crate::fit_results::{Column, Ended, FitResult, Linearization, problem_error};
use crate::robot::Robot;
use crate::simulation::IntegratorSpec;
use axisight_core::robot::{Parameter, RobotDescription};
use axisight_identification::logs::{
    Column as Shared, Courses as Runs, FitOptions, FitParameter, InverseDynamics,
    Linearization as Point, Loss, MotionRecord, Problem, Record, SimulationErrorProblem,
    SimulationInput, SimulationOutput, Target, fit,
};
use axisight_numerics::Weighting;
use axisight_numerics::descent::Status;
use numpy::PyReadonlyArray2;
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
    /// Of a shape: the only size of its effect, in the table of the effect.
    amplitude: Option<usize>,
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
type WarmColumn<'py> = (usize, Bound<'py, Column>);

/// What to mind of every status that is no convergence: pairs of status and advice.
#[pyfunction]
pub fn status_advice() -> Vec<(&'static str, &'static str)> {
    let all = Status::ALL.iter();
    all.filter_map(|s| Some((s.name(), s.advice()?))).collect()
}

fn parameters(specs: &[ParameterSpec], robot: &RobotDescription) -> PyResult<Vec<FitParameter>> {
    let size = |s: &ParameterSpec| {
        let wanted = (s.effect?.0, s.amplitude?);
        specs.iter().position(|other| other.effect == Some(wanted))
    };
    specs
        .iter()
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
                amplitude: size(s),
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

fn solve<P: Problem + Send>(
    py: Python<'_>,
    cancel: &AtomicBool,
    problem: &P,
    parameters: &[FitParameter],
    options: FitOptions,
    warm: &[WarmColumn<'_>],
) -> PyResult<Ended<FitResult>> {
    let warm = warm_columns(warm);
    let fit = detached(py, cancel, || fit(problem, parameters, options, &warm))?;
    Ended::of(fit.map(|fit| FitResult { fit }))
}

fn linearize<P: Problem + Send>(
    py: Python<'_>,
    cancel: &AtomicBool,
    problem: &P,
    parameters: &[FitParameter],
    loss: Loss,
    warm: &[WarmColumn<'_>],
) -> PyResult<Ended<Linearization>> {
    let warm = warm_columns(warm);
    let at = detached(py, cancel, || Point::new(problem, parameters, loss, &warm))?;
    Ended::of(at.map(|at| Linearization { at }))
}

/// Input, target and certainty of a record, arrays `(n, n_axes)`, driven joint angles where it begins,
/// and how many samples of input and target lead to what is compared.
type RecordTuple<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    Option<PyReadonlyArray2<'py, f64>>,
    Option<Vec<f64>>,
    usize,
);

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
        let record = |(i, t, c, start, lead): &RecordTuple<'_>| {
            let certainty = c.as_ref().map(|c| rows(c, "certainty", n_axes));
            Ok(Record {
                input: rows(i, "input", n_axes)?,
                target: rows(t, "target", n_axes)?,
                certainty: certainty.transpose()?,
                start: start.clone(),
                lead: *lead,
            })
        };
        let problem = SimulationErrorProblem {
            robot: robot.clone(),
            effects: settings(self.effects),
            parameters: parameters(&self.parameters, robot)?,
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

/// Fit the simulation of logs. `records` are (input, target, certainty or None) of `(n, n_axes)` arrays,
/// where each starts, and its lead.
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
) -> PyResult<Ended<FitResult>> {
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
) -> PyResult<Ended<Linearization>> {
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
) -> PyResult<Ended<Courses>> {
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
    Ended::of(runs.map(|runs| Courses {
        runs: runs.map(Arc::new),
    }))
}

/// A motion as (position, velocity, acceleration, torque, certainty), each `(n, n_axes)`, motor side.
type MotionTuple<'py> = (
    PyReadonlyArray2<'py, f64>,
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
    let record = |(q, v, a, t, c): &MotionTuple<'_>| {
        Ok(MotionRecord {
            position: rows(q, "position", n_axes)?,
            velocity: rows(v, "velocity", n_axes)?,
            acceleration: rows(a, "acceleration", n_axes)?,
            torque: rows(t, "torque", n_axes)?,
            certainty: rows(c, "certainty", n_axes)?,
        })
    };
    let problem = InverseDynamics {
        robot: robot.clone(),
        effects: settings(effects),
        parameters: parameters(&specs, robot)?,
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
) -> PyResult<Ended<FitResult>> {
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
) -> PyResult<Ended<Linearization>> {
    let (robot, block_s) = (&robot.description, options.block_s);
    let problem = inverse_dynamics(robot, effects, parameters, &records, weighting, block_s)?;
    let loss = loss(&options)?;
    let parameters = &problem.parameters;
    linearize(py, &flag(cancel), &problem, parameters, loss, &warm)
}
