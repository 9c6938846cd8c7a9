//! Excitation: phases, crest factors, square waves, directions.

use crate::convert::{array1, array2};
use crate::entry::{CancelToken, detached, flag, input_error};
use axisight_spectra::excitation::crest::{
    Budget, Clipping, CrestProblem, LpRefinement, Start, peak, search,
};
use axisight_spectra::excitation::{self as core, Square};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Clipping: iterations, first level, last level, relaxation, oversampling.
type ClippingTuple = (usize, f64, f64, f64, usize);
/// Refinement: first exponent, last exponent, iterations, oversampling.
type RefinementTuple = (u32, u32, usize, usize);

/// Uniform random phases of one realization [rad].
#[pyfunction]
pub fn random_phases<'py>(
    py: Python<'py>,
    n: usize,
    seed: u64,
    run: u64,
) -> Bound<'py, PyArray1<f64>> {
    array1(py, core::random_phases(n, seed, run))
}

/// Peak of a multisine on the fine grid.
#[pyfunction]
pub fn multisine_peak(
    py: Python<'_>,
    lines: Vec<usize>,
    amplitude: Vec<f64>,
    phase: Vec<f64>,
) -> PyResult<f64> {
    let work = || peak(&lines, &amplitude, &phase);
    detached(py, &AtomicBool::new(false), work)?.map_err(input_error)
}

/// One period of a smoothed square wave.
#[pyfunction]
pub fn square_period<'py>(
    py: Python<'py>,
    amplitude: f64,
    period_s: f64,
    smoothing: usize,
    sample_time: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let square = Square::new(amplitude, period_s, smoothing, sample_time).map_err(input_error)?;
    Ok(array1(py, square.period()))
}

/// A direction matrix by name.
#[pyfunction]
pub fn directions<'py>(
    py: Python<'py>,
    name: &str,
    n: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    array2(py, core::directions(name, n).map_err(input_error)?, n)
}

/// Search for phases with a low crest factor.
#[pyfunction]
#[pyo3(signature = (lines, amplitude, *, snow, snow_limit, phase, seed, clipping, refinement, starts, time_s, threads, cancel=None))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn optimize_crest_factor<'py>(
    py: Python<'py>,
    lines: Vec<usize>,
    amplitude: Vec<f64>,
    snow: Vec<usize>,
    snow_limit: f64,
    phase: Option<Vec<f64>>,
    seed: u64,
    clipping: ClippingTuple,
    refinement: Option<RefinementTuple>,
    starts: u64,
    time_s: Option<f64>,
    threads: usize,
    cancel: Option<Bound<'py, CancelToken>>,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let problem = CrestProblem::new(&lines, &amplitude, &snow, snow_limit).map_err(input_error)?;
    let (iterations, first_level, last_level, relaxation, oversampling) = clipping;
    let clipping = Clipping {
        iterations,
        first_level,
        last_level,
        relaxation,
        oversampling,
    };
    let refinement = refinement.map(|(first, last, iterations, oversampling)| LpRefinement {
        first_exponent: first,
        last_exponent: last,
        iterations,
        oversampling,
    });
    let time = time_s
        .map(Duration::try_from_secs_f64)
        .transpose()
        .map_err(|_| input_error(format!("time_s: expected seconds, got {time_s:?}")))?;
    let budget = Budget {
        starts,
        time,
        threads,
    };
    let start = phase.map_or(Start::Random(seed), Start::Given);
    let cancel = flag(cancel.as_ref());
    let work = || search(&problem, &start, clipping, refinement, budget, &cancel);
    let Some(found) = detached(py, &cancel, work)?.map_err(input_error)? else {
        return Ok(None);
    };
    let out = PyDict::new(py);
    out.set_item("start", found.start)?;
    out.set_item("crest_factor", found.crest_factor)?;
    out.set_item("crest_factors", array1(py, found.crest_factors))?;
    out.set_item("phase", array1(py, found.phase))?;
    out.set_item("snow", array1(py, found.snow))?;
    out.set_item("clipping_iterations", found.effort.0)?;
    out.set_item("refinement_steps", found.effort.1)?;
    out.set_item("out_of_time", found.out_of_time)?;
    Ok(Some(out))
}
