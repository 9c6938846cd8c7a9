//! Friction that acts ahead of the speed.

use axisight_core::effects::{Motor, build};

/// Friction with a lead acts on the speed that far ahead, and is exactly its level beyond its width.
#[test]
fn friction_with_a_lead_acts_on_the_speed_ahead() {
    let (level, width, lead) = (0.5, 0.2, 0.01);
    let with = |lead: f64| build::<f64>("coulomb_friction", &[level, width, 0.0, lead]);
    let (ahead, plain) = (with(lead).expect("known"), with(0.0).expect("known"));
    assert!(ahead.needs_acceleration() && !plain.needs_acceleration());
    for (speed, acceleration, sign) in [
        (0.3, 0.0, 1.0),
        (0.3, -60.0, -1.0),
        (0.3, -20.0, 0.5),
        (0.0, 5.0, 0.25),
        (-0.3, 20.0, -0.5),
    ] {
        let torque = ahead.motor_torque(&Motor {
            angle: 0.0,
            speed,
            acceleration,
            command: 0.0,
            load: 0.0,
            internal: &[],
        });
        let off = (torque + level * sign).abs();
        assert!(off < 1e-15, "{speed} {acceleration}: {torque}");
    }
}
