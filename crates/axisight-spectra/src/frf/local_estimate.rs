//! What the local methods return and what they refuse.

use super::flag::LineFlag;
use super::local_least_squares::C;
use rayon::prelude::*;

/// Condition number above which a line is flagged.
const ILL_CONDITIONED: f64 = 1e3;

/// Responses `(line, output, input)` with their variance, and condition and flag by line.
#[derive(Debug, Clone)]
pub struct LocalEstimate {
    /// Frequency responses.
    pub response: Vec<C>,
    /// `E|dG|^2`.
    pub variance: Vec<f64>,
    /// Condition number of the scaled regressors.
    pub condition: Vec<f64>,
    /// Flags.
    pub flag: Vec<LineFlag>,
    /// Complex degrees of freedom of the residuals behind the variance.
    pub degrees_of_freedom: usize,
}

/// Records that the local methods cannot take.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: expected {expected}, got {got}")]
pub struct LocalModelError {
    /// Field.
    pub field: &'static str,
    /// What it should be.
    pub expected: String,
    /// What came.
    pub got: String,
}

/// A [`LocalModelError`] where `right` does not hold.
pub(super) fn expect(
    right: bool,
    field: &'static str,
    expected: impl FnOnce() -> String,
    got: impl std::fmt::Display,
) -> Result<(), LocalModelError> {
    if right {
        return Ok(());
    }
    let (expected, got) = (expected(), got.to_string());
    Err(LocalModelError {
        field,
        expected,
        got,
    })
}

/// The results of one line, to be filled.
pub(super) struct Line<'a> {
    pub(super) response: &'a mut [C],
    pub(super) variance: &'a mut [f64],
    condition: &'a mut f64,
    flag: &'a mut LineFlag,
}

impl Line<'_> {
    pub(super) fn fail(&mut self, flag: LineFlag) {
        *self.flag = flag;
    }

    pub(super) fn condition(&mut self, condition: f64) {
        *self.condition = condition;
        let poor = condition > ILL_CONDITIONED;
        *self.flag = if poor {
            LineFlag::IllConditioned
        } else {
            LineFlag::Good
        };
    }
}

impl LocalEstimate {
    /// Estimate every line with the scratch of its thread; what is not filled in is NaN.
    ///
    /// A line depends on the records alone, so threads cannot change the result.
    pub(super) fn over_lines<S>(
        n_lines: usize,
        n_elements: usize,
        degrees_of_freedom: usize,
        scratch: impl Fn() -> S + Sync + Send,
        one: impl Fn(usize, &mut S, Line<'_>) + Sync + Send,
    ) -> Self {
        let mut all = Self {
            response: vec![C::new(f64::NAN, f64::NAN); n_lines * n_elements],
            variance: vec![f64::NAN; n_lines * n_elements],
            condition: vec![f64::NAN; n_lines],
            flag: vec![LineFlag::RankDeficient; n_lines],
            degrees_of_freedom,
        };
        all.response
            .par_chunks_mut(n_elements)
            .zip(all.variance.par_chunks_mut(n_elements))
            .zip(all.condition.par_iter_mut().zip(&mut all.flag))
            .enumerate()
            .for_each_init(
                scratch,
                |space, (i, ((response, variance), (condition, flag)))| {
                    let line = Line {
                        response,
                        variance,
                        condition,
                        flag,
                    };
                    one(i, space, line);
                },
            );
        all
    }
}
