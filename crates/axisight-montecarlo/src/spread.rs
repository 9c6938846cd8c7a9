//! Parameters that vary from run to run, as functions of (seed, run).

use super::error::StudyError;
use axisight_core::effects;
use axisight_core::robot::{EffectSetting, Parameter, RobotDescription};
use axisight_spectra::ensemble::{Purpose, generator};
use rand::Rng;
use rand_distr::{Distribution as _, StandardNormal};

/// Shape of a spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Distribution {
    /// Gaussian; the scale is the standard deviation.
    Normal,
    /// Uniform; the scale is the half width.
    Uniform,
}

/// The quantity that varies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SpreadTarget {
    /// A physical parameter of the robot.
    Robot(Parameter),
    /// A parameter of an effect: index in the list of effects, then in the table of the effect.
    Effect(usize, usize),
}

/// One varying parameter, `value (1 + relative z) + absolute z` with a random `z`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// The quantity that varies.
    pub target: SpreadTarget,
    /// Distribution of `z`.
    pub distribution: Distribution,
    /// Scale relative to the nominal value.
    pub relative: f64,
    /// Scale in the unit of the parameter.
    pub absolute: f64,
}

impl SpreadTarget {
    /// The target called `name`.
    ///
    /// Names are `axis2.stiffness` (robot parameter), `payload.mass_kg` (effect of the arm) or
    /// `torque_ripple@1.cosine_1_nm` (effect on an axis, counted from 1).
    ///
    /// # Errors
    /// [`StudyError`] with the known names.
    pub fn parse(
        name: &str,
        robot: &RobotDescription,
        settings: &[EffectSetting<f64>],
    ) -> Result<Self, StudyError> {
        if let Some((head, tail)) = name.rsplit_once('.')
            && let Some(index) = settings.iter().position(|s| s.label() == head)
        {
            let info = effects::info(&settings[index].name)
                .map_err(|e| StudyError::field("spread.parameter", "an effect", e))?;
            let names: Vec<_> = info.parameters.iter().map(|p| p.name).collect();
            let found = names.iter().position(|p| *p == tail);
            return found.map(|p| Self::Effect(index, p)).ok_or_else(|| {
                StudyError::field("spread.parameter", &names.join(", "), format!("`{name}`"))
            });
        }
        Parameter::parse(name, robot).map(Self::Robot).map_err(|e| {
            let labels: Vec<_> = settings.iter().map(EffectSetting::label).collect();
            let expected = format!(
                "one of {}, or a parameter of an effect of the study ({})",
                e.expected,
                labels.join(", ")
            );
            StudyError::field("spread.parameter", &expected, format!("`{name}`"))
        })
    }
}

impl Spread {
    pub(super) fn check(
        &self,
        robot: &RobotDescription,
        settings: &[EffectSetting<f64>],
    ) -> Result<(), StudyError> {
        for (field, scale) in [
            ("spread.relative", self.relative),
            ("spread.absolute", self.absolute),
        ] {
            if !(scale.is_finite() && scale >= 0.0) {
                return Err(StudyError::field(field, "a number not below zero", scale));
            }
        }
        let known = match self.target {
            SpreadTarget::Robot(p) => Parameter::all(robot).contains(&p),
            SpreadTarget::Effect(i, p) => settings.get(i).is_some_and(|s| p < s.parameters.len()),
        };
        if known {
            Ok(())
        } else {
            let got = format!("{:?}", self.target);
            Err(StudyError::field(
                "spread.parameter",
                "a parameter of the study",
                got,
            ))
        }
    }

    fn value(&self, nominal: f64, z: f64) -> f64 {
        nominal * (1.0 + self.relative * z) + self.absolute * z
    }
}

/// Robot and effects of one run; `None` if a drawn value is physically impossible.
pub(super) fn draw(
    robot: &RobotDescription,
    settings: &[EffectSetting<f64>],
    spreads: &[Spread],
    seed: u64,
    run: u64,
) -> Option<(RobotDescription, Vec<EffectSetting<f64>>)> {
    let (mut robot_out, mut effects_out) = (robot.clone(), settings.to_vec());
    let mut rng = generator(seed, Purpose::Spread, run);
    for spread in spreads {
        let z = match spread.distribution {
            Distribution::Normal => StandardNormal.sample(&mut rng),
            Distribution::Uniform => rng.random_range(-1.0..1.0),
        };
        match spread.target {
            SpreadTarget::Robot(parameter) => {
                let value = spread.value(parameter.nominal(robot), z);
                if !possible(parameter, value) {
                    return None;
                }
                parameter.set(&mut robot_out, value);
            }
            SpreadTarget::Effect(index, p) => {
                let slot = effects_out.get_mut(index)?.parameters.get_mut(p)?;
                *slot = spread.value(*slot, z);
            }
        }
    }
    Some((robot_out, effects_out))
}

fn possible(parameter: Parameter, value: f64) -> bool {
    value.is_finite()
        && match parameter {
            Parameter::Mass(_)
            | Parameter::InertiaScale(_)
            | Parameter::Stiffness(_)
            | Parameter::MotorInertia(_) => value > 0.0,
            Parameter::Damping(_) | Parameter::ViscousFriction(_) => value >= 0.0,
            Parameter::Com(..) => true,
        }
}
