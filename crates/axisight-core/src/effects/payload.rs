//! A load on the last link that carries mass.

use super::{
    Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, Mark, ParameterInfo,
    PlantParameters, Role, Scales, Scope,
};
use crate::robot::Body;
use axisight_scalar::Scalar;

const fn coordinate(name: &'static str, neutral: f64) -> ParameterInfo {
    ParameterInfo {
        name,
        unit: "m (frame of the last link)",
        role: Role::Shape,
        neutral,
        lower: -3.0,
        upper: 3.0,
        typical: 0.5,
        marks: &[Mark::Optional],
        ..ParameterInfo::PLAIN
    }
}

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "payload",
    summary: "the tool or load is heavier (or lighter) than modelled",
    equation: "mass m at p on the last link, with the inertia m k^2 about every axis through p",
    source: "Swevers, Verdonck, De Schutter (2007), IEEE Control Systems 27(5), payload as a rigid body",
    scope: Scope::Arm,
    acts: Acts::Arm,
    family: Family::Load,
    linear: Linear::Parameters,
    absorbed_by: &[Absorber::Links],
    shown_by: &[Experiment::Poses],
    formula: Formula::RIGID_BODY,
    scales: Some(Scales::Carriers),
    // Every arm carries loads, so a load is more common than an error in a link.
    usual_odds: 3.0,
    needs_chain: true,
    parameters: &[
        ParameterInfo {
            name: "mass_kg",
            unit: "kg",
            lower: -1e4,
            upper: 1e4,
            typical: 30.0,
            ..ParameterInfo::PLAIN
        },
        coordinate("x_m", 1.0),
        coordinate("y_m", 0.0),
        coordinate("z_m", 0.2),
        // A tool spreads about alike in all directions: one number says how far.
        ParameterInfo {
            name: "gyration_m2",
            unit: "m^2 (squared radius of gyration)",
            role: Role::Shape,
            lower: 0.0,
            upper: 1.0,
            typical: 0.01,
            marks: &[Mark::Optional],
            sizes: "judgement: tools are about 0.1 m large",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Payload<S> {
    mass: S,
    position: [S; 3],
    gyration: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Payload {
        mass: p[0],
        position: [p[1], p[2], p[3]],
        gyration: p[4],
    })
}

impl<S: Scalar> Kernel<S> for Payload<S> {
    fn prepare(&self, plant: &mut PlantParameters<'_, S>) {
        let last = plant
            .chain
            .joints
            .iter_mut()
            .rev()
            .find_map(|j| j.body.as_mut());
        if let Some(body) = last {
            *body = combined(body, self);
        }
    }
}

/// A body with a load attached (parallel-axis theorem).
fn combined<S: Scalar>(body: &Body<S>, load: &Payload<S>) -> Body<S> {
    let total = body.mass + load.mass;
    let share = load.mass / total;
    let arm: [S; 3] = std::array::from_fn(|i| load.position[i] - body.com[i]);
    // Reduced mass of body and payload; zero without a payload.
    let reduced = body.mass * share;
    let [x, y, z] = arm;
    let spread = [
        y * y + z * z,
        x * x + z * z,
        x * x + y * y,
        -(x * y),
        -(x * z),
        -(y * z),
    ];
    let own = load.mass * load.gyration;
    Body {
        mass: total,
        com: std::array::from_fn(|i| body.com[i] + share * arm[i]),
        inertia: std::array::from_fn(|i| {
            let about_itself = if i < 3 { own } else { S::zero() };
            body.inertia[i] + reduced * spread[i] + about_itself
        }),
    }
}
