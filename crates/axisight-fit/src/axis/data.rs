//! A record of one axis, with its checks.

use super::error::AxisError;

/// A record of one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisSet {
    /// Number of the data set, from 0.
    pub number: usize,
    /// Motor torque [Nm].
    pub torque: Vec<f64>,
    /// Measured output, one value per sample of the torque.
    pub output: Vec<f64>,
    /// Sample time [s].
    pub sample_time: f64,
    /// Weight of the squared residuals.
    pub weight: f64,
    /// Samples per block of the sandwich covariance.
    pub block: usize,
}

impl AxisSet {
    /// Refuse data that cannot be simulated; `i` is the number of the data set in the error.
    pub(super) fn check(&self, i: usize) -> Result<(), AxisError> {
        let field = |name: &str| format!("data_sets[{i}].{name}");
        let (n, m) = (self.torque.len(), self.output.len());
        if n != m || n == 0 {
            return Err(AxisError::invalid(
                field("output"),
                format!("as many samples as the torque has, {n}, and some"),
                m,
            ));
        }
        let finite = |x: &[f64]| x.iter().all(|x| x.is_finite());
        if !finite(&self.torque) || !finite(&self.output) {
            return Err(AxisError::invalid(
                field("samples"),
                "finite numbers",
                "others",
            ));
        }
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !positive(self.sample_time) || !positive(self.weight) {
            return Err(AxisError::invalid(
                field("sample_time, weight"),
                "positive numbers",
                format!("{}, {}", self.sample_time, self.weight),
            ));
        }
        Ok(())
    }
}
