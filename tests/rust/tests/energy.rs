//! Without damping, friction and drive the plant conserves energy.

use axisight_core::plant::{Plant, linearize};
use axisight_core::robot::{RigidBody, RobotDescription};
use axisight_core::simulation::{Drive, Method};
use axisight_identification::frequency::modes;
use axisight_tests::{ARM, PRESET, largest, plant, robot, trace};

const SAMPLES: usize = 500;
const SUBSTEPS: usize = 8;

fn without_losses(text: &str) -> RobotDescription {
    let mut robot = robot(text);
    for joint in &mut robot.joints {
        if let Some(compliance) = &mut joint.compliance {
            compliance.damping = 0.0;
        }
        if let Some(drive) = &mut joint.drive {
            drive.viscous_friction = 0.0;
        }
    }
    robot
}

/// Kinetic (links, motors) and stored (gravity, springs) energy [J].
struct Energy {
    links: f64,
    motors: f64,
    stored: f64,
}

fn energy(body: &RigidBody, plant: &Plant<f64>, x: &[f64]) -> Energy {
    let (m, n) = (plant.n_motors(), plant.chain.len());
    let (q, v) = (&x[m..m + n], &x[m + n + m..]);
    let (links, mut stored) = body.energy(q, v).expect("energy");
    let mut motors = 0.0;
    for axis in &plant.axes {
        let speed = plant.motor_speed(axis, x);
        motors += 0.5 * axis.motor_inertia * speed * speed;
        if let Some(gear) = &axis.gear {
            let deflection = plant.motor_angle(axis, x) * axis.ratio - q[axis.joint];
            stored += 0.5 * gear.stiffness * deflection * deflection;
        }
    }
    for (joint, stiffness, _) in &plant.elastic {
        stored += 0.5 * stiffness * q[*joint] * q[*joint];
    }
    Energy {
        links,
        motors,
        stored,
    }
}

/// Energies of a fall from the operating point, the holding torque taken away.
fn fall(robot: &RobotDescription) -> Vec<Energy> {
    let plant = plant::<f64>(robot, &[]);
    let body = RigidBody::new(robot);
    let torque = vec![0.0; SAMPLES * robot.n_axes()];
    let method = Method::RungeKutta4 { substeps: SUBSTEPS };
    let run = trace(&plant, robot, Drive::Torque(&[&torque]), &[], method);
    run.states
        .iter()
        .map(|x| energy(&body, &plant, x))
        .collect()
}

/// Largest departure of the sum from its start, over the energy exchanged.
fn departure(energies: &[Energy], motor_share: f64) -> f64 {
    let total = |e: &Energy| e.links + motor_share * e.motors + e.stored;
    let start = energies.first().map_or(f64::NAN, total);
    let off: Vec<f64> = energies.iter().map(|e| total(e) - start).collect();
    let exchanged: Vec<f64> = energies.iter().map(|e| e.links + e.motors).collect();
    largest(&off) / largest(&exchanged)
}

/// RK4 damps a mode of frequency w by `(w h)^6 / 72` of its energy per step; were all
/// energy in the fastest mode, the loss over the run would be this.
fn tolerance(robot: &RobotDescription) -> f64 {
    let linear = linearize(robot, &[], &robot.operating_point).expect("linear");
    let fastest = modes(&linear).expect("modes");
    let fastest = fastest
        .iter()
        .map(|m| m.eigenvalue.norm())
        .fold(0.0, f64::max);
    let h = robot.sample_time / SUBSTEPS as f64;
    (SAMPLES * SUBSTEPS) as f64 * (fastest * h).powi(6) / 72.0
}

#[test]
fn passive_motion_conserves_energy() {
    for text in [PRESET, ARM] {
        let robot = without_losses(text);
        let (error, bound) = (departure(&fall(&robot), 1.0), tolerance(&robot));
        assert!(bound < 1e-4, "the bound says nothing: {bound:.1e}");
        assert!(error < bound, "{}: {error:.1e} {bound:.1e}", robot.name);
    }
}

#[test]
fn rigid_transmission_conserves_energy() {
    let mut robot = without_losses(ARM);
    robot.joints[0].compliance = None;
    let (error, bound) = (departure(&fall(&robot), 1.0), tolerance(&robot));
    assert!(error < bound.max(1e-12), "{error:.1e} {bound:.1e}");
}

/// The check sees what it should: a motor inertia left out of the sum is noticed.
#[test]
fn motor_inertia_belongs_to_the_sum() {
    for text in [PRESET, ARM] {
        let robot = without_losses(text);
        assert!(departure(&fall(&robot), 0.99) > 100.0 * tolerance(&robot));
    }
}

/// With losses the energy falls, never rises, when nothing drives the arm.
#[test]
fn damping_takes_energy_away() {
    for text in [PRESET, ARM] {
        let robot = robot(text);
        let energies = fall(&robot);
        let total: Vec<f64> = energies
            .iter()
            .map(|e| e.links + e.motors + e.stored)
            .collect();
        let exchanged: Vec<f64> = energies.iter().map(|e| e.links + e.motors).collect();
        // The integrator adds at most its own error (as for the undamped arm).
        let slack = tolerance(&without_losses(text)) * largest(&exchanged);
        assert!(total.windows(2).all(|w| w[1] < w[0] + slack));
        assert!(total[0] - total[total.len() - 1] > 1e3 * slack);
    }
}
