//! The equations of motion of a chain of masses over any scalar, thesis (9.4)-(9.9).
//!
//! The states are the deflections of the springs and the speeds of the masses, so that a turning
//! axis has no drifting state. The motor angle is added if a term depends on it. Friction,
//! backlash, springs and ripple use the formulas of the effects.

use super::layout::AxisModel;
use axisight_plant::formulas::{dead_zone, harmonic, smoothed_sign, spring_torque, stribeck_level};
use axisight_scalar::Scalar;
use std::array::from_fn;

/// State of a chain of `N` masses, or the rate of a state.
#[derive(Debug, Clone, Copy)]
pub(super) struct State<S, const N: usize> {
    /// Motor angle, then the deflections of the springs.
    pub place: [S; N],
    /// Speeds, the motor first.
    pub speed: [S; N],
}

impl<S: Scalar, const N: usize> State<S, N> {
    /// A state from motor angle, deflections and speeds, in this order.
    #[inline(always)]
    pub fn new(entry: impl Fn(usize) -> S) -> Self {
        Self {
            place: from_fn(&entry),
            speed: from_fn(|i| entry(N + i)),
        }
    }

    /// `self + h * rate`. The motor angle stays if the chain is not extended.
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

    /// Entry at a place, ordered as in [`State::new`].
    #[inline(always)]
    pub fn entry(&self, i: usize) -> S {
        if i < N {
            self.place[i]
        } else {
            self.speed[i - N]
        }
    }

    /// `self + h * rate`, with derivatives of `h`.
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

/// The active friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Regime {
    /// The motor turns in the direction of this sign.
    Slip(f64),
    /// The motor stands.
    Stick,
    /// The sign is smoothed, so that the direction needs no tracking.
    Smooth,
}

/// Parameters of a chain in the form of the equations. Springs count from 1: spring `i` pulls mass
/// `i`.
#[derive(Debug, Clone)]
pub(super) struct Chain<S, const N: usize> {
    inverse_inertia: [S; N],
    /// Motor acceleration per torque of the gear spring.
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
    /// Whether the excess is not zero or has derivatives.
    humped: bool,
    inverse_stribeck_speed: S,
    asymmetry: S,
    offset: S,
    ripple: Vec<(f64, S, S)>,
    /// One over the smoothing; `None` for an exact sign.
    pub inverse_smoothing: Option<f64>,
}

impl<S: Scalar, const N: usize> Chain<S, N> {
    /// A chain whose parameters are `value` of their places.
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

    /// `x` times the gear ratio, minus `y`. Only an extended chain has derivatives of the ratio.
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
        // Loops, because closures of `from_fn` are not always inlined.
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
            // The rate comes last, because every operation after it delays the next stage.
            torques[i] = rate.fma(self.damping[i], spring);
        }
        (rates, torques)
    }

    /// Torque on the motor, without gear and friction.
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

    /// Torque on a standing motor, without friction.
    pub fn standing_drive(&self, x: &State<S, N>, torque: f64) -> S {
        let (_, springs) = self.springs::<true>(x);
        self.drive::<true>(x, torque) - springs[1] * self.ratio
    }

    /// Largest torque that the friction of a standing motor holds.
    pub fn breakaway(&self) -> S {
        self.coulomb + self.excess
    }
}

#[cfg(test)]
mod tests {
    use super::super::layout::{Hold, Output};
    use super::*;
    use axisight_core::effects::{Kernel, Motor, Spring, build};

    const ORDER: f64 = 3.0;
    const SMOOTHING: f64 = 0.3;

    /// A chain of two masses with only the parameters that `set` gives.
    fn chain(set: impl Fn(&mut Vec<f64>)) -> Chain<f64, 2> {
        let model = AxisModel {
            masses: 2,
            output: Output::Velocity,
            hold: Hold::Zero,
            smoothing: SMOOTHING,
            ripple_orders: vec![ORDER],
            substeps: 1,
        };
        let mut theta = vec![0.0; model.layout().len(1)];
        set(&mut theta);
        Chain::new(&model, |i| theta[i])
    }

    fn layout() -> super::super::layout::Layout {
        super::super::layout::Layout {
            masses: 2,
            orders: 1,
        }
    }

    fn kernel(name: &str, parameters: &[f64]) -> Box<dyn Kernel<f64>> {
        build(name, parameters).unwrap_or_else(|error| panic!("{error}"))
    }

    fn motor(angle: f64, speed: f64) -> Motor<'static, f64> {
        Motor {
            angle,
            speed,
            acceleration: 0.0,
            command: 0.0,
            load: 0.0,
            internal: &[],
        }
    }

    fn assert_same(got: f64, want: f64) {
        assert_eq!(got.to_bits(), want.to_bits(), "{got} {want}");
    }

    fn sweep() -> impl Iterator<Item = f64> {
        (-40..=40).map(|i| 0.137 * f64::from(i) + 0.001)
    }

    #[test]
    fn friction_is_that_of_the_effects() {
        let chain = chain(|theta| {
            theta[layout().coulomb()] = 0.64;
            theta[layout().excess()] = 0.27;
            theta[layout().stribeck_speed()] = 1.7;
        });
        let stribeck = kernel("stribeck_friction", &[0.64, 0.27, 1.7, SMOOTHING, 0.0]);
        let coulomb = kernel("coulomb_friction", &[0.64, SMOOTHING, 0.0, 0.0]);
        for speed in sweep() {
            let own = chain.friction::<true>(speed, Regime::Smooth);
            assert_same(own, -stribeck.motor_torque(&motor(0.0, speed)));
            let own = chain.friction::<false>(speed, Regime::Smooth);
            assert_same(own, -coulomb.motor_torque(&motor(0.0, speed)));
        }
    }

    #[test]
    fn the_gear_is_that_of_the_effects() {
        let chain = chain(|theta| {
            theta[layout().cubic(0)] = 5.0;
            theta[layout().backlash()] = 0.8;
        });
        let (gap, spring) = (
            kernel("backlash", &[0.8, 0.0]),
            kernel("nonlinear_stiffness", &[5.0]),
        );
        let at = |loaded| Spring {
            loaded,
            rate: 0.0,
            stiffness: 0.0,
            internal: &[],
        };
        for deflection in sweep() {
            let state = State::new(|i| if i == 1 { deflection } else { 0.0 });
            let (_, torques) = chain.springs::<true>(&state);
            let loaded = gap.deflection(deflection).loaded;
            assert!((torques[1] - spring.gear_torque(&at(loaded))).abs() <= 0.0);
            let (_, torques) = chain.springs::<false>(&state);
            assert!((torques[1] - spring.gear_torque(&at(deflection))).abs() <= 0.0);
        }
    }

    #[test]
    fn ripple_is_that_of_the_effect() {
        let chain = chain(|theta| {
            theta[layout().ripple(0)] = 0.11;
            theta[layout().ripple(0) + 1] = -0.06;
        });
        let mut parameters = [0.0; 18];
        parameters[..3].copy_from_slice(&[ORDER, 0.11, -0.06]);
        let ripple = kernel("torque_ripple", &parameters);
        for angle in sweep() {
            let state = State::new(|i| if i == 0 { angle } else { 0.0 });
            let own = chain.drive::<true>(&state, 0.0);
            assert_same(own, ripple.motor_torque(&motor(angle, 0.0)));
        }
    }
}
