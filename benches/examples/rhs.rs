use axisight_benches::preset;
use axisight_core::robot::{Plant, equilibrium};
use axisight_core::scalar::{Lanes, Scalar};
use std::hint::black_box;
fn go<S: Scalar>(n: usize) {
    let robot = preset();
    let plant = Plant::<S>::new(&robot, &[], &[]).unwrap();
    let rest = equilibrium(&plant, &[0.3, -0.4, 0.5]).unwrap();
    let mut x = plant.state_at_rest(&rest.motor_angle, &rest.joint_angle);
    for (i, rate) in x.iter_mut().skip(10).enumerate() { *rate = S::constant(0.1 * i as f64 - 0.4); }
    let (mut scratch, mut dx) = (plant.scratch(), x.clone());
    let mut best = f64::INFINITY;
    for _ in 0..n / 500 {
    let t = std::time::Instant::now();
    for _ in 0..500 { plant.derivative(black_box(&x), &rest.motor_torque, &rest.motor_torque, &mut scratch, &mut dx); black_box(&dx); }
    best = best.min(t.elapsed().as_nanos() as f64 / 500.0); }
    println!("{} ns", best);
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let n: usize = a[2].parse().unwrap();
    match a[1].as_str() { "1" => go::<f64>(n), "4" => go::<Lanes<4>>(n), _ => go::<Lanes<8>>(n) }
}
