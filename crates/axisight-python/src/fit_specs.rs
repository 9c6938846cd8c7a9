//! Specifications of fits, from Python.

use crate::entry::{InputError, input_error};
use axisight_core::robot::{Parameter, RobotDescription};
use axisight_identification::logs::{FitOptions, FitParameter, Loss, Sensed, SensedOutput, Target};
use axisight_numerics::Weighting;
use pyo3::prelude::*;

/// One parameter to fit, from Python.
#[derive(FromPyObject)]
pub struct ParameterSpec {
    /// Name of a robot parameter, or None for an effect parameter.
    robot: Option<String>,
    /// Index of the effect in the list, then of the parameter in its table.
    effect: Option<(usize, usize)>,
    initial: f64,
    lower: f64,
    upper: f64,
    scale: f64,
    prior: Option<(f64, f64)>,
    frozen: bool,
    nuisance: bool,
    /// For a shape: index of the only size parameter in the table of its effect.
    amplitude: Option<usize>,
    logarithmic: bool,
}

/// Settings of a fit, from Python.
#[derive(FromPyObject)]
pub struct OptionSpec {
    max_iterations: usize,
    loss_tolerance: f64,
    step_tolerance: f64,
    loss: String,
    loss_scale: f64,
    nuisance_refreshes: usize,
}

/// Frequencies [Hz], weights and decimation of one axis.
pub type WeightingTuple = (Vec<f64>, Vec<f64>, usize);

/// Kind of a reading of a sensor on the arm, its index, and its weighting.
pub type SensedTuple = (String, usize, WeightingTuple);

/// Compared readings of sensors on the arm.
pub fn sensed_outputs(specs: Vec<SensedTuple>) -> PyResult<Vec<SensedOutput>> {
    let one = |(kind, index, weighting): SensedTuple| {
        let quantity = match kind.as_str() {
            "joint_angle" => Sensed::JointAngle(index),
            "acceleration" => Sensed::SpecificForce(index),
            other => {
                let text = format!("sensed: expected joint_angle or acceleration, got {other}");
                return Err(input_error(text));
            }
        };
        Ok(SensedOutput {
            quantity,
            weighting: self::weighting(weighting),
        })
    };
    specs.into_iter().map(one).collect()
}

/// Parameters of a fit. Raises `InputError` if `robot` does not have one of them.
pub fn parameters(
    specs: &[ParameterSpec],
    robot: &RobotDescription,
) -> PyResult<Vec<FitParameter>> {
    let size = |s: &ParameterSpec| {
        let wanted = (s.effect?.0, s.amplitude?);
        specs.iter().position(|other| other.effect == Some(wanted))
    };
    specs
        .iter()
        .enumerate()
        .map(|(i, s)| {
            let target = match (&s.robot, s.effect) {
                (Some(name), None) => {
                    Target::Robot(Parameter::parse(name, robot).map_err(input_error)?)
                }
                (None, Some((e, j))) => Target::Effect(e, j),
                _ => {
                    let text = "expected either a robot parameter or an effect parameter";
                    return Err(InputError::new_err(format!("parameters[{i}]: {text}")));
                }
            };
            Ok(FitParameter {
                target,
                initial: s.initial,
                lower: s.lower,
                upper: s.upper,
                scale: s.scale,
                prior: s.prior,
                frozen: s.frozen,
                amplitude: size(s),
                nuisance: s.nuisance,
                logarithmic: s.logarithmic,
            })
        })
        .collect()
}

/// Loss by name. Raises `InputError` for an unknown name.
pub fn loss(spec: &OptionSpec) -> PyResult<Loss> {
    match spec.loss.as_str() {
        "squared" => Ok(Loss::Squared),
        "huber" => Ok(Loss::Huber(spec.loss_scale)),
        "soft_l1" => Ok(Loss::SoftL1(spec.loss_scale)),
        other => {
            let text = format!("loss: expected squared, huber or soft_l1, got {other}");
            Err(InputError::new_err(text))
        }
    }
}

/// Settings of a fit.
pub fn options(spec: &OptionSpec) -> PyResult<FitOptions> {
    Ok(FitOptions {
        max_iterations: spec.max_iterations,
        loss_tolerance: spec.loss_tolerance,
        step_tolerance: spec.step_tolerance,
        loss: loss(spec)?,
        nuisance_refreshes: spec.nuisance_refreshes,
    })
}

/// Weightings of errors, one per axis.
pub fn weightings(specs: Vec<WeightingTuple>) -> Vec<Weighting> {
    specs.into_iter().map(weighting).collect()
}

fn weighting((frequency_hz, weight, decimation): WeightingTuple) -> Weighting {
    Weighting {
        frequency_hz,
        weight,
        decimation,
    }
}
