//! The continuous-time plant: motors, gears, elastic arm and the effects on them.
//!
//! With motor angles `phi` (compliant gears only), joint angles `q`, deflection
//! `delta = r phi - q` and gear torque `tau_g`:
//! `J_m phi'' = tau - F_v phi' - r tau_g`, `M(q) q'' + c + g = B tau_g - K_e q_e - D_e q_e'`.
//! A rigid gear has `phi = q / r` and no state of its own.

use super::axis::Axis;
use super::own::{OnPair, Own};
use crate::effect::{Arm, AxisTorque, CoupledAxis, Motor, Pair};
use crate::robot::{Accelerometer, Chain, Dynamics, DynamicsScratch, JointMotion, n_readings};
use axisight_scalar::Scalar;
use std::ops::Range;

/// A robot with its effects, ready to be integrated.
#[derive(Clone)]
pub struct Plant<S> {
    /// Rigid-body chain, with the joints that effects put below the first one.
    pub chain: Chain<S>,
    /// Equations of motion of the chain.
    pub dynamics: Dynamics<S>,
    /// Driven axes in chain order.
    pub axes: Vec<Axis<S>>,
    /// Elastic joints, each with index, stiffness and damping.
    pub elastic: Vec<(usize, S, S)>,
    pub(super) on_pairs: Vec<OnPair<S>>,
    pub(super) on_arm: Vec<Own<S>>,
    /// Accelerometers, with the joints of `chain`.
    pub(super) accelerometers: Vec<Accelerometer>,
    pub(super) n_motors: usize,
    pub(super) n_base: usize,
    pub(super) n_internal: usize,
}

impl<S: Scalar> Plant<S> {
    /// Number of states: `[phi, q, phi', q']`, then the states of the effects.
    pub fn n_states(&self) -> usize {
        2 * self.n_angles() + self.n_internal
    }

    /// Number of angles of motors and joints at the start of the state. As many rates follow.
    pub fn n_angles(&self) -> usize {
        self.n_motors + self.chain.len()
    }

    /// Whether the arm may be linearised along a run. It must stand on the ground, and every motor
    /// must be behind a compliant gear, so that no command makes a joint jump.
    pub fn follows_courses(&self) -> bool {
        self.n_base == 0 && self.axes.iter().all(|axis| axis.gear.is_some())
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

    /// Angle of the joint that an axis drives in state `x` [rad].
    pub fn joint_angle(&self, axis: &Axis<S>, x: &[S]) -> S {
        x[self.n_motors + axis.joint]
    }

    /// Torques of the effects between axes, each with its two axes; `state` gives the state of an
    /// axis.
    pub fn between_axes(
        &self,
        state: impl Fn(usize) -> CoupledAxis<S>,
    ) -> impl Iterator<Item = ([usize; 2], [AxisTorque<S>; 2])> {
        self.on_pairs.iter().map(move |pair| {
            let axes = pair.axes.map(&state);
            let internal = &[];
            let at = Pair { axes, internal };
            (pair.axes, pair.own.kernel.pair_torque(&at))
        })
    }

    /// Whether the links, or the couplings that move the arm, carry derivatives.
    pub fn arm_carries_derivatives(&self) -> bool {
        let seeded = |by: &S| (0..S::PARTIALS).any(|seed| by.partial(seed, 0) != 0.0);
        let mut turned = self.axes.iter().flat_map(|axis| &axis.led_by);
        self.chain.carries_derivatives() || turned.any(|lead| seeded(&lead.by))
    }

    /// Relative error of the controller's clock, positive if fast compared with the references;
    /// `None` if both use one clock.
    pub fn clock_drift(&self) -> Option<S> {
        let drifts = self.on_arm.iter().filter_map(|on| on.kernel.clock_drift());
        drifts.reduce(|a, b| a + b)
    }

    /// Index of an axis's motor angle among the states; `None` for a rigid transmission.
    pub fn motor_slot(&self, axis: usize) -> Option<usize> {
        self.axes.get(axis)?.gear.as_ref().map(|gear| gear.slot)
    }

    /// For each axis, the state that gives its motor angle, and the motor angle per unit of that
    /// state.
    pub fn motor_slots(&self) -> Vec<(usize, f64)> {
        let slot = |axis: &Axis<S>| match &axis.gear {
            Some(gear) => (gear.slot, 1.0),
            None => (self.n_motors + axis.joint, 1.0 / axis.ratio),
        };
        self.axes.iter().map(slot).collect()
    }

    /// The states that are angles of the robot's joints.
    pub fn joint_slots(&self) -> Range<usize> {
        self.n_motors + self.n_base..self.n_motors + self.chain.len()
    }

    /// Angles of the robot's joints in state `x`.
    pub fn joint_angles<'x>(&self, x: &'x [S]) -> &'x [S] {
        &x[self.joint_slots()]
    }

    /// Number of readings of the accelerometers: one for each direction.
    pub fn n_readings(&self) -> usize {
        n_readings(&self.accelerometers)
    }

    /// What the accelerometers measure in state `x` with the rates `dx` [m/s^2], written to `out`.
    pub fn specific_force(&self, x: &[S], dx: &[S], out: &mut [S]) {
        let (m, n) = (self.n_motors, self.chain.len());
        let rates = m + n + m;
        let motion = JointMotion {
            q: &x[m..m + n],
            v: &x[rates..rates + n],
            a: &dx[rates..rates + n],
        };
        self.dynamics
            .specific_force(motion, &self.accelerometers, out);
    }

    /// Compute `dx = f(x, tau)`.
    ///
    /// `applied` is the torque that the drives deliver [Nm]. `command` is the commanded torque of
    /// the sample [Nm], with which torque ripple scales.
    #[inline]
    pub fn derivative(
        &self,
        x: &[S],
        applied: &[S],
        command: &[S],
        scratch: &mut DynamicsScratch<S>,
        dx: &mut [S],
    ) {
        let (m, n) = (self.n_motors, self.chain.len());
        self.dynamics.place(&x[m..m + n], scratch);
        self.factorize_inertia(scratch);
        self.derivative_in_place(x, applied, command, scratch, dx);
    }

    /// [`Plant::derivative`] if only rates, torques and the effects' own states have changed since
    /// the last evaluation with this `scratch`. It takes about half the work.
    #[inline]
    pub fn derivative_in_place(
        &self,
        x: &[S],
        applied: &[S],
        command: &[S],
        scratch: &mut DynamicsScratch<S>,
        dx: &mut [S],
    ) {
        let (m, n) = (self.n_motors, self.chain.len());
        let (state, own) = x.split_at(2 * (m + n));
        let (angles, rates) = state.split_at(m + n);
        let (q, v) = (&angles[m..], &rates[m..]);
        self.dynamics.add_rates(v, scratch);
        // `solve` turns this force into the acceleration in place.
        let force = scratch.forces();
        for f in force.iter_mut() {
            *f = -*f;
        }
        let (place, own_rates) = dx.split_at_mut(2 * (m + n));
        place[..m + n].copy_from_slice(rates);
        for (axis, (applied, command)) in self.axes.iter().zip(applied.iter().zip(command)) {
            let torque = self.driven(axis, x, *applied, *command, own_rates);
            let joint = axis.joint;
            force[joint] += axis.joint_torque(q[joint], v[joint], own, own_rates);
            if let Some(gear) = &axis.gear {
                force[joint] += torque.gear;
                place[m + n + gear.slot] =
                    (torque.motor - torque.load) * axis.inverse_motor_inertia;
            } else {
                force[joint] += torque.motor * (1.0 / axis.ratio);
            }
        }
        let accelerations = &mut place[m + n..];
        self.each_reaction(x, |first, torque| {
            self.hold_back(first, torque, force, accelerations);
        });
        for pair in &self.on_pairs {
            self.couple(pair, x, force, &mut place[m + n..], own_rates);
        }
        for on_arm in &self.on_arm {
            self.load_arm(on_arm, x, &mut force[self.n_base..n], own_rates);
        }
        for (joint, stiffness, damping) in &self.elastic {
            force[*joint] -= stiffness.fma(q[*joint], *damping * v[*joint]);
        }
        if self.axes.iter().any(|axis| !axis.ahead.is_empty()) {
            self.act_ahead(x, command, scratch, &mut place[m + n..]);
        }
        self.dynamics.solve(scratch);
        place[m + n + m..].copy_from_slice(&scratch.forces()[..n]);
    }

    /// Whether the torques of the drives enter only the accelerations of the motors, and unchanged.
    /// Then [`Plant::change_torque`] replaces an evaluation.
    pub fn torque_acts_on_motors_alone(&self) -> bool {
        self.axes.iter().all(|axis| {
            let plain = |on: &Own<S>| !on.kernel.uses_command();
            axis.gear.is_some() && axis.ahead.is_empty() && axis.on_motor.iter().all(plain)
        })
    }

    /// Change a derivative under the torques `from` to that under `to`, in the same state.
    ///
    /// Valid only if [`Plant::torque_acts_on_motors_alone`].
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

    /// Factorize the inertia matrix, including the motors behind rigid gears.
    fn factorize_inertia(&self, scratch: &mut DynamicsScratch<S>) {
        for axis in self.axes.iter().filter(|axis| axis.gear.is_none()) {
            let up = 1.0 / axis.ratio;
            scratch.add_inertia(axis.joint, axis.motor_inertia * (up * up));
        }
        self.dynamics.factorize(scratch);
    }

    /// Torque that effects add on each motor in state `x` [Nm]. Those that need the acceleration act
    /// as at a constant speed.
    pub fn motor_disturbances(&self, x: &[S], command: &[S], out: &mut [S]) {
        for ((axis, command), out) in self.axes.iter().zip(command).zip(out.iter_mut()) {
            let free = self.driven(axis, x, S::zero(), *command, &mut []).motor;
            *out = free + axis.viscous_friction * self.motor_speed(axis, x);
            *out += axis.torque_ahead(&self.motor_state(axis, x, S::zero(), *command));
        }
        self.each_reaction(x, |first, torque| out[first] -= torque);
        for pair in &self.on_pairs {
            let torque = pair.own.kernel.pair_torque(&self.pair_state(pair, x));
            for (axis, torque) in pair.axes.iter().zip(torque) {
                out[*axis] += torque.motor;
            }
        }
    }

    /// Torque through the gear of each axis [Nm, motor side], in state `x` with the rates `dx`. Of a
    /// rigid gear it is what the motor does not need for its own inertia and friction.
    pub fn gear_loads(&self, x: &[S], dx: &[S], applied: &[S], command: &[S], out: &mut [S]) {
        self.motor_disturbances(x, command, out);
        for (i, axis) in self.axes.iter().enumerate() {
            if axis.gear.is_some() {
                out[i] = self.driven(axis, x, applied[i], command[i], &mut []).load;
            } else {
                let own = axis.viscous_friction * self.motor_speed(axis, x);
                // The rates of the rates stand where the rates do in the state.
                out[i] += applied[i] - own - axis.motor_inertia * self.motor_speed(axis, dx);
            }
        }
    }

    /// Torques of an axis. Rates of the effects' own states are written only if `own_rates` has
    /// room for them.
    #[inline(always)]
    fn driven(
        &self,
        axis: &Axis<S>,
        x: &[S],
        applied: S,
        command: S,
        own_rates: &mut [S],
    ) -> Driven<S> {
        let (m, n) = (self.n_motors, self.chain.len());
        let own = &x[2 * (m + n)..];
        let (angle, speed, gear, load) = if let Some(gear) = &axis.gear {
            let (angle, speed) = (x[gear.slot], x[m + n + gear.slot]);
            let (mut delta, mut slope) = (angle * axis.ratio, S::constant(axis.ratio));
            let mut back = slope;
            for on_gear in &axis.on_gear {
                if let Some(error) = on_gear.kernel.transmission_error(angle) {
                    delta += error.ahead;
                    slope += error.slope;
                    back += error.returned;
                }
            }
            delta -= x[m + axis.joint];
            let mut rate = speed * slope - x[m + n + m + axis.joint];
            for lead in &axis.led_by {
                let first = &self.axes[lead.axis];
                delta += self.motor_angle(first, x) * lead.by;
                rate += self.motor_speed(first, x) * lead.by;
            }
            let torque = axis.gear_torque(gear, delta, rate, own, own_rates);
            (angle, speed, torque, torque * back)
        } else {
            let up = 1.0 / axis.ratio;
            let (q, v) = (x[m + axis.joint], x[m + n + m + axis.joint]);
            (q * up, v * up, S::zero(), S::zero())
        };
        let mut motor = applied - axis.viscous_friction * speed;
        if !axis.on_motor.is_empty() {
            let state = Motor {
                angle,
                speed,
                acceleration: S::zero(),
                command,
                load,
                internal: &[],
            };
            motor += axis.motor_torque(&state, own, own_rates);
        }
        Driven { motor, gear, load }
    }

    fn pair_state<'x>(&self, pair: &OnPair<S>, x: &'x [S]) -> Pair<'x, S> {
        let (m, n) = (self.n_motors, self.chain.len());
        let state = |i: usize| {
            let axis = &self.axes[i];
            CoupledAxis {
                motor_angle: self.motor_angle(axis, x),
                motor_speed: self.motor_speed(axis, x),
                joint_angle: x[m + axis.joint],
                joint_speed: x[m + n + m + axis.joint],
            }
        };
        Pair {
            axes: pair.axes.map(state),
            internal: &x[2 * (m + n)..][pair.own.internal.clone()],
        }
    }

    /// Call `take(axis, torque)` with the torque [Nm] against each motor that turns another gear.
    #[inline]
    fn each_reaction(&self, x: &[S], mut take: impl FnMut(usize, S)) {
        for second in self.axes.iter().filter(|axis| !axis.led_by.is_empty()) {
            let none = S::zero();
            let gear = self.driven(second, x, none, none, &mut []).gear;
            for lead in &second.led_by {
                take(lead.axis, gear * lead.by);
            }
        }
    }

    /// Subtract a torque from a motor.
    fn hold_back(&self, axis: usize, torque: S, force: &mut [S], accelerations: &mut [S]) {
        let axis = &self.axes[axis];
        if let Some(gear) = &axis.gear {
            accelerations[gear.slot] -= torque * axis.inverse_motor_inertia;
        } else {
            force[axis.joint] -= torque * (1.0 / axis.ratio);
        }
    }

    /// Add the torques on motors that depend on the acceleration without them. Each axis counts the
    /// torques of the others as they are without these effects.
    #[inline(never)]
    fn act_ahead(
        &self,
        x: &[S],
        command: &[S],
        scratch: &mut DynamicsScratch<S>,
        accelerations: &mut [S],
    ) {
        let mut force = scratch.forces().to_vec();
        let rigid = |axis: &Axis<S>| axis.gear.is_none() && !axis.ahead.is_empty();
        if self.axes.iter().any(rigid) {
            self.dynamics.solve(scratch);
        }
        for (i, (axis, command)) in self.axes.iter().zip(command).enumerate() {
            let free = match &axis.gear {
                Some(gear) => accelerations[gear.slot],
                None => scratch.forces()[axis.joint] * (1.0 / axis.ratio),
            };
            let torque = axis.torque_ahead(&self.motor_state(axis, x, free, *command));
            self.hold_back(i, -torque, &mut force, accelerations);
        }
        scratch.forces().copy_from_slice(&force);
    }

    /// State of a motor with an acceleration, and without the load of its gear.
    fn motor_state(
        &self,
        axis: &Axis<S>,
        x: &[S],
        acceleration: S,
        command: S,
    ) -> Motor<'static, S> {
        Motor {
            angle: self.motor_angle(axis, x),
            speed: self.motor_speed(axis, x),
            acceleration,
            command,
            load: S::zero(),
            internal: &[],
        }
    }

    /// Add the torques of an effect between two axes.
    fn couple(
        &self,
        pair: &OnPair<S>,
        x: &[S],
        force: &mut [S],
        accelerations: &mut [S],
        own_rates: &mut [S],
    ) {
        let state = self.pair_state(pair, x);
        for (i, torque) in pair.axes.iter().zip(pair.own.kernel.pair_torque(&state)) {
            let axis = &self.axes[*i];
            force[axis.joint] += torque.joint;
            self.hold_back(*i, -torque.motor, force, accelerations);
        }
        if let Some(rates) = own_rates.get_mut(pair.own.internal.clone()) {
            pair.own.kernel.pair_rates(&state, rates);
        }
    }

    /// Add the forces of an effect on the arm.
    fn load_arm(&self, on_arm: &Own<S>, x: &[S], force: &mut [S], own_rates: &mut [S]) {
        let (m, n) = (self.n_motors, self.chain.len());
        let slots = self.joint_slots();
        let arm = Arm {
            angles: &x[slots.clone()],
            speeds: &x[slots.start + m + n..slots.end + m + n],
            internal: &x[2 * (m + n)..][on_arm.internal.clone()],
        };
        on_arm.kernel.arm_force(&arm, force);
        if let Some(rates) = own_rates.get_mut(on_arm.internal.clone()) {
            on_arm.kernel.arm_rates(&arm, rates);
        }
    }
}

/// Torques of a driven axis.
struct Driven<S> {
    /// Torque on the motor, without the gear.
    motor: S,
    /// Gear torque, joint side.
    gear: S,
    /// Gear torque on the motor, motor side.
    load: S,
}
