//! The torque regressor against inverse dynamics, and its triangular factors against it.
#![allow(clippy::unwrap_used)]

use axisight_core::robot::{RigidBody, RobotDescription};
use axisight_fit::regressor::{Extra, FactorRequest, Motion, Regressor, Signal, link_parameters};
use axisight_tests::{ARM, PRESET, Random, largest, relative, robot};

fn identity(n: usize) -> Vec<f64> {
    (0..n * n)
        .map(|k| f64::from(u8::from(k / n == k % n)))
        .collect()
}

fn joints(robot: &RobotDescription) -> Regressor {
    Regressor::new(robot, &identity(robot.n_joints()), Vec::new()).unwrap()
}

/// Position, velocity and acceleration of `n` samples.
fn states(robot: &RobotDescription, n: usize) -> [Vec<f64>; 3] {
    let mut random = Random(3);
    [3.0, 2.0, 5.0].map(|size| random.vector(n * robot.n_joints(), size))
}

#[test]
fn times_parameters_is_inverse_dynamics() {
    for text in [PRESET, ARM] {
        let robot = robot(text);
        let (body, regressor) = (RigidBody::new(&robot), joints(&robot));
        let n = robot.n_joints();
        let [q, v, a] = states(&robot, 21);
        let motion = Motion {
            q: &q,
            v: &v,
            a: &a,
        };
        let phi = regressor.evaluate(&motion).unwrap();
        let theta = link_parameters(&robot);
        let torque: Vec<f64> = phi
            .chunks_exact(theta.len())
            .map(|row| row.iter().zip(&theta).map(|(x, p)| x * p).sum())
            .collect();
        for k in 0..21 {
            let at = k * n..(k + 1) * n;
            let want = body
                .inverse_dynamics(&q[at.clone()], &v[at.clone()], &a[at.clone()])
                .unwrap();
            assert!(relative(&torque[at], &want) < 1e-12);
        }
        let energy = regressor.energy(&q, &v).unwrap();
        for (k, row) in energy.chunks_exact(theta.len()).enumerate() {
            let at = k * n..(k + 1) * n;
            let (kinetic, potential) = body.energy(&q[at.clone()], &v[at]).unwrap();
            let got: f64 = row.iter().zip(&theta).map(|(x, p)| x * p).sum();
            assert!((got - kinetic - potential).abs() < 1e-12 * (kinetic + potential.abs()));
        }
    }
}

#[test]
fn factors_have_the_normal_equations_of_the_regressor() {
    let robot = robot(PRESET);
    let n = robot.n_joints();
    let samples = 700;
    let extra = Extra {
        signal: Signal::Direction {
            dead_band: 0.1,
            smoothing: 0.0,
        },
        motion: identity(n)[..n].to_vec(),
        rows: vec![1.0; n],
    };
    let regressor = Regressor::new(&robot, &identity(n), vec![extra]).unwrap();
    let [q, v, a] = states(&robot, samples);
    let motion = Motion {
        q: &q,
        v: &v,
        a: &a,
    };
    let p = regressor.n_parameters();
    let mut random = Random(9);
    let torque = random.vector(samples * n, 1.0);
    let weight: Vec<f64> = random
        .vector(samples * n, 1.0)
        .iter()
        .map(|w| w + 1.0)
        .collect();
    let columns = [6, 10, 13, 22, 30];
    let mut known = vec![0.0; p];
    known[12] = 0.7;
    let request = FactorRequest {
        torque: &torque,
        weight: Some(&weight),
        columns: &columns,
        known: &known,
        blocks: 3,
    };
    let factors = regressor.factors(&motion, &request).unwrap();
    assert_eq!(factors.lengths, [233, 233, 234]);
    let phi = regressor.evaluate(&motion).unwrap();
    let order = columns.len() + 1;
    let mut first = 0;
    for (block, length) in factors.lengths.iter().enumerate() {
        for row in 0..n {
            let start = (block * n + row) * order * order;
            let r = &factors.factor[start..start + order * order];
            let line = |k: usize| -> Vec<f64> {
                let at = (first + k) * n + row;
                let h = &phi[at * p..(at + 1) * p];
                let rest = torque[at] - 0.7 * h[12];
                let kept = columns.iter().map(|c| h[*c]).chain([rest]);
                kept.map(|x| x * weight[at]).collect()
            };
            for i in 0..order {
                for j in 0..order {
                    let want: f64 = (0..*length).map(|k| line(k)[i] * line(k)[j]).sum();
                    let got: f64 = (0..order)
                        .map(|k| r[k * order + i] * r[k * order + j])
                        .sum();
                    assert!(
                        (got - want).abs() < 1e-10 * (1.0 + want.abs()),
                        "{row} {i} {j}"
                    );
                    assert!(i <= j || r[i * order + j] == 0.0);
                }
            }
        }
        first += length;
    }
}

#[test]
fn misuse_names_the_field() {
    let robot = robot(ARM);
    let regressor = joints(&robot);
    let good = [0.0; 4];
    let motion = |q: &'static [f64]| Motion {
        q,
        v: &[0.0; 4],
        a: &[0.0; 4],
    };
    let error = regressor.evaluate(&motion(&[0.0; 6])).unwrap_err();
    assert_eq!(error.to_string(), "v: expected 3 rows of 2 numbers, got 4");
    let error = regressor
        .evaluate(&motion(&[0.0, 0.0, f64::NAN, 0.0]))
        .unwrap_err();
    assert_eq!(error.field, "q");
    let request = FactorRequest {
        torque: &good,
        weight: None,
        columns: &[3, 2],
        known: &[0.0; 20],
        blocks: 1,
    };
    let still = motion(&[0.0; 4]);
    let fails = |request: &FactorRequest<'_>| regressor.factors(&still, request).unwrap_err().field;
    assert_eq!(fails(&request), "columns");
    let columns: &[usize] = &[2, 20];
    assert_eq!(fails(&FactorRequest { columns, ..request }), "columns");
    let columns: &[usize] = &[2, 3];
    assert_eq!(
        fails(&FactorRequest {
            columns,
            blocks: 3,
            ..request
        }),
        "blocks"
    );
    assert_eq!(
        fails(&FactorRequest {
            columns,
            known: &good,
            ..request
        }),
        "known"
    );
    assert_eq!(
        fails(&FactorRequest {
            columns,
            torque: &[0.0; 3],
            ..request
        }),
        "torque"
    );
    let weight: Option<&[f64]> = Some(&[f64::INFINITY; 4]);
    assert_eq!(
        fails(&FactorRequest {
            columns,
            weight,
            ..request
        }),
        "weight"
    );
    assert_eq!(
        Regressor::new(&robot, &[], Vec::new()).unwrap_err().field,
        "rows"
    );
    assert_eq!(
        Regressor::new(&robot, &[0.0; 3], Vec::new())
            .unwrap_err()
            .field,
        "rows"
    );
    let extra = Extra {
        signal: Signal::Constant,
        motion: vec![1.0],
        rows: vec![1.0; 2],
    };
    let wrong = Regressor::new(&robot, &identity(2), vec![extra]).unwrap_err();
    assert_eq!(wrong.field, "extras.motion");
    let none = joints(&robot)
        .evaluate(&Motion {
            q: &[],
            v: &[],
            a: &[],
        })
        .unwrap();
    assert!(largest(&none) == 0.0 && none.is_empty());
}
