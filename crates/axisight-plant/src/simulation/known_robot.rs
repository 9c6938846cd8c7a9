//! The robot model of a controller, for gravity compensation or computed torque.

use crate::plant::{Plant, PlantError};
use crate::robot::{Controller, DynamicsScratch, Known};
use axisight_scalar::Scalar;

/// A rigid robot that fits do not change.
pub struct KnownRobot<S: Scalar> {
    model: Plant<S>,
    /// Whether the controller's commands are accelerations.
    moves: bool,
    /// Joint angles, rates and accelerations. Elastic joints stay at rest.
    joints: [Vec<S>; 3],
    scratch: DynamicsScratch<S>,
    force: Vec<S>,
    torque: Vec<S>,
}

impl<S: Scalar> KnownRobot<S> {
    /// The robot model of a controller of `n_axes` axes; `None` if the controller has no model.
    ///
    /// # Errors
    /// [`PlantError`] if the robot cannot be built.
    pub fn of(kind: &Controller, n_axes: usize) -> Result<Option<Self>, PlantError> {
        let Controller::PdPosition {
            known: Some(known), ..
        } = kind
        else {
            return Ok(None);
        };
        let (Known::Gravity(robot) | Known::Dynamics(robot)) = known;
        let model = Plant::with_kernels(robot, &[], Vec::new())?;
        let still = vec![S::zero(); model.chain.len()];
        Ok(Some(Self {
            moves: matches!(known, Known::Dynamics(_)),
            scratch: model.dynamics.scratch(),
            force: still.clone(),
            joints: [still.clone(), still.clone(), still],
            torque: vec![S::zero(); n_axes],
            model,
        }))
    }

    /// Convert the output of the feedback to motor torques, at measured angles and speeds.
    ///
    /// The output is accelerations, or torques to which gravity is added.
    pub fn command(&mut self, angle: &[S], speed: &[S], out: &mut [S]) {
        if self.moves {
            let wanted = out.to_vec();
            out.copy_from_slice(self.torque(angle, speed, &wanted));
        } else {
            let still = vec![S::zero(); angle.len()];
            let gravity = self.torque(angle, &still, &still);
            out.iter_mut().zip(gravity).for_each(|(u, g)| *u += *g);
        }
    }

    /// Convert accelerations to motor torques for a robot at rest, without its weight. Torques stay
    /// unchanged.
    pub fn weigh(&mut self, angle: &[S], out: &mut [S]) {
        if !self.moves {
            return;
        }
        let (still, wanted) = (vec![S::zero(); angle.len()], out.to_vec());
        out.copy_from_slice(self.torque(angle, &still, &wanted));
        let gravity = self.torque(angle, &still, &still);
        out.iter_mut().zip(gravity).for_each(|(u, g)| *u -= *g);
    }

    /// Motor torques for motor angles, speeds and accelerations, rotors included.
    pub fn torque(&mut self, angle: &[S], speed: &[S], acceleration: &[S]) -> &[S] {
        for (joints, motors) in self.joints.iter_mut().zip([angle, speed, acceleration]) {
            for (axis, motor) in self.model.axes.iter().zip(motors) {
                joints[axis.joint] = *motor * axis.ratio;
            }
        }
        let [angle, speed, along] = &self.joints;
        let (dynamics, scratch) = (&self.model.dynamics, &mut self.scratch);
        dynamics.forces_along(angle, speed, along, scratch, &mut self.force);
        let axes = self.model.axes.iter().zip(acceleration);
        for ((axis, acceleration), torque) in axes.zip(&mut self.torque) {
            *torque = self.force[axis.joint] * axis.ratio + axis.motor_inertia * *acceleration;
        }
        &self.torque
    }
}
