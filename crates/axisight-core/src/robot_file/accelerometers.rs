//! Accelerometers on the links, an addition of version 2 of the format.

use super::document::{Entry, Section};
use super::error::RobotError;
use crate::robot::description::check_unit;
use crate::robot::{Accelerometer, RobotDescription};

const KEYS: &[&str] = &["name", "joint", "position", "directions"];
/// Directions of an accelerometer that states none: the axes of its link.
const LINK_AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const UNIT_TOLERANCE: f64 = 1e-6;

pub(super) fn read_accelerometers(
    root: &Section,
    robot: &RobotDescription,
) -> Result<Vec<Accelerometer>, RobotError> {
    let Some(list) = root.find("accelerometer") else {
        return Ok(Vec::new());
    };
    let mut out: Vec<Accelerometer> = Vec::new();
    for section in list.sections()? {
        let one = read_accelerometer(&section, robot)?;
        if let Some(earlier) = out.iter().position(|other| other.name == one.name) {
            let name = section.require("name", "a string")?;
            let expected = "a name that no other [[accelerometer]] has".to_owned();
            let got = format!(
                "\"{}\", the name of accelerometer[{}]",
                one.name,
                earlier + 1
            );
            return Err(name.invalid(expected, got));
        }
        out.push(one);
    }
    Ok(out)
}

fn read_accelerometer(
    section: &Section,
    robot: &RobotDescription,
) -> Result<Accelerometer, RobotError> {
    section.only(KEYS)?;
    let position = section.require("position", "an array of 3 numbers [m]")?;
    Ok(Accelerometer {
        name: read_name(section)?,
        joint: read_joint(section, robot)?,
        position: position.vector("m")?,
        directions: match section.find("directions") {
            Some(entry) => read_directions(&entry)?,
            None => LINK_AXES.to_vec(),
        },
    })
}

/// A name that can be part of the name of a log column.
fn read_name(section: &Section) -> Result<String, RobotError> {
    let expected = "a name of letters, digits and underscores that begins with a letter";
    let entry = section.require("name", expected)?;
    let name = entry.string()?;
    let starts = name.starts_with(|c: char| c.is_ascii_alphabetic());
    if starts && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
        return Ok(name.to_owned());
    }
    Err(entry.refuse(expected.to_owned()))
}

fn read_joint(section: &Section, robot: &RobotDescription) -> Result<usize, RobotError> {
    let names: Vec<_> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    let expected = format!("the name of a joint, one of {}", names.join(", "));
    let entry = section.require("joint", &expected)?;
    let name = entry.value.as_str();
    let found = names.iter().position(|joint| Some(*joint) == name);
    found.ok_or_else(|| entry.refuse(expected))
}

fn read_directions(entry: &Entry) -> Result<Vec<[f64; 3]>, RobotError> {
    let expected = "one to three unit vectors of 3 numbers".to_owned();
    let items = entry.items(expected.clone())?;
    if !(1..=LINK_AXES.len()).contains(&items.len()) {
        return Err(entry.refuse(expected));
    }
    let direction = |item: &Entry| {
        let vector = item.vector("1")?;
        let unit = "a unit vector of 3 numbers".to_owned();
        check_unit(&vector, UNIT_TOLERANCE)
            .map_err(|norm| item.invalid(unit, format!("{vector:?} of norm {norm}")))?;
        Ok(vector)
    };
    items.iter().map(direction).collect()
}
