//! Every point where an effect may act, proved with a small effect made for it.
//!
//! The effects here are odometers: a state of their own whose rate is the speed they see. A run
//! must return the angle (a linear invariant, which Runge-Kutta methods keep exactly), and a
//! spring on that state must do what a known spring at the same place does.

use axisight_core::effects::{
    Acts, Arm, AxisTorque, BaseJoint, EffectInfo, Family, Joint, Kernel, Motor, Pair,
    PlantParameters, Scope, Spring,
};
use axisight_core::plant::{Plant, equilibrium};
use axisight_core::robot::{Motion, Place, RobotDescription};
use axisight_core::simulation::{Drive, Method};
use axisight_tests::{PRESET, Trace, effect, plant, relative, robot, sines, trace};
use std::sync::Arc;

const SAMPLES: usize = 200;

const fn info(scope: Scope, acts: Acts) -> EffectInfo {
    EffectInfo {
        name: "test",
        scope,
        acts,
        family: Family::Arm,
        inverse_dynamics: false,
        ..EffectInfo::PLAIN
    }
}

static MOTOR: EffectInfo = info(Scope::Axis, Acts::Motor);
static GEAR: EffectInfo = info(Scope::Axis, Acts::Transmission);
static JOINT: EffectInfo = info(Scope::Axis, Acts::Joint);
static SENSOR: EffectInfo = info(Scope::Axis, Acts::Sensor);
static PATH: EffectInfo = info(Scope::Axis, Acts::TorquePath);
static PAIR: EffectInfo = info(Scope::Axes, Acts::Motor);
static ARM: EffectInfo = info(Scope::Arm, Acts::Arm);
static BASE: EffectInfo = info(Scope::Arm, Acts::Base);

/// A spring of stiffness `k` on what an odometer counts, wherever it is put.
struct Odometer {
    k: f64,
}

impl Odometer {
    fn pull(&self, internal: &[f64]) -> f64 {
        -self.k * internal.first().copied().unwrap_or(0.0)
    }
}

impl Kernel<f64> for Odometer {
    fn n_internal(&self) -> usize {
        1
    }
    fn motor_torque(&self, motor: &Motor<'_, f64>) -> f64 {
        self.pull(motor.internal)
    }
    fn motor_rates(&self, motor: &Motor<'_, f64>, rates: &mut [f64]) {
        rates[0] = motor.speed;
    }
    fn gear_torque(&self, spring: &Spring<'_, f64>) -> f64 {
        -self.pull(spring.internal)
    }
    fn gear_rates(&self, spring: &Spring<'_, f64>, rates: &mut [f64]) {
        rates[0] = spring.rate;
    }
    fn joint_torque(&self, joint: &Joint<'_, f64>) -> f64 {
        self.pull(joint.internal)
    }
    fn joint_rates(&self, joint: &Joint<'_, f64>, rates: &mut [f64]) {
        rates[0] = joint.speed;
    }
    fn pair_torque(&self, pair: &Pair<'_, f64>) -> [AxisTorque<f64>; 2] {
        let motor = self.pull(pair.internal);
        let joint = 0.0;
        [
            AxisTorque { motor, joint },
            AxisTorque {
                motor: -motor,
                joint,
            },
        ]
    }
    fn pair_rates(&self, pair: &Pair<'_, f64>, rates: &mut [f64]) {
        rates[0] = pair.axes[0].motor_speed - pair.axes[1].motor_speed;
    }
    fn arm_force(&self, arm: &Arm<'_, f64>, force: &mut [f64]) {
        force[arm.angles.len() - 1] += self.pull(arm.internal);
    }
    fn arm_rates(&self, arm: &Arm<'_, f64>, rates: &mut [f64]) {
        rates[0] = arm.speeds[arm.speeds.len() - 1];
    }
}

/// The preset without gravity: it rests at its zero angles with relaxed springs.
fn weightless() -> RobotDescription {
    let mut robot = robot(PRESET);
    robot.gravity = [0.0; 3];
    robot.operating_point = vec![0.0; 3];
    robot
}

fn run(plant: &Plant<f64>, robot: &RobotDescription, method: Method) -> Trace<f64> {
    let reference = sines(SAMPLES, robot.n_axes(), robot.sample_time, 1.5);
    trace(plant, robot, Drive::Reference(&[&reference]), &[], method)
}

const RK4: Method = Method::RungeKutta4 { substeps: 2 };

fn with(
    robot: &RobotDescription,
    info: &'static EffectInfo,
    place: Place,
    kernel: impl Kernel<f64> + 'static,
) -> Plant<f64> {
    let kernels = vec![(info, place, Arc::new(kernel) as Arc<dyn Kernel<f64>>)];
    Plant::with_kernels(robot, &[], kernels).unwrap_or_else(|error| panic!("{error}"))
}

/// What an odometer must return from a state `[phi, q, ..]`.
type Seen<'a> = Box<dyn Fn(&[f64]) -> f64 + 'a>;

#[test]
fn odometers_return_the_angle_they_see() {
    let robot = weightless();
    let m = 3;
    let ratio = |axis: usize| {
        robot
            .driven()
            .nth(axis)
            .map_or(0.0, |(_, _, d)| d.gear_ratio)
    };
    let joint = |axis: usize| robot.driven().nth(axis).map_or(0, |(j, _, _)| j);
    let cases: Vec<(&'static EffectInfo, Place, Seen<'_>)> = vec![
        (&MOTOR, Place::Axis(1), Box::new(|x: &[f64]| x[1])),
        (
            &GEAR,
            Place::Axis(1),
            Box::new(|x: &[f64]| ratio(1) * x[1] - x[m + joint(1)]),
        ),
        (
            &JOINT,
            Place::Axis(2),
            Box::new(|x: &[f64]| x[m + joint(2)]),
        ),
        (&PAIR, Place::Axes(2, 0), Box::new(|x: &[f64]| x[2] - x[0])),
        (&ARM, Place::Arm, Box::new(|x: &[f64]| x[m + 6])),
    ];
    for (info, place, seen) in cases {
        let plant = with(&robot, info, place, Odometer { k: 0.0 });
        assert_eq!(plant.n_states(), 21, "{place}");
        for method in [RK4, Method::Nystrom4 { substeps: 1 }] {
            let out = run(&plant, &robot, method);
            let last = out.last();
            let wanted = seen(last);
            assert!(wanted.abs() > 1e-7, "{place}: it moves, {wanted:e}");
            // An invariant of every Runge-Kutta method; the Nystrom method takes own states
            // with the rates of its stages, of the same order.
            let tolerance = if method == RK4 { 1e-12 } else { 1e-6 };
            let error = (last[20] - wanted).abs() / wanted.abs();
            assert!(error < tolerance, "{place} {method:?}: {error:.1e}");
        }
    }
}

/// A spring on an odometer is the spring that is known.
#[test]
fn springs_on_odometers_are_known_springs() {
    let robot = weightless();
    let stiffness = robot.joints[0].compliance.map_or(0.0, |c| c.stiffness);
    let tip = robot.n_joints() - 1;
    let mut stiff_tip = robot.clone();
    if let Some(c) = stiff_tip.joints[tip].compliance.as_mut() {
        c.stiffness += 3e5;
    }
    let by_name =
        |name: &str, axis, p: &[f64]| plant::<f64>(&robot, &[effect(name, Some(axis), p)]);
    let cases = [
        (
            with(&robot, &JOINT, Place::Axis(1), Odometer { k: 4e4 }),
            by_name("cable_stiffness", 1, &[4e4, 0.0]),
        ),
        (
            with(
                &robot,
                &GEAR,
                Place::Axis(0),
                Odometer { k: 0.2 * stiffness },
            ),
            by_name("joint_stiffness", 0, &[0.2]),
        ),
        (
            with(&robot, &ARM, Place::Arm, Odometer { k: 3e5 }),
            plant(&stiff_tip, &[]),
        ),
    ];
    let base = run(&plant(&robot, &[]), &robot, RK4);
    for (mine, known) in &cases {
        let (mine, known) = (run(mine, &robot, RK4), run(known, &robot, RK4));
        let effect = relative(&base.command, &known.command);
        let error = relative(&mine.command, &known.command);
        // The same equations, summed in another order and amplified by the loop.
        assert!(
            effect > 1e-5 && error < 1e-6 * effect,
            "{error:.1e} of {effect:.1e}"
        );
    }
}

/// Equal and opposite torques between two motors do no work on their common motion.
#[test]
fn a_spring_between_two_motors_pulls_both() {
    let robot = weightless();
    let coupled = with(&robot, &PAIR, Place::Axes(0, 2), Odometer { k: 0.05 });
    let x: Vec<f64> = (0..21).map(|i| 1e-3 * f64::from(i % 7)).collect();
    let zeros = [0.0; 3];
    let rates = |x: &[f64], plant: &Plant<f64>| {
        let mut dx = vec![0.0; x.len()];
        plant.derivative(x, &zeros, &zeros, &mut plant.scratch(), &mut dx);
        dx
    };
    let free = rates(&x[..20], &plant(&robot, &[]));
    let bound = rates(&x, &coupled);
    let inertia = |axis: usize| {
        robot
            .driven()
            .nth(axis)
            .map_or(0.0, |(_, _, d)| d.motor_inertia)
    };
    let torque = |axis: usize| (bound[10 + axis] - free[10 + axis]) * inertia(axis);
    let pull = 0.05 * x[20];
    assert!((torque(0) + pull).abs() < 1e-6 * pull && (torque(2) - pull).abs() < 1e-6 * pull);
    assert_eq!(bound[..10], free[..10]);
    assert_eq!(bound[20].to_bits(), (x[10] - x[12]).to_bits());
    // What the log calls disturbance holds it too.
    let mut seen = [0.0; 3];
    coupled.motor_disturbances(&x, &zeros, &mut seen);
    assert!(
        (seen[0] + pull).abs() < 1e-12 && (seen[2] - pull).abs() < 1e-12,
        "{seen:?}"
    );
}

/// A spring the arm stands on, and the direction of gravity.
struct Base {
    joints: Vec<BaseJoint<f64>>,
    gravity: Option<[f64; 3]>,
}

impl Kernel<f64> for Base {
    fn prepare(&self, plant: &mut PlantParameters<'_, f64>) {
        if let Some(gravity) = self.gravity {
            plant.chain.gravity = gravity;
        }
    }
    fn base_joints(&self) -> Vec<BaseJoint<f64>> {
        self.joints.clone()
    }
}

/// The oracle is a robot whose file says the same: an elastic joint before the first one.
#[test]
fn springs_below_the_arm_are_elastic_joints() {
    let robot = robot(PRESET);
    let spring = BaseJoint {
        motion: Motion::Revolute,
        axis: [0.0, 1.0, 0.0],
        stiffness: 4e6,
        damping: 5e3,
        body: None,
    };
    let base = Base {
        joints: vec![spring],
        gravity: None,
    };
    let mine = with(&robot, &BASE, Place::Arm, base);
    let mut written = robot.clone();
    let mut joint = robot
        .joints
        .iter()
        .find(|j| j.drive.is_none())
        .cloned()
        .expect("elastic");
    joint.name = "base".to_owned();
    (joint.origin, joint.axis, joint.link) = ([0.0; 3], spring.axis, None);
    if let Some(c) = joint.compliance.as_mut() {
        (c.stiffness, c.damping) = (spring.stiffness, spring.damping);
    }
    written.joints.insert(0, joint);
    for (i, joint) in written.joints.iter_mut().enumerate() {
        joint.parent = i.checked_sub(1);
    }
    let known = plant::<f64>(&written, &[]);
    assert_eq!((mine.n_states(), mine.joint_slots()), (22, 4..11));
    let (got, want) = (run(&mine, &robot, RK4), run(&known, &written, RK4));
    assert_eq!(got.command, want.command);
    assert_eq!(got.states, want.states);
    let stiff = run(&plant(&robot, &[]), &robot, RK4);
    assert!(relative(&got.command, &stiff.command) > 1e-4);
}

#[test]
fn gravity_of_a_tilted_base() {
    let robot = robot(PRESET);
    let gravity = [0.5, -0.3, -9.79];
    let base = Base {
        joints: Vec::new(),
        gravity: Some(gravity),
    };
    let mine = with(&robot, &BASE, Place::Arm, base);
    let tilted = RobotDescription {
        gravity,
        ..robot.clone()
    };
    let (got, want) = (
        run(&mine, &robot, RK4),
        run(&plant(&tilted, &[]), &tilted, RK4),
    );
    assert_eq!(got.command, want.command);
}

/// The robot turned by the angles of the tilt, seen from itself: gravity turned back.
#[test]
fn a_tilted_base_is_gravity_from_elsewhere() {
    let robot = robot(PRESET);
    let (a, b): (f64, f64) = (0.05, -0.03);
    let down = robot.gravity[2];
    assert_eq!(robot.gravity[..2], [0.0, 0.0]);
    // R_y(-b) R_x(-a) of a vector that points down.
    let gravity = [
        -b.sin() * a.cos() * down,
        a.sin() * down,
        b.cos() * a.cos() * down,
    ];
    let tilt = effect("base_tilt", None, &[a, b]);
    let tilted = RobotDescription {
        gravity,
        ..robot.clone()
    };
    let (got, want) = (
        run(&plant(&robot, &[tilt]), &robot, RK4),
        run(&plant(&tilted, &[]), &tilted, RK4),
    );
    assert!(relative(&got.command, &want.command) < 1e-12);
}

/// A joint that counts its zero elsewhere, at rest: the arm is held as it is held where it stands.
#[test]
fn a_zero_offset_turns_the_arm_beyond() {
    let mut here = robot(PRESET);
    here.operating_point = vec![0.1, 0.3, -0.2];
    for (axis, offset) in [(1, 0.07), (2, -0.04)] {
        let mut there = here.clone();
        there.operating_point[axis] += offset;
        let moved = effect("joint_zero_offset", Some(axis), &[offset]);
        let (got, want) = (
            equilibrium(&plant::<f64>(&here, &[moved]), &here.operating_point).expect("rest"),
            equilibrium(&plant::<f64>(&there, &[]), &there.operating_point).expect("rest"),
        );
        for (got, want) in got.motor_torque.iter().zip(&want.motor_torque) {
            assert!((got - want).abs() < 1e-9, "axis {axis}: {got} {want}");
        }
        let plain = equilibrium(&plant::<f64>(&here, &[]), &here.operating_point).expect("rest");
        assert!((plain.motor_torque[axis] - got.motor_torque[axis]).abs() > 1e-2);
    }
}

/// A link of another length: the machine of a description with the next joint elsewhere.
#[test]
fn a_link_of_another_length_carries_the_next_axis_elsewhere() {
    let here = robot(PRESET);
    for (axis, d) in [(0, [0.03, -0.02, 0.05]), (1, [-0.04, 0.01, 0.02])] {
        let mut there = here.clone();
        let (place, ..) = here.driven().nth(axis + 1).expect("an axis");
        for (x, d) in there.joints[place].origin.iter_mut().zip(d) {
            *x += d;
        }
        let longer = effect("link_geometry", Some(axis), &d);
        let (got, want, plain) = (
            run(&plant(&here, &[longer]), &here, RK4),
            run(&plant(&there, &[]), &there, RK4),
            run(&plant(&here, &[]), &here, RK4),
        );
        assert!(relative(&got.command, &want.command) < 1e-11, "axis {axis}");
        assert!(
            relative(&plain.command, &want.command) > 1e-3,
            "axis {axis}"
        );
    }
}

/// A drive that reports a share of its torque moves the machine as any other does.
#[test]
fn a_reported_share_changes_the_report_alone() {
    let robot = robot(PRESET);
    let share = effect("torque_sensor_gain", Some(1), &[0.08]);
    let (got, want) = (
        run(&plant(&robot, &[share]), &robot, RK4),
        run(&plant(&robot, &[]), &robot, RK4),
    );
    assert_eq!(got.measured, want.measured);
    let n = robot.n_axes();
    for (i, (got, want)) in got.command.iter().zip(&want.command).enumerate() {
        let factor = if i % n == 1 { 1.08 } else { 1.0 };
        assert!((got - factor * want).abs() <= 1e-15 * want.abs(), "{i}");
    }
}

/// Torques that hold: effects of the arm and between axes belong to the equilibrium.
#[test]
fn rest_is_rest_with_effects_at_every_point() {
    struct Hold;
    impl Kernel<f64> for Hold {
        fn arm_force(&self, arm: &Arm<'_, f64>, force: &mut [f64]) {
            force[1] += 30.0 + 10.0 * arm.angles[1];
        }
        fn pair_torque(&self, pair: &Pair<'_, f64>) -> [AxisTorque<f64>; 2] {
            let joint = 20.0 * pair.axes[0].motor_angle.sin();
            let (a, b) = (0.1 * pair.axes[1].joint_angle, -0.2);
            [
                AxisTorque { motor: a, joint },
                AxisTorque {
                    motor: b,
                    joint: -joint,
                },
            ]
        }
    }
    let mut robot = robot(PRESET);
    robot.operating_point = vec![0.1, 0.3, -0.2];
    let kernels = |i: &'static EffectInfo, p| (i, p, Arc::new(Hold) as Arc<dyn Kernel<f64>>);
    let plant = Plant::with_kernels(
        &robot,
        &[],
        vec![kernels(&ARM, Place::Arm), kernels(&PAIR, Place::Axes(1, 2))],
    )
    .unwrap_or_else(|error| panic!("{error}"));
    let rest = axisight_core::plant::equilibrium(&plant, &robot.operating_point).expect("rest");
    let x = plant.state_at_rest(&rest);
    let mut dx = vec![0.0; x.len()];
    let torque = &rest.motor_torque;
    plant.derivative(&x, torque, torque, &mut plant.scratch(), &mut dx);
    // Rounding of the gear torque (2e-16 of 1e6 Nm/rad times 1 rad) over the motor inertia.
    assert!(dx.iter().all(|a| a.abs() < 1e-6), "{dx:?}");
}

#[test]
fn what_a_point_cannot_hold_is_refused() {
    let robot = robot(PRESET);
    let refusal =
        |info: &'static EffectInfo, place, kernel: Arc<dyn Kernel<f64>>| match Plant::with_kernels(
            &robot,
            &[],
            vec![(info, place, kernel)],
        ) {
            Ok(_) => "accepted".to_owned(),
            Err(error) => error.to_string(),
        };
    let odometer = || Arc::new(Odometer { k: 1.0 });
    for info in [&SENSOR, &PATH] {
        let message = refusal(info, Place::Axis(0), odometer());
        let wanted = "effect `test`: expected no states of its own where it acts, got 1";
        assert_eq!(message, wanted);
    }
    let spring = BaseJoint {
        motion: Motion::Revolute,
        axis: [1.0, 0.0, 0.0],
        stiffness: 1e6,
        damping: 0.0,
        body: None,
    };
    let base = |joints: usize| {
        Arc::new(Base {
            joints: vec![spring; joints],
            gravity: None,
        })
    };
    let message = refusal(&ARM, Place::Arm, base(2));
    assert!(
        message.contains("expected no joints below the first one"),
        "{message}"
    );
    let message = refusal(&BASE, Place::Arm, base(40));
    assert!(
        message.starts_with("joints: expected at most 32"),
        "{message}"
    );
    for place in [
        Place::Axes(1, 1),
        Place::Axes(0, 3),
        Place::Axis(0),
        Place::Arm,
    ] {
        let message = refusal(&PAIR, place, odometer());
        assert!(
            message.contains("expected two different axes from 1 to 3"),
            "{message}"
        );
    }
    assert!(refusal(&PAIR, Place::Axes(2, 0), odometer()) == "accepted");
}
