//! Loss functions on whitened residuals.

/// Loss `rho(r)` with `rho = r^2` near zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// Least squares.
    Squared,
    /// Quadratic up to the given scale, linear above it (Huber 1964).
    Huber(f64),
    /// `2 c^2 (sqrt(1 + (r/c)^2) - 1)` with the scale `c`, a smooth Huber loss.
    SoftL1(f64),
}

impl Loss {
    /// Loss and weight of a residual; the weight is `rho'(r) / (2 r)`.
    pub fn evaluate(self, r: f64) -> (f64, f64) {
        match self {
            Self::Squared => (r * r, 1.0),
            Self::Huber(c) => {
                let size = r.abs();
                if size <= c {
                    (r * r, 1.0)
                } else {
                    (2.0 * c * size - c * c, c / size)
                }
            }
            Self::SoftL1(c) => {
                let root = (1.0 + (r / c).powi(2)).sqrt();
                (2.0 * c * c * (root - 1.0), 1.0 / root)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weight_is_the_slope_of_the_loss() {
        for loss in [Loss::Squared, Loss::Huber(1.3), Loss::SoftL1(0.7)] {
            for r in [-3.0, -1.0, -0.2, 0.4, 2.5] {
                let h = 1e-6;
                let slope = (loss.evaluate(r + h).0 - loss.evaluate(r - h).0) / (2.0 * h);
                assert!(
                    (slope / (2.0 * r) - loss.evaluate(r).1).abs() < 1e-8,
                    "{loss:?} {r}"
                );
            }
        }
    }
}
