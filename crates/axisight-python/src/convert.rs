//! Conversion between `NumPy` arrays and plain vectors.

use crate::entry::InputError;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3,
};
use pyo3::prelude::*;

/// Row-major copy of a two-dimensional array; an error unless it has `columns` columns.
pub fn rows(array: &PyReadonlyArray2<'_, f64>, field: &str, columns: usize) -> PyResult<Vec<f64>> {
    let view = array.as_array();
    if view.ncols() != columns {
        return Err(InputError::new_err(format!(
            "{field}: expected shape (n, {columns}), got ({}, {})",
            view.nrows(),
            view.ncols()
        )));
    }
    Ok(view.iter().copied().collect())
}

/// Row-major copies of the planes of a three-dimensional array; an error unless it has `columns`
/// columns.
pub fn planes(
    array: &PyReadonlyArray3<'_, f64>,
    field: &str,
    columns: usize,
) -> PyResult<Vec<Vec<f64>>> {
    let view = array.as_array();
    if view.shape()[2] != columns {
        return Err(InputError::new_err(format!(
            "{field}: expected shape (n_runs, n, {columns}), got {:?}",
            view.shape()
        )));
    }
    Ok(view
        .outer_iter()
        .map(|plane| plane.iter().copied().collect())
        .collect())
}

/// An `(n, columns)` array from row-major numbers.
pub fn array2<'py>(
    py: Python<'py>,
    data: Vec<f64>,
    columns: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let n = data.len().checked_div(columns).unwrap_or(0);
    data.into_pyarray(py).reshape([n, columns])
}

/// An `(n, rows, columns)` array from row-major numbers.
pub fn array3<'py>(
    py: Python<'py>,
    data: Vec<f64>,
    rows: usize,
    columns: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let n = data.len().checked_div(rows * columns).unwrap_or(0);
    data.into_pyarray(py).reshape([n, rows, columns])
}

/// A one-dimensional array.
pub fn array1<'py>(py: Python<'py>, data: Vec<f64>) -> Bound<'py, PyArray1<f64>> {
    data.into_pyarray(py)
}

/// A two-dimensional array from its entries.
pub fn matrix<'py>(
    py: Python<'py>,
    (rows, columns): (usize, usize),
    entry: impl Fn(usize, usize) -> f64,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let mut data = Vec::with_capacity(rows * columns);
    for i in 0..rows {
        data.extend((0..columns).map(|j| entry(i, j)));
    }
    array2(py, data, columns)
}
