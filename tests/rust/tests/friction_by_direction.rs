//! Viscous friction by direction against its closed form.

use axisight_core::effects::{Motor, build};
use axisight_scalar::{Dual, Scalar};

type D = Dual<f64, 1>;

/// Beside the mean it is one line through zero for each direction, but for the corner: at `w` its
/// difference from the corner's `|w|` is `2 |w| / (1 + exp(2 |w| / v_0))`, below 1e-17 beyond 2 rad/s here.
#[test]
fn viscous_friction_of_each_direction_is_its_own_line() {
    let (forward, backward, corner) = (0.03, 0.05, 0.1);
    let mean =
        build::<f64>("viscous_friction", &[0.5 * (forward + backward)]).expect("in the table");
    let half = [0.5 * (forward - backward), corner];
    let asymmetry = build::<f64>("viscous_asymmetry", &half).expect("in the table");
    for speed in [-40.0, -2.0, -0.03, 0.0, 0.05, 2.0, 300.0] {
        let motor = Motor {
            angle: 7.0,
            speed,
            acceleration: 0.0,
            command: 0.0,
            load: 3.0,
            internal: &[],
        };
        let torque = mean.motor_torque(&motor) + asymmetry.motor_torque(&motor);
        let line = -speed * if speed > 0.0 { forward } else { backward };
        let rounded = 2.0 * f64::abs(speed) / (1.0 + f64::exp(2.0 * f64::abs(speed) / corner));
        assert!(
            (torque - (line + half[0] * rounded)).abs() < 1e-14,
            "{speed}: {torque}"
        );
    }
}

/// The slope at rest is that of the mean, and the derivative by speed is exact across the corner.
#[test]
fn viscous_friction_by_direction_is_smooth_at_rest() {
    let corner = 0.1;
    let kernel = build::<D>(
        "viscous_asymmetry",
        &[D::constant(-0.02), D::constant(corner)],
    );
    let kernel = kernel.expect("in the table");
    for speed in [-0.3_f64, -0.05, 0.0, 0.02, 0.4] {
        let motor = Motor {
            angle: D::constant(0.0),
            speed: D::constant(speed).seeded(0),
            acceleration: D::constant(0.0),
            command: D::constant(0.0),
            load: D::constant(0.0),
            internal: &[],
        };
        let t = f64::tanh(speed / corner);
        let slope = 0.02 * (t + speed / corner * (1.0 - t * t));
        assert!(
            (kernel.motor_torque(&motor).partials[0] - slope).abs() < 1e-15,
            "{speed}"
        );
    }
}
