//! The robot reader: what it reads, and how it says no.

use axisight_core::robot::{Compliance, Controller, Drive, Link, Motion, RobotDescription};
use axisight_core::robot_file::{RobotError, read_robot};

const NOMINAL: &str = include_str!("../../../python/axisight/robot/presets/irb6600_like.toml");

/// A small robot with every kind of joint. Tests count its lines: `schema` is line 1.
const SMALL: &str = include_str!("../src/small_robot.toml");

/// Inertia of the only link.
const INERTIA: &str = "[38.0, 36.0, 7.0, 0.0, 0.0, 0.0]";

/// `SMALL` with the first `from` replaced by `to`.
fn small_with(from: &str, to: &str) -> String {
    assert!(SMALL.contains(from), "{from:?} is not in the small robot");
    SMALL.replacen(from, to, 1)
}

fn read(text: &str) -> RobotDescription {
    match read_robot(text) {
        Ok(robot) => robot,
        Err(error) => panic!("refused: {error}"),
    }
}

#[track_caller]
fn refused(text: &str, message: &str) {
    match read_robot(text) {
        Ok(_) => panic!("read, but expected the error: {message}"),
        Err(error) => assert_eq!(error.to_string(), message),
    }
}

/// One test per refusal: the small robot with `from` replaced by `to` gives the error.
macro_rules! refusals {
    ($($name:ident: $from:expr => $to:expr, $message:expr;)*) => {
        $(#[test]
        fn $name() {
            refused(&small_with($from, $to), $message);
        })*
    };
}

// What is read.

#[test]
fn nominal_robot_reads() {
    let robot = read(NOMINAL);
    assert_eq!(robot.name, "irb6600-like, 250 kg payload, 20 states");
    assert_eq!(robot.gravity, [0.0, 0.0, -9.81]);
    assert_eq!(robot.sample_time, 5.0e-4);
    assert_eq!((robot.n_joints(), robot.n_axes()), (7, 3));
    let driven: Vec<_> = robot
        .driven()
        .map(|(i, joint, _)| (i, joint.name.as_str()))
        .collect();
    assert_eq!(driven, [(0, "axis1"), (1, "axis2"), (4, "axis3")]);
    let axis3 = &robot.joints[4];
    assert_eq!(axis3.motion, Motion::Revolute);
    assert_eq!(axis3.origin, [0.0, 0.0, 1.075]);
    assert_eq!(axis3.axis, [0.0, 1.0, 0.0]);
    assert_eq!(axis3.link, None);
    let compliance = Compliance {
        stiffness: 1_631_000.0,
        damping: 424.7,
    };
    assert_eq!(axis3.compliance, Some(compliance));
    let drive = Drive {
        gear_ratio: 0.004761904761904762,
        motor_inertia: 0.0079,
        viscous_friction: 0.01,
    };
    assert_eq!(axis3.drive, Some(drive));
    let tip = Link {
        mass: 680.0,
        com: [0.7699, 0.2429, 0.1874],
        inertia: [37.26, 303.2, 303.4, -11.27, -3.611, -4.291],
    };
    assert_eq!(robot.joints[6].link, Some(tip));
    assert_eq!(robot.joints[6].drive, None);
    let controller = Controller::PiVelocity {
        kp: vec![7.039, 4.005, 3.403],
        ki: vec![178.6, 101.6, 86.33],
    };
    assert_eq!(robot.controller, controller);
    assert_eq!(robot.position_noise_std, 1.2e-5);
    assert_eq!(robot.operating_point, [0.0; 3]);
}

#[test]
fn small_robot_reads_integers_rigid_drives_and_negative_ratios() {
    let robot = read(SMALL);
    assert_eq!(robot.gravity, [0.0, 0.0, -9.81]);
    assert_eq!(robot.joints[0].compliance, None);
    let drive = Drive {
        gear_ratio: -0.01,
        motor_inertia: 0.0,
        viscous_friction: 0.01,
    };
    assert_eq!(robot.joints[0].drive, Some(drive));
    assert_eq!(robot.joints[2].link.map(|link| link.mass), Some(260.0));
    assert_eq!(robot.operating_point, [0.1, 0.2]);
}

#[test]
fn windows_line_ends_read_alike() {
    assert_eq!(read(&SMALL.replace('\n', "\r\n")), read(SMALL));
    let text = small_with("gravity = [0, 0", "gravity = [0, nan").replace('\n', "\r\n");
    refused(
        &text,
        "line 3: `gravity[2]`: expected a finite number [m/s^2], got nan",
    );
}

#[test]
fn optional_tables_have_defaults() {
    let (head, _) = SMALL
        .split_once("[controller]")
        .expect("small robot has a controller");
    let robot = read(head);
    assert_eq!(robot.controller, Controller::None);
    assert_eq!(robot.position_noise_std, 0.0);
    assert_eq!(robot.operating_point, [0.0, 0.0]);
}

#[test]
fn every_controller_kind_reads() {
    let with = |lines: &str| {
        let old = "kind = \"cascade\"\nkv = [10, 11]\nkp = [1.0, 1.5]\nki = [2.0, 2.5]\n";
        read(&small_with(old, lines)).controller
    };
    let (kv, kp, ki) = (vec![10.0, 11.0], vec![1.0, 1.5], vec![2.0, 2.5]);
    assert_eq!(
        read(SMALL).controller,
        Controller::Cascade {
            kv: kv.clone(),
            kp: kp.clone(),
            ki: ki.clone(),
            told_positions: None
        }
    );
    assert_eq!(
        with("kind = \"cascade\"\nkv = [10, 11]\nkp = [1.0, 1.5]\n"),
        Controller::Cascade {
            kv,
            kp: kp.clone(),
            ki: vec![0.0; 2],
            told_positions: None
        }
    );
    assert_eq!(
        with("kind = \"pi_velocity\"\nkp = [1.0, 1.5]\nki = [2.0, 2.5]\n"),
        Controller::PiVelocity { kp: kp.clone(), ki }
    );
    assert_eq!(
        with("kind = \"p_velocity\"\nkp = [1.0, 1.5]\n"),
        Controller::PVelocity { kp }
    );
    assert_eq!(with("kind = \"none\"\n"), Controller::None);
}

#[test]
fn a_cascade_of_targets_is_fed_rates_where_it_says_so() {
    let old = "kind = \"cascade\"";
    let two = small_with("axisight.robot/1", "axisight.robot/2");
    let kind = "kind = \"cascade_position\"";
    for (lines, fed) in [
        (kind.to_owned(), false),
        (format!("{kind}\nvelocity_feedforward = true"), true),
    ] {
        let controller = read(&two.replacen(old, &lines, 1)).controller;
        assert_eq!(
            controller,
            Controller::Cascade {
                kv: vec![10.0, 11.0],
                kp: vec![1.0, 1.5],
                ki: vec![2.0, 2.5],
                told_positions: Some(fed)
            }
        );
        assert!(controller.has_targets());
    }
    assert!(!read(SMALL).controller.has_targets());
}

#[test]
fn prismatic_joint_reads() {
    let robot = read(&small_with("\"revolute\"", "\"prismatic\""));
    assert_eq!(robot.joints[1].motion, Motion::Prismatic);
}

#[test]
fn rigid_drive_with_rotor_may_end_the_chain() {
    let tip = "\n[[joint]]\nname = \"tool\"\nkind = \"driven\"\norigin = [0, 0, 1]\n\
               axis = [0, 0, 1]\ndrive = { gear_ratio = 0.02, motor_inertia = 0.001, \
               viscous_friction = 0 }\n";
    let (head, _) = SMALL
        .split_once("[controller]")
        .expect("small robot has a controller");
    assert_eq!(read(&format!("{head}{tip}")).n_axes(), 3);
    // Neither without a rotor nor with the rotor behind a spring.
    let rotorless = tip.replace("0.001", "0");
    let compliant = tip.replace("drive =", "stiffness = 1e3\ndamping = 1\ndrive =");
    for massless in [rotorless, compliant] {
        refused(
            &format!("{head}{massless}"),
            "line 42: missing key `joint[4].link`; expected a mass at or beyond this joint, or \
             a rigid drive with motor_inertia > 0: else the inertia matrix is singular \
             (joint `tool`)",
        );
    }
}

#[test]
fn slightly_rounded_axis_reads() {
    let robot = read(&small_with("[0.0, 1.0, 0.0]", "[0.0, 0.6, 0.8000004]"));
    assert_eq!(robot.joints[1].axis, [0.0, 0.6, 0.8000004]);
}

// The four kinds of error, field by field.

#[test]
fn invalid_error_has_its_fields() {
    let error = RobotError::Invalid {
        key: "joint[3].link.mass".into(),
        line: 37,
        expected: "a positive number [kg]".into(),
        got: "-260 (joint `bend`)".into(),
    };
    assert_eq!(
        read_robot(&small_with("mass = 260", "mass = -260")),
        Err(error)
    );
}

#[test]
fn unknown_key_error_has_its_fields() {
    let error = RobotError::UnknownKey {
        key: "sensor.noise".into(),
        line: 48,
        expected: "position_noise_std".into(),
    };
    assert_eq!(
        read_robot(&small_with("position_noise_std", "noise")),
        Err(error)
    );
}

#[test]
fn missing_key_error_has_its_fields() {
    let error = RobotError::MissingKey {
        key: "sample_time".into(),
        line: 1,
        expected: "a positive number [s]".into(),
    };
    assert_eq!(
        read_robot(&small_with("sample_time = 5.0e-4\n", "")),
        Err(error)
    );
}

#[test]
fn syntax_error_has_its_fields() {
    let error = RobotError::Syntax {
        line: 8,
        message: "duplicate key (at `name`)".into(),
    };
    let text = small_with("kind = \"driven\"", "name = \"again\"");
    assert_eq!(read_robot(&text), Err(error));
}

// Single faults.

refusals! {
    // Unknown keys, at every level.

    unknown_root_key_is_refused: "gravity =" => "gravitiy =",
        "line 3: unknown key `gravitiy`; expected one of schema, name, gravity, sample_time, \
        joint, controller, sensor, operating_point";

    unknown_joint_key_is_refused: "damping = 500.0" => "dampnig = 500.0",
        "line 23: unknown key `joint[2].dampnig`; expected one of name, kind, motion, origin, \
        axis, stiffness, damping, link, drive (joint `shoulder`)";

    unknown_link_key_is_refused: "com =" => "cog =",
        "line 38: unknown key `joint[3].link.cog`; expected one of mass, com, inertia \
        (joint `bend`)";

    unknown_drive_key_is_refused: "gear_ratio =" => "ratio =",
        "line 12: unknown key `joint[1].drive.ratio`; expected one of gear_ratio, \
        motor_inertia, viscous_friction (joint `base`)";

    key_of_another_controller_is_refused: "\"cascade\"" => "\"pi_velocity\"",
        "line 43: unknown key `controller.kv`; expected one of kind, kp, ki";

    integral_gain_of_p_velocity_is_refused:
        "kind = \"cascade\"\nkv = [10, 11]"
        => "kind = \"p_velocity\"",
        "line 44: unknown key `controller.ki`; expected one of kind, kp";

    gains_without_controller_are_refused: "\"cascade\"" => "\"none\"",
        "line 43: unknown key `controller.kv`; expected one of kind";

    unknown_operating_point_key_is_refused: "joint_angle" => "angle",
        "line 51: unknown key `operating_point.angle`; expected one of joint_angle";

    // Wrong types and shapes.

    name_must_be_a_string: "\"small\"" => "3",
        "line 2: `name`: expected a string, got 3";

    number_must_be_a_number: "5.0e-4" => "\"fast\"",
        "line 4: `sample_time`: expected a positive number [s], got \"fast\"";

    vector_must_have_its_length: "[0, 0, -9.81]" => "[0, -9.81]",
        "line 3: `gravity`: expected an array of 3 numbers [m/s^2], got an array of 2";

    vector_must_be_an_array: "[0.1, 0.0, 0.5]" => "0.1",
        "line 20: `joint[2].origin`: expected an array of 3 numbers [m], got 0.1 \
        (joint `shoulder`)";

    entry_of_a_vector_is_named_with_its_own_line:
        INERTIA => "[38.0, 36.0, 7.0,\n  true, 0.0, 0.0]",
        "line 40: `joint[3].link.inertia[4]`: expected a finite number [kg m^2], got true \
        (joint `bend`)";

    inertia_must_have_six_entries: INERTIA => "[38.0, 36.0, 7.0]",
        "line 39: `joint[3].link.inertia`: expected an array of 6 numbers [kg m^2], \
        got an array of 3 (joint `bend`)";

    link_must_be_a_table:
        "[joint.link]\nmass = 260\ncom = [0.0, -0.2, 0.45]\ninertia = [38.0, 36.0, 7.0, 0.0, 0.0, 0.0]"
        => "link = 260",
        "line 36: `joint[3].link`: expected a table, got 260 (joint `bend`)";

    unknown_kind_is_refused: "\"elastic\"" => "\"passive\"",
        "line 31: `joint[3].kind`: expected \"driven\" or \"elastic\", got \"passive\" \
        (joint `bend`)";

    unknown_motion_is_refused: "\"revolute\"" => "\"helical\"",
        "line 19: `joint[2].motion`: expected \"revolute\" or \"prismatic\", got \"helical\" \
        (joint `shoulder`)";

    unknown_controller_is_refused: "\"cascade\"" => "\"pid\"",
        "line 42: `controller.kind`: expected \"pi_velocity\" or \"p_velocity\" or \"cascade\" \
        or \"none\", got \"pid\"";

    // Numbers that are not finite or not physical.

    infinity_is_refused: "1.0e6" => "inf",
        "line 22: `joint[2].stiffness`: expected a positive number [Nm/rad], got inf \
        (joint `shoulder`)";

    overflowing_number_is_refused: "260" => "1e999",
        "line 37: `joint[3].link.mass`: expected a positive number [kg], got 1e999 \
        (joint `bend`)";

    sample_time_must_be_positive: "5.0e-4" => "0.0",
        "line 4: `sample_time`: expected a positive number [s], got 0.0";

    mass_must_be_positive: "mass = 260" => "mass = 0",
        "line 37: `joint[3].link.mass`: expected a positive number [kg], got 0 (joint `bend`)";

    indefinite_inertia_is_refused:
        INERTIA => "[38.0, 36.0, 7.0, 0.0, 0.0, 16.0]",
        "line 39: `joint[3].link.inertia`: expected a positive definite inertia \
        (Ixx Iyy Izz Ixy Ixz Iyz), got [38.0, 36.0, 7.0, 0.0, 0.0, 16.0] (joint `bend`)";

    axis_must_be_a_unit_vector: "[0.0, 1.0, 0.0]" => "[0.0, 3.0, 4.0]",
        "line 21: `joint[2].axis`: expected a unit vector of 3 numbers, \
        got [0.0, 3.0, 4.0] of norm 5 (joint `shoulder`)";

    nearly_unit_axis_is_refused: "[0.0, 1.0, 0.0]" => "[0.0, 1.00001, 0.0]",
        "line 21: `joint[2].axis`: expected a unit vector of 3 numbers, \
        got [0.0, 1.00001, 0.0] of norm 1.00001 (joint `shoulder`)";

    stiffness_must_be_positive: "8.0e6" => "0.0",
        "line 34: `joint[3].stiffness`: expected a positive number [Nm/rad], got 0.0 \
        (joint `bend`)";

    damping_must_not_be_negative: "2000.0" => "-1.0",
        "line 35: `joint[3].damping`: expected a number not below zero [Nm s/rad], got -1.0 \
        (joint `bend`)";

    gear_ratio_must_not_be_zero: "-0.01" => "0",
        "line 12: `joint[1].drive.gear_ratio`: expected a number other than zero [rad/rad], \
        got 0 (joint `base`)";

    rigid_motor_inertia_must_not_be_negative: "motor_inertia = 0\n" => "motor_inertia = -1\n",
        "line 13: `joint[1].drive.motor_inertia`: expected a number not below zero [kg m^2], \
        got -1 (joint `base`)";

    compliant_motor_inertia_must_be_positive: "0.012\n" => "0.0\n",
        "line 26: `joint[2].drive.motor_inertia`: expected a positive number [kg m^2], got 0.0 \
        (joint `shoulder`)";

    friction_must_not_be_negative: "0.013" => "-0.013",
        "line 27: `joint[2].drive.viscous_friction`: expected a number not below zero \
        [Nm s/rad], got -0.013 (joint `shoulder`)";

    noise_must_not_be_negative: "1.0e-5" => "-1.0e-5",
        "line 48: `sensor.position_noise_std`: expected a number not below zero [rad], \
        got -1.0e-5";

    // Missing and contradictory parts.

    gravity_is_required: "gravity = [0, 0, -9.81]\n" => "",
        "line 1: missing key `gravity`; expected an array of 3 numbers [m/s^2]";
    name_is_required: "name = \"small\"\n" => "",
        "line 1: missing key `name`; expected a string";

    joint_name_is_required: "name = \"shoulder\"\n" => "",
        "line 16: missing key `joint[2].name`; expected a string";

    link_needs_all_of_its_keys: "inertia = [38.0, 36.0, 7.0, 0.0, 0.0, 0.0]\n" => "",
        "line 36: missing key `joint[3].link.inertia`; expected an array of 6 numbers \
        [kg m^2]: Ixx Iyy Izz Ixy Ixz Iyz (joint `bend`)";

    elastic_joint_needs_stiffness: "stiffness = 8.0e6\n" => "",
        "line 29: missing key `joint[3].stiffness`; expected a positive number [Nm/rad] \
        (joint `bend`)";

    elastic_joint_needs_damping: "damping = 2000.0\n" => "",
        "line 29: missing key `joint[3].damping`; expected a number not below zero [Nm s/rad] \
        (joint `bend`)";

    stiffness_alone_on_a_driven_joint_is_refused: "damping = 500.0\n" => "",
        "line 16: missing key `joint[2].damping`; expected it beside `stiffness`, or neither \
        for a rigid transmission (joint `shoulder`)";

    damping_alone_on_a_driven_joint_is_refused: "stiffness = 1.0e6\n" => "",
        "line 16: missing key `joint[2].stiffness`; expected it beside `damping`, or neither \
        for a rigid transmission (joint `shoulder`)";

    driven_joint_needs_a_drive:
        "[joint.drive]\ngear_ratio = 0.005\nmotor_inertia = 0.012\nviscous_friction = 0.013\n"
        => "",
        "line 16: missing key `joint[2].drive`; expected a [joint.drive] table, as the joint \
        is driven (joint `shoulder`)";

    elastic_joint_must_not_have_a_drive:
        "[joint.link]" => "[joint.drive]\ngear_ratio = 1\n[joint.link]",
        "line 36: `joint[3].drive`: expected no drive, as the joint is elastic, got a table \
        (joint `bend`)";

    joint_names_must_differ: "\"bend\"" => "\"base\"",
        "line 30: `joint[3].name`: expected a name no other joint has, \
        got \"base\", the name of joint[1]";

    kv_needs_one_gain_per_driven_joint: "[10, 11]" => "[10]",
        "line 43: `controller.kv`: expected an array of 2 numbers [1/s], one per driven joint, \
        got an array of 1";

    kp_needs_one_gain_per_driven_joint: "[1.0, 1.5]" => "[1, 2, 3]",
        "line 44: `controller.kp`: expected an array of 2 numbers [Nm s/rad], one per driven \
        joint, got an array of 3";

    ki_needs_one_gain_per_driven_joint: "[2.0, 2.5]" => "[]",
        "line 45: `controller.ki`: expected an array of 2 numbers [Nm/rad], one per driven \
        joint, got an array of 0";

    pi_velocity_needs_integral_gains:
        "kind = \"cascade\"\nkv = [10, 11]\nkp = [1.0, 1.5]\nki = [2.0, 2.5]"
        => "kind = \"pi_velocity\"\nkp = [1.0, 1.5]",
        "line 41: missing key `controller.ki`; expected an array of 2 numbers [Nm/rad], \
        one per driven joint";

    operating_point_needs_one_entry_per_driven_joint: "[0.1, 0.2]" => "[0.1, 0.2, 0.3]",
        "line 51: `operating_point.joint_angle`: expected an array of 2 numbers [rad], \
        one per driven joint, got an array of 3";

    last_joint_needs_a_mass:
        "[joint.link]\nmass = 260\ncom = [0.0, -0.2, 0.45]\ninertia = [38.0, 36.0, 7.0, 0.0, 0.0, 0.0]\n"
        => "",
        "line 29: missing key `joint[3].link`; expected a mass at or beyond this joint, or a \
        rigid drive with motor_inertia > 0: else the inertia matrix is singular (joint `bend`)";
}

// Faults that are not one replacement.

#[test]
fn truncated_text_is_refused_on_its_last_line() {
    refused(
        "schema = \"axisight.robot/1\"\nname = \"\"\"no end\n",
        "line 2: not valid TOML: invalid multi-line basic string, expected `\"`",
    );
}

#[test]
fn empty_text_is_refused() {
    refused(
        "",
        "line 1: missing key `schema`; expected \"axisight.robot/1\" or \"axisight.robot/2\"",
    );
}

#[test]
fn unknown_schema_is_refused_before_its_keys() {
    let text = small_with("robot/1\"", "robot/3\"\nnew_key = 1");
    refused(
        &text,
        "line 1: `schema`: expected \"axisight.robot/1\" or \"axisight.robot/2\", got \
         \"axisight.robot/3\"",
    );
}

#[test]
fn first_unknown_key_in_the_file_is_named() {
    let text = small_with("name = \"small\"", "mu = 1\nalpha = 2\nzeta = 3");
    let error = read_robot(&text).map_err(|error| error.to_string());
    assert!(error.is_err_and(|text| text.starts_with("line 2: unknown key `mu`;")));
}

#[test]
fn joint_must_be_an_array_of_tables() {
    refused(
        "schema = \"axisight.robot/1\"\nname = \"x\"\ngravity = [0, 0, 0]\n\
         sample_time = 1e-3\n[joint]\nname = \"a\"\n",
        "line 5: `joint`: expected an array of tables, [[joint]], got a table",
    );
}

#[test]
fn singular_inertia_is_refused_despite_rounding() {
    for singular in [
        "[0, 0, 0, 0, 0, 0]",
        "[0.1, 0.1, 0.1, 0.1, 0.0, 0.0]",
        "[0.1, 0.2, 0.5, 0.1, 0.1, 0.3]",
        "[1.0, 1.0, 0.0, 0.0, 0.0, 0.0]",
        "[-1.0, 1.0, 1.0, 0.0, 0.0, 0.0]",
    ] {
        let text = small_with(INERTIA, singular);
        let error = read_robot(&text).map_err(|error| error.to_string());
        let expected = "line 39: `joint[3].link.inertia`: expected a positive definite inertia";
        assert!(
            error.is_err_and(|text| text.starts_with(expected)),
            "{singular}"
        );
    }
}

#[test]
fn coupled_definite_inertia_reads() {
    let text = small_with(INERTIA, "[38.0, 36.0, 7.0, 30, -8, -4]");
    assert_eq!(
        read(&text).joints[2].link.map(|link| link.inertia[3]),
        Some(30.0)
    );
}

#[test]
fn robot_needs_joints() {
    refused(
        "schema = \"axisight.robot/1\"\nname = \"x\"\ngravity = [0, 0, 0]\nsample_time = 1e-3\n",
        "line 1: missing key `joint`; expected at least one [[joint]] table",
    );
}

/// Where the joints, the elastic joint `bend` and the controller begin in `SMALL`.
fn sections() -> (usize, usize, usize) {
    let find = |needle| SMALL.find(needle).expect("in the small robot");
    let bend = find("[[joint]]\nname = \"bend\"");
    (find("[[joint]]"), bend, find("[controller]"))
}

#[test]
fn chain_longer_than_the_compiled_sizes_is_refused() {
    let (first, bend, end) = sections();
    let elastic = SMALL[bend..end].repeat(33);
    refused(
        &format!("{}{elastic}", &SMALL[..first]),
        "line 6: `joint`: expected at most 32 joints, got 33",
    );
}

#[test]
fn robot_needs_a_driven_joint() {
    let (first, bend, _) = sections();
    refused(
        &format!("{}{}", &SMALL[..first], &SMALL[bend..]),
        "line 6: `joint`: expected at least one joint of kind \"driven\", got none",
    );
}
