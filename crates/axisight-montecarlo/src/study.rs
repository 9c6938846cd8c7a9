//! Settings of a study: robot, excitation, measurement and spread.

use super::error::StudyError;
use super::simulate::{GroupPlant, Model};
use super::spread::Spread;
use axisight_core::robot::{Controller, EffectSetting, RobotDescription};
use axisight_core::simulation::{coloured_noise, measurement_noise};
use axisight_numerics::SmallSolver;
use axisight_spectra::excitation::{Multisine, Square};
use axisight_spectra::frf::Output;
use nalgebra::Complex;

/// Settings that define a study. [`Study::new`] checks them.
#[derive(Debug, Clone)]
pub struct StudySettings {
    /// Robot.
    pub robot: RobotDescription,
    /// Effects to add to the robot's own.
    pub effects: Vec<EffectSetting<f64>>,
    /// Driven joint angles at rest [rad].
    pub start: Vec<f64>,
    /// Linear or nonlinear plant.
    pub model: Model,
    /// Broadband reference [rad/s].
    pub multisine: Multisine,
    /// Square wave [rad/s], on all axes in all experiments.
    pub square: Option<Square>,
    /// Factors of the multisine, row-major `(axis, experiment)`.
    pub directions: Vec<f64>,
    /// Number of periods before the measurement.
    pub waiting_periods: usize,
    /// Number of measured periods, which are averaged.
    pub periods: usize,
    /// Whether positions have the robot's sensor noise.
    pub noise: bool,
    /// Corner frequency of the noise's first-order spectrum [Hz]; `None` for white noise.
    pub noise_cutoff_hz: Option<f64>,
    /// Step of the position sensor [rad]; zero for none.
    pub resolution: f64,
    /// The estimated response.
    pub output: Output,
    /// Parameters that vary from run to run.
    pub spread: Vec<Spread>,
    /// Relative accuracy of the quantiles.
    pub relative_accuracy: f64,
}

/// A checked study.
#[derive(Debug, Clone)]
pub struct Study {
    pub(super) settings: StudySettings,
    square_period: Vec<f64>,
}

/// Largest number of samples of one experiment. More do not fit in memory.
const MOST_SAMPLES: usize = 1 << 31;

impl Study {
    /// Check `settings`, and that the nominal plant can be built and settles.
    ///
    /// # Errors
    /// [`StudyError`] that names the invalid field, or says why the plant cannot be built.
    pub fn new(settings: StudySettings) -> Result<Self, StudyError> {
        let robot = &settings.robot;
        let (n, samples) = (robot.n_axes(), settings.multisine.dft().len());
        if robot.controller == Controller::None {
            let expected = "a controller, which velocity references need";
            return Err(StudyError::field("robot.controller", expected, "kind none"));
        }
        check_directions(&settings.directions, n)?;
        if settings.periods == 0 {
            return Err(StudyError::field("periods", "at least 1", 0));
        }
        let total = settings.waiting_periods.saturating_add(settings.periods);
        if total < 2 {
            // The drift over a period needs the difference of two periods.
            let expected = "at least 2 together with periods";
            return Err(StudyError::field("waiting_periods", expected, total));
        }
        if total.saturating_mul(samples).saturating_mul(n) > MOST_SAMPLES {
            let expected = "at most 2^31 samples per experiment";
            return Err(StudyError::field("waiting_periods", expected, total));
        }
        let square_period = match &settings.square {
            Some(square) if samples % square.samples() != 0 => {
                let expected = "a whole number of square waves in a multisine period";
                let got = samples as f64 / square.samples() as f64;
                return Err(StudyError::field("square.period_s", expected, got));
            }
            Some(square) => square.period(),
            None => Vec::new(),
        };
        for (field, value) in [
            ("measurement.noise_cutoff_hz", settings.noise_cutoff_hz),
            (
                "measurement.position_resolution_rad",
                Some(settings.resolution).filter(|r| *r != 0.0),
            ),
        ] {
            if let Some(bad) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
                return Err(StudyError::field(field, "a positive number", bad));
            }
        }
        for spread in &settings.spread {
            spread.check(robot, &settings.effects)?;
        }
        if settings.model == (Model::Linear { substeps: 0 }) {
            return Err(StudyError::field("plant.substeps", "at least 1", 0));
        }
        GroupPlant::new(settings.model, robot, &settings.effects, &settings.start)?;
        Ok(Self {
            settings,
            square_period,
        })
    }

    /// The settings.
    pub fn settings(&self) -> &StudySettings {
        &self.settings
    }

    /// Number of axes, which is also the number of experiments per run.
    pub fn n_axes(&self) -> usize {
        self.settings.robot.n_axes()
    }

    /// Number of samples per period.
    pub fn period_samples(&self) -> usize {
        self.settings.multisine.dft().len()
    }

    /// Frequencies of the estimated lines [Hz].
    pub fn frequency_hz(&self) -> Vec<f64> {
        let period = self.period_samples() as f64 * self.settings.robot.sample_time;
        let lines = self.settings.multisine.lines().iter();
        lines.map(|k| *k as f64 / period).collect()
    }

    /// Number of complex elements of one estimate.
    pub fn size(&self) -> usize {
        self.settings.multisine.lines().len() * self.n_axes() * self.n_axes()
    }

    /// One period of the broadband reference of a run [rad/s].
    pub fn broadband(&self, seed: u64, run: u64) -> Vec<f64> {
        let multisine = &self.settings.multisine;
        multisine.period(&multisine.phases(seed, run))
    }

    /// Reference of one experiment over all periods, row-major `(sample, axis)` [rad/s].
    pub fn reference(&self, broadband: &[f64], experiment: usize) -> Vec<f64> {
        let n = self.n_axes();
        let column: Vec<f64> = (0..n)
            .map(|axis| self.settings.directions[axis * n + experiment])
            .collect();
        let mut period = Vec::with_capacity(broadband.len() * n);
        for (k, b) in broadband.iter().enumerate() {
            let square = match self.square_period.len() {
                0 => 0.0,
                m => self.square_period[k % m],
            };
            period.extend(column.iter().map(|d| d * b + square));
        }
        period.repeat(self.settings.waiting_periods + self.settings.periods)
    }

    /// Position noise of one experiment [rad], shaped like the reference; `None` if there is none.
    ///
    /// It equals the noise of a simulation with the run number `run * n_axes + experiment`.
    pub fn noise(&self, seed: u64, run: u64, experiment: usize) -> Option<Vec<f64>> {
        let (n, std) = (self.n_axes(), self.settings.robot.position_noise_std);
        let total = self.settings.waiting_periods + self.settings.periods;
        (self.settings.noise && std > 0.0).then(|| {
            let stream = run * n as u64 + experiment as u64;
            let samples = total * self.period_samples();
            let step = self.settings.robot.sample_time;
            match self.settings.noise_cutoff_hz {
                None => measurement_noise(seed, stream, samples, n, std),
                Some(cutoff) => coloured_noise(seed, stream, samples, n, std, cutoff, step),
            }
        })
    }
}

fn check_directions(directions: &[f64], n: usize) -> Result<(), StudyError> {
    let wrong = |got: String| {
        let expected = format!("a non-singular matrix of {n} x {n} finite numbers");
        StudyError::field("directions", &expected, got)
    };
    if directions.len() != n * n {
        return Err(wrong(format!("{} numbers", directions.len())));
    }
    if let Some(bad) = directions.iter().find(|d| !d.is_finite()) {
        return Err(wrong(bad.to_string()));
    }
    let matrix: Vec<_> = directions.iter().map(|d| Complex::new(*d, 0.0)).collect();
    let mut inverse = matrix.clone();
    if !SmallSolver::new(n).invert(&matrix, &mut inverse) {
        return Err(wrong(format!("{directions:?}")));
    }
    Ok(())
}
