//! The equations of motion of a chain of masses over any scalar, thesis (9.4)-(9.9).
//!
//! The states are the deflections of the springs and the speeds of the masses, so that a
//! turning axis has no state that drifts; the motor angle is carried where something needs it.
//! Friction, backlash, springs and ripple are the formulas of the core's effects.

use super::layout::AxisModel;
use axisight_core::effects::formulas::{
    dead_zone, harmonic, smoothed_sign, spring_torque, stribeck_level,
};
use axisight_scalar::Scalar;
use std::array::from_fn;

/// State of a chain of `N` masses, or its rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct State<S, const N: usize> {
    /// Motor angle, then the deflections of the springs.
    pub place: [S; N],
    /// Speeds, the motor first.
    pub speed: [S; N],
}

impl<S: Scalar, const N: usize> State<S, N> {
    /// From motor angle, deflections and speeds, one after the other.
    #[inline(always)]
    pub fn new(entry: impl Fn(usize) -> S) -> Self {
        Self {
            place: from_fn(&entry),
            speed: from_fn(|i| entry(N + i)),
        }
    }

    /// `self + h * rate`; the motor angle of a chain that is not extended stays.
    #[inline(always)]
    pub fn moved<const EXTENDED: bool>(&self, rate: &Self, h: f64) -> Self {
        let mut out = *self;
        for i in 0..N {
            if EXTENDED || i > 0 {
                out.place[i] = rate.place[i].axpy(h, self.place[i]);
            }
            out.speed[i] = rate.speed[i].axpy(h, self.speed[i]);
        }
        out
    }

    /// Entry by its place as in [`State::new`].
    #[inline(always)]
    pub fn entry(&self, i: usize) -> S {
        if i < N {
            self.place[i]
        } else {
            self.speed[i - N]
        }
    }

    /// `self + h * rate` where `h` carries derivatives.
    #[inline(always)]
    pub fn shifted(&self, rate: &Self, h: S) -> Self {
        Self {
            place: from_fn(|i| rate.place[i].fma(h, self.place[i])),
            speed: from_fn(|i| rate.speed[i].fma(h, self.speed[i])),
        }
    }

    /// The values without derivatives.
    #[inline(always)]
    pub fn values(&self) -> State<f64, N> {
        State {
            place: from_fn(|i| self.place[i].lane(0)),
            speed: from_fn(|i| self.speed[i].lane(0)),
        }
    }
}

/// Which friction acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Regime {
    /// The motor turns in the direction of the sign.
    Slip(f64),
    /// The motor stands.
    Stick,
    /// The sign is smoothed; the direction takes care of itself.
    Smooth,
}

/// Parameters of a chain in the form the equations use. Springs count from 1: spring `i`
/// pulls mass `i`.
#[derive(Debug, Clone)]
pub(super) struct Chain<S, const N: usize> {
    inverse_inertia: [S; N],
    /// Motor acceleration by torque of the gear spring.
    gear_mobility: S,
    linear: [S; N],
    cubic: [S; N],
    damping: [S; N],
    viscous: S,
    coulomb: S,
    ratio: S,
    plain_ratio: f64,
    backlash: S,
    excess: S,
    /// Whether there is an excess, or could be one.
    humped: bool,
    inverse_stribeck_speed: S,
    asymmetry: S,
    offset: S,
    ripple: Vec<(f64, S, S)>,
    /// One over the smoothing; `None` for the sign itself.
    pub inverse_smoothing: Option<f64>,
}

impl<S: Scalar, const N: usize> Chain<S, N> {
    /// Chain with the parameters that `value` gives by their place.
    #[inline(always)]
    pub fn new(model: &AxisModel, value: impl Fn(usize) -> S) -> Self {
        let layout = model.layout();
        let spring = |place: &dyn Fn(usize) -> usize| {
            from_fn(|i| {
                if i == 0 {
                    S::zero()
                } else {
                    value(place(i - 1))
                }
            })
        };
        let (ratio, excess) = (value(layout.ratio()), value(layout.excess()));
        let harmonic = |(i, order): (usize, &f64)| {
            (*order, value(layout.ripple(i)), value(layout.ripple(i) + 1))
        };
        let inverse_inertia: [S; N] = from_fn(|i| value(layout.inertia(i)).recip());
        Self {
            inverse_inertia,
            gear_mobility: -(inverse_inertia[0] * ratio),
            linear: spring(&|i| layout.linear(i)),
            cubic: spring(&|i| layout.cubic(i)),
            damping: spring(&|i| layout.damping(i)),
            viscous: value(layout.viscous()),
            coulomb: value(layout.coulomb()),
            ratio,
            plain_ratio: ratio.lane(0),
            backlash: value(layout.backlash()),
            excess,
            humped: excess.lane(0) != 0.0 || (0..S::PARTIALS).any(|i| excess.partial(i, 0) != 0.0),
            inverse_stribeck_speed: value(layout.stribeck_speed()).recip(),
            asymmetry: value(layout.asymmetry()),
            offset: value(layout.offset()),
            ripple: model
                .ripple_orders
                .iter()
                .enumerate()
                .map(harmonic)
                .collect(),
            inverse_smoothing: (model.smoothing > 0.0).then(|| 1.0 / model.smoothing),
        }
    }

    /// `x` times the gear ratio, whose derivative only an extended chain carries, minus `y`.
    #[inline(always)]
    fn geared_less<const EXTENDED: bool>(&self, x: S, y: S) -> S {
        if EXTENDED {
            x.fma(self.ratio, -y)
        } else {
            x.axpy(self.plain_ratio, -y)
        }
    }

    /// Rates of the deflections and torques of the springs.
    #[inline(always)]
    fn springs<const EXTENDED: bool>(&self, x: &State<S, N>) -> ([S; N], [S; N]) {
        // Loops, because the closures of `from_fn` are not always inlined.
        let (mut rates, mut torques) = ([S::zero(); N], [S::zero(); N]);
        for i in 1..N {
            rates[i] = if i == 1 {
                self.geared_less::<EXTENDED>(x.speed[0], x.speed[1])
            } else {
                x.speed[i - 1] - x.speed[i]
            };
            let (deflection, rate) = if EXTENDED && i == 1 {
                let (loaded, slope) = dead_zone(x.place[1], self.backlash);
                (loaded, slope * rates[1])
            } else {
                (x.place[i], rates[i])
            };
            let spring = spring_torque(self.linear[i], self.cubic[i], deflection);
            // The rate comes last: every operation after it delays the next stage.
            torques[i] = rate.fma(self.damping[i], spring);
        }
        (rates, torques)
    }

    /// Torque on the motor but for gear and friction.
    #[inline(always)]
    fn drive<const EXTENDED: bool>(&self, x: &State<S, N>, torque: f64) -> S {
        let mut drive = S::constant(torque);
        if EXTENDED {
            drive += self.offset;
            for (order, cosine, sine) in &self.ripple {
                drive += harmonic(x.place[0] * *order, *cosine, *sine);
            }
        }
        drive
    }

    /// Friction torque.
    #[inline(always)]
    fn friction<const EXTENDED: bool>(&self, speed: S, regime: Regime) -> S {
        let level = if EXTENDED && self.humped {
            stribeck_level(
                self.coulomb,
                self.excess,
                self.inverse_stribeck_speed,
                speed,
            )
        } else {
            self.coulomb
        };
        let dry = match (regime, self.inverse_smoothing) {
            (Regime::Smooth, Some(inverse)) => level * smoothed_sign(speed, inverse),
            (Regime::Slip(sign), _) => level * sign,
            _ => S::zero(),
        };
        let friction = self.viscous.fma(speed, dry);
        if EXTENDED {
            self.asymmetry.fma(speed.abs(), friction)
        } else {
            friction
        }
    }

    /// Rate of change of the state under a motor torque.
    #[inline(always)]
    pub fn rate<const EXTENDED: bool>(
        &self,
        x: &State<S, N>,
        torque: f64,
        regime: Regime,
    ) -> State<S, N> {
        let (mut place, springs) = self.springs::<EXTENDED>(x);
        if EXTENDED {
            place[0] = x.speed[0];
        }
        let mut speed = [S::zero(); N];
        let friction = self.friction::<EXTENDED>(x.speed[0], regime);
        let own = (self.drive::<EXTENDED>(x, torque) - friction) * self.inverse_inertia[0];
        speed[0] = springs[1].fma(self.gear_mobility, own);
        for i in 1..N {
            let net = if i + 1 < N {
                springs[i] - springs[i + 1]
            } else {
                springs[i]
            };
            speed[i] = net * self.inverse_inertia[i];
        }
        let mut rate = State { place, speed };
        if regime == Regime::Stick {
            rate.speed[0] = S::zero();
        }
        rate
    }

    /// Torque on a standing motor but for the friction.
    pub fn standing_drive(&self, x: &State<S, N>, torque: f64) -> S {
        let (_, springs) = self.springs::<true>(x);
        self.drive::<true>(x, torque) - springs[1] * self.ratio
    }

    /// Torque that the friction of a standing motor withstands.
    pub fn breakaway(&self) -> S {
        self.coulomb + self.excess
    }
}
