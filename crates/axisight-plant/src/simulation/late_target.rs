//! Delayed references, linearly interpolated between samples.

use axisight_scalar::Scalar;

/// Delayed references of one axis.
pub struct LateTarget<S> {
    /// Age of the reference relative to the second entry of the history [samples].
    fraction: S,
    /// Pairs of angle [rad] and speed [rad/s], oldest first.
    history: Vec<[S; 2]>,
}

impl<S: Scalar> LateTarget<S> {
    /// References with a delay of `samples`, at rest at `angle` before the run. All lanes share the
    /// whole part of the delay.
    pub fn new(samples: S, angle: S) -> Self {
        // Bounds on the delay keep the count small and not negative.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let whole = samples.lane(0).max(0.0) as usize;
        Self {
            fraction: samples - whole as f64,
            history: vec![[angle, S::zero()]; whole + 2],
        }
    }

    /// The effective reference at the sample in which `newest` is given.
    ///
    /// References are held from sample to sample, so the mean reference over a sample is the linear
    /// interpolation.
    pub fn read(&mut self, newest: [S; 2]) -> [S; 2] {
        self.history.rotate_left(1);
        if let Some(last) = self.history.last_mut() {
            *last = newest;
        }
        let (older, newer) = (self.history[0], self.history[1]);
        std::array::from_fn(|i| newer[i] + self.fraction * (older[i] - newer[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_late_by_the_delay_and_rests_before_the_run() {
        let mut late = LateTarget::new(2.25, -1.0);
        let read: Vec<f64> = (0..8).map(|k| late.read([f64::from(k), 1.0])[0]).collect();
        assert!((read[0] + 1.0).abs() < 1e-15);
        for (k, angle) in read.iter().enumerate().skip(3) {
            assert!((angle - (k as f64 - 2.25)).abs() < 1e-15, "{k}");
        }
    }

    #[test]
    fn without_a_delay_the_target_is_in_force_at_once() {
        let mut late = LateTarget::new(0.0, 0.0);
        let [angle, speed] = late.read([3.0, 2.0]);
        assert!((angle - 3.0).abs() < 1e-15 && (speed - 2.0).abs() < 1e-15);
    }
}
