//! Static equilibrium: elastic joints settled under gravity, motors holding.

use super::plant::Plant;
use axisight_scalar::Scalar;

/// A plant at rest.
#[derive(Debug, Clone)]
pub struct Equilibrium<S> {
    /// All joint angles [rad].
    pub joint_angle: Vec<S>,
    /// Motor angles [rad].
    pub motor_angle: Vec<S>,
    /// Torque command that holds the arm, effects of the torque path included [Nm].
    pub motor_torque: Vec<S>,
}

/// Why no equilibrium was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EquilibriumError {
    /// Wrong number of driven joint angles.
    #[error("joint_angle: expected {expected} driven joint angles, got {got}")]
    Shape {
        /// Driven joints.
        expected: usize,
        /// Angles given.
        got: usize,
    },
    /// A gear cannot carry its static load, or a parameter is not finite.
    #[error("axis {axis}: expected a gear that carries its static load, got no finite deflection")]
    NoDeflection {
        /// Driven axis, from 1.
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

const MAX_ITERATIONS: usize = 200;

/// Equilibrium with the driven joints at `driven` [rad].
///
/// Fixed-point iteration `q_e = -K_e^-1 g_e(q)`; it contracts by the ratio of
/// gravity stiffness to spring stiffness (1e-3 on the nominal robot), and
/// derivatives carried by the scalar converge at the same rate.
///
/// # Errors
/// [`EquilibriumError`] for a wrong shape or springs too soft to settle.
pub fn equilibrium<S: Scalar>(
    plant: &Plant<S>,
    driven: &[f64],
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
        q[axis.joint] = S::constant(*angle);
    }
    let mut settled_for = 0;
    let mut change = 0.0;
    for _ in 0..MAX_ITERATIONS {
        let state = plant.dynamics.evaluate(&q, &rest);
        change = settle_step(plant, &state.bias, &mut q);
        // One more iteration once the value is settled, for the derivatives.
        settled_for = if change < 1e-16 { settled_for + 1 } else { 0 };
        if settled_for == 3 {
            return hold(plant, q, &state.bias);
        }
    }
    Err(EquilibriumError::NotSettled { change })
}

fn settle_step<S: Scalar>(plant: &Plant<S>, gravity: &[S], q: &mut [S]) -> f64 {
    let mut largest: f64 = 0.0;
    for (joint, stiffness, _) in &plant.elastic {
        let next = -(gravity[*joint] / *stiffness);
        for lane in 0..S::LANES {
            let change = (next.lane(lane) - q[*joint].lane(lane)).abs();
            // A NaN must not pass for settled.
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

fn hold<S: Scalar>(
    plant: &Plant<S>,
    q: Vec<S>,
    gravity: &[S],
) -> Result<Equilibrium<S>, EquilibriumError> {
    let mut motor_angle = Vec::with_capacity(plant.axes.len());
    let mut motor_torque = Vec::with_capacity(plant.axes.len());
    for (number, axis) in plant.axes.iter().enumerate() {
        let joint_angle = q[axis.joint];
        let load = gravity[axis.joint] - axis.joint_torque(joint_angle);
        let angle = axis.motor_angle_at_rest(joint_angle, load);
        if (0..S::LANES).any(|lane| !angle.lane(lane).is_finite()) {
            return Err(EquilibriumError::NoDeflection { axis: number + 1 });
        }
        motor_angle.push(angle);
        let mut command = axis.motor_torque_at_rest(angle, load);
        for kernel in axis.kernels.iter().rev() {
            command = kernel.drive_inverse(command);
        }
        motor_torque.push(command);
    }
    Ok(Equilibrium {
        joint_angle: q,
        motor_angle,
        motor_torque,
    })
}
