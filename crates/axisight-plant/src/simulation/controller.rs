//! The sampled controllers of robot files.

use super::known_robot::KnownRobot;
use super::late_target::LateTarget;
use crate::effect::Kernel;
use crate::plant::{Axis, Plant, PlantError};
use crate::robot::{Controller, Known};
use axisight_scalar::Scalar;
use std::sync::Arc;

/// Changes that effects make to the controller of one axis.
#[derive(Debug, Clone, Copy)]
pub struct OwnLaw<S> {
    /// Factors of three gains: proportional, integral, and the position gain of a cascade. For a PD
    /// controller, the first two are those of the position and velocity gains.
    gains: [S; 3],
    /// Feed-forward gains for the rate of the reference and for the reference; `None` without
    /// feed-forward.
    forward: Option<[S; 2]>,
    /// Weight of a new speed in the filtered speed; `None` without a filter.
    filter: Option<S>,
    /// Delay of the commands [samples]; `None` without delay.
    late: Option<S>,
}

impl<S: Scalar> OwnLaw<S> {
    /// The changes that the effects of a plant make to its controller, by axis.
    pub fn of(plant: &Plant<S>, sample_time: f64) -> Vec<Self> {
        let of = |axis: &Axis<S>| Self::of_axis(&axis.kernels, sample_time);
        plant.axes.iter().map(of).collect()
    }

    /// The changes that `kernels` make to the controller of one axis.
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
                // Backward difference: without a lag, the filter returns the speed unchanged.
                own.filter = Some((lag + sample_time).recip() * sample_time);
            }
        }
        own
    }
}

/// A controller with its memory. Its commands are motor torques [Nm].
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
    /// Delayed position references by axis; `None` for axes without delay.
    late: Vec<Option<LateTarget<S>>>,
}

/// The delayed references of each axis.
///
/// A controller of positions closes its loop at the motor, so a delay acts on its references. The
/// list is empty for all other controllers, whose torques are delayed.
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
    /// A controller settled at the motor angles `angle` with the static torques `feed_forward`.
    ///
    /// `own` holds the changes that effects make to it, by axis; it may be empty.
    ///
    /// # Errors
    /// [`PlantError`] if the robot model of the controller cannot be built.
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
            // In the settled pose it holds the arm, whatever its robot model says.
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

    /// Compute the commands for measured motor angles `measured` and velocity references
    /// `reference`.
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

    /// Set `added` to the feedback that keeps `measured` on the logged positions `logged`. Both
    /// count from their first sample.
    ///
    /// This feedback is not part of the machine, so effects do not change it.
    pub fn follow(&mut self, measured: &[S], logged: &[S], added: &mut [S]) {
        let rate = 1.0 / self.sample_time;
        let first_sample = self.first_lag.is_empty();
        for i in 0..measured.len() {
            // The lag behind the log replaces the measured angle of an ordinary loop.
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

    /// Acceleration of the reference of axis `i`, if the law uses it; zero at the first sample.
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

    /// Feed-forward torque for the reference of axis `i` and its rate. The rate is zero at the
    /// first sample.
    #[inline(always)]
    fn forward(&mut self, i: usize, reference: S) -> S {
        let Some([for_rate, for_itself]) = self.own.get(i).and_then(|own| own.forward) else {
            return S::zero();
        };
        let before = self.previous_reference[i];
        self.previous_reference[i] = reference;
        for_rate * ((reference - before) * (1.0 / self.sample_time)) + for_itself * reference
    }

    /// Angle and speed of axis `i` for which a command is computed.
    ///
    /// A sampled law uses the measured values. A law that also acts between samples uses the values
    /// halfway to the next sample, because a measured speed is half a sample old.
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

    /// Error of a speed. The speed reference is zero if the controller uses position references
    /// only.
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

    /// Filtered speed of axis `i`, as the controller uses it.
    #[inline(always)]
    fn filter(&mut self, i: usize, speed: S) -> S {
        let Some(share) = self.own.get(i).and_then(|own| own.filter) else {
            return speed;
        };
        let before = self.filtered[i];
        self.filtered[i] = before + share * (speed - before);
        self.filtered[i]
    }

    /// Torque for errors of speed and angle, with the gain factors `gains` as in [`OwnLaw`].
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
