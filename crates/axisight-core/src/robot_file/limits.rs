//! Checks `[joint.limits]`: what a joint may do. No simulation stops at these limits, so the robot
//! does not keep them; who plans a motion reads them from the text of the description.

use super::document::{Entry, Section};
use super::error::RobotError;
use crate::robot::description::{Bound, Motion};

/// Largest values in either direction, joint side, with their units for angles and for distances.
const LARGEST: [(&str, [&str; 2]); 3] = [
    ("velocity", ["rad/s", "m/s"]),
    ("acceleration", ["rad/s^2", "m/s^2"]),
    ("effort", ["Nm", "N"]),
];

/// Refuse unknown keys, a range whose ends are not in order, and limits that are not positive.
pub(super) fn check_limits(entry: &Entry, motion: Motion, driven: bool) -> Result<(), RobotError> {
    if !driven {
        return Err(entry.refuse("no limits, as the joint is elastic".to_owned()));
    }
    let section = entry.section()?;
    section.only(&["position", "velocity", "acceleration", "effort"])?;
    let unit = match motion {
        Motion::Revolute => 0,
        Motion::Prismatic => 1,
    };
    check_range(&section, ["rad", "m"][unit])?;
    for (name, units) in LARGEST {
        if section.find(name).is_some() {
            section.number(name, Bound::Positive, units[unit])?;
        }
    }
    Ok(())
}

fn check_range(section: &Section, unit: &str) -> Result<(), RobotError> {
    let Some(entry) = section.find("position") else {
        return Ok(());
    };
    let [low, high] = entry.vector(unit)?;
    if low < high {
        return Ok(());
    }
    let expected = format!("the smaller end before the larger [{unit}]");
    Err(entry.invalid(expected, format!("[{low}, {high}]")))
}
