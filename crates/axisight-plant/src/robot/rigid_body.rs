//! Rigid-body quantities of a robot at given joint angles, in plain numbers.

use super::chain::{Chain, Pose};
use super::description::{Motion, RobotDescription};
use super::dynamics::{Dynamics, DynamicsScratch, DynamicsState};
use nalgebra::DMatrix;

/// Kinematics and dynamics of all joints (driven and elastic).
#[derive(Debug, Clone)]
pub struct RigidBody {
    chain: Chain<f64>,
    dynamics: Dynamics<f64>,
    motion: Vec<Motion>,
    gravity: [f64; 3],
}

/// Error: a vector has the wrong length or a non-finite entry.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, got {got}")]
pub struct ShapeError {
    /// Name of the argument.
    pub field: &'static str,
    /// Expected value.
    pub expected: String,
    /// Actual value.
    pub got: String,
}

/// Check the length of a vector, and that its entries are finite; `what` names them.
#[inline(always)]
pub(super) fn check_numbers(
    field: &'static str,
    x: &[f64],
    n: usize,
    what: &str,
) -> Result<(), ShapeError> {
    if x.len() == n && x.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    Err(refused(field, x, n, what))
}

#[cold]
fn refused(field: &'static str, x: &[f64], n: usize, what: &str) -> ShapeError {
    let bad = x.iter().position(|v| !v.is_finite());
    let (expected, got) = match bad.filter(|_| x.len() == n) {
        None => (format!("{n} {what}"), x.len().to_string()),
        Some(i) => {
            let got = format!("{} at joint {}", x[i], i + 1);
            ("finite values".to_owned(), got)
        }
    };
    ShapeError {
        field,
        expected,
        got,
    }
}

impl RigidBody {
    /// The joints of a robot, without motors and springs.
    pub fn new(robot: &RobotDescription) -> Self {
        let chain = Chain::new(robot);
        Self {
            dynamics: Dynamics::new(&chain),
            chain,
            motion: robot.joints.iter().map(|j| j.motion).collect(),
            gravity: robot.gravity,
        }
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.chain.len()
    }

    fn check(&self, field: &'static str, x: &[f64]) -> Result<(), ShapeError> {
        check_numbers(field, x, self.n_joints(), "joint values")
    }

    fn evaluate(&self, q: &[f64], v: &[f64]) -> Result<DynamicsState<f64>, ShapeError> {
        self.check("q", q)?;
        self.check("v", v)?;
        Ok(self.dynamics.evaluate(q, v))
    }

    fn poses(&self, q: &[f64]) -> Result<Vec<Pose<f64>>, ShapeError> {
        self.check("q", q)?;
        Ok(self.chain.poses(q))
    }

    /// Inertia matrix M(q), row-major.
    ///
    /// # Errors
    /// [`ShapeError`] for a wrong length or non-finite value (as for all methods here).
    pub fn inertia_matrix(&self, q: &[f64]) -> Result<Vec<f64>, ShapeError> {
        Ok(self.evaluate(q, &vec![0.0; q.len()])?.inertia)
    }

    /// Coriolis, centrifugal and gravity forces c(q, v) + g(q).
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn bias(&self, q: &[f64], v: &[f64]) -> Result<Vec<f64>, ShapeError> {
        Ok(self.evaluate(q, v)?.bias)
    }

    /// Gravity forces g(q).
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn gravity(&self, q: &[f64]) -> Result<Vec<f64>, ShapeError> {
        self.bias(q, &vec![0.0; q.len()])
    }

    /// Joint forces for accelerations `a`: M(q) a + c(q, v) + g(q).
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn inverse_dynamics(
        &self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
    ) -> Result<Vec<f64>, ShapeError> {
        let mut tau = vec![0.0; self.n_joints()];
        self.inverse_dynamics_into([q, v, a], &mut self.scratch(), &mut tau)?;
        Ok(tau)
    }

    /// Joint accelerations under forces `tau`.
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn forward_dynamics(
        &self,
        q: &[f64],
        v: &[f64],
        tau: &[f64],
    ) -> Result<Vec<f64>, ShapeError> {
        let mut a = vec![0.0; self.n_joints()];
        self.forward_dynamics_into([q, v, tau], &mut self.scratch(), &mut a)?;
        Ok(a)
    }

    /// Scratch memory, for evaluating one state after another.
    pub fn scratch(&self) -> DynamicsScratch<f64> {
        self.dynamics.scratch()
    }

    /// [`RigidBody::inverse_dynamics`], written to `tau`, with one entry per joint.
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn inverse_dynamics_into(
        &self,
        [q, v, a]: [&[f64]; 3],
        scratch: &mut DynamicsScratch<f64>,
        tau: &mut [f64],
    ) -> Result<(), ShapeError> {
        self.check("a", a)?;
        self.check("q", q)?;
        self.check("v", v)?;
        self.dynamics.forces_along(q, v, a, scratch, tau);
        Ok(())
    }

    /// [`RigidBody::forward_dynamics`], written to `a`, with one entry per joint.
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn forward_dynamics_into(
        &self,
        [q, v, tau]: [&[f64]; 3],
        scratch: &mut DynamicsScratch<f64>,
        a: &mut [f64],
    ) -> Result<(), ShapeError> {
        self.check("tau", tau)?;
        self.check("q", q)?;
        self.check("v", v)?;
        self.dynamics.accelerate(q, v, tau, scratch, a);
        Ok(())
    }

    /// Pose of the link frame of joint `joint`: rotation (rows) and origin [m], base frame.
    ///
    /// # Errors
    /// [`ShapeError`], also for a joint the chain does not have.
    pub fn pose(&self, q: &[f64], joint: usize) -> Result<([[f64; 3]; 3], [f64; 3]), ShapeError> {
        let poses = self.poses(q)?;
        self.check_joint(joint)?;
        Ok((poses[joint].rotation.0, poses[joint].position.0))
    }

    fn check_joint(&self, joint: usize) -> Result<(), ShapeError> {
        if joint < self.n_joints() {
            return Ok(());
        }
        Err(ShapeError {
            field: "joint",
            expected: format!("a joint from 1 to {}", self.n_joints()),
            got: (joint + 1).to_string(),
        })
    }

    /// Geometric Jacobian of a point fixed in the frame of `joint`: rows are
    /// linear velocity [m] then angular velocity of that link, base frame;
    /// columns are all joints. Joints that do not carry the link have zeros.
    ///
    /// # Errors
    /// [`ShapeError`], also for a joint the chain does not have.
    pub fn jacobian(
        &self,
        q: &[f64],
        joint: usize,
        point: [f64; 3],
    ) -> Result<DMatrix<f64>, ShapeError> {
        let poses = self.poses(q)?;
        self.check_joint(joint)?;
        let tip = poses[joint].position + poses[joint].rotation.apply_constant(&point);
        let mut out = DMatrix::zeros(6, self.n_joints());
        for i in self.chain.path(joint) {
            let axis = poses[i].axis;
            match self.motion[i] {
                Motion::Revolute => {
                    let linear = axis.cross(&(tip - poses[i].position));
                    for k in 0..3 {
                        out[(k, i)] = linear.0[k];
                        out[(3 + k, i)] = axis.0[k];
                    }
                }
                Motion::Prismatic => {
                    for k in 0..3 {
                        out[(k, i)] = axis.0[k];
                    }
                }
            }
        }
        Ok(out)
    }

    /// Kinetic and potential energy of the links [J].
    ///
    /// # Errors
    /// [`ShapeError`].
    pub fn energy(&self, q: &[f64], v: &[f64]) -> Result<(f64, f64), ShapeError> {
        let state = self.evaluate(q, v)?;
        let n = v.len();
        let kinetic: f64 = (0..n)
            .map(|i| v[i] * (0..n).map(|j| state.inertia[i * n + j] * v[j]).sum::<f64>())
            .sum();
        let potential: f64 = self
            .chain
            .joints
            .iter()
            .zip(&self.chain.poses(q))
            .filter_map(|(joint, pose)| {
                let body = joint.body.as_ref()?;
                let com = pose.position + pose.rotation.apply_constant(&body.com);
                let height: f64 = (0..3).map(|k| self.gravity[k] * com.0[k]).sum();
                Some(-body.mass * height)
            })
            .sum();
        Ok((0.5 * kinetic, potential))
    }
}
