//! Accelerometers on the links, and what they measure.

use axisight_scalar::Scalar;

/// An accelerometer that is fixed to a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Accelerometer {
    /// Name, unique among the accelerometers of the robot.
    pub name: String,
    /// Index of the joint whose link carries it.
    pub joint: usize,
    /// Position in the link frame [m].
    pub position: [f64; 3],
    /// One to three unit vectors in the link frame: the measured directions.
    pub directions: Vec<[f64; 3]>,
}

/// Number of readings of accelerometers: one for each direction.
pub fn n_readings(accelerometers: &[Accelerometer]) -> usize {
    accelerometers.iter().map(|a| a.directions.len()).sum()
}

/// Motion of the joints: angles [rad or m], rates, and accelerations.
#[derive(Debug, Clone, Copy)]
pub struct JointMotion<'a, S: Scalar> {
    /// Angles.
    pub q: &'a [S],
    /// Rates.
    pub v: &'a [S],
    /// Accelerations.
    pub a: &'a [S],
}
