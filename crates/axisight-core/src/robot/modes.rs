//! Modes and zero-order-hold frequency response of a linearization.

use super::linearization::Linearization;
use nalgebra::{Complex, DMatrix};

/// One eigenvalue of the linearized plant.
#[derive(Debug, Clone)]
pub struct Mode {
    /// Eigenvalue [rad/s]; of a complex pair, the one with positive imaginary part.
    pub eigenvalue: Complex<f64>,
    /// Undamped frequency |lambda| / 2 pi [Hz].
    pub frequency_hz: f64,
    /// Damping ratio `-Re lambda / |lambda|`; zero for an eigenvalue at the origin.
    pub damping_ratio: f64,
    /// Eigenvector over the states, largest element one.
    pub shape: Vec<Complex<f64>>,
}

/// The eigenvalue iteration did not converge (the matrix has non-finite entries).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("eigenvalues of the linearization did not converge; expected finite parameters")]
pub struct ModesError;

/// All modes, slowest first; each complex pair appears once.
///
/// # Errors
/// [`ModesError`] if the eigenvalue iteration fails.
pub fn modes(linear: &Linearization) -> Result<Vec<Mode>, ModesError> {
    let n = linear.a.nrows();
    let a = faer::Mat::from_fn(n, n, |i, j| linear.a[(i, j)]);
    let eigen = a.eigen().map_err(|_| ModesError)?;
    let (values, vectors) = (eigen.S().column_vector(), eigen.U());
    // A pair's members must not both survive nor both vanish through rounding.
    let scale = linear.a.amax();
    let mut out: Vec<Mode> = (0..n)
        .filter(|j| values[*j].im > -1e-14 * scale)
        .map(|j| {
            let column: Vec<_> = (0..n).map(|i| vectors[(i, j)]).collect();
            mode(Complex::new(values[j].re, values[j].im), &column)
        })
        .collect();
    out.sort_by(|x, y| x.frequency_hz.total_cmp(&y.frequency_hz));
    Ok(out)
}

fn mode(eigenvalue: Complex<f64>, column: &[faer::c64]) -> Mode {
    let largest = column.iter().map(|c| Complex::new(c.re, c.im)).fold(
        Complex::new(0.0, 0.0),
        |a: Complex<f64>, c| {
            if c.norm() > a.norm() { c } else { a }
        },
    );
    let magnitude = eigenvalue.norm();
    Mode {
        eigenvalue,
        frequency_hz: magnitude / std::f64::consts::TAU,
        damping_ratio: if magnitude > 0.0 {
            -eigenvalue.re / magnitude
        } else {
            0.0
        },
        shape: column
            .iter()
            .map(|c| Complex::new(c.re, c.im) / largest)
            .collect(),
    }
}

/// Response `G(e^{i w T}) = C (e^{i w T} I - A_d)^-1 B_d` from motor torque to
/// motor angle for a torque held over each sample; `(frequency, output, input)`.
///
/// The true response of a sampled loop is this one, not `G(i w)`. Returns
/// `None` in the place of a frequency that hits a pole.
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
