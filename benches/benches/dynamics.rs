//! Rigid-body algorithms, one right-hand side, and one second of closed loop.
//!
//! Times of lane types are per call, that is for all lanes together.

use axisight_benches::{preset, reference};
use axisight_core::plant::{assemble, equilibrium};
use axisight_core::robot::RigidBody;
use axisight_core::simulation::{Drive, Method, Run, Status, Stepper, simulate};
use axisight_scalar::{Dual, Lanes, Scalar};
use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

fn rigid_body(c: &mut Criterion) {
    let body = RigidBody::new(&preset());
    let q = [0.3, -0.4, 0.01, -0.02, 0.5, 0.01, -0.01];
    let v = [0.5, -0.2, 0.1, 0.05, 0.4, -0.1, 0.2];
    let a = [1.0, -2.0, 0.5, 0.3, -0.7, 0.1, 0.9];
    c.bench_function("inverse_dynamics/f64", |b| {
        b.iter(|| body.inverse_dynamics(black_box(&q), black_box(&v), black_box(&a)));
    });
    c.bench_function("forward_dynamics/f64", |b| {
        b.iter(|| body.forward_dynamics(black_box(&q), black_box(&v), black_box(&a)));
    });
}

fn right_hand_side<S: Scalar>(c: &mut Criterion, label: &str) {
    let robot = preset();
    let Ok(plant) = assemble::<S>(&robot, &[], &[]) else {
        return;
    };
    let Ok(rest) = equilibrium(&plant, &[0.3, -0.4, 0.5].map(S::constant)) else {
        return;
    };
    let mut x = plant.state_at_rest(&rest);
    for (i, rate) in x.iter_mut().skip(10).enumerate() {
        *rate = S::constant(0.1 * i as f64 - 0.4).seeded(i % 4);
    }
    let (mut scratch, mut dx) = (plant.scratch(), x.clone());
    let torque = &rest.motor_torque;
    c.bench_function(&format!("right_hand_side/{label}"), |b| {
        b.iter(|| {
            plant.derivative(
                black_box(&x),
                black_box(torque),
                torque,
                &mut scratch,
                &mut dx,
            );
            black_box(&dx);
        });
    });
}

fn right_hand_sides(c: &mut Criterion) {
    right_hand_side::<f64>(c, "f64");
    right_hand_side::<Lanes<4>>(c, "lanes4");
    right_hand_side::<Lanes<8>>(c, "lanes8");
    right_hand_side::<Dual<f64, 4>>(c, "dual4");
    right_hand_side::<Dual<Lanes<4>, 4>>(c, "dual4_lanes4");
    right_hand_side::<Dual<Lanes<8>, 4>>(c, "dual4_lanes8");
}

/// One second at 2 kHz, one Runge-Kutta step per sample.
fn closed_loop<S: Scalar>(c: &mut Criterion, label: &str) {
    let robot = preset();
    let Ok(plant) = assemble::<S>(&robot, &[], &[]) else {
        return;
    };
    let input = reference(2000, robot.n_axes(), robot.sample_time);
    let inputs = vec![&input[..]; S::LANES];
    let run = Run {
        controller: &robot.controller,
        sample_time: robot.sample_time,
        start: &[&robot.operating_point],
        drive: Drive::Reference(&inputs),
        noise: &[],
        resolution: 0.0,
        disturbances: false,
        accelerometers: false,
        method: Method::RungeKutta4 { substeps: 1 },
        cancel: None,
    };
    let mut stepper = Stepper::new(&plant);
    let mut group = c.benchmark_group("closed_loop_second");
    group.sample_size(20);
    group.bench_function(label, |b| {
        b.iter(|| {
            let mut last = S::zero();
            let status = simulate(&plant, &run, &mut stepper, &mut |s| last = s.command[0]);
            assert_eq!(status, Ok(Status::Completed));
            black_box(last)
        });
    });
    group.finish();
}

fn closed_loops(c: &mut Criterion) {
    closed_loop::<f64>(c, "f64");
    closed_loop::<Lanes<4>>(c, "lanes4");
    closed_loop::<Lanes<8>>(c, "lanes8");
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(50).measurement_time(std::time::Duration::from_secs(2));
    targets = rigid_body, right_hand_sides, closed_loops
}
criterion_main!(benches);
