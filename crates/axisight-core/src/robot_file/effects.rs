//! Additions of version 2 of the format: effects of the simulator, and tolerances of its
//! parameters.

use super::document::{Entry, Section};
use super::error::RobotError;
use crate::effects::{Acts, EFFECTS, EffectInfo, Scope};
use crate::robot::description::{Bound, Controller};
use crate::robot::{EffectSetting, Place, RobotDescription};

/// Quantities that may have a tolerance, besides gains.
const TOLERATED: [&str; 6] = [
    "mass",
    "inertia_scale",
    "stiffness",
    "damping",
    "motor_inertia",
    "viscous_friction",
];

/// Gains that may have a tolerance: those of controllers with position references. A cascade has an
/// integral gain only if it is not zero.
fn tolerated_gains(controller: &Controller) -> &'static [&'static str] {
    match controller {
        Controller::PdPosition { .. } => &["kp", "kd"],
        Controller::Cascade {
            ki,
            told_positions: Some(_),
            ..
        } if ki.iter().any(|gain| *gain > 0.0) => &["kv", "kp", "ki"],
        Controller::Cascade {
            told_positions: Some(_),
            ..
        } => &["kv", "kp"],
        _ => &[],
    }
}

pub(super) fn read_effects(
    root: &Section,
    robot: &RobotDescription,
) -> Result<Vec<EffectSetting<f64>>, RobotError> {
    let Some(list) = root.find("effect") else {
        return Ok(Vec::new());
    };
    let mut out: Vec<EffectSetting<f64>> = Vec::new();
    for section in list.sections()? {
        let setting = read_effect(&section, robot)?;
        if let Some(earlier) = out.iter().position(|other| other.replaces(&setting)) {
            let name = section.require("name", "a string")?;
            let expected = "an effect that no other [[effect]] states at the same place".to_owned();
            let got = format!("`{}`, as effect[{}]", setting.label(), earlier + 1);
            return Err(name.invalid(expected, got));
        }
        out.push(setting);
    }
    Ok(out)
}

fn read_effect(
    section: &Section,
    robot: &RobotDescription,
) -> Result<EffectSetting<f64>, RobotError> {
    let entry = section.require("name", "the name of an effect")?;
    let name = entry.string()?;
    let Some(info) = EFFECTS.iter().find(|e| e.name == name) else {
        let known: Vec<_> = EFFECTS.iter().map(|e| e.name).collect();
        return Err(entry.refuse(format!("one of {}", known.join(", "))));
    };
    let mut keys = match info.scope {
        Scope::Axis => vec!["name", "axis"],
        Scope::Axes => vec!["name", "axes"],
        Scope::Arm => vec!["name"],
    };
    keys.extend(info.parameters.iter().map(|p| p.name));
    section.only(&keys)?;
    if info.needs_chain && !robot.is_chain() {
        let expected = "an effect of robots with branches: this one needs a chain";
        return Err(entry.refuse(expected.to_owned()));
    }
    Ok(EffectSetting {
        name: name.to_owned(),
        place: read_place(section, info, robot)?,
        parameters: read_parameters(section, info)?,
    })
}

fn read_place(
    section: &Section,
    info: &EffectInfo,
    robot: &RobotDescription,
) -> Result<Place, RobotError> {
    let n = robot.n_axes();
    match info.scope {
        Scope::Arm => Ok(Place::Arm),
        Scope::Axis => {
            let entry = section.require("axis", &format!("an axis from 1 to {n}"))?;
            Ok(Place::Axis(axis_number(&entry, info, robot)?))
        }
        Scope::Axes => {
            let expected = format!("two different axes from 1 to {n}");
            let entry = section.require("axes", &expected)?;
            let axes = entry.items(expected.clone())?;
            let [first, second] = axes.as_slice() else {
                return Err(entry.refuse(expected));
            };
            let (i, j) = (
                axis_number(first, info, robot)?,
                axis_number(second, info, robot)?,
            );
            if i == j {
                return Err(entry.invalid(expected, format!("axis {} twice", i + 1)));
            }
            Ok(Place::Axes(i, j))
        }
    }
}

/// An axis of the robot, counted from 0, on which the effect can act.
fn axis_number(
    entry: &Entry,
    info: &EffectInfo,
    robot: &RobotDescription,
) -> Result<usize, RobotError> {
    let expected = format!("an axis from 1 to {}", robot.n_axes());
    let number = entry.number(Bound::Any, "1")?;
    #[allow(clippy::float_cmp)] // a count is a whole number or none
    let found = (0..robot.n_axes()).find(|i| (*i + 1) as f64 == number);
    let index = found.ok_or_else(|| entry.refuse(expected))?;
    let rigid = |i: usize| {
        let joint = robot.driven().nth(i).map(|(_, joint, _)| joint);
        joint.is_some_and(|joint| joint.compliance.is_none())
    };
    if info.acts == Acts::Transmission && rigid(index) {
        let expected = "an axis with a compliant transmission".to_owned();
        return Err(entry.invalid(expected, format!("axis {} (rigid)", index + 1)));
    }
    if info.acts == Acts::Arm && robot.link_of_axis(index).is_none() {
        let expected = "an axis that moves a link with mass".to_owned();
        return Err(entry.invalid(expected, format!("axis {} (massless)", index + 1)));
    }
    Ok(index)
}

fn read_parameters(section: &Section, info: &EffectInfo) -> Result<Vec<f64>, RobotError> {
    let mut out = Vec::with_capacity(info.parameters.len());
    for parameter in info.parameters {
        let Some(entry) = section.find(parameter.name) else {
            out.push(parameter.neutral);
            continue;
        };
        let value = entry.number(Bound::Any, parameter.unit)?;
        if !(parameter.lower..=parameter.upper).contains(&value) {
            let (low, high) = (parameter.lower, parameter.upper);
            return Err(entry.refuse(format!("{low} to {high} [{}]", parameter.unit)));
        }
        out.push(value);
    }
    Ok(out)
}

pub(super) fn read_tolerances(
    root: &Section,
    robot: &RobotDescription,
) -> Result<Vec<(String, f64)>, RobotError> {
    let Some(entry) = root.find("tolerances") else {
        return Ok(Vec::new());
    };
    let section = entry.section()?;
    let mut tolerated = TOLERATED.to_vec();
    tolerated.extend(tolerated_gains(&robot.controller));
    section.only(&tolerated)?;
    let stated = tolerated.iter().filter(|name| section.find(name).is_some());
    stated
        .map(|name| {
            Ok((
                (*name).to_owned(),
                section.number(name, Bound::Positive, "1")?,
            ))
        })
        .collect()
}
