//! One log of a simulation-error problem.

use super::problem::{ProblemError, invalid};

/// The value of an effect parameter in one log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnValue {
    /// Index of the effect.
    pub effect: usize,
    /// Index of the parameter in the table of the effect.
    pub parameter: usize,
    /// The value.
    pub value: f64,
}

/// One log to be reproduced. Arrays are row-major `(n_samples, n_axes)`.
#[derive(Debug, Clone)]
pub struct Record {
    /// Input of the simulation: velocity reference [rad/s], commanded torque [Nm] or, for tracking,
    /// measured position [rad].
    pub input: Vec<f64>,
    /// Compared output: commanded torque [Nm] or measured position [rad].
    pub target: Vec<f64>,
    /// Factor on the weighted error of each sample, from 0 to 1: how well a model can follow the
    /// log there. `None` means one everywhere.
    pub certainty: Option<Vec<f64>>,
    /// Readings of sensors on the arm, row-major `(n_samples, n_sensed)`; NaN for a sensor that the
    /// log lacks. Empty if the log has none of them.
    pub sensed: Vec<f64>,
    /// Effect parameters whose values hold in this log only, such as its load.
    pub own: Vec<OwnValue>,
    /// Driven joint angles at the start of the run, at rest [rad]. `None` means the operating
    /// point.
    pub start: Option<Vec<f64>>,
    /// Number of samples of the run-up at the beginning of input and target. They are simulated but
    /// not compared, and `certainty` does not include them.
    pub lead: usize,
}

impl Record {
    /// A log with a certainty of one that begins at the operating point.
    pub fn new(input: Vec<f64>, target: Vec<f64>) -> Self {
        Self {
            input,
            target,
            certainty: None,
            sensed: Vec::new(),
            own: Vec::new(),
            start: None,
            lead: 0,
        }
    }

    /// The run-up and the first `n_samples` compared samples, for `n_axes` axes and `n_sensed`
    /// sensors on the arm.
    pub(super) fn first(&self, n_samples: usize, n_axes: usize, n_sensed: usize) -> Self {
        let rows = self.lead + n_samples;
        let kept = rows * n_axes;
        let certainty = self.certainty.as_ref();
        Self {
            input: self.input[..kept.min(self.input.len())].to_vec(),
            target: self.target[..kept.min(self.target.len())].to_vec(),
            certainty: certainty.map(|c| c[..(n_samples * n_axes).min(c.len())].to_vec()),
            sensed: self.sensed[..(rows * n_sensed).min(self.sensed.len())].to_vec(),
            own: self.own.clone(),
            start: self.start.clone(),
            lead: self.lead,
        }
    }

    /// Refuse arrays that do not fit `n_axes` axes and `n_sensed` sensors on the arm; `number` is
    /// the index of the log in the error.
    pub(super) fn validate(
        &self,
        number: usize,
        n_axes: usize,
        n_sensed: usize,
    ) -> Result<(), ProblemError> {
        let field = format!("records[{number}]");
        let (n, m) = (self.input.len(), self.target.len());
        if n != m || n == 0 || n % n_axes != 0 {
            let expected = format!("input and target of equal size, {n_axes} axes");
            return Err(invalid(field, expected, format!("{n} and {m} numbers")));
        }
        let readings = n / n_axes * n_sensed;
        if !self.sensed.is_empty() && self.sensed.len() != readings {
            let got = self.sensed.len().to_string();
            let expected = format!("{readings} numbers, {n_sensed} for each sample");
            return Err(invalid(format!("{field}.sensed"), expected, got));
        }
        if self.lead >= n / n_axes {
            let expected = format!("less than {} samples", n / n_axes);
            return Err(invalid(
                format!("{field}.lead"),
                expected,
                self.lead.to_string(),
            ));
        }
        if let Some(certainty) = &self.certainty {
            let field = format!("{field}.certainty");
            check_certainty(field, certainty, n - self.lead * n_axes)?;
        }
        if let Some(k) = self.target.iter().position(|v| !v.is_finite()) {
            let got = format!("{} at sample {}", self.target[k], k / n_axes);
            return Err(invalid(field, "finite numbers".into(), got));
        }
        Ok(())
    }
}

fn check_certainty(field: String, certainty: &[f64], n: usize) -> Result<(), ProblemError> {
    if certainty.len() != n {
        let got = certainty.len().to_string();
        return Err(invalid(field, format!("{n} numbers, as the input"), got));
    }
    if let Some(bad) = certainty.iter().find(|c| !(0.0..=1.0).contains(*c)) {
        return Err(invalid(field, "from 0 to 1".into(), bad.to_string()));
    }
    Ok(())
}
