//! Description of an effect: everything known about it, in one table entry.
//!
//! Code that treats effects differently reads a property here. Only the start values of a search
//! know effects by name.

use super::formula::Formula;
use super::prior::Prior;
use super::relations::{BegunFrom, Later, LawOf, Plainer, Resembles, Scales, SpringChange};

/// The part of the robot to which an effect belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// One driven axis.
    Axis,
    /// Two driven axes; their order matters.
    Axes,
    /// The whole arm.
    Arm,
}

/// The place in the signal path where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acts {
    /// Between commanded and applied motor torque.
    TorquePath,
    /// Torque on the motor shaft.
    Motor,
    /// Between motor and joint.
    Transmission,
    /// Torque on the driven joint.
    Joint,
    /// Masses and springs of the arm, forces on its joints.
    Arm,
    /// The support of the arm: gravity as seen from it, springs below the first joint.
    Base,
    /// Between true and measured motor position.
    Sensor,
    /// In the controller, between references, measured positions and command.
    Controller,
}

/// The kind of cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Friction and drag.
    Friction,
    /// Springs, dampers and backlash of the gear.
    Transmission,
    /// Errors that repeat with the angle.
    Periodic,
    /// Delayed or slow torque.
    Timing,
    /// Wrong or limited torque.
    TorquePath,
    /// Inertia and load.
    Load,
    /// Flexibility and couplings of the arm beyond its modelled joints.
    Arm,
    /// Wrong readings.
    Sensor,
    /// A controller that differs from the stated one.
    Controller,
}

/// How a change is stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// In the unit of the changed quantity.
    Absolute,
    /// Relative to the changed quantity, which must not be zero.
    Relative,
}

/// A parameter of the robot that an effect replaces. While the effect is free, the parameter is
/// held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StandsFor {
    /// Quantity of the joint, as in parameter names.
    pub quantity: &'static str,
    /// How the first parameter of the effect states the change.
    pub change: Change,
}

/// How a linear model includes an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Linear {
    /// As changed parameters of the robot, which enter every model of it, linear or not.
    Parameters,
    /// By its slope at rest. This is valid where small motion about the rest stays near that slope,
    /// even a slope of zero (a cubic spring without load). It is not valid where speed leaves the
    /// slope (drag).
    Slope,
    /// As a gain, delay or lag before the plant.
    Path,
    /// As waves over the motor angle, beside the linear plant.
    ///
    /// The variant gives the numbers of parameters, in kernel order, for each of the three kinds of
    /// terms.
    Waves {
        /// Number of terms of constant torque.
        constant: usize,
        /// Number of terms of torque proportional to the command.
        proportional: usize,
        /// Number of terms of the reading.
        reading: usize,
    },
    /// A linear model cannot include it.
    No,
}

/// A quantity from identification that absorbs an effect or a part of it, if the data contain the
/// effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Absorber {
    /// Masses and inertias of the links.
    Links,
    /// Inertia of the motor.
    MotorInertia,
    /// Viscous friction.
    ViscousFriction,
    /// Dry friction, which depends only on the direction of the speed.
    DryFriction,
    /// Constant torque.
    TorqueOffset,
    /// Stiffness of the gear.
    Stiffness,
    /// Damping of the gear.
    Damping,
    /// Backlash of the gear.
    Backlash,
    /// The unit of torque.
    Torque,
}

/// An experiment that tells an effect from other effects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Experiment {
    /// The same excitation at several amplitudes and preloads.
    Amplitudes,
    /// An excitation with a wide band.
    WideBand,
    /// Constant speeds in both directions, with and without load.
    Speeds,
    /// Slow motion at two speeds, with a sensor on the joint.
    SlowTurns,
    /// Several poses, with and without a known load.
    Poses,
    /// References and positions, logged beside the torque.
    References,
}

/// The role of a parameter in its effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The effect vanishes when every amplitude is at its neutral value.
    Amplitude,
    /// It shapes the effect. It may have any value if every amplitude is at its neutral value.
    Shape,
}

/// A mark of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// It may be idle, as one of several coordinates, waves or gains. The effect pays no penalty
    /// for a parameter that explains nothing.
    Optional,
    /// It says where the effect acts, and does not count as a number of the effect.
    Place,
    /// It belongs to a way of writing the law, not to the machine.
    Notation,
    /// The shortest time [s] in which the effect changes. Fixed steps must not be longer.
    FastestTime,
    /// A small change shows as a change of the inverse, as for a stiffness by its compliance.
    ShowsInverse,
    /// It is held at its neutral value until the fit of the other parameters has converged. The
    /// curve of the law at rest does not depend on it.
    HeldFirst,
}

/// One parameter of an effect.
#[derive(Debug, Clone, Copy)]
pub struct ParameterInfo {
    /// Name with its unit as suffix, e.g. `coulomb_nm`.
    pub name: &'static str,
    /// Unit, e.g. `Nm`; `1` when dimensionless.
    pub unit: &'static str,
    /// Amplitude or shape.
    pub role: Role,
    /// Value at which the effect vanishes (amplitude) or the usual value (shape).
    pub neutral: f64,
    /// Smallest admissible value.
    pub lower: f64,
    /// Largest admissible value.
    pub upper: f64,
    /// Typical magnitude: the natural scale of a search and the width of a plausible range. A
    /// change of this size must be visible in the closed loop of the preset robot.
    pub typical: f64,
    /// Distribution of its values over machines.
    pub prior: Prior,
    /// Source of `typical` and of the spread.
    pub sizes: &'static str,
    /// Marks of the parameter.
    pub marks: &'static [Mark],
}

impl ParameterInfo {
    /// The most common case: a non-negative amplitude without marks. Name, unit, bounds and typical
    /// size must be set.
    pub const PLAIN: Self = Self {
        name: "",
        unit: "1",
        role: Role::Amplitude,
        neutral: 0.0,
        lower: 0.0,
        upper: 0.0,
        typical: 0.0,
        prior: Prior::HalfNormal,
        sizes: "judgement: the scale at which it shows on an arm like the preset",
        marks: &[],
    };
}

/// Description of an effect.
// Its facts are independent of each other: every combination of them can occur.
#[allow(clippy::struct_excessive_bools)]
#[derive(Debug)]
pub struct EffectInfo {
    /// Name, as in a verdict.
    pub name: &'static str,
    /// Summary for users, one line.
    pub summary: &'static str,
    /// Equation, in the notation of the thesis.
    pub equation: &'static str,
    /// Source of the equation.
    pub source: &'static str,
    /// One axis, two axes or the arm.
    pub scope: Scope,
    /// Point of action.
    pub acts: Acts,
    /// Kind of cause.
    pub family: Family,
    /// Effects that this one becomes at some value of its parameters.
    pub contains: &'static [&'static str],
    /// Simpler effects that together do the same.
    pub parts: &'static [&'static str],
    /// More common effects of the same family that this one looks like if speed, load or pose
    /// hardly change.
    pub usual: &'static [&'static str],
    /// How many times as common this effect is as one that lists it in `usual` [1].
    pub usual_odds: f64,
    /// Effects that give the same logs of commands and motor angles.
    pub twins: &'static [&'static str],
    /// Whether it has its twins only on an arm of one axis. On other arms, the other axes feel the
    /// difference.
    pub twins_alone: bool,
    /// Another effect that it equals at some values of its parameters.
    pub resembles: Option<Resembles>,
    /// The plainer law that it contains.
    pub plainer: Option<Plainer>,
    /// Law whose fit can start the fit of this effect.
    pub begun_from: Option<BegunFrom>,
    /// Parameters that are fitted in a second step, after the fit without them.
    pub later: Option<Later>,
    /// The part of which it is a law, if an axis has only one law of that part.
    pub law_of: Option<LawOf>,
    /// How much two formulas of it may differ.
    pub formula: Formula,
    /// How it changes the spring of a gear.
    pub spring: Option<SpringChange>,
    /// The torques that it scales like a change of torque unit.
    pub scales: Option<Scales>,
    /// Causes of the same axis without which torque predicted from measured motion does not show
    /// the effect reliably, because errors of the formulas look like it.
    pub beside: &'static [&'static str],
    /// Whether no two runs repeat it. Such an effect is noise, which no simulator removes.
    pub unrepeatable: bool,
    /// Whether it acts at the one tip of a chain, or on the one joint after a link. A robot with
    /// branches has several, and refuses it.
    pub needs_chain: bool,
    /// Parameter of the robot that it changes.
    pub stands_for: Option<StandsFor>,
    /// How a linear model includes it.
    pub linear: Linear,
    /// Whether torque predicted from measured motion can include it. It is false for effects of the
    /// sensor and in the transmission, because that prediction assumes a rigid gear.
    pub inverse_dynamics: bool,
    /// Identified quantities that absorb it.
    pub absorbed_by: &'static [Absorber],
    /// Experiments that tell it from other effects, the best first.
    pub shown_by: &'static [Experiment],
    /// Parameters in kernel order.
    pub parameters: &'static [ParameterInfo],
}

impl EffectInfo {
    /// The most common case of an effect.
    ///
    /// It acts on one axis, torque predicted from measured motion can include it, and linear models
    /// cannot. It is related to no other effect. Its formula is written differently in each book.
    /// It is four times as common as its look-alikes.
    ///
    /// An effect sets at least name, summary, equation, source, point of action, family and
    /// parameters, and takes the rest from `..EffectInfo::PLAIN`.
    pub const PLAIN: Self = Self {
        name: "",
        summary: "",
        equation: "",
        source: "",
        scope: Scope::Axis,
        acts: Acts::Motor,
        family: Family::Friction,
        contains: &[],
        parts: &[],
        usual: &[],
        usual_odds: 4.0,
        twins: &[],
        twins_alone: false,
        resembles: None,
        plainer: None,
        begun_from: None,
        later: None,
        law_of: None,
        formula: Formula::LAW,
        spring: None,
        scales: None,
        beside: &[],
        unrepeatable: false,
        needs_chain: false,
        stands_for: None,
        linear: Linear::No,
        inverse_dynamics: true,
        absorbed_by: &[],
        shown_by: &[],
        parameters: &[],
    };
}
