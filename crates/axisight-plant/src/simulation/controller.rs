//! The sampled controllers of `axisight.robot/1`.

use crate::robot::Controller;
use axisight_scalar::Scalar;

/// A controller with its memory; commands are motor torques [Nm].
pub struct ControlLoop<S> {
    kind: Controller,
    sample_time: f64,
    feed_forward: Vec<S>,
    reference_angle: Vec<S>,
    previous: Option<Vec<S>>,
    integral: Vec<S>,
    first_lag: Option<Vec<S>>,
}

impl<S: Scalar> ControlLoop<S> {
    /// A controller settled at motor angles `angle` with static torques `feed_forward`.
    pub fn new(kind: &Controller, sample_time: f64, angle: &[S], feed_forward: &[S]) -> Self {
        Self {
            kind: kind.clone(),
            sample_time,
            feed_forward: feed_forward.to_vec(),
            reference_angle: angle.to_vec(),
            previous: None,
            integral: vec![S::zero(); angle.len()],
            first_lag: None,
        }
    }

    /// Commands for measured motor angles `measured` and velocity references `reference`.
    pub fn command(&mut self, measured: &[S], reference: &[S], out: &mut [S]) {
        let rate = 1.0 / self.sample_time;
        for i in 0..measured.len() {
            let speed = match &self.previous {
                Some(previous) => (measured[i] - previous[i]) * rate,
                None => S::zero(),
            };
            let speed_error = reference[i] - speed;
            let angle_error = self.reference_angle[i] - measured[i];
            out[i] = self.feed_forward[i] + self.feedback(i, speed_error, angle_error);
            self.reference_angle[i] += reference[i] * self.sample_time;
        }
        match &mut self.previous {
            Some(previous) => previous.copy_from_slice(measured),
            None => self.previous = Some(measured.to_vec()),
        }
    }

    /// Add to `command` the feedback that keeps `measured` on the logged positions
    /// `logged`, both counted from their first sample.
    pub fn follow(&mut self, measured: &[S], logged: &[S], command: &mut [S]) {
        let rate = 1.0 / self.sample_time;
        // The lag behind the log takes the place of the measured angle of an ordinary loop.
        let lag: Vec<S> = measured.iter().zip(logged).map(|(m, l)| *m - *l).collect();
        let first = self.first_lag.get_or_insert_with(|| lag.clone()).clone();
        for i in 0..lag.len() {
            let behind = lag[i] - first[i];
            let speed = self
                .previous
                .as_ref()
                .map_or_else(S::zero, |p| (lag[i] - p[i]) * rate);
            command[i] += self.feedback(i, -speed, -behind);
        }
        self.previous = Some(lag);
    }

    #[inline(always)]
    fn feedback(&mut self, i: usize, speed_error: S, angle_error: S) -> S {
        match &self.kind {
            Controller::PiVelocity { kp, ki } => speed_error * kp[i] + angle_error * ki[i],
            Controller::PVelocity { kp } => speed_error * kp[i],
            Controller::Cascade { kv, kp, ki } => {
                let error = speed_error + angle_error * kv[i];
                let integral = self.integral[i];
                self.integral[i] += error * self.sample_time;
                error * kp[i] + integral * ki[i]
            }
            Controller::None => S::zero(),
        }
    }
}
