//! Version 2 of the robot format: effects of the simulator and tolerances.

use axisight_core::plant::Plant;
use axisight_core::robot::{EffectSetting, Place};
use axisight_core::robot_file::read_robot;
use axisight_core::simulation::{Drive, Method};
use axisight_tests::{PRESET, effect, plant, robot, sines, trace};

/// The preset in version 2 with `tail` at its end.
fn second(tail: &str) -> String {
    let text = PRESET.replacen("axisight.robot/1", "axisight.robot/2", 1);
    format!("{text}\n{tail}\n")
}

fn refusal(tail: &str) -> String {
    match read_robot(&second(tail)) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

const FRICTION: &str = "[[effect]]\nname = \"coulomb_friction\"\naxis = 2\ncoulomb_nm = 0.41\n";

#[test]
fn effects_and_tolerances_are_read() {
    let tail = format!(
        "{FRICTION}[[effect]]\nname = \"payload\"\nmass_kg = 12\n[tolerances]\nstiffness = 0.02\n"
    );
    let robot = robot(&second(&tail));
    let expected = [
        EffectSetting {
            name: "coulomb_friction".to_owned(),
            place: Place::Axis(1),
            // What the file leaves out has its usual value.
            parameters: vec![0.41, 0.1, 0.0, 0.0],
        },
        EffectSetting {
            name: "payload".to_owned(),
            place: Place::Arm,
            parameters: vec![12.0, 1.0, 0.0, 0.2, 0.0],
        },
    ];
    assert_eq!(robot.effects, expected);
    assert_eq!(robot.tolerances, [("stiffness".to_owned(), 0.02)]);
}

#[test]
fn gains_have_a_tolerance_where_they_are_those_of_targets() {
    let servo = second("[tolerances]\nkp = 0.5\nmass = 0.1\n")
        .replacen("kind = \"pi_velocity\"", "kind = \"pd_position\"", 1)
        .replacen("ki = [", "kd = [", 1);
    let stated = [("mass".to_owned(), 0.1), ("kp".to_owned(), 0.5)];
    assert_eq!(robot(&servo).tolerances, stated);
    let message = refusal("[tolerances]\nkp = 0.5");
    assert!(message.contains("unknown key `tolerances.kp`"), "{message}");
}

#[test]
fn version_one_has_no_effects() {
    assert!(robot(PRESET).effects.is_empty());
    let error = read_robot(&format!("{PRESET}\n{FRICTION}")).map_err(|e| e.to_string());
    assert!(error.is_err_and(|text| text.contains("unknown key `effect`")));
}

/// What the file states acts like the same effect given; one given takes the place of the file's.
#[test]
fn effects_of_the_file_act_and_are_replaced() {
    let (bare, own) = (robot(PRESET), robot(&second(FRICTION)));
    let reference = sines(100, 3, bare.sample_time, 1.5);
    let run = |plant: &Plant<f64>| {
        let method = Method::RungeKutta4 { substeps: 1 };
        trace(plant, &bare, Drive::Reference(&[&reference]), &[], method).command
    };
    let friction = |level| effect("coulomb_friction", Some(1), &[level, 0.1, 0.0, 0.0]);
    let without = run(&plant(&bare, &[]));
    let stated = run(&plant(&own, &[]));
    assert_ne!(stated, without);
    assert_eq!(stated, run(&plant(&bare, &[friction(0.41)])));
    assert_eq!(
        run(&plant(&own, &[friction(0.7)])),
        run(&plant(&bare, &[friction(0.7)]))
    );
    let (emptied, all) = own.with_all_effects(&[friction(0.7)]);
    assert_eq!((emptied.effects.len(), all), (0, vec![friction(0.7)]));
}

#[test]
fn faults_are_named_with_their_line() {
    let first = PRESET.lines().count() + 2;
    let cases = [
        (
            "name = \"colour\"".to_owned(),
            1,
            "`effect[1].name`: expected one of viscous_friction, ",
        ),
        (
            "name = \"backlash\"".to_owned(),
            0,
            "missing key `effect[1].axis`; expected an axis from 1 to 3",
        ),
        (
            "name = \"backlash\"\naxis = 4".to_owned(),
            2,
            "`effect[1].axis`: expected an axis from 1 to 3, got 4",
        ),
        (
            "name = \"backlash\"\naxis = 1.5".to_owned(),
            2,
            "`effect[1].axis`: expected an axis from 1 to 3, got 1.5",
        ),
        (
            "name = \"payload\"\naxis = 1".to_owned(),
            2,
            "unknown key `effect[1].axis`; expected one of name, mass_kg",
        ),
        (
            "name = \"backlash\"\naxis = 1\nwidth = 1".to_owned(),
            3,
            "unknown key `effect[1].width`; expected one of name, axis, half_width_rad",
        ),
        (
            "name = \"backlash\"\naxis = 1\nhalf_width_rad = 1".to_owned(),
            3,
            "`effect[1].half_width_rad`: expected 0 to 0.05 [rad (joint side)], got 1",
        ),
        (
            format!("name = \"coulomb_friction\"\naxis = 2\n{FRICTION}"),
            4,
            "`effect[2].name`: expected an effect that no other [[effect]] states at the same \
             place, got `coulomb_friction@2`, as effect[1]",
        ),
    ];
    for (tail, line, wanted) in cases {
        let message = refusal(&format!("[[effect]]\n{tail}"));
        let start = format!("line {}: ", first + line);
        assert!(message.starts_with(&start), "{start} {message}");
        assert!(message.contains(wanted), "{message}");
    }
    let message = refusal("[tolerances]\nstiffness = -1");
    assert!(
        message.contains("`tolerances.stiffness`: expected a positive number"),
        "{message}"
    );
    let message = refusal("[tolerances]\ncolour = 1");
    assert!(
        message.contains("unknown key `tolerances.colour`"),
        "{message}"
    );
}

#[test]
fn a_rigid_gear_has_no_play() {
    let text = second("[[effect]]\nname = \"backlash\"\naxis = 1");
    let rigid: Vec<_> = text
        .lines()
        .scan(0, |seen, line| {
            let gone = *seen < 2 && (line.starts_with("stiffness") || line.starts_with("damping"));
            *seen += usize::from(gone);
            Some(if gone { "" } else { line })
        })
        .collect();
    let error = read_robot(&rigid.join("\n")).map_err(|e| e.to_string());
    let named = |text: String| text.contains("expected an axis with a compliant transmission");
    assert!(error.is_err_and(named));
}
