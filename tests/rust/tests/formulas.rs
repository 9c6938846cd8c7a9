//! The formulas that the effects and the axis fit share, and one axis run through both models.

use axisight_core::effects::formulas::{
    dead_zone, dead_zone_inverse, harmonic, harmonic_slope, smoothed_sign, spring_torque,
    stribeck_level,
};
use axisight_core::effects::{Joint, Motor, Spring, build};
use axisight_core::plant::assemble;
use axisight_core::robot::Parameter;
use axisight_core::robot::{EffectSetting, Place};
use axisight_core::simulation::{Drive, Method, Run, Status, Stepper, simulate};
use axisight_fit::axis::{AxisModel, AxisProblem, AxisSet, Hold, Output};
use axisight_scalar::{Dual, Scalar};
use axisight_tests::{ROTOR, Random, effect, robot, sines};
use std::sync::atomic::AtomicBool;

type D = Dual<f64, 1>;

#[test]
fn the_dead_zone_is_a_shifted_line_outside_its_edge_and_nothing_inside() {
    let b = 0.4;
    for delta in [0.43, 0.6, 5.0] {
        assert_eq!(dead_zone(delta, b), (delta - b, 1.0));
        assert_eq!(dead_zone(-delta, b), (-(delta - b), 1.0));
    }
    for delta in [0.0, 0.1, 0.379] {
        assert_eq!(dead_zone(delta, b), (0.0, 0.0));
    }
    // A gap of no width is no gap.
    assert_eq!(dead_zone(0.3, 0.0), (0.3, 1.0));
    assert_eq!(dead_zone(0.0, 0.0).0, 0.0);
}

/// Torques of a gear that slips, by its values of `gear_hysteresis`, along a way of its deflection in small
/// steps (midpoint rule: the error of the way is the square of a step over D, 1e-6).
fn slipping(values: &[f64; 5], stiffness: f64, way: &[f64]) -> Vec<f64> {
    let kernel = build("gear_hysteresis", values).expect("in the table");
    let n = kernel.n_internal();
    let (mut z, mut rate) = (vec![0.0; n], vec![0.0; n]);
    let mut torques = Vec::new();
    for step in way.windows(2) {
        let at = |loaded, rate, internal: &[f64]| {
            kernel.gear_torque(&Spring {
                loaded,
                rate,
                stiffness,
                internal,
            })
        };
        let rates = |internal: &[f64], out: &mut [f64]| {
            kernel.gear_rates(
                &Spring {
                    loaded: step[0],
                    rate: step[1] - step[0],
                    stiffness,
                    internal,
                },
                out,
            );
        };
        rates(&z, &mut rate);
        let middle: Vec<f64> = z.iter().zip(&rate).map(|(z, r)| z + 0.5 * r).collect();
        rates(&middle, &mut rate);
        z.iter_mut().zip(&rate).for_each(|(z, r)| *z += r);
        torques.push(at(step[1], 0.0, &z));
    }
    torques
}

#[test]
fn a_gear_that_slips_gradually_follows_dahls_model() {
    let (a, d, k, n, begins) = (0.3, 2e-4, 1e5, 3000, -0.4);
    let full = a * k * d;
    let line =
        |from: f64, to: f64| (0..=n).map(move |i| from + (to - from) * f64::from(i) / f64::from(n));
    let there: Vec<f64> = line(0.0, 3.0 * d).collect();
    let back: Vec<f64> = line(3.0 * d, d).skip(1).collect();
    let way: Vec<f64> = there.iter().chain(&back).copied().collect();
    let torques = slipping(&[a, d, 0.0, 0.0, begins], k, &way);
    // Each way it comes closer to where it slips, exponentially; the torque at rest is not felt.
    let strain = |from: f64, to: f64, delta: f64| to + (from - to) * (-delta / d).exp();
    let top = strain(begins, 1.0, 3.0 * d);
    for (torque, delta) in torques.iter().zip(&way[1..]).take(n as usize) {
        let z = strain(begins, 1.0, *delta);
        assert!(
            (torque - full * (z - begins)).abs() < 1e-5 * full,
            "{delta}"
        );
    }
    for (torque, delta) in torques.iter().zip(&way[1..]).skip(n as usize) {
        let z = strain(top, -1.0, 3.0 * d - delta);
        assert!(
            (torque - full * (z - begins)).abs() < 1e-5 * full,
            "{delta}"
        );
    }
}

/// Springs in parallel that slip, each at once, evenly apart: play operators, as Iwan's model has them.
fn sliders(d: f64, way: &[f64]) -> Vec<f64> {
    let mut strains = [0.0_f64; 4];
    let mut out = Vec::new();
    for step in way.windows(2) {
        for (x, at) in strains.iter_mut().zip([0.4, 0.8, 1.2, 1.6]) {
            *x = (*x + step[1] - step[0]).clamp(-at * d, at * d);
        }
        out.push(strains.iter().sum::<f64>() / 4.0);
    }
    out
}

#[test]
fn a_gear_that_slips_suddenly_is_like_sliders_in_parallel() {
    let (a, d, k) = (0.3, 2e-4, 1e5);
    // Small turns on the flanks of large ones: they close with sliders, and creep with Dahl's law.
    let way: Vec<f64> = (0..20000)
        .map(|i| {
            let t = std::f64::consts::TAU * f64::from(i) / 20000.0;
            d * (2.5 * (2.0 * t).sin() + 0.4 * (37.0 * t).sin())
        })
        .collect();
    let oracle = sliders(d, &way);
    let off = |sharpness: f64| {
        let torques = slipping(&[a, d, 0.0, sharpness, 0.0], k, &way);
        let error = torques
            .iter()
            .zip(&oracle)
            .map(|(x, y)| (x / (a * k) - y).powi(2));
        let size = oracle.iter().map(|y| y * y);
        (error.sum::<f64>() / size.sum::<f64>()).sqrt()
    };
    // Where a slider slips, an element has come to z: z + z^6/6 + z^11/11 + .. = 1, 0.883. Nowhere is it further off.
    assert!(off(1.0) < 1.0 - 0.883, "{}", off(1.0));
    assert!(off(0.0) > 3.0 * off(1.0), "{}", off(0.0));
}

#[test]
fn a_step_longer_than_a_corner_ends_where_it_slips() {
    let d = 1e-5;
    let full = 0.3 * 1e5 * d;
    // Of the element that slips first, up to ten times as long as its way.
    for (long, off) in [(0.5, 0.1), (4.0, 2.0)] {
        let way: Vec<f64> = (0..200).map(|i| long * d * f64::from(i)).collect();
        let torques = slipping(&[0.3, d, 0.0, 1.0, 0.0], 1e5, &way);
        assert!(torques.iter().all(|x| *x < 6.0 * full), "{long}");
        assert!(
            (torques[198] / full - 1.0).abs() < off,
            "{long}: {}",
            torques[198] / full
        );
    }
}

#[test]
fn a_gear_with_a_knee_has_two_stiffnesses() {
    let (step, within, knee, k) = (0.6, -0.2, 3e-4, 1e5);
    let kernel = build::<f64>("piecewise_stiffness", &[step, within, knee]).expect("in the table");
    let torque = |loaded: f64| {
        k * loaded
            + kernel.gear_torque(&Spring {
                loaded,
                rate: 0.0,
                stiffness: k,
                internal: &[],
            })
    };
    // Clear of the corners, rounded over a twentieth of the knee.
    for (from, to, stiffness) in [
        (-2.5e-4, 2.5e-4, k * (1.0 + within)),
        (3.5e-4, 9e-4, k * (1.0 + within + step)),
        (-9e-4, -3.5e-4, k * (1.0 + within + step)),
    ] {
        let slope = (torque(to) - torque(from)) / (to - from);
        assert!((slope / stiffness - 1.0).abs() < 1e-12, "{from}");
    }
    // Beyond the corners the lines meet at the knee.
    let meet = torque(9e-4) - k * (1.0 + within + step) * (9e-4 - knee);
    assert!((meet / (k * (1.0 + within) * knee) - 1.0).abs() < 1e-12);
}

#[test]
fn a_slipping_spring_that_the_stiffness_includes_shows_in_large_motions_only() {
    let (a, d, k) = (0.3, 2e-4, 1e5);
    let kernel = build("gear_hysteresis", &[a, d, 1.0, 0.0, 0.0]).expect("in the table");
    let torque = |loaded: f64, z: f64| {
        kernel.gear_torque(&Spring {
            loaded,
            rate: 0.0,
            stiffness: k,
            internal: &[z; 4],
        })
    };
    // Stuck, z follows the deflection: nothing is different from the gear's own spring.
    assert!(torque(1e-6, 1e-6 / d).abs() < 1e-12 * k);
    // Slipping, the gear is softer by the share, about a force that stays.
    let slope = (torque(5e-3, 1.0) - torque(4e-3, 1.0)) / 1e-3;
    assert!((slope + a * k).abs() < 1e-9 * k);
    assert!((torque(0.0, 1.0) - a * k * d).abs() < 1e-12 * k);
}

#[test]
fn a_gear_that_slips_takes_energy_out() {
    let (a, d, k) = (0.3, 2e-4, 1e5);
    for amplitude in [0.1 * d, d, 10.0 * d] {
        let turns = std::f64::consts::TAU / 4000.0;
        let way: Vec<f64> = (0..8000)
            .map(|i| amplitude * (turns * f64::from(i)).sin())
            .collect();
        let torques = slipping(&[a, d, 0.0, 0.5, 0.0], k, &way);
        let work = |i: usize| torques[i] * (way[i + 1] - way[i]);
        // The second turn: the first forgets how it began.
        let loss: f64 = (4000..7999).map(work).sum();
        let most = 4.0 * amplitude * a * k * d;
        assert!(loss > 0.0 && loss < most, "{amplitude}: {loss} of {most}");
    }
}

#[test]
fn slopes_are_derivatives() {
    let mut random = Random(1);
    for _ in 0..300 {
        let x = D::constant(random.within(0.6)).seeded(0);
        let (value, slope) = dead_zone(x, D::constant(0.4));
        assert!((value.partials[0] - slope.value).abs() < 1e-15, "{x:?}");
        let (c, s) = (D::constant(random.within(2.0)), D::constant(0.7));
        let (value, slope) = harmonic_slope(x, c, s);
        assert!((value.partials[0] - slope.value).abs() < 1e-15, "{x:?}");
        assert_eq!(value, harmonic(x, c, s));
    }
}

/// A gear without play that carries nothing: derivatives pass, as they do under any load.
#[test]
fn a_gap_of_no_width_has_the_slope_of_none() {
    for x in [-0.2, 0.0, 0.2] {
        let (x, b) = (D::constant(x).seeded(0), D::zero());
        assert_eq!(dead_zone_inverse(x, b).partials, [1.0]);
        assert_eq!(dead_zone(x, b).0.partials, [1.0]);
    }
}

#[test]
fn the_dead_zone_is_inverted() {
    let mut random = Random(2);
    for _ in 0..300 {
        let loaded = random.within(0.1);
        let back = dead_zone(dead_zone_inverse(loaded, 0.3), 0.3).0;
        // A square root near the edge: 1e-16 of the gap under the root.
        assert!((back - loaded).abs() < 1e-15, "{loaded} {back}");
    }
    assert_eq!(dead_zone_inverse(0.0, 0.3), 0.0);
}

#[test]
fn values_are_those_of_the_equations() {
    let mut random = Random(3);
    for _ in 0..300 {
        let (x, a, b) = (random.within(4.0), random.within(2.0), random.within(2.0));
        let near = |got: f64, want: f64| {
            let size = want.abs().max(1.0);
            assert!((got - want).abs() < 4e-15 * size, "{got} {want}");
        };
        near(smoothed_sign(x, 5.0), (x / 0.2).tanh());
        near(
            stribeck_level(a, b, 0.5, x),
            a + b * (-(x / 2.0) * (x / 2.0)).exp(),
        );
        near(harmonic(x, a, b), a * x.cos() + b * x.sin());
        near(
            spring_torque(a, b, x) / 128.0,
            (a * x + b * x.powi(3)) / 128.0,
        );
    }
    assert_eq!(stribeck_level(0.5, 0.25, 3.0, 0.0), 0.75);
}

#[test]
fn a_deadband_takes_its_width_off_every_torque() {
    let kernel = build::<f64>("torque_deadband", &[0.5]).expect("in the table");
    for (commanded, delivered) in [
        (2.0, 1.5),
        (0.5, 0.0),
        (0.3, 0.0),
        (-0.2, 0.0),
        (-3.0, -2.5),
    ] {
        assert_eq!(kernel.command(commanded), delivered, "{commanded}");
    }
}

/// A gear that does not bend feels one torque, wherever the friction is: motor side, that of the motor and
/// `r` times that of the joint. Power too: what both take is what the whole takes.
#[test]
fn a_share_of_friction_acts_behind_the_gear() {
    let laws: [(&str, &[f64], &[f64]); 4] = [
        ("coulomb_friction", &[0.5, 0.1], &[0.0]),
        ("asymmetric_friction", &[0.5, 0.3, 0.1], &[]),
        ("stribeck_friction", &[0.5, 0.3, 3.0, 0.1], &[]),
        (
            "position_dependent_friction",
            &[0.5, -0.2, 0.01, 0.1, 0.6],
            &[],
        ),
    ];
    let ratio = -1.0 / 120.0;
    for (name, values, after) in laws {
        let kernel_with = |share: f64| {
            let p = [values, &[share], after].concat();
            build::<f64>(name, &p).expect("in the table")
        };
        for (angle, speed) in [(0.3, 4.0), (40.0, 0.05), (-130.0, -0.02), (300.0, -20.0)] {
            let torques = |share: f64| {
                let kernel = kernel_with(share);
                let motor = kernel.motor_torque(&Motor {
                    angle,
                    speed,
                    acceleration: 0.0,
                    command: 0.0,
                    load: 0.0,
                    internal: &[],
                });
                let joint = kernel.joint_torque(&Joint {
                    angle: ratio * angle,
                    speed: ratio * speed,
                    ratio,
                    internal: &[],
                });
                (motor, joint, kernel.acts_behind_gear())
            };
            let (whole, nothing, behind) = torques(0.0);
            assert_eq!(nothing, 0.0, "{name}");
            assert!(!behind && torques(0.3).2, "{name}");
            let (motor, joint, _) = torques(0.3);
            let off = |got: f64, want: f64| ((got - want) / whole).abs();
            assert!(off(motor, 0.7 * whole) < 1e-15, "{name}: {motor}");
            // Rounding of the turn to the joint and back, of speeds in a corner of 0.1 rad/s.
            assert!(off(joint * ratio, 0.3 * whole) < 1e-14, "{name}: {joint}");
            assert!(joint * ratio * speed < 0.0, "{name}: against its motion");
        }
    }
}

#[test]
fn friction_of_a_place_is_a_wave_over_the_angle() {
    let p = [0.5, -0.2, 0.01, 0.1, 0.6, 0.0];
    let kernel = build::<f64>("position_dependent_friction", &p).expect("in the table");
    for (angle, speed) in [(0.0, 3.0), (40.0, 0.05), (-130.0, -0.02), (300.0, -20.0)] {
        let motor = Motor {
            angle,
            speed,
            acceleration: 0.0,
            command: 0.0,
            load: 0.0,
            internal: &[],
        };
        let level = 0.6 + 0.5 * f64::cos(0.01 * angle) - 0.2 * f64::sin(0.01 * angle);
        let want = -level * f64::tanh(speed / 0.1);
        assert!((kernel.motor_torque(&motor) - want).abs() < 1e-14);
    }
}

/// Closed form: a joint moved by sin(W t) feels a mass on a spring and damper with the response
/// J W^2 (w^2 + 2 i z w W) / (w^2 - W^2 + 2 i z w W).
#[test]
fn what_swings_on_a_joint_has_the_response_of_a_mass_on_a_spring() {
    let (inertia, frequency, damping) = (3.0, 12.0, 0.1);
    let kernel = build::<f64>("extra_mode", &[inertia, frequency, damping]).expect("in the table");
    let own = std::f64::consts::TAU * frequency;
    for forced in [0.3 * own, own, 2.5 * own] {
        let joint = |t: f64, internal: &[f64]| {
            let speed = forced * (forced * t).cos();
            let at = Joint {
                angle: (forced * t).sin(),
                speed,
                ratio: 1.0,
                internal,
            };
            let mut rates = [0.0; 2];
            kernel.joint_rates(&at, &mut rates);
            (kernel.joint_torque(&at), rates)
        };
        // Two seconds take the swing from rest to its end: e^(-z w t) is 3e-7.
        let (step, mut x) = (1e-5, [0.0; 2]);
        let (mut sine, mut cosine) = (0.0, 0.0);
        let periods = (forced * 0.5 / std::f64::consts::TAU).floor();
        let (begin, end) = (2.0, 2.0 + periods * std::f64::consts::TAU / forced);
        let count = (end / step).round() as usize;
        for k in 0..count {
            let t = k as f64 * step;
            let (torque, rates) = joint(t, &x);
            if t >= begin {
                sine += torque * (forced * t).sin() * step;
                cosine += torque * (forced * t).cos() * step;
            }
            let middle = [x[0] + 0.5 * step * rates[0], x[1] + 0.5 * step * rates[1]];
            let (_, rates) = joint(t + 0.5 * step, &middle);
            x = [x[0] + step * rates[0], x[1] + step * rates[1]];
        }
        let half = 0.5 * (end - begin);
        let damper = 2.0 * damping * own * forced;
        let (real, imaginary) = (own * own - forced * forced, damper);
        let size = inertia * forced * forced / (real * real + imaginary * imaginary);
        let want = [
            size * (own * own * real + damper * damper),
            size * (damper * real - own * own * imaginary),
        ];
        let largest = want[0].abs().max(want[1].abs());
        for (got, want) in [sine / half, cosine / half].iter().zip(want) {
            assert!(
                (got - want).abs() < 2e-3 * largest,
                "{forced}: {got} {want}"
            );
        }
    }
}

const SAMPLE_TIME: f64 = 5e-4;
const RATIO: f64 = 1.0 / 224.3;
const SMOOTHING: f64 = 2.0;

/// Motor inertia, arm inertia, stiffness, cubic stiffness, damping, viscous and Coulomb
/// friction, backlash, Stribeck excess, ripple (cosine, sine).
const TRUTH: [f64; 11] = [
    0.0121, 1130.0, 1.46e6, 3.72e10, 2630.0, 0.013, 0.644, 1e-4, 0.2, 0.06, -0.04,
];
const STRIBECK_SPEED: f64 = 3.0;
const ORDER: f64 = 2.0;

/// Motor speed at the samples through the plant of the simulator, with derivatives along
/// eight of the parameters.
fn through_plant(torque: &[f64], seeds: &[usize]) -> Vec<Dual<f64, 8>> {
    type S = Dual<f64, 8>;
    let text = ROTOR
        .replace("[1, 1, 3, 0, 0, 0]", "[1, 1, 1, 0, 0, 0]")
        .replace(
            "axis = [0, 0, 1]",
            "axis = [0, 0, 1]\nstiffness = 1\ndamping = 1",
        );
    let mut robot = robot(&text);
    if let Some(drive) = robot.joints[0].drive.as_mut() {
        drive.gear_ratio = RATIO;
    }
    let value = |i: usize| {
        let x = S::constant(TRUTH[i]);
        match seeds.iter().position(|s| *s == i) {
            Some(seed) => x.seeded(seed),
            None => x,
        }
    };
    let overrides = [
        (Parameter::MotorInertia(0), value(0)),
        (Parameter::InertiaScale(0), value(1)),
        (Parameter::Stiffness(0), value(2)),
        (Parameter::Damping(0), value(4)),
        (Parameter::ViscousFriction(0), value(5)),
    ];
    let setting = |name: &str, parameters: &[S]| EffectSetting {
        name: name.to_owned(),
        place: Place::Axis(0),
        parameters: parameters.to_vec(),
    };
    let fixed = S::constant;
    let mut ripple = effect::<S>("torque_ripple", Some(0), &[0.0; 18]);
    ripple.parameters[..3].copy_from_slice(&[fixed(ORDER), value(9), value(10)]);
    let settings = [
        setting(
            "stribeck_friction",
            &[
                value(6),
                value(8),
                fixed(STRIBECK_SPEED),
                fixed(SMOOTHING),
                fixed(0.0),
            ],
        ),
        setting("backlash", &[value(7), fixed(0.0)]),
        setting("nonlinear_stiffness", &[value(3)]),
        ripple,
    ];
    let plant = assemble(&robot, &overrides, &settings).expect("a plant");
    let run = Run {
        controller: &robot.controller,
        sample_time: SAMPLE_TIME,
        start: &[&robot.operating_point],
        drive: Drive::Torque(&[torque]),
        noise: &[],
        resolution: 0.0,
        disturbances: true,
        accelerometers: false,
        method: Method::RungeKutta4 { substeps: 2 },
        cancel: None,
    };
    let (mut out, speed) = (Vec::new(), plant.n_angles());
    let status = simulate(&plant, &run, &mut Stepper::new(&plant), &mut |sample| {
        out.push(sample.state[speed]);
    });
    assert_eq!(status, Ok(Status::Completed));
    out
}

#[test]
fn the_axis_fit_and_the_simulator_are_one_model() {
    let n = 1500;
    let torque = sines(n, 1, SAMPLE_TIME, 4.0);
    let model = AxisModel {
        masses: 2,
        output: Output::Velocity,
        hold: Hold::Zero,
        smoothing: SMOOTHING,
        ripple_orders: vec![ORDER],
        substeps: 2,
    };
    let record = AxisSet {
        number: 0,
        torque: torque.clone(),
        output: vec![0.0; n],
        sample_time: SAMPLE_TIME,
        weight: 1.0,
        block: 100,
    };
    let cancel = AtomicBool::new(false);
    let problem = AxisProblem::new(model, vec![record], Vec::new(), false, &cancel).expect("data");
    let layout = problem.layout();
    let places = [
        layout.inertia(0),
        layout.inertia(1),
        layout.linear(0),
        layout.cubic(0),
        layout.damping(0),
        layout.viscous(),
        layout.coulomb(),
        layout.backlash(),
        layout.excess(),
        layout.ripple(0),
        layout.ripple(0) + 1,
    ];
    let mut theta = vec![0.0; problem.n_parameters()];
    for (place, value) in places.iter().zip(TRUTH) {
        theta[*place] = value;
    }
    theta[layout.ratio()] = RATIO;
    theta[layout.stribeck_speed()] = STRIBECK_SPEED;
    let chain = problem.linearize(&theta, &places).expect("a run");
    for seeds in [[0, 1, 2, 3, 4, 5, 6, 7], [3, 4, 5, 6, 7, 8, 9, 10]] {
        let plant = through_plant(&torque, &seeds);
        // Angles of many turns instead of deflections: 1e-16 of them, times the stiffness.
        let worst = |got: &dyn Fn(&Dual<f64, 8>) -> f64, want: &[f64]| {
            let size = want.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            assert!(size > 0.0);
            let each = plant.iter().zip(want).map(|(p, w)| (got(p) - w).abs());
            each.fold(0.0, f64::max) / size
        };
        let error = worst(&|p| p.value, &chain.residual);
        assert!(error < 1e-9, "velocity: {error:.1e}");
        for (slot, seed) in seeds.iter().enumerate() {
            let error = worst(&|p| p.partials[slot], &chain.columns[*seed]);
            assert!(error < 1e-7, "along parameter {seed}: {error:.1e}");
        }
    }
}

#[test]
fn warming_friction_follows_its_own_clock() {
    let (slope, time, cold) = (-0.01, 4.0, 0.02);
    let kernel = build::<f64>("friction_warmup", &[slope, time, cold]).expect("in the table");
    assert_eq!(kernel.n_internal(), 1);
    for done in [0.0, 0.3, 1.0] {
        let internal = [done];
        let motor = Motor {
            angle: 1.0,
            speed: 20.0,
            acceleration: 0.0,
            command: 0.0,
            load: 0.0,
            internal: &internal,
        };
        let mut rates = [0.0];
        kernel.motor_rates(&motor, &mut rates);
        // The state is 1 - e^(-t/T), whose rate is e^(-t/T) / T.
        assert!((rates[0] - (1.0 - done) / time).abs() < 1e-15);
        assert!((kernel.motor_torque(&motor) + (cold + slope * done) * 20.0).abs() < 1e-15);
    }
}
