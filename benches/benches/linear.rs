//! The linear closed loop with ripple and noise: batch against the plain loop, one core.
//!
//! Prints simulated seconds per second, the ratio of the two, and how far the batch is from
//! the peak of the machine, all measured in this run; then the criterion figures.

use axisight_benches::linear_loop::PlainLoop;
use axisight_benches::{preset, reference, table_8_1};
use axisight_core::robot::RobotDescription;
use axisight_core::simulation::{
    Drive, LinearPlant, Method, Run, Status, measurement_noise, simulate_linear,
};
use axisight_scalar::{Lanes, Scalar};
use criterion::{Criterion, Throughput, criterion_group};
use std::hint::black_box;
use std::time::Instant;

const SAMPLES: usize = 20_000;

struct Case {
    robot: RobotDescription,
    linear: LinearPlant,
    plain: PlainLoop,
    input: Vec<f64>,
}

#[allow(clippy::panic)] // a bench that cannot start says so
fn case() -> Case {
    let robot = preset();
    let ripple = table_8_1(robot.n_axes());
    let linear = LinearPlant::new(&robot, &ripple, &robot.operating_point)
        .unwrap_or_else(|error| panic!("{error}"));
    let Some(plain) = PlainLoop::new(&robot, &ripple) else {
        panic!("the plain loop expects the preset robot");
    };
    let input = reference(SAMPLES, robot.n_axes(), robot.sample_time);
    Case {
        robot,
        linear,
        plain,
        input,
    }
}

impl Case {
    fn noise(&self, run: u64) -> Vec<f64> {
        let std = self.robot.position_noise_std;
        measurement_noise(1, run, SAMPLES, self.robot.n_axes(), std)
    }

    /// Sum of the last commands, so that nothing is left out.
    fn batch<S: Scalar>(&self, noise: &[Vec<f64>]) -> f64 {
        let inputs = vec![&self.input[..]; S::LANES];
        let noise: Vec<&[f64]> = noise.iter().take(S::LANES).map(|n| &n[..]).collect();
        let run = Run {
            controller: &self.robot.controller,
            sample_time: self.robot.sample_time,
            start: &[&self.robot.operating_point],
            drive: Drive::Reference(&inputs),
            noise: &noise,
            resolution: 0.0,
            disturbances: false,
            accelerometers: false,
            method: Method::default(),
            cancel: None,
        };
        let mut last = S::zero();
        let status = simulate_linear::<S>(&self.linear, &run, &mut |s| last = s.command[0]);
        assert_eq!(status, Ok(Status::Completed));
        (0..S::LANES).map(|l| last.lane(l)).sum()
    }

    fn plain(&self, noise: &[f64]) -> f64 {
        let mut last = 0.0;
        self.plain
            .simulate(&self.input, noise, |u, _, _| last = u[0]);
        last
    }

    fn seconds(&self, runs: usize) -> f64 {
        runs as f64 * SAMPLES as f64 * self.robot.sample_time
    }
}

/// Shortest of several timings [s].
fn shortest(repeats: usize, mut work: impl FnMut() -> f64) -> f64 {
    let timings = (0..repeats).map(|_| {
        let begun = Instant::now();
        black_box(work());
        begun.elapsed().as_secs_f64()
    });
    timings.fold(f64::INFINITY, f64::min)
}

/// Fused multiply-adds of doubles per second at full tilt.
fn peak() -> f64 {
    const CHAINS: usize = 12;
    let steps = 2_000_000;
    let time = shortest(7, || {
        let mut x = [Lanes::<4>([1.0; 4]); CHAINS];
        let (a, b) = (
            black_box(Lanes([0.999_999; 4])),
            black_box(Lanes([1e-6; 4])),
        );
        for _ in 0..steps {
            for v in &mut x {
                *v = v.fma(a, b);
            }
        }
        x.iter().map(|v| v.lane(0)).sum()
    });
    f64::from(steps) * (CHAINS * 4) as f64 / time
}

fn line(case: &Case, label: &str, runs: usize, time: f64, plain: f64) -> f64 {
    let rate = case.seconds(runs) / time;
    println!(
        "{label:<28} {rate:>9.0} simulated s/s   {:>5.2} x plain",
        rate / plain
    );
    rate
}

fn summary() {
    let case = case();
    let noise: Vec<_> = (0..16).map(|run| case.noise(run)).collect();
    let difference = (case.plain(&noise[0]) - case.batch::<f64>(&noise)).abs();
    println!("last command, plain against batch: {difference:.1e} Nm apart");
    let plain = case.seconds(1) / shortest(7, || case.plain(&noise[0]));
    line(&case, "plain loop", 1, case.seconds(1) / plain, plain);
    line(
        &case,
        "f64",
        1,
        shortest(7, || case.batch::<f64>(&noise)),
        plain,
    );
    line(
        &case,
        "lanes 4",
        4,
        shortest(9, || case.batch::<Lanes<4>>(&noise)),
        plain,
    );
    let rate = line(
        &case,
        "lanes 8",
        8,
        shortest(9, || case.batch::<Lanes<8>>(&noise)),
        plain,
    );
    line(
        &case,
        "lanes 16",
        16,
        shortest(9, || case.batch::<Lanes<16>>(&noise)),
        plain,
    );
    let made = shortest(5, || case.noise(3)[5]);
    println!(
        "noise alone: {:.2} ns per number",
        made * 1e9 / (3 * SAMPLES) as f64
    );
    let per_run = case.seconds(8) / rate / 8.0 + made;
    line(&case, "lanes 8, noise included", 1, per_run, plain);
    line(
        &case,
        "plain, noise included",
        1,
        case.seconds(1) / plain + made,
        plain,
    );
    let count = case.linear.operations();
    let total = (count.propagation + count.harmonics) as f64;
    let samples = rate / case.robot.sample_time;
    let peak = peak();
    println!(
        "{} operations per sample ({} propagation, {} harmonics): {:.1} G/s, {:.0} % of the \
         AVX2 peak of {:.1} G/s",
        total,
        count.propagation,
        count.harmonics,
        total * samples * 1e-9,
        100.0 * total * samples / peak,
        peak * 1e-9
    );
}

fn loops(c: &mut Criterion) {
    let case = case();
    let noise: Vec<_> = (0..8).map(|run| case.noise(run)).collect();
    let mut group = c.benchmark_group("linear_loop");
    group.sample_size(10);
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.bench_function("plain", |b| b.iter(|| case.plain(black_box(&noise[0]))));
    group.throughput(Throughput::Elements(8 * SAMPLES as u64));
    group.bench_function("lanes8", |b| {
        b.iter(|| case.batch::<Lanes<8>>(black_box(&noise)))
    });
    group.finish();
}

criterion_group!(benches, loops);

fn main() {
    summary();
    if std::env::args().any(|a| a == "--summary") {
        return;
    }
    benches();
    Criterion::default().configure_from_args().final_summary();
}
