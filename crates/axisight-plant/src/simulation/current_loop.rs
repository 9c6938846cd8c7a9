//! Response of a current loop to a held command, as moments in closed form.
//!
//! The excess `e` of the delivered torque over the command decays by `T e' + e = 0` (first order)
//! or `T^2 e'' + 2 D T e' + e = 0` (second order). Both are integrated over a piece with a constant
//! command. The integrals of `e` and `t e` follow from the equation itself.

use axisight_scalar::Scalar;

/// Avoids a division by a time constant of zero; far below any relevant time.
const SHORTEST_S: f64 = 1e-18;
/// Number of time constants after which the excess has vanished and its phase does not matter.
const OVER: f64 = 700.0;

/// Zeroth and first moment of a torque over a piece, in samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments<S> {
    pub zeroth: S,
    pub first: S,
}

/// Delivered torque, and its rate times the time constant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Delivered<S> {
    pub torque: S,
    pub rise: S,
}

impl<S: Scalar> Delivered<S> {
    /// A loop settled at a torque.
    pub fn settled(torque: S) -> Self {
        Self {
            torque,
            rise: S::zero(),
        }
    }
}

/// Current loop of one axis, with times in samples.
pub(super) struct CurrentLoop<S> {
    time_constant: S,
    /// Damping ratio of a loop of second order.
    damping: Option<S>,
}

impl<S: Scalar> CurrentLoop<S> {
    /// A loop with this time constant [s]. A `damping` ratio, which must be below one, makes it one
    /// of second order.
    pub fn new(time_constant_s: S, damping: Option<S>, sample_time: f64) -> Self {
        Self {
            time_constant: (time_constant_s + SHORTEST_S) * (1.0 / sample_time),
            damping,
        }
    }

    /// Moments of the excess over `command` during `width`, which begins at `start`; advances
    /// `state`.
    pub fn excess(&self, command: S, start: S, width: S, state: &mut Delivered<S>) -> Moments<S> {
        let excess = state.torque - command;
        let (left, own) = match self.damping {
            None => self.first_order(excess, width),
            Some(damping) => self.second_order(damping, excess, state.rise, width),
        };
        *state = Delivered {
            torque: command + left.torque,
            rise: left.rise,
        };
        Moments {
            zeroth: own.zeroth,
            first: start * own.zeroth + own.first,
        }
    }

    fn first_order(&self, excess: S, width: S) -> (Delivered<S>, Moments<S>) {
        let t = self.time_constant;
        let ratio = width / t;
        let decay = (-ratio).exp();
        let own = Moments {
            zeroth: excess * t * (S::one() - decay),
            first: excess * (t * t * (S::one() - decay * (ratio + 1.0))),
        };
        (Delivered::settled(excess * decay), own)
    }

    fn second_order(&self, damping: S, excess: S, rise: S, width: S) -> (Delivered<S>, Moments<S>) {
        let t = self.time_constant;
        let frequency = (S::one() - damping.square()).sqrt();
        let ratio = width / t;
        let turned = (ratio - OVER).if_positive(S::constant(OVER), ratio);
        let (sin, cos) = (frequency * turned).sin_cos();
        let decay = (-(damping * ratio)).exp();
        let wave = sin / frequency;
        let end = Delivered {
            torque: decay * (excess * cos + (damping * excess + rise) * wave),
            rise: decay * (rise * cos - (excess + damping * rise) * wave),
        };
        let twice = damping * t * 2.0;
        let zeroth = t * (rise - end.rise) + twice * (excess - end.torque);
        let first = t * t * (end.torque - excess) - t * width * end.rise
            + twice * (zeroth - width * end.torque);
        (end, Moments { zeroth, first })
    }
}
