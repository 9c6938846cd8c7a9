//! Reads a robot from TOML text, schema `axisight.robot/1`.
//!
//! Files come from elsewhere, so nothing is guessed: whatever is unknown,
//! missing or unphysical is refused with its key, its line and what was
//! expected. The document is walked with spans rather than deserialized,
//! because a derived deserializer cannot say on which line a key is missing.

use super::description::{
    Bound, Compliance, Controller, Drive, Joint, Link, Motion, RobotDescription, check_unit,
    is_positive_definite,
};
use super::dynamics::MOST_JOINTS;
use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

const SCHEMA: &str = "axisight.robot/1";
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
const LINK_KEYS: &[&str] = &["mass", "com", "inertia"];
const DRIVE_KEYS: &[&str] = &["gear_ratio", "motor_inertia", "viscous_friction"];

/// Why a robot description is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// A value is of the wrong type or shape, or means nothing physical.
    #[error("line {line}: `{key}`: expected {expected}, got {got}")]
    Invalid {
        /// Path of the key; joints and array entries count from 1.
        key: String,
        /// Line of the value, from 1.
        line: usize,
        /// What the format asks for.
        expected: String,
        /// What the file says.
        got: String,
    },
    /// A key the schema does not have.
    #[error("line {line}: unknown key `{key}`; expected one of {expected}")]
    UnknownKey {
        /// Path of the key; joints count from 1.
        key: String,
        /// Line of the key, from 1.
        line: usize,
        /// Keys that may stand here.
        expected: String,
    },
    /// A required key is not there.
    #[error("line {line}: missing key `{key}`; expected {expected}")]
    MissingKey {
        /// Path of the key; joints count from 1.
        key: String,
        /// Line of the table that lacks it, from 1.
        line: usize,
        /// What the format asks for.
        expected: String,
    },
    /// The text is not TOML.
    #[error("line {line}: not valid TOML: {message}")]
    Syntax {
        /// Line of the fault, from 1.
        line: usize,
        /// What the TOML parser says.
        message: String,
    },
}

impl RobotError {
    /// Append the name of the joint: people know joints by name, not number.
    fn of_joint(mut self, name: &str) -> Self {
        let text = match &mut self {
            Self::Invalid { got, .. } => got,
            Self::UnknownKey { expected, .. } | Self::MissingKey { expected, .. } => expected,
            Self::Syntax { message, .. } => message,
        };
        text.push_str(" (joint `");
        text.push_str(name);
        text.push_str("`)");
        self
    }
}

/// Read a robot description from TOML text.
///
/// # Errors
/// [`RobotError`] for the first fault: text that is no TOML, another schema,
/// unknown or missing keys, wrong types or shapes, and values that are not
/// finite or not physical.
pub fn read_robot(text: &str) -> Result<RobotDescription, RobotError> {
    let document = DeTable::parse(text).map_err(|error| syntax_error(text, &error))?;
    let root = Section {
        text,
        entries: document.get_ref(),
        path: String::new(),
        start: 0,
    };
    // The schema first: the keys of another schema would all seem unknown.
    read_schema(&root)?;
    root.only(ROOT_KEYS)?;
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
        sample_time,
        joints: sections
            .iter()
            .map(read_named_joint)
            .collect::<Result<_, _>>()?,
        controller: Controller::None,
        position_noise_std: 0.0,
        operating_point: Vec::new(),
    };
    check_chain(&robot, &joint_list, &sections)?;
    let n_axes = robot.n_axes();
    robot.controller = read_controller(&root, n_axes)?;
    robot.position_noise_std = read_noise(&root)?;
    robot.operating_point = read_operating_point(&root, n_axes)?;
    Ok(robot)
}

fn syntax_error(text: &str, error: &toml::de::Error) -> RobotError {
    let span = error.span().unwrap_or_default();
    // At the end of the text the parser points past the last line.
    let line = line_at(text, span.start).min(text.lines().count().max(1));
    let mut message = error.message().to_owned();
    if let Some(piece) = text.get(span).filter(|piece| !piece.trim().is_empty()) {
        message = format!("{message} (at `{piece}`)");
    }
    RobotError::Syntax { line, message }
}

fn read_schema(root: &Section) -> Result<(), RobotError> {
    let expected = format!("\"{SCHEMA}\"");
    let schema = root.require("schema", &expected)?;
    match schema.value {
        DeValue::String(text) if text == SCHEMA => Ok(()),
        _ => Err(schema.refuse(expected)),
    }
}

/// Faults that no joint shows on its own.
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

fn read_named_joint(section: &Section) -> Result<Joint, RobotError> {
    let name = section.find("name").and_then(|entry| entry.value.as_str());
    read_joint(section).map_err(|error| match name {
        Some(name) => error.of_joint(name),
        None => error,
    })
}

fn read_joint(section: &Section) -> Result<Joint, RobotError> {
    section.only(JOINT_KEYS)?;
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
    Ok(Joint {
        name,
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
    // A driven joint without either has a rigid transmission; one without the
    // other is more likely a slip than a gear that does not damp.
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

fn read_link(entry: &Entry) -> Result<Link, RobotError> {
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
    // A motor on a compliant gear has an equation of motion of its own.
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
    None,
}

fn read_controller(root: &Section, n_axes: usize) -> Result<Controller, RobotError> {
    let Some(entry) = root.find("controller") else {
        return Ok(Controller::None);
    };
    let kinds = [
        ("pi_velocity", ControllerKind::PiVelocity),
        ("p_velocity", ControllerKind::PVelocity),
        ("cascade", ControllerKind::Cascade),
        ("none", ControllerKind::None),
    ];
    let section = entry.section()?;
    let kind = section.require("kind", &one_of(&kinds))?.choice(&kinds)?;
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
        ControllerKind::Cascade => {
            section.only(&["kind", "kv", "kp", "ki"])?;
            let kv = gains("kv", "1/s")?;
            let kp = kp()?;
            // Without `ki` the velocity loop is P.
            let ki = if section.find("ki").is_some() {
                ki()?
            } else {
                vec![0.0; n_axes]
            };
            Ok(Controller::Cascade { kv, kp, ki })
        }
        ControllerKind::None => {
            section.only(&["kind"])?;
            Ok(Controller::None)
        }
    }
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

/// A table of the document and where it stands.
struct Section<'a> {
    text: &'a str,
    entries: &'a DeTable<'a>,
    path: String,
    /// Byte at which the table starts.
    start: usize,
}

impl<'a> Section<'a> {
    fn key(&self, name: &str) -> String {
        if self.path.is_empty() {
            name.to_owned()
        } else {
            format!("{}.{name}", self.path)
        }
    }

    /// Refuse keys that are not `known`; the first in the file is named.
    fn only(&self, known: &[&str]) -> Result<(), RobotError> {
        let is_unknown = |key: &&Spanned<_>| !known.contains(&AsRef::<str>::as_ref(key.get_ref()));
        let unknown = self.entries.keys().filter(is_unknown);
        match unknown.min_by_key(|key| key.span().start) {
            None => Ok(()),
            Some(key) => Err(RobotError::UnknownKey {
                key: self.key(key.get_ref()),
                line: line_at(self.text, key.span().start),
                expected: known.join(", "),
            }),
        }
    }

    fn find(&self, name: &str) -> Option<Entry<'a>> {
        let value = self.entries.get(name)?;
        Some(Entry::new(self.text, value, self.key(name)))
    }

    fn missing(&self, name: &str, expected: &str) -> RobotError {
        RobotError::MissingKey {
            key: self.key(name),
            line: line_at(self.text, self.start),
            expected: expected.to_owned(),
        }
    }

    fn require(&self, name: &str, expected: &str) -> Result<Entry<'a>, RobotError> {
        self.find(name).ok_or_else(|| self.missing(name, expected))
    }

    fn number(&self, name: &str, bound: Bound, unit: &str) -> Result<f64, RobotError> {
        self.require(name, &bound.describe(unit))?
            .number(bound, unit)
    }

    /// One number per driven joint.
    fn per_axis(&self, name: &str, n_axes: usize, unit: &str) -> Result<Vec<f64>, RobotError> {
        let expected = format!("{}, one per driven joint", array_of(n_axes, unit));
        self.require(name, &expected)?
            .numbers(n_axes, unit, expected)
    }
}

/// A value of the document, its key and where it stands.
struct Entry<'a> {
    text: &'a str,
    value: &'a DeValue<'a>,
    key: String,
    /// Byte at which the value starts.
    start: usize,
}

impl<'a> Entry<'a> {
    fn new(text: &'a str, value: &'a Spanned<DeValue<'a>>, key: String) -> Self {
        Self {
            text,
            start: value.span().start,
            value: value.get_ref(),
            key,
        }
    }

    fn invalid(&self, expected: String, got: String) -> RobotError {
        RobotError::Invalid {
            key: self.key.clone(),
            line: line_at(self.text, self.start),
            expected,
            got,
        }
    }

    /// [`Entry::invalid`] with the value as the file has it.
    fn refuse(&self, expected: String) -> RobotError {
        self.invalid(expected, describe(self.value))
    }

    fn string(&self) -> Result<&'a str, RobotError> {
        self.value
            .as_str()
            .ok_or_else(|| self.refuse("a string".to_owned()))
    }

    fn choice<T: Copy>(&self, choices: &[(&str, T)]) -> Result<T, RobotError> {
        let text = self.value.as_str();
        let chosen = choices.iter().find(|(name, _)| text == Some(name));
        chosen
            .map(|(_, choice)| *choice)
            .ok_or_else(|| self.refuse(one_of(choices)))
    }

    fn number(&self, bound: Bound, unit: &str) -> Result<f64, RobotError> {
        let number = match self.value {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(integer) => integer_value(integer),
            _ => None,
        };
        number
            .filter(|x| bound.allows(*x))
            .ok_or_else(|| self.refuse(bound.describe(unit)))
    }

    fn vector<const N: usize>(&self, unit: &str) -> Result<[f64; N], RobotError> {
        let numbers = self.numbers(N, unit, array_of(N, unit))?;
        <[f64; N]>::try_from(numbers).map_err(|_| self.refuse(array_of(N, unit)))
    }

    fn numbers(&self, n: usize, unit: &str, expected: String) -> Result<Vec<f64>, RobotError> {
        if self.value.as_array().is_none_or(|items| items.len() != n) {
            return Err(self.refuse(expected));
        }
        self.items(expected)?
            .iter()
            .map(|item| item.number(Bound::Any, unit))
            .collect()
    }

    fn items(&self, expected: String) -> Result<Vec<Entry<'a>>, RobotError> {
        let items = self.value.as_array().ok_or_else(|| self.refuse(expected))?;
        let entry = |(i, value)| Entry::new(self.text, value, format!("{}[{}]", self.key, i + 1));
        Ok(items.iter().enumerate().map(entry).collect())
    }

    fn section(&self) -> Result<Section<'a>, RobotError> {
        let entries = self
            .value
            .as_table()
            .ok_or_else(|| self.refuse("a table".to_owned()))?;
        Ok(Section {
            text: self.text,
            entries,
            path: self.key.clone(),
            start: self.start,
        })
    }

    fn sections(&self) -> Result<Vec<Section<'a>>, RobotError> {
        let expected = format!("an array of tables, [[{}]]", self.key);
        self.items(expected)?.iter().map(Entry::section).collect()
    }
}

fn integer_value(integer: &DeInteger) -> Option<f64> {
    i128::from_str_radix(integer.as_str(), integer.radix())
        .ok()
        .map(|i| i as f64)
}

fn array_of(n: usize, unit: &str) -> String {
    let plural = if n == 1 { "" } else { "s" };
    format!("an array of {n} number{plural} [{unit}]")
}

fn one_of<T>(choices: &[(&str, T)]) -> String {
    let quoted: Vec<_> = choices
        .iter()
        .map(|(name, _)| format!("\"{name}\""))
        .collect();
    quoted.join(" or ")
}

fn describe(value: &DeValue) -> String {
    match value {
        DeValue::String(text) => format!("{text:?}"),
        DeValue::Integer(integer) => integer.to_string(),
        DeValue::Float(float) => float.to_string(),
        DeValue::Boolean(flag) => flag.to_string(),
        DeValue::Datetime(time) => time.to_string(),
        DeValue::Array(items) => format!("an array of {}", items.len()),
        DeValue::Table(_) => "a table".to_owned(),
    }
}

/// Line of a byte of the text, from 1.
fn line_at(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|b| *b == b'\n').count()
}
