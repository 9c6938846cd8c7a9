//! Reads a robot from TOML text, schemas `axisight.robot/1` and `axisight.robot/2`.
//!
//! Nothing in a file is guessed. Unknown, missing or unphysical values are refused with the key,
//! the line and the expected value.
//!
//! The reader walks the document with spans, because a derived deserializer cannot report the line
//! of a missing key.

use super::accelerometers::read_accelerometers;
use super::base::{check_base, read_base};
use super::document::{Entry, Section, line_at, one_of};
use super::effects::{read_effects, read_tolerances};
use super::error::RobotError;
use super::limits::check_limits;
use super::parents::read_parent;
use crate::robot::MOST_JOINTS;
use crate::robot::description::{
    Bound, Compliance, Controller, Drive, Joint, Known, Link, Motion, RobotDescription, Stepped,
    check_unit, is_positive_definite,
};
use std::sync::Arc;
use toml::de::DeTable;

/// Names of the schemas; version 1 comes first.
const SCHEMAS: [&str; 2] = ["axisight.robot/1", "axisight.robot/2"];
const AXIS_TOLERANCE: f64 = 1e-6;

const ROOT_KEYS: &[&str] = &[
    "schema",
    "name",
    "gravity",
    "sample_time",
    "joint",
    "controller",
    "sensor",
    "operating_point",
];
/// Keys of version 2 only.
// The table of the remainder is for the Python package, which checks it.
const NEWER_ROOT_KEYS: &[&str] = &["accelerometer", "base", "effect", "remainder", "tolerances"];
const JOINT_KEYS: &[&str] = &[
    "name",
    "kind",
    "motion",
    "origin",
    "axis",
    "stiffness",
    "damping",
    "link",
    "drive",
];
/// Keys of version 2 only.
const NEWER_JOINT_KEYS: &[&str] = &["limits", "parent"];
const LINK_KEYS: &[&str] = &["mass", "com", "inertia"];
const DRIVE_KEYS: &[&str] = &["gear_ratio", "motor_inertia", "viscous_friction"];

/// Read a robot description from TOML text.
///
/// # Errors
/// [`RobotError`] for the first error in the file: invalid TOML, an unknown schema, unknown or
/// missing keys, wrong types or shapes, and values that are not finite or not physical.
pub fn read_robot(text: &str) -> Result<RobotDescription, RobotError> {
    let document = DeTable::parse(text).map_err(|error| syntax_error(text, &error))?;
    let root = Section {
        text,
        entries: document.get_ref(),
        path: String::new(),
        start: 0,
    };
    // The schema comes first, because every key of another schema would count as unknown.
    let version = read_schema(&root)?;
    if version == 1 {
        root.only(ROOT_KEYS)?;
    } else {
        root.only(&[ROOT_KEYS, NEWER_ROOT_KEYS].concat())?;
    }
    let name = root.require("name", "a string")?.string()?.to_owned();
    let gravity = root
        .require("gravity", "an array of 3 numbers [m/s^2]")?
        .vector("m/s^2")?;
    let sample_time = root.number("sample_time", Bound::Positive, "s")?;
    let joint_list = root.require("joint", "at least one [[joint]] table")?;
    let sections = joint_list.sections()?;
    let mut robot = RobotDescription {
        name,
        gravity,
        floating_base: read_base(&root)?,
        sample_time,
        joints: read_joints(&sections, version)?,
        controller: Controller::None,
        position_noise_std: 0.0,
        operating_point: Vec::new(),
        accelerometers: Vec::new(),
        effects: Vec::new(),
        tolerances: Vec::new(),
    };
    check_chain(&robot, &joint_list, &sections)?;
    check_base(&robot, &sections)?;
    let n_axes = robot.n_axes();
    robot.controller = read_controller(&root, &robot, version)?;
    robot.position_noise_std = read_noise(&root)?;
    robot.operating_point = read_operating_point(&root, n_axes)?;
    robot.accelerometers = read_accelerometers(&root, &robot)?;
    robot.effects = read_effects(&root, &robot)?;
    robot.tolerances = read_tolerances(&root, &robot)?;
    Ok(robot)
}

fn syntax_error(text: &str, error: &toml::de::Error) -> RobotError {
    let span = error.span().unwrap_or_default();
    // At the end of the text, the parser points behind the last line.
    let line = line_at(text, span.start).min(text.lines().count().max(1));
    let mut message = error.message().to_owned();
    if let Some(piece) = text.get(span).filter(|piece| !piece.trim().is_empty()) {
        message = format!("{message} (at `{piece}`)");
    }
    RobotError::Syntax { line, message }
}

/// Version of the schema, counted from 1.
fn read_schema(root: &Section) -> Result<usize, RobotError> {
    let [first, second] = SCHEMAS;
    let expected = format!("\"{first}\" or \"{second}\"");
    let schema = root.require("schema", &expected)?;
    let known = |text: &str| SCHEMAS.iter().position(|s| *s == text);
    match schema.value.as_str().and_then(known) {
        Some(index) => Ok(index + 1),
        None => Err(schema.refuse(expected)),
    }
}

/// Checks of the robot that need more than one joint.
fn check_chain(
    robot: &RobotDescription,
    joint_list: &Entry,
    sections: &[Section],
) -> Result<(), RobotError> {
    let place = |i: usize| sections.get(i).zip(robot.joints.get(i));
    if robot.joints.len() > MOST_JOINTS {
        let expected = format!("at most {MOST_JOINTS} joints");
        return Err(joint_list.invalid(expected, robot.joints.len().to_string()));
    }
    if robot.n_axes() == 0 {
        let expected = "at least one joint of kind \"driven\"".to_owned();
        return Err(joint_list.invalid(expected, "none".to_owned()));
    }
    if let Some((earlier, later)) = robot.duplicate_name()
        && let Some((section, joint)) = place(later)
    {
        let got = format!("\"{}\", the name of joint[{}]", joint.name, earlier + 1);
        let name = section.require("name", "a string")?;
        return Err(name.invalid("a name no other joint has".to_owned(), got));
    }
    if let Some((section, joint)) = robot.joint_without_inertia().and_then(place) {
        let expected = "a mass at or beyond this joint, or a rigid drive with \
                        motor_inertia > 0: else the inertia matrix is singular";
        return Err(section.missing("link", expected).of_joint(&joint.name));
    }
    Ok(())
}

fn read_joints(sections: &[Section], version: usize) -> Result<Vec<Joint>, RobotError> {
    let mut joints = Vec::with_capacity(sections.len());
    for section in sections {
        joints.push(read_named_joint(section, &joints, version)?);
    }
    Ok(joints)
}

fn read_named_joint(
    section: &Section,
    before: &[Joint],
    version: usize,
) -> Result<Joint, RobotError> {
    let name = section.find("name").and_then(|entry| entry.value.as_str());
    read_joint(section, before, version).map_err(|error| match name {
        Some(name) => error.of_joint(name),
        None => error,
    })
}

fn read_joint(section: &Section, before: &[Joint], version: usize) -> Result<Joint, RobotError> {
    if version == 1 {
        section.only(JOINT_KEYS)?;
    } else {
        section.only(&[JOINT_KEYS, NEWER_JOINT_KEYS].concat())?;
    }
    let kinds = [("driven", true), ("elastic", false)];
    let motions = [
        ("revolute", Motion::Revolute),
        ("prismatic", Motion::Prismatic),
    ];
    let name = section.require("name", "a string")?.string()?.to_owned();
    let driven = section.require("kind", &one_of(&kinds))?.choice(&kinds)?;
    let motion = section
        .find("motion")
        .map(|entry| entry.choice(&motions))
        .transpose()?;
    let motion = motion.unwrap_or(Motion::Revolute);
    let origin = section
        .require("origin", "an array of 3 numbers [m]")?
        .vector("m")?;
    let axis = read_axis(section)?;
    let compliance = read_compliance(section, motion, driven)?;
    let link = section
        .find("link")
        .map(|entry| read_link(&entry))
        .transpose()?;
    let drive = if driven {
        Some(read_drive(section, motion, compliance.is_none())?)
    } else {
        refuse_drive(section)?;
        None
    };
    if let Some(limits) = section.find("limits") {
        check_limits(&limits, motion, driven)?;
    }
    Ok(Joint {
        name,
        parent: read_parent(section, before)?,
        motion,
        origin,
        axis,
        compliance,
        link,
        drive,
    })
}

fn read_axis(section: &Section) -> Result<[f64; 3], RobotError> {
    let expected = "a unit vector of 3 numbers";
    let entry = section.require("axis", expected)?;
    let axis = entry.vector("1")?;
    check_unit(&axis, AXIS_TOLERANCE).map_err(|norm| {
        let got = format!("{axis:?} of norm {norm}");
        entry.invalid(expected.to_owned(), got)
    })?;
    Ok(axis)
}

fn read_compliance(
    section: &Section,
    motion: Motion,
    driven: bool,
) -> Result<Option<Compliance>, RobotError> {
    let has = |name| section.find(name).is_some();
    // A driven joint without both keys has a rigid transmission. One key alone is more likely a
    // mistake than a gear without damping.
    if driven && !has("stiffness") && !has("damping") {
        return Ok(None);
    }
    for (name, other) in [("stiffness", "damping"), ("damping", "stiffness")] {
        if driven && !has(name) {
            let expected = format!("it beside `{other}`, or neither for a rigid transmission");
            return Err(section.missing(name, &expected));
        }
    }
    let (stiffness_unit, damping_unit) = match motion {
        Motion::Revolute => ("Nm/rad", "Nm s/rad"),
        Motion::Prismatic => ("N/m", "N s/m"),
    };
    Ok(Some(Compliance {
        stiffness: section.number("stiffness", Bound::Positive, stiffness_unit)?,
        damping: section.number("damping", Bound::NotNegative, damping_unit)?,
    }))
}

pub(super) fn read_link(entry: &Entry) -> Result<Link, RobotError> {
    let section = entry.section()?;
    section.only(LINK_KEYS)?;
    let mass = section.number("mass", Bound::Positive, "kg")?;
    let com = section
        .require("com", "an array of 3 numbers [m]")?
        .vector("m")?;
    let shape = "an array of 6 numbers [kg m^2]: Ixx Iyy Izz Ixy Ixz Iyz";
    let entry = section.require("inertia", shape)?;
    let inertia = entry.vector("kg m^2")?;
    if !is_positive_definite(&inertia) {
        let expected = "a positive definite inertia (Ixx Iyy Izz Ixy Ixz Iyz)".to_owned();
        return Err(entry.invalid(expected, format!("{inertia:?}")));
    }
    Ok(Link { mass, com, inertia })
}

fn read_drive(section: &Section, motion: Motion, rigid: bool) -> Result<Drive, RobotError> {
    let expected = "a [joint.drive] table, as the joint is driven";
    let section = section.require("drive", expected)?.section()?;
    section.only(DRIVE_KEYS)?;
    let ratio_unit = match motion {
        Motion::Revolute => "rad/rad",
        Motion::Prismatic => "m/rad",
    };
    // A motor on a compliant gear has its own equation of motion, so its inertia must be positive.
    let rotor = if rigid {
        Bound::NotNegative
    } else {
        Bound::Positive
    };
    Ok(Drive {
        gear_ratio: section.number("gear_ratio", Bound::NotZero, ratio_unit)?,
        motor_inertia: section.number("motor_inertia", rotor, "kg m^2")?,
        viscous_friction: section.number("viscous_friction", Bound::NotNegative, "Nm s/rad")?,
    })
}

fn refuse_drive(section: &Section) -> Result<(), RobotError> {
    section.find("drive").map_or(Ok(()), |drive| {
        Err(drive.refuse("no drive, as the joint is elastic".to_owned()))
    })
}

#[derive(Clone, Copy)]
enum ControllerKind {
    PiVelocity,
    PVelocity,
    Cascade,
    PdPosition,
    CascadePosition,
    None,
}

fn read_controller(
    root: &Section,
    robot: &RobotDescription,
    version: usize,
) -> Result<Controller, RobotError> {
    let n_axes = robot.n_axes();
    let Some(entry) = root.find("controller") else {
        return Ok(Controller::None);
    };
    let kinds = [
        ("pi_velocity", ControllerKind::PiVelocity),
        ("p_velocity", ControllerKind::PVelocity),
        ("cascade", ControllerKind::Cascade),
        ("none", ControllerKind::None),
        ("pd_position", ControllerKind::PdPosition),
        ("cascade_position", ControllerKind::CascadePosition),
    ];
    // Version 1 does not have the last two kinds.
    let kinds = &kinds[..if version == 1 {
        kinds.len() - 2
    } else {
        kinds.len()
    }];
    let section = entry.section()?;
    let kind = section.require("kind", &one_of(kinds))?.choice(kinds)?;
    let gains = |name, unit| section.per_axis(name, n_axes, unit);
    let kp = || gains("kp", "Nm s/rad");
    let ki = || gains("ki", "Nm/rad");
    match kind {
        ControllerKind::PiVelocity => {
            section.only(&["kind", "kp", "ki"])?;
            Ok(Controller::PiVelocity {
                kp: kp()?,
                ki: ki()?,
            })
        }
        ControllerKind::PVelocity => {
            section.only(&["kind", "kp"])?;
            Ok(Controller::PVelocity { kp: kp()? })
        }
        ControllerKind::Cascade => read_cascade(&section, n_axes, false),
        ControllerKind::CascadePosition => read_cascade(&section, n_axes, true),
        ControllerKind::PdPosition => {
            let switches = [
                "velocity_feedforward",
                "gravity_compensation",
                "computed_torque",
                "continuous",
            ];
            let steps = ["step", "step_inertia"];
            section.only(&[&["kind", "kp", "kd"][..], &switches, &steps].concat())?;
            // One key without the other describes only half of a simulator's step.
            let stepped = if steps.iter().any(|key| section.find(key).is_some()) {
                Some(Stepped {
                    step: section.number(steps[0], Bound::Positive, "s")?,
                    inertia: section.per_axis(steps[1], n_axes, "kg m^2")?,
                })
            } else {
                None
            };
            let held = section.flag(switches[1], false)?;
            let moved = section.flag(switches[2], false)?;
            if held && moved {
                let both = "one of gravity_compensation and computed_torque, which has it";
                return Err(entry.refuse(both.to_owned()));
            }
            let own = || Arc::new(robot.clone());
            let known = match (held, moved) {
                (_, true) => Some(Known::Dynamics(own())),
                (true, _) => Some(Known::Gravity(own())),
                _ => None,
            };
            let [of_angle, of_speed] = if moved {
                ["1/s^2", "1/s"]
            } else {
                ["Nm/rad", "Nm s/rad"]
            };
            Ok(Controller::PdPosition {
                kp: gains("kp", of_angle)?,
                kd: gains("kd", of_speed)?,
                feeds_speed: section.flag(switches[0], true)?,
                continuous: section.flag(switches[3], false)?,
                known,
                stepped,
            })
        }
        ControllerKind::None => {
            section.only(&["kind"])?;
            Ok(Controller::None)
        }
    }
}

/// A cascade with references of positions or speeds. Without `ki` its velocity loop is a P loop.
fn read_cascade(
    section: &Section,
    n_axes: usize,
    of_positions: bool,
) -> Result<Controller, RobotError> {
    let keys = ["kind", "kv", "kp", "ki", "velocity_feedforward"];
    section.only(
        &keys[..if of_positions {
            keys.len()
        } else {
            keys.len() - 1
        }],
    )?;
    let told_positions = if of_positions {
        Some(section.flag(keys[4], false)?)
    } else {
        None
    };
    Ok(Controller::Cascade {
        kv: section.per_axis("kv", n_axes, "1/s")?,
        kp: section.per_axis("kp", n_axes, "Nm s/rad")?,
        ki: if section.find("ki").is_some() {
            section.per_axis("ki", n_axes, "Nm/rad")?
        } else {
            vec![0.0; n_axes]
        },
        told_positions,
    })
}

fn read_noise(root: &Section) -> Result<f64, RobotError> {
    let Some(entry) = root.find("sensor") else {
        return Ok(0.0);
    };
    let section = entry.section()?;
    section.only(&["position_noise_std"])?;
    section.number("position_noise_std", Bound::NotNegative, "rad")
}

fn read_operating_point(root: &Section, n_axes: usize) -> Result<Vec<f64>, RobotError> {
    let Some(entry) = root.find("operating_point") else {
        return Ok(vec![0.0; n_axes]);
    };
    let section = entry.section()?;
    section.only(&["joint_angle"])?;
    section.per_axis("joint_angle", n_axes, "rad")
}
