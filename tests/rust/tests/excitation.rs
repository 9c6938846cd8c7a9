//! Line transforms and the search for low crest factors.
#![allow(missing_docs, clippy::unwrap_used)]

use axisight_numerics::LineTransform;
use axisight_spectra::excitation::crest::{
    Budget, Clipping, CrestProblem, LpRefinement, Start, peak, search,
};
use axisight_spectra::excitation::random_phases;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;
use std::sync::atomic::AtomicBool;

const LINES: [usize; 4] = [1, 5, 6, 30];

fn coefficients() -> Vec<Complex<f64>> {
    let phases = random_phases(LINES.len(), 1, 0);
    let amplitude = [1.0, 0.3, 2.0, 0.7];
    phases
        .iter()
        .zip(amplitude)
        .map(|(p, a)| Complex::from_polar(a, *p))
        .collect()
}

#[test]
fn synthesis_is_the_sum_of_lines() {
    let transform = LineTransform::<f64>::new(64, &LINES);
    let mut grid = transform.grid();
    let d = coefficients();
    transform.synthesize(&d, &mut grid);
    for (m, pair) in grid.pairs.iter().enumerate() {
        for (i, value) in [(2 * m, pair.re), (2 * m + 1, pair.im)] {
            let angle = |k: usize| Complex::from_polar(1.0, TAU * (k * i) as f64 / 128.0);
            let terms = LINES.iter().zip(&d).map(|(k, d)| (d * angle(*k)).re);
            assert!((value - terms.sum::<f64>()).abs() < 1e-13, "sample {i}");
        }
    }
}

#[test]
fn analysis_undoes_synthesis_and_ignores_other_lines() {
    let all: Vec<usize> = LINES.iter().copied().chain([7, 31]).collect();
    let wide = LineTransform::<f64>::new(50, &all);
    let narrow = LineTransform::<f64>::new(50, &LINES);
    let mut d = coefficients();
    d.extend([Complex::new(1.0, 2.0), Complex::new(-3.0, 0.5)]);
    let mut grid = wide.grid();
    wide.synthesize(&d, &mut grid);
    let mut back = vec![Complex::default(); LINES.len()];
    narrow.analyze(&mut grid, &mut back);
    for (a, b) in back.iter().zip(&d) {
        assert!((a - b).norm() < 1e-13);
    }
}

#[test]
fn peak_between_samples_is_found() {
    // Sines of known peak at phases that put it anywhere between grid points.
    for i in 0..50 {
        let phase = TAU * f64::from(i) / 50.0;
        let found = peak(&[7], &[3.0], &[phase]).unwrap();
        assert!((found / 3.0 - 1.0).abs() < 1e-5, "{found}");
    }
    // sin x + sin 3x: 8 / (3 sqrt 3).
    let found = peak(&[1, 3], &[1.0, 1.0], &[0.0, 0.0]).unwrap();
    assert!((found - 8.0 / 27f64.sqrt()).abs() < 1e-5);
}

#[test]
fn cancelled_before_the_first_start() {
    let lines: Vec<usize> = (1..50).collect();
    let problem = CrestProblem::new(&lines, &[1.0; 49], &[], 0.0).unwrap();
    let budget = Budget {
        starts: 3,
        time: None,
        threads: 1,
    };
    let run = |cancel| {
        let cancel = AtomicBool::new(cancel);
        let refinement = Some(LpRefinement::default());
        let start = Start::Random(0);
        search(
            &problem,
            &start,
            Clipping::default(),
            refinement,
            budget,
            &cancel,
        )
        .unwrap()
    };
    assert!(run(true).is_none());
    let found = run(false).unwrap();
    assert_eq!(found.crest_factors.len(), 3);
    assert!(!found.out_of_time);
}

#[test]
fn refinement_never_loses() {
    let lines: Vec<usize> = (1..60).collect();
    let problem = CrestProblem::new(&lines, &[1.0; 59], &[], 0.0).unwrap();
    let budget = Budget {
        starts: 4,
        time: None,
        threads: 1,
    };
    let best = |refinement| {
        let start = Start::Random(5);
        let cancel = AtomicBool::new(false);
        let clipping = Clipping::default();
        let found = search(&problem, &start, clipping, refinement, budget, &cancel);
        found.unwrap().unwrap().crest_factors
    };
    let plain = best(None);
    let refined = best(Some(LpRefinement::default()));
    assert!(plain.iter().zip(&refined).all(|(a, b)| b < a));
}
