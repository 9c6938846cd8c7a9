//! Accumulators, small complex systems, the DFT convention.

use axisight_numerics::{Dft, DftScratch, SmallSolver};
use axisight_spectra::ensemble::{Moments, Purpose, QuantileSketch, generator};
use axisight_spectra::excitation::{Grid, Multisine, Square, directions};
use axisight_spectra::frf::{Output, Spectra, response};
use axisight_tests::Random;
use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

fn numbers(n: usize, seed: u64) -> Vec<C> {
    let mut random = Random(seed);
    (0..n)
        .map(|_| C::new(random.within(2.0) + 3.0, random.within(2.0)))
        .collect()
}

fn moments(values: &[C]) -> Moments {
    let mut out = Moments::new(1);
    for v in values {
        out.push(0, *v);
        out.push_inverse(0, v.inv());
    }
    out
}

#[test]
fn merging_parts_equals_counting_all() {
    let values = numbers(97, 1);
    let whole = moments(&values);
    let mut merged = Moments::new(1);
    for part in values.chunks(13) {
        merged.merge(&moments(part)).unwrap();
    }
    assert_eq!(merged.count, whole.count);
    // Sums of 97 terms of size ten: 97 * 10 * 2e-16, with a margin of ten.
    for (a, b) in merged.values.iter().zip(&whole.values) {
        assert!((a - b).abs() < 2e-12, "{a} {b}");
    }
    // An empty accumulator on either side changes nothing at all.
    let mut kept = whole.clone();
    kept.merge(&Moments::new(1)).unwrap();
    assert_eq!(kept, whole);
    let mut empty = Moments::new(1);
    empty.merge(&whole).unwrap();
    assert_eq!(empty, whole);
    assert!(empty.merge(&Moments::new(2)).is_err());
}

#[test]
fn phases_that_wrap_have_a_mean() {
    // Either side of pi: the mean of the arguments would be near zero.
    let values: Vec<C> = [3.1, -3.1, 3.0, -3.0]
        .iter()
        .map(|p| C::from_polar(2.0, *p))
        .collect();
    let m = moments(&values);
    let mean = C::new(m.values[7], m.values[8]);
    assert!((mean.arg().abs() - std::f64::consts::PI).abs() < 1e-15);
    assert!((m.values[5].exp() - 2.0).abs() < 1e-15);
}

#[test]
fn a_zero_response_is_no_infinity() {
    let m = moments(&[C::new(0.0, 0.0), C::new(1.0, 0.0)]);
    assert!(m.values[..9].iter().all(|v| v.is_finite()));
}

#[test]
fn sketches_merge_exactly_and_keep_their_accuracy() {
    let mut random = Random(5);
    let values: Vec<f64> = (0..500).map(|_| random.within(12.0).exp()).collect();
    let count = |part: &[f64]| {
        let mut s = QuantileSketch::new(1, 0.01).unwrap();
        part.iter().for_each(|v| s.push(0, *v));
        s
    };
    let (a, b, c) = (
        count(&values[..100]),
        count(&values[100..230]),
        count(&values[230..]),
    );
    let merge = |x: &QuantileSketch, y: &QuantileSketch| {
        let mut out = x.clone();
        out.merge(y).unwrap();
        out
    };
    assert_eq!(merge(&merge(&a, &b), &c), merge(&a, &merge(&b, &c)));
    assert_eq!(merge(&merge(&c, &a), &b), count(&values));
    let mut sorted = values.clone();
    sorted.sort_by(f64::total_cmp);
    for q in [0.0, 0.05, 0.5, 0.77, 1.0] {
        let exact = sorted[(q * 499.0_f64).floor() as usize];
        let got = count(&values).quantile(0, q);
        assert!((got / exact - 1.0).abs() <= 0.01 * (1.0 + 1e-9), "{q}");
    }
    let whole = count(&values);
    let (starts, buckets, counts) = whole.to_parts();
    let again = QuantileSketch::from_parts(0.01, &starts, &buckets, &counts).unwrap();
    assert_eq!(again, whole);
    assert!(QuantileSketch::from_parts(0.01, &[0, 900], &buckets, &counts).is_err());
    assert!(QuantileSketch::from_parts(0.01, &[5, 2], &buckets, &counts).is_err());
    assert!(QuantileSketch::new(1, 0.0).is_err());
    assert!(
        QuantileSketch::new(1, 0.01)
            .unwrap()
            .quantile(0, 0.5)
            .is_nan()
    );
}

#[test]
fn small_systems_solve_and_singular_ones_say_so() {
    for n in 1..=6 {
        let (u, g) = (numbers(n * n, n as u64), numbers(n * n, 40 + n as u64));
        let y = DMatrix::from_row_slice(n, n, &g) * DMatrix::from_row_slice(n, n, &u);
        let y: Vec<C> = y.transpose().iter().copied().collect();
        let mut solver = SmallSolver::new(n);
        let mut out = vec![C::default(); n * n];
        assert!(solver.right_divide(&y, &u, &mut out));
        for (a, b) in out.iter().zip(&g) {
            assert!((a - b).norm() < 1e-9, "{n}: {a} {b}");
        }
        let mut twice = u.clone();
        if n > 1 {
            let first: Vec<C> = u[..n].iter().map(|c| c * 3.0).collect();
            twice[n..2 * n].copy_from_slice(&first);
            let before = out.clone();
            assert!(!solver.right_divide(&y, &twice, &mut out));
            assert_eq!(out, before);
        }
        let mut bad = u.clone();
        bad[0].re = f64::NAN;
        assert!(!solver.right_divide(&y, &bad, &mut out));
        assert!(!solver.invert(&vec![C::default(); n * n], &mut out));
    }
}

#[test]
fn singular_lines_are_counted_and_nan() {
    let spectra = |a: [f64; 2], b: [f64; 2]| Spectra {
        input: [a, b].concat().iter().map(|v| C::new(*v, 0.0)).collect(),
        output: vec![C::new(1.0, 1.0); 4],
    };
    // Two lines, two axes; on the second line both experiments are the same.
    let runs = [
        spectra([1.0, 0.0], [1.0, 2.0]),
        spectra([0.0, 1.0], [1.0, 2.0]),
    ];
    let (g, singular) = response(&runs, &[1.0, 2.0], Output::Position);
    assert_eq!(singular, 1);
    assert!(g[..4].iter().all(|c| (c - C::new(1.0, 1.0)).norm() < 1e-15));
    assert!(g[4..].iter().all(|c| c.re.is_nan()));
}

#[test]
fn the_dft_is_the_documented_one() {
    let n = 60;
    let mut random = Random(3);
    let (a, b) = (random.vector(n, 1.0), random.vector(n, 5.0));
    let lines = [1, 7, 29, 30];
    let dft = Dft::new(n);
    let mut scratch = DftScratch::default();
    let pairs = a.iter().copied().zip(b.iter().copied());
    dft.pair(pairs, &lines, &mut scratch, |i, x, y| {
        for (series, got) in [(&a, x), (&b, y)] {
            let sum: C = (0..n)
                .map(|k| {
                    let turn = -std::f64::consts::TAU * (lines[i] * k) as f64 / n as f64;
                    C::from_polar(series[k], turn)
                })
                .sum();
            assert!((sum / (n as f64).sqrt() - got).norm() < 1e-13);
        }
    });
    let x = dft.sum_of_sines(&[3, 5], &[2.0, 0.5], &[0.3, -1.0]);
    for (k, v) in x.iter().enumerate() {
        let t = std::f64::consts::TAU * k as f64 / n as f64;
        let want = 2.0 * (3.0 * t + 0.3).sin() + 0.5 * (5.0 * t - 1.0).sin();
        assert!((v - want).abs() < 1e-13);
    }
}

#[test]
fn multisines_keep_band_grid_and_peak() {
    let odd = Multisine::new(1.0, (4.0, 9.0), Grid::Odd, 3.0, 1e-3).unwrap();
    assert_eq!(odd.lines(), [5, 7, 9]);
    let x = odd.period(&odd.phases(1, 2));
    let peak = x.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    assert!((peak - 3.0).abs() < 1e-14);
    assert_eq!(odd.phases(1, 2), odd.phases(1, 2));
    assert_ne!(odd.phases(1, 2), odd.phases(1, 3));
    let all = Multisine::new(0.1, (10.0, 40.0), Grid::All, 1.0, 5e-4).unwrap();
    assert_eq!(all.lines(), [1, 2, 3, 4]);
    for (period, band) in [
        (-1.0, (1.0, 2.0)),
        (f64::NAN, (1.0, 2.0)),
        (0.00133, (1.0, 2.0)),
        (1.0, (2.0, 1.0)),
        (1.0, (1.0, 500.0)),
        (1.0, (1.1, 1.9)),
    ] {
        assert!(Multisine::new(period, band, Grid::All, 1.0, 1e-3).is_err());
    }
}

/// Crest factor of the samples of one period of lines of equal amplitude.
fn crest_factor(x: &[f64]) -> f64 {
    let peak = x.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let power = x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
    peak / power.sqrt()
}

#[test]
fn clipped_multisines_have_a_low_crest_factor() {
    let random = Multisine::new(2.0, (1.0, 40.0), Grid::All, 8.0, 1e-3).unwrap();
    let clipped = random.clone().with_clipping(100);
    for run in 0..5 {
        let phases = clipped.phases(3, run);
        assert_eq!(phases, clipped.phases(3, run));
        let x = clipped.period(&phases);
        // 79 lines reach 1.5 to 1.6; random phases have 2.7 and more.
        assert!(crest_factor(&x) < 1.8);
        assert!(crest_factor(&random.period(&random.phases(3, run))) > 2.2);
    }
    assert_ne!(clipped.phases(3, 0), clipped.phases(3, 1));
    assert_eq!(
        random.clone().with_clipping(0).phases(3, 0),
        random.phases(3, 0)
    );
}

#[test]
fn square_waves_are_smoothed_by_a_triangle() {
    let x = Square::new(9.6, 0.5, 40, 5e-4).unwrap().period();
    // Direct sum of (7.3).
    let level = |i: i64| if i.rem_euclid(1000) < 500 { 9.6 } else { -9.6 };
    for i in 0..1000_i64 {
        let sum: f64 = (-40..=40_i64)
            .map(|k| (41 - k.abs()) as f64 / (41.0 * 41.0) * level(i + k))
            .sum();
        assert!((x[i as usize] - sum).abs() < 1e-13, "{i}");
    }
    assert!(Square::new(9.6, 0.5005, 40, 5e-4).is_err());
    assert!(Square::new(9.6, 0.5, 260, 5e-4).is_err());
}

#[test]
fn directions_are_those_of_the_thesis() {
    assert_eq!(
        directions("t2", 3).unwrap(),
        [1.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0, -1.0]
    );
    let h = DMatrix::from_row_slice(4, 4, &directions("hadamard", 4).unwrap());
    assert_eq!(&h * h.transpose(), DMatrix::identity(4, 4) * 4.0);
    assert!(directions("hadamard", 3).is_err());
    assert!(directions("t2", 2).is_err());
    assert!(directions("t3", 3).is_err());
}

#[test]
fn purposes_and_runs_have_streams_of_their_own() {
    use rand::RngCore;
    let first = |purpose, run| generator(9, purpose, run).next_u64();
    let all = [
        first(Purpose::Phases, 0),
        first(Purpose::Phases, 1),
        first(Purpose::Spread, 0),
        first(Purpose::Spread, 1),
        generator(10, Purpose::Phases, 0).next_u64(),
    ];
    for (i, a) in all.iter().enumerate() {
        assert!(all[..i].iter().all(|b| a != b));
    }
}
