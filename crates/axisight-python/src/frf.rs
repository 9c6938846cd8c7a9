//! Frequency responses from records, and small complex matrices by the million.
//!
//! These calls read and write `NumPy` memory in place and therefore keep the GIL: most of the
//! work is a single pass over it, and a copy would take as long.

use crate::entry::{AxisightError, InputError, input_error};
use axisight_core::frf::{self, Channels, Extent, Layout};
use axisight_core::signal::{invert_batch, right_divide_batch};
use numpy::{
    Complex64, Element, IntoPyArray, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1,
    PyReadonlyArray3, PyReadonlyArray4, PyReadwriteArray3, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Run `work` on `threads` threads, 0 for every core.
fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let pool = pool
        .build()
        .map_err(|e| AxisightError::new_err(format!("threads: {e}")))?;
    Ok(pool.install(work))
}

fn contiguous(field: &str) -> PyErr {
    InputError::new_err(format!("{field}: expected a C-contiguous array"))
}

/// Shape of `matrices` as (count, rows, columns).
fn shape3(shape: &[usize]) -> (usize, usize, usize) {
    (shape[0], shape[1], shape[2])
}

/// `out = matrices^-1`, true where singular.
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
    let a = matrices.as_slice().map_err(|_| contiguous("matrices"))?;
    let out = out.as_slice_mut().map_err(|_| contiguous("out"))?;
    let singular = on_threads(threads, || invert_batch(a, n, count, out))?;
    Ok(singular.map_err(input_error)?.into_pyarray(py))
}

/// `out = y u^-1`, true where `u` is singular.
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
    let (y, u) = (
        y.as_slice().map_err(|_| contiguous("y"))?,
        u.as_slice().map_err(|_| contiguous("u"))?,
    );
    let out = out.as_slice_mut().map_err(|_| contiguous("out"))?;
    let singular = on_threads(threads, || right_divide_batch(y, u, (rows, n), count, out))?;
    Ok(singular.map_err(input_error)?.into_pyarray(py))
}

/// Signals of one extent with whether their drift is removed.
struct Signals<'a> {
    list: Vec<(Channels<'a>, bool)>,
    extent: Extent,
}

type Records<'py> = PyReadonlyArray4<'py, f64>;

fn signals<'a>(given: &'a [(&str, &'a Records<'_>, bool)]) -> PyResult<Signals<'a>> {
    let mut out = Signals {
        list: Vec::new(),
        extent: Extent {
            experiments: 0,
            periods: 0,
            samples: 0,
        },
    };
    for (i, (field, array, drifts)) in given.iter().enumerate() {
        let shape = array.shape();
        let extent = &mut out.extent;
        if i == 0 {
            (extent.experiments, extent.periods, extent.samples) = (shape[0], shape[1], shape[2]);
        }
        let wanted = [extent.experiments, extent.periods, extent.samples];
        if shape[..3] != wanted {
            return Err(InputError::new_err(format!(
                "{field}: expected (experiment, period, sample) {wanted:?}, got {:?}",
                &shape[..3]
            )));
        }
        let channels = Channels {
            data: array.as_slice().map_err(|_| contiguous(field))?,
            count: shape[3],
        };
        out.list.push((channels, *drifts));
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

/// DFT lines of one signal, (experiment, period, line, channel).
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
    let signals = signals(&given)?;
    let out = on_threads(threads, || {
        frf::spectra(&signals.list, signals.extent, &lines)
    })?;
    let extent = signals.extent;
    let shape = [
        extent.experiments,
        extent.periods,
        lines.len(),
        signal.shape()[3],
    ];
    shaped(py, out, &shape)
}

/// The multivariable estimate with its uncertainty.
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
    let signals = signals(&given)?;
    let extent = signals.extent;
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
    let estimate = on_threads(threads, || {
        let spectra = frf::spectra(&signals.list, extent, &lines);
        frf::multivariable(&spectra, layout, factor)
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
