//! Frequency responses from records, and batches of millions of small complex matrices.
//!
//! These calls read and write `NumPy` memory in place. A copy of a million 3x3 matrices would take
//! as long as their inversion (17 to 56 ns each), and a copy of the records as long as their
//! spectra.
//!
//! Nobody may write the memory while it is read, so the GIL is kept, but only for pieces of a few
//! milliseconds; see [`in_place`].

use crate::entry::{AxisightError, InputError, detached, in_place, input_error};
use axisight_numerics::{Threads, invert_batch, right_divide_batch};
use axisight_spectra::frf::{self, Channels, Extent, Layout, LineSpectra};
use numpy::{
    Complex64, Element, IntoPyArray, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1,
    PyReadonlyArray3, PyReadonlyArray4, PyReadwriteArray3, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

/// Numbers in one piece of work with the GIL.
const PIECE: usize = 1 << 18;

/// The threads of a call: 0 for every core, 1 for the calling thread.
struct Pool(Option<rayon::ThreadPool>);

impl Pool {
    fn new(threads: usize) -> PyResult<Self> {
        if threads == 1 {
            return Ok(Self(None));
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool
            .build()
            .map_err(|e| AxisightError::new_err(format!("threads: {e}")))?;
        Ok(Self(Some(pool)))
    }

    fn run<T: Send>(&self, work: impl FnOnce(Threads) -> T + Send) -> T {
        match &self.0 {
            None => work(Threads::This),
            Some(pool) => pool.install(|| work(Threads::Pool)),
        }
    }
}

/// Ranges that divide `count` items of `size` numbers into pieces.
fn pieces(count: usize, size: usize) -> impl Iterator<Item = Range<usize>> {
    // Whole groups of lanes, because kernels pad incomplete groups.
    let step = (PIECE / size.max(1)).next_multiple_of(64).max(64);
    (0..count)
        .step_by(step)
        .map(move |first| first..(first + step).min(count))
}

fn of(range: &Range<usize>, size: usize) -> Range<usize> {
    range.start * size..range.end * size
}

fn contiguous(field: &str) -> PyErr {
    InputError::new_err(format!("{field}: expected a C-contiguous array"))
}

/// Shape of `matrices` as (count, rows, columns).
fn shape3(shape: &[usize]) -> (usize, usize, usize) {
    (shape[0], shape[1], shape[2])
}

/// Write `matrices^-1` to `out`. Return true for singular matrices.
#[pyfunction]
#[pyo3(signature = (matrices, out, *, threads=1))]
pub fn invert_matrices<'py>(
    py: Python<'py>,
    matrices: PyReadonlyArray3<'py, Complex64>,
    mut out: PyReadwriteArray3<'py, Complex64>,
    threads: usize,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let (count, rows, n) = shape3(matrices.shape());
    if rows != n {
        return Err(InputError::new_err(format!(
            "matrices: expected shape (count, n, n), got ({count}, {rows}, {n})"
        )));
    }
    if out.shape() != matrices.shape() {
        return Err(InputError::new_err(format!(
            "out: expected shape {:?}, got {:?}",
            matrices.shape(),
            out.shape()
        )));
    }
    let (pool, mut singular) = (Pool::new(threads)?, Vec::with_capacity(count));
    for piece in pieces(count, n * n) {
        let a = matrices.as_slice().map_err(|_| contiguous("matrices"))?;
        let out = out.as_slice_mut().map_err(|_| contiguous("out"))?;
        let (a, out) = (&a[of(&piece, n * n)], &mut out[of(&piece, n * n)]);
        let found = in_place(py, || {
            pool.run(|threads| invert_batch(a, n, piece.len(), out, threads))
        })?;
        singular.extend(found.map_err(input_error)?);
    }
    Ok(singular.into_pyarray(py))
}

/// Write `y u^-1` to `out`. Return true where `u` is singular.
#[pyfunction]
#[pyo3(signature = (y, u, out, *, threads=1))]
pub fn right_divide_matrices<'py>(
    py: Python<'py>,
    y: PyReadonlyArray3<'py, Complex64>,
    u: PyReadonlyArray3<'py, Complex64>,
    mut out: PyReadwriteArray3<'py, Complex64>,
    threads: usize,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let ((count, m, n), (other, rows, columns)) = (shape3(u.shape()), shape3(y.shape()));
    if m != n || other != count || columns != n {
        return Err(InputError::new_err(format!(
            "u: expected shape ({other}, {columns}, {columns}) for y of \
             ({other}, {rows}, {columns}), got ({count}, {m}, {n})"
        )));
    }
    if out.shape() != y.shape() {
        return Err(InputError::new_err(format!(
            "out: expected shape {:?}, got {:?}",
            y.shape(),
            out.shape()
        )));
    }
    let (pool, mut singular) = (Pool::new(threads)?, Vec::with_capacity(count));
    let (size, wide) = (n * n, rows * n);
    for piece in pieces(count, size.max(wide)) {
        let y = y.as_slice().map_err(|_| contiguous("y"))?;
        let u = u.as_slice().map_err(|_| contiguous("u"))?;
        let out = out.as_slice_mut().map_err(|_| contiguous("out"))?;
        let (y, u) = (&y[of(&piece, wide)], &u[of(&piece, size)]);
        let out = &mut out[of(&piece, wide)];
        let found = in_place(py, || {
            let shape = (rows, n);
            pool.run(|threads| right_divide_batch(y, u, shape, piece.len(), out, threads))
        })?;
        singular.extend(found.map_err(input_error)?);
    }
    Ok(singular.into_pyarray(py))
}

type Records<'py> = PyReadonlyArray4<'py, f64>;
/// One signal: name, samples, and whether the drift is removed.
type Given<'a, 'py> = (&'a str, &'a Records<'py>, bool);

/// The common extent of all signals.
fn extent_of(given: &[Given<'_, '_>]) -> PyResult<Extent> {
    let mut wanted: Option<[usize; 3]> = None;
    for (field, array, _) in given {
        let shape = array.shape();
        let got = [shape[0], shape[1], shape[2]];
        if *wanted.get_or_insert(got) != got {
            return Err(InputError::new_err(format!(
                "{field}: expected (experiment, period, sample) {:?}, got {got:?}",
                wanted.unwrap_or_default()
            )));
        }
    }
    let [experiments, periods, samples] = wanted.unwrap_or_default();
    Ok(Extent {
        experiments,
        periods,
        samples,
    })
}

/// Spectra of all signals, computed for a few experiments at a time.
fn spectra(
    py: Python<'_>,
    given: &[Given<'_, '_>],
    extent: Extent,
    lines: &[usize],
    pool: &Pool,
) -> PyResult<Vec<Complex64>> {
    let channels: Vec<usize> = given.iter().map(|(_, a, _)| a.shape()[3]).collect();
    let plan = LineSpectra::new(&channels, extent.samples, lines);
    let record = extent.periods * extent.samples;
    let size = record * channels.iter().sum::<usize>();
    // An even number, because periods are transformed in pairs.
    let step = (PIECE / size.max(1)).max(1).next_multiple_of(2);
    let mut out = Vec::new();
    for first in (0..extent.experiments).step_by(step) {
        let last = (first + step).min(extent.experiments);
        let mut signals = Vec::with_capacity(given.len());
        for ((field, array, drifts), count) in given.iter().zip(&channels) {
            let all = array.as_slice().map_err(|_| contiguous(field))?;
            let data = &all[of(&(first..last), record * count)];
            let count = *count;
            signals.push((Channels { data, count }, *drifts));
        }
        let extent = Extent {
            experiments: last - first,
            ..extent
        };
        out.extend(in_place(py, || {
            pool.run(|threads| plan.of(&signals, extent, threads))
        })?);
    }
    Ok(out)
}

/// An array of any shape from row-major numbers.
fn shaped<'py, T: Element>(
    py: Python<'py>,
    data: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    data.into_pyarray(py).reshape(shape.to_vec())
}

/// DFT lines of one signal, `(experiment, period, line, channel)`.
#[pyfunction]
#[pyo3(signature = (signal, lines, *, remove_drift, threads=1))]
pub fn record_spectra<'py>(
    py: Python<'py>,
    signal: Records<'py>,
    lines: Vec<usize>,
    remove_drift: bool,
    threads: usize,
) -> PyResult<Bound<'py, PyArrayDyn<Complex64>>> {
    let given = [("signal", &signal, remove_drift)];
    let extent = extent_of(&given)?;
    let out = spectra(py, &given, extent, &lines, &Pool::new(threads)?)?;
    let shape = [
        extent.experiments,
        extent.periods,
        lines.len(),
        signal.shape()[3],
    ];
    shaped(py, out, &shape)
}

/// Multivariable estimate with its uncertainty.
#[pyfunction]
#[pyo3(signature = (input, output, reference, lines, factor, *, remove_drift, threads=1))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn multivariable<'py>(
    py: Python<'py>,
    input: Records<'py>,
    output: Records<'py>,
    reference: Option<Records<'py>>,
    lines: Vec<usize>,
    factor: PyReadonlyArray1<'py, Complex64>,
    remove_drift: bool,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let mut given = vec![("input", &input, false), ("output", &output, remove_drift)];
    given.extend(reference.as_ref().map(|r| ("reference", r, false)));
    let extent = extent_of(&given)?;
    let layout = Layout {
        experiments: extent.experiments,
        periods: extent.periods,
        lines: lines.len(),
        inputs: input.shape()[3],
        outputs: output.shape()[3],
        references: reference.as_ref().map_or(0, |r| r.shape()[3]),
    };
    let references = layout.references;
    if layout.experiments < layout.inputs || ![0, layout.inputs].contains(&references) {
        return Err(InputError::new_err(format!(
            "input: expected at least {} experiments and as many references or none, got {} \
             and {references}",
            layout.inputs, layout.experiments
        )));
    }
    let factor = factor.as_slice().map_err(|_| contiguous("factor"))?;
    if factor.len() != lines.len() {
        return Err(InputError::new_err(format!(
            "factor: expected {} numbers, got {}",
            lines.len(),
            factor.len()
        )));
    }
    let spectra = spectra(py, &given, extent, &lines, &Pool::new(threads)?)?;
    let factor = factor.to_vec();
    let estimate = detached(py, &AtomicBool::new(false), || {
        frf::multivariable(&spectra, layout, &factor)
    })?;
    let shape = [lines.len(), layout.outputs, layout.inputs];
    let out = PyDict::new(py);
    out.set_item("response", shaped(py, estimate.response, &shape)?)?;
    for (name, values) in [
        ("noise_variance", estimate.noise_variance),
        ("noise_freedom", estimate.noise_freedom),
        ("residual_variance", estimate.residual_variance),
    ] {
        out.set_item(name, shaped(py, values, &shape)?)?;
    }
    out.set_item("condition", estimate.condition.into_pyarray(py))?;
    out.set_item("flag", estimate.flag.into_pyarray(py))?;
    Ok(out)
}
