//! Fits of linearized robots to frequency responses, and choice of operating points.

use crate::convert::{array1, array2, array3, matrix};
use crate::effects::{EffectTuple, settings};
use crate::entry::{CancelToken, InputError, detached, flag, input_error};
use crate::robot::Robot;
use axisight_core::robot::Parameter;
use axisight_identification::frequency::{
    Criterion, DesignOptions, FrequencyFit, FrequencyFitError, FrequencyOptions,
    FrequencyParameter, FrequencyProblem, Hold, PoseResponse, SearchOptions, Uncertainty, minimize,
};
use axisight_identification::logs::{Loss, OwnValue};
use numpy::{
    Complex64, PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// One parameter, from Python.
#[derive(FromPyObject)]
pub struct FrequencyParameterSpec {
    name: String,
    initial: f64,
    lower: f64,
    upper: f64,
    logarithmic: bool,
    prior: Option<(f64, f64)>,
    frozen: bool,
}

/// Settings of a fit, from Python.
#[derive(FromPyObject)]
pub struct FrequencyOptionSpec {
    sampled: bool,
    logarithmic: bool,
    weighted: bool,
    loss: String,
    loss_scale: f64,
    block_lines: usize,
    max_iterations: usize,
    gain_tolerance: f64,
    step_tolerance: f64,
}

/// One pose: joint angles, frequencies, response, variance, variance for the weights, covariance,
/// reference of logarithmic weights, derivative order, effect parameters with own values (effect,
/// parameter, value). Arrays over lines and elements are flat.
type PoseTuple<'py> = (
    Vec<f64>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, Complex64>,
    Option<PyReadonlyArray1<'py, f64>>,
    Option<PyReadonlyArray1<'py, f64>>,
    Option<PyReadonlyArray1<'py, Complex64>>,
    Option<PyReadonlyArray1<'py, Complex64>>,
    u8,
    Vec<(usize, usize, f64)>,
);

fn pose(tuple: PoseTuple<'_>) -> PyResult<PoseResponse> {
    let (
        joint_angle,
        frequency_hz,
        response,
        variance,
        weighing,
        covariance,
        reference,
        order,
        own,
    ) = tuple;
    let value = |(effect, parameter, value)| OwnValue {
        effect,
        parameter,
        value,
    };
    let plain = |a: &PyReadonlyArray1<'_, f64>| a.as_array().to_vec();
    let complex = |a: &PyReadonlyArray1<'_, Complex64>| a.as_array().to_vec();
    let uncertainty = match (variance, weighing, covariance) {
        (None, None, None) => Uncertainty::Unknown,
        (Some(variance), None, None) => Uncertainty::Variance(plain(&variance)),
        (Some(variance), Some(weighing), None) => Uncertainty::Pooled {
            stated: plain(&variance),
            weighing: plain(&weighing),
        },
        (None, None, Some(covariance)) => Uncertainty::Covariance(complex(&covariance)),
        _ => {
            return Err(InputError::new_err(
                "expected a variance or a covariance, got both",
            ));
        }
    };
    Ok(PoseResponse {
        joint_angle,
        frequency_hz: plain(&frequency_hz),
        response: complex(&response),
        uncertainty,
        reference: reference.as_ref().map(complex),
        order,
        own: own.into_iter().map(value).collect(),
    })
}

fn problem(
    robot: &Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<FrequencyParameterSpec>,
    poses: Vec<PoseTuple<'_>>,
    options: &FrequencyOptionSpec,
    cancel: &Arc<AtomicBool>,
) -> PyResult<FrequencyProblem> {
    let description = robot.description.clone();
    let parameter = |spec: FrequencyParameterSpec| {
        Ok(FrequencyParameter {
            parameter: Parameter::parse(&spec.name, &description).map_err(input_error)?,
            initial: spec.initial,
            lower: spec.lower,
            upper: spec.upper,
            logarithmic: spec.logarithmic,
            prior: spec.prior,
            frozen: spec.frozen,
        })
    };
    let parameters = parameters
        .into_iter()
        .map(parameter)
        .collect::<PyResult<_>>()?;
    let loss = match options.loss.as_str() {
        "squared" => Loss::Squared,
        "huber" => Loss::Huber(options.loss_scale),
        "soft_l1" => Loss::SoftL1(options.loss_scale),
        other => {
            let text = format!("loss: expected squared, huber or soft_l1, got {other}");
            return Err(InputError::new_err(text));
        }
    };
    let sampled = Hold::ZeroOrder(description.sample_time);
    let options = FrequencyOptions {
        hold: if options.sampled {
            sampled
        } else {
            Hold::Continuous
        },
        criterion: if options.logarithmic {
            Criterion::Logarithmic
        } else {
            Criterion::Linear
        },
        weighted: options.weighted,
        loss,
        block_lines: options.block_lines,
    };
    let poses = poses.into_iter().map(pose).collect::<PyResult<_>>()?;
    let (settings, cancel) = (settings(effects), Arc::clone(cancel));
    FrequencyProblem::new(description, settings, parameters, poses, options, cancel)
        .map_err(failure)
}

fn failure(e: FrequencyFitError) -> PyErr {
    match e {
        FrequencyFitError::Cancelled => pyo3::exceptions::PyKeyboardInterrupt::new_err("cancelled"),
        other => input_error(other),
    }
}

/// Result of a fit. Arrays are copies, and matrices cover the free parameters in search units.
#[pyclass(frozen, module = "axisight._core")]
pub struct FrequencyFitResult {
    fit: FrequencyFit,
}

#[pymethods]
impl FrequencyFitResult {
    #[getter]
    fn status(&self) -> &'static str {
        self.fit.status.name()
    }
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.fit.values.clone())
    }
    /// Slopes of the values over their search units.
    #[getter]
    fn slopes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.fit.slopes.clone())
    }
    #[getter]
    fn free(&self) -> Vec<usize> {
        self.fit.free.clone()
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
    fn iterations(&self) -> usize {
        self.fit.iterations
    }
    #[getter]
    fn evaluations(&self) -> usize {
        self.fit.evaluations
    }
    #[getter]
    fn n_residuals(&self) -> usize {
        self.fit.scatter.count
    }
    #[getter]
    fn at_bound(&self) -> Vec<usize> {
        self.fit.at_bound.clone()
    }
    /// `J^T W J` with the priors.
    #[getter]
    fn information<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.fit.matrix.shape(), |i, j| self.fit.matrix[(i, j)])
    }
    /// Covariance of the gradient due to the uncertainty of the responses, if known.
    #[getter]
    fn expected_scatter<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let known = self.fit.scatter.expected.as_ref();
        known
            .map(|m| matrix(py, m.shape(), |i, j| m[(i, j)]))
            .transpose()
    }
    /// Covariance of the gradient from its scatter over blocks of lines.
    #[getter]
    fn block_scatter<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let m = &self.fit.scatter.blocks;
        matrix(py, m.shape(), |i, j| m[(i, j)])
    }
    /// Whitened residuals of all poses, real and imaginary parts, `(n, 2)`.
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let parts = self.fit.scatter.residual.iter().flat_map(|r| [r.re, r.im]);
        array2(py, parts.collect(), 2)
    }
}

/// Fit the linearized robot to frequency responses.
#[pyfunction]
#[pyo3(signature = (robot, effects, parameters, poses, options, *, cancel=None))]
pub fn fit_frequency_responses(
    py: Python<'_>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<FrequencyParameterSpec>,
    poses: Vec<PoseTuple<'_>>,
    options: FrequencyOptionSpec,
    cancel: Option<&Bound<'_, CancelToken>>,
) -> PyResult<FrequencyFitResult> {
    let cancel = flag(cancel);
    let problem = problem(robot, effects, parameters, poses, &options, &cancel)?;
    let search = SearchOptions {
        max_iterations: options.max_iterations,
        gain_tolerance: options.gain_tolerance,
        step_tolerance: options.step_tolerance,
    };
    let fit = detached(py, &cancel, || minimize(&problem, search))?;
    Ok(FrequencyFitResult {
        fit: fit.map_err(failure)?,
    })
}

/// Information of each pose on the free parameters, `(n_poses, n_free, n_free)`.
#[pyfunction]
#[pyo3(signature = (robot, effects, parameters, poses, options, *, cancel=None))]
pub fn frequency_information<'py>(
    py: Python<'py>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    parameters: Vec<FrequencyParameterSpec>,
    poses: Vec<PoseTuple<'_>>,
    options: FrequencyOptionSpec,
    cancel: Option<&Bound<'_, CancelToken>>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let cancel = flag(cancel);
    let start = parameters.iter();
    let theta: Vec<f64> = start
        .map(|p| {
            if p.logarithmic {
                p.initial.ln()
            } else {
                p.initial
            }
        })
        .collect();
    let n = parameters.iter().filter(|p| !p.frozen).count();
    let problem = problem(robot, effects, parameters, poses, &options, &cancel)?;
    let found = detached(py, &cancel, || problem.information(&theta))?.map_err(failure)?;
    let flat = found.iter().flat_map(|m| m.iter().copied()).collect();
    array3(py, flat, n, n)
}

/// Response of the linearized robot, `(n_freq, n_axes, 2 n_axes)`, with real and imaginary parts
/// interleaved along the last axis.
#[pyfunction]
pub fn frequency_response<'py>(
    py: Python<'py>,
    robot: &Robot,
    effects: Vec<EffectTuple>,
    joint_angle: Vec<f64>,
    frequency_hz: Vec<f64>,
    sampled: bool,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    use axisight_identification::frequency::{Linearizer, SecondOrderError, evaluate};
    let sample_time = robot.description.sample_time;
    let hold = if sampled {
        Hold::ZeroOrder(sample_time)
    } else {
        Hold::Continuous
    };
    let linearizer = Linearizer::new(&robot.description, &settings(effects), &[], &[]);
    let (model, _) = linearizer
        .and_then(|l| l.at(&joint_angle))
        .map_err(input_error)?;
    let found = evaluate(&model, &[], &frequency_hz, hold)
        .ok_or_else(|| input_error(SecondOrderError::Mass))?;
    let n = robot.description.n_axes();
    let mut data = Vec::with_capacity(frequency_hz.len() * n * n * 2);
    for line in 0..frequency_hz.len() {
        for k in 0..n * n {
            let (re, im) = found.parts(0, k / n, k % n);
            data.extend([re[line], im[line]]);
        }
    }
    array3(py, data, n, 2 * n)
}

/// Choose operating points by their information matrices `(n, p, p)`, in addition to prior
/// information `(p, p)`.
#[pyfunction]
#[pyo3(signature = (information, prior, count, *, repeats, gap_tolerance, max_iterations))]
pub fn design_poses<'py>(
    py: Python<'py>,
    information: PyReadonlyArray3<'py, f64>,
    prior: PyReadonlyArray2<'py, f64>,
    count: usize,
    repeats: bool,
    gap_tolerance: f64,
    max_iterations: usize,
) -> PyResult<Bound<'py, PyDict>> {
    use axisight_identification::frequency::{InformationMatrix, design};
    let view = information.as_array();
    let p = view.shape()[1];
    let square = |values: Vec<f64>| InformationMatrix::from_row_slice(p, p, &values);
    let planes = view
        .outer_iter()
        .map(|plane| square(plane.iter().copied().collect()));
    let matrices: Vec<_> = planes.collect();
    let prior = square(prior.as_array().iter().copied().collect());
    let options = DesignOptions {
        count,
        repeats,
        gap_tolerance,
        max_iterations,
    };
    let found = detached(py, &AtomicBool::new(false), || {
        design(&matrices, &prior, options)
    })?
    .map_err(input_error)?;
    let out = PyDict::new(py);
    out.set_item("weights", array1(py, found.weights))?;
    out.set_item("sensitivity", array1(py, found.sensitivity))?;
    out.set_item("gap", found.gap)?;
    out.set_item("bound", found.bound)?;
    out.set_item("chosen", found.chosen)?;
    out.set_item("log_det", found.log_det)?;
    out.set_item("iterations", found.iterations)?;
    Ok(out)
}
