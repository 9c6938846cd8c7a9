//! Integration over one sample by the classical Runge-Kutta method of order 4, which follows the
//! sign of the friction exactly.
//!
//! Without smoothing of the sign, the equations are smooth only between changes of regime: slipping
//! ends where the speed crosses zero, sticking ends where the drive exceeds the friction. The time
//! of a change is located inside the step, and the step is taken in two parts. The derivative of
//! this time with respect to the parameters follows from the implicit function theorem: one Newton
//! step on the guard in dual numbers, from the root found in plain numbers.

use super::chain::{Chain, Regime, State};
use super::numbers::Number;
use axisight_scalar::Scalar;

/// Largest number of regime changes within one step. After that, the rest of the step keeps the
/// last regime.
const MOST_CHANGES: usize = 8;

/// A chain in three kinds of numbers: for ordinary steps, for steps with a change of regime, and
/// without derivatives for locating the change.
///
/// Changes of regime are rare, so they are compiled once for all chains of a length, with the
/// extended equations.
pub(super) struct Motion<S: Number, const N: usize> {
    chain: Chain<S, N>,
    changes: Changes<S::Plain, N>,
}

/// Data for steps with a change of regime.
struct Changes<S, const N: usize> {
    chain: Chain<S, N>,
    plain: Chain<f64, N>,
}

/// Torque at the start of a step, and its slope.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    pub torque: f64,
    pub slope: f64,
}

impl Ramp {
    fn at(self, t: f64) -> f64 {
        self.slope.mul_add(t, self.torque)
    }
    fn later(self, t: f64) -> Self {
        Self {
            torque: self.at(t),
            ..self
        }
    }
}

/// One Runge-Kutta step.
///
/// The step is written out for the most common chain and for plain numbers, where this is 10 % and
/// 25 % faster than the loop. For all others the loop is as fast, and compiles in a third of the
/// time.
#[inline(always)]
fn runge_kutta4<S: Scalar, const N: usize, const EXTENDED: bool>(
    chain: &Chain<S, N>,
    x: &State<S, N>,
    ramp: Ramp,
    h: f64,
    regime: Regime,
) -> State<S, N> {
    let (half, middle) = (0.5 * h, ramp.at(0.5 * h));
    if const { (N == 2 && !EXTENDED) || S::PARTIALS == 0 } {
        let a = chain.rate::<EXTENDED>(x, ramp.torque, regime);
        let b = chain.rate::<EXTENDED>(&x.moved::<EXTENDED>(&a, half), middle, regime);
        let c = chain.rate::<EXTENDED>(&x.moved::<EXTENDED>(&b, half), middle, regime);
        let d = chain.rate::<EXTENDED>(&x.moved::<EXTENDED>(&c, h), ramp.at(h), regime);
        return x
            .moved::<EXTENDED>(&a, h / 6.0)
            .moved::<EXTENDED>(&b, h / 3.0)
            .moved::<EXTENDED>(&c, h / 3.0)
            .moved::<EXTENDED>(&d, h / 6.0);
    }
    // Each stage: step along the last rate, torque, weight in the sum.
    let stages = [
        (0.0, ramp.torque, h / 6.0),
        (half, middle, h / 3.0),
        (half, middle, h / 3.0),
        (h, ramp.at(h), h / 6.0),
    ];
    let (mut next, mut rate) = (*x, State::new(|_| S::zero()));
    for (ahead, torque, weight) in stages {
        let stage = x.moved::<EXTENDED>(&rate, ahead);
        rate = chain.rate::<EXTENDED>(&stage, torque, regime);
        next = next.moved::<EXTENDED>(&rate, weight);
    }
    next
}

/// A function that is positive while `regime` lasts.
#[inline(always)]
fn guard<S: Scalar, const N: usize>(
    chain: &Chain<S, N>,
    x: &State<S, N>,
    torque: f64,
    regime: Regime,
) -> S {
    match regime {
        Regime::Slip(sign) => x.speed[0] * sign,
        Regime::Stick => chain.breakaway() - chain.standing_drive(x, torque).abs(),
        Regime::Smooth => S::one(),
    }
}

impl<S: Number, const N: usize> Motion<S, N> {
    #[inline(always)]
    pub fn new(chain: Chain<S, N>, careful: Chain<S::Plain, N>, plain: Chain<f64, N>) -> Self {
        Self {
            chain,
            changes: Changes {
                chain: careful,
                plain,
            },
        }
    }

    /// The state after the time `h`.
    #[inline(always)]
    pub fn step<const EXTENDED: bool>(&self, x: &State<S, N>, ramp: Ramp, h: f64) -> State<S, N> {
        let speed = x.speed[0].lane(0);
        let regime = if self.chain.inverse_smoothing.is_some() {
            Regime::Smooth
        } else if speed != 0.0 {
            Regime::Slip(speed.signum())
        } else {
            self.changes
                .plain
                .leaving_standstill(&x.values(), ramp.torque)
        };
        let next = runge_kutta4::<S, N, EXTENDED>(&self.chain, x, ramp, h, regime);
        let lasts = match regime {
            Regime::Smooth => true,
            Regime::Slip(sign) => next.speed[0].lane(0) * sign >= 0.0,
            Regime::Stick => self.changes.plain.lasts(&next.values(), ramp.at(h), regime),
        };
        if lasts {
            next
        } else {
            let x = State::new(|i| x.entry(i).plain());
            let next = self.changes.step(&x, ramp, h, regime);
            State::new(|i| S::from_plain(next.entry(i)))
        }
    }
}

impl<S: Scalar, const N: usize> Changes<S, N> {
    /// The state after the time `h`, for a step with a change of regime.
    #[inline(never)]
    fn step(&self, x: &State<S, N>, ramp: Ramp, h: f64, regime: Regime) -> State<S, N> {
        let (mut x, mut ramp, mut left, mut regime) = (*x, ramp, h, regime);
        // The times of changes have derivatives, but the lengths of the parts do not. `late` is the
        // lag of the state behind its nominal time; its value is zero, and only its derivatives are
        // not.
        let mut late = S::zero();
        for _ in 0..MOST_CHANGES {
            let next = self.advance(&x, ramp, left, regime);
            if self.plain.lasts(&next.values(), ramp.at(left), regime) {
                break;
            }
            let (instant, slope) = self.plain.instant(&x.values(), ramp, left, regime);
            x = self.advance(&x, ramp, instant, regime);
            ramp = ramp.later(instant);
            left -= instant;
            if slope != 0.0 {
                let value = guard(&self.chain, &x, ramp.torque, regime);
                let shift = value * (-1.0 / slope);
                x = self.shifted(&x, ramp.torque, regime, shift);
                late += shift;
            }
            if matches!(regime, Regime::Slip(_)) {
                x.speed[0] = S::zero();
                regime = self.plain.leaving_standstill(&x.values(), ramp.torque);
            } else {
                let drive = self.plain.standing_drive(&x.values(), ramp.torque);
                regime = Regime::Slip(drive.signum());
            }
        }
        let next = self.advance(&x, ramp, left, regime);
        self.shifted(&next, ramp.at(left), regime, -late)
    }

    #[inline(never)]
    fn advance(&self, x: &State<S, N>, ramp: Ramp, h: f64, regime: Regime) -> State<S, N> {
        runge_kutta4::<S, N, true>(&self.chain, x, ramp, h, regime)
    }

    /// The state after a short time, which has derivatives.
    #[inline(never)]
    fn shifted(&self, x: &State<S, N>, torque: f64, regime: Regime, time: S) -> State<S, N> {
        x.shifted(&self.chain.rate::<true>(x, torque, regime), time)
    }
}

impl<const N: usize> Chain<f64, N> {
    fn leaving_standstill(&self, x: &State<f64, N>, torque: f64) -> Regime {
        let drive = self.standing_drive(x, torque);
        if drive.abs() <= self.breakaway() {
            Regime::Stick
        } else {
            Regime::Slip(drive.signum())
        }
    }

    fn lasts(&self, x: &State<f64, N>, torque: f64, regime: Regime) -> bool {
        guard(self, x, torque, regime) >= 0.0
    }

    /// The time within `h` at which the guard of `regime` falls through zero, and the slope of the
    /// guard there. The slope is zero if the guard falls at once.
    fn instant(&self, x: &State<f64, N>, ramp: Ramp, h: f64, regime: Regime) -> (f64, f64) {
        let value = |t: f64| {
            let x = self.advanced(x, ramp, t, regime);
            guard(self, &x, ramp.at(t), regime)
        };
        let (mut low, mut high) = (1e-6 * h, h);
        let (mut above, mut below) = (value(low), value(high));
        if above <= 0.0 {
            return (0.0, 0.0);
        }
        // Regula falsi with the Illinois rule: an end that stays twice counts half.
        let (mut t, mut side) = (high, 0);
        for _ in 0..60 {
            t = (low * below - high * above) / (below - above);
            let g = value(t);
            if g.abs() < 1e-15 || high - low < 1e-14 * h {
                break;
            }
            if g > 0.0 {
                (low, above) = (t, g);
                below *= if side > 0 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                (high, below) = (t, g);
                above *= if side < 0 { 0.5 } else { 1.0 };
                side = -1;
            }
        }
        let e = 1e-4 * h;
        (t, (value(t + e) - value(t - e)) / (2.0 * e))
    }

    #[inline(never)]
    fn advanced(&self, x: &State<f64, N>, ramp: Ramp, h: f64, regime: Regime) -> State<f64, N> {
        runge_kutta4::<f64, N, true>(self, x, ramp, h, regime)
    }
}
