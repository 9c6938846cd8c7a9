//! The linear plant: everything that the linear loop needs of a robot, computed once.

use super::harmonics::{RippleTable, Waves};
use super::propagator::Propagator;
use crate::effects::{self, Change, EffectError, EffectInfo, Kernel, Linear, Role};
use crate::plant::{Linearization, LinearizationError, PlantError, assemble, linearize};
use crate::robot::{EffectSetting, Place, RobotDescription};
use axisight_scalar::Scalar;
use std::ops::Range;
use std::sync::Arc;

/// Reason why a robot has no linear plant.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinearPlantError {
    /// The robot cannot be linearized.
    #[error(transparent)]
    Linearization(#[from] LinearizationError),
    /// An effect has no linearization that holds in motion.
    #[error(
        "effect `{effect}`: expected one that is smooth about rest, got one without a \
         linearization that holds in motion; use the nonlinear plant"
    )]
    NotLinear {
        /// Name of the effect.
        effect: String,
    },
    /// The motor angle of an axis is not proportional to a single state.
    #[error("axis {axis}: expected a motor angle in proportion to one state, got none")]
    NoMotorAngle {
        /// Driven axis, counted from 1.
        axis: usize,
    },
}

/// One driven axis of a linear plant.
#[derive(Debug, Clone)]
pub(super) struct LinearAxis {
    /// State to which the motor angle is proportional.
    pub(super) slot: usize,
    /// Motor angle per unit of that state [rad/rad].
    pub(super) scale: f64,
    /// Motor angle at rest [rad].
    pub(super) angle: f64,
    /// Torque that the drive delivers at rest [Nm].
    pub(super) torque: f64,
    /// Viscous friction added by effects, motor side [Nm s/rad].
    pub(super) viscous: f64,
    /// Effects on the commanded torque.
    path: Vec<EffectSetting<f64>>,
}

/// A robot linearized about rest, with its ripple and torque path, ready for
/// [`simulate_linear`](super::simulate_linear).
#[derive(Debug, Clone)]
pub struct LinearPlant {
    pub(super) linear: Linearization,
    /// Driven joint angles at which it was linearized [rad].
    pub(super) start: Vec<f64>,
    /// State at rest, `[phi, q, phi', q']`.
    pub(super) rest: Vec<f64>,
    joints: Range<usize>,
    pub(super) axes: Vec<LinearAxis>,
    /// Torque and resolver ripple of all axes.
    pub(super) waves: Waves,
    /// Propagation over one sample of the robot's sample time.
    pub(super) propagator: Propagator,
}

impl LinearPlant {
    /// Linearize `robot` with `settings` at rest, with the driven joints at `start` [rad].
    ///
    /// Any effect is allowed at its neutral value, where it has no influence.
    ///
    /// # Errors
    /// [`LinearPlantError`] if an effect has no linearization (use the nonlinear plant), or if the
    /// plant cannot be built or does not settle.
    pub fn new(
        robot: &RobotDescription,
        settings: &[EffectSetting<f64>],
        start: &[f64],
    ) -> Result<Self, LinearPlantError> {
        let whole = assemble::<f64>(robot, &[], settings).map_err(LinearizationError::from)?;
        let (robot, settings) = &robot.with_all_effects(settings);
        let mut smooth = Vec::new();
        for setting in settings {
            if is_smooth(setting)? {
                smooth.push(setting.clone());
            }
        }
        let linear = linearize(robot, &smooth, start)?;
        let plain = assemble::<f64>(robot, &[], &smooth).map_err(LinearizationError::from)?;
        let axes = (0..whole.axes.len())
            .map(|i| LinearAxis::new(i, settings, &linear))
            .collect::<Result<Vec<_>, _>>()?;
        let at = &linear.equilibrium;
        Ok(Self {
            start: start.to_vec(),
            rest: plain.state_at_rest(at),
            joints: plain.joint_slots(),
            propagator: Propagator::new(&linear.a, &linear.b, robot.sample_time),
            waves: Waves::new(&ripple_tables(settings, axes.len())),
            linear,
            axes,
        })
    }

    /// The linearization, with states `[phi, q, phi', q']`.
    pub fn linearization(&self) -> &Linearization {
        &self.linear
    }

    /// Number of driven axes.
    pub fn n_axes(&self) -> usize {
        self.axes.len()
    }

    /// For each axis, the state that gives its motor angle, and the motor angle per unit of that
    /// state.
    pub fn motor_slots(&self) -> Vec<(usize, f64)> {
        self.axes.iter().map(|a| (a.slot, a.scale)).collect()
    }

    /// The states that are joint angles.
    pub fn joint_slots(&self) -> Range<usize> {
        self.joints.clone()
    }

    /// Number of states.
    pub fn n_states(&self) -> usize {
        self.rest.len()
    }

    /// Multiplications and additions of one step of one run, by part. An `a * b + c` counts once.
    pub fn operations(&self) -> Operations {
        Operations {
            propagation: self.propagator.operations(self.waves.act_on_torque()),
            harmonics: self.waves.operations(),
        }
    }
}

/// Arithmetic operations of one step of one run. A fused multiply-add counts once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Operations {
    /// Linear propagation and its correction for the ripple.
    pub propagation: usize,
    /// Sines, cosines, their products and sums.
    pub harmonics: usize,
}

/// Whether the linear plant can include an effect. Waves of ripple and neutral effects are handled
/// separately.
fn is_smooth(setting: &EffectSetting<f64>) -> Result<bool, LinearPlantError> {
    let misused = |e: EffectError| LinearizationError::from(PlantError::from(e));
    let info = effects::info(&setting.name).map_err(misused)?;
    let parameters = info.parameters.iter().zip(&setting.parameters);
    let mut amplitudes = parameters.filter(|(p, _)| p.role == Role::Amplitude);
    match info.linear {
        Linear::Parameters | Linear::Slope | Linear::Path => Ok(true),
        Linear::Waves { .. } => Ok(false),
        #[allow(clippy::float_cmp)] // neutral is a value one sets, not one that comes out
        Linear::No if amplitudes.all(|(p, value)| *value == p.neutral) => Ok(false),
        Linear::No => Err(LinearPlantError::NotLinear {
            effect: setting.name.clone(),
        }),
    }
}

/// Ripple parameters of each axis.
fn ripple_tables(settings: &[EffectSetting<f64>], n_axes: usize) -> Vec<RippleTable> {
    let mut tables = vec![RippleTable::default(); n_axes];
    for setting in settings {
        let Ok(Linear::Waves {
            constant,
            proportional,
            reading,
        }) = effects::info(&setting.name).map(|info| info.linear)
        else {
            continue;
        };
        let Place::Axis(axis) = setting.place else {
            continue;
        };
        let Some(table) = tables.get_mut(axis) else {
            continue;
        };
        let mut parameters = setting.parameters.iter().copied();
        table.constant.extend(parameters.by_ref().take(constant));
        table
            .proportional
            .extend(parameters.by_ref().take(proportional));
        table.resolver.extend(parameters.take(reading));
    }
    tables
}

impl LinearAxis {
    fn new(
        index: usize,
        settings: &[EffectSetting<f64>],
        linear: &Linearization,
    ) -> Result<Self, LinearPlantError> {
        let mine = || {
            let here = settings.iter().filter(|s| s.place == Place::Axis(index));
            here.filter_map(|s| Some((s, effects::info(&s.name).ok()?)))
        };
        let path = mine().filter(|(_, info)| info.linear == Linear::Path);
        let path: Vec<_> = path.map(|(setting, _)| setting.clone()).collect();
        let viscous = |info: &EffectInfo| {
            info.stands_for
                .is_some_and(|s| s.quantity == "viscous_friction" && s.change == Change::Absolute)
        };
        let no_angle = LinearPlantError::NoMotorAngle { axis: index + 1 };
        let (slot, scale) = (0..linear.c.ncols())
            .map(|j| (j, linear.c[(index, j)]))
            .find(|(_, c)| *c != 0.0)
            .ok_or(no_angle)?;
        let at = &linear.equilibrium;
        let command = at.motor_torque.get(index).copied().unwrap_or(0.0);
        let mut axis = Self {
            slot,
            scale,
            angle: at.motor_angle.get(index).copied().unwrap_or(0.0),
            torque: command,
            viscous: mine()
                .filter(|(_, info)| viscous(info))
                .filter_map(|(s, _)| s.parameters.first())
                .sum(),
            path,
        };
        let kernels = axis
            .path_kernels::<f64>()
            .map_err(|e| LinearizationError::from(PlantError::from(e)))?;
        axis.torque = kernels.iter().fold(command, |t, k| k.drive(t));
        Ok(axis)
    }

    /// The effects on the commanded torque.
    pub(super) fn path_kernels<S: Scalar>(&self) -> Result<Vec<Arc<dyn Kernel<S>>>, EffectError> {
        let built = self.path.iter().map(|setting| {
            let lifted: Vec<S> = setting.parameters.iter().map(|p| S::constant(*p)).collect();
            effects::build(&setting.name, &lifted).map(Arc::from)
        });
        built.collect()
    }
}
