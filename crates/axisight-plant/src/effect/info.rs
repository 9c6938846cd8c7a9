//! What an effect is: the whole of what is known of it, in one table entry.
//!
//! Whoever has to treat effects differently asks for a property here; no other place knows
//! them by name, but for the start values of a search.

use super::formula::Formula;
use super::prior::Prior;
use super::relations::{BegunFrom, Later, LawOf, Plainer, Resembles, Scales, SpringChange};

/// What an effect belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// One driven axis.
    Axis,
    /// Two driven axes, in order.
    Axes,
    /// The whole arm.
    Arm,
}

/// Where in the signal path an effect acts.
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
    /// What the arm stands on: gravity seen from it, springs below the first joint.
    Base,
    /// Between true and measured motor position.
    Sensor,
    /// In the controller, from references and measured positions to the command.
    Controller,
}

/// What kind of cause an effect is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Against the motion.
    Friction,
    /// Springs, dampers and play of the gear.
    Transmission,
    /// Repeats with the angle.
    Periodic,
    /// Late or slow torque.
    Timing,
    /// Wrong or limited torque.
    TorquePath,
    /// Inertia and load.
    Load,
    /// The arm beyond its modelled joints.
    Arm,
    /// Wrong readings.
    Sensor,
    /// Another controller than the stated one.
    Controller,
}

/// How a change is stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// In the unit of what changes.
    Absolute,
    /// As a share of what changes, which must not be zero.
    Relative,
}

/// A parameter of the robot that an effect stands in for: with the effect free, the
/// parameter is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StandsFor {
    /// Quantity of the joint, as in parameter names.
    pub quantity: &'static str,
    /// What the first parameter of the effect says of it.
    pub change: Change,
}

/// How a linear model holds an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Linear {
    /// Changed parameters of the robot: wherever the robot goes, linear or not.
    Parameters,
    /// Its slope at rest describes it in motion too. A slope of zero qualifies where small motion
    /// about the rest stays in it (a cubic spring without load); not where speed leaves it behind
    /// (drag).
    Slope,
    /// It comes before the plant: gain, delay, lag.
    Path,
    /// Waves over the motor angle beside the linear plant; numbers of its parameters, in
    /// order, that are terms of constant torque, torque in proportion to the command, reading.
    Waves {
        /// Terms of constant torque.
        constant: usize,
        /// Terms in proportion to the command.
        proportional: usize,
        /// Terms of the reading.
        reading: usize,
    },
    /// Not at all.
    No,
}

/// What identification may have found from data that hold the effect: the effect, or part of
/// it, is then in what was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Absorber {
    /// Masses and inertias of the links.
    Links,
    /// Inertia of the motor.
    MotorInertia,
    /// Friction in proportion to the speed.
    ViscousFriction,
    /// Friction that the speed only turns.
    DryFriction,
    /// Constant torque.
    TorqueOffset,
    /// Stiffness of the gear.
    Stiffness,
    /// Damping of the gear.
    Damping,
    /// Play of the gear.
    Backlash,
    /// The unit of torque.
    Torque,
}

/// An experiment that tells an effect from others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Experiment {
    /// The same excitation at several amplitudes and preloads.
    Amplitudes,
    /// A wide band.
    WideBand,
    /// Constant speeds in both directions, with and without load.
    Speeds,
    /// Slow motion at two speeds, and a sensor on the joint.
    SlowTurns,
    /// Poses, with and without a known load.
    Poses,
    /// References and positions logged beside the torque.
    References,
}

/// What a parameter does to an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The effect vanishes when every amplitude is at its neutral value.
    Amplitude,
    /// Shapes the effect; any value is neutral once the amplitudes are.
    Shape,
}

/// What else is to be known of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// It may be idle: one coordinate, one wave, one gain of several. An effect does not pay for it where it says
    /// nothing for it.
    Optional,
    /// It says where the effect acts, and counts no more than the axis does.
    Place,
    /// It is how somebody writes the law, not what a machine has.
    Notation,
    /// A time [s] over which the effect changes at the fastest: no fixed step follows less than one of its own.
    FastestTime,
    /// A small change of it shows as the change of its inverse: of a stiffness, as that of the compliance.
    ShowsInverse,
    /// Held at its neutral value until the fit of the others is where it belongs; the curve of the law at rest has
    /// none of it.
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
    /// Typical magnitude: natural scale of a search and width of a plausible range. It must visibly
    /// change the closed loop of the preset robot.
    pub typical: f64,
    /// How its values are spread over machines.
    pub prior: Prior,
    /// What typical size and spread rest on.
    pub sizes: &'static str,
    /// What else is to be known of it.
    pub marks: &'static [Mark],
}

impl ParameterInfo {
    /// What most parameters are: an amplitude that may be none, without marks. Name, unit, bounds and typical size are its own.
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
#[derive(Debug)]
pub struct EffectInfo {
    /// Name as in the verdict vocabulary.
    pub name: &'static str,
    /// One line for people.
    pub summary: &'static str,
    /// Equation in the notation of the thesis.
    pub equation: &'static str,
    /// Where the equation comes from.
    pub source: &'static str,
    /// Axis, two axes or arm.
    pub scope: Scope,
    /// Point of action.
    pub acts: Acts,
    /// Kind of cause.
    pub family: Family,
    /// Effects that this one becomes at some value of its parameters.
    pub contains: &'static [&'static str],
    /// Simpler effects that together do what this one does.
    pub parts: &'static [&'static str],
    /// Effects met more often, of the same family, that this one looks like where speed, load or
    /// pose hardly change.
    pub usual: &'static [&'static str],
    /// How many times as often as what looks like it this effect is met, where it is the usual one [1].
    pub usual_odds: f64,
    /// Effects of which a machine gives the very same logs of commands and motor angles.
    pub twins: &'static [&'static str],
    /// Whether it has its twins on an axis alone: others feel the motion of its axis when it is.
    pub twins_alone: bool,
    /// Another effect that it is like at some values of its parameters.
    pub resembles: Option<Resembles>,
    /// The law that it is without what it adds.
    pub plainer: Option<Plainer>,
    /// Law where whose fit ended its own may begin.
    pub begun_from: Option<BegunFrom>,
    /// Numbers of it that are looked for where its fit without them ended.
    pub later: Option<Later>,
    /// What it is a law of, if an axis has one of that.
    pub law_of: Option<LawOf>,
    /// What two formulas of it may differ by.
    pub formula: Formula,
    /// How it makes a gear another spring.
    pub spring: Option<SpringChange>,
    /// Whose torques it changes as another unit of torque would.
    pub scales: Option<Scales>,
    /// Causes of its axis without which torque predicted from measured motion does not show it for sure: what no
    /// formula has of a real machine passes for it.
    pub beside: &'static [&'static str],
    /// Whether no two runs repeat what it does: it is noise, which no simulator removes.
    pub unrepeatable: bool,
    /// Parameter of the robot it is a change of.
    pub stands_for: Option<StandsFor>,
    /// How a linear model holds it.
    pub linear: Linear,
    /// Whether torque predicted from measured motion can hold it; false for effects in the
    /// transmission and of the sensor, whose place a rigid gear takes there.
    pub inverse_dynamics: bool,
    /// What it is part of once identified.
    pub absorbed_by: &'static [Absorber],
    /// Experiments that show it, the best first.
    pub shown_by: &'static [Experiment],
    /// Parameters in kernel order.
    pub parameters: &'static [ParameterInfo],
}

impl EffectInfo {
    /// What most effects are: on one axis, held by torque predicted from measured motion and by no linear model,
    /// akin to no other, with a formula that each book writes otherwise; met four times as often as what looks
    /// like it.
    ///
    /// An effect states what it is otherwise, `..EffectInfo::PLAIN` the rest. Of its own it states at least name,
    /// summary, equation, source, point of action, family and parameters.
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
        stands_for: None,
        linear: Linear::No,
        inverse_dynamics: true,
        absorbed_by: &[],
        shown_by: &[],
        parameters: &[],
    };
}
