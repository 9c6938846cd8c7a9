//! Effects against their definitions, computed here by other means.

use axisight_core::plant::{Plant, equilibrium};
use axisight_core::robot::{EffectSetting, RigidBody, RobotDescription};
use axisight_core::simulation::{Drive, Method};
use axisight_identification::logs::{InverseDynamics, MotionRecord, Problem};
use axisight_tests::{PRESET, Random, effect, flat, plant, relative, robot, sines, trace};
use std::sync::Arc;

const METHOD: Method = Method::RungeKutta4 { substeps: 2 };

/// The preset without gravity, friction and gear damping: what power goes in stays in.
fn conservative() -> RobotDescription {
    let mut robot = robot(PRESET);
    robot.gravity = [0.0; 3];
    robot.operating_point = vec![0.0; 3];
    for joint in &mut robot.joints {
        if let Some(drive) = &mut joint.drive {
            drive.viscous_friction = 0.0;
        }
        if let Some(compliance) = &mut joint.compliance {
            compliance.damping = 0.0;
        }
    }
    robot
}

/// Joint of each axis, its gear ratio, motor inertia and stiffness.
fn drives(robot: &RobotDescription) -> Vec<(usize, f64, f64, f64)> {
    let one = |(joint, description, drive): (
        usize,
        &axisight_core::robot::Joint,
        &axisight_core::robot::Drive,
    )| {
        let stiffness = description.compliance.map_or(0.0, |c| c.stiffness);
        (joint, drive.gear_ratio, drive.motor_inertia, stiffness)
    };
    robot.driven().map(one).collect()
}

fn derivative(plant: &Plant<f64>, x: &[f64], torque: &[f64]) -> Vec<f64> {
    let mut dx = vec![0.0; x.len()];
    plant.derivative(x, torque, torque, &mut plant.scratch(), &mut dx);
    dx
}

/// A gear that another axis turns along returns its torque to that axis: power is kept.
#[test]
fn a_gear_that_is_turned_along_keeps_power() {
    const SHARE: f64 = 0.3;
    let robot = conservative();
    let coupled = effect("axis_coupling", Some(1), &[SHARE, 0.0, 0.0, 1.0, 0.1]);
    let body = RigidBody::new(&robot);
    let mut random = Random(7);
    let kept = |plant: &Plant<f64>, random: &mut Random, share: f64| {
        let (m, n) = (3, body.n_joints());
        let mut x: Vec<f64> = (0..2 * (m + n)).map(|_| random.within(1e-3)).collect();
        x[..m].iter_mut().for_each(|phi| *phi = random.within(0.05));
        let torque = [0.3, -0.2, 0.1];
        let dx = derivative(plant, &x, &torque);
        let (q, v, a) = (&x[m..m + n], &dx[m..m + n], &dx[2 * m + n..]);
        let asked = body.inverse_dynamics(q, v, a).expect("finite");
        // Power that goes into links, motors and springs, less what the drives give.
        let mut power: f64 = asked.iter().zip(v).map(|(f, v)| f * v).sum();
        let mut largest: f64 = 0.0;
        let axes = drives(&robot);
        for (i, (joint, ratio, inertia, stiffness)) in axes.iter().enumerate() {
            let turned = |of: &[f64]| {
                if i == 2 {
                    share * axes[1].1 * of[1]
                } else {
                    0.0
                }
            };
            let delta = ratio * x[i] + turned(&x) - x[m + joint];
            let rate = ratio * dx[i] + turned(&dx) - dx[m + joint];
            let spring = stiffness * delta * rate;
            power += inertia * dx[i] * dx[m + n + i] + spring - torque[i] * dx[i];
            largest = largest.max(spring.abs());
        }
        for (j, joint) in robot
            .joints
            .iter()
            .enumerate()
            .filter(|(_, j)| j.drive.is_none())
        {
            let stiffness = joint.compliance.map_or(0.0, |c| c.stiffness);
            power += stiffness * x[m + j] * v[j];
        }
        power.abs() / largest
    };
    for _ in 0..10 {
        // Sums of a dozen products rounded at 1e-16, of forces that cancel to a hundredth.
        assert!(
            kept(
                &plant(&robot, std::slice::from_ref(&coupled)),
                &mut random,
                SHARE
            ) < 1e-12
        );
        assert!(kept(&plant(&robot, &[]), &mut random, SHARE) > 1e-6);
    }
}

/// At rest the first motor carries a share of the second gear's load, and turned the second one.
#[test]
fn a_motor_carries_the_gear_it_turns_along() {
    const SHARE: f64 = -0.4;
    let mut robot = robot(PRESET);
    robot.operating_point = vec![0.1, 0.3, -0.2];
    let coupled = effect("axis_coupling", Some(1), &[SHARE, 0.5, 0.5, 1.0, 0.1]);
    let rest = |settings: &[EffectSetting<f64>]| {
        equilibrium(&plant::<f64>(&robot, settings), &robot.operating_point).expect("rest")
    };
    let (with, without) = (rest(&[coupled]), rest(&[]));
    let ratios: Vec<f64> = drives(&robot).iter().map(|d| d.1).collect();
    let carried = SHARE * ratios[1] * without.motor_torque[2] / ratios[2];
    let turned = -SHARE * ratios[1] * without.motor_angle[1] / ratios[2];
    for (got, want) in [
        (with.motor_torque[1], without.motor_torque[1] + carried),
        (with.motor_torque[2], without.motor_torque[2]),
        (with.motor_angle[2], without.motor_angle[2] + turned),
    ] {
        assert!(
            (got - want).abs() < 1e-9 * want.abs().max(1.0),
            "{got} {want}"
        );
    }
    assert!(carried.abs() > 0.01 && turned.abs() > 1.0);
}

/// Predicted torques give the power that links, motors and coupled friction take.
#[test]
fn predicted_torques_of_coupled_axes_balance_power() {
    const SHARE: f64 = 0.3;
    let mut robot = robot(PRESET);
    robot.gravity = [0.0; 3];
    let (viscous, coulomb, ratio, width) = (0.02, 0.4, -0.7, 2.0);
    let coupled = effect(
        "axis_coupling",
        Some(1),
        &[SHARE, viscous, coulomb, ratio, width],
    );
    let (n, samples) = (3, 40);
    let mut random = Random(3);
    let mut of = |size: f64| {
        (0..n * samples)
            .map(|_| random.within(size))
            .collect::<Vec<_>>()
    };
    let record = MotionRecord {
        position: of(50.0),
        velocity: of(20.0),
        acceleration: of(200.0),
        torque: vec![0.0; n * samples],
        certainty: vec![1.0; n * samples],
    };
    let problem = InverseDynamics {
        robot: robot.clone(),
        effects: vec![coupled],
        parameters: vec![],
        records: vec![Arc::new(record.clone())],
        weighting: vec![flat(1.0); n],
        block_s: 1.0,
    };
    let torque = problem.evaluate(&[], &[]).expect("evaluated").residual;
    let body = RigidBody::new(&robot);
    let axes = drives(&robot);
    for k in 0..samples {
        let motor = |x: &[f64]| x[n * k..n * (k + 1)].to_vec();
        let joints = |x: &[f64]| {
            let mut out = vec![0.0; body.n_joints()];
            for (i, (joint, ratio, ..)) in axes.iter().enumerate() {
                out[*joint] = ratio * x[i]
                    + if i == 2 {
                        SHARE * axes[1].1 * x[1]
                    } else {
                        0.0
                    };
            }
            out
        };
        let [p, v, a] =
            [&record.position, &record.velocity, &record.acceleration].map(|x| motor(x));
        let force = body
            .inverse_dynamics(&joints(&p), &joints(&v), &joints(&a))
            .expect("finite");
        let mut want: f64 = force.iter().zip(joints(&v)).map(|(f, v)| f * v).sum();
        for (i, (.., inertia, _)) in axes.iter().enumerate() {
            let own = robot.driven().nth(i).expect("an axis").2.viscous_friction;
            want += inertia * v[i] * a[i] + own * v[i] * v[i];
        }
        let speed = v[1] + ratio * v[2];
        want += speed * (viscous * speed + coulomb * (speed / width).tanh());
        let got: f64 = (0..n).map(|i| torque[i * samples + k] * v[i]).sum();
        assert!(
            (got - want).abs() < 1e-10 * want.abs().max(1.0),
            "{k}: {got} {want}"
        );
    }
}

/// A clock that is fast runs through its references faster.
#[test]
fn a_fast_clock_runs_through_its_references() {
    const DRIFT: f64 = 0.008;
    let robot = robot(PRESET);
    let (n, samples) = (robot.n_axes(), 400);
    let reference = sines(samples, n, robot.sample_time, 1.5);
    let mut warped = reference.clone();
    for k in 0..samples {
        let at = k as f64 * (1.0 + DRIFT);
        let (low, share) = (at.floor(), at - at.floor());
        let entry = |sample: f64, i: usize| reference[(sample as usize).min(samples - 1) * n + i];
        for i in 0..n {
            warped[k * n + i] = (1.0 - share) * entry(low, i) + share * entry(low + 1.0, i);
        }
    }
    let drifting = plant::<f64>(&robot, &[effect("clock_drift", None, &[DRIFT])]);
    let plain = plant::<f64>(&robot, &[]);
    let got = trace(
        &drifting,
        &robot,
        Drive::Reference(&[&reference]),
        &[],
        METHOD,
    );
    let want = trace(&plain, &robot, Drive::Reference(&[&warped]), &[], METHOD);
    let other = trace(&plain, &robot, Drive::Reference(&[&reference]), &[], METHOD);
    assert!(relative(&got.command, &want.command) < 1e-12);
    assert!(relative(&other.command, &want.command) > 1e-2);
}

/// A motor without friction accelerates with what its supply leaves of the torque.
#[test]
fn a_sagging_supply_leaves_less_torque() {
    const SAG: f64 = 0.004;
    let robot = conservative();
    let inertia = drives(&robot)[1].2;
    let delivered = |curvature: f64, torque: f64, speed: f64| {
        let values = [SAG, curvature];
        let sagging = plant::<f64>(&robot, &[effect("power_supply_sag", Some(1), &values)]);
        let n = sagging.n_angles();
        let mut x = vec![0.0; sagging.n_states()];
        x[n + 1] = speed;
        derivative(&sagging, &x, &[0.0, torque, 0.0])[n + 1] * inertia
    };
    for (torque, speed) in [
        (2.0, 100.0),
        (2.0, -100.0),
        (-2.0, -60.0),
        (-2.0, 60.0),
        (2.0, 0.0),
    ] {
        let drawn = SAG * f64::max(torque * speed, 0.0);
        for (curvature, left) in [(0.0, 1.0 - drawn), (1.0, 1.0 / (1.0 + drawn))] {
            let got = delivered(curvature, torque, speed);
            let want = torque * left;
            assert!((got - want).abs() < 1e-12, "{torque} {speed}: {got} {want}");
        }
    }
    // Something is always left.
    assert!((delivered(0.0, 4.0, 100.0) - 0.2).abs() < 1e-12);
}

/// An encoder off centre is wrong by a wave over the joint's turn, counted on the motor's side.
#[test]
fn an_eccentric_encoder_reads_a_wave_of_the_joint() {
    let (a, b) = (0.03, -0.02);
    let mut robot = robot(PRESET);
    robot.operating_point = vec![0.1, 0.3, -0.2];
    let eccentric = plant::<f64>(&robot, &[effect("encoder_eccentricity", Some(2), &[a, b])]);
    let reference = sines(100, 3, robot.sample_time, 1.5);
    let got = trace(
        &eccentric,
        &robot,
        Drive::Reference(&[&reference]),
        &[],
        METHOD,
    );
    let (joint, ratio, ..) = drives(&robot)[2];
    let start = got.states[0][3 + joint];
    for (k, x) in got.states.iter().enumerate() {
        let q = x[3 + joint];
        let wave = |q: f64| a * q.cos() + b * q.sin();
        let want = x[2] + (wave(q) - wave(start)) / ratio;
        let read = got.measured[3 * k + 2];
        assert!(
            (read - want).abs() < 1e-12 * want.abs(),
            "{k}: {read} {want}"
        );
    }
}

/// A gear with lost motion is soft around its middle and as stiff as it was beyond: at once with
/// hardly any rounding, gradually with more.
#[test]
fn lost_motion_is_soft_around_the_middle() {
    let (softness, width) = (0.7, 2e-4);
    let robot = conservative();
    let (_, ratio, inertia, stiffness) = drives(&robot)[0];
    for rounding in [0.02_f64, 0.5] {
        let values = [softness, width, rounding];
        let soft = plant::<f64>(&robot, &[effect("lost_motion", Some(0), &values)]);
        let n = soft.n_angles();
        let torque = |delta: f64| {
            let mut x = vec![0.0; soft.n_states()];
            x[0] = delta / ratio;
            -derivative(&soft, &x, &[0.0; 3])[n] * inertia / ratio
        };
        // The corner of a hyperbola is off its lines by at most half of its rounding, at the corner.
        let scale = rounding.hypot(1.0);
        let corner = 0.5 * softness * stiffness * width * rounding * scale;
        for delta in [-1e-3, -5e-4, -1e-4, 1e-5, 1.5e-4, 3e-4, 1e-3] {
            let within = scale * f64::clamp(delta, -width, width);
            let want = stiffness * (delta - softness * within);
            let got = torque(delta);
            assert!((got - want).abs() <= corner, "{delta}: {got} {want}");
        }
        let step = 1e-3 * width;
        let slope = (torque(step) - torque(-step)) / (2.0 * step);
        let want = stiffness * (1.0 - softness);
        assert!((slope - want).abs() < 1e-3 * stiffness, "{slope} {want}");
    }
}

/// An encoder of few lines reads the nearest of its steps.
#[test]
fn a_coarse_encoder_reads_steps() {
    const STEP: f64 = 2e-3;
    let robot = robot(PRESET);
    let coarse = plant::<f64>(&robot, &[effect("position_quantization", Some(1), &[STEP])]);
    let reference = sines(100, 3, robot.sample_time, 1.5);
    let got = trace(
        &coarse,
        &robot,
        Drive::Reference(&[&reference]),
        &[],
        METHOD,
    );
    for (k, x) in got.states.iter().enumerate() {
        let read = &got.measured[3 * k..3 * (k + 1)];
        assert!(
            (read[0] - x[0]).abs() == 0.0 && (read[2] - x[2]).abs() == 0.0,
            "{k}"
        );
        assert!((read[1] - x[1]).abs() < 0.5 * STEP * (1.0 + 1e-9), "{k}");
        let steps = read[1] / STEP;
        assert!((steps - steps.round()).abs() < 1e-9, "{k}: {steps} steps");
    }
}

/// A gear that runs ahead by two waves carries the torque of its spring at what they add, and conserves power.
#[test]
fn a_transmission_error_has_two_waves() {
    let (order, ratio_of_second, waves) = (3.0, 1.5, [2e-4, -1e-4, 3e-5, 5e-5]);
    let robot = conservative();
    let [a, b, c, d] = waves;
    let values = [order, a, b, 1.0, c, d, ratio_of_second];
    let waving = plant::<f64>(&robot, &[effect("transmission_error", Some(0), &values)]);
    let (joint, ratio, inertia, stiffness) = drives(&robot)[0];
    let (m, n) = (waving.n_motors(), waving.n_angles());
    let body = RigidBody::new(&robot);
    for phi in [0.0_f64, 0.4, -1.3, 2.0] {
        let mut x = vec![0.0; waving.n_states()];
        x[0] = phi;
        let at = |k: f64| (k * order * phi).sin_cos();
        let ((s1, c1), (s2, c2)) = (at(1.0), at(ratio_of_second));
        let ahead = waves[0] * c1 + waves[1] * s1 + waves[2] * c2 + waves[3] * s2;
        let first = order * (waves[1] * c1 - waves[0] * s1);
        let slope = first + ratio_of_second * order * (waves[3] * c2 - waves[2] * s2);
        let torque = stiffness * (ratio * phi + ahead);
        let dx = derivative(&waving, &x, &[0.0; 3]);
        let on_motor = -dx[n] * inertia;
        let want = torque * (ratio + slope);
        assert!(
            (on_motor - want).abs() < 1e-9 * want.abs().max(1e-3),
            "{phi}: {on_motor} {want}"
        );
        let force = body.inverse_dynamics(&x[m..n], &vec![0.0; n - m], &dx[n + m..2 * n]);
        let on_joint = force.expect("finite")[joint];
        assert!(
            (on_joint - torque).abs() < 1e-9 * torque.abs().max(1.0),
            "{on_joint} {torque}"
        );
    }
}
