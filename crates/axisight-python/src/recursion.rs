//! Recursive filters.

use crate::convert::array2;
use crate::entry::{InputError, in_place};
use axisight_numerics::recursion::filter;
use numpy::{PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// Solves a difference equation for signals `(n, k)`, each from zero; see
/// `axisight.statistics.recursion`.
#[pyfunction]
pub fn recursive<'py>(
    py: Python<'py>,
    above: Vec<f64>,
    below: Vec<f64>,
    signals: PyReadonlyArray2<'_, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    if below.first().is_none_or(|first| *first == 0.0) || above.is_empty() {
        return Err(InputError::new_err(
            "below: expected a first factor that is not zero, and factors above",
        ));
    }
    let columns = signals.shape()[1];
    let mut values: Vec<f64> = signals.as_array().iter().copied().collect();
    if columns > 0 {
        in_place(py, || filter(&above, &below, &mut values, columns))?;
    }
    array2(py, values, columns)
}
