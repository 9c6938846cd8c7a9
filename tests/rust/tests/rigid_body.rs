//! Rigid-body algorithms: an oracle (Pinocchio), identities, and a mixed chain.

use axisight_core::robot::{Motion, RigidBody, RobotDescription};
use axisight_tests::{PRESET, Random, relative, robot};
use nalgebra::DMatrix;
use serde_json::Value;

/// Slide, turn about a skew axis, slide, turn: nothing of it along a coordinate axis only.
const MIXED: &str = r#"schema = "axisight.robot/1"
name = "mixed"
gravity = [0.5, -1.0, -9.81]
sample_time = 1e-3
[[joint]]
name = "rail"
kind = "driven"
motion = "prismatic"
origin = [0, 0, 0.2]
axis = [1, 0, 0]
[joint.link]
mass = 30
com = [0.1, 0, 0.05]
inertia = [2, 3, 4, 0.1, -0.2, 0.3]
[joint.drive]
gear_ratio = 0.01
motor_inertia = 0.001
viscous_friction = 0.001
[[joint]]
name = "swing"
kind = "driven"
origin = [0.1, 0.2, 0.3]
axis = [0.6, 0, 0.8]
[joint.link]
mass = 12
com = [0.2, -0.1, 0.3]
inertia = [1, 1.2, 0.7, 0.05, 0.1, -0.1]
[joint.drive]
gear_ratio = 0.01
motor_inertia = 0.001
viscous_friction = 0.001
[[joint]]
name = "reach"
kind = "driven"
motion = "prismatic"
origin = [0, 0, 0]
axis = [0, 0.6, -0.8]
[joint.drive]
gear_ratio = 0.01
motor_inertia = 0.001
viscous_friction = 0.001
[[joint]]
name = "wrist"
kind = "elastic"
origin = [0.4, 0, 0]
axis = [0, 1, 0]
stiffness = 1e4
damping = 10
[joint.link]
mass = 5
com = [0.1, 0.05, -0.1]
inertia = [0.2, 0.3, 0.25, 0.01, 0, 0.02]
[controller]
kind = "none"
[sensor]
position_noise_std = 0
[operating_point]
joint_angle = [0, 0, 0]
"#;

fn both() -> [RobotDescription; 2] {
    [robot(PRESET), robot(MIXED)]
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().expect("a number")],
    }
}

#[test]
fn agrees_with_pinocchio() {
    let text = include_str!("../../golden/reference_small.json");
    let golden: Value = serde_json::from_str(text).expect("JSON");
    let body = RigidBody::new(&robot(PRESET));
    let point: [f64; 3] = numbers(&golden["point"]).try_into().expect("three");
    let states = golden["states"].as_array().expect("states");
    assert_eq!(states.len(), 4);
    for state in states {
        let get = |name: &str| numbers(&state[name]);
        let (q, v, a) = (get("q"), get("v"), get("a"));
        // Sums of about 100 products of order one on each side, rounded at 1.1e-16:
        // 2 * 100 * 1.1e-16 = 2e-14. The forward dynamics is worse by the condition
        // number of the inertia matrix, below 1e4 at these states.
        let check = |name: &str, got: &[f64], tolerance: f64| {
            let error = relative(got, &get(name));
            assert!(error < tolerance, "{name}: {error:.1e}");
        };
        check(
            "inertia_matrix",
            &body.inertia_matrix(&q).expect("M"),
            2e-14,
        );
        check("bias", &body.bias(&q, &v).expect("bias"), 2e-14);
        check("gravity", &body.gravity(&q).expect("gravity"), 2e-14);
        check(
            "inverse_dynamics",
            &body.inverse_dynamics(&q, &v, &a).expect("tau"),
            2e-14,
        );
        let tau: Vec<f64> = a.iter().map(|x| 1e3 * x).collect();
        check(
            "forward_dynamics",
            &body.forward_dynamics(&q, &v, &tau).expect("acc"),
            2e-10,
        );
        let (rotation, origin) = body.pose(&q, 6).expect("pose");
        check("last_rotation", rotation.as_flattened(), 2e-14);
        check("last_origin", &origin, 2e-14);
        let jacobian = body.jacobian(&q, 6, point).expect("jacobian");
        check("last_jacobian", jacobian.transpose().as_slice(), 2e-14);
        let (kinetic, potential) = body.energy(&q, &v).expect("energy");
        check("kinetic", &[kinetic], 2e-14);
        check("potential", &[potential], 2e-13);
    }
}

#[test]
fn inertia_is_symmetric_positive_definite() {
    let mut random = Random(1);
    for robot in both() {
        let body = RigidBody::new(&robot);
        let n = body.n_joints();
        for _ in 0..200 {
            let flat = body.inertia_matrix(&random.vector(n, 3.0)).expect("M");
            let m = DMatrix::from_row_slice(n, n, &flat);
            assert_eq!(m, m.transpose());
            assert!(m.cholesky().is_some());
        }
    }
}

#[test]
fn inverse_and_forward_dynamics_are_inverses() {
    let mut random = Random(2);
    for robot in both() {
        let body = RigidBody::new(&robot);
        let n = body.n_joints();
        for _ in 0..200 {
            let (q, v) = (random.vector(n, 3.0), random.vector(n, 2.0));
            let a = random.vector(n, 5.0);
            let tau = body.inverse_dynamics(&q, &v, &a).expect("tau");
            let back = body.forward_dynamics(&q, &v, &tau).expect("acc");
            let m = DMatrix::from_row_slice(n, n, &body.inertia_matrix(&q).expect("M"));
            let values = m.symmetric_eigenvalues();
            // Rounding of tau (1e-15 of its largest terms, up to 10 times a) is
            // multiplied by the condition number.
            let tolerance = 1e-14 * values.max() / values.min();
            let error = relative(&back, &a);
            assert!(error < tolerance, "{error:.1e} {tolerance:.1e}");
        }
    }
}

/// Finite differences of pose along joint `i`: step 1e-5 leaves a truncation of
/// h^2 / 6 = 2e-11 and a rounding of 1e-16 * (3 m) / h = 3e-11.
#[test]
fn jacobian_is_the_slope_of_the_pose() {
    let (h, tolerance) = (1e-5, 2e-10);
    let point = [0.3, -0.2, 0.5];
    let mut random = Random(3);
    for robot in both() {
        let body = RigidBody::new(&robot);
        let n = body.n_joints();
        for joint in 0..n {
            let q = random.vector(n, 2.0);
            let jacobian = body.jacobian(&q, joint, point).expect("jacobian");
            let (rotation, _) = body.pose(&q, joint).expect("pose");
            for i in 0..n {
                let shifted = |step: f64| {
                    let mut q = q.clone();
                    q[i] += step;
                    let (r, p) = body.pose(&q, joint).expect("pose");
                    let tip = |k: usize| p[k] + (0..3).map(|j| r[k][j] * point[j]).sum::<f64>();
                    (r, [tip(0), tip(1), tip(2)])
                };
                let (high, low) = (shifted(h), shifted(-h));
                let slope = |k: usize, l: usize| (high.0[k][l] - low.0[k][l]) / (2.0 * h);
                // Spin from dR/dq R^T, a skew matrix.
                let skew = |k: usize, l: usize| (0..3).map(|j| slope(k, j) * rotation[l][j]).sum();
                let spin: [f64; 3] = [skew(2, 1), skew(0, 2), skew(1, 0)];
                for k in 0..3 {
                    let linear = (high.1[k] - low.1[k]) / (2.0 * h);
                    assert!(
                        (jacobian[(k, i)] - linear).abs() < tolerance,
                        "{joint} {i} {k}"
                    );
                    assert!(
                        (jacobian[(3 + k, i)] - spin[k]).abs() < tolerance,
                        "{joint} {i} {k}"
                    );
                }
            }
        }
    }
}

/// Potential of order 1e4 J over step 1e-4: rounding 1e-12 / 1e-4 = 1e-8, truncation
/// h^2 / 6 * 1e4 = 2e-5 Nm; both against gravity forces of order 1e4 Nm.
#[test]
fn gravity_is_the_slope_of_the_potential() {
    let h = 1e-4;
    let mut random = Random(4);
    for robot in both() {
        let body = RigidBody::new(&robot);
        let n = body.n_joints();
        for _ in 0..50 {
            let q = random.vector(n, 3.0);
            let gravity = body.gravity(&q).expect("gravity");
            for i in 0..n {
                let at = |step: f64| {
                    let mut q = q.clone();
                    q[i] += step;
                    body.energy(&q, &vec![0.0; n]).expect("energy").1
                };
                let slope = (at(h) - at(-h)) / (2.0 * h);
                assert!(
                    (gravity[i] - slope).abs() < 5e-5,
                    "{i}: {} {slope}",
                    gravity[i]
                );
            }
        }
    }
}

/// Lagrange: `c = M' v - d(v^T M v / 2)/dq`, which ties bias forces to the inertia
/// matrix whatever the joint kinds. Entries up to 1e4 kg m^2, v up to 2, step 1e-4:
/// truncation `h^2 / 6 * 8 * 7^2 * 1e4 * 4` = 3e-2 at the very worst, 1e-5 of the forces.
#[test]
fn velocity_forces_follow_from_the_inertia_matrix() {
    let h = 1e-4;
    let mut random = Random(5);
    for robot in both() {
        let body = RigidBody::new(&robot);
        let n = body.n_joints();
        for _ in 0..50 {
            let (q, v) = (random.vector(n, 3.0), random.vector(n, 2.0));
            let bias = body.bias(&q, &v).expect("bias");
            let gravity = body.gravity(&q).expect("gravity");
            let got: Vec<f64> = bias.iter().zip(&gravity).map(|(b, g)| b - g).collect();
            let slope = |i: usize| {
                let at = |step: f64| {
                    let mut q = q.clone();
                    q[i] += step;
                    DMatrix::from_row_slice(n, n, &body.inertia_matrix(&q).expect("M"))
                };
                (at(h) - at(-h)) / (2.0 * h)
            };
            let speed = nalgebra::DVector::from_column_slice(&v);
            let mut want = nalgebra::DVector::zeros(n);
            for i in 0..n {
                let along = slope(i) * &speed;
                want[i] -= 0.5 * speed.dot(&along);
                want += along * v[i];
            }
            let error = relative(&got, want.as_slice());
            assert!(error < 1e-5, "{error:.1e}");
        }
    }
}

#[test]
fn prismatic_joint_weighs_what_it_carries() {
    let robot = robot(MIXED);
    let body = RigidBody::new(&robot);
    assert_eq!(robot.joints[0].motion, Motion::Prismatic);
    let mut random = Random(6);
    for _ in 0..20 {
        let q = random.vector(4, 2.0);
        // A slide along x carries all 47 kg whatever the pose; gravity along x is 0.5.
        let m = body.inertia_matrix(&q).expect("M");
        assert!((m[0] - 47.0).abs() < 47.0 * 1e-15, "{}", m[0]);
        let g = body.gravity(&q).expect("gravity");
        assert!((g[0] + 47.0 * 0.5).abs() < 1e-13, "{}", g[0]);
    }
}

#[test]
fn wrong_shapes_are_refused_by_name() {
    let body = RigidBody::new(&robot(PRESET));
    let good = [0.1; 7];
    for (result, expected) in [
        (
            body.gravity(&good[..6]),
            "q: expected 7 joint values, got 6",
        ),
        (
            body.bias(&good, &good[..3]),
            "v: expected 7 joint values, got 3",
        ),
        (
            body.inverse_dynamics(&good, &good, &[]),
            "a: expected 7 joint values, got 0",
        ),
        (
            body.forward_dynamics(&good, &good, &[0.0, f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0]),
            "tau: expected finite values, got NaN at joint 2",
        ),
    ] {
        assert_eq!(result.expect_err("refused").to_string(), expected);
    }
    assert!(body.pose(&good, 7).is_err() && body.jacobian(&good, 7, [0.0; 3]).is_err());
}
