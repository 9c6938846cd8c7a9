//! The library of effects: what a machine may have and a simulator may lack.
//!
//! Each effect has its own file, which states everything known about it: its parameters, the value
//! at which it vanishes, where it acts, its equation and source, and its relations to other effects
//! ([`EffectInfo`]). A new effect is a new file and one line in the table below. Equations that
//! other models share are in [`formulas`].

mod harmonics;
mod lead;
mod sides;

pub use axisight_plant::effect::{
    Absorber, Acts, Arm, AxisTorque, BaseJoint, BegunFrom, Change, CoupledAxis, Deflected,
    EffectError, EffectInfo, Experiment, Family, Formula, FormulaKind, GearError, Held, Joint,
    Kernel, Later, LawOf, Linear, Mark, Motor, Pair, ParameterInfo, Plainer, PlantParameters,
    Prior, Resembles, Role, Scales, Scope, Shown, Spring, SpringChange, StandsFor,
};
pub use axisight_plant::formulas;

use axisight_scalar::Scalar;

/// Motor speed below which the sign of a dry friction is rounded.
const SMOOTHING: ParameterInfo = ParameterInfo {
    name: "smoothing_rad_s",
    unit: "rad/s",
    role: Role::Shape,
    neutral: 0.1,
    lower: 1e-5,
    upper: 50.0,
    typical: 0.1,
    marks: &[Mark::Notation],
    prior: Prior::LogNormal { spread: 1.5 },
    sizes: "judgement: how sharply a sign turns, over machines and those who write it, a factor of twenty either way (95 %)",
};

/// Motor speed over which a dry friction falls from its value at standstill.
const STRIBECK_SPEED: ParameterInfo = ParameterInfo {
    name: "stribeck_speed_rad_s",
    unit: "rad/s",
    role: Role::Shape,
    neutral: 3.0,
    lower: 1e-4,
    upper: 500.0,
    typical: 3.0,
    prior: Prior::LogNormal { spread: 2.3 },
    sizes: "Armstrong-Helouvry, Dupont, Canudas de Wit (1994), Automatica 30(7), table 1: 1e-5 to 0.1 m/s at the contact",
    ..ParameterInfo::PLAIN
};

/// A displacement along one axis of the link's frame, as a parameter.
const fn shift(name: &'static str) -> ParameterInfo {
    ParameterInfo {
        name,
        unit: "m (frame of the link)",
        lower: -2.0,
        upper: 2.0,
        typical: 0.05,
        marks: &[Mark::Optional],
        ..ParameterInfo::PLAIN
    }
}

macro_rules! effect_table {
    ($($module:ident),* $(,)?) => {
        $(mod $module;)*

        /// Every effect, in the order of the documentation.
        pub static EFFECTS: &[&EffectInfo] = &[$(&$module::INFO),*];

        /// The kernel of effect `name` at parameters `p` (in the order of its table).
        ///
        /// # Errors
        /// [`EffectError`] if the name is unknown or the parameter count is wrong.
        pub fn build<S: Scalar>(name: &str, p: &[S]) -> Result<Box<dyn Kernel<S>>, EffectError> {
            let info = info(name)?;
            if info.parameters.len() != p.len() {
                return Err(EffectError::ParameterCount {
                    effect: info.name,
                    expected: info.parameters.len(),
                    got: p.len(),
                });
            }
            match name {
                $(stringify!($module) => Ok($module::kernel(p)),)*
                _ => Err(unknown(name)),
            }
        }
    };
}

effect_table!(
    viscous_friction,
    coulomb_friction,
    asymmetric_friction,
    stribeck_friction,
    presliding_friction,
    backlash,
    nonlinear_stiffness,
    joint_stiffness,
    torque_ripple,
    resolver_ripple,
    input_delay,
    actuator_bandwidth,
    torque_constant,
    torque_offset,
    payload,
    motor_inertia,
    joint_damping,
    quadratic_drag,
    load_dependent_friction,
    gravity_compensation,
    cable_stiffness,
    transmission_error,
    torque_saturation,
    gear_hysteresis,
    torque_deadband,
    base_tilt,
    position_dependent_friction,
    extra_mode,
    controller_gain,
    velocity_filter,
    link_mass,
    link_com,
    link_inertia,
    base_compliance,
    friction_warmup,
    piecewise_stiffness,
    joint_zero_offset,
    torque_sensor_gain,
    sensor_delay,
    torque_sensor_offset,
    feedforward_missing,
    current_loop,
    link_geometry,
    lost_motion,
    encoder_eccentricity,
    power_supply_sag,
    axis_coupling,
    clock_drift,
    position_quantization,
    rotor_inertia,
    viscous_asymmetry,
);

/// Description of effect `name`.
///
/// # Errors
/// [`EffectError::Unknown`] with the list of known names.
pub fn info(name: &str) -> Result<&'static EffectInfo, EffectError> {
    EFFECTS
        .iter()
        .copied()
        .find(|e| e.name == name)
        .ok_or_else(|| unknown(name))
}

fn unknown(name: &str) -> EffectError {
    let names: Vec<_> = EFFECTS.iter().map(|e| e.name).collect();
    EffectError::Unknown {
        name: name.to_owned(),
        expected: names.join(", "),
    }
}
