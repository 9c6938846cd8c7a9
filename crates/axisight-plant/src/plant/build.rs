//! Construction of a plant from a robot, changed parameters and the kernels of effects.

use super::axis::{Lead, axes};
use super::equations::Plant;
use super::own::{OnPair, Own};
use crate::effect::{Acts, BaseJoint, EffectError, EffectInfo, Kernel, PlantParameters, Scope};
use crate::robot::description::moves_with;
use crate::robot::{Chain, ChainJoint, Dynamics, MOST_JOINTS, Parameter, Place, RobotDescription};
use axisight_scalar::Scalar;
use std::sync::Arc;

/// Reason why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// Effects or fitted parameters leave a link without mass.
    #[error("mass of the link of joint {joint}: expected more than 0 kg, got {got}")]
    Mass {
        /// Joint, counted from 1.
        joint: usize,
        /// Mass [kg].
        got: f64,
    },
    /// The chain has more joints than the compiled code supports.
    #[error("joints: expected at most {MOST_JOINTS}, got {0}")]
    TooManyJoints(usize),
    /// The robot has a floating base, whose motion a plant does not have.
    #[error(
        "base: expected a fixed base, got a floating one: simulations, linearizations and fits of \
         them have no floating base. Take the model with a fixed base, or inverse_dynamics, \
         forward_dynamics and identify_floating"
    )]
    FloatingBase,
    /// An effect is used incorrectly.
    #[error(transparent)]
    Effect(#[from] EffectError),
}

/// A kernel of an effect with its description and its place.
pub type PlacedKernel<S> = (&'static EffectInfo, Place, Arc<dyn Kernel<S>>);

impl<S: Scalar> Plant<S> {
    /// The plant of `robot` with some parameters replaced, and with the effects `kernels` only.
    ///
    /// # Errors
    /// [`PlantError`] if a kernel is misplaced or uses a feature that its point of action does not
    /// offer, if a link has no mass left, or if the chain is too long.
    #[inline(never)]
    pub fn with_kernels(
        robot: &RobotDescription,
        overrides: &[(Parameter, S)],
        kernels: Vec<PlacedKernel<S>>,
    ) -> Result<Self, PlantError> {
        let mut plant = Self::bare(robot, overrides)?;
        for (info, place, kernel) in kernels {
            plant.add_kernel(info, place, kernel)?;
        }
        plant.finish()?;
        Ok(plant)
    }

    fn bare(robot: &RobotDescription, overrides: &[(Parameter, S)]) -> Result<Self, PlantError> {
        if robot.joints.len() > MOST_JOINTS {
            return Err(PlantError::TooManyJoints(robot.joints.len()));
        }
        if robot.floating_base.is_some() {
            return Err(PlantError::FloatingBase);
        }
        let mut chain = Chain::new(robot);
        for (parameter, value) in overrides {
            parameter.apply_to_chain(*value, &mut chain);
        }
        let value_of = |p: Parameter| {
            let found = overrides.iter().rev().find(|(q, _)| *q == p);
            found.map_or_else(|| S::constant(p.nominal(robot)), |(_, v)| *v)
        };
        let compliant = |j: &crate::robot::Joint| j.drive.is_some() && j.compliance.is_some();
        Ok(Self {
            dynamics: Dynamics::new(&chain),
            chain,
            axes: axes(robot, &value_of),
            elastic: elastic_joints(robot, &value_of),
            on_pairs: Vec::new(),
            on_arm: Vec::new(),
            accelerometers: robot.accelerometers.clone(),
            n_motors: robot.joints.iter().filter(|j| compliant(j)).count(),
            n_base: 0,
            n_internal: 0,
        })
    }

    /// Check and complete the plant, because effects may have changed masses, inertias and the
    /// chain.
    fn finish(&mut self) -> Result<(), PlantError> {
        self.check_masses()?;
        if self.chain.len() > MOST_JOINTS {
            return Err(PlantError::TooManyJoints(self.chain.len()));
        }
        self.dynamics = Dynamics::new(&self.chain);
        for axis in &mut self.axes {
            axis.inverse_motor_inertia = axis.motor_inertia.recip();
        }
        Ok(())
    }

    /// Check that effects leave every link with a positive mass.
    fn check_masses(&self) -> Result<(), PlantError> {
        for (i, joint) in self.chain.joints.iter().skip(self.n_base).enumerate() {
            let Some(body) = &joint.body else { continue };
            let lightest = (0..S::LANES)
                .map(|lane| body.mass.lane(lane))
                .fold(f64::INFINITY, f64::min);
            if lightest <= 0.0 {
                return Err(PlantError::Mass {
                    joint: i + 1,
                    got: lightest,
                });
            }
        }
        Ok(())
    }

    /// Add a kernel at its point of action.
    fn add_kernel(
        &mut self,
        info: &'static EffectInfo,
        place: Place,
        kernel: Arc<dyn Kernel<S>>,
    ) -> Result<(), PlantError> {
        check_states(info, kernel.n_internal())?;
        check_base(info, kernel.base_joints().len())?;
        if info.needs_chain && !self.chain.is_chain() {
            return Err(EffectError::on_tree(info.name).into());
        }
        let first = self.n_internal;
        let own = Own {
            kernel,
            internal: first..first,
        };
        match (info.scope, place) {
            (Scope::Arm, Place::Arm) => self.add_to_arm(own),
            (Scope::Axis, Place::Axis(axis)) if axis < self.axes.len() => {
                self.add_to_axis(info, axis, own)?;
            }
            (Scope::Axes, Place::Axes(a, b)) if a != b && a.max(b) < self.axes.len() => {
                let own = self.with_states(own);
                if let Some(share) = own.kernel.turns_next() {
                    let by = share * self.axes[a].ratio;
                    self.axes[b].led_by.push(Lead {
                        axis: a,
                        by,
                        effect: info.name,
                    });
                }
                self.on_pairs.push(OnPair { axes: [a, b], own });
            }
            _ => return Err(misplaced(info, self.axes.len(), place).into()),
        }
        Ok(())
    }

    /// Reserve states for the kernel among those of the plant.
    fn with_states(&mut self, own: Own<S>) -> Own<S> {
        let first = self.n_internal;
        self.n_internal += own.kernel.n_internal();
        Own {
            kernel: own.kernel,
            internal: first..self.n_internal,
        }
    }

    fn add_to_arm(&mut self, own: Own<S>) {
        own.kernel.prepare(&mut PlantParameters {
            chain: &mut self.chain,
            driven: None,
            link: None,
            stiffness: None,
            damping: None,
            motor_inertia: None,
        });
        self.insert_base(own.kernel.base_joints());
        let own = self.with_states(own);
        self.on_arm.push(own);
    }

    /// Insert joints below the first one. All other joints move up.
    fn insert_base(&mut self, joints: Vec<BaseJoint<S>>) {
        let count = joints.len();
        for axis in &mut self.axes {
            axis.joint += count;
        }
        for (joint, ..) in &mut self.elastic {
            *joint += count;
        }
        for accelerometer in &mut self.accelerometers {
            accelerometer.joint += count;
        }
        // The springs carry everything that stood on the ground.
        let last = (self.n_base + count).checked_sub(1);
        for joint in self.chain.joints.iter_mut().skip(self.n_base) {
            let inner = joint.parent.filter(|parent| *parent >= self.n_base);
            joint.parent = inner.map_or(last, |parent| Some(parent + count));
        }
        for (i, joint) in joints.into_iter().enumerate() {
            let place = self.n_base + i;
            self.elastic.push((place, joint.stiffness, joint.damping));
            let link = ChainJoint {
                parent: place.checked_sub(1),
                motion: joint.motion,
                origin: None,
                shift: None,
                axis: joint.axis,
                zero: S::zero(),
                body: joint.body,
            };
            self.chain.joints.insert(place, link);
        }
        self.n_base += count;
    }

    fn add_to_axis(
        &mut self,
        info: &'static EffectInfo,
        index: usize,
        own: Own<S>,
    ) -> Result<(), PlantError> {
        let own = self.with_states(own);
        let link = self.link(index);
        let axis = &mut self.axes[index];
        let needs = |expected: &str, lack: &str| EffectError::Lacking {
            effect: info.name,
            expected: expected.to_owned(),
            got: format!("{} ({lack})", Place::Axis(index)),
        };
        if info.acts == Acts::Transmission && axis.gear.is_none() {
            return Err(needs("an axis with a compliant transmission", "rigid").into());
        }
        if info.acts == Acts::Arm && link.is_none() {
            return Err(needs("an axis that moves a link with mass", "massless").into());
        }
        if one_too_many(&axis.kernels, &own.kernel) {
            return Err(needs("an axis with no other current loop", "it has one").into());
        }
        let (stiffness, damping) = match &mut axis.gear {
            Some(gear) => (Some(&mut gear.stiffness), Some(&mut gear.damping)),
            None => (None, None),
        };
        own.kernel.prepare(&mut PlantParameters {
            chain: &mut self.chain,
            driven: Some(axis.joint),
            link,
            stiffness,
            damping,
            motor_inertia: Some(&mut axis.motor_inertia),
        });
        axis.kernels.push(Arc::clone(&own.kernel));
        if own.kernel.acts_behind_gear() {
            axis.on_joint.push(own.clone());
        }
        match info.acts {
            Acts::Motor if own.kernel.needs_acceleration() => axis.ahead.push(own.kernel),
            Acts::Motor => axis.on_motor.push(own),
            Acts::Transmission => axis.on_gear.push(own),
            Acts::Joint => axis.on_joint.push(own),
            _ => {}
        }
        Ok(())
    }
}

impl<S: Scalar> Plant<S> {
    /// Joint that carries the link which moves with an axis but not with a further axis.
    fn link(&self, index: usize) -> Option<usize> {
        let joints = &self.chain.joints;
        let driven = self.axes[index].joint;
        let parent = |i: usize| joints[i].parent;
        let is_driven = |i: usize| self.axes.iter().any(|axis| axis.joint == i);
        (driven..joints.len())
            .find(|i| joints[*i].body.is_some() && moves_with(*i, driven, parent, is_driven))
    }
}

/// Whether an axis would get a second active current loop, one of them of second order.
fn one_too_many<S: Scalar>(others: &[Arc<dyn Kernel<S>>], new: &Arc<dyn Kernel<S>>) -> bool {
    let at_work = |t: S| (0..S::LANES).any(|lane| t.lane(lane) > 0.0);
    let first = |k: &Arc<dyn Kernel<S>>| k.lag().is_some_and(at_work);
    let second = |k: &Arc<dyn Kernel<S>>| k.current_loop().is_some_and(|(t, _)| at_work(t));
    let any = others.iter().any(|k| first(k) || second(k));
    (second(new) && any) || (first(new) && others.iter().any(second))
}

fn misplaced(info: &'static EffectInfo, n_axes: usize, place: Place) -> EffectError {
    let expected = match info.scope {
        Scope::Axis => format!("an axis from 1 to {n_axes}"),
        Scope::Axes => format!("two different axes from 1 to {n_axes}"),
        Scope::Arm => "no axis (it acts on the whole arm)".to_owned(),
    };
    EffectError::Axis {
        effect: info.name,
        expected,
        got: place.to_string(),
    }
}

/// Only integrated effects can have states; torque path and sensor work from sample to sample.
fn check_states(info: &'static EffectInfo, states: usize) -> Result<(), EffectError> {
    let integrated = !matches!(
        info.acts,
        Acts::TorquePath | Acts::Sensor | Acts::Controller
    );
    if integrated || states == 0 {
        return Ok(());
    }
    Err(EffectError::Unsupported {
        effect: info.name,
        expected: "no states of its own",
        got: format!("{states}"),
    })
}

fn check_base(info: &'static EffectInfo, joints: usize) -> Result<(), EffectError> {
    if info.acts == Acts::Base || joints == 0 {
        return Ok(());
    }
    Err(EffectError::Unsupported {
        effect: info.name,
        expected: "no joints below the first one",
        got: format!("{joints}"),
    })
}

fn elastic_joints<S: Scalar>(
    robot: &RobotDescription,
    value_of: &impl Fn(Parameter) -> S,
) -> Vec<(usize, S, S)> {
    let is_elastic = |i: &usize| robot.joints[*i].drive.is_none();
    (0..robot.joints.len())
        .filter(is_elastic)
        .map(|i| {
            (
                i,
                value_of(Parameter::Stiffness(i)),
                value_of(Parameter::Damping(i)),
            )
        })
        .collect()
}
