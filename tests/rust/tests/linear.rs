//! The linear plant in the sampled loop: exactness, order of the ripple, and the nonlinear plant.

use axisight_core::plant::linearize;
use axisight_core::robot::{Controller, EffectSetting, RobotDescription};
use axisight_core::simulation::{
    Drive, LinearPlant, LinearPlantError, Method, Run, SimulationError, Status, measurement_noise,
    simulate_linear,
};
use axisight_scalar::{Lanes, Scalar};
use axisight_tests::{
    ARM, PRESET, ROTOR, Trace, effect, largest, plant, relative, robot, sines, trace,
};
use nalgebra::{DMatrix, DVector};
use std::sync::atomic::AtomicBool;

const ONE: Method = Method::RungeKutta4 { substeps: 1 };

/// An effect takes five waves: an order of zero switches one off.
const NONE: [f64; 3] = [0.0; 3];
/// Torque and resolver ripple of one axis (thesis, Table 8.1): order, amplitude, phase.
const TORQUE: [[f64; 3]; 6] = [
    [3.0, 0.06, 1.45],
    [36.0, 0.11, 0.90],
    [72.0, 0.08, 0.20],
    NONE,
    NONE,
    [18.0, 0.04, 0.0],
];
const RESOLVER: [[f64; 3]; 5] = [
    [2.0, 0.4e-3, -1.84],
    [10.0, 0.2e-3, 0.81],
    [12.0, 0.22e-3, 2.94],
    [48.0, 0.18e-3, 2.94],
    NONE,
];

fn terms(table: &[[f64; 3]]) -> Vec<f64> {
    let triple = |[n, a, p]: &[f64; 3]| [*n, a * p.sin(), a * p.cos()];
    table.iter().flat_map(triple).collect()
}

fn wave([n, a, p]: [f64; 3], angle: f64) -> f64 {
    a * (n * angle + p).sin()
}

fn ripple(n_axes: usize) -> Vec<EffectSetting<f64>> {
    let both = |axis| {
        [
            effect("torque_ripple", Some(axis), &terms(&TORQUE)),
            effect("resolver_ripple", Some(axis), &terms(&RESOLVER)),
        ]
    };
    (0..n_axes).flat_map(both).collect()
}

fn linear(robot: &RobotDescription, settings: &[EffectSetting<f64>]) -> LinearPlant {
    LinearPlant::new(robot, settings, &robot.operating_point).expect("linear plant")
}

fn linear_trace<S: Scalar>(
    robot: &RobotDescription,
    settings: &[EffectSetting<f64>],
    drive: Drive<'_>,
    noise: &[&[f64]],
    method: Method,
) -> Trace<S> {
    let run = Run {
        controller: &robot.controller,
        sample_time: robot.sample_time,
        start: &[&robot.operating_point],
        drive,
        noise,
        resolution: 0.0,
        disturbances: true,
        accelerometers: false,
        method,
        cancel: None,
    };
    let mut out = Trace {
        command: Vec::new(),
        measured: Vec::new(),
        states: Vec::new(),
        status: Status::Completed,
        evaluations: 0,
    };
    let status = simulate_linear::<S>(&linear(robot, settings), &run, &mut |sample| {
        out.command.extend(sample.command);
        out.measured.extend(sample.measured);
        out.states.push(sample.state.to_vec());
    });
    out.status = status.expect("no misuse");
    out
}

/// Torque commands: those at rest plus a smooth excitation [Nm].
fn torques(robot: &RobotDescription, n_samples: usize, size: f64) -> Vec<f64> {
    let rest = linearize(robot, &[], &robot.operating_point).expect("linear");
    let n = robot.n_axes();
    let mut out = sines(n_samples, n, robot.sample_time, size);
    for (i, u) in out.iter_mut().enumerate() {
        *u += rest.equilibrium.motor_torque[i % n];
    }
    out
}

/// `[e^{A h}, int e^{A s} B ds]`.
fn held(a: &DMatrix<f64>, b: &DMatrix<f64>, h: f64) -> (DMatrix<f64>, DMatrix<f64>) {
    let (n, m) = (a.nrows(), b.ncols());
    let mut joint = DMatrix::zeros(n + m, n + m);
    joint.view_mut((0, 0), (n, n)).copy_from(&(a * h));
    joint.view_mut((0, n), (n, m)).copy_from(&(b * h));
    let e = joint.exp();
    (
        e.view((0, 0), (n, n)).into_owned(),
        e.view((0, n), (n, m)).into_owned(),
    )
}

/// Without ripple the states are repeated products with the matrix exponential. Rounding:
/// 200 samples of 20 terms, each 1e-16 of numbers that cancel by the spread of `A h`, 10.
#[test]
fn without_ripple_it_is_the_matrix_exponential() {
    for text in [PRESET, ARM, ROTOR] {
        let robot = robot(text);
        let (n_samples, m) = (200, robot.n_axes());
        let torque = torques(&robot, n_samples, 2.0);
        let run = linear_trace::<f64>(&robot, &[], Drive::Torque(&[&torque]), &[], ONE);
        let model = linearize(&robot, &[], &robot.operating_point).expect("linear");
        let (phi, gamma) = held(&model.a, &model.b, robot.sample_time);
        let rest = DVector::from_vec(run.states[0].clone());
        let mut x = DVector::zeros(rest.len());
        for k in 0..n_samples {
            let got = DVector::from_vec(run.states[k].clone()) - &rest;
            let error = (&got - &x).amax();
            let size = x.amax().max(1e-12);
            assert!(
                error < 1e-11 * size + 1e-14,
                "{} {k}: {error:.1e}",
                robot.name
            );
            let u = DVector::from_fn(m, |i, _| {
                torque[k * m + i] - model.equilibrium.motor_torque[i]
            });
            x = &phi * x + &gamma * u;
        }
        assert!(x.amax() > 1e-3, "{}: nothing moved", robot.name);
    }
}

/// The width of the lanes and the company in them do not change a bit.
#[test]
fn lanes_equal_single_runs_bit_for_bit() {
    fn compare<const L: usize>(robot: &RobotDescription, settings: &[EffectSetting<f64>]) {
        let n = 300;
        let make = |lane: usize| sines(n, 3, robot.sample_time, 4.0 + 3.0 * lane as f64);
        let references: Vec<_> = (0..L).map(make).collect();
        let noise: Vec<_> = (0..L)
            .map(|lane| measurement_noise(7, lane as u64, n, 3, 1.2e-5))
            .collect();
        let (r, e): (Vec<&[f64]>, Vec<&[f64]>) = references
            .iter()
            .zip(&noise)
            .map(|(a, b)| (&a[..], &b[..]))
            .unzip();
        let all = linear_trace::<Lanes<L>>(robot, settings, Drive::Reference(&r), &e, ONE);
        for lane in 0..L {
            let drive = [r[lane]];
            let one = linear_trace::<f64>(
                robot,
                settings,
                Drive::Reference(&drive),
                &e[lane..=lane],
                ONE,
            );
            let same = |a: &[Lanes<L>], b: &[f64]| {
                a.iter()
                    .zip(b)
                    .all(|(a, b)| a.0[lane].to_bits() == b.to_bits())
            };
            assert!(same(&all.command, &one.command) && same(&all.measured, &one.measured));
            assert!(all.states.iter().zip(&one.states).all(|(a, b)| same(a, b)));
            assert_eq!(one.states.len(), n);
        }
    }
    let robot = robot(PRESET);
    let mut settings = ripple(3);
    settings.push(effect("input_delay", Some(1), &[3e-4]));
    settings.push(effect("actuator_bandwidth", Some(2), &[5e-4]));
    settings.push(effect("torque_saturation", Some(0), &[3.0]));
    compare::<1>(&robot, &settings);
    compare::<3>(&robot, &settings);
    compare::<4>(&robot, &settings);
    compare::<8>(&robot, &settings);
}

/// States of `x' = A x + B (u + v(C x, u))` by 64 Runge-Kutta steps per sample.
fn fine_steps(robot: &RobotDescription, torque: &[f64], n_samples: usize) -> Vec<Vec<f64>> {
    let model = linearize(robot, &[], &robot.operating_point).expect("linear");
    let m = robot.n_axes();
    let rest = &model.equilibrium;
    let rate = |x: &DVector<f64>, u: &[f64]| {
        let phi = &model.c * x;
        let input = DVector::from_fn(m, |i, _| {
            let angle = rest.motor_angle[i] + phi[i];
            let constant: f64 = TORQUE[..3].iter().map(|t| wave(*t, angle)).sum();
            u[i] - rest.motor_torque[i] + constant + u[i] * wave(TORQUE[5], angle)
        });
        &model.a * x + &model.b * input
    };
    let mut x = DVector::zeros(model.a.nrows());
    let mut out = Vec::new();
    let h = robot.sample_time / 64.0;
    for k in 0..n_samples {
        out.push(x.as_slice().to_vec());
        let u = &torque[k * m..(k + 1) * m];
        for _ in 0..64 {
            let k1 = rate(&x, u);
            let k2 = rate(&(&x + &k1 * (h / 2.0)), u);
            let k3 = rate(&(&x + &k2 * (h / 2.0)), u);
            let k4 = rate(&(&x + &k3 * h), u);
            x += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
        }
    }
    out
}

/// Largest distance to [`fine_steps`] relative to the largest deviation.
fn ripple_error(substeps: usize) -> f64 {
    let robot = robot(PRESET);
    let n_samples = 200;
    let torque = torques(&robot, n_samples, 6.0);
    let exact: Vec<f64> = fine_steps(&robot, &torque, n_samples).concat();
    let method = Method::RungeKutta4 { substeps };
    let run = linear_trace::<f64>(&robot, &ripple(3), Drive::Torque(&[&torque]), &[], method);
    let rest = run.states[0].clone();
    let deviations = run
        .states
        .iter()
        .flat_map(|x| x.iter().zip(&rest).map(|(a, b)| a - b));
    relative(&deviations.collect::<Vec<_>>(), &exact)
}

/// Speeds reach 20 rad/s: `n phi' h` is 0.7 for the 72nd harmonic in a whole sample, and
/// the cubic through its two ends is good to `0.7^4 / 400` of it.
#[test]
fn ripple_inside_the_sample_is_followed_with_order_four() {
    let errors = [1, 2, 4].map(ripple_error);
    assert!(errors[0] < 1e-4, "{errors:?}");
    // Rounding of the reference and its own error, 64^-4, stand far below.
    assert!(errors[2] > 1e-10, "{errors:?}");
    let order = (errors[1] / errors[2]).log2();
    assert!((order - 4.0).abs() < 0.3, "{order} {errors:?}");
}

/// Relative distance of the linear from the nonlinear run, deviations of the states.
fn nonlinearity(robot: &RobotDescription, settings: &[EffectSetting<f64>], size: f64) -> f64 {
    let (n, method) = (200, Method::RungeKutta4 { substeps: 8 });
    let reference = sines(n, robot.n_axes(), robot.sample_time, size);
    let drive = [&reference[..]];
    let straight = linear_trace::<f64>(robot, settings, Drive::Reference(&drive), &[], method);
    let plant = plant::<f64>(robot, settings);
    let bent = trace(&plant, robot, Drive::Reference(&drive), &[], method);
    let rest = &bent.states[0];
    assert!(relative(&straight.states[0], rest) < 1e-15);
    let deviation = |states: &[Vec<f64>]| -> Vec<f64> {
        let of = |x: &Vec<f64>| x.iter().zip(rest).map(|(a, b)| a - b).collect::<Vec<_>>();
        states.iter().flat_map(of).collect()
    };
    relative(&deviation(&straight.states), &deviation(&bent.states))
}

/// What the linearization leaves out is of second order in the motion, so its share of the
/// motion halves with the amplitude (quarters where symmetry takes the second order away).
#[test]
fn nonlinear_plant_agrees_as_the_amplitude_falls() {
    let smooth = |robot: &RobotDescription| {
        let mut settings = vec![
            effect("viscous_friction", Some(0), &[0.01]),
            effect("joint_stiffness", Some(0), &[-0.2]),
            effect("nonlinear_stiffness", Some(0), &[1e10]),
            effect("gravity_compensation", Some(0), &[50.0, 20.0]),
            effect("cable_stiffness", Some(0), &[300.0, 40.0]),
            effect("input_delay", Some(0), &[7e-4]),
            effect("actuator_bandwidth", Some(0), &[4e-4]),
            effect("torque_constant", Some(0), &[0.1]),
            effect("torque_offset", Some(0), &[0.4]),
            effect("motor_inertia", Some(0), &[0.1]),
            effect("joint_damping", Some(0), &[0.2]),
        ];
        if robot.n_axes() > 1 {
            settings.push(effect("torque_saturation", Some(1), &[500.0]));
        }
        settings
    };
    for text in [PRESET, ARM] {
        let robot = robot(text);
        for settings in [Vec::new(), smooth(&robot)] {
            let sizes = [8.0, 4.0, 2.0];
            let [a, b, c] = sizes.map(|size| nonlinearity(&robot, &settings, size));
            assert!(
                a < 0.05 && c > 1e-8,
                "{}: {a:.1e} {b:.1e} {c:.1e}",
                robot.name
            );
            for ratio in [a / b, b / c] {
                assert!(
                    (1.8..4.5).contains(&ratio),
                    "{}: {a:.1e} {b:.1e} {c:.1e}",
                    robot.name
                );
            }
        }
    }
}

/// The measurement is the true angle plus the resolver's error and the noise, and the
/// disturbance is the ripple under the present command.
#[test]
fn samples_show_ripple_at_the_true_angle() {
    let robot = robot(PRESET);
    let n = 400;
    let reference = sines(n, 3, robot.sample_time, 8.0);
    let noise = measurement_noise(3, 0, n, 3, 1.2e-5);
    let run = Run {
        controller: &robot.controller,
        sample_time: robot.sample_time,
        start: &[&robot.operating_point],
        drive: Drive::Reference(&[&reference]),
        noise: &[&noise],
        resolution: 0.0,
        disturbances: true,
        accelerometers: false,
        method: ONE,
        cancel: None,
    };
    let plant = linear(&robot, &ripple(3));
    let mut worst = [0.0_f64; 3];
    let status = simulate_linear::<f64>(&plant, &run, &mut |s| {
        for i in 0..3 {
            let (angle, u) = (s.state[i], s.command[i]);
            let resolver: f64 = RESOLVER.iter().map(|t| wave(*t, angle)).sum();
            let constant: f64 = TORQUE[..3].iter().map(|t| wave(*t, angle)).sum();
            let torque = constant + u * wave(TORQUE[5], angle);
            let error = noise[s.index * 3 + i] + resolver;
            worst[0] = worst[0].max((s.measured[i] - angle - error).abs());
            worst[1] = worst[1].max((s.position_disturbance[i] - error).abs());
            worst[2] = worst[2].max((s.torque_disturbance[i] - torque).abs());
        }
    });
    assert_eq!(status, Ok(Status::Completed));
    // The angle moved by up to 1e-7 rad from where the ripple was evaluated; the square of
    // 72 times that is 5e-11, times an amplitude of a thousandth rad and a tenth Nm.
    assert!(
        worst[0] < 1e-13 && worst[1] < 1e-13 && worst[2] < 1e-11,
        "{worst:?}"
    );
}

/// Under noise alone the variances solve the Lyapunov equation of the sampled loop:
/// `P = F P F' + G G' sigma^2` for the states `[x, y_{k-1}]`.
#[test]
fn noise_leads_to_the_predicted_variance() {
    let robot = robot(PRESET);
    let Controller::PiVelocity { kp, ki } = &robot.controller else {
        panic!("the preset has a PI controller");
    };
    let (h, std, n) = (robot.sample_time, robot.position_noise_std, 20);
    let model = linearize(&robot, &[], &robot.operating_point).expect("linear");
    let (phi, gamma) = held(&model.a, &model.b, h);
    // u = -kp (y - y_{k-1}) / h - ki y
    let now = DMatrix::from_fn(3, 3, |i, j| if i == j { -kp[i] / h - ki[i] } else { 0.0 });
    let before = DMatrix::from_fn(3, 3, |i, j| if i == j { kp[i] / h } else { 0.0 });
    let mut f = DMatrix::zeros(n + 3, n + 3);
    f.view_mut((0, 0), (n, n))
        .copy_from(&(&phi + &gamma * &now * &model.c));
    f.view_mut((0, n), (n, 3)).copy_from(&(&gamma * &before));
    f.view_mut((n, 0), (3, n)).copy_from(&model.c);
    let mut g = DMatrix::zeros(n + 3, 3);
    g.view_mut((0, 0), (n, 3)).copy_from(&(&gamma * &now));
    g.view_mut((n, 0), (3, 3)).fill_with_identity();
    // Doubling: the sum of F^k G G' F'^k over twice as many k each time.
    let mut p = &g * g.transpose() * (std * std);
    for _ in 0..20 {
        p += &f * &p * f.transpose();
        f = &f * &f;
    }
    const LANES: usize = 8;
    let (samples, skipped) = (24_000, 4000);
    let noise: Vec<_> = (0..LANES)
        .map(|lane| measurement_noise(5, lane as u64, samples, 3, std))
        .collect();
    let noise: Vec<&[f64]> = noise.iter().map(|e| &e[..]).collect();
    let still = vec![0.0; 3 * samples];
    let drive = Drive::Reference(&[&still]);
    let run = linear_trace::<Lanes<LANES>>(&robot, &[], drive, &noise, ONE);
    for i in 0..3 {
        let rest = run.states[0][i].0[0];
        let squares = run.states[skipped..].iter().map(|x| x[i]);
        let sum: f64 = squares
            .map(|v| v.0.iter().map(|a| (a - rest).powi(2)).sum::<f64>())
            .sum();
        let got = sum / ((samples - skipped) * LANES) as f64;
        // 80 s of a loop that forgets in 40 ms: 1000 independent samples, 4.5 % each way.
        assert!(
            (got / p[(i, i)] - 1.0).abs() < 0.15,
            "axis {i}: {got:.2e} {:.2e}",
            p[(i, i)]
        );
    }
}

#[test]
fn unstable_gain_diverges() {
    let mut robot = robot(PRESET);
    robot.controller = Controller::PVelocity {
        kp: vec![4000.0, 4.0, 3.4],
    };
    let reference = sines(4000, 3, robot.sample_time, 1.0);
    let drive = Drive::Reference(&[&reference]);
    let run = linear_trace::<Lanes<4>>(&robot, &ripple(3), drive, &[], ONE);
    match run.status {
        Status::Diverged(k) => {
            // Where the ripple got too steep for the step; what was seen after is void.
            assert!(run.states.len() > k);
            let last: Vec<f64> = run.states[k].iter().map(|v| v.0[0]).collect();
            assert!(largest(&last).is_finite(), "told a sample too late");
        }
        other => panic!("expected divergence, got {other:?}"),
    }
}

#[test]
fn misuse_is_refused_by_name() {
    let robot = robot(PRESET);
    for (name, parameters) in [
        ("coulomb_friction", vec![0.5, 0.5, 0.0, 0.0]),
        ("backlash", vec![1e-4, 0.0]),
        ("quadratic_drag", vec![1e-3]),
        (
            "transmission_error",
            vec![2.0, 1e-4, 0.0, 1.0, 0.0, 0.0, 2.0],
        ),
    ] {
        let build = |p: &[f64]| LinearPlant::new(&robot, &[effect(name, Some(0), p)], &[0.0; 3]);
        match build(&parameters).map(|_| ()) {
            Err(LinearPlantError::NotLinear { effect }) => assert_eq!(effect, name),
            other => panic!("{name}: {other:?}"),
        }
    }
    // At its neutral value an effect does nothing, and may stay.
    let neutral = effect("backlash", Some(0), &[0.0; 2]);
    assert!(LinearPlant::new(&robot, &[neutral], &[0.0; 3]).is_ok());
    for (settings, start, message) in [
        (
            vec![effect("torque_ripple", Some(3), &terms(&TORQUE))],
            vec![0.0; 3],
            "effect `torque_ripple`: expected an axis from 1 to 3, got axis 4",
        ),
        (
            vec![effect("torque_ripple", Some(0), &[1.0])],
            vec![0.0; 3],
            "effect `torque_ripple`: expected 18 parameters, got 1",
        ),
        (
            Vec::new(),
            vec![0.0; 2],
            "joint_angle: expected 3 driven joint angles, got 2",
        ),
    ] {
        let error = LinearPlant::new(&robot, &settings, &start).expect_err(message);
        assert_eq!(error.to_string(), message);
    }
    let plant = linear(&robot, &[]);
    let torque = [0.0; 6];
    let flag = AtomicBool::new(true);
    let mut run = Run {
        controller: &robot.controller,
        sample_time: robot.sample_time,
        start: &[&[0.0, 0.0, 0.1]],
        drive: Drive::Torque(&[&torque]),
        noise: &[],
        resolution: 0.0,
        disturbances: true,
        accelerometers: false,
        method: ONE,
        cancel: Some(&flag),
    };
    let outcome = |run: &Run<'_>| simulate_linear::<f64>(&plant, run, &mut |_| {});
    let error = outcome(&run).expect_err("another start").to_string();
    let want =
        "start: expected [0.0, 0.0, 0.0], where the plant was linearized, got [0.0, 0.0, 0.1]";
    assert_eq!(error, want);
    let rest = [&robot.operating_point[..]];
    run.start = &rest;
    assert_eq!(outcome(&run), Ok(Status::Cancelled(0)));
    let short = [&torque[..5]];
    run.drive = Drive::Torque(&short);
    assert!(matches!(outcome(&run), Err(SimulationError::Shape { .. })));
}
