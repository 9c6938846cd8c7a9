//! Columns besides those of the links: rotors, friction, springs.

use super::RegressorError;
use axisight_scalar::Scalar;

/// The signal of an extra column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Signal {
    /// Position, for a spring.
    Position,
    /// Velocity, for viscous friction.
    Velocity,
    /// Acceleration, for a rotor.
    Acceleration,
    /// Direction of motion, for Coulomb friction. It is zero within `dead_band` of standstill, and
    /// `tanh(v / smoothing)` if the smoothing is not zero.
    Direction {
        /// Speed below which the direction counts as unknown.
        dead_band: f64,
        /// Speed over which the direction changes; zero for a step.
        smoothing: f64,
    },
    /// One, for an offset.
    Constant,
}

impl Signal {
    #[inline(always)]
    pub(super) fn value<S: Scalar>(self, position: S, velocity: S, acceleration: S) -> S {
        match self {
            Self::Position => position,
            Self::Velocity => velocity,
            Self::Acceleration => acceleration,
            Self::Constant => S::one(),
            Self::Direction {
                dead_band,
                smoothing,
            } => {
                let direction = if smoothing > 0.0 {
                    (velocity * (1.0 / smoothing)).tanh()
                } else {
                    velocity.if_positive(S::one(), S::constant(-1.0))
                };
                (velocity.abs() - dead_band).if_positive(direction, S::zero())
            }
        }
    }
}

/// An extra column: a signal of a combination of joints, with a fixed factor in each row.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    /// The signal.
    pub signal: Signal,
    /// Coefficient of each joint in the motion of the signal.
    pub motion: Vec<f64>,
    /// Factor of the signal in each row.
    pub rows: Vec<f64>,
}

impl Extra {
    pub(super) fn check(&self, n_joints: usize, n_rows: usize) -> Result<(), RegressorError> {
        for (name, x, n) in [
            ("extras.motion", &self.motion, n_joints),
            ("extras.rows", &self.rows, n_rows),
        ] {
            if x.len() != n || !x.iter().all(|v| v.is_finite()) {
                let expected = format!("{n} finite numbers");
                return Err(RegressorError::new(name, expected, &format!("{x:?}")));
            }
        }
        if let Signal::Direction {
            dead_band,
            smoothing,
        } = self.signal
        {
            for (name, x) in [("dead_band", dead_band), ("smoothing", smoothing)] {
                if !(x.is_finite() && x >= 0.0) {
                    return Err(RegressorError::new(name, "a number not below zero", &x));
                }
            }
        }
        Ok(())
    }
}
