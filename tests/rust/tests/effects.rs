//! Every effect in the table: neutral means absent, derivatives are exact, misuse is refused.
//!
//! The tests walk the table, so that a new effect is tested without being named here.

use axisight_core::effects::{
    Acts, EFFECTS, EffectInfo, Family, Joint, Kernel, Motor, Role, Scope, Spring, build,
};
use axisight_core::plant::{assemble, equilibrium};
use axisight_core::robot::{EffectSetting, RobotDescription};
use axisight_core::simulation::{Drive, Method, Status};
use axisight_scalar::{Dual, Scalar};
use axisight_tests::{PRESET, Trace, effect, plant, relative, robot, sines, trace};

const SAMPLES: usize = 120;

/// Axes (or the arm) an effect can act on.
fn places(info: &EffectInfo, n_axes: usize) -> Vec<Option<usize>> {
    match info.scope {
        Scope::Arm => vec![None],
        // The last link carries no axis.
        Scope::Axis if info.name == "link_geometry" => (0..n_axes - 1).map(Some).collect(),
        Scope::Axis => (0..n_axes).map(Some).collect(),
        Scope::Axes => (0..n_axes - 1).map(Some).collect(),
    }
}

fn neutral(info: &EffectInfo) -> Vec<f64> {
    info.parameters.iter().map(|p| p.neutral).collect()
}

/// Shapes that are taken between their bounds, and off the corner of a strain of none.
const BETWEEN: [&str; 6] = [
    "damped",
    "gyration_m2",
    "relaxation_s",
    "arm_share",
    "sharpness",
    "strain_at_rest",
];

/// The effect at work: amplitudes well off neutral, every term on.
fn at_work(info: &EffectInfo) -> Vec<f64> {
    let value = |(i, p): (usize, &axisight_core::effects::ParameterInfo)| match p.role {
        // A limit that is neutral when far away, and bites when near.
        Role::Amplitude if p.neutral >= p.upper => 0.1 * p.typical,
        // Off whole and half samples, where the slope of a delay has a corner.
        Role::Amplitude => p.neutral + 0.7 * p.typical,
        // Orders of harmonics that are switched off; different ones.
        Role::Shape if p.neutral <= p.lower && p.name.starts_with("order") => 2.0 + i as f64 / 3.0,
        Role::Shape if BETWEEN.contains(&p.name) => p.typical,
        Role::Shape => p.neutral,
    };
    info.parameters.iter().enumerate().map(value).collect()
}

fn closed_loop<S: Scalar>(robot: &RobotDescription, settings: &[EffectSetting<S>]) -> Trace<S> {
    moved_by(1.5, robot, settings)
}

fn moved_by<S: Scalar>(
    speed: f64,
    robot: &RobotDescription,
    settings: &[EffectSetting<S>],
) -> Trace<S> {
    let plant = plant::<S>(robot, settings);
    let reference = sines(SAMPLES, robot.n_axes(), robot.sample_time, speed);
    let method = Method::RungeKutta4 { substeps: 1 };
    let out = trace(&plant, robot, Drive::Reference(&[&reference]), &[], method);
    assert_eq!(out.status, Status::Completed);
    out
}

#[test]
fn neutral_effects_vanish() {
    let mut robot = robot(PRESET);
    robot.operating_point = vec![0.1, 0.3, -0.2];
    let base = closed_loop::<f64>(&robot, &[]);
    let mut failed = Vec::new();
    for info in EFFECTS {
        for place in places(info, robot.n_axes()) {
            let run = closed_loop(&robot, &[effect(info.name, place, &neutral(info))]);
            // Amplitudes at zero add exact zeros or multiply by one; the delay and the
            // body sums may round once per sample, 1e-16 amplified by the gear stiffness.
            for (got, want) in [
                (&run.command, &base.command),
                (&run.measured, &base.measured),
            ] {
                let error = relative(got, want);
                if error.is_nan() || error > 1e-12 {
                    failed.push(format!("{} {place:?}: {error:.1e}", info.name));
                }
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// The counterpart: at work, every effect shows, so that the test above can fail.
#[test]
fn effects_at_work_show() {
    let mut robot = robot(PRESET);
    // Tilted: where an axis along gravity has its zero shows in nothing.
    robot.gravity = [1.0, 0.5, -9.7];
    robot.operating_point = vec![0.1, 0.3, -0.2];
    // Either way: some act only where the motor drives its load.
    let ways = [1.5, -1.5].map(|speed| (speed, moved_by::<f64>(speed, &robot, &[])));
    for info in EFFECTS {
        for place in places(info, robot.n_axes()) {
            let at_work = effect(info.name, place, &at_work(info));
            let seen = ways.iter().fold(0.0_f64, |seen, (speed, base)| {
                let run = moved_by(*speed, &robot, std::slice::from_ref(&at_work));
                let command = relative(&run.command, &base.command);
                seen.max(command)
                    .max(relative(&run.measured, &base.measured))
            });
            assert!(seen > 1e-9, "{} {place:?}: {seen:.1e}", info.name);
        }
    }
}

/// Central differences through the loop at steps h and h / 2: their difference is three times
/// the truncation left in the finer one. Added to it is rounding: a motor angle of 70 rad is
/// known to 7e-15, the differenced speed times kp to 4 / 5e-4 times that, 6e-11 Nm, ten of
/// these over h. A tolerance above 1e-3 of the derivative would say nothing.
#[test]
fn derivatives_agree_with_finite_differences() {
    let mut failed = Vec::new();
    let mut robot = robot(PRESET);
    robot.operating_point = vec![0.1, 0.3, -0.2];
    for info in EFFECTS {
        // Axis 2 carries gravity, so that its gear does not leave its side of a gap or come back to a
        // knee, and lowering its load it draws no power.
        let own = ["knee", "softness", "sag"];
        let unloaded = |name: &str| own.iter().any(|start| name.starts_with(start));
        let axis = usize::from(!info.parameters.iter().any(|p| unloaded(p.name)));
        let start = at_work(info);
        // Rounding has no derivative: it is read off the logs, no fit asks for one.
        if info.name == "position_quantization" {
            continue;
        }
        for (i, p) in info.parameters.iter().enumerate() {
            // A lead is a way to write friction: no fit asks for its derivative.
            if p.name == "lead_s" {
                continue;
            }
            // What is damped in a gap shows where it is crossed, which is no place to change its width.
            let axis = if p.name == "damped" { 0 } else { axis };
            let place = (info.scope != Scope::Arm).then_some(axis);
            // Orders, and what multiplies them, multiply a motor angle of 70 rad.
            let share = if p.name.starts_with("order") || p.name == "second_ratio" {
                1e-4
            } else {
                1e-2
            };
            let h = share * p.typical.max(0.1 * start[i].abs());
            let mut setting = effect::<Dual<f64, 1>>(info.name, place, &start);
            setting.parameters[i] = setting.parameters[i].seeded(0);
            let exact: Vec<f64> = closed_loop(&robot, &[setting])
                .command
                .iter()
                .map(|u| u.partials[0])
                .collect();
            let at = |x: f64| {
                let mut parameters = start.clone();
                parameters[i] = x;
                closed_loop::<f64>(&robot, &[effect(info.name, place, &parameters)]).command
            };
            let central = |h: f64| -> Vec<f64> {
                let (high, low) = (at(start[i] + h), at(start[i] - h));
                high.iter()
                    .zip(&low)
                    .map(|(a, b)| (a - b) / (2.0 * h))
                    .collect()
            };
            let (coarse, fine) = (central(h), central(0.5 * h));
            let size = axisight_tests::largest(&exact);
            let truncation = coarse
                .iter()
                .zip(&fine)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            let tolerance = truncation + 6e-10 / h;
            let error = exact
                .iter()
                .zip(&fine)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            // A gap that never opens shifts the motor once and for all: no torque, nothing to see.
            let blind = size > 0.0 && tolerance > 1e-3 * size;
            if error.is_nan() || error > tolerance || blind {
                let label = format!("{}.{}: {error:.1e} of {size:.1e}", info.name, p.name);
                let weak = error <= tolerance && blind;
                let advice = if weak {
                    ": effect too weak: raise `typical`"
                } else {
                    ""
                };
                failed.push(format!("{label}, tolerance {tolerance:.1e}{advice}"));
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// Delay and lag have a derivative at zero too, where fits start: one-sided differences of
/// first order, Richardson-extrapolated, `2 D(h/2) - D(h)`.
#[test]
fn timing_effects_have_a_derivative_at_zero() {
    let robot = robot(PRESET);
    for (name, shape, tolerance) in [
        ("input_delay", &[][..], 1e-4),
        ("actuator_bandwidth", &[], 1e-2),
        ("current_loop", &[0.7], 1e-2),
    ] {
        let parameters = |x: f64| [&[x], shape].concat();
        let mut setting = effect::<Dual<f64, 1>>(name, Some(0), &parameters(0.0));
        setting.parameters[0] = setting.parameters[0].seeded(0);
        let exact: Vec<f64> = closed_loop(&robot, &[setting])
            .command
            .iter()
            .map(|u| u.partials[0])
            .collect();
        let at =
            |x: f64| closed_loop::<f64>(&robot, &[effect(name, Some(0), &parameters(x))]).command;
        let base = at(0.0);
        let slope =
            |h: f64| -> Vec<f64> { at(h).iter().zip(&base).map(|(a, b)| (a - b) / h).collect() };
        // Lags far below the sample time; the delay's slope changes over a sample.
        let h = 1e-6;
        let (coarse, fine) = (slope(h), slope(0.5 * h));
        let extrapolated: Vec<f64> = coarse.iter().zip(&fine).map(|(c, f)| 2.0 * f - c).collect();
        let error = relative(&extrapolated, &exact);
        assert!(error < tolerance, "{name}: {error:.1e}");
    }
}

fn refusal(robot: &RobotDescription, setting: &EffectSetting<f64>) -> String {
    match assemble(robot, &[], std::slice::from_ref(setting)) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn bounds_are_refused_by_name() {
    let robot = robot(PRESET);
    for info in EFFECTS {
        let place = if info.scope == Scope::Arm {
            None
        } else {
            Some(0)
        };
        for (i, p) in info.parameters.iter().enumerate() {
            let width = p.upper - p.lower;
            for bad in [
                p.lower - 1e-3 * width,
                p.upper + 1e-3 * width,
                f64::NAN,
                f64::INFINITY,
            ] {
                let mut values = neutral(info);
                values[i] = bad;
                let message = refusal(&robot, &effect(info.name, place, &values));
                let start = format!("effect `{}`: parameter `{}`: expected ", info.name, p.name);
                assert!(message.starts_with(&start), "{bad}: {message}");
            }
            let inside = (p.lower..=p.upper).contains(&p.neutral) && p.typical > 0.0;
            assert!(inside && p.lower < p.upper, "{}.{}", info.name, p.name);
        }
    }
}

#[test]
fn wrong_axis_count_and_name_are_refused() {
    let robot = robot(PRESET);
    for info in EFFECTS {
        let (bad, expected) = match info.scope {
            Scope::Axis => (
                vec![None, Some(3), Some(usize::MAX)],
                "expected an axis from 1 to 3",
            ),
            Scope::Axes => (
                vec![None, Some(2)],
                "expected two different axes from 1 to 3",
            ),
            Scope::Arm => (vec![Some(0)], "expected no axis"),
        };
        for place in bad {
            if place == Some(usize::MAX) {
                continue; // printed 1-based; see `axis_zero_is_refused`
            }
            let message = refusal(&robot, &effect(info.name, place, &neutral(info)));
            assert!(message.contains(expected), "{message}");
        }
        let mut long = neutral(info);
        long.push(0.0);
        for parameters in [&long[..], &long[..info.parameters.len() - 1]] {
            let place = if info.scope == Scope::Arm {
                None
            } else {
                Some(0)
            };
            let message = refusal(&robot, &effect(info.name, place, parameters));
            let count = format!(
                "expected {} parameters, got {}",
                info.parameters.len(),
                parameters.len()
            );
            assert!(message.ends_with(&count), "{message}");
        }
    }
    let message = refusal(&robot, &effect("colour", Some(0), &[]));
    assert!(
        message.starts_with("effect `colour`: expected one of viscous_friction, "),
        "{message}"
    );
    assert!(build::<f64>("", &[]).is_err());
}

#[test]
fn transmission_effects_need_a_compliant_gear() {
    let mut robot = robot(PRESET);
    robot.joints[0].compliance = None;
    for info in EFFECTS.iter().filter(|e| e.acts == Acts::Transmission) {
        let message = refusal(&robot, &effect(info.name, Some(0), &neutral(info)));
        assert!(
            message.contains("expected an axis with a compliant transmission"),
            "{message}"
        );
        assert_eq!(
            refusal(&robot, &effect(info.name, Some(1), &neutral(info))),
            "accepted"
        );
    }
}

/// At rest every effect keeps the arm still: accelerations of the spring forces' rounding only.
/// Effects on the motor need not vanish at rest, and a torque limit below the load cannot hold it.
#[test]
fn rest_is_rest_with_every_effect() {
    let mut robot = robot(PRESET);
    robot.operating_point = vec![0.1, 0.3, -0.2];
    let holds = |e: &&&EffectInfo| e.acts != Acts::Motor && e.name != "torque_saturation";
    for info in EFFECTS.iter().filter(holds) {
        for place in places(info, robot.n_axes()) {
            let plant = plant::<f64>(&robot, &[effect(info.name, place, &at_work(info))]);
            let rest = equilibrium(&plant, &robot.operating_point).expect("rest");
            let x = plant.state_at_rest(&rest);
            let delivered: Vec<f64> = plant
                .axes
                .iter()
                .zip(&rest.motor_torque)
                .map(|(axis, u)| axis.kernels.iter().fold(*u, |t, k| k.drive(t)))
                .collect();
            let mut dx = vec![0.0; x.len()];
            plant.derivative(
                &x,
                &delivered,
                &rest.motor_torque,
                &mut plant.scratch(),
                &mut dx,
            );
            // Gear forces of 1e4 Nm rounded at 1e-16 on motors of 1e-2 kg m^2 and links of
            // 1 kg m^2; the nonlinear spring is iterated to 1e-12 of the load.
            let moved = axisight_tests::largest(&dx);
            assert!(moved < 1e-6, "{} {place:?}: {moved:.1e}", info.name);
        }
    }
}

/// A cubic spring far stiffer under load than at rest (within its bounds) still rests.
#[test]
fn strongly_nonlinear_spring_finds_its_rest() {
    let robot = robot(PRESET);
    for cubic in [1e11, 1e12, 1e13, 1e14] {
        let plant = plant::<f64>(&robot, &[effect("nonlinear_stiffness", Some(1), &[cubic])]);
        let rest = equilibrium(&plant, &robot.operating_point).expect("rest");
        let deflection = rest.motor_angle[1] * plant.axes[1].ratio - rest.joint_angle[1];
        let gear = plant.axes[1].gear.as_ref().expect("gear");
        let torque = gear.stiffness * deflection + cubic * deflection.powi(3);
        let load = rest.motor_torque[1] / plant.axes[1].ratio;
        assert!(
            (torque / load - 1.0).abs() < 1e-9,
            "{cubic:e}: {torque} {load}"
        );
    }
}

/// The effect as its equation is meant: amplitudes at their typical, positive sizes.
fn as_meant(info: &EffectInfo) -> Box<dyn Kernel<f64>> {
    let value = |p: &axisight_core::effects::ParameterInfo| match p.role {
        Role::Amplitude => p.typical,
        // Between its bounds.
        Role::Shape if ["damped", "relaxation_s"].contains(&p.name) => p.typical,
        Role::Shape => p.neutral,
    };
    let values: Vec<f64> = info.parameters.iter().map(value).collect();
    build(info.name, &values).expect("in the table")
}

/// Work [J] that an effect on a motor does on it while it moves forth, and while it moves back,
/// by 20 rad in 2 s under a gear torque `load`, after a first turn to forget how it began.
fn work_forth_and_back(kernel: &dyn Kernel<f64>, load: f64) -> [f64; 2] {
    // A bristle bends by a neutral 0.01 rad in 2e-4 s at 60 rad/s: 100 steps.
    let (amplitude, rate, steps) = (20.0, std::f64::consts::PI, 1_000_000);
    let step = std::f64::consts::TAU / rate / f64::from(steps);
    let mut internal = vec![0.0; kernel.n_internal()];
    let mut rates = internal.clone();
    let mut work = [0.0; 2];
    for k in 0..2 * steps {
        let (sine, cosine) = (rate * step * (f64::from(k) + 0.5)).sin_cos();
        let motor = Motor {
            angle: amplitude * sine,
            speed: amplitude * rate * cosine,
            acceleration: 0.0,
            command: 0.0,
            load,
            internal: &internal,
        };
        if k >= steps {
            let side = usize::from(motor.speed < 0.0);
            work[side] += kernel.motor_torque(&motor) * motor.speed * step;
        }
        kernel.motor_rates(&motor, &mut rates);
        for (z, rate) in internal.iter_mut().zip(&rates) {
            *z += step * rate;
        }
    }
    work
}

/// Half of a difference between the directions, and the mean beside which it is a friction.
const BESIDE_ITS_MEAN: [(&str, &str); 1] = [("viscous_asymmetry", "viscous_friction")];

/// Friction takes energy out of motion either way, whichever way the gear is loaded. Bristles
/// give back what they were bent by, a share of 1e-4 of it.
#[test]
fn friction_takes_energy_out_of_either_way() {
    let friction = |e: &&&EffectInfo| e.family == Family::Friction && e.acts == Acts::Motor;
    let mut tried = 0;
    for info in EFFECTS.iter().filter(friction) {
        for load in [-10.0, 10.0] {
            let [mut forth, mut back] = work_forth_and_back(&*as_meant(info), load);
            for (_, mean) in BESIDE_ITS_MEAN
                .iter()
                .filter(|(name, _)| *name == info.name)
            {
                assert!(forth < 0.0, "{}: {forth:.1e} J forth", info.name);
                let mean = axisight_core::effects::info(mean).expect("in the table");
                let beside = work_forth_and_back(&*as_meant(mean), load);
                forth += beside[0];
                back += beside[1];
            }
            let label = format!(
                "{}: work of {forth:.1e} J forth, {back:.1e} J back",
                info.name
            );
            assert!(
                forth < 0.0 && back < 0.0,
                "{label}: is `motor_torque` negative for forth?"
            );
        }
        tried += 1;
    }
    assert!(tried > 0);
    // Friction that acts elsewhere is not moved here: it needs a test of its own.
    let elsewhere = |e: &&&EffectInfo| e.family == Family::Friction && e.acts != Acts::Motor;
    assert_eq!(
        EFFECTS.iter().filter(elsewhere).map(|e| e.name).next(),
        None
    );
}

/// What an effect adds to the torque of a gear pulls the joint to where the motor has it and
/// against its rate, or does not depend on them.
#[test]
fn springs_and_dampers_of_gears_restore() {
    let mut acting = 0;
    for info in EFFECTS.iter().filter(|e| e.acts == Acts::Transmission) {
        let kernel = as_meant(info);
        let internal = vec![0.0; kernel.n_internal()];
        // Where it takes from the gear's spring, what is left of that restores.
        let own = if info.name == "lost_motion" { 1e5 } else { 0.0 };
        let torque = |loaded: f64, rate: f64| {
            own * loaded
                + kernel.gear_torque(&Spring {
                    loaded,
                    rate,
                    stiffness: 1e5,
                    internal: &internal,
                })
        };
        for size in [1e-5, 1e-4, 1e-3] {
            for way in [-1.0, 1.0] {
                for (what, torque) in [
                    ("deflection", torque(way * size, 0.0)),
                    ("rate", torque(0.0, way * size)),
                ] {
                    let against = format!("{}: `gear_torque` at {way} {what}", info.name);
                    assert!(
                        torque * way >= 0.0,
                        "{against}: {torque:.1e} Nm drives it on"
                    );
                    acting += usize::from(torque != 0.0);
                }
            }
        }
    }
    assert!(acting > 0);
}

/// A spring on a joint takes the joint back to where it is relaxed; a load in the arm's own way
/// of turning (a balancer) need not.
#[test]
fn springs_of_joints_restore() {
    let springs = |e: &&&EffectInfo| {
        let stiff = |p: &axisight_core::effects::ParameterInfo| p.name.starts_with("stiffness");
        e.acts == Acts::Joint && e.parameters.iter().any(stiff)
    };
    let mut tried = 0;
    for info in EFFECTS.iter().filter(springs) {
        let kernel = as_meant(info);
        let at = |angle| {
            kernel.joint_torque(&Joint {
                angle,
                speed: 0.0,
                ratio: 1.0,
                internal: &[],
            })
        };
        for angle in [-0.5, -0.01, 0.01, 0.5] {
            // Where it rests is another number of it: whatever that is, it falls with the angle.
            let torque = at(angle) - at(0.0);
            let label = format!("{}: `joint_torque` at {angle} rad", info.name);
            assert!(
                torque * angle < 0.0,
                "{label}: {torque:.1e} Nm drives it on"
            );
            tried += 1;
        }
    }
    assert!(tried > 0);
}
