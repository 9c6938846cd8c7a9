//! Frequency responses by local models.

use crate::entry::{detached, input_error};
use axisight_spectra::frf::{
    LocalEstimate, LocalModel, LocalModelError, Records, local_polynomial_periodic, local_rational,
};
use numpy::{Element, IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::AtomicBool;

/// Records for the core: owned, and checked for equal shapes.
struct Owned {
    shape: [usize; 2],
    channels: [usize; 2],
    input: Vec<f64>,
    output: Vec<f64>,
}

impl Owned {
    fn new(
        input: &PyReadonlyArray3<'_, f64>,
        output: &PyReadonlyArray3<'_, f64>,
    ) -> PyResult<Self> {
        let (u, y) = (input.as_array(), output.as_array());
        let ([e, n, inputs], [e_y, n_y, outputs]) = (dims(u.shape()), dims(y.shape()));
        if (e, n) != (e_y, n_y) || e * n * inputs * outputs == 0 {
            return Err(input_error(format!(
                "input, output: expected shapes (n_experiments, n_samples, n_channels) with \
                 equal numbers of experiments and samples, none zero, got {:?} and {:?}",
                u.shape(),
                y.shape()
            )));
        }
        Ok(Self {
            shape: [e, n],
            channels: [inputs, outputs],
            input: u.iter().copied().collect(),
            output: y.iter().copied().collect(),
        })
    }

    fn records(&self) -> Records<'_> {
        Records {
            n_samples: self.shape[1],
            n_inputs: self.channels[0],
            n_outputs: self.channels[1],
            input: &self.input,
            output: &self.output,
        }
    }

    fn estimate<'py>(
        &self,
        py: Python<'py>,
        threads: usize,
        work: impl FnOnce(&Records<'_>) -> Result<LocalEstimate, LocalModelError> + Send,
    ) -> PyResult<Bound<'py, PyDict>> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(input_error)?;
        let records = self.records();
        let found = detached(py, &AtomicBool::new(false), || {
            pool.install(|| work(&records))
        })?;
        let found = found.map_err(input_error)?;
        let shape = [found.flag.len(), self.channels[1], self.channels[0]];
        let out = PyDict::new(py);
        out.set_item("response", shaped(py, found.response, &shape)?)?;
        out.set_item("variance", shaped(py, found.variance, &shape)?)?;
        out.set_item("condition", found.condition.into_pyarray(py))?;
        let flags: Vec<i8> = found.flag.iter().map(|f| *f as i8).collect();
        out.set_item("flag", flags.into_pyarray(py))?;
        out.set_item("degrees_of_freedom", found.degrees_of_freedom)?;
        Ok(out)
    }
}

fn dims(shape: &[usize]) -> [usize; 3] {
    [0, 1, 2].map(|i| shape.get(i).copied().unwrap_or_default())
}

fn shaped<'py, T: Element>(
    py: Python<'py>,
    data: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    data.into_pyarray(py).reshape(shape.to_vec())
}

/// Local rational method (polynomial for denominator order 0) at lines of the whole record. Flags
/// are codes of `axisight.frf.Flag`.
#[pyfunction]
#[pyo3(signature = (input, output, lines, *, order, denominator_order, half_width, band, threads=0))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn frf_local_model<'py>(
    py: Python<'py>,
    input: PyReadonlyArray3<'py, f64>,
    output: PyReadonlyArray3<'py, f64>,
    lines: Vec<usize>,
    order: usize,
    denominator_order: usize,
    half_width: usize,
    band: (usize, usize),
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let model = LocalModel {
        order,
        denominator_order,
        half_width,
        band,
    };
    Owned::new(&input, &output)?.estimate(py, threads, |records| {
        local_rational(records, &lines, model)
    })
}

/// Local polynomial method for whole periods, at lines of the period. Flags are codes of
/// `axisight.frf.Flag`.
#[pyfunction]
#[pyo3(signature = (input, output, lines, *, n_periods, order, half_width, threads=0))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn frf_local_periodic<'py>(
    py: Python<'py>,
    input: PyReadonlyArray3<'py, f64>,
    output: PyReadonlyArray3<'py, f64>,
    lines: Vec<usize>,
    n_periods: usize,
    order: usize,
    half_width: usize,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    Owned::new(&input, &output)?.estimate(py, threads, |records| {
        local_polynomial_periodic(records, n_periods, &lines, order, half_width)
    })
}
