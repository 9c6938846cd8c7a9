//! The sampled controllers of robot files.

use super::known_robot::KnownRobot;
use super::late_target::LateTarget;
use crate::effect::Kernel;
use crate::plant::{Axis, Plant, PlantError};
use crate::robot::{Controller, Known};
use axisight_scalar::Scalar;
use std::sync::Arc;

/// What effects change of the controller of one axis.
#[derive(Debug, Clone, Copy)]
pub struct OwnLaw<S> {
    /// Factors of the proportional and the integral gain; of a PD controller of the position and the
    /// velocity gain. The third is that of the position gain of a cascade.
    gains: [S; 3],
    /// Torque for the rate of the reference, and for the reference; `None` without.
    forward: Option<[S; 2]>,
    /// Share of a new speed in the filtered one; `None` without a filter.
    filter: Option<S>,
    /// By how many samples commands take effect late; `None` at once.
    late: Option<S>,
}

impl<S: Scalar> OwnLaw<S> {
    /// What the effects on each axis of a plant make of a controller.
    pub fn of(plant: &Plant<S>, sample_time: f64) -> Vec<Self> {
        let of = |axis: &Axis<S>| Self::of_axis(&axis.kernels, sample_time);
        plant.axes.iter().map(of).collect()
    }

    /// The same of one axis.
    pub fn of_axis(kernels: &[Arc<dyn Kernel<S>>], sample_time: f64) -> Self {
        let mut own = Self {
            gains: [S::one(); 3],
            forward: None,
            filter: None,
            late: None,
        };
        for kernel in kernels {
            if let Some([kp, ki, kv]) = kernel.controller_gains() {
                let [own_kp, own_ki, own_kv] = own.gains;
                own.gains = [own_kp * kp, own_ki * ki, own_kv * kv];
            }
            if let Some(delay) = kernel.delay() {
                let delay = delay * (1.0 / sample_time);
                own.late = Some(own.late.map_or(delay, |other| other + delay));
            }
            own.forward = kernel.feedforward().or(own.forward);
            if let Some(lag) = kernel.speed_filter() {
                // Backward difference: without a lag the speed is what it was.
                own.filter = Some((lag + sample_time).recip() * sample_time);
            }
        }
        own
    }
}

/// A controller with its memory; commands are motor torques [Nm].
pub struct ControlLoop<S: Scalar> {
    kind: Controller,
    sample_time: f64,
    feed_forward: Vec<S>,
    reference_angle: Vec<S>,
    previous: Option<Vec<S>>,
    previous_reference: Vec<S>,
    integral: Vec<S>,
    own: Vec<OwnLaw<S>>,
    filtered: Vec<S>,
    first_lag: Vec<S>,
    last_lag: Vec<S>,
    known: Option<KnownRobot<S>>,
    last_speed: Vec<S>,
    last_target_speed: Vec<S>,
    /// Of axes whose targets take effect late.
    late: Vec<Option<LateTarget<S>>>,
}

/// What is late where a controller has targets of positions: its loop is closed at the motor, and what is
/// commanded from afar are the targets. Empty for others, whose torques are late.
fn late_targets<S: Scalar>(
    kind: &Controller,
    own: &[OwnLaw<S>],
    angle: &[S],
) -> Vec<Option<LateTarget<S>>> {
    if !kind.has_targets() {
        return Vec::new();
    }
    let of = |(own, angle): (&OwnLaw<S>, &S)| Some(LateTarget::new(own.late?, *angle));
    own.iter().zip(angle).map(of).collect()
}

impl<S: Scalar> ControlLoop<S> {
    /// A controller settled at motor angles `angle` with static torques `feed_forward`; `own` says
    /// by axis what effects change of it, none where it is empty.
    ///
    /// # Errors
    /// [`PlantError`] of a robot that the controller knows and that cannot be built.
    pub fn new(
        kind: &Controller,
        sample_time: f64,
        angle: &[S],
        feed_forward: &[S],
        own: Vec<OwnLaw<S>>,
    ) -> Result<Self, PlantError> {
        let mut known = KnownRobot::of(kind, angle.len())?;
        let mut feed_forward = feed_forward.to_vec();
        if let Some(known) = &mut known {
            // Where it settled it holds the arm, whatever it knows.
            let still = vec![S::zero(); angle.len()];
            let held = known.torque(angle, &still, &still);
            let held = feed_forward.iter_mut().zip(held);
            held.for_each(|(u, g)| *u -= *g);
        }
        Ok(Self {
            known,
            last_speed: vec![S::zero(); angle.len()],
            last_target_speed: Vec::with_capacity(angle.len()),
            late: late_targets(kind, &own, angle),
            own,
            filtered: vec![S::zero(); angle.len()],
            kind: kind.clone(),
            sample_time,
            feed_forward,
            reference_angle: angle.to_vec(),
            previous: None,
            previous_reference: Vec::with_capacity(angle.len()),
            integral: vec![S::zero(); angle.len()],
            first_lag: Vec::with_capacity(angle.len()),
            last_lag: Vec::with_capacity(angle.len()),
        })
    }

    /// Commands for measured motor angles `measured` and velocity references `reference`.
    pub fn command(&mut self, measured: &[S], reference: &[S], out: &mut [S]) {
        let rate = 1.0 / self.sample_time;
        if self.previous_reference.is_empty() {
            self.previous_reference.extend_from_slice(reference);
        }
        for i in 0..measured.len() {
            let speed = match &self.previous {
                Some(previous) => (measured[i] - previous[i]) * rate,
                None => S::zero(),
            };
            let (angle, speed) = self.halfway(i, measured[i], speed);
            let speed = self.filter(i, speed);
            self.filtered[i] = speed;
            let target = [self.reference_angle[i], reference[i]];
            let [target_angle, target_speed] = match self.late.get_mut(i) {
                Some(Some(late)) => late.read(target),
                _ => target,
            };
            let speed_error = self.speed_error(target_speed, speed);
            let angle_error = target_angle - angle;
            let gains = self.own.get(i).map_or([S::one(); 3], |own| own.gains);
            let wanted = self.rate_of_target(i, target_speed);
            out[i] = wanted + self.feedback(i, speed_error, angle_error, gains);
            self.reference_angle[i] += reference[i] * self.sample_time;
        }
        if let Some(known) = &mut self.known {
            known.command(measured, &self.filtered, out);
        }
        for (i, reference) in reference.iter().enumerate() {
            out[i] += self.feed_forward[i] + self.forward(i, *reference);
        }
        match &mut self.previous {
            Some(previous) => previous.copy_from_slice(measured),
            None => self.previous = Some(measured.to_vec()),
        }
    }

    /// Set `added` to the feedback that keeps `measured` on the logged positions
    /// `logged`, both counted from their first sample. Effects change nothing of it: it is none of
    /// the machine.
    pub fn follow(&mut self, measured: &[S], logged: &[S], added: &mut [S]) {
        let rate = 1.0 / self.sample_time;
        let first_sample = self.first_lag.is_empty();
        for i in 0..measured.len() {
            // The lag behind the log takes the place of the measured angle of an ordinary loop.
            let lag = measured[i] - logged[i];
            if first_sample {
                self.first_lag.push(lag);
                self.last_lag.push(lag);
            }
            let behind = lag - self.first_lag[i];
            let speed = (lag - self.last_lag[i]) * rate;
            self.last_lag[i] = lag;
            added[i] = self.feedback(i, -speed, -behind, [S::one(); 3]);
        }
        if let Some(known) = &mut self.known {
            known.weigh(measured, added);
        }
    }

    /// Acceleration of the target of axis `i` where a law takes it; none at the first sample.
    #[inline(always)]
    fn rate_of_target(&mut self, i: usize, speed: S) -> S {
        let Controller::PdPosition {
            known: Some(Known::Dynamics(_)),
            feeds_speed: true,
            ..
        } = self.kind
        else {
            return S::zero();
        };
        if self.last_target_speed.len() == i {
            self.last_target_speed.push(speed);
        }
        let change = speed - self.last_target_speed[i];
        self.last_target_speed[i] = speed;
        change * (1.0 / self.sample_time)
    }

    /// Torque for the reference of axis `i` and its rate; none at the first sample.
    #[inline(always)]
    fn forward(&mut self, i: usize, reference: S) -> S {
        let Some([for_rate, for_itself]) = self.own.get(i).and_then(|own| own.forward) else {
            return S::zero();
        };
        let before = self.previous_reference[i];
        self.previous_reference[i] = reference;
        for_rate * ((reference - before) * (1.0 / self.sample_time)) + for_itself * reference
    }

    /// Angle and speed of axis `i` that a command is for: those measured, or, of a law that holds between
    /// samples, those halfway to the next one. A speed measured is that of half a sample ago.
    #[inline(always)]
    fn halfway(&mut self, i: usize, angle: S, speed: S) -> (S, S) {
        let Controller::PdPosition {
            continuous: true, ..
        } = self.kind
        else {
            return (angle, speed);
        };
        let change = speed - self.last_speed[i];
        self.last_speed[i] = speed;
        let ahead = (speed + change * 0.5) * (0.5 * self.sample_time);
        (angle + ahead, speed + change)
    }

    /// By how much a speed is off its reference, which is zero where a controller has targets only.
    #[inline(always)]
    fn speed_error(&self, reference: S, speed: S) -> S {
        match self.kind {
            Controller::PdPosition {
                feeds_speed: false, ..
            }
            | Controller::Cascade {
                told_positions: Some(false),
                ..
            } => -speed,
            _ => reference - speed,
        }
    }

    /// Speed of axis `i` as the controller takes it, which may lag behind the measured one.
    #[inline(always)]
    fn filter(&mut self, i: usize, speed: S) -> S {
        let Some(share) = self.own.get(i).and_then(|own| own.filter) else {
            return speed;
        };
        let before = self.filtered[i];
        self.filtered[i] = before + share * (speed - before);
        self.filtered[i]
    }

    /// Torque for errors of speed and angle, all gains times `gains` as in [`OwnLaw`].
    #[inline(always)]
    fn feedback(&mut self, i: usize, speed_error: S, angle_error: S, gains: [S; 3]) -> S {
        let [own_kp, own_ki, own_kv] = gains;
        match &self.kind {
            Controller::PiVelocity { kp, ki } => {
                own_kp * (speed_error * kp[i]) + own_ki * (angle_error * ki[i])
            }
            Controller::PVelocity { kp } => own_kp * (speed_error * kp[i]),
            Controller::Cascade { kv, kp, ki, .. } => {
                let error = speed_error + own_kv * (angle_error * kv[i]);
                let integral = self.integral[i];
                self.integral[i] += error * self.sample_time;
                own_kp * (error * kp[i]) + own_ki * (integral * ki[i])
            }
            Controller::PdPosition { kp, kd, .. } => {
                own_kp * (angle_error * kp[i]) + own_ki * (speed_error * kd[i])
            }
            Controller::None => S::zero(),
        }
    }
}
