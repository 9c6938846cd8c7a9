//! The continuous-time plant: motors, gears, elastic arm and the effects on them.
//!
//! With motor angles `phi` (compliant gears only), joint angles `q`, deflection
//! `delta = r phi - q` and gear torque `tau_g`:
//! `J_m phi'' = tau - F_v phi' - r tau_g`, `M(q) q'' + c + g = B tau_g - K_e q_e - D_e q_e'`.
//! A rigid gear has `phi = q / r` and no state of its own.

use super::axis::{Axis, OnMotor, axes, gear_torque};
use super::chain::Chain;
use super::description::RobotDescription;
use super::dynamics::{Dynamics, DynamicsScratch, MOST_JOINTS, sized};
use super::linear_algebra::{factorize, solve_factorized};
use super::parameters::Parameter;
use crate::effects::{self, EffectError, EffectInfo, Kernel, Motor, PlantParameters, Scope};
use axisight_scalar::Scalar;
use std::sync::Arc;

/// An effect with its place and parameters.
#[derive(Debug, Clone)]
pub struct EffectSetting<S> {
    /// Name in the effect table.
    pub name: String,
    /// 0-based driven axis; `None` for effects of the whole arm.
    pub axis: Option<usize>,
    /// Parameters in the order of the table.
    pub parameters: Vec<S>,
}

impl EffectSetting<f64> {
    /// The same setting over another scalar.
    pub fn lifted<S: Scalar>(&self) -> EffectSetting<S> {
        EffectSetting {
            name: self.name.clone(),
            axis: self.axis,
            parameters: self.parameters.iter().map(|p| S::constant(*p)).collect(),
        }
    }
}

/// Why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// Effects or fitted parameters leave a link without mass.
    #[error("mass of the link of joint {joint}: expected more than 0 kg, got {got}")]
    Mass {
        /// Joint, from 1.
        joint: usize,
        /// Mass [kg].
        got: f64,
    },
    /// The chain is longer than the compiled sizes.
    #[error("joints: expected at most {MOST_JOINTS}, got {0}")]
    TooManyJoints(usize),
    /// An effect is misused.
    #[error(transparent)]
    Effect(#[from] EffectError),
}

/// A robot with its effects, ready to be integrated.
#[derive(Clone)]
pub struct Plant<S> {
    /// Rigid-body chain.
    pub chain: Chain<S>,
    /// Equations of motion of the chain.
    pub dynamics: Dynamics<S>,
    /// Driven axes in chain order.
    pub axes: Vec<Axis<S>>,
    /// Elastic joints: index, stiffness, damping.
    pub elastic: Vec<(usize, S, S)>,
    n_motors: usize,
    n_internal: usize,
}

impl<S: Scalar> Plant<S> {
    /// The plant of `robot` with some parameters replaced and some effects added.
    ///
    /// # Errors
    /// [`PlantError`] when an effect is unknown, misplaced or has the wrong parameters.
    pub fn new(
        robot: &RobotDescription,
        overrides: &[(Parameter, S)],
        settings: &[EffectSetting<S>],
    ) -> Result<Self, PlantError> {
        if robot.joints.len() > MOST_JOINTS {
            return Err(PlantError::TooManyJoints(robot.joints.len()));
        }
        let mut chain = Chain::new(robot);
        for (parameter, value) in overrides {
            parameter.apply_to_chain(*value, &mut chain);
        }
        let value_of = |p: Parameter| {
            let found = overrides.iter().rev().find(|(q, _)| *q == p);
            found.map_or_else(|| S::constant(p.nominal(robot)), |(_, v)| *v)
        };
        let mut plant = Self {
            dynamics: Dynamics::new(&chain),
            chain,
            axes: axes(robot, &value_of),
            elastic: elastic_joints(robot, &value_of),
            n_motors: robot
                .driven()
                .filter(|(_, j, _)| j.compliance.is_some())
                .count(),
            n_internal: 0,
        };
        for setting in settings {
            plant.add_effect(setting)?;
        }
        plant.check_masses()?;
        // Effects may have changed masses and inertias.
        plant.dynamics = Dynamics::new(&plant.chain);
        for axis in &mut plant.axes {
            axis.inverse_motor_inertia = axis.motor_inertia.recip();
        }
        Ok(plant)
    }

    /// Effects may take mass away, but not all of it.
    fn check_masses(&self) -> Result<(), PlantError> {
        for (i, joint) in self.chain.joints.iter().enumerate() {
            let Some(body) = &joint.body else { continue };
            let lightest = (0..S::LANES)
                .map(|lane| body.mass.lane(lane))
                .fold(f64::INFINITY, f64::min);
            if lightest <= 0.0 {
                return Err(PlantError::Mass {
                    joint: i + 1,
                    got: lightest,
                });
            }
        }
        Ok(())
    }

    fn add_effect(&mut self, setting: &EffectSetting<S>) -> Result<(), PlantError> {
        let info = effects::info(&setting.name)?;
        check_bounds(info, &setting.parameters)?;
        let kernel: Arc<dyn Kernel<S>> = effects::build(&setting.name, &setting.parameters)?.into();
        let n_axes = self.axes.len();
        let first = self.n_states();
        let internal = first..first + kernel.n_internal();
        let misplaced = |expected: String, got: String| EffectError::Axis {
            effect: info.name,
            expected,
            got,
        };
        match (info.scope, setting.axis) {
            (Scope::Arm, None) => kernel.prepare(&mut PlantParameters {
                chain: &mut self.chain,
                stiffness: None,
                damping: None,
                motor_inertia: None,
            }),
            (Scope::Arm, Some(i)) => {
                let got = format!("axis {}", i + 1);
                return Err(misplaced("no axis (it acts on the whole arm)".into(), got).into());
            }
            (Scope::Axis, axis) => {
                let got = axis.map_or_else(|| "no axis".to_owned(), |i| format!("axis {}", i + 1));
                let Some(axis) = axis.and_then(|i| self.axes.get_mut(i)) else {
                    return Err(misplaced(format!("an axis from 1 to {n_axes}"), got).into());
                };
                let on_gear = matches!(info.acts, effects::Acts::Transmission);
                if on_gear && axis.gear.is_none() {
                    let expected = "an axis with a compliant transmission".to_owned();
                    return Err(misplaced(expected, format!("{got} (rigid)")).into());
                }
                let (stiffness, damping) = match &mut axis.gear {
                    Some(gear) => (Some(&mut gear.stiffness), Some(&mut gear.damping)),
                    None => (None, None),
                };
                kernel.prepare(&mut PlantParameters {
                    chain: &mut self.chain,
                    stiffness,
                    damping,
                    motor_inertia: Some(&mut axis.motor_inertia),
                });
                axis.kernels.push(Arc::clone(&kernel));
                match info.acts {
                    effects::Acts::Motor => {
                        self.n_internal += internal.len();
                        axis.on_motor.push(OnMotor { kernel, internal });
                    }
                    effects::Acts::Transmission => axis.on_gear.push(kernel),
                    effects::Acts::Joint => axis.on_joint.push(kernel),
                    _ => {}
                }
            }
        }
        Ok(())
    }

    /// Number of states: `[phi, q, phi', q']`, then those of the effects.
    pub fn n_states(&self) -> usize {
        2 * self.n_angles() + self.n_internal
    }

    /// Number of angles, motors' and joints', at the front of the state; as many rates follow.
    pub fn n_angles(&self) -> usize {
        self.n_motors + self.chain.len()
    }

    /// Number of motor angles among the states (compliant gears).
    pub fn n_motors(&self) -> usize {
        self.n_motors
    }

    /// Motor angle of an axis in state `x` [rad].
    pub fn motor_angle(&self, axis: &Axis<S>, x: &[S]) -> S {
        match &axis.gear {
            Some(gear) => x[gear.slot],
            None => x[self.n_motors + axis.joint] * (1.0 / axis.ratio),
        }
    }

    /// Motor speed of an axis in state `x` [rad/s].
    pub fn motor_speed(&self, axis: &Axis<S>, x: &[S]) -> S {
        let rates = &x[self.n_motors + self.chain.len()..];
        match &axis.gear {
            Some(gear) => rates[gear.slot],
            None => rates[self.n_motors + axis.joint] * (1.0 / axis.ratio),
        }
    }

    /// Index of an axis's motor angle among the states; `None` for a rigid transmission.
    pub fn motor_slot(&self, axis: usize) -> Option<usize> {
        self.axes.get(axis)?.gear.as_ref().map(|gear| gear.slot)
    }

    /// Per axis, the state that carries its motor angle, and the motor angle per unit of it.
    pub fn motor_slots(&self) -> Vec<(usize, f64)> {
        let slot = |axis: &Axis<S>| match &axis.gear {
            Some(gear) => (gear.slot, 1.0),
            None => (self.n_motors + axis.joint, 1.0 / axis.ratio),
        };
        self.axes.iter().map(slot).collect()
    }

    /// Joint angles in state `x`.
    pub fn joint_angles<'x>(&self, x: &'x [S]) -> &'x [S] {
        &x[self.n_motors..self.n_motors + self.chain.len()]
    }

    /// State at rest with the given motor and joint angles.
    pub fn state_at_rest(&self, motor_angle: &[S], joint_angle: &[S]) -> Vec<S> {
        let mut x = vec![S::zero(); self.n_states()];
        for (axis, angle) in self.axes.iter().zip(motor_angle) {
            if let Some(gear) = &axis.gear {
                x[gear.slot] = *angle;
            }
        }
        x[self.n_motors..self.n_motors + self.chain.len()].copy_from_slice(joint_angle);
        x
    }

    /// `dx = f(x, tau)`: `applied` is the torque the drives deliver, `command`
    /// the commanded torque of the sample (torque ripple scales with it) [Nm].
    #[inline]
    pub fn derivative(
        &self,
        x: &[S],
        applied: &[S],
        command: &[S],
        scratch: &mut DynamicsScratch<S>,
        dx: &mut [S],
    ) {
        sized!(
            self.dynamics.len(),
            self.derivative_sized(x, applied, command, scratch, dx, true)
        );
    }

    /// [`Plant::derivative`] where only rates, torques and the effects' own states have
    /// changed since the last evaluation with this `scratch`; about half the work.
    #[inline]
    pub fn derivative_in_place(
        &self,
        x: &[S],
        applied: &[S],
        command: &[S],
        scratch: &mut DynamicsScratch<S>,
        dx: &mut [S],
    ) {
        sized!(
            self.dynamics.len(),
            self.derivative_sized(x, applied, command, scratch, dx, false)
        );
    }

    /// Whether the torques of the drives enter the motors' accelerations only, and as they are:
    /// then [`Plant::change_torque`] replaces an evaluation.
    pub fn torque_acts_on_motors_alone(&self) -> bool {
        self.axes.iter().all(|axis| {
            let plain = |on: &OnMotor<S>| !on.kernel.uses_command();
            axis.gear.is_some() && axis.on_motor.iter().all(plain)
        })
    }

    /// Turn a derivative under torques `from` into that under `to` in the same state, where
    /// [`Plant::torque_acts_on_motors_alone`].
    #[inline]
    pub fn change_torque(&self, from: &[S], to: &[S], dx: &mut [S]) {
        let first = self.n_motors + self.chain.len();
        for (axis, (from, to)) in self.axes.iter().zip(from.iter().zip(to)) {
            if let Some(gear) = &axis.gear {
                dx[first + gear.slot] += (*to - *from) * axis.inverse_motor_inertia;
            }
        }
    }

    /// Scratch for [`Plant::derivative`].
    pub fn scratch(&self) -> DynamicsScratch<S> {
        self.dynamics.scratch()
    }

    fn derivative_sized<const N: usize>(
        &self,
        x: &[S],
        applied: &[S],
        command: &[S],
        scratch: &mut DynamicsScratch<S>,
        dx: &mut [S],
        moved: bool,
    ) {
        let (m, n) = (self.n_motors, self.chain.len());
        let (angles, rates) = x.split_at(m + n);
        let rates = &rates[..m + n];
        let (q, v) = (&angles[m..], &rates[m..]);
        if moved {
            self.dynamics.place::<N>(q, scratch);
            self.factorize_inertia::<N>(scratch);
        }
        self.dynamics.add_rates::<N>(v, scratch);
        let Some(terms) = scratch.sized::<N>() else {
            return;
        };
        // The force becomes the acceleration below.
        let force = terms.bias;
        for f in force.iter_mut() {
            *f = -*f;
        }
        dx[..m + n].copy_from_slice(rates);
        for (axis, (applied, command)) in self.axes.iter().zip(applied.iter().zip(command)) {
            let torque = self.axis_torque(axis, x, *applied, *command, dx);
            let joint = axis.joint;
            for kernel in &axis.on_joint {
                force[joint] += kernel.joint_torque(q[joint]);
            }
            if let Some(gear) = &axis.gear {
                force[joint] += torque.gear;
                dx[m + n + gear.slot] = (torque.motor - torque.load) * axis.inverse_motor_inertia;
            } else {
                force[joint] += torque.motor * (1.0 / axis.ratio);
            }
        }
        for (joint, stiffness, damping) in &self.elastic {
            force[*joint] -= stiffness.fma(q[*joint], *damping * v[*joint]);
        }
        solve_factorized(terms.inertia, force);
        dx[m + n + m..2 * (m + n)].copy_from_slice(&force[..n]);
    }

    /// Motors behind rigid gears turn with their joints.
    #[inline(always)]
    fn factorize_inertia<const N: usize>(&self, scratch: &mut DynamicsScratch<S>) {
        if let Some(terms) = scratch.sized::<N>() {
            for axis in self.axes.iter().filter(|axis| axis.gear.is_none()) {
                let up = 1.0 / axis.ratio;
                terms.inertia[axis.joint][axis.joint] += axis.motor_inertia * (up * up);
            }
            factorize(terms.inertia);
        }
    }

    /// Torque that effects add on a motor in state `x` [Nm].
    pub fn motor_disturbance(&self, axis: &Axis<S>, x: &[S], command: S) -> S {
        let free = self.axis_torque(axis, x, S::zero(), command, &mut []).motor;
        free + axis.viscous_friction * self.motor_speed(axis, x)
    }

    /// Torques of an axis; rates of the effects' own states go where `dx` has room for them.
    #[inline]
    fn axis_torque(
        &self,
        axis: &Axis<S>,
        x: &[S],
        applied: S,
        command: S,
        dx: &mut [S],
    ) -> AxisTorque<S> {
        let (m, n) = (self.n_motors, self.chain.len());
        let (angle, speed, gear, load) = if let Some(gear) = &axis.gear {
            let (angle, speed) = (x[gear.slot], x[m + n + gear.slot]);
            let (mut delta, mut slope) = (angle * axis.ratio, S::constant(axis.ratio));
            for kernel in &axis.on_gear {
                if let Some((error, rate)) = kernel.transmission_error(angle) {
                    delta += error;
                    slope += rate;
                }
            }
            delta -= x[m + axis.joint];
            let rate = speed * slope - x[m + n + m + axis.joint];
            let torque = gear_torque(gear, &axis.on_gear, delta, rate);
            (angle, speed, torque, torque * slope)
        } else {
            let up = 1.0 / axis.ratio;
            let (q, v) = (x[m + axis.joint], x[m + n + m + axis.joint]);
            (q * up, v * up, S::zero(), S::zero())
        };
        let mut motor = applied - axis.viscous_friction * speed;
        for OnMotor { kernel, internal } in &axis.on_motor {
            let state = Motor {
                angle,
                speed,
                command,
                load,
                internal: &x[internal.clone()],
            };
            motor += kernel.motor_torque(&state);
            if let Some(rate) = dx.get_mut(internal.clone()) {
                kernel.internal_rate(&state, rate);
            }
        }
        AxisTorque { motor, gear, load }
    }
}

struct AxisTorque<S> {
    /// Torque on the motor, without the gear.
    motor: S,
    /// Gear torque on the joint side.
    gear: S,
    /// What the motor feels of it.
    load: S,
}

fn elastic_joints<S: Scalar>(
    robot: &RobotDescription,
    value_of: &impl Fn(Parameter) -> S,
) -> Vec<(usize, S, S)> {
    let is_elastic = |i: &usize| robot.joints[*i].drive.is_none();
    (0..robot.joints.len())
        .filter(is_elastic)
        .map(|i| {
            (
                i,
                value_of(Parameter::Stiffness(i)),
                value_of(Parameter::Damping(i)),
            )
        })
        .collect()
}

fn check_bounds<S: Scalar>(info: &'static EffectInfo, values: &[S]) -> Result<(), EffectError> {
    for (parameter, value) in info.parameters.iter().zip(values) {
        for lane in 0..S::LANES {
            let got = value.lane(lane);
            if !(parameter.lower..=parameter.upper).contains(&got) {
                return Err(EffectError::Bounds {
                    effect: info.name,
                    parameter: parameter.name,
                    lower: parameter.lower,
                    upper: parameter.upper,
                    got,
                });
            }
        }
    }
    Ok(())
}
