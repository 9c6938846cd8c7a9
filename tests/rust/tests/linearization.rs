//! Linearization: exact Jacobian, eigenvalues, and the response of the sampled plant.

use axisight_core::plant::{equilibrium, linearize, zoh_frequency_response};
use axisight_core::robot::{EffectSetting, RobotDescription};
use axisight_core::simulation::{Drive, Method};
use axisight_identification::frequency::modes;
use axisight_tests::{ARM, PRESET, effect, plant, robot, trace};
use nalgebra::{Complex, DMatrix};
use std::f64::consts::TAU;

type C = Complex<f64>;

fn settings() -> Vec<EffectSetting<f64>> {
    vec![
        effect("nonlinear_stiffness", Some(1), &[2e11]),
        effect("coulomb_friction", Some(0), &[0.5, 0.5, 0.0, 0.0]),
        effect(
            "torque_ripple",
            Some(2),
            &[
                3.0, 0.05, 0.02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
                0.0, 0.0,
            ],
        ),
    ]
}

/// Central differences with the step halved: the difference of the two estimates is three
/// times the truncation left in the finer one, and rounding is 1e-16 |f| / h.
#[test]
fn jacobian_agrees_with_finite_differences() {
    let robot = robot(PRESET);
    let at = [0.3, -0.4, 0.5];
    for settings in [Vec::new(), settings()] {
        let linear = linearize(&robot, &settings, &at).expect("linear");
        let plant = plant::<f64>(&robot, &settings);
        let rest = equilibrium(&plant, &at).expect("rest");
        let x0 = plant.state_at_rest(&rest);
        let mut scratch = plant.scratch();
        let nx = x0.len();
        let mut at_shift = |column: usize, h: f64| {
            let (mut x, mut u) = (x0.clone(), rest.motor_torque.clone());
            if column < nx {
                x[column] += h;
            } else {
                u[column - nx] += h;
            }
            let mut dx = vec![0.0; nx];
            plant.derivative(&x, &u, &u, &mut scratch, &mut dx);
            dx
        };
        // Forces of 1e6 Nm/rad times 1 rad cancel to accelerations: rounding of 1e6 / 10 kg m^2.
        let size = linear.a.amax();
        for column in 0..nx + 3 {
            let h = 1e-5;
            let mut central = |h: f64| -> Vec<f64> {
                let (high, low) = (at_shift(column, h), at_shift(column, -h));
                high.iter()
                    .zip(&low)
                    .map(|(a, b)| (a - b) / (2.0 * h))
                    .collect()
            };
            let (coarse, fine) = (central(2.0 * h), central(h));
            for row in 0..nx {
                let exact = if column < nx {
                    linear.a[(row, column)]
                } else {
                    linear.b[(row, column - nx)]
                };
                let tolerance = (coarse[row] - fine[row]).abs() + 1e-16 * size / h;
                assert!(tolerance < 1e-4 * size, "says nothing: {tolerance:.1e}");
                let error = (fine[row] - exact).abs();
                assert!(
                    error <= tolerance,
                    "({row}, {column}): {error:.1e} {tolerance:.1e}"
                );
            }
        }
    }
}

#[test]
fn equilibrium_is_at_rest() {
    let robot = robot(PRESET);
    for settings in [Vec::new(), settings()] {
        let plant = plant::<f64>(&robot, &settings);
        let rest = equilibrium(&plant, &[0.3, -0.4, 0.5]).expect("rest");
        let x = plant.state_at_rest(&rest);
        let mut dx = vec![0.0; x.len()];
        // Ripple is an effect on the motor that rest does not take into account.
        let ripple = !settings.is_empty();
        plant.derivative(
            &x,
            &rest.motor_torque,
            &rest.motor_torque,
            &mut plant.scratch(),
            &mut dx,
        );
        for (i, d) in dx.iter().enumerate() {
            // Spring forces of 1e4 Nm, rounded, on inertias of 1 kg m^2 and motors of 1e-2 kg m^2.
            let moved_by_ripple = ripple && i == 12;
            assert!(moved_by_ripple || d.abs() < 1e-9, "state {i}: {d:.1e}");
        }
    }
}

/// Every mode is an eigenvector to rounding, and all of them together have the trace.
#[test]
fn modes_are_eigenpairs() {
    let robot = robot(PRESET);
    let linear = linearize(&robot, &[], &robot.operating_point).expect("linear");
    let a = linear.a.map(|x| C::new(x, 0.0));
    let size = linear.a.norm();
    let mut sum = 0.0;
    let mut count = 0;
    for mode in modes(&linear).expect("modes") {
        let v = DMatrix::from_column_slice(mode.shape.len(), 1, &mode.shape);
        let off = (&a * &v - &v * mode.eigenvalue).norm() / (size * v.norm());
        // Backward error of a QR algorithm: a few units times the order.
        assert!(
            off < 20.0 * 20.0 * f64::EPSILON,
            "{}: {off:.1e}",
            mode.eigenvalue
        );
        let paired = mode.eigenvalue.im > 1e-6;
        count += 1 + usize::from(paired);
        sum += mode.eigenvalue.re * if paired { 2.0 } else { 1.0 };
    }
    assert_eq!(count, 20);
    assert!(
        (sum - linear.a.trace()).abs() < 1e-12 * size,
        "{sum} {}",
        linear.a.trace()
    );
}

/// Motor and link with a spring between them and no gravity:
/// `w^2 = k (1 / J + r^2 / J_m)` without damping, and two modes at zero.
#[test]
fn two_masses_have_the_textbook_frequency() {
    let mut robot = robot(ARM);
    robot.gravity = [0.0; 3];
    robot.joints.truncate(1);
    let compliance = robot.joints[0].compliance.as_mut().expect("spring");
    compliance.damping = 0.0;
    robot.joints[0]
        .drive
        .as_mut()
        .expect("drive")
        .viscous_friction = 0.0;
    let linear = linearize(&robot, &[], &[0.7]).expect("linear");
    let all = modes(&linear).expect("modes");
    let inertia = 5.0 + 60.0 * (0.4 * 0.4 + 0.1 * 0.1);
    let want = (4e5 * (1.0 / inertia + 0.01 * 0.01 / 0.004_f64)).sqrt() / TAU;
    let got = all.last().expect("a mode");
    // Eigenvalues carry a rounding of 1e-16 of the largest entry, r k / J_m = 1e6 / s^2, times
    // the condition of the eigenvectors: motor angle over joint angle, w^2 J_m / r k, and
    // rate over angle, w, span 30 and 190; over w itself that is 3e-9 of w.
    assert!(
        (got.frequency_hz / want - 1.0).abs() < 3e-9,
        "{} {want}",
        got.frequency_hz
    );
    assert!(got.damping_ratio.abs() < 3e-9);
    // A double root at zero splits into the root of the rounding: sqrt(1e-16) w.
    assert!(all[0].frequency_hz < 1e-7 * want, "{}", all[0].frequency_hz);
}

/// Fourier coefficients at `frequency_hz` of the last `window` samples, `(axis)`.
fn coefficients(
    series: &[f64],
    n_axes: usize,
    window: usize,
    frequency_hz: f64,
    dt: f64,
) -> Vec<C> {
    let n = series.len() / n_axes;
    let mut out = vec![C::new(0.0, 0.0); n_axes];
    for k in n - window..n {
        let turn = C::from_polar(1.0, -TAU * frequency_hz * dt * (k as f64));
        for axis in 0..n_axes {
            out[axis] += turn * series[k * n_axes + axis];
        }
    }
    out
}

/// Small sines through the settled loop, one experiment per axis: `G = Y U^-1`.
fn brute_force(robot: &RobotDescription, frequency_hz: &[f64]) -> Vec<DMatrix<C>> {
    let (n, dt) = (robot.n_axes(), robot.sample_time);
    let (settle, window) = (16_000, 1000);
    let plant = plant::<f64>(robot, &[]);
    let runs: Vec<_> = (0..n)
        .map(|driven| {
            let mut reference = vec![0.0; (settle + window) * n];
            for k in 0..settle + window {
                let t = k as f64 * dt;
                let sum: f64 = frequency_hz.iter().map(|f| (TAU * f * t).sin()).sum();
                reference[k * n + driven] = 1e-3 * sum;
            }
            let method = Method::RungeKutta4 { substeps: 4 };
            trace(&plant, robot, Drive::Reference(&[&reference]), &[], method)
        })
        .collect();
    frequency_hz
        .iter()
        .map(|f| {
            let gather = |pick: &dyn Fn(usize) -> Vec<C>| {
                let columns: Vec<_> = (0..n).map(pick).collect();
                DMatrix::from_fn(n, n, |i, j| columns[j][i])
            };
            let u = gather(&|e| coefficients(&runs[e].command, n, window, *f, dt));
            let y = gather(&|e| coefficients(&runs[e].measured, n, window, *f, dt));
            y * u.try_inverse().expect("three independent experiments")
        })
        .collect()
}

/// The dampers are made ten times stronger so that the arm swings less long on motors held
/// by their loops: its slowest mode then decays with 3.0 1/s, and 8 s leave exp(-24) = 4e-11.
/// RK4 at 8 kHz leaves (w h)^5 / 120 = 2e-7 per step on the fastest mode (155 Hz), less at
/// the frequencies of the test; the mean of the motion lies 1e-7 rad of joint angle off the
/// operating point, which changes the linearization by about as much.
#[test]
fn zero_order_hold_response_is_what_a_sine_shows() {
    let frequency_hz = [6.0, 20.0, 46.0, 90.0];
    for text in [PRESET, ARM] {
        let mut robot = robot(text);
        for compliance in robot
            .joints
            .iter_mut()
            .filter_map(|j| j.compliance.as_mut())
        {
            compliance.damping *= 10.0;
        }
        let linear = linearize(&robot, &[], &robot.operating_point).expect("linear");
        let exact = zoh_frequency_response(&linear, robot.sample_time, &frequency_hz);
        let measured = brute_force(&robot, &frequency_hz);
        for ((f, exact), measured) in frequency_hz.iter().zip(exact).zip(measured) {
            let exact = exact.expect("no pole");
            let error = (&measured - &exact).norm() / exact.norm();
            assert!(error < 1e-6, "{} {f} Hz: {error:.1e}", robot.name);
        }
    }
}
