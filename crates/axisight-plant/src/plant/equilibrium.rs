//! Static equilibrium: elastic joints settled under gravity, motors holding the arm.

use super::axis::Axis;
use super::equations::Plant;
use crate::effect::{Arm, AxisTorque, CoupledAxis};
use axisight_scalar::Scalar;

/// A plant at rest.
#[derive(Debug, Clone)]
pub struct Equilibrium<S> {
    /// Angles of the joints that effects put below the first one [rad].
    pub base_angle: Vec<S>,
    /// Angles of the robot's joints [rad].
    pub joint_angle: Vec<S>,
    /// Motor angles [rad].
    pub motor_angle: Vec<S>,
    /// Torque command that holds the arm, including effects of the torque path [Nm].
    pub motor_torque: Vec<S>,
}

/// Reason why no equilibrium was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EquilibriumError {
    /// Wrong number of driven joint angles.
    #[error("joint_angle: expected {expected} driven joint angles, got {got}")]
    Shape {
        /// Number of driven joints.
        expected: usize,
        /// Number of given angles.
        got: usize,
    },
    /// A gear cannot carry its static load, or a parameter is not finite.
    #[error("axis {axis}: expected a gear that carries its static load, got no finite deflection")]
    NoDeflection {
        /// Driven axis, counted from 1.
        axis: usize,
    },
    /// The elastic joints do not settle.
    #[error(
        "elastic joints do not settle under gravity (last change {change:.1e} rad): \
         expected springs stiffer than the gravity load"
    )]
    NotSettled {
        /// Last change of an elastic joint [rad].
        change: f64,
    },
}

impl<S: Scalar> Plant<S> {
    /// State at rest.
    pub fn state_at_rest(&self, rest: &Equilibrium<S>) -> Vec<S> {
        let mut x = vec![S::zero(); self.n_states()];
        for (axis, angle) in self.axes.iter().zip(&rest.motor_angle) {
            if let Some(gear) = &axis.gear {
                x[gear.slot] = *angle;
            }
        }
        let joints = rest.base_angle.iter().chain(&rest.joint_angle);
        for (x, angle) in x[self.n_motors..].iter_mut().zip(joints) {
            *x = *angle;
        }
        x
    }
}

const MAX_ITERATIONS: usize = 200;

/// Static equilibrium with the driven joints at `driven` [rad].
///
/// The fixed-point iteration `q_e = -K_e^-1 g_e(q)` contracts by the ratio of gravity stiffness to
/// spring stiffness (1e-3 on the nominal robot). Derivatives carried by the scalar converge at the
/// same rate.
///
/// # Errors
/// [`EquilibriumError`] if the number of angles is wrong, a gear cannot carry its static load, or
/// the springs are too soft to settle.
#[inline(never)]
pub fn equilibrium<S: Scalar>(
    plant: &Plant<S>,
    driven: &[S],
) -> Result<Equilibrium<S>, EquilibriumError> {
    if driven.len() != plant.axes.len() {
        return Err(EquilibriumError::Shape {
            expected: plant.axes.len(),
            got: driven.len(),
        });
    }
    let n = plant.chain.len();
    let rest = vec![S::zero(); n];
    let mut q = rest.clone();
    for (axis, angle) in plant.axes.iter().zip(driven) {
        q[axis.joint] = *angle;
    }
    let mut settled_for = 0;
    let mut change = 0.0;
    for _ in 0..MAX_ITERATIONS {
        let mut load = plant.dynamics.evaluate(&q, &rest).bias;
        relieve(plant, &q, &rest, &mut load);
        change = settle_step(plant, &load, &mut q);
        // Derivatives settle later than values, so three settled iterations are required.
        settled_for = if change < 1e-16 { settled_for + 1 } else { 0 };
        if settled_for == 3 {
            return hold(plant, &q, &load);
        }
    }
    Err(EquilibriumError::NotSettled { change })
}

/// Subtract from the load on the joints what the effects of the arm carry.
fn relieve<S: Scalar>(plant: &Plant<S>, q: &[S], rest: &[S], load: &mut [S]) {
    let mut force = rest.to_vec();
    for on_arm in &plant.on_arm {
        let arm = Arm {
            angles: &q[plant.n_base..],
            speeds: &rest[plant.n_base..],
            internal: &[],
        };
        on_arm.kernel.arm_force(&arm, &mut force[plant.n_base..]);
    }
    for (load, force) in load.iter_mut().zip(force) {
        *load -= force;
    }
}

fn settle_step<S: Scalar>(plant: &Plant<S>, load: &[S], q: &mut [S]) -> f64 {
    let mut largest: f64 = 0.0;
    for (joint, stiffness, _) in &plant.elastic {
        let next = -(load[*joint] / *stiffness);
        for lane in 0..S::LANES {
            let change = (next.lane(lane) - q[*joint].lane(lane)).abs();
            // A NaN must not count as settled.
            largest = if change.is_nan() {
                f64::INFINITY
            } else {
                largest.max(change)
            };
        }
        q[*joint] = next;
    }
    largest
}

/// Number of iterations over the effects between axes. Their torques move the motors only by the
/// compliance of the gears, so each iteration gains several digits.
const PAIR_PASSES: usize = 20;

fn hold<S: Scalar>(
    plant: &Plant<S>,
    q: &[S],
    load: &[S],
) -> Result<Equilibrium<S>, EquilibriumError> {
    let n_axes = plant.axes.len();
    let mut added = vec![AxisTorque::zero(); n_axes];
    let mut motors = hold_axes(plant, q, load, &added, &vec![S::zero(); n_axes])?;
    if !plant.on_pairs.is_empty() {
        for _ in 0..PAIR_PASSES {
            added = pair_torques(plant, q, &motors.0);
            add_reactions(plant, q, load, &mut added);
            motors = hold_axes(plant, q, load, &added, &motors.0)?;
        }
    }
    let (motor_angle, motor_torque) = motors;
    Ok(Equilibrium {
        base_angle: q[..plant.n_base].to_vec(),
        joint_angle: q[plant.n_base..].to_vec(),
        motor_angle,
        motor_torque,
    })
}

/// Motor angles and torque commands that hold the joints.
///
/// `added` are the torques of effects between axes, `motors` the motor angles [rad] of the previous
/// iteration.
fn hold_axes<S: Scalar>(
    plant: &Plant<S>,
    q: &[S],
    load: &[S],
    added: &[AxisTorque<S>],
    motors: &[S],
) -> Result<(Vec<S>, Vec<S>), EquilibriumError> {
    let mut motor_angle = Vec::with_capacity(plant.axes.len());
    let mut motor_torque = Vec::with_capacity(plant.axes.len());
    for (number, (axis, added)) in plant.axes.iter().zip(added).enumerate() {
        let joint_angle = q[axis.joint];
        let load = gear_load(axis, q, load) - added.joint;
        let turned = axis.led_by.iter().map(|lead| motors[lead.axis] * lead.by);
        let by_motor = turned.fold(joint_angle, |angle, by| angle - by);
        let angle = axis.motor_angle_at_rest(by_motor, load);
        if (0..S::LANES).any(|lane| !angle.lane(lane).is_finite()) {
            return Err(EquilibriumError::NoDeflection { axis: number + 1 });
        }
        motor_angle.push(angle);
        let mut command = axis.motor_torque_at_rest(angle, load) - added.motor;
        for kernel in axis.kernels.iter().rev() {
            command = kernel.drive_inverse(command);
        }
        motor_torque.push(command);
    }
    Ok((motor_angle, motor_torque))
}

/// Load on the gear of an axis at rest [Nm, joint side], without effects between axes.
fn gear_load<S: Scalar>(axis: &Axis<S>, q: &[S], load: &[S]) -> S {
    load[axis.joint] - axis.joint_torque_of(q[axis.joint], S::zero())
}

/// Subtract from each motor the load of the other gears that it turns.
fn add_reactions<S: Scalar>(plant: &Plant<S>, q: &[S], load: &[S], added: &mut [AxisTorque<S>]) {
    for (second, axis) in plant.axes.iter().enumerate() {
        let torque = gear_load(axis, q, load) - added[second].joint;
        for lead in &axis.led_by {
            added[lead.axis].motor -= torque * lead.by;
        }
    }
}

fn pair_torques<S: Scalar>(plant: &Plant<S>, q: &[S], motor_angle: &[S]) -> Vec<AxisTorque<S>> {
    let mut added = vec![AxisTorque::zero(); plant.axes.len()];
    let zero = S::zero();
    let state = |i: usize| CoupledAxis {
        motor_angle: motor_angle[i],
        motor_speed: zero,
        joint_angle: q[plant.axes[i].joint],
        joint_speed: zero,
    };
    for (axes, torques) in plant.between_axes(state) {
        for (i, torque) in axes.iter().zip(torques) {
            added[*i].motor += torque.motor;
            added[*i].joint += torque.joint;
        }
    }
    added
}
