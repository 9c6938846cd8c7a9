//! The robot class.

use crate::convert::{array1, array2, array3, matrix, rows};
use crate::effects::{EffectTuple, settings, tuple};
use crate::entry::{AxisightError, RobotError, input_error};
use crate::joints::joint_entry;
use axisight_core::plant::{
    Linearization, assemble, equilibrium, linearize, stable_substeps, zoh_frequency_response,
};
use axisight_core::robot::{
    Controller, Joint, Known, Motion, Parameter, RigidBody, RobotDescription, ShapeError,
};
use axisight_core::robot_file::read_robot;
use axisight_identification::frequency::modes;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A robot description with its rigid-body algorithms.
#[pyclass(frozen, module = "axisight._core")]
#[derive(Clone)]
pub struct Robot {
    pub description: RobotDescription,
    body: RigidBody,
    source: String,
    pub changes: Vec<(String, f64)>,
    pub controller_speed: f64,
}

/// Pickled data of a robot: text, changed parameters, controller speed, effects, operating point,
/// and whether the controller feeds speed forward.
type Kept = (
    String,
    Vec<(String, f64)>,
    f64,
    Vec<EffectTuple>,
    Vec<f64>,
    bool,
);

type Matrix2<'py> = Bound<'py, PyArray2<f64>>;
type Matrix3<'py> = Bound<'py, PyArray3<f64>>;
/// Eigenvalues, frequencies, damping ratios and shapes.
type ModeArrays<'py> = (
    Matrix2<'py>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Matrix3<'py>,
);

impl Robot {
    fn linear(&self, effects: Vec<EffectTuple>, at: Option<Vec<f64>>) -> PyResult<Linearization> {
        let at = at.unwrap_or_else(|| self.description.operating_point.clone());
        linearize(&self.description, &settings(effects), &at).map_err(input_error)
    }

    /// Apply `f` to each row of `K` arrays `(n, joints)` of equal length. `f` fills a row of
    /// `width` numbers.
    fn each_row<'py, const K: usize>(
        &self,
        py: Python<'py>,
        arrays: [(&str, &PyReadonlyArray2<'_, f64>); K],
        width: usize,
        mut f: impl FnMut(&RigidBody, [&[f64]; K], &mut [f64]) -> Result<(), ShapeError>,
    ) -> PyResult<Matrix2<'py>> {
        let n = self.body.n_joints();
        let data = arrays
            .iter()
            .map(|(name, a)| rows(a, name, n))
            .collect::<PyResult<Vec<_>>>()?;
        let count = data.first().map_or(0, |d| d.len() / n);
        if let Some(i) = data.iter().position(|d| d.len() != count * n) {
            let got = data[i].len() / n;
            let name = arrays[i].0;
            return Err(input_error(format!(
                "{name}: expected {count} rows, got {got}"
            )));
        }
        let mut out = vec![0.0; count * width];
        for (row, out) in out.chunks_exact_mut(width).enumerate() {
            let at = std::array::from_fn(|k| &data[k][row * n..(row + 1) * n]);
            f(&self.body, at, out).map_err(input_error)?;
        }
        array2(py, out, width)
    }
}

#[pymethods]
impl Robot {
    /// Read a description in the format `axisight.robot/1` or `axisight.robot/2`.
    #[staticmethod]
    fn from_toml(text: String) -> PyResult<Self> {
        let description = read_robot(&text).map_err(|e| RobotError::new_err(e.to_string()))?;
        let body = RigidBody::new(&description);
        Ok(Self {
            description,
            body,
            source: text,
            changes: Vec::new(),
            controller_speed: 1.0,
        })
    }

    /// The same robot with some parameters replaced, by name.
    fn with_parameters(&self, values: Vec<(String, f64)>) -> PyResult<Self> {
        let mut description = self.description.clone();
        for (name, value) in &values {
            let parameter = Parameter::parse(name, &description).map_err(input_error)?;
            parameter.set(&mut description, *value);
        }
        Ok(Self {
            body: RigidBody::new(&description),
            description,
            source: self.source.clone(),
            changes: [&self.changes[..], &values[..]].concat(),
            controller_speed: self.controller_speed,
        })
    }

    /// The same robot with a controller for a loop that is `factor` times as fast as the stated
    /// one.
    fn with_controller_speed(&self, factor: f64) -> PyResult<Self> {
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(input_error(format!(
                "factor: expected a positive number, got {factor}"
            )));
        }
        let stated = read_robot(&self.source).map_err(input_error)?;
        let mut description = self.description.clone();
        description.controller = stated.controller.at_speed(factor);
        let out = Self {
            body: self.body.clone(),
            description,
            source: self.source.clone(),
            changes: self.changes.clone(),
            controller_speed: factor,
        };
        let on = self.velocity_feedforward();
        if out.velocity_feedforward() == on {
            return Ok(out);
        }
        out.with_velocity_feedforward(on)
    }

    /// Effects that the robot's own simulator includes.
    #[getter]
    pub fn effects(&self) -> Vec<EffectTuple> {
        self.description.effects.iter().map(tuple).collect()
    }

    /// The same robot with other own effects.
    fn with_effects(&self, effects: Vec<EffectTuple>) -> PyResult<Self> {
        let mut description = self.description.clone();
        description.effects = settings(effects);
        assemble::<f64>(&description, &[], &[]).map_err(input_error)?;
        Ok(Self {
            body: RigidBody::new(&description),
            description,
            source: self.source.clone(),
            changes: self.changes.clone(),
            controller_speed: self.controller_speed,
        })
    }

    /// The same robot with another operating point.
    fn with_operating_point(&self, angle: Vec<f64>) -> PyResult<Self> {
        let expected = self.description.n_axes();
        if angle.len() != expected || angle.iter().any(|x| !x.is_finite()) {
            return Err(input_error(format!(
                "angle: expected {expected} finite numbers, got {angle:?}"
            )));
        }
        let mut out = self.clone();
        out.description.operating_point = angle;
        Ok(out)
    }

    /// Whether a controller of positions uses the rate of its references as speed reference.
    #[getter]
    pub fn velocity_feedforward(&self) -> bool {
        !matches!(
            self.description.controller,
            Controller::PdPosition {
                feeds_speed: false,
                ..
            } | Controller::Cascade {
                told_positions: Some(false),
                ..
            }
        )
    }

    /// Whether the gains of the controller give accelerations, which the robot's dynamics turn into
    /// torques.
    #[getter]
    fn computed_torque(&self) -> bool {
        matches!(
            self.description.controller,
            Controller::PdPosition {
                known: Some(Known::Dynamics(_)),
                ..
            }
        )
    }

    /// Step [s] of the simulator that executes the control law, and the inertia [kg m^2] that it
    /// adds to each motor; None for a machine.
    #[getter]
    fn stepped(&self) -> Option<(f64, Vec<f64>)> {
        match &self.description.controller {
            Controller::PdPosition { stepped, .. } => {
                stepped.as_ref().map(|s| (s.step, s.inertia.clone()))
            }
            _ => None,
        }
    }

    /// The same robot, whose controller of positions has the rate of its references as speed
    /// reference or not.
    fn with_velocity_feedforward(&self, on: bool) -> PyResult<Self> {
        let mut out = self.clone();
        match &mut out.description.controller {
            Controller::PdPosition { feeds_speed, .. }
            | Controller::Cascade {
                told_positions: Some(feeds_speed),
                ..
            } => *feeds_speed = on,
            _ => {
                return Err(input_error(format!(
                    "controller: expected kind pd_position or cascade_position, got {}",
                    self.controller_kind()
                )));
            }
        }
        Ok(out)
    }

    /// Relative tolerance of the robot's own parameters by quantity, if stated.
    #[getter]
    fn tolerances(&self) -> Vec<(String, f64)> {
        self.description.tolerances.clone()
    }

    /// Rebuild a robot from its pickled data.
    #[staticmethod]
    pub(crate) fn _restore(
        text: String,
        changes: Vec<(String, f64)>,
        controller_speed: f64,
        effects: Vec<EffectTuple>,
        operating_point: Vec<f64>,
        velocity_feedforward: bool,
    ) -> PyResult<Self> {
        let robot = Self::from_toml(text)?
            .with_parameters(changes)?
            .with_controller_speed(controller_speed)?
            .with_effects(effects)?
            .with_operating_point(operating_point)?;
        if velocity_feedforward == robot.velocity_feedforward() {
            return Ok(robot);
        }
        robot.with_velocity_feedforward(velocity_feedforward)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Kept)> {
        let maker = slf.get_type().getattr("_restore")?;
        let robot = slf.get();
        let kept = (
            robot.source.clone(),
            robot.changes.clone(),
            robot.controller_speed,
            robot.effects(),
            robot.description.operating_point.clone(),
            robot.velocity_feedforward(),
        );
        Ok((maker, kept))
    }

    fn __repr__(&self) -> String {
        let d = &self.description;
        format!(
            "<Robot {:?}: {} axes, {} joints>",
            d.name,
            d.n_axes(),
            d.n_joints()
        )
    }

    #[getter]
    fn toml(&self) -> &str {
        &self.source
    }
    #[getter]
    fn name(&self) -> &str {
        &self.description.name
    }
    #[getter]
    fn sample_time_s(&self) -> f64 {
        self.description.sample_time
    }
    #[getter]
    fn n_axes(&self) -> usize {
        self.description.n_axes()
    }
    #[getter]
    fn n_joints(&self) -> usize {
        self.description.n_joints()
    }
    #[getter]
    fn joint_names(&self) -> Vec<String> {
        self.description
            .joints
            .iter()
            .map(|j| j.name.clone())
            .collect()
    }
    #[getter]
    fn axis_joints(&self) -> Vec<usize> {
        self.description.driven().map(|(i, _, _)| i).collect()
    }
    #[getter]
    fn gear_ratio<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(
            py,
            self.description
                .driven()
                .map(|(_, _, d)| d.gear_ratio)
                .collect(),
        )
    }
    #[getter]
    fn axis_is_prismatic(&self) -> Vec<bool> {
        let slides = |(_, j, _): (_, &Joint, _)| j.motion == Motion::Prismatic;
        self.description.driven().map(slides).collect()
    }
    #[getter]
    fn axis_is_rigid(&self) -> Vec<bool> {
        self.description
            .driven()
            .map(|(_, j, _)| j.compliance.is_none())
            .collect()
    }
    #[getter]
    fn operating_point<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array1(py, self.description.operating_point.clone())
    }
    #[getter]
    fn position_noise_std(&self) -> f64 {
        self.description.position_noise_std
    }
    #[getter]
    fn controller_kind(&self) -> &'static str {
        match self.description.controller {
            Controller::PiVelocity { .. } => "pi_velocity",
            Controller::PVelocity { .. } => "p_velocity",
            Controller::Cascade {
                told_positions: None,
                ..
            } => "cascade",
            Controller::Cascade { .. } => "cascade_position",
            Controller::PdPosition { .. } => "pd_position",
            Controller::None => "none",
        }
    }
    /// Controller gains by name, one value per axis.
    #[getter]
    fn controller_gains<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        let set = |name: &str, gain: &Vec<f64>| out.set_item(name, array1(py, gain.clone()));
        match &self.description.controller {
            Controller::PiVelocity { kp, ki } => {
                set("kp", kp)?;
                set("ki", ki)?;
            }
            Controller::PVelocity { kp } => set("kp", kp)?,
            Controller::Cascade { kv, kp, ki, .. } => {
                set("kv", kv)?;
                set("kp", kp)?;
                set("ki", ki)?;
            }
            Controller::PdPosition { kp, kd, .. } => {
                set("kp", kp)?;
                set("kd", kd)?;
            }
            Controller::None => {}
        }
        Ok(out)
    }
    #[getter]
    fn gravity_m_s2(&self) -> [f64; 3] {
        self.description.gravity
    }
    /// Every joint from base to tip, with its link, spring and drive.
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let joints = self.description.joints.iter();
        joints.map(|joint| joint_entry(py, joint)).collect()
    }
    /// Names and values of all physical parameters.
    fn parameters(&self) -> Vec<(String, f64)> {
        let d = &self.description;
        let all = Parameter::all(d).into_iter();
        all.map(|p| (p.name(d), p.nominal(d))).collect()
    }

    fn inertia_matrix<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Matrix3<'py>> {
        let n = self.body.n_joints();
        let flat = self.each_row(py, [("q", &q)], n * n, |body, [q], out| {
            out.copy_from_slice(&body.inertia_matrix(q)?);
            Ok(())
        })?;
        flat.reshape([q.as_array().nrows(), n, n])
    }
    fn bias<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArray2<'py, f64>,
        v: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Matrix2<'py>> {
        let n = self.body.n_joints();
        self.each_row(py, [("q", &q), ("v", &v)], n, |body, [q, v], out| {
            out.copy_from_slice(&body.bias(q, v)?);
            Ok(())
        })
    }
    fn gravity<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Matrix2<'py>> {
        let n = self.body.n_joints();
        self.each_row(py, [("q", &q)], n, |body, [q], out| {
            out.copy_from_slice(&body.gravity(q)?);
            Ok(())
        })
    }
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArray2<'py, f64>,
        v: PyReadonlyArray2<'py, f64>,
        a: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Matrix2<'py>> {
        let (n, mut scratch) = (self.body.n_joints(), self.body.scratch());
        let arrays = [("q", &q), ("v", &v), ("a", &a)];
        self.each_row(py, arrays, n, |body, at, out| {
            body.inverse_dynamics_into(at, &mut scratch, out)
        })
    }
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArray2<'py, f64>,
        v: PyReadonlyArray2<'py, f64>,
        tau: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Matrix2<'py>> {
        let (n, mut scratch) = (self.body.n_joints(), self.body.scratch());
        let arrays = [("q", &q), ("v", &v), ("tau", &tau)];
        self.each_row(py, arrays, n, |body, at, out| {
            body.forward_dynamics_into(at, &mut scratch, out)
        })
    }
    fn energy<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArray2<'py, f64>,
        v: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Matrix2<'py>> {
        self.each_row(py, [("q", &q), ("v", &v)], 2, |body, [q, v], out| {
            let (kinetic, potential) = body.energy(q, v)?;
            out.copy_from_slice(&[kinetic, potential]);
            Ok(())
        })
    }
    /// Rotation and origin of the frame of joint `joint`, counted from 0.
    fn pose<'py>(
        &self,
        py: Python<'py>,
        q: Vec<f64>,
        joint: usize,
    ) -> PyResult<(Matrix2<'py>, Bound<'py, PyArray1<f64>>)> {
        let (r, p) = self.body.pose(&q, joint).map_err(input_error)?;
        Ok((matrix(py, (3, 3), |i, j| r[i][j])?, array1(py, p.to_vec())))
    }
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        q: Vec<f64>,
        joint: usize,
        point: [f64; 3],
    ) -> PyResult<Matrix2<'py>> {
        let j = self.body.jacobian(&q, joint, point).map_err(input_error)?;
        matrix(py, j.shape(), |r, c| j[(r, c)])
    }

    #[pyo3(signature = (effects, joint_angle=None))]
    fn equilibrium<'py>(
        &self,
        py: Python<'py>,
        effects: Vec<EffectTuple>,
        joint_angle: Option<Vec<f64>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let at = joint_angle.unwrap_or_else(|| self.description.operating_point.clone());
        let plant =
            assemble::<f64>(&self.description, &[], &settings(effects)).map_err(input_error)?;
        let rest = equilibrium(&plant, &at).map_err(input_error)?;
        let out = PyDict::new(py);
        out.set_item("joint_angle", array1(py, rest.joint_angle))?;
        out.set_item("motor_angle", array1(py, rest.motor_angle))?;
        out.set_item("motor_torque", array1(py, rest.motor_torque))?;
        Ok(out)
    }

    /// Steps of Runge-Kutta per sample that stay stable near standstill.
    fn stable_substeps(&self, effects: Vec<EffectTuple>) -> PyResult<usize> {
        stable_substeps(&self.description, &settings(effects)).map_err(input_error)
    }

    #[pyo3(signature = (effects, joint_angle=None))]
    fn linearize<'py>(
        &self,
        py: Python<'py>,
        effects: Vec<EffectTuple>,
        joint_angle: Option<Vec<f64>>,
    ) -> PyResult<(Matrix2<'py>, Matrix2<'py>, Matrix2<'py>)> {
        let l = self.linear(effects, joint_angle)?;
        Ok((
            matrix(py, l.a.shape(), |i, j| l.a[(i, j)])?,
            matrix(py, l.b.shape(), |i, j| l.b[(i, j)])?,
            matrix(py, l.c.shape(), |i, j| l.c[(i, j)])?,
        ))
    }

    /// Eigenvalues (re, im), frequencies, damping ratios and shapes (re, im).
    #[pyo3(signature = (effects, joint_angle=None))]
    fn modes<'py>(
        &self,
        py: Python<'py>,
        effects: Vec<EffectTuple>,
        joint_angle: Option<Vec<f64>>,
    ) -> PyResult<ModeArrays<'py>> {
        let l = self.linear(effects, joint_angle)?;
        let all = modes(&l).map_err(|e| AxisightError::new_err(e.to_string()))?;
        let values = all
            .iter()
            .flat_map(|m| [m.eigenvalue.re, m.eigenvalue.im])
            .collect();
        let shapes = all
            .iter()
            .flat_map(|m| m.shape.iter().flat_map(|c| [c.re, c.im]))
            .collect();
        Ok((
            array2(py, values, 2)?,
            array1(py, all.iter().map(|m| m.frequency_hz).collect()),
            array1(py, all.iter().map(|m| m.damping_ratio).collect()),
            array3(py, shapes, l.a.nrows(), 2)?,
        ))
    }

    /// Zero-order-hold response from motor torque to motor angle, `(n_freq, n_axes, 2 n_axes)`,
    /// with real and imaginary parts interleaved along the last axis; NaN at a pole.
    #[pyo3(signature = (frequency_hz, effects, joint_angle=None))]
    fn zoh_response<'py>(
        &self,
        py: Python<'py>,
        frequency_hz: Vec<f64>,
        effects: Vec<EffectTuple>,
        joint_angle: Option<Vec<f64>>,
    ) -> PyResult<Matrix3<'py>> {
        let l = self.linear(effects, joint_angle)?;
        let n = self.description.n_axes();
        let mut data = Vec::with_capacity(frequency_hz.len() * n * n * 2);
        for g in zoh_frequency_response(&l, self.description.sample_time, &frequency_hz) {
            for i in 0..n {
                for j in 0..n {
                    let value = g
                        .as_ref()
                        .map_or((f64::NAN, f64::NAN), |g| (g[(i, j)].re, g[(i, j)].im));
                    data.extend([value.0, value.1]);
                }
            }
        }
        array3(py, data, n, 2 * n)
    }
}
