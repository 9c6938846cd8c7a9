//! Recursive filters.

use crate::convert::{array2, array3};
use crate::entry::{InputError, in_place};
use axisight_numerics::recursion::{filter, states};
use numpy::{PyArray2, PyArray3, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
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

/// States `(n_samples + 1, n_states, n_columns)` of a linear model; see
/// `axisight.statistics.recursion`.
#[pyfunction]
pub fn linear_states<'py>(
    py: Python<'py>,
    a: PyReadonlyArray2<'_, f64>,
    drive: PyReadonlyArray3<'_, f64>,
    start: PyReadonlyArray2<'_, f64>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (n, columns) = (start.shape()[0], start.shape()[1]);
    if a.shape() != [n, n] || drive.shape()[1..] != [n, columns] {
        let got = (a.shape().to_vec(), drive.shape().to_vec());
        return Err(InputError::new_err(format!(
            "a, drive: expected shapes ({n}, {n}) and (n_samples, {n}, {columns}), as start, got {got:?}"
        )));
    }
    let own = |x: &mut dyn Iterator<Item = &f64>| x.copied().collect::<Vec<f64>>();
    let factors = own(&mut a.as_array().iter());
    let driven = own(&mut drive.as_array().iter());
    let first = own(&mut start.as_array().iter());
    let found = in_place(py, || states(&factors, &driven, &first, n))?;
    array3(py, found, n, columns)
}
