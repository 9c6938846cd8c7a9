//! A floating base: the same numbers as a tree on the six joints that stand for it.

use axisight_core::plant::{PlantError, assemble};
use axisight_core::robot::{
    BASE_COORDINATES, BaseMotion, Controller, FloatingBody, Joint, Link, RigidBody,
    RobotDescription,
};
use axisight_fit::regressor::{Motion, Regressor, link_parameters};
use axisight_tests::{PRESET, Random, relative, robot};

/// Sums of a few hundred products, rounded at 1.1e-16, give 1e-13 of the largest.
const TOLERANCE: f64 = 1e-12;

fn link(random: &mut Random) -> Link {
    let mut next = || random.within(1.0);
    Link {
        mass: 2.0 + next(),
        com: [next(), next(), next()],
        inertia: [2.0, 3.0, 4.0, 0.3 * next(), 0.3 * next(), 0.3 * next()],
    }
}

/// A robot with two arms on a floating base.
fn flyer(random: &mut Random) -> RobotDescription {
    let preset = robot(PRESET);
    let parents = [None, Some(0), Some(1), None, Some(3), Some(3)];
    let joints = parents.iter().enumerate().map(|(i, parent)| Joint {
        name: format!("j{i}"),
        parent: *parent,
        origin: [random.within(1.0), random.within(1.0), random.within(1.0)],
        axis: [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, 0.0, -1.0]][i % 3],
        compliance: None,
        link: Some(link(random)),
        ..preset.joints[0].clone()
    });
    RobotDescription {
        joints: joints.collect(),
        operating_point: vec![0.0; parents.len()],
        controller: Controller::None,
        floating_base: Some(link(random)),
        ..preset
    }
}

/// Positions, rates and accelerations of the joints that stand for a base, followed by `joints`.
fn on_joints(base: &BaseMotion, joints: &[Vec<f64>; 3]) -> [Vec<f64>; 3] {
    let [x, y, z] = base.angular_velocity;
    let carried = [y * z, -x * z, x * y];
    let turned = base.angular_acceleration.iter().zip(carried);
    let growth: Vec<f64> = turned.map(|(e, c)| e - c).collect();
    let [q, v, a] = joints;
    [
        [&[0.0; 6][..], q].concat(),
        [&[0.0, 0.0, 0.0, x, y, z][..], v].concat(),
        [&base.proper_acceleration[..], &growth, a].concat(),
    ]
}

#[test]
fn equals_the_tree_on_six_joints() {
    let mut random = Random(17);
    let robot = flyer(&mut random);
    let n = robot.n_joints();
    let body = FloatingBody::new(&robot).expect("a floating base");
    let tree = RigidBody::new(&robot.on_base_joints());
    let size = body.n_coordinates();
    assert_eq!(size, BASE_COORDINATES + n);
    let mut scratch = body.scratch();
    let mut vector = |k: usize| -> Vec<f64> { (0..k).map(|_| random.within(2.0)).collect() };
    for _ in 0..10 {
        let joints = [vector(n), vector(n), vector(n)];
        let [w, e, f] = [vector(3), vector(3), vector(3)].map(|x| [x[0], x[1], x[2]]);
        let base = BaseMotion {
            angular_velocity: w,
            angular_acceleration: e,
            proper_acceleration: f,
        };
        let [q, v, a] = on_joints(&base, &joints);
        let wanted = tree.inverse_dynamics(&q, &v, &a).expect("a motion");
        let mut forces = vec![0.0; size];
        let motion = [&joints[0][..], &joints[1], &joints[2]];
        body.inverse_dynamics(motion, &base, &mut scratch, &mut forces)
            .expect("a motion");
        assert!(relative(&forces, &wanted) < TOLERANCE);

        let mut inertia = vec![0.0; size * size];
        body.inertia_matrix(&joints[0], &mut scratch, &mut inertia)
            .expect("angles");
        let other = tree.inertia_matrix(&q).expect("angles");
        assert!(relative(&inertia, &other) < TOLERANCE);

        let mut found = vec![0.0; size];
        let state = [&joints[0][..], &joints[1], &forces];
        body.forward_dynamics(state, w, &mut scratch, &mut found)
            .expect("a state");
        let moved = [&f[..], &e, &joints[2]].concat();
        assert!(relative(&found, &moved) < 1e-10);

        let identity: Vec<f64> = (0..size * size)
            .map(|k| f64::from(u8::from(k / size == k % size)))
            .collect();
        let regressor = Regressor::new(&robot, &identity, Vec::new()).expect("rows");
        let motion = Motion {
            q: &q,
            v: &v,
            a: &a,
        };
        let matrix = regressor.evaluate(&motion).expect("a motion");
        let theta = link_parameters(&robot);
        let rows = matrix.chunks_exact(theta.len());
        let by_parameters: Vec<f64> = rows
            .map(|row| row.iter().zip(&theta).map(|(x, p)| x * p).sum())
            .collect();
        assert!(relative(&by_parameters, &forces) < TOLERANCE);
    }
}

#[test]
fn misuse_is_refused() {
    let mut random = Random(5);
    let robot = flyer(&mut random);
    let body = FloatingBody::new(&robot).expect("a floating base");
    let mut scratch = body.scratch();
    let mut out = vec![0.0; 144];
    let short = body.inertia_matrix(&[0.0; 5], &mut scratch, &mut out);
    assert_eq!(short.expect_err("five angles").field, "q");
    let state = [&[0.0; 6][..], &[0.0; 6], &[0.0; 6]];
    let forces = body.forward_dynamics(state, [0.0; 3], &mut scratch, &mut out);
    assert_eq!(forces.expect_err("six forces").field, "tau");
    assert_eq!(
        assemble::<f64>(&robot, &[], &[]).err(),
        Some(PlantError::FloatingBase)
    );
    let fixed = RobotDescription {
        floating_base: None,
        ..robot
    };
    assert!(FloatingBody::new(&fixed).is_none());
}
