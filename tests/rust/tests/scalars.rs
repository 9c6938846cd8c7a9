//! One model, several scalars: the same numbers whichever carries them.

use axisight_core::robot::EffectSetting;
use axisight_core::simulation::{Drive, Method, Status, measurement_noise};
use axisight_scalar::{Dual, DualNumber, Lanes, Partials, Register, Scalar};
use axisight_tests::{PRESET, Random, Trace, effect, plant, robot, sines, trace};
use nalgebra::Complex;

const SAMPLES: usize = 150;

/// Effects that go through every elementary function and every point of action.
fn settings<S: Scalar>() -> Vec<EffectSetting<S>> {
    vec![
        effect("stribeck_friction", Some(0), &[0.5, 0.3, 3.0, 0.1, 0.0]),
        effect("nonlinear_stiffness", Some(1), &[2e11]),
        effect("backlash", Some(0), &[1e-4, 0.3]),
        effect(
            "torque_ripple",
            Some(2),
            &[
                3.0, 0.05, 0.02, 36.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 18.0,
                0.03, 0.01,
            ],
        ),
        effect(
            "resolver_ripple",
            Some(1),
            &[
                2.0, 4e-4, 1e-4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
            ],
        ),
        effect("input_delay", Some(2), &[0.7e-3]),
        effect("actuator_bandwidth", Some(1), &[1e-3]),
        effect("torque_constant", Some(1), &[0.05]),
        effect("payload", None, &[20.0, 1.0, 0.0, 0.2, 0.0]),
    ]
}

/// References of different size and length, noise of its own, per lane.
fn inputs(n_axes: usize, sample_time: f64) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    (0..4)
        .map(|lane| {
            let n = SAMPLES - 10 * lane;
            let size = 1.0 + lane as f64;
            let noise = measurement_noise(7, lane as u64, n, n_axes, 1.2e-5);
            (sines(n, n_axes, sample_time, size), noise)
        })
        .unzip()
}

fn run<S: Scalar>(settings: &[EffectSetting<S>], lanes: &[usize], substeps: usize) -> Trace<S> {
    let robot = robot(PRESET);
    let (references, noises) = inputs(robot.n_axes(), robot.sample_time);
    let pick =
        |from: &[Vec<f64>]| -> Vec<Vec<f64>> { lanes.iter().map(|l| from[*l].clone()).collect() };
    let (references, noises) = (pick(&references), pick(&noises));
    let references: Vec<&[f64]> = references.iter().map(|r| &r[..]).collect();
    let noises: Vec<&[f64]> = noises.iter().map(|r| &r[..]).collect();
    let method = Method::RungeKutta4 { substeps };
    let plant = plant::<S>(&robot, settings);
    let out = trace(
        &plant,
        &robot,
        Drive::Reference(&references),
        &noises,
        method,
    );
    assert_eq!(out.status, Status::Completed);
    out
}

/// States of one lane, sample after sample, followed by commands and measurements.
fn lane_of<S: Scalar>(trace: &Trace<S>, lane: usize, n: usize) -> Vec<f64> {
    let states = trace.states.iter().take(n).flatten();
    let n_axes = trace.command.len() / trace.states.len();
    let signals = trace
        .command
        .iter()
        .take(n * n_axes)
        .chain(trace.measured.iter().take(n * n_axes));
    states.chain(signals).map(|x| x.lane(lane)).collect()
}

#[test]
fn every_lane_is_the_single_run_bit_for_bit() {
    for substeps in [1, 2] {
        let together = run::<Lanes<4>>(&settings(), &[0, 1, 2, 3], substeps);
        for lane in 0..4 {
            let alone = run::<f64>(&settings(), &[lane], substeps);
            let n = alone.states.len();
            assert_eq!(n, SAMPLES - 10 * lane);
            let (got, want) = (lane_of(&together, lane, n), lane_of(&alone, 0, n));
            let differing = got
                .iter()
                .zip(&want)
                .filter(|(a, b)| a.to_bits() != b.to_bits())
                .count();
            assert_eq!(differing, 0, "lane {lane} of {} numbers", want.len());
        }
    }
}

#[test]
fn lanes_do_not_depend_on_their_neighbours() {
    let pair = run::<Lanes<2>>(&settings(), &[2, 0], 1);
    let four = run::<Lanes<4>>(&settings(), &[0, 1, 2, 3], 1);
    let n = SAMPLES - 20;
    assert_eq!(lane_of(&pair, 0, n), lane_of(&four, 2, n));
    assert_eq!(lane_of(&pair, 1, n), lane_of(&four, 0, n));
}

/// The value part of a dual number differs from a plain run by the rounding of `a / b`
/// as `a * (1 / b)`: 1e-16 per division, amplified by the stiff springs to below 1e-10.
#[test]
fn derivatives_ride_along_without_changing_the_run() {
    let plain = run::<f64>(&settings(), &[0], 1);
    let dual = run::<Dual<f64, 2>>(&seeded(), &[0], 1);
    let (got, want) = (lane_of(&dual, 0, SAMPLES), lane_of(&plain, 0, SAMPLES));
    let error = axisight_tests::relative(&got, &want);
    assert!(error < 1e-10, "{error:.1e}");
}

/// Derivatives along Coulomb level (axis 1) and time constant (axis 2).
fn seeded<S: Scalar>() -> Vec<EffectSetting<S>> {
    let mut out = settings::<S>();
    out[0].parameters[0] = out[0].parameters[0].seeded(0);
    out[6].parameters[0] = out[6].parameters[0].seeded(1);
    out
}

#[test]
fn derivative_of_a_lane_is_the_derivative_of_the_single_run() {
    let together = run::<Dual<Lanes<2>, 2>>(&seeded(), &[1, 3], 1);
    for (lane, which) in [(0, 1), (1, 3)] {
        let alone = run::<Dual<f64, 2>>(&seeded(), &[which], 1);
        let n_axes = 3;
        let mut seen = 0.0_f64;
        for k in 0..alone.states.len() * n_axes {
            for seed in 0..2 {
                let (a, b) = (
                    together.command[k].partial(seed, lane),
                    alone.command[k].partial(seed, 0),
                );
                assert_eq!(
                    a.to_bits(),
                    b.to_bits(),
                    "lane {lane}, entry {k}, seed {seed}"
                );
                seen = seen.max(a.abs());
            }
        }
        assert!(seen > 1e-3, "no derivative at all: {seen}");
    }
}

#[test]
fn elementary_functions_of_dual_numbers_have_their_slopes() {
    // Central differences with step 1e-6: truncation below 1e-11, rounding 1e-16 / 1e-6 = 1e-10.
    let h = 1e-6;
    type D = Dual<f64, 1>;
    type Function = fn(D) -> D;
    let functions: [(&str, Function); 8] = [
        ("sin", |x| x.sin_cos().0),
        ("cos", |x| x.sin_cos().1),
        ("exp", Scalar::exp),
        ("tanh", Scalar::tanh),
        ("sqrt", Scalar::sqrt),
        ("recip", Scalar::recip),
        ("abs", Scalar::abs),
        ("quotient", |x| (x * x - 2.0) / (x + 0.3)),
    ];
    for (name, f) in functions {
        for x in [0.2, 0.9, 1.7] {
            let exact = f(D::constant(x).seeded(0)).partials[0];
            let at = |x: f64| f(D::constant(x)).value;
            let slope = (at(x + h) - at(x - h)) / (2.0 * h);
            assert!(
                (exact - slope).abs() < 1e-9 * exact.abs().max(1.0),
                "{name}({x}): {exact} {slope}"
            );
        }
    }
}

/// Every operation on dual numbers once, with branches taken either way.
#[inline(always)]
fn every_operation<P: Partials<f64>>(numbers: &[DualNumber<f64, P>; 3], out: &mut [Vec<f64>; 2]) {
    let [x, y, z] = *numbers;
    let (s, c) = x.sin_cos();
    let mut sum = x;
    sum += y;
    sum -= z * 3.0;
    let results = [
        x + y,
        x - y,
        x * y,
        x / y,
        -x,
        x + 0.3,
        x - 0.3,
        x * 0.7,
        x.fma(y, z),
        x.axpy(0.7, z),
        x.recip(),
        x.square().sqrt(),
        s,
        c,
        x.exp(),
        x.tanh(),
        x.abs(),
        x.if_positive(y, z),
        sum,
    ];
    for result in &results {
        out[0].push(result.lane(0));
        out[1].extend((0..8).map(|i| result.partial(i, 0)));
    }
}

/// Results for pairs of numbers made from `numbers`, eight partials each.
#[inline(always)]
fn all_operations<P: Partials<f64>>(numbers: &[[f64; 9]]) -> [Vec<f64>; 2] {
    let mut out = [Vec::new(), Vec::new()];
    for triple in numbers.windows(3) {
        let number = |n: &[f64; 9]| {
            // `value + sum_i slope_i eps_i` from constants and seeds.
            let mut x = DualNumber::<f64, P>::constant(n[0]);
            for (i, slope) in n[1..].iter().enumerate() {
                x += (DualNumber::constant(0.0).seeded(i)) * *slope;
            }
            x
        };
        let numbers = [number(&triple[0]), number(&triple[1]), number(&triple[2])];
        every_operation(&numbers, &mut out);
    }
    out
}

fn random_numbers() -> Vec<[f64; 9]> {
    let mut random = Random(5);
    (0..200)
        .map(|_| std::array::from_fn(|_| random.within(3.0)))
        .collect()
}

fn assert_same_bits(got: &[Vec<f64>; 2], want: &[Vec<f64>; 2]) {
    for (got, want) in got.iter().zip(want) {
        assert_eq!(got.len(), want.len());
        for (i, (a, b)) in got.iter().zip(want).enumerate() {
            assert_eq!(a.to_bits(), b.to_bits(), "number {i}: {a} {b}");
        }
    }
}

#[test]
fn partials_in_a_register_are_the_partials_in_an_array_bit_for_bit() {
    let numbers = random_numbers();
    let array = all_operations::<[f64; 8]>(&numbers);
    assert_same_bits(&all_operations::<Lanes<8>>(&numbers), &array);
    let moving = array[1].iter().filter(|x| **x != 0.0).count();
    assert!(2 * moving > array[1].len(), "derivatives of constants");
}

#[cfg(target_arch = "x86_64")]
#[test]
fn partials_in_a_wide_register_are_the_same_bit_for_bit() {
    use axisight_scalar::wide::{Wide, available};

    #[target_feature(enable = "avx512f,avx512dq")]
    fn wide(numbers: &[[f64; 9]]) -> [Vec<f64>; 2] {
        all_operations::<Wide>(numbers)
    }
    if available() {
        let numbers = random_numbers();
        // SAFETY: the processor has the instructions.
        #[allow(unsafe_code)]
        let got = unsafe { wide(&numbers) };
        assert_same_bits(&got, &all_operations::<[f64; 8]>(&numbers));
    }
}

#[test]
fn a_factor_without_derivatives_is_a_constant() {
    // `axpy` leaves products with zero out; the sums are the same.
    type D = Dual<Lanes<2>, 3>;
    let mut random = Random(9);
    for _ in 0..100 {
        let mut number = || D {
            value: Lanes([random.within(3.0), random.within(3.0)]),
            partials: std::array::from_fn(|_| Lanes([random.within(3.0), random.within(3.0)])),
        };
        let (x, y) = (number(), number());
        assert_eq!(x.axpy(-1.7, y), x.fma(D::constant(-1.7), y));
    }
    assert_eq!(2.0.axpy(3.0, 1.0), 7.0);
}

fn registers_of<const L: usize>() {
    let mut random = Random(L as u64);
    let (x, y) = (random.vector(L, 3.0), random.vector(L, 3.0));
    let (a, b) = (Lanes::<L>::load(&x), Lanes::<L>::load(&y));
    let mut out = vec![0.0; L + 1];
    let mut check = |name: &str, result: Lanes<L>, plain: &dyn Fn(f64, f64) -> f64| {
        out[L] = 7.0;
        result.store(&mut out);
        for lane in 0..L {
            let want = plain(x[lane], y[lane]);
            assert_eq!(out[lane].to_bits(), want.to_bits(), "{name}, {L} lanes");
        }
        assert_eq!(out[L], 7.0, "{name} writes beyond {L} lanes");
    };
    check("+", a + b, &|a, b| a + b);
    check("-", a - b, &|a, b| a - b);
    check("*", a * b, &|a, b| a * b);
    check("neg", -a, &|a, _| -a);
    check("fma", Register::fma(a, b, a), &|a, b| a.mul_add(b, a));
    check("fnma", Register::fnma(a, b, a), &|a, b| (-a).mul_add(b, a));
    check("recip", Register::recip(a), &|a, _| 1.0 / a);
    check("choice", Register::if_positive(a, b, a), &|a, b| {
        if a > 0.0 { b } else { a }
    });
    check("power", Register::inverse_power_of_two(a * a), &|a, _| {
        (-(a * a).log2().floor()).exp2()
    });
    // Numbers three apart, there and back.
    let numbers: Vec<_> = (0..3 * L)
        .map(|i| Complex::new(i as f64, -0.5 * i as f64))
        .collect();
    let (re, im) = Lanes::<L>::split(&numbers, 3);
    assert_eq!(re.0, std::array::from_fn::<_, L, _>(|l| 3.0 * l as f64));
    let mut back = vec![Complex::default(); 3 * L];
    Lanes::<L>::join(re, im, &mut back, 3);
    for (i, (a, b)) in numbers.iter().zip(&back).enumerate() {
        assert_eq!(*b, if i % 3 == 0 { *a } else { Complex::default() });
    }
}

#[test]
fn registers_of_any_length_are_plain_numbers_side_by_side() {
    registers_of::<1>();
    registers_of::<2>();
    registers_of::<4>();
    registers_of::<5>();
    registers_of::<8>();
}
