//! One driven axis: motor, transmission, and the effects on them.

use super::own::Own;
use crate::effect::{Joint, Kernel, Motor, Spring};
use crate::robot::{Parameter, RobotDescription};
use axisight_scalar::Scalar;
use std::sync::Arc;

/// A compliant transmission.
#[derive(Debug, Clone, Copy)]
pub struct Gear<S> {
    /// Stiffness k [Nm/rad].
    pub stiffness: S,
    /// Damping d [Nm s/rad].
    pub damping: S,
    /// Index of the motor angle among the motor states.
    pub(super) slot: usize,
}

/// Coupling to another axis whose motor also turns this gear.
#[derive(Debug, Clone, Copy)]
pub struct Lead<S> {
    /// Index of the other axis.
    pub axis: usize,
    /// Turn of this gear, joint side, per turn of the other motor.
    pub by: S,
    /// Name of the effect that couples the axes.
    pub effect: &'static str,
}

/// One driven axis.
#[derive(Clone)]
pub struct Axis<S> {
    /// Index of the joint the axis drives.
    pub joint: usize,
    /// Gear ratio r, joint angle per motor angle.
    pub ratio: f64,
    /// Motor inertia [kg m^2].
    pub motor_inertia: S,
    /// Viscous friction of the motor [Nm s/rad].
    pub viscous_friction: S,
    pub(super) inverse_motor_inertia: S,
    /// Compliant transmission; `None` is rigid.
    pub gear: Option<Gear<S>>,
    /// All effects on this axis.
    pub kernels: Vec<Arc<dyn Kernel<S>>>,
    pub(super) on_motor: Vec<Own<S>>,
    /// Effects on the motor that need its acceleration without them.
    pub(super) ahead: Vec<Arc<dyn Kernel<S>>>,
    pub(super) on_gear: Vec<Own<S>>,
    pub(super) on_joint: Vec<Own<S>>,
    /// Axes whose motors also turn this gear.
    pub led_by: Vec<Lead<S>>,
}

impl<S: Scalar> Axis<S> {
    /// Torque of the effects without states on the driven joint [Nm]. Use it at rest, or if the
    /// motion is measured and nothing is integrated.
    pub fn joint_torque_of(&self, angle: S, speed: S) -> S {
        let state = Joint {
            angle,
            speed,
            ratio: self.ratio,
            internal: &[],
        };
        let torques = self
            .on_joint
            .iter()
            .map(|on| on.kernel.joint_torque(&state));
        torques.fold(S::zero(), |a, b| a + b)
    }

    /// Torque of the effects on the driven joint [Nm]; `own` and `own_rates` hold the states of all
    /// effects.
    pub(super) fn joint_torque(&self, angle: S, speed: S, own: &[S], own_rates: &mut [S]) -> S {
        let mut torque = S::zero();
        for Own { kernel, internal } in &self.on_joint {
            let state = Joint {
                angle,
                speed,
                ratio: self.ratio,
                internal: &own[internal.clone()],
            };
            torque += kernel.joint_torque(&state);
            if let Some(rates) = own_rates.get_mut(internal.clone()) {
                kernel.joint_rates(&state, rates);
            }
        }
        torque
    }

    /// Torque of the effects on the motor [Nm]; `at` gives its state with the load torque.
    #[inline(never)]
    pub(super) fn motor_torque(&self, at: &Motor<S>, own: &[S], own_rates: &mut [S]) -> S {
        let mut torque = S::zero();
        for Own { kernel, internal } in &self.on_motor {
            let state = Motor {
                internal: &own[internal.clone()],
                ..*at
            };
            torque += kernel.motor_torque(&state);
            if let Some(rates) = own_rates.get_mut(internal.clone()) {
                kernel.motor_rates(&state, rates);
            }
        }
        torque
    }

    /// Torque on the motor [Nm] of the effects that need its acceleration; `at` gives it.
    pub(super) fn torque_ahead(&self, at: &Motor<S>) -> S {
        let torques = self.ahead.iter().map(|kernel| kernel.motor_torque(at));
        torques.fold(S::zero(), |a, b| a + b)
    }

    /// Torque of the gear [Nm, joint side] at the deflection `delta` [rad] and its rate `rate`
    /// [rad/s].
    #[inline]
    pub(super) fn gear_torque(
        &self,
        gear: &Gear<S>,
        delta: S,
        rate: S,
        own: &[S],
        own_rates: &mut [S],
    ) -> S {
        // A separate function for gears with effects, because calls of effects would force this
        // path out of registers.
        if self.on_gear.is_empty() {
            return gear.stiffness.fma(delta, gear.damping * rate);
        }
        self.torque_of_gear_with_effects(gear, delta, rate, own, own_rates)
    }

    #[inline(never)]
    fn torque_of_gear_with_effects(
        &self,
        gear: &Gear<S>,
        delta: S,
        rate: S,
        own: &[S],
        own_rates: &mut [S],
    ) -> S {
        let (mut loaded, mut slope, mut damped) = (delta, S::one(), S::one());
        for on_gear in &self.on_gear {
            let next = on_gear.kernel.deflection(loaded);
            loaded = next.loaded;
            slope = slope * next.slope;
            damped = damped * next.damped;
        }
        let mut torque = gear.stiffness.fma(loaded, gear.damping * damped * rate);
        for Own { kernel, internal } in &self.on_gear {
            let state = Spring {
                loaded,
                rate: slope * rate,
                stiffness: gear.stiffness,
                internal: &own[internal.clone()],
            };
            torque += kernel.gear_torque(&state);
            if let Some(rates) = own_rates.get_mut(internal.clone()) {
                kernel.gear_rates(&state, rates);
            }
        }
        torque
    }

    /// Motor angle at rest for a joint angle and a static load [Nm, joint side].
    ///
    /// Fixed-point iteration over the transmission error, whose slope is a small
    /// share of the gear ratio.
    pub(super) fn motor_angle_at_rest(&self, joint_angle: S, load: S) -> S {
        let wanted = joint_angle + self.static_deflection(load);
        let mut angle = wanted * (1.0 / self.ratio);
        for _ in 0..60 {
            let errors = self
                .on_gear
                .iter()
                .filter_map(|on| on.kernel.transmission_error(angle));
            let Some(error) = errors.map(|e| e.ahead).reduce(|a, b| a + b) else {
                break;
            };
            angle = (wanted - error) * (1.0 / self.ratio);
        }
        angle
    }

    /// Motor torque that holds a static load [Nm, joint side] at a motor angle.
    pub(super) fn motor_torque_at_rest(&self, angle: S, load: S) -> S {
        let slopes = self
            .on_gear
            .iter()
            .filter_map(|on| on.kernel.transmission_error(angle));
        load * slopes.fold(S::constant(self.ratio), |r, e| r + e.returned)
    }

    /// Geometric gear deflection under a static load [Nm, joint side]; zero for a rigid gear.
    ///
    /// The fixed-point iteration on the secant stiffness goes half of the way each time. For a
    /// hardening spring this at least halves the error, however stiff the spring becomes.
    fn static_deflection(&self, load: S) -> S {
        let Some(gear) = &self.gear else {
            return S::zero();
        };
        let mut loaded = load / gear.stiffness;
        for _ in 0..60 {
            let mut extra = S::zero();
            for on_gear in &self.on_gear {
                let state = Spring {
                    loaded,
                    rate: S::zero(),
                    stiffness: gear.stiffness,
                    internal: &[],
                };
                extra += on_gear.kernel.gear_torque(&state);
            }
            let secant = loaded.abs().if_positive(extra / loaded, S::zero());
            loaded = (loaded + load / (gear.stiffness + secant)) * 0.5;
        }
        self.on_gear
            .iter()
            .rev()
            .fold(loaded, |d, on| on.kernel.deflection_inverse(d))
    }
}

/// The driven axes of `robot`, without effects.
pub(super) fn axes<S: Scalar>(
    robot: &RobotDescription,
    value_of: &impl Fn(Parameter) -> S,
) -> Vec<Axis<S>> {
    let mut slot = 0;
    robot
        .driven()
        .map(|(joint, description, drive)| {
            let gear = description.compliance.map(|_| {
                slot += 1;
                Gear {
                    stiffness: value_of(Parameter::Stiffness(joint)),
                    damping: value_of(Parameter::Damping(joint)),
                    slot: slot - 1,
                }
            });
            Axis {
                joint,
                ratio: drive.gear_ratio,
                motor_inertia: value_of(Parameter::MotorInertia(joint)),
                inverse_motor_inertia: value_of(Parameter::MotorInertia(joint)).recip(),
                viscous_friction: value_of(Parameter::ViscousFriction(joint)),
                gear,
                kernels: Vec::new(),
                on_motor: Vec::new(),
                ahead: Vec::new(),
                on_gear: Vec::new(),
                on_joint: Vec::new(),
                led_by: Vec::new(),
            }
        })
        .collect()
}
