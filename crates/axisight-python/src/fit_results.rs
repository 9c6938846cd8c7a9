//! Results of fits, for Python.

use crate::convert::{array1, array2, array3};
use crate::entry::input_error;
use axisight_identification::logs::{
    BlockGram, Column as Shared, Divergence, Fit, Linearization as Point, ProblemError,
};
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use std::sync::Arc;

/// A model without a valid run, along some of the logs or along any log.
#[pyclass(frozen, module = "axisight._core")]
pub struct Diverged {
    divergence: Divergence,
}

#[pymethods]
impl Diverged {
    #[new]
    #[pyo3(signature = (reason, logs=Vec::new(), sample=None))]
    fn new(reason: String, logs: Vec<usize>, sample: Option<usize>) -> Self {
        Self {
            divergence: Divergence {
                records: logs,
                sample,
                reason,
            },
        }
    }
    #[getter]
    fn logs(&self) -> Vec<usize> {
        self.divergence.records.clone()
    }
    #[getter]
    fn sample(&self) -> Option<usize> {
        self.divergence.sample
    }
    fn __str__(&self) -> String {
        self.divergence.to_string()
    }
    fn __repr__(&self) -> String {
        format!("Diverged({:?})", self.divergence.reason)
    }
}

/// The result of a model, or its divergence if it has no valid run.
#[derive(IntoPyObject)]
pub enum Ended<T> {
    Holds(T),
    Diverged(Diverged),
}

impl<T> Ended<T> {
    /// Convert an outcome. Invalid input and Ctrl-C raise.
    pub fn of(outcome: Result<T, ProblemError>) -> PyResult<Self> {
        match outcome {
            Ok(found) => Ok(Self::Holds(found)),
            Err(ProblemError::Diverged(divergence)) => Ok(Self::Diverged(Diverged { divergence })),
            Err(other) => Err(problem_error(other)),
        }
    }
}

/// The Python error of a problem error that is not a divergence.
pub fn problem_error(e: ProblemError) -> PyErr {
    match e {
        ProblemError::Cancelled => pyo3::exceptions::PyKeyboardInterrupt::new_err("cancelled"),
        other => input_error(other),
    }
}

/// A block: log, axis, start and length.
type BlockTuple = (usize, usize, usize, usize);

/// A column of a Jacobian, kept in the core for reuse by other fits.
#[pyclass(frozen, module = "axisight._core")]
pub struct Column {
    pub(crate) shared: Shared,
}

#[pymethods]
impl Column {
    /// The values, as a copy.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.shared.to_vec())
    }

    /// Ranges of rows (start, end), as a column.
    fn part(&self, rows: Vec<(usize, usize)>) -> PyResult<Self> {
        let mut kept = Vec::with_capacity(rows.iter().map(|(a, b)| b.saturating_sub(*a)).sum());
        for (first, last) in rows {
            let range = self.shared.get(first..last).ok_or_else(|| {
                input_error(format!(
                    "rows: expected ranges within {}, got {first}..{last}",
                    self.shared.len()
                ))
            })?;
            kept.extend_from_slice(range);
        }
        Ok(Self {
            shared: Shared::new(kept),
        })
    }
}

/// Rows of a matrix, from separate columns.
fn stacked(columns: &[Shared]) -> Vec<f64> {
    columns.iter().flat_map(|c| c.iter().copied()).collect()
}

/// Columns for Python, shared with the core.
fn handed_out(columns: &[Shared]) -> Vec<Column> {
    let shared = columns.iter().map(Arc::clone);
    shared.map(|shared| Column { shared }).collect()
}

/// Result of a fit. Arrays are copies.
#[pyclass(frozen, module = "axisight._core")]
pub struct FitResult {
    pub(crate) fit: Fit,
}

#[pymethods]
impl FitResult {
    #[getter]
    fn status(&self) -> &'static str {
        self.fit.status.name()
    }
    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.fit.theta.clone())
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
    fn n_residuals(&self) -> usize {
        self.fit.n_residuals
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
    fn free(&self) -> Vec<usize> {
        self.fit.free.clone()
    }
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array2(py, self.fit.covariance.clone(), self.fit.free.len())
    }
    #[getter]
    fn sandwich<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array2(py, self.fit.sandwich.clone(), self.fit.free.len())
    }
    #[getter]
    fn condition(&self) -> f64 {
        self.fit.condition
    }
    #[getter]
    fn up_to_date(&self) -> bool {
        self.fit.up_to_date
    }
    #[getter]
    fn at_bound(&self) -> Vec<usize> {
        self.fit.at_bound.clone()
    }
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.fit.residual.clone())
    }
    /// Jacobian columns of the free parameters, `(n_free, n_residuals)`.
    #[getter]
    fn jacobian<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array2(py, stacked(&self.fit.columns), self.fit.n_residuals)
    }
    /// Jacobian columns of the free parameters, kept in the core.
    #[getter]
    fn columns(&self) -> Vec<Column> {
        handed_out(&self.fit.columns)
    }
    #[getter]
    fn blocks(&self) -> Vec<BlockTuple> {
        places(&self.fit.blocks)
    }
    #[getter]
    fn block_matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        matrices(py, &self.fit.blocks, self.fit.free.len())
    }
    #[getter]
    fn block_gradient<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        gradients(py, &self.fit.blocks, self.fit.free.len())
    }
    #[getter]
    fn block_loss<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        losses(py, &self.fit.blocks)
    }
}

/// A problem linearized at given parameters. Arrays are copies.
#[pyclass(frozen, module = "axisight._core")]
pub struct Linearization {
    pub(crate) at: Point,
}

#[pymethods]
impl Linearization {
    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.at.theta.clone())
    }
    #[getter]
    fn loss(&self) -> f64 {
        self.at.loss
    }
    #[getter]
    fn free(&self) -> Vec<usize> {
        self.at.free.clone()
    }
    #[getter]
    fn at_bound(&self) -> Vec<usize> {
        self.at.at_bound.clone()
    }
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.at.residual.clone())
    }
    /// Jacobian columns of the free parameters, `(n_free, n_residuals)`.
    #[getter]
    fn jacobian<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array2(py, stacked(&self.at.columns), self.at.residual.len())
    }
    /// Jacobian columns of the free parameters, kept in the core.
    #[getter]
    fn columns(&self) -> Vec<Column> {
        handed_out(&self.at.columns)
    }
    #[getter]
    fn blocks(&self) -> Vec<BlockTuple> {
        places(&self.at.blocks)
    }
    #[getter]
    fn block_matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        matrices(py, &self.at.blocks, self.at.free.len())
    }
    #[getter]
    fn block_gradient<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        gradients(py, &self.at.blocks, self.at.free.len())
    }
    #[getter]
    fn block_loss<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        losses(py, &self.at.blocks)
    }
}

/// Blocks as rows (log, axis, start, length).
fn places(blocks: &[BlockGram]) -> Vec<BlockTuple> {
    let blocks = blocks.iter().map(|g| g.block);
    blocks.map(|b| (b.record, b.axis, b.start, b.len)).collect()
}

/// `J^T W J` by block, `(n_blocks, n_free, n_free)`.
fn matrices<'py>(
    py: Python<'py>,
    blocks: &[BlockGram],
    n: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat = blocks.iter().flat_map(|g| g.matrix.iter().copied());
    array3(py, flat.collect(), n, n)
}

/// `J^T W r` by block, `(n_blocks, n_free)`.
fn gradients<'py>(
    py: Python<'py>,
    blocks: &[BlockGram],
    n: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat = blocks.iter().flat_map(|g| g.gradient.iter().copied());
    array2(py, flat.collect(), n)
}

/// Loss by block.
fn losses<'py>(py: Python<'py>, blocks: &[BlockGram]) -> Bound<'py, PyArray1<f64>> {
    array1(py, blocks.iter().map(|g| g.loss).collect())
}
