//! Integrators, ends of a run, and the torque path against closed forms.

use axisight_core::plant::assemble;
use axisight_core::robot::{Controller, EffectSetting, RobotDescription};
use axisight_core::simulation::{Drive, Method, Run, SimulationError, Status, Stepper, simulate};
use axisight_tests::{ARM, PRESET, ROTOR, effect, plant, relative, robot, sines, trace};
use std::sync::atomic::AtomicBool;

/// State at `time` of a fall from rest with `per_second` samples of one step each.
fn fall(robot: &RobotDescription, per_second: usize, method: Method) -> Vec<f64> {
    let mut robot = robot.clone();
    robot.sample_time = 1.0 / per_second as f64;
    let n = per_second / 20 + 1;
    let torque = vec![0.0; n * robot.n_axes()];
    let plant = plant::<f64>(&robot, &[]);
    let run = trace(&plant, &robot, Drive::Torque(&[&torque]), &[], method);
    run.last().to_vec()
}

/// Slope of error over step size between successive halvings, the finest pair.
fn observed_order(robot: &RobotDescription, method: Method, rates: [usize; 3]) -> f64 {
    let exact = fall(robot, 64_000, Method::RungeKutta4 { substeps: 4 });
    let error = |rate: usize| relative(&fall(robot, rate, method), &exact);
    let (coarse, fine) = (error(rates[1]), error(rates[2]));
    // The reference and rounding must stand far below the finest error.
    assert!(
        fine > 1e-12 && error(rates[0]) > coarse,
        "{coarse:.1e} {fine:.1e}"
    );
    (coarse / fine).log2() / (rates[2] as f64 / rates[1] as f64).log2()
}

/// The next term of the error expansion is smaller by w h = 0.1 to 0.2 at these steps, which
/// moves the observed order by about as much.
#[test]
fn fixed_steps_converge_with_order_four() {
    for method in [
        Method::RungeKutta4 { substeps: 1 },
        Method::Nystrom4 { substeps: 1 },
    ] {
        for text in [PRESET, ARM] {
            let robot = robot(text);
            let order = observed_order(&robot, method, [2000, 4000, 8000]);
            assert!(
                (order - 4.0).abs() < 0.3,
                "{method:?} {}: {order}",
                robot.name
            );
        }
    }
}

/// What depends on the angles alone may be kept: the same bits, gears compliant or rigid.
#[test]
fn derivative_in_place_is_the_derivative_at_the_same_angles() {
    for text in [PRESET, ARM, ROTOR] {
        let robot = robot(text);
        let plant = plant::<f64>(&robot, &[]);
        let (n, n_axes) = (plant.n_states(), robot.n_axes());
        let at = |seed: usize| -> Vec<f64> {
            let value = |i: usize| ((7 * i + 13 * seed) as f64).sin();
            (0..n).map(value).collect()
        };
        let (before, mut after) = (at(1), at(2));
        after[..plant.n_angles()].copy_from_slice(&before[..plant.n_angles()]);
        let torque = |u: f64| vec![u; n_axes];
        let derivative = |x: &[f64], u: f64, scratch: &mut _| {
            let mut dx = vec![0.0; n];
            plant.derivative(x, &torque(u), &torque(u), scratch, &mut dx);
            dx
        };
        let mut scratch = plant.scratch();
        derivative(&before, 1.0, &mut scratch);
        let mut kept = vec![0.0; n];
        plant.derivative_in_place(&after, &torque(2.0), &torque(2.0), &mut scratch, &mut kept);
        assert_eq!(
            kept,
            derivative(&after, 2.0, &mut plant.scratch()),
            "{}",
            robot.name
        );
        assert_ne!(
            kept,
            derivative(&before, 1.0, &mut scratch),
            "{}",
            robot.name
        );
    }
}

/// A tolerance no step can miss leaves one step per sample.
#[test]
fn dormand_prince_converges_with_order_five() {
    for text in [PRESET, ARM] {
        let robot = robot(text);
        let method = Method::DormandPrince { tolerance: 1e9 };
        let order = observed_order(&robot, method, [500, 1000, 2000]);
        assert!((order - 5.0).abs() < 0.3, "{}: {order}", robot.name);
    }
}

/// In the closed loop sub-steps converge too: the torque is held, so the order stays.
#[test]
fn substeps_converge_in_the_closed_loop() {
    let robot = robot(PRESET);
    let reference = sines(100, 3, robot.sample_time, 1.0);
    let at = |substeps: usize| {
        let plant = plant::<f64>(&robot, &[]);
        let method = Method::RungeKutta4 { substeps };
        trace(&plant, &robot, Drive::Reference(&[&reference]), &[], method).command
    };
    let exact = at(64);
    let (coarse, fine) = (relative(&at(2), &exact), relative(&at(4), &exact));
    let order = (coarse / fine).log2();
    assert!((order - 4.0).abs() < 0.3, "{order} {coarse:.1e}");
}

/// The local error is held to the tolerance in each of 200 steps, and the damped loop
/// forgets, so the error of the run stays within a few hundred tolerances.
#[test]
fn tolerance_bounds_the_error_and_costs_effort() {
    let robot = robot(PRESET);
    let reference = sines(200, 3, robot.sample_time, 1.0);
    let at = |method: Method| {
        trace(
            &plant::<f64>(&robot, &[]),
            &robot,
            Drive::Reference(&[&reference]),
            &[],
            method,
        )
    };
    let exact = at(Method::RungeKutta4 { substeps: 64 });
    let mut effort = 0;
    for tolerance in [1e-5, 1e-7, 1e-9] {
        let run = at(Method::DormandPrince { tolerance });
        let error = relative(&run.measured, &exact.measured);
        assert!(error < 200.0 * tolerance, "{tolerance:.0e}: {error:.1e}");
        assert!(run.evaluations >= effort, "effort fell");
        effort = run.evaluations;
    }
    assert!(effort > 7 * 200);
}

#[test]
fn unstable_gain_diverges() {
    let mut robot = robot(PRESET);
    robot.controller = Controller::PVelocity {
        kp: vec![4000.0, 4.0, 3.4],
    };
    let reference = sines(4000, 3, robot.sample_time, 1.0);
    let method = Method::RungeKutta4 { substeps: 1 };
    let run = trace(
        &plant::<f64>(&robot, &[]),
        &robot,
        Drive::Reference(&[&reference]),
        &[],
        method,
    );
    match run.status {
        Status::Diverged(k) => assert_eq!(run.states.len(), k + 1),
        other => panic!("expected divergence, got {other:?}"),
    }
}

#[test]
fn absurd_stiffness_collapses_the_step() {
    for stiffness in [1e18, 1e24, 1e30] {
        let mut robot = robot(ARM);
        robot.joints[0]
            .compliance
            .as_mut()
            .expect("spring")
            .stiffness = stiffness;
        let reference = sines(20, 1, robot.sample_time, 1.0);
        let method = Method::DormandPrince { tolerance: 1e-9 };
        let run = trace(
            &plant::<f64>(&robot, &[]),
            &robot,
            Drive::Reference(&[&reference]),
            &[],
            method,
        );
        assert!(
            matches!(run.status, Status::StepSizeCollapsed(_)),
            "{stiffness:e}: {:?}",
            run.status
        );
    }
}

fn run_of<'a>(
    robot: &'a RobotDescription,
    start: &'a [&'a [f64]],
    drive: Drive<'a>,
    noise: &'a [&'a [f64]],
) -> Run<'a> {
    Run {
        controller: &robot.controller,
        sample_time: robot.sample_time,
        start,
        drive,
        noise,
        resolution: 0.0,
        disturbances: true,
        accelerometers: false,
        method: Method::default(),
        cancel: None,
    }
}

fn outcome(robot: &RobotDescription, run: &Run<'_>) -> Result<Status, SimulationError> {
    let plant = plant::<f64>(robot, &[]);
    simulate(&plant, run, &mut Stepper::new(&plant), &mut |_| {})
}

#[test]
fn cancelled_run_stops_before_its_sample() {
    let robot = robot(ARM);
    let flag = AtomicBool::new(true);
    let start = [&robot.operating_point[..]];
    let mut run = run_of(&robot, &start, Drive::Reference(&[&[0.0; 5]]), &[]);
    run.cancel = Some(&flag);
    assert_eq!(outcome(&robot, &run), Ok(Status::Cancelled(0)));
}

#[test]
fn misuse_is_refused_by_name() {
    let robot = robot(PRESET);
    let good = [0.0; 6];
    let bad = [0.0, 0.0, 0.0, 0.0, f64::NAN, 0.0];
    let none = RobotDescription {
        controller: Controller::None,
        ..robot.clone()
    };
    let cases: [(&RobotDescription, Drive<'_>, &[&[f64]], &str); 6] = [
        (
            &robot,
            Drive::Reference(&[&good[..5]]),
            &[],
            "velocity_ref: expected samples of 3 axes, got 5 numbers",
        ),
        (
            &robot,
            Drive::Torque(&[&bad]),
            &[],
            "torque: expected finite numbers, got NaN at sample 1",
        ),
        (
            &robot,
            Drive::Torque(&[]),
            &[],
            "torque: expected 1 to 1 runs, got 0",
        ),
        (
            &robot,
            Drive::Torque(&[&good, &good]),
            &[],
            "torque: expected 1 to 1 runs, got 2",
        ),
        (
            &robot,
            Drive::Reference(&[&good]),
            &[&bad],
            "noise: expected finite numbers, got NaN at sample 1",
        ),
        (
            &none,
            Drive::Reference(&[&good]),
            &[],
            "controller: expected one for a run driven by velocity references, got kind `none`",
        ),
    ];
    for (robot, drive, noise, message) in cases {
        let start = [&robot.operating_point[..]];
        let error = outcome(robot, &run_of(robot, &start, drive, noise)).expect_err(message);
        assert_eq!(error.to_string(), message);
    }
    let lanes: [&[f64]; 1] = [&good];
    let start = [&robot.operating_point[..]];
    let mut run = run_of(&robot, &start, Drive::Reference(&lanes), &[]);
    run.sample_time = 0.0;
    let error = outcome(&robot, &run)
        .expect_err("zero sample time")
        .to_string();
    assert_eq!(
        error,
        "sample_time: expected a positive time in seconds, got 0"
    );
    run.sample_time = 1e-3;
    run.start = &[&[0.0]];
    let error = outcome(&robot, &run).expect_err("short start").to_string();
    assert_eq!(error, "start: expected 3 driven joint angles, got 1");
    run.start = &[&[0.0; 3], &[0.0; 3]];
    let error = outcome(&robot, &run).expect_err("two starts").to_string();
    assert_eq!(
        error,
        "start: expected one set of angles, or one for each of 1 runs, got 2"
    );
}

/// A delay of whole samples is the torque list shifted, after the torque at rest. The sample
/// number `n T / T` rounds by 1e-16 samples; the springs amplify that by below 1e4.
#[test]
fn whole_sample_delay_shifts_the_torque() {
    let robot = robot(PRESET);
    let rest =
        axisight_core::plant::equilibrium(&plant::<f64>(&robot, &[]), &[0.0; 3]).expect("rest");
    let mut torque = sines(60, 3, robot.sample_time, 2.0);
    for (i, u) in torque.iter_mut().enumerate() {
        *u += rest.motor_torque[i % 3] + 0.3;
    }
    for samples in [1_usize, 3, 7] {
        for substeps in [1, 3] {
            let method = Method::RungeKutta4 { substeps };
            let delay = samples as f64 * robot.sample_time;
            let settings: Vec<_> = (0..3)
                .map(|a| effect("input_delay", Some(a), &[delay]))
                .collect();
            let late = trace(
                &plant::<f64>(&robot, &settings),
                &robot,
                Drive::Torque(&[&torque]),
                &[],
                method,
            );
            let mut shifted = rest.motor_torque.repeat(samples);
            shifted.extend(&torque[..torque.len() - 3 * samples]);
            let base = trace(
                &plant::<f64>(&robot, &[]),
                &robot,
                Drive::Torque(&[&shifted]),
                &[],
                method,
            );
            let error = relative(&late.measured, &base.measured);
            assert!(error < 1e-12, "{samples} {substeps}: {error:.1e}");
        }
    }
}

/// Angle of `J phi'' = tau(t)` at each sample, `tau` the held torque list through a delay
/// and then a lag (none if zero), integrated piece by piece in closed form.
fn closed_form(torque: &[f64], t: f64, inertia: f64, delay: f64, lag: f64) -> Vec<f64> {
    let (mut angle, mut speed, mut lagged) = (0.0, 0.0, 0.0);
    let whole = (delay / t).floor();
    let switch = delay - whole * t;
    let held = |k: usize, back: f64| {
        let index = k as f64 - back;
        if index < 0.0 {
            0.0
        } else {
            torque[index as usize]
        }
    };
    let mut out = Vec::new();
    for k in 0..torque.len() {
        out.push(angle);
        for (u, h) in [(held(k, whole + 1.0), switch), (held(k, whole), t - switch)] {
            if h <= 0.0 {
                continue;
            }
            // Excess over u decays; its integral and double integral in closed form.
            let excess = if lag > 0.0 { lagged - u } else { 0.0 };
            let gone = if lag > 0.0 { -(-h / lag).exp_m1() } else { 0.0 };
            angle += h * speed + (u * h * h / 2.0 + excess * lag * (h - lag * gone)) / inertia;
            speed += (u * h + excess * lag * gone) / inertia;
            lagged = u + excess * (1.0 - gone);
        }
    }
    out
}

/// For a rigid inertia the straight-line torque with the right two moments is exact, so only
/// rounding is left: 1e-16 per sample and sub-step, summed twice over 40 samples.
#[test]
fn delay_and_lag_are_exact_on_a_rigid_inertia() {
    let robot = robot(ROTOR);
    let inertia = 0.25 + 3.0 * 0.5 * 0.5;
    let torque = axisight_tests::Random(9).vector(40, 2.0);
    let t = robot.sample_time;
    for (delay, lag) in [
        (0.4e-3, 0.0),
        (2.37e-3, 0.0),
        (0.0, 0.7e-3),
        (0.0, 20e-3),
        (0.0, 0.02e-3),
        (1.6e-3, 0.9e-3),
    ] {
        for substeps in [1, 2, 5] {
            let mut settings = Vec::new();
            if delay > 0.0 {
                settings.push(effect("input_delay", Some(0), &[delay]));
            }
            if lag > 0.0 {
                settings.push(effect("actuator_bandwidth", Some(0), &[lag]));
            }
            for method in [
                Method::RungeKutta4 { substeps },
                Method::DormandPrince { tolerance: 1e-6 },
            ] {
                let run = trace(
                    &plant::<f64>(&robot, &settings),
                    &robot,
                    Drive::Torque(&[&torque]),
                    &[],
                    method,
                );
                // A lag of T_c is made T_c + 1e-12 s by the core: 1e-12 / 2e-5 = 5e-8 at worst.
                let tolerance = if lag > 0.0 {
                    1e-13 + 2e-12 / lag
                } else {
                    1e-13
                };
                let error = relative(&run.measured, &closed_form(&torque, t, inertia, delay, lag));
                assert!(error < tolerance, "{delay} {lag} {method:?}: {error:.1e}");
            }
        }
    }
}

/// The same for a loop of second order (time constant, damping), integrated by Runge-Kutta steps a
/// two-hundredth of a piece long: of their fourth power, 1e-9, is left.
fn followed(torque: &[f64], t: f64, inertia: f64, delay: f64, (tau, d): (f64, f64)) -> Vec<f64> {
    let rate = |x: [f64; 4], u: f64| {
        let bend = (u - x[2] - 2.0 * d * tau * x[3]) / (tau * tau);
        [x[1], x[2] / inertia, x[3], bend]
    };
    let along = |x: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn(|i| x[i] + h * k[i]);
    // Angle, speed, delivered torque and its rate.
    let mut x = [0.0; 4];
    let mut out = Vec::new();
    for k in 0..torque.len() {
        out.push(x[0]);
        let before = if k > 0 { torque[k - 1] } else { 0.0 };
        for (u, piece) in [(before, delay), (torque[k], t - delay)] {
            let h = piece / 200.0;
            for _ in 0..200 {
                let a = rate(x, u);
                let b = rate(along(x, a, h / 2.0), u);
                let c = rate(along(x, b, h / 2.0), u);
                let e = rate(along(x, c, h), u);
                x = std::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + e[i]));
            }
        }
    }
    out
}

#[test]
fn current_loop_is_exact_on_a_rigid_inertia() {
    let robot = robot(ROTOR);
    let inertia = 0.25 + 3.0 * 0.5 * 0.5;
    let torque = axisight_tests::Random(9).vector(40, 2.0);
    let t = robot.sample_time;
    for (delay, tau, damping) in [
        (0.0, 0.7e-3, 0.7),
        (0.0, 5e-3, 0.1),
        (0.4e-3, 0.3e-3, 0.95),
        (0.4e-3, 0.05e-3, 0.5),
    ] {
        let mut settings = vec![effect("current_loop", Some(0), &[tau, damping])];
        if delay > 0.0 {
            settings.push(effect("input_delay", Some(0), &[delay]));
        }
        for substeps in [1, 3] {
            let run = trace(
                &plant::<f64>(&robot, &settings),
                &robot,
                Drive::Torque(&[&torque]),
                &[],
                Method::RungeKutta4 { substeps },
            );
            let expected = followed(&torque, t, inertia, delay, (tau, damping));
            let error = relative(&run.measured, &expected);
            assert!(error < 1e-8, "{delay} {tau} {damping}: {error:.1e}");
        }
    }
}

/// Two of them at work on one axis are refused; one that does nothing is as if it were not there.
#[test]
fn an_axis_has_one_current_loop_of_second_order() {
    let robot = robot(ROTOR);
    let second = effect::<f64>("current_loop", Some(0), &[1e-3, 0.7]);
    let first = effect::<f64>("actuator_bandwidth", Some(0), &[1e-3]);
    for both in [[&first, &second], [&second, &first], [&second, &second]] {
        let settings = both.map(Clone::clone);
        let error = assemble(&robot, &[], &settings).err().expect("refused");
        assert!(
            error.to_string().contains("no other current loop"),
            "{error}"
        );
    }
    let torque = axisight_tests::Random(9).vector(40, 2.0);
    let measured = |settings: &[EffectSetting<f64>]| {
        let plant = plant::<f64>(&robot, settings);
        let method = Method::RungeKutta4 { substeps: 1 };
        trace(&plant, &robot, Drive::Torque(&[&torque]), &[], method).measured
    };
    let idle_first = effect("actuator_bandwidth", Some(0), &[0.0]);
    let idle_second = effect("current_loop", Some(0), &[0.0, 0.7]);
    for (own, idle) in [(first, idle_second), (second, idle_first)] {
        let beside = measured(&[own.clone(), idle]);
        assert!(relative(&beside, &measured(&[own])) < 1e-12);
    }
}

/// Two delays (or lags) on one axis act one after the other: the sum of the delays.
#[test]
fn delays_add() {
    let robot = robot(ROTOR);
    let torque = axisight_tests::Random(10).vector(30, 2.0);
    let run = |delays: &[f64]| {
        let settings: Vec<_> = delays
            .iter()
            .map(|d| effect("input_delay", Some(0), &[*d]))
            .collect();
        let method = Method::RungeKutta4 { substeps: 1 };
        trace(
            &plant::<f64>(&robot, &settings),
            &robot,
            Drive::Torque(&[&torque]),
            &[],
            method,
        )
        .measured
    };
    assert!(relative(&run(&[0.4e-3, 1.1e-3]), &run(&[1.5e-3])) < 1e-13);
}

/// What keeps a simulation on a log acts past delays and lags of its drive: of the right model it is the answer to the
/// noise of the log, the same whatever these are.
#[test]
fn a_right_model_answers_noise_alike_with_any_lag() {
    let mut robot = robot(ROTOR);
    robot.controller = Controller::PiVelocity {
        kp: vec![0.4],
        ki: vec![4.0],
    };
    let method = Method::RungeKutta4 { substeps: 2 };
    let torque = axisight_tests::Random(11).vector(80, 2.0);
    let noise = axisight_tests::Random(12).vector(80, 1e-4);
    let added = |drive: &[EffectSetting<f64>]| -> Vec<f64> {
        let machine = plant::<f64>(&robot, drive);
        let open = Drive::Torque(&[&torque]);
        let motion = trace(&machine, &robot, open, &[], method).measured;
        let logged: Vec<f64> = motion.iter().zip(&noise).map(|(y, n)| y + n).collect();
        let log = Drive::Tracking {
            torque: &[&torque],
            position: &[&logged],
        };
        let kept = trace(&machine, &robot, log, &[], method).command;
        kept.iter().zip(&torque).map(|(u, own)| u - own).collect()
    };
    let expected = added(&[]);
    assert!(axisight_tests::largest(&expected) > 1e-3);
    for (name, values) in [
        ("input_delay", &[1.3e-3][..]),
        ("actuator_bandwidth", &[2e-3]),
        ("current_loop", &[1e-3, 0.4]),
    ] {
        let found = added(&[effect(name, Some(0), values)]);
        assert!(relative(&found, &expected) < 1e-9, "{name}");
    }
}

/// A machine of which all is less, by a share that its motor is weaker, is the same to any command: it needs as much to
/// be kept on a log.
#[test]
fn what_keeps_a_simulation_on_a_log_is_in_units_of_commands() {
    let torque = axisight_tests::Random(13).vector(80, 2.0);
    let position = axisight_tests::Random(14).vector(80, 1e-2);
    let kept = |text: &str, effects: &[EffectSetting<f64>]| {
        let mut robot = robot(text);
        robot.controller = Controller::PiVelocity {
            kp: vec![0.4],
            ki: vec![4.0],
        };
        let log = Drive::Tracking {
            torque: &[&torque],
            position: &[&position],
        };
        let method = Method::RungeKutta4 { substeps: 2 };
        trace(&plant::<f64>(&robot, effects), &robot, log, &[], method).command
    };
    let lighter = ROTOR
        .replace("inertia = [1, 1, 3", "inertia = [1, 1, 2.4")
        .replace("motor_inertia = 0.25", "motor_inertia = 0.2");
    let weaker = effect("torque_constant", Some(0), &[-0.2]);
    assert!(relative(&kept(&lighter, &[weaker]), &kept(ROTOR, &[])) < 1e-9);
}
