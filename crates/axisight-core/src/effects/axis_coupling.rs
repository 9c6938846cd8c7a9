//! A drive that goes through another axis: wrists, and arms with a parallelogram.

use super::formulas::smoothed_sign;
use super::{Absorber, Acts, AxisTorque, EffectInfo, Experiment, Family, Kernel, Pair, ParameterInfo, Role, SMOOTHING, Scope};
use axisight_scalar::Scalar;

const fn amplitude(
    name: &'static str,
    unit: &'static str,
    [lower, upper]: [f64; 2],
    typical: f64,
) -> ParameterInfo {
    ParameterInfo {
        name,
        unit,
        lower,
        upper,
        typical,
        ..ParameterInfo::PLAIN
    }
}

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "axis_coupling",
    summary: "the drive of the second axis runs through the first axis, which turns it along and shares friction with it",
    equation: "q_2 = r_2 phi_2 + c r_1 phi_1;  tau_f = F_v s + F_c tanh(s / v_0),  s = phi_1' + n phi_2', on both motors: 1 and n times",
    source: "Vandanjon, Janot, Gautier, Khatib (2008), dynamic identification of a Staubli TX-40 (coupled axes 5 and 6)",
    scope: Scope::Axes,
    acts: Acts::Motor,
    family: Family::Arm,
    absorbed_by: &[Absorber::ViscousFriction, Absorber::DryFriction],
    shown_by: &[Experiment::Speeds],
    parameters: &[
        amplitude("share", "1 (joint side)", [-2.0, 2.0], 0.02),
        amplitude("viscous_nm_s_rad", "Nm s/rad", [-1e4, 1e4], 0.01),
        amplitude("coulomb_nm", "Nm", [0.0, 1e4], 0.5),
        ParameterInfo {
            name: "speed_ratio",
            unit: "1",
            role: Role::Shape,
            neutral: 1.0,
            lower: -1e3,
            upper: 1e3,
            typical: 1.0,
            ..ParameterInfo::PLAIN
        },
        SMOOTHING,
    ],
    ..EffectInfo::PLAIN
};

struct Coupling<S> {
    share: S,
    viscous: S,
    coulomb: S,
    speed_ratio: S,
    inverse_width: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Coupling {
        share: p[0],
        viscous: p[1],
        coulomb: p[2],
        speed_ratio: p[3],
        inverse_width: p[4].recip(),
    })
}

impl<S: Scalar> Kernel<S> for Coupling<S> {
    fn turns_next(&self) -> Option<S> {
        Some(self.share)
    }

    fn pair_torque(&self, pair: &Pair<'_, S>) -> [AxisTorque<S>; 2] {
        let [first, second] = pair.axes.map(|axis| axis.motor_speed);
        let speed = first + self.speed_ratio * second;
        let sign = smoothed_sign(speed, self.inverse_width);
        let motor = -self.viscous.fma(speed, self.coulomb * sign);
        let joint = S::zero();
        [
            AxisTorque { motor, joint },
            AxisTorque {
                motor: motor * self.speed_ratio,
                joint,
            },
        ]
    }
}
