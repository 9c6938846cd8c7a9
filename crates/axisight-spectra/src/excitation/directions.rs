//! Directions of the excitation: `r(t) = T r_0(t)`, with one column of `T` per experiment.

use super::ExcitationError;

/// The direction matrix called `name` for `n` axes, row-major `(axis, experiment)`.
///
/// * `identity`: one axis at a time, T1 of Wernholt (2004), (6.6).
/// * `t2`: T2 of the same equation, for three axes only.
/// * `hadamard`: Sylvester's construction, for 1, 2, 4, 8, ... axes.
///
/// # Errors
/// [`ExcitationError`] for an unknown name, or for a size for which the matrix is not defined.
pub fn directions(name: &str, n: usize) -> Result<Vec<f64>, ExcitationError> {
    let wrong = |expected: &str| {
        let got = format!("`{name}` for {n} axes");
        ExcitationError::new("directions", expected, got)
    };
    match name {
        "identity" => Ok((0..n * n)
            .map(|i| f64::from(u8::from(i / n == i % n)))
            .collect()),
        "t2" if n == 3 => Ok(vec![1.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0, -1.0]),
        "t2" => Err(wrong("three axes")),
        "hadamard" if n.is_power_of_two() => Ok((0..n * n)
            .map(|i| {
                let odd = ((i / n) & (i % n)).count_ones() % 2 == 1;
                if odd { -1.0 } else { 1.0 }
            })
            .collect()),
        "hadamard" => Err(wrong("a power of two axes")),
        _ => Err(wrong("identity, t2, hadamard or a matrix")),
    }
}
