//! Plants, linearizations and integrators for robots with effects by name.

use crate::effects::{self, EffectError, EffectInfo};
use crate::robot::{EffectSetting, Parameter, RobotDescription};
use crate::simulation::{self, Stepper};
use axisight_plant::plant::{
    self, Linearization, LinearizationError, PlacedKernel, Plant, PlantError,
};
use axisight_scalar::Scalar;

/// The plant of `robot` with some parameters replaced and the effects `settings` added.
///
/// The robot's own effects act too, except those that `settings` replaces: the same effect at the
/// same place.
///
/// # Errors
/// [`PlantError`] if an effect is unknown or misplaced, has the wrong parameters, or the plant
/// cannot be built.
#[inline(never)]
pub fn assemble<S: Scalar>(
    robot: &RobotDescription,
    overrides: &[(Parameter, S)],
    settings: &[EffectSetting<S>],
) -> Result<Plant<S>, PlantError> {
    let mut kernels = Vec::new();
    for own in robot.effects_beside(settings) {
        kernels.push(placed(&own.lifted())?);
    }
    for setting in settings {
        kernels.push(placed(setting)?);
    }
    Plant::with_kernels(robot, overrides, kernels)
}

fn placed<S: Scalar>(setting: &EffectSetting<S>) -> Result<PlacedKernel<S>, EffectError> {
    let info = effects::info(&setting.name)?;
    check_bounds(info, &setting.parameters)?;
    let kernel = effects::build(&setting.name, &setting.parameters)?;
    Ok((info, setting.place, kernel.into()))
}

/// Linearize `robot` with `settings` at rest with the driven joints at `driven` [rad].
///
/// # Errors
/// [`LinearizationError`] if the plant cannot be built or does not settle.
pub fn linearize(
    robot: &RobotDescription,
    settings: &[EffectSetting<f64>],
    driven: &[f64],
) -> Result<Linearization, LinearizationError> {
    let plain = assemble(robot, &[], settings)?;
    plant::linearize(&plain, &seeded(robot, settings)?, driven)
}

/// Steps of Runge-Kutta per sample that stay stable near standstill for `robot` with `settings`.
///
/// # Errors
/// [`PlantError`] as for [`assemble`].
pub fn stable_substeps(
    robot: &RobotDescription,
    settings: &[EffectSetting<f64>],
) -> Result<usize, PlantError> {
    let decay = plant::fastest_decay(&seeded(robot, settings)?);
    Ok(simulation::stable_substeps(decay, robot.sample_time))
}

/// Integrator of `plant`, which must be that of `robot` with `settings`, for any method.
///
/// Implicit methods integrate one run without derivatives. For other scalars this function equals
/// [`Stepper::new`].
///
/// # Errors
/// [`PlantError`] as for [`assemble`].
#[inline(never)]
pub fn stepper<S: Scalar>(
    plant: &Plant<S>,
    robot: &RobotDescription,
    settings: &[EffectSetting<f64>],
) -> Result<Stepper<S>, PlantError> {
    if S::LANES == 1 && S::PARTIALS == 0 {
        let plain = assemble(robot, &[], settings)?;
        return Ok(Stepper::with_jacobian(
            plant,
            plain,
            seeded(robot, settings)?,
        ));
    }
    Ok(Stepper::new(plant))
}

fn seeded(
    robot: &RobotDescription,
    settings: &[EffectSetting<f64>],
) -> Result<Plant<plant::Seeded>, PlantError> {
    let lifted: Vec<_> = settings.iter().map(EffectSetting::lifted).collect();
    assemble(robot, &[], &lifted)
}

fn check_bounds<S: Scalar>(info: &'static EffectInfo, values: &[S]) -> Result<(), EffectError> {
    for (parameter, value) in info.parameters.iter().zip(values) {
        for lane in 0..S::LANES {
            let got = value.lane(lane);
            if !(parameter.lower..=parameter.upper).contains(&got) {
                return Err(EffectError::Bounds {
                    effect: info.name,
                    parameter: parameter.name,
                    lower: parameter.lower,
                    upper: parameter.upper,
                    got,
                });
            }
        }
    }
    Ok(())
}
