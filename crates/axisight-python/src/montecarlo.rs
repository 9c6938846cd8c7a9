//! Monte Carlo studies: blocks of runs and their accumulators.

use crate::effects::{EffectTuple, settings};
use crate::entry::{CancelToken, detached, flag, input_error};
use crate::robot::Robot;
use crate::simulation::IntegratorSpec;
use axisight_montecarlo::{
    Block, BlockError, Distribution, Ensemble, FailureKind, Model, Spread, SpreadTarget, Study,
    StudySettings, Summary, run_block,
};
use axisight_spectra::ensemble::{Moments, QuantileSketch, STATISTICS};
use axisight_spectra::excitation::{Grid, Multisine, Square, directions};
use axisight_spectra::frf::Output;
use numpy::{
    Complex64, Element, IntoPyArray, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1,
    PyReadonlyArray2,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Spread: parameter, distribution, relative scale, absolute scale.
type SpreadTuple = (String, String, f64, f64);
/// Square wave: amplitude, period [s], smoothing samples.
type SquareTuple = (f64, f64, usize);

/// A checked study. It is immutable, so threads may share it.
#[pyclass(frozen, module = "axisight._core")]
pub struct MonteCarloStudy {
    study: Study,
}

/// An array of any shape from row-major numbers.
fn shaped<'py, T: Element>(
    py: Python<'py>,
    data: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    data.into_pyarray(py).reshape(shape.to_vec())
}

fn choice<T: Copy>(field: &str, name: &str, table: &[(&str, T)]) -> PyResult<T> {
    let found = table.iter().find(|(n, _)| *n == name);
    found.map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<_> = table.iter().map(|(n, _)| *n).collect();
        input_error(format!(
            "{field}: expected one of {}, got {name}",
            names.join(", ")
        ))
    })
}

#[pymethods]
impl MonteCarloStudy {
    #[new]
    #[pyo3(signature = (robot, effects, *, model, integrator, start, period_s, band_hz, grid, peak_rad_s, clipping_iterations, square, directions, direction_matrix, waiting_periods, periods, noise, noise_cutoff_hz, resolution, output, spread, relative_accuracy))]
    #[allow(clippy::too_many_arguments)] // keyword arguments of a binding
    fn new(
        robot: &Robot,
        effects: Vec<EffectTuple>,
        model: &str,
        integrator: IntegratorSpec,
        start: Option<Vec<f64>>,
        period_s: f64,
        band_hz: (f64, f64),
        grid: &str,
        peak_rad_s: f64,
        clipping_iterations: usize,
        square: Option<SquareTuple>,
        directions: &str,
        direction_matrix: Option<Vec<f64>>,
        waiting_periods: usize,
        periods: usize,
        noise: bool,
        noise_cutoff_hz: Option<f64>,
        resolution: f64,
        output: &str,
        spread: Vec<SpreadTuple>,
        relative_accuracy: f64,
    ) -> PyResult<Self> {
        let description = robot.description.clone();
        let (n, sample_time) = (description.n_axes(), description.sample_time);
        let effects = settings(effects);
        let linear = Model::Linear {
            substeps: integrator.substeps,
        };
        let models = [
            ("linear", linear),
            ("nonlinear", Model::Nonlinear(integrator.method()?)),
        ];
        let outputs = [
            ("position", Output::Position),
            ("velocity", Output::Velocity),
            ("acceleration", Output::Acceleration),
        ];
        let grid = choice(
            "multisine.grid",
            grid,
            &[("all", Grid::All), ("odd", Grid::Odd)],
        )?;
        let spread = spread
            .into_iter()
            .map(|(name, distribution, relative, absolute)| {
                let kinds = [
                    ("normal", Distribution::Normal),
                    ("uniform", Distribution::Uniform),
                ];
                Ok(Spread {
                    target: SpreadTarget::parse(&name, &description, &effects)
                        .map_err(input_error)?,
                    distribution: choice("spread.distribution", &distribution, &kinds)?,
                    relative,
                    absolute,
                })
            })
            .collect::<PyResult<_>>()?;
        let square = square
            .map(|(amplitude, period, smoothing)| {
                Square::new(amplitude, period, smoothing, sample_time)
            })
            .transpose()
            .map_err(input_error)?;
        let study = Study::new(StudySettings {
            start: start.unwrap_or_else(|| description.operating_point.clone()),
            model: choice("model", model, &models)?,
            multisine: Multisine::new(period_s, band_hz, grid, peak_rad_s, sample_time)
                .map_err(input_error)?
                .with_clipping(clipping_iterations),
            square,
            directions: match direction_matrix {
                Some(matrix) => matrix,
                None => self::directions(directions, n).map_err(input_error)?,
            },
            robot: description,
            effects,
            waiting_periods,
            periods,
            noise,
            noise_cutoff_hz,
            resolution,
            output: choice("output", output, &outputs)?,
            spread,
            relative_accuracy,
        });
        Ok(Self {
            study: study.map_err(input_error)?,
        })
    }

    #[getter]
    fn n_axes(&self) -> usize {
        self.study.n_axes()
    }

    #[getter]
    fn frequency_hz<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.study.frequency_hz().into_pyarray(py)
    }

    /// Velocity references of one experiment, `(sample, axis)` [rad/s].
    fn reference<'py>(
        &self,
        py: Python<'py>,
        seed: u64,
        run: u64,
        experiment: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.study.n_axes();
        if experiment >= n {
            return Err(input_error(format!(
                "experiment: expected 0 to {}, got {experiment}",
                n - 1
            )));
        }
        let broadband = self.study.broadband(seed, run);
        let data = self.study.reference(&broadband, experiment);
        let samples = data.len() / n;
        shaped(py, data, &[samples, n])
    }

    /// Accumulated results of the runs `first` to `first + count - 1`, or None if cancelled.
    #[pyo3(signature = (seed, first, count, *, keep_responses=false, cancel=None))]
    fn block<'py>(
        &self,
        py: Python<'py>,
        seed: u64,
        first: u64,
        count: u64,
        keep_responses: bool,
        cancel: Option<&Bound<'py, CancelToken>>,
    ) -> PyResult<Option<Bound<'py, PyDict>>> {
        let cancel = flag(cancel);
        let work = || run_block(&self.study, seed, first, count, keep_responses, &cancel);
        match detached(py, &cancel, work)? {
            Ok(block) => self.block_arrays(py, block, keep_responses).map(Some),
            Err(BlockError::Cancelled) => Ok(None),
            Err(error) => Err(input_error(error)),
        }
    }
}

impl MonteCarloStudy {
    fn block_arrays<'py>(
        &self,
        py: Python<'py>,
        block: Block,
        keep_responses: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let size = self.study.size();
        let out = PyDict::new(py);
        let Moments {
            count,
            inverse_count,
            values,
        } = block.moments;
        let counts = [count, inverse_count].concat();
        out.set_item("count", shaped(py, counts, &[2, size])?)?;
        out.set_item("moments", shaped(py, values, &[STATISTICS.len(), size])?)?;
        let (starts, buckets, counts) = block.sketch.to_parts();
        out.set_item("bucket_start", starts.into_pyarray(py))?;
        out.set_item("bucket", buckets.into_pyarray(py))?;
        out.set_item("bucket_count", counts.into_pyarray(py))?;
        let failures: Vec<u64> = block
            .failures
            .iter()
            .flat_map(|f| {
                let code = FailureKind::ALL.iter().position(|k| *k == f.kind);
                let code = code.unwrap_or_default() as u64;
                [f.run, code, f.experiment as u64, f.detail as u64]
            })
            .collect();
        let rows = block.failures.len();
        out.set_item("failures", shaped(py, failures, &[rows, 4])?)?;
        if keep_responses {
            let n = self.study.n_axes();
            let lines = size / (n * n);
            let runs = block.responses.len() / size;
            let responses = shaped(py, block.responses, &[runs, lines, n, n])?;
            out.set_item("responses", responses)?;
        }
        Ok(out)
    }
}

/// Names of the failure codes of a block.
#[pyfunction]
pub fn failure_kinds() -> Vec<&'static str> {
    FailureKind::ALL.iter().map(|k| k.name()).collect()
}

/// Accumulators of a study, merged block by block.
#[pyclass(module = "axisight._core")]
pub struct MonteCarloEnsemble {
    ensemble: Ensemble,
    lines: usize,
    n_axes: usize,
    accuracy: f64,
}

#[pymethods]
impl MonteCarloEnsemble {
    #[new]
    fn new(lines: usize, n_axes: usize, relative_accuracy: f64) -> PyResult<Self> {
        Ok(Self {
            ensemble: Ensemble::new(lines, n_axes, relative_accuracy).map_err(input_error)?,
            lines,
            n_axes,
            accuracy: relative_accuracy,
        })
    }

    /// Add the accumulators of a block.
    fn merge(
        &mut self,
        count: PyReadonlyArray2<'_, u64>,
        moments: PyReadonlyArray2<'_, f64>,
        bucket_start: PyReadonlyArray1<'_, u64>,
        bucket: PyReadonlyArray1<'_, i32>,
        bucket_count: PyReadonlyArray1<'_, u64>,
    ) -> PyResult<()> {
        let counts: Vec<u64> = count.as_array().iter().copied().collect();
        if !counts.len().is_multiple_of(2) {
            return Err(input_error("count: expected shape (2, n)"));
        }
        let (count, inverse_count) = counts.split_at(counts.len() / 2);
        let moments = Moments {
            count: count.to_vec(),
            inverse_count: inverse_count.to_vec(),
            values: moments.as_array().iter().copied().collect(),
        };
        let starts: Vec<u64> = bucket_start.as_array().iter().copied().collect();
        let buckets: Vec<i32> = bucket.as_array().iter().copied().collect();
        let counts: Vec<u64> = bucket_count.as_array().iter().copied().collect();
        let sketch = QuantileSketch::from_parts(self.accuracy, &starts, &buckets, &counts)
            .map_err(input_error)?;
        self.ensemble.merge(&moments, &sketch).map_err(input_error)
    }

    /// Statistics so far, as arrays `(line, output, input)`. Quantiles have a leading axis.
    fn summary<'py>(&self, py: Python<'py>, quantiles: Vec<f64>) -> PyResult<Bound<'py, PyDict>> {
        if let Some(q) = quantiles.iter().find(|q| !(0.0..=1.0).contains(*q)) {
            return Err(input_error(format!("quantiles: expected 0 to 1, got {q}")));
        }
        let shape = [self.lines, self.n_axes, self.n_axes];
        let all = [quantiles.len(), self.lines, self.n_axes, self.n_axes];
        let Summary {
            count,
            arithmetic_mean,
            log_mean,
            harmonic_mean,
            variance_real,
            variance_imag,
            covariance,
            standard_error,
            log_standard_error,
            quantiles,
        } = self.ensemble.summary(&quantiles);
        let out = PyDict::new(py);
        let means: [(&str, Vec<Complex64>); 3] = [
            ("arithmetic_mean", arithmetic_mean),
            ("log_mean", log_mean),
            ("harmonic_mean", harmonic_mean),
        ];
        for (name, data) in means {
            out.set_item(name, shaped(py, data, &shape)?)?;
        }
        let figures = [
            ("variance_real", variance_real),
            ("variance_imag", variance_imag),
            ("covariance", covariance),
            ("standard_error", standard_error),
            ("log_standard_error", log_standard_error),
        ];
        for (name, data) in figures {
            out.set_item(name, shaped(py, data, &shape)?)?;
        }
        out.set_item("count", shaped(py, count, &shape)?)?;
        out.set_item("magnitude_quantile", shaped(py, quantiles, &all)?)?;
        Ok(out)
    }
}
