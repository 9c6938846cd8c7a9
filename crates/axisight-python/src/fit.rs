//! Fits to logs that are prepared once and kept in the core.

use crate::convert::rows;
use crate::effects::{EffectTuple, settings};
use crate::entry::{CancelToken, detached, flag, input_error};
use crate::fit_results::{Column, Ended, FitResult, Linearization, problem_error};
use crate::fit_specs::{
    OptionSpec, ParameterSpec, SensedTuple, WeightingTuple, loss, options, parameters,
    sensed_outputs, weightings,
};
use crate::robot::Robot;
use crate::simulation::IntegratorSpec;
use axisight_core::simulation::Method;
use axisight_identification::logs::{
    Column as Shared, Courses as Runs, FitParameter, InverseDynamics, Linearization as Point,
    MotionRecord, OwnValue, Problem, Record, SimulationErrorProblem, SimulationInput,
    SimulationOutput, fit,
};
use axisight_numerics::descent::Status;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Index of a parameter with its Jacobian column.
type WarmColumn<'py> = (usize, Bound<'py, Column>);
/// A flag that ends a call early.
type Cancel<'a, 'py> = Option<&'a Bound<'py, CancelToken>>;

/// Pairs of status and advice, for every status without convergence.
#[pyfunction]
pub fn status_advice() -> Vec<(&'static str, &'static str)> {
    let all = Status::ALL.iter();
    all.filter_map(|s| Some((s.name(), s.advice()?))).collect()
}

fn warm_columns(warm: &[WarmColumn<'_>]) -> Vec<(usize, Shared)> {
    let shared = |(i, c): &WarmColumn<'_>| (*i, Arc::clone(&c.get().shared));
    warm.iter().map(shared).collect()
}

fn solve<P: Problem + Send>(
    py: Python<'_>,
    cancel: &AtomicBool,
    (problem, parameters): (&P, &[FitParameter]),
    spec: &OptionSpec,
    warm: &[WarmColumn<'_>],
) -> PyResult<Ended<FitResult>> {
    let (options, warm) = (options(spec)?, warm_columns(warm));
    let fit = detached(py, cancel, || fit(problem, parameters, options, &warm))?;
    Ended::of(fit.map(|fit| FitResult { fit }))
}

fn linearize<P: Problem + Send>(
    py: Python<'_>,
    cancel: &AtomicBool,
    (problem, parameters): (&P, &[FitParameter]),
    spec: &OptionSpec,
    warm: &[WarmColumn<'_>],
) -> PyResult<Ended<Linearization>> {
    let (loss, warm) = (loss(spec)?, warm_columns(warm));
    let at = detached(py, cancel, || Point::new(problem, parameters, loss, &warm))?;
    Ended::of(at.map(|at| Linearization { at }))
}

/// One record: input, target and certainty `(n, n_axes)`, driven joint angles at the start, and the
/// number of run-up samples of input and target.
type RecordTuple<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    Option<PyReadonlyArray2<'py, f64>>,
    Option<Vec<f64>>,
    usize,
);

/// Runs of a model over all logs, for the simulation of similar models.
#[pyclass(frozen, module = "axisight._core")]
pub struct Courses {
    /// `None` if the arm cannot be linearised along runs.
    runs: Option<Arc<Runs>>,
}

/// Logs for the simulation of a robot, ready for fits of any effects.
#[pyclass(frozen, module = "axisight._core")]
pub struct SimulatedLogs {
    /// The problem without effects and parameters.
    bare: SimulationErrorProblem,
}

impl SimulatedLogs {
    fn problem(
        &self,
        effects: Vec<EffectTuple>,
        specs: &[ParameterSpec],
        courses: Option<&Bound<'_, Courses>>,
        cancel: &Arc<AtomicBool>,
    ) -> PyResult<SimulationErrorProblem> {
        Ok(SimulationErrorProblem {
            effects: settings(effects),
            parameters: parameters(specs, &self.bare.robot)?,
            courses: courses.and_then(|c| c.get().runs.clone()),
            cancel: Some(Arc::clone(cancel)),
            ..self.bare.clone()
        })
    }
}

fn simulation_input(name: &str) -> PyResult<SimulationInput> {
    match name {
        "reference" => Ok(SimulationInput::Reference),
        "torque" => Ok(SimulationInput::Torque),
        "tracking" => Ok(SimulationInput::Tracking),
        other => {
            let text = "expected reference, torque or tracking";
            Err(input_error(format!("input: {text}, got {other}")))
        }
    }
}

fn simulation_output(name: &str) -> PyResult<SimulationOutput> {
    match name {
        "torque" => Ok(SimulationOutput::Torque),
        "position" => Ok(SimulationOutput::Position),
        other => {
            let text = format!("output: expected torque or position, got {other}");
            Err(input_error(text))
        }
    }
}

#[pymethods]
impl SimulatedLogs {
    #[new]
    #[pyo3(signature = (robot, records, weighting, *, input="reference", output="torque", sensed=Vec::new(), readings=Vec::new(), own=Vec::new(), block_s=1.0, integrator=None))]
    #[allow(clippy::too_many_arguments)] // keyword arguments of a binding
    fn new(
        robot: &Robot,
        records: Vec<RecordTuple<'_>>,
        weighting: Vec<WeightingTuple>,
        input: &str,
        output: &str,
        sensed: Vec<SensedTuple>,
        readings: Vec<Option<PyReadonlyArray2<'_, f64>>>,
        own: Vec<Vec<(usize, usize, f64)>>,
        block_s: f64,
        integrator: Option<IntegratorSpec>,
    ) -> PyResult<Self> {
        let robot = robot.description.clone();
        let n_axes = robot.n_axes();
        let sensed = sensed_outputs(sensed)?;
        let values = |number: usize| {
            let given = own.get(number).into_iter().flatten();
            let value = |(effect, parameter, value): &(usize, usize, f64)| OwnValue {
                effect: *effect,
                parameter: *parameter,
                value: *value,
            };
            given.map(value).collect()
        };
        let record = |(number, (i, t, c, start, lead)): (usize, RecordTuple<'_>)| {
            let certainty = c.map(|c| rows(&c, "certainty", n_axes));
            let read = readings.get(number).and_then(Option::as_ref);
            let read = read.map(|r| rows(r, "readings", sensed.len()));
            Ok(Arc::new(Record {
                input: rows(&i, "input", n_axes)?,
                target: rows(&t, "target", n_axes)?,
                certainty: certainty.transpose()?,
                sensed: read.transpose()?.unwrap_or_default(),
                own: values(number),
                start,
                lead,
            }))
        };
        let each_sample = Method::RungeKutta4 { substeps: 1 };
        let bare = SimulationErrorProblem {
            effects: Vec::new(),
            parameters: Vec::new(),
            records: records
                .into_iter()
                .enumerate()
                .map(record)
                .collect::<PyResult<_>>()?,
            input: simulation_input(input)?,
            output: simulation_output(output)?,
            weighting: weightings(weighting),
            sensed: sensed.clone(),
            method: integrator.map_or(Ok(each_sample), |i| i.method())?,
            block_s,
            courses: None,
            cancel: None,
            robot,
        };
        bare.validate().map_err(problem_error)?;
        Ok(Self { bare })
    }

    /// The same logs, reduced to those with the given indices.
    fn part(&self, logs: Vec<usize>) -> PyResult<Self> {
        let bare = self.bare.part(&logs).map_err(problem_error)?;
        Ok(Self { bare })
    }

    /// The same logs, reduced to the first `samples` compared samples of each.
    fn first(&self, samples: Vec<usize>) -> PyResult<Self> {
        let bare = self.bare.first(&samples).map_err(problem_error)?;
        Ok(Self { bare })
    }

    /// Fit the simulation to the logs.
    #[pyo3(signature = (effects, parameters, options, *, warm=Vec::new(), courses=None, cancel=None))]
    #[allow(clippy::too_many_arguments)] // keyword arguments of a binding
    fn fit(
        &self,
        py: Python<'_>,
        effects: Vec<EffectTuple>,
        parameters: Vec<ParameterSpec>,
        options: OptionSpec,
        warm: Vec<WarmColumn<'_>>,
        courses: Option<&Bound<'_, Courses>>,
        cancel: Cancel<'_, '_>,
    ) -> PyResult<Ended<FitResult>> {
        let cancel = flag(cancel);
        let problem = self.problem(effects, &parameters, courses, &cancel)?;
        let parameters = &problem.parameters[..];
        solve(py, &cancel, (&problem, parameters), &options, &warm)
    }

    /// Evaluate the simulation at the initial values of the parameters.
    #[pyo3(signature = (effects, parameters, options, *, warm=Vec::new(), courses=None, cancel=None))]
    #[allow(clippy::too_many_arguments)] // keyword arguments of a binding
    fn evaluate(
        &self,
        py: Python<'_>,
        effects: Vec<EffectTuple>,
        parameters: Vec<ParameterSpec>,
        options: OptionSpec,
        warm: Vec<WarmColumn<'_>>,
        courses: Option<&Bound<'_, Courses>>,
        cancel: Cancel<'_, '_>,
    ) -> PyResult<Ended<Linearization>> {
        let cancel = flag(cancel);
        let problem = self.problem(effects, &parameters, courses, &cancel)?;
        let parameters = &problem.parameters[..];
        linearize(py, &cancel, (&problem, parameters), &options, &warm)
    }

    /// Run a model, for linearising the arm of similar models along the runs.
    #[pyo3(signature = (effects, parameters, *, cancel=None))]
    fn run(
        &self,
        py: Python<'_>,
        effects: Vec<EffectTuple>,
        parameters: Vec<ParameterSpec>,
        cancel: Cancel<'_, '_>,
    ) -> PyResult<Ended<Courses>> {
        let cancel = flag(cancel);
        let problem = self.problem(effects, &parameters, None, &cancel)?;
        let theta: Vec<f64> = problem.parameters.iter().map(|p| p.initial).collect();
        let runs = detached(py, &cancel, || Runs::new(&problem, &theta))?;
        Ended::of(runs.map(|runs| Courses {
            runs: runs.map(Arc::new),
        }))
    }
}

/// One motion: position, velocity, acceleration, torque, certainty, each `(n, n_axes)`, motor side.
type MotionTuple<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
);

/// Measured motions for predicting a robot's torque, ready for fits of any effects.
#[pyclass(frozen, module = "axisight._core")]
pub struct MeasuredMotions {
    /// The problem without effects and parameters.
    bare: InverseDynamics,
}

impl MeasuredMotions {
    fn problem(
        &self,
        effects: Vec<EffectTuple>,
        specs: &[ParameterSpec],
    ) -> PyResult<InverseDynamics> {
        Ok(InverseDynamics {
            effects: settings(effects),
            parameters: parameters(specs, &self.bare.robot)?,
            ..self.bare.clone()
        })
    }
}

#[pymethods]
impl MeasuredMotions {
    #[new]
    #[pyo3(signature = (robot, records, weighting, *, block_s=1.0))]
    fn new(
        robot: &Robot,
        records: Vec<MotionTuple<'_>>,
        weighting: Vec<WeightingTuple>,
        block_s: f64,
    ) -> PyResult<Self> {
        let robot = robot.description.clone();
        let n_axes = robot.n_axes();
        let record = |(q, v, a, t, c): MotionTuple<'_>| {
            Ok(Arc::new(MotionRecord {
                position: rows(&q, "position", n_axes)?,
                velocity: rows(&v, "velocity", n_axes)?,
                acceleration: rows(&a, "acceleration", n_axes)?,
                torque: rows(&t, "torque", n_axes)?,
                certainty: rows(&c, "certainty", n_axes)?,
            }))
        };
        let bare = InverseDynamics {
            effects: Vec::new(),
            parameters: Vec::new(),
            records: records.into_iter().map(record).collect::<PyResult<_>>()?,
            weighting: weightings(weighting),
            block_s,
            robot,
        };
        bare.validate().map_err(problem_error)?;
        Ok(Self { bare })
    }

    /// The same motions, reduced to those with the given indices.
    fn part(&self, logs: Vec<usize>) -> PyResult<Self> {
        let bare = self.bare.part(&logs).map_err(problem_error)?;
        Ok(Self { bare })
    }

    /// The same motions with other factors on the errors of their samples.
    fn with_certainty(&self, certainty: Vec<PyReadonlyArray2<'_, f64>>) -> PyResult<Self> {
        let n_axes = self.bare.robot.n_axes();
        let factors = certainty.iter().map(|c| rows(c, "certainty", n_axes));
        let bare = self.bare.with_certainty(factors.collect::<PyResult<_>>()?);
        Ok(Self {
            bare: bare.map_err(problem_error)?,
        })
    }

    /// Fit the predicted torque to the measured torque.
    #[pyo3(signature = (effects, parameters, options, *, warm=Vec::new(), cancel=None))]
    fn fit(
        &self,
        py: Python<'_>,
        effects: Vec<EffectTuple>,
        parameters: Vec<ParameterSpec>,
        options: OptionSpec,
        warm: Vec<WarmColumn<'_>>,
        cancel: Cancel<'_, '_>,
    ) -> PyResult<Ended<FitResult>> {
        let problem = self.problem(effects, &parameters)?;
        let parameters = &problem.parameters[..];
        solve(py, &flag(cancel), (&problem, parameters), &options, &warm)
    }

    /// Evaluate the predicted torque at the initial values of the parameters.
    #[pyo3(signature = (effects, parameters, options, *, warm=Vec::new(), cancel=None))]
    fn evaluate(
        &self,
        py: Python<'_>,
        effects: Vec<EffectTuple>,
        parameters: Vec<ParameterSpec>,
        options: OptionSpec,
        warm: Vec<WarmColumn<'_>>,
        cancel: Cancel<'_, '_>,
    ) -> PyResult<Ended<Linearization>> {
        let problem = self.problem(effects, &parameters)?;
        let parameters = &problem.parameters[..];
        linearize(py, &flag(cancel), (&problem, parameters), &options, &warm)
    }
}
