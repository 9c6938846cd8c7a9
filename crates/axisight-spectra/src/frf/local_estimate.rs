//! Result and errors of the local methods.

use super::flag::LineFlag;
use super::local_least_squares::C;
use rayon::prelude::*;

/// Condition number above which a line is flagged.
const ILL_CONDITIONED: f64 = 1e3;

/// Responses with their variances, and the condition number and flag of each line.
#[derive(Debug, Clone)]
pub struct LocalEstimate {
    /// Frequency responses, `(line, output, input)`.
    pub response: Vec<C>,
    /// Variance `E|dG|^2` of the response, `(line, output, input)`.
    pub variance: Vec<f64>,
    /// Condition number of the scaled regressors, by line.
    pub condition: Vec<f64>,
    /// Flags, by line.
    pub flag: Vec<LineFlag>,
    /// Complex degrees of freedom of the residuals that give the variance.
    pub degrees_of_freedom: usize,
}

/// Error: the local methods cannot use these records or settings.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: expected {expected}, got {got}")]
pub struct LocalModelError {
    /// Name of the field.
    pub field: &'static str,
    /// Expected value.
    pub expected: String,
    /// Actual value.
    pub got: String,
}

/// Returns a [`LocalModelError`] unless `right` holds.
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

/// The part of the results that belongs to one line.
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
    /// Estimate every line with the scratch memory of its thread. Results that are not filled in
    /// stay NaN.
    ///
    /// A line depends on the records alone, so the number of threads does not change the result.
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
