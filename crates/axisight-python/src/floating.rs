//! Dynamics of robots with a floating base.

use crate::convert::{array2, array3, rows};
use crate::entry::input_error;
use crate::robot::Robot;
use axisight_core::robot::{BASE_NAMES, BaseMotion, FloatingBody};
use numpy::{PyArray2, PyArray3, PyReadonlyArray2};
use pyo3::prelude::*;

/// Mass, centre of mass and inertia of a link.
type LinkTuple = (f64, [f64; 3], [f64; 6]);

fn body_of(robot: &Robot) -> PyResult<FloatingBody> {
    let body = FloatingBody::new(&robot.description);
    body.ok_or_else(|| input_error("base: expected a floating base, got a fixed one"))
}

/// Refuse arrays of different numbers of rows. Each array has its numbers and its width.
fn same_rows<const K: usize>(arrays: [(&Vec<f64>, usize); K]) -> PyResult<usize> {
    let counts = arrays.map(|(data, width)| data.len() / width);
    if counts.iter().any(|count| *count != counts[0]) {
        return Err(input_error(format!(
            "q, v, base: expected equal numbers of rows, got {counts:?}"
        )));
    }
    Ok(counts[0])
}

/// Mass properties of the floating base; None for a fixed base.
#[pyfunction]
pub fn floating_base(robot: &Robot) -> Option<LinkTuple> {
    let base = robot.description.floating_base.as_ref();
    base.map(|link| (link.mass, link.com, link.inertia))
}

/// Names of the six coordinates of a floating base.
#[pyfunction]
pub fn base_names() -> [&'static str; 6] {
    BASE_NAMES
}

/// Inertia matrices `(m, 6 + n, 6 + n)` at joint positions `(m, n)`.
#[pyfunction]
pub fn floating_inertia<'py>(
    py: Python<'py>,
    robot: &Robot,
    q: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (body, n) = (body_of(robot)?, robot.description.n_joints());
    let (size, mut scratch) = (body.n_coordinates(), body.scratch());
    let q = rows(&q, "q", n)?;
    let mut out = vec![0.0; q.len() / n * size * size];
    for (q, out) in q.chunks_exact(n).zip(out.chunks_exact_mut(size * size)) {
        body.inertia_matrix(q, &mut scratch, out)
            .map_err(input_error)?;
    }
    array3(py, out, size, size)
}

/// Forces `(m, 6 + n)` along motions of joints `(m, n)` and base `(m, 9)`: angular velocity,
/// angular acceleration, proper acceleration.
#[pyfunction]
pub fn floating_inverse_dynamics<'py>(
    py: Python<'py>,
    robot: &Robot,
    q: PyReadonlyArray2<'py, f64>,
    v: PyReadonlyArray2<'py, f64>,
    a: PyReadonlyArray2<'py, f64>,
    base: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (body, n) = (body_of(robot)?, robot.description.n_joints());
    let (size, mut scratch) = (body.n_coordinates(), body.scratch());
    let (q, v, a) = (rows(&q, "q", n)?, rows(&v, "v", n)?, rows(&a, "a", n)?);
    let base = rows(&base, "base", 9)?;
    let count = same_rows([(&q, n), (&v, n), (&a, n), (&base, 9)])?;
    let mut out = vec![0.0; count * size];
    let parts = base.as_chunks::<3>().0.as_chunks::<3>().0;
    for ((i, out), parts) in out.chunks_exact_mut(size).enumerate().zip(parts) {
        let at = [&q, &v, &a].map(|x| &x[i * n..(i + 1) * n]);
        let [angular_velocity, angular_acceleration, proper_acceleration] = *parts;
        let base = BaseMotion {
            angular_velocity,
            angular_acceleration,
            proper_acceleration,
        };
        body.inverse_dynamics(at, &base, &mut scratch, out)
            .map_err(input_error)?;
    }
    array2(py, out, size)
}

/// Accelerations `(m, 6 + n)` under forces `tau (m, 6 + n)`, with the angular velocity of the base
/// `(m, 3)`.
#[pyfunction]
pub fn floating_forward_dynamics<'py>(
    py: Python<'py>,
    robot: &Robot,
    q: PyReadonlyArray2<'py, f64>,
    v: PyReadonlyArray2<'py, f64>,
    tau: PyReadonlyArray2<'py, f64>,
    angular_velocity: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (body, n) = (body_of(robot)?, robot.description.n_joints());
    let (size, mut scratch) = (body.n_coordinates(), body.scratch());
    let (q, v, tau) = (
        rows(&q, "q", n)?,
        rows(&v, "v", n)?,
        rows(&tau, "tau", size)?,
    );
    let rates = rows(&angular_velocity, "base", 3)?;
    let count = same_rows([(&q, n), (&v, n), (&tau, size), (&rates, 3)])?;
    let mut out = vec![0.0; count * size];
    let rates = rates.as_chunks::<3>().0;
    for ((i, out), rate) in out.chunks_exact_mut(size).enumerate().zip(rates) {
        let [q, v] = [&q, &v].map(|x| &x[i * n..(i + 1) * n]);
        let tau = &tau[i * size..(i + 1) * size];
        body.forward_dynamics([q, v, tau], *rate, &mut scratch, out)
            .map_err(input_error)?;
    }
    array2(py, out, size)
}
