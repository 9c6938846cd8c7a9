//! Backlash: a dead zone between motor and joint.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Kernel, Linear, ParameterInfo, Role, Scope};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "backlash",
    summary: "play in the gear: no torque until the gap is crossed",
    equation: "tau_g = k D + d D',  D = delta - clip(delta, -b, b), its corners rounded over b/20",
    source: "Nordin, Gutman (2002), Automatica 38(10), dead-zone model",
    scope: Scope::Axis,
    acts: Acts::Transmission,
    family: Family::Transmission,
    contains: &[],
    parts: &[],
    stands_for: None,
    linear: Linear::No,
    inverse_dynamics: false,
    stiff: false,
    absorbed_by: &[Absorber::Backlash],
    shown_by: &[Experiment::Amplitudes],
    parameters: &[ParameterInfo {
        name: "half_width_rad",
        unit: "rad (joint side)",
        role: Role::Amplitude,
        neutral: 0.0,
        lower: 0.0,
        upper: 0.05,
        typical: 3e-4,
    }],
};

struct Backlash<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Backlash(p[0]))
}

/// The edge of the gap is rounded over this share of the half-width on either side:
/// the damping would otherwise jump at contact, which no integrator follows with a
/// bounded error.
const EDGE: f64 = 0.05;

impl<S: Scalar> Kernel<S> for Backlash<S> {
    fn deflection(&self, delta: S) -> (S, S) {
        let (zero, one) = (S::zero(), S::one());
        let edge = self.0 * EDGE;
        let over = delta.abs() - self.0;
        let into = over + edge;
        let rounded = (edge - over).if_positive(into * into / (edge * 4.0), over);
        let slope = (edge - over).if_positive(into / (edge * 2.0), one);
        // Strictly inside the gap; a gap of no width has no inside.
        let size = (-into).if_positive(zero, rounded);
        let slope = (-into).if_positive(zero, slope);
        (delta.if_positive(size, -size), slope)
    }

    fn deflection_inverse(&self, loaded: S) -> S {
        let zero = S::zero();
        let edge = self.0 * EDGE;
        let size = loaded.abs();
        let on_edge = (size * edge).sqrt() * 2.0 - edge;
        let over = (edge - size).if_positive(on_edge, size) + self.0;
        // An unloaded gear rests in the middle of its gap.
        loaded.if_positive(over, (-loaded).if_positive(-over, zero))
    }
}
