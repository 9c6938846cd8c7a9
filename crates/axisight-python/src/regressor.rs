//! Torque and energy regressors, and the triangular factors of their regressions.

use crate::convert::{array1, array2, array3, rows};
use crate::entry::{detached, input_error};
use crate::robot::Robot;
use axisight_fit::regressor::{Extra, FactorRequest, Motion, Regressor, Signal, link_parameters};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArray4, PyArrayMethods, PyReadonlyArray2,
};
use pyo3::prelude::*;
use std::sync::atomic::AtomicBool;

/// Extra column: signal, joint coefficients, row coefficients, dead band, smoothing.
pub type ExtraTuple = (String, Vec<f64>, Vec<f64>, f64, f64);

fn extras(tuples: Vec<ExtraTuple>) -> PyResult<Vec<Extra>> {
    let convert = |(name, motion, rows, dead_band, smoothing): ExtraTuple| {
        let signal = match name.as_str() {
            "position" => Signal::Position,
            "velocity" => Signal::Velocity,
            "acceleration" => Signal::Acceleration,
            "direction" => Signal::Direction {
                dead_band,
                smoothing,
            },
            "constant" => Signal::Constant,
            other => {
                return Err(input_error(format!(
                    "extras: expected position, velocity, acceleration, direction or constant, \
                     got {other}"
                )));
            }
        };
        Ok(Extra {
            signal,
            motion,
            rows,
        })
    };
    tuples.into_iter().map(convert).collect()
}

fn regressor(
    robot: &Robot,
    row_map: &PyReadonlyArray2<'_, f64>,
    tuples: Vec<ExtraTuple>,
) -> PyResult<Regressor> {
    let row_map = rows(row_map, "rows", robot.description.n_coordinates())?;
    Regressor::new(&robot.description, &row_map, extras(tuples)?).map_err(input_error)
}

/// Position, velocity and acceleration, owned.
struct Owned([Vec<f64>; 3]);

impl Owned {
    fn new(n: usize, arrays: [&PyReadonlyArray2<'_, f64>; 3]) -> PyResult<Self> {
        let [q, v, a] = arrays;
        Ok(Self([rows(q, "q", n)?, rows(v, "v", n)?, rows(a, "a", n)?]))
    }

    fn motion(&self) -> Motion<'_> {
        let [q, v, a] = &self.0;
        Motion { q, v, a }
    }
}

/// Run on the given number of threads; zero means all, without the cost of a new pool.
fn on_threads<T: Send>(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let cancel = AtomicBool::new(false);
    if threads == 0 {
        return detached(py, &cancel, work);
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(input_error)?;
    detached(py, &cancel, || pool.install(work))
}

/// Regressor of the torques that `rows` selects or combines.
#[pyfunction]
#[pyo3(signature = (robot, q, v, a, *, rows, extras, threads=0))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn torque_regressor<'py>(
    py: Python<'py>,
    robot: PyRef<'_, Robot>,
    q: PyReadonlyArray2<'py, f64>,
    v: PyReadonlyArray2<'py, f64>,
    a: PyReadonlyArray2<'py, f64>,
    rows: PyReadonlyArray2<'py, f64>,
    extras: Vec<ExtraTuple>,
    threads: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let regressor = regressor(&robot, &rows, extras)?;
    let owned = Owned::new(regressor.n_joints(), [&q, &v, &a])?;
    let out = on_threads(py, threads, || regressor.evaluate(&owned.motion()))?;
    let out = out.map_err(input_error)?;
    let shape = [
        q.as_array().nrows(),
        regressor.n_rows(),
        regressor.n_parameters(),
    ];
    if out.is_empty() {
        return out.into_pyarray(py).reshape(shape);
    }
    array3(py, out, shape[1], shape[2])
}

/// Regressor of the energy of the links.
#[pyfunction]
#[pyo3(signature = (robot, q, v, *, threads=0))]
pub fn energy_regressor<'py>(
    py: Python<'py>,
    robot: PyRef<'_, Robot>,
    q: PyReadonlyArray2<'py, f64>,
    v: PyReadonlyArray2<'py, f64>,
    threads: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    if robot.description.floating_base.is_some() {
        return Err(input_error(
            "base: expected a fixed base for the energy, got a floating one",
        ));
    }
    let n = robot.description.n_joints();
    let identity = (0..n * n).map(|k| f64::from(u8::from(k / n == k % n)));
    let identity: Vec<f64> = identity.collect();
    let regressor =
        Regressor::new(&robot.description, &identity, Vec::new()).map_err(input_error)?;
    let (positions, velocities) = (rows(&q, "q", n)?, rows(&v, "v", n)?);
    let out = on_threads(py, threads, || regressor.energy(&positions, &velocities))?;
    array2(py, out.map_err(input_error)?, regressor.n_parameters())
}

/// Triangular factors of `[Phi | tau]`, for each block of samples and each row.
#[pyfunction]
#[pyo3(signature = (robot, q, v, a, torque, *, rows, extras, columns, known, weight, blocks, threads=0))]
#[allow(clippy::too_many_arguments)] // keyword arguments of a binding
pub fn regression_factors<'py>(
    py: Python<'py>,
    robot: PyRef<'_, Robot>,
    q: PyReadonlyArray2<'py, f64>,
    v: PyReadonlyArray2<'py, f64>,
    a: PyReadonlyArray2<'py, f64>,
    torque: PyReadonlyArray2<'py, f64>,
    rows: PyReadonlyArray2<'py, f64>,
    extras: Vec<ExtraTuple>,
    columns: Vec<usize>,
    known: Vec<f64>,
    weight: Option<PyReadonlyArray2<'py, f64>>,
    blocks: usize,
    threads: usize,
) -> PyResult<(Bound<'py, PyArray4<f64>>, Vec<usize>)> {
    let regressor = regressor(&robot, &rows, extras)?;
    let n_rows = regressor.n_rows();
    let owned = Owned::new(regressor.n_joints(), [&q, &v, &a])?;
    let torque = crate::convert::rows(&torque, "torque", n_rows)?;
    let weight = weight.map(|w| crate::convert::rows(&w, "weight", n_rows));
    let weight = weight.transpose()?;
    let request = FactorRequest {
        torque: &torque,
        weight: weight.as_deref(),
        columns: &columns,
        known: &known,
        blocks,
    };
    let found = on_threads(py, threads, || regressor.factors(&owned.motion(), &request))?;
    let found = found.map_err(input_error)?;
    let order = columns.len() + 1;
    let shape = [found.lengths.len(), n_rows, order, order];
    Ok((found.factor.into_pyarray(py).reshape(shape)?, found.lengths))
}

/// Inertial parameters of the links with mass, ten each, and the joints of these links. A floating
/// base has the last of its six joints, which come first.
#[pyfunction]
pub fn inertial_parameters<'py>(
    py: Python<'py>,
    robot: PyRef<'_, Robot>,
) -> (Vec<usize>, Bound<'py, PyArray1<f64>>) {
    let description = robot.description.on_base_joints();
    let joints = description.joints.iter().enumerate();
    let loaded = joints.filter(|(_, joint)| joint.link.is_some());
    let links = loaded.map(|(i, _)| i).collect();
    (links, array1(py, link_parameters(&robot.description)))
}
