//! Accelerometers of a robot.

use crate::convert::{array2, rows};
use crate::entry::input_error;
use crate::robot::Robot;
use axisight_core::robot::{Chain, Dynamics, JointMotion, n_readings};
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

/// Name, joint, position and directions of an accelerometer.
type AccelerometerTuple = (String, String, [f64; 3], Vec<[f64; 3]>);

/// Every accelerometer of a robot, with the name of the joint whose link carries it.
#[pyfunction]
pub fn accelerometers(robot: &Robot) -> Vec<AccelerometerTuple> {
    let d = &robot.description;
    let each = d.accelerometers.iter().map(|a| {
        let joint = d.joints[a.joint].name.clone();
        (a.name.clone(), joint, a.position, a.directions.clone())
    });
    each.collect()
}

/// Readings `(m, n_readings)` of the accelerometers along motions of all joints: angles, rates and
/// accelerations `(m, n_joints)`.
#[pyfunction]
pub fn specific_force<'py>(
    py: Python<'py>,
    robot: &Robot,
    q: PyReadonlyArray2<'py, f64>,
    v: PyReadonlyArray2<'py, f64>,
    a: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let d = &robot.description;
    let n = d.n_joints();
    let (q, v, a) = (rows(&q, "q", n)?, rows(&v, "v", n)?, rows(&a, "a", n)?);
    if v.len() != q.len() || a.len() != q.len() {
        let got = format!("{}, {} and {}", q.len() / n, v.len() / n, a.len() / n);
        return Err(input_error(format!(
            "q, v, a: expected equal numbers of rows, got {got}"
        )));
    }
    let width = n_readings(&d.accelerometers);
    let dynamics = Dynamics::<f64>::new(&Chain::new(d));
    let mut out = vec![0.0; q.len() / n * width];
    let motions = q
        .chunks_exact(n)
        .zip(v.chunks_exact(n).zip(a.chunks_exact(n)));
    for ((q, (v, a)), out) in motions.zip(out.chunks_exact_mut(width.max(1))) {
        dynamics.specific_force(JointMotion { q, v, a }, &d.accelerometers, out);
    }
    array2(py, out, width)
}

/// The same robot with the description `text` in place of its own. Changed parameters, effects,
/// operating point and controller stay.
#[pyfunction]
pub fn described_as(robot: &Robot, text: String) -> PyResult<Robot> {
    Robot::_restore(
        text,
        robot.changes.clone(),
        robot.controller_speed,
        robot.effects(),
        robot.description.operating_point.clone(),
        robot.velocity_feedforward(),
    )
}
