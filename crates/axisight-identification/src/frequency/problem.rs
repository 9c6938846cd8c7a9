//! Residuals of all operating points and their normal equations.

use super::checks::{check_parameters, check_pose};
use super::columns::Columns;
use super::error::{FrequencyFitError, invalid};
use super::hold::Hold;
use super::residuals::Residuals;
use super::response::evaluate;
use super::second_order::{Linearizer, SecondOrderError};
use super::settings::{FrequencyOptions, FrequencyParameter};
use super::weighting::{Criterion, PoseResponse, Whitening, whitening};
use crate::logs::Loss;
use axisight_core::robot::{EffectSetting, RobotDescription};
use axisight_numerics::descent::Normal;
use nalgebra::{Complex, DMatrix};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

type C = Complex<f64>;

/// A fit of a linearized robot to responses, checked and whitened.
pub struct FrequencyProblem {
    pub(super) parameters: Vec<FrequencyParameter>,
    pub(super) free: Vec<usize>,
    robot: RobotDescription,
    settings: Vec<EffectSetting<f64>>,
    hold: Hold,
    criterion: Criterion,
    loss: Loss,
    poses: Vec<Prepared>,
    block_lines: usize,
    cancel: Arc<AtomicBool>,
}

struct Prepared {
    data: PoseResponse,
    whitening: Whitening,
    /// Variance of a residual due to the uncertainty of the response, per element.
    expected: Option<Vec<f64>>,
}

/// Covariance information at the end of a fit, besides the normal equations.
#[derive(Debug, Clone)]
pub struct Scatter {
    /// Covariance of `J^T W r` due to the uncertainty of the responses; `None` if that is unknown.
    pub expected: Option<DMatrix<f64>>,
    /// Sum of the squared gradients of blocks of lines.
    pub blocks: DMatrix<f64>,
    /// Complex residuals of all poses, one after the other, each `(line, output, input)`.
    pub residual: Vec<C>,
    /// Number of residuals that are used, real and imaginary parts.
    pub count: usize,
}

impl FrequencyProblem {
    /// Check the input and compute the whitening.
    ///
    /// # Errors
    /// [`FrequencyFitError`] if the input is invalid.
    pub fn new(
        robot: RobotDescription,
        settings: Vec<EffectSetting<f64>>,
        parameters: Vec<FrequencyParameter>,
        poses: Vec<PoseResponse>,
        options: FrequencyOptions,
        cancel: Arc<AtomicBool>,
    ) -> Result<Self, FrequencyFitError> {
        check_parameters(&parameters, &robot)?;
        if poses.is_empty() {
            return Err(invalid("responses", "at least one operating point", "none"));
        }
        let mut prepared = Vec::with_capacity(poses.len());
        for (number, data) in poses.into_iter().enumerate() {
            check_pose(&data, robot.n_axes(), number, options)?;
            let (whitening, expected) =
                whitening(&data, options.criterion, options.weighted, number)?;
            prepared.push(Prepared {
                data,
                whitening,
                expected,
            });
        }
        let free = (0..parameters.len())
            .filter(|i| !parameters[*i].frozen)
            .collect();
        Ok(Self {
            free,
            parameters,
            robot,
            settings,
            hold: options.hold,
            criterion: options.criterion,
            loss: options.loss,
            poses: prepared,
            block_lines: options.block_lines.max(1),
            cancel,
        })
    }

    /// Values of all parameters in their own units, for `theta` in search units.
    pub fn values(&self, theta: &[f64]) -> Vec<f64> {
        let natural = |(p, x): (&FrequencyParameter, &f64)| match (p.frozen, p.logarithmic) {
            (true, _) => p.initial,
            (false, true) => x.exp(),
            (false, false) => *x,
        };
        self.parameters.iter().zip(theta).map(natural).collect()
    }

    /// Loss and normal equations of the free parameters at `theta`, both in search units.
    ///
    /// # Errors
    /// [`FrequencyFitError`] if the model is not valid at `theta`, or if the fit is cancelled.
    pub fn evaluate(&self, theta: &[f64]) -> Result<Normal, FrequencyFitError> {
        let mut sum = Normal::zero(self.free.len());
        for part in self.each_pose(theta, |_, residuals| residuals.normal())? {
            sum.add(&part);
        }
        Ok(sum)
    }

    /// Number of residuals that are used, real and imaginary parts.
    pub(super) fn count(&self) -> usize {
        self.poses.iter().map(|pose| 2 * pose.n_used()).sum()
    }

    /// Normal matrix of every pose at `theta`, which is the information of the pose.
    ///
    /// # Errors
    /// [`FrequencyFitError`] if the model is not valid at `theta`, or if the fit is cancelled.
    pub fn information(&self, theta: &[f64]) -> Result<Vec<DMatrix<f64>>, FrequencyFitError> {
        self.each_pose(theta, |_, residuals| residuals.normal().matrix)
    }

    /// Covariance information from the residuals at `theta`.
    ///
    /// # Errors
    /// [`FrequencyFitError`] if the model is not valid at `theta`, or if the fit is cancelled.
    pub fn scatter(&self, theta: &[f64]) -> Result<Scatter, FrequencyFitError> {
        let parts = self.each_pose(theta, |pose, residuals| {
            let lines = pose.data.frequency_hz.len();
            (
                pose.expected.as_ref().map(|v| residuals.expected(v, lines)),
                residuals.blocks(lines, self.block_lines),
                residuals.complex(lines),
                pose.n_used(),
            )
        })?;
        let n = self.free.len();
        let mut out = Scatter {
            expected: Some(DMatrix::zeros(n, n)),
            blocks: DMatrix::zeros(n, n),
            residual: Vec::new(),
            count: 0,
        };
        for (expected, blocks, residual, count) in parts {
            out.expected = out.expected.zip(expected).map(|(sum, part)| sum + part);
            out.blocks += blocks;
            out.residual.extend(residual);
            out.count += 2 * count;
        }
        Ok(out)
    }

    fn each_pose<T: Send>(
        &self,
        theta: &[f64],
        take: impl Fn(&Prepared, Residuals) -> T + Sync,
    ) -> Result<Vec<T>, FrequencyFitError> {
        if self.cancel.load(Ordering::Relaxed) {
            return Err(FrequencyFitError::Cancelled);
        }
        let values = self.values(theta);
        let parameters = self.parameters.iter().map(|p| p.parameter);
        let overrides: Vec<_> = parameters.zip(values.iter().copied()).collect();
        let usual = Linearizer::new(&self.robot, &self.settings, &overrides, &self.free)
            .map_err(|source| FrequencyFitError::Robot { pose: 1, source })?;
        let slope = |i: &usize| {
            if self.parameters[*i].logarithmic {
                values[*i]
            } else {
                1.0
            }
        };
        let slopes: Vec<f64> = self.free.iter().map(slope).collect();
        let one = |(number, pose): (usize, &Prepared)| {
            let own = self.own_settings(pose).map(|settings| {
                Linearizer::new(&self.robot, &settings, &overrides, &self.free).map_err(|source| {
                    FrequencyFitError::Robot {
                        pose: number + 1,
                        source,
                    }
                })
            });
            let own = own.transpose()?;
            let linearizer = own.as_ref().unwrap_or(&usual);
            let residuals = self.residuals(number, pose, linearizer, &slopes)?;
            Ok(take(pose, residuals))
        };
        self.poses.par_iter().enumerate().map(one).collect()
    }

    /// Effects at a pose that has values of its own; `None` for other poses.
    fn own_settings(&self, pose: &Prepared) -> Option<Vec<EffectSetting<f64>>> {
        if pose.data.own.is_empty() {
            return None;
        }
        let mut settings = self.settings.clone();
        for one in &pose.data.own {
            let setting = settings.get_mut(one.effect);
            if let Some(number) = setting.and_then(|s| s.parameters.get_mut(one.parameter)) {
                *number = one.value;
            }
        }
        Some(settings)
    }

    fn residuals(
        &self,
        number: usize,
        pose: &Prepared,
        linearizer: &Linearizer<'_>,
        slopes: &[f64],
    ) -> Result<Residuals, FrequencyFitError> {
        let failed = |source| FrequencyFitError::Robot {
            pose: number + 1,
            source,
        };
        let (model, derivatives) = linearizer.at(&pose.data.joint_angle).map_err(failed)?;
        let columns = evaluate(&model, &derivatives, &pose.data.frequency_hz, self.hold)
            .ok_or(failed(SecondOrderError::Mass))?;
        let mut residuals = self.compare(pose, &columns, slopes);
        if let Some(bad) = residuals.values.iter().position(|r| !r.is_finite()) {
            let lines = pose.data.frequency_hz.len();
            let (element, m) = (bad / (2 * lines), self.robot.n_axes());
            return Err(FrequencyFitError::NotFinite {
                pose: number + 1,
                frequency_hz: pose.data.frequency_hz[bad % lines],
                output: element / m + 1,
                input: element % m + 1,
            });
        }
        if let Whitening::Lines(matrices) = &pose.whitening {
            residuals.whiten(matrices);
        }
        residuals.weigh(self.loss, pose.data.frequency_hz.len());
        Ok(residuals)
    }

    /// Deviations and their derivatives, whitened if the elements have separate factors.
    fn compare(&self, pose: &Prepared, columns: &Columns, slopes: &[f64]) -> Residuals {
        let (lines, m) = (pose.data.frequency_hz.len(), self.robot.n_axes());
        let size = 2 * lines * m * m;
        let mut values = vec![0.0; size];
        let mut jacobian = vec![vec![0.0; size]; slopes.len()];
        let powers: Vec<C> = pose
            .data
            .frequency_hz
            .iter()
            .map(|f| power(*f, pose.data.order))
            .collect();
        let mut factor = vec![C::default(); lines];
        for element in 0..m * m {
            let (a, b) = (element / m, element % m);
            let (re, im) = columns.parts(0, a, b);
            let place = element * 2 * lines;
            let (out_re, out_im) = values[place..place + 2 * lines].split_at_mut(lines);
            for line in 0..lines {
                let k = line * m * m + element;
                let weight = match &pose.whitening {
                    Whitening::Elements(factors) => factors[k],
                    Whitening::Lines(_) => 1.0,
                };
                if weight == 0.0 {
                    factor[line] = C::default();
                    continue;
                }
                let model = C::new(re[line], im[line]) * powers[line];
                let (deviation, slope) = match self.criterion {
                    Criterion::Linear => (model - pose.data.response[k], powers[line]),
                    // The angle of the ratio is the phase difference, whatever the two phases are.
                    Criterion::Logarithmic => {
                        ((model / pose.data.response[k]).ln(), powers[line] / model)
                    }
                };
                (out_re[line], out_im[line]) = (weight * deviation.re, weight * deviation.im);
                factor[line] = slope * weight;
            }
            for (p, (column, slope)) in jacobian.iter_mut().zip(slopes).enumerate() {
                let (re, im) = columns.parts(p + 1, a, b);
                let (out_re, out_im) = column[place..place + 2 * lines].split_at_mut(lines);
                for line in 0..lines {
                    let f = factor[line] * *slope;
                    out_re[line] = f.re * re[line] - f.im * im[line];
                    out_im[line] = f.re * im[line] + f.im * re[line];
                }
            }
        }
        Residuals {
            values,
            weight: Vec::new(),
            loss: 0.0,
            jacobian,
        }
    }
}

/// `(i w)^order`.
fn power(frequency_hz: f64, order: u8) -> C {
    let w = std::f64::consts::TAU * frequency_hz;
    match order {
        0 => C::new(1.0, 0.0),
        1 => C::new(0.0, w),
        _ => C::new(-w * w, 0.0),
    }
}

impl Prepared {
    fn n_used(&self) -> usize {
        match &self.whitening {
            Whitening::Elements(factors) => factors.iter().filter(|f| **f > 0.0).count(),
            Whitening::Lines(_) => self.data.response.len(),
        }
    }
}
