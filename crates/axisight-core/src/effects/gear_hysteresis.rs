//! Gear hysteresis: a slipping spring with memory beside the gear's own spring.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Kernel, LawOf, ParameterInfo, Prior, Role, Spring, SpringChange};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "gear_hysteresis",
    summary: "torque and deflection of the gear form a loop: part of its stiffness, or a spring beside it, slips",
    equation: "tau_g = k (1 - b a) delta + a k sum_j D_j z_j / 4,  D_j z_j' = delta' - ((1 - s/2) |delta'| z_j + s/2 delta' |z_j|) (1 - s + s z_j^4),  D_j = D (1 + s (j - 2.5) 0.4)",
    source: "four Bouc-Wen elements: Wen (1976), J. Eng. Mech. Div. 102(2), with A = 1, beta = 1 - s/2, gamma = s/2; with s = 0 all are Dahl's (1968, TOR-0158), with s = 1 about the sliders of Iwan (1966), J. Appl. Mech. 33(4), evenly apart; beside the spring as in Dhaouadi, Ghorbel, Gandhi (2003), IEEE Trans. Ind. Electron. 50(6)",
    acts: Acts::Transmission,
    family: Family::Transmission,
    inverse_dynamics: false,
    absorbed_by: &[Absorber::Stiffness, Absorber::Damping],
    shown_by: &[Experiment::Amplitudes],
    law_of: Some(LawOf::Gear),
    spring: Some(SpringChange { sums: &[&["share"]], without_middle: "backlash" }),
    parameters: &[
        ParameterInfo {
            name: "share",
            unit: "1",
            lower: 0.0,
            upper: 10.0,
            typical: 0.3,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "deflection_rad",
            unit: "rad (joint side)",
            role: Role::Shape,
            neutral: 3e-4,
            lower: 1e-6,
            upper: 1.0,
            typical: 3e-4,
            prior: Prior::LogNormal { spread: 1.2 },
            sizes: "judgement: gears lose their friction over 0.1 to 10 minutes of arc",
            ..ParameterInfo::PLAIN
        },
        // One if the stiffness was measured with small motions, zero if with large ones.
        ParameterInfo {
            name: "included",
            unit: "1",
            role: Role::Shape,
            lower: -0.5,
            upper: 1.5,
            typical: 0.5,
            prior: Prior::Uniform,
            sizes: "judgement: a stiffness was measured with small motions, or with large ones",
            ..ParameterInfo::PLAIN
        },
        // How suddenly each element slips, and how far apart the elements slip. The larger the
        // value, the less small loops creep under a load.
        ParameterInfo {
            name: "sharpness",
            unit: "1",
            role: Role::Shape,
            lower: 0.0,
            upper: 1.0,
            typical: 0.5,
            prior: Prior::Uniform,
            sizes: "judgement: Dahl and springs with sliders are both met",
            ..ParameterInfo::PLAIN
        },
        // Strain that the motion before the run has left.
        ParameterInfo {
            name: "strain_at_rest",
            unit: "1",
            role: Role::Shape,
            lower: -1.0,
            upper: 1.0,
            typical: 0.5,
            prior: Prior::Uniform,
            sizes: "judgement: any motion may have been before a run",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

/// Offsets of the elements' slip deflections from their mean, relative to it. At full sharpness the
/// deflections are evenly spaced from zero.
const APART: [f64; 4] = [-0.6, -0.2, 0.2, 0.6];

/// Factor on the part of a strain beyond its yield, for a return slower than Dahl's.
const SLOWLY: f64 = 0.1;

/// The positive part of `x`.
fn over<S: Scalar>(x: S) -> S {
    x.if_positive(x, S::zero())
}

struct Hysteresis<S> {
    share: S,
    deflection: S,
    included: S,
    sharpness: S,
    strain_at_rest: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Hysteresis {
        share: p[0],
        deflection: p[1],
        included: p[2],
        sharpness: p[3],
        strain_at_rest: p[4],
    })
}

impl<S: Scalar> Hysteresis<S> {
    /// Deflection at which the element with the offset `apart` slips.
    fn slips_at(&self, apart: f64) -> S {
        self.deflection * (self.sharpness * apart + 1.0)
    }
}

impl<S: Scalar> Kernel<S> for Hysteresis<S> {
    fn n_internal(&self) -> usize {
        APART.len()
    }

    fn gear_torque(&self, spring: &Spring<'_, S>) -> S {
        // The states count from the strains at rest, where the gear holds the load whatever the
        // strains are.
        let slipping = spring
            .internal
            .iter()
            .zip(APART)
            .fold(S::zero(), |sum, (z, apart)| sum + *z * self.slips_at(apart));
        let taken = self.included * spring.loaded;
        self.share * spring.stiffness * (slipping * (1.0 / APART.len() as f64) - taken)
    }

    fn gear_rates(&self, spring: &Spring<'_, S>, rates: &mut [S]) {
        for ((change, out), apart) in spring.internal.iter().zip(rates).zip(APART) {
            let z = *change + self.strain_at_rest;
            // A strain is beyond its yield only after a step that is too long for the corner. From
            // there it returns slowly, however long the step is.
            let beyond = over(z - 1.0) - over(-z - 1.0);
            let z = beyond.fma(S::constant(SLOWLY - 1.0), z);
            let short = z.square().square() - 1.0;
            let sudden = short.if_positive(S::zero(), short) * self.sharpness + 1.0;
            let straight = self.sharpness * 0.5;
            let slip = (spring.rate.abs() * z * (-straight + 1.0)
                + spring.rate * z.abs() * straight)
                * sudden;
            *out = (spring.rate - slip) / self.slips_at(apart);
        }
    }
}
