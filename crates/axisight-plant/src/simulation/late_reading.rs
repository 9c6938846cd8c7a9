//! Delayed readings of a motor angle, interpolated by angle and speed at both ends of a sample.

use axisight_scalar::Scalar;

/// Delayed readings of one motor.
pub struct LateReading<S> {
    /// Age of the reading relative to the second entry of the history [samples].
    fraction: S,
    /// Pairs of angle [rad] and speed times sample time [rad], oldest first.
    history: Vec<[S; 2]>,
}

impl<S: Scalar> LateReading<S> {
    /// A reading with a delay of `samples`, of a motor at rest at `rest` before the run. All lanes
    /// share the whole part of the delay.
    pub fn new(samples: S, rest: S) -> Self {
        // Bounds on the delay keep the count small and not negative.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let whole = samples.lane(0).max(0.0) as usize;
        Self {
            fraction: samples - whole as f64,
            history: vec![[rest, S::zero()]; whole + 2],
        }
    }

    /// The reading at a sample in which the motor has `angle`, and the speed times sample time
    /// `turn`.
    ///
    /// Hermite's cubic has an error of at most 1/384 of the fourth difference of the angles.
    pub fn read(&mut self, angle: S, turn: S) -> S {
        self.history.rotate_left(1);
        if let Some(newest) = self.history.last_mut() {
            *newest = [angle, turn];
        }
        let ([older, turn_older], [newer, turn_newer]) = (self.history[0], self.history[1]);
        let f = self.fraction;
        let (left, square) = (-f + 1.0, f * f);
        let share = square * (-f * 2.0 + 3.0);
        newer + share * (older - newer) - f * left * left * turn_newer + square * left * turn_older
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_read_exactly_and_rest_before_the_run() {
        let (delay, time) = (2.3, |k: f64| 1.0 + 0.5 * k - 0.2 * k * k + 0.03 * k.powi(3));
        let slope = |k: f64| 0.5 - 0.4 * k + 0.09 * k * k;
        let mut late = LateReading::new(delay, 7.0);
        assert!((late.read(time(0.0), slope(0.0)) - 7.0).abs() < 1e-15);
        for k in 1..9 {
            let read = late.read(time(f64::from(k)), slope(f64::from(k)));
            if k > 2 {
                assert!((read - time(f64::from(k) - delay)).abs() < 1e-12, "{k}");
            }
        }
    }

    #[test]
    fn no_delay_reads_the_angle_itself() {
        let mut late = LateReading::new(0.0, 7.0);
        assert!((late.read(3.0, 1.0) - 3.0).abs() < f64::EPSILON);
    }
}
