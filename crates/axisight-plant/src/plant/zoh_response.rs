//! Zero-order-hold frequency response of a linearization.

use super::linearization::Linearization;
use nalgebra::{Complex, DMatrix};

/// Response `G(e^{i w T}) = C (e^{i w T} I - A_d)^-1 B_d` from motor torque to motor angle,
/// `(frequency, output, input)`, for a torque held over each sample.
///
/// A sampled loop has this response, not `G(i w)`. The result is `None` at a frequency that hits a
/// pole.
pub fn zoh_frequency_response(
    linear: &Linearization,
    sample_time: f64,
    frequency_hz: &[f64],
) -> Vec<Option<DMatrix<Complex<f64>>>> {
    let (nx, nu) = (linear.a.nrows(), linear.b.ncols());
    let mut joint = DMatrix::zeros(nx + nu, nx + nu);
    joint
        .view_mut((0, 0), (nx, nx))
        .copy_from(&(&linear.a * sample_time));
    joint
        .view_mut((0, nx), (nx, nu))
        .copy_from(&(&linear.b * sample_time));
    let held = joint.exp();
    let lift = |m: DMatrix<f64>| m.map(|x| Complex::new(x, 0.0));
    let a_d = lift(held.view((0, 0), (nx, nx)).into_owned());
    let b_d = lift(held.view((0, nx), (nx, nu)).into_owned());
    let c = lift(linear.c.clone());
    frequency_hz
        .iter()
        .map(|f| {
            let z = Complex::from_polar(1.0, std::f64::consts::TAU * f * sample_time);
            let resolvent = DMatrix::from_diagonal_element(nx, nx, z) - &a_d;
            resolvent.lu().solve(&b_d).map(|x| &c * x)
        })
        .collect()
}
