//! Modes of a linearized robot.

use axisight_core::plant::Linearization;
use axisight_numerics::eigen;
use nalgebra::Complex;

/// One eigenvalue of the linearized plant.
#[derive(Debug, Clone)]
pub struct Mode {
    /// Eigenvalue [rad/s]. A complex pair is represented by the one with positive imaginary part.
    pub eigenvalue: Complex<f64>,
    /// Undamped frequency |lambda| / 2 pi [Hz].
    pub frequency_hz: f64,
    /// Damping ratio `-Re lambda / |lambda|`; zero for an eigenvalue at the origin.
    pub damping_ratio: f64,
    /// Eigenvector over the states, largest element one.
    pub shape: Vec<Complex<f64>>,
}

/// Error: the eigenvalue iteration did not converge, because the matrix has non-finite entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("eigenvalues of the linearization did not converge; expected finite parameters")]
pub struct ModesError;

/// All modes, slowest first. Each complex pair appears once.
///
/// # Errors
/// [`ModesError`] if the eigenvalue iteration fails.
pub fn modes(linear: &Linearization) -> Result<Vec<Mode>, ModesError> {
    let (values, vectors) = eigen(&linear.a).ok_or(ModesError)?;
    // In spite of rounding, exactly one member of each pair must remain.
    let scale = linear.a.amax();
    let pairs = values.iter().zip(vectors.column_iter());
    let mut out: Vec<Mode> = pairs
        .filter(|(value, _)| value.im > -1e-14 * scale)
        .map(|(value, vector)| mode(*value, vector.as_slice()))
        .collect();
    out.sort_by(|x, y| x.frequency_hz.total_cmp(&y.frequency_hz));
    Ok(out)
}

fn mode(eigenvalue: Complex<f64>, column: &[Complex<f64>]) -> Mode {
    let larger = |a: Complex<f64>, c: &Complex<f64>| if c.norm() > a.norm() { *c } else { a };
    let largest = column.iter().fold(Complex::new(0.0, 0.0), larger);
    let magnitude = eigenvalue.norm();
    Mode {
        eigenvalue,
        frequency_hz: magnitude / std::f64::consts::TAU,
        damping_ratio: if magnitude > 0.0 {
            -eigenvalue.re / magnitude
        } else {
            0.0
        },
        shape: column.iter().map(|c| c / largest).collect(),
    }
}
