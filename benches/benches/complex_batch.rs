//! Batched inversion of small complex matrices, one core: 1,000 at a time, in cache.

use axisight_numerics::{SmallSolver, Threads, invert_batch};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Complex;
use std::hint::black_box;

const COUNT: usize = 1000;

fn inversions(c: &mut Criterion) {
    let mut group = c.benchmark_group("complex_inversion");
    group.throughput(Throughput::Elements(COUNT as u64));
    for n in [3, 6] {
        let entry = |i: usize| Complex::new((i as f64 * 0.7).sin(), (i as f64 * 1.3).cos());
        let a: Vec<_> = (0..COUNT * n * n).map(|i| entry(i * i)).collect();
        let mut out = a.clone();
        group.bench_function(format!("batch {n}x{n}"), |b| {
            b.iter(|| invert_batch(black_box(&a), n, COUNT, &mut out, Threads::This));
        });
        let mut solver = SmallSolver::new(n);
        group.bench_function(format!("one by one {n}x{n}"), |b| {
            b.iter(|| {
                let pairs = a.chunks_exact(n * n).zip(out.chunks_exact_mut(n * n));
                pairs
                    .filter_map(|(a, out)| solver.invert(black_box(a), out).then_some(()))
                    .count()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, inversions);
criterion_main!(benches);
