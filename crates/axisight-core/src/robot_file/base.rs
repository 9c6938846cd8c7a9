//! The base of a robot: fixed, or a floating link.

use super::document::Section;
use super::error::RobotError;
use super::reader::read_link;
use crate::robot::description::{Link, RobotDescription};

/// The link of a floating base; `None` for a fixed base, also without the table.
pub(super) fn read_base(root: &Section) -> Result<Option<Link>, RobotError> {
    let Some(entry) = root.find("base") else {
        return Ok(None);
    };
    let section = entry.section()?;
    section.only(&["kind", "link"])?;
    let kinds = [("fixed", false), ("floating", true)];
    let floats = section
        .require("kind", "\"fixed\" or \"floating\"")?
        .choice(&kinds)?;
    let link = section.find("link");
    match (floats, link) {
        (true, Some(link)) => Ok(Some(read_link(&link)?)),
        (true, None) => {
            let expected = "a [base.link] table with mass, com and inertia, as the base floats";
            Err(section.missing("link", expected))
        }
        (false, Some(link)) => Err(link.refuse("no link, as the base is fixed".to_owned())),
        (false, None) => Ok(None),
    }
}

/// Refuse joints of a floating robot whose parameters would have the names of those of the base.
pub(super) fn check_base(robot: &RobotDescription, sections: &[Section]) -> Result<(), RobotError> {
    let named_base = |joint: &crate::robot::Joint| {
        joint.name == "base" || crate::robot::BASE_NAMES.contains(&joint.name.as_str())
    };
    let found = robot.joints.iter().position(named_base);
    match found.and_then(|i| sections.get(i).zip(robot.joints.get(i))) {
        Some((section, joint)) if robot.floating_base.is_some() => {
            let name = section.require("name", "a string")?;
            let expected = "a name that the floating base does not have";
            Err(name.invalid(expected.to_owned(), format!("\"{}\"", joint.name)))
        }
        _ => Ok(()),
    }
}
