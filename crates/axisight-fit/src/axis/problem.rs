//! Residuals, derivatives and normal equations for data sets and parameters.

use super::data::AxisSet;
use super::error::AxisError;
use super::gram::Rows;
use super::layout::{AxisModel, Layout};
use super::numbers::{Jet, LANES, PlainLanes, stored};
use super::predictor::{Predictor, Trajectory};
#[cfg(target_arch = "x86_64")]
use axisight_numerics::descent::Normal;
use axisight_scalar::wide;
use axisight_scalar::{Register, Scalar};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

/// Residuals with derivatives of each data set, and their normal equations.
pub(super) struct Evaluation {
    pub normal: Normal,
    pub rows: Vec<Rows>,
}

/// Residuals and Jacobian, data set by data set.
#[derive(Debug, Clone)]
pub struct Linearization {
    /// Weighted residuals, model minus measurement. A noise filter also whitens them.
    pub residual: Vec<f64>,
    /// Derivatives of the residuals, one vector per free parameter.
    pub columns: Vec<Vec<f64>>,
}

/// Data sets that one model has to explain.
#[derive(Debug)]
pub struct AxisProblem<'a> {
    model: AxisModel,
    sets: Vec<AxisSet>,
    /// Coefficients `a_1..` of `A(q)` that whiten the residuals: `H = 1 / A`.
    whitening: Vec<f64>,
    predicts: bool,
    cancel: &'a AtomicBool,
}

impl<'a> AxisProblem<'a> {
    /// A problem for `model` and `sets`; `predicts` switches the innovations gains on.
    ///
    /// # Errors
    /// [`AxisError::Invalid`] if the model, a data set or the whitening filter is invalid.
    pub fn new(
        model: AxisModel,
        sets: Vec<AxisSet>,
        whitening: Vec<f64>,
        predicts: bool,
        cancel: &'a AtomicBool,
    ) -> Result<Self, AxisError> {
        model.check()?;
        for (i, set) in sets.iter().enumerate() {
            set.check(i)?;
        }
        if whitening.iter().any(|a| !a.is_finite()) {
            return Err(AxisError::invalid("whitening", "finite numbers", "others"));
        }
        Ok(Self {
            model,
            sets,
            whitening,
            predicts,
            cancel,
        })
    }

    /// Places of the parameters.
    pub fn layout(&self) -> Layout {
        self.model.layout()
    }

    /// Data sets.
    pub fn sets(&self) -> &[AxisSet] {
        &self.sets
    }

    /// Number of parameters, including the starts of the data sets.
    pub fn n_parameters(&self) -> usize {
        self.layout().len(self.sets.len())
    }

    /// Weighted sum of the squared outputs, as a scale for the loss.
    pub fn energy(&self) -> f64 {
        let of = |s: &AxisSet| s.weight * s.output.iter().map(|y| y * y).sum::<f64>();
        self.sets.iter().map(of).sum()
    }

    /// Residuals and normal equations of the `free` parameters at `theta`. Reuses the memory of
    /// `spare`.
    pub(super) fn evaluate(
        &self,
        theta: &[f64],
        free: &[usize],
        spare: Option<Evaluation>,
    ) -> Result<Evaluation, AxisError> {
        let spare = spare.map_or_else(Vec::new, |e| e.rows);
        let mut memory: Vec<Option<Rows>> = spare.into_iter().map(Some).collect();
        memory.resize_with(self.sets.len(), || None);
        let parts: Vec<_> = memory
            .into_par_iter()
            .enumerate()
            .map(|(set, memory)| {
                let rows = self.rows(theta, free, set, memory)?;
                Ok((rows.normal(free.len()), rows))
            })
            .collect();
        let mut out = Evaluation {
            normal: Normal::zero(free.len()),
            rows: Vec::with_capacity(parts.len()),
        };
        for part in parts {
            let (normal, rows) = part?;
            out.normal.add(&normal);
            out.rows.push(rows);
        }
        Ok(out)
    }

    /// Residuals and Jacobian at `theta`.
    ///
    /// # Errors
    /// [`AxisError::Diverged`] if the simulation fails, [`AxisError::Cancelled`], and
    /// [`AxisError::Invalid`] if `theta` has the wrong length.
    pub fn linearize(&self, theta: &[f64], free: &[usize]) -> Result<Linearization, AxisError> {
        let parts: Vec<_> = (0..self.sets.len())
            .into_par_iter()
            .map(|s| self.rows(theta, free, s, None))
            .collect();
        let mut out = Linearization {
            residual: Vec::new(),
            columns: vec![Vec::new(); free.len()],
        };
        for part in parts {
            let rows = part?;
            for (slot, column) in out.columns.iter_mut().enumerate() {
                rows.append_column(slot, column);
            }
            out.residual.extend(rows.residual);
        }
        Ok(out)
    }

    /// Simulated or predicted run of data set `set` at the parameters `theta`.
    ///
    /// # Errors
    /// [`AxisError::Diverged`] if the simulation fails, [`AxisError::Cancelled`], and
    /// [`AxisError::Invalid`] if `theta` has the wrong length or there is no such data set.
    pub fn trajectory(&self, theta: &[f64], set: usize) -> Result<Trajectory, AxisError> {
        self.complete(theta)?;
        match self.model.masses {
            2 => self.trajectory_of::<2>(theta, set),
            3 => self.trajectory_of::<3>(theta, set),
            _ => self.trajectory_of::<4>(theta, set),
        }
    }

    fn complete(&self, theta: &[f64]) -> Result<(), AxisError> {
        let (n, got) = (self.n_parameters(), theta.len());
        if n == got {
            Ok(())
        } else {
            Err(AxisError::invalid("theta", format!("{n} numbers"), got))
        }
    }

    fn trajectory_of<const N: usize>(
        &self,
        theta: &[f64],
        set: usize,
    ) -> Result<Trajectory, AxisError> {
        let Some(data) = self.sets.get(set) else {
            return Err(AxisError::invalid("set", "a data set", set));
        };
        let mut out = Trajectory {
            output: Vec::with_capacity(data.torque.len()),
            states: Vec::with_capacity(data.torque.len() * 2 * N),
        };
        let value = |i: usize| theta.get(i).copied().unwrap_or(0.0);
        let run = Predictor::<f64, N>::new(&self.model, theta, set, value, self.predicts);
        // Trajectories include the motor angle, which only the extended equations integrate.
        run.run::<true>(data, self.cancel, |_, x, y| {
            out.output.push(y);
            out.states.extend(x.place.iter().chain(&x.speed));
        })?;
        Ok(out)
    }

    /// Residuals of a data set with their derivatives, in passes of eight parameters.
    fn rows(
        &self,
        theta: &[f64],
        free: &[usize],
        set: usize,
        memory: Option<Rows>,
    ) -> Result<Rows, AxisError> {
        self.complete(theta)?;
        let extended = self.model.extended(theta, free);
        match (self.model.masses, extended) {
            (2, false) => self.rows_of::<2, false>(theta, free, set, memory),
            (2, true) => self.rows_of::<2, true>(theta, free, set, memory),
            (3, false) => self.rows_of::<3, false>(theta, free, set, memory),
            (3, true) => self.rows_of::<3, true>(theta, free, set, memory),
            (_, false) => self.rows_of::<4, false>(theta, free, set, memory),
            (_, true) => self.rows_of::<4, true>(theta, free, set, memory),
        }
    }

    fn rows_of<const N: usize, const EXTENDED: bool>(
        &self,
        theta: &[f64],
        free: &[usize],
        set: usize,
        memory: Option<Rows>,
    ) -> Result<Rows, AxisError> {
        let layout = self.layout();
        let own = layout.start(set)..layout.start(set + 1);
        let acts = |i: usize| i < layout.shared() || own.contains(&i);
        let slots: Vec<usize> = (0..free.len()).filter(|s| acts(free[*s])).collect();
        let data = &self.sets[set];
        let mut rows = Rows::new(slots.clone(), data.torque.len(), memory);
        let passes = slots.len().div_ceil(LANES).max(1);
        for pass in 0..passes {
            let seeds = slots.iter().skip(pass * LANES).take(LANES);
            let seeds: Vec<usize> = seeds.map(|s| free[*s]).collect();
            let task = Pass {
                theta,
                seeds: &seeds,
                set,
                first: pass == 0,
            };
            self.pass::<N, EXTENDED>(&task, &mut rows)?;
        }
        rows.whiten(&self.whitening);
        rows.weigh(data.weight.sqrt());
        Ok(rows)
    }

    /// One pass, in the widest registers that the processor has.
    fn pass<const N: usize, const EXTENDED: bool>(
        &self,
        task: &Pass<'_>,
        rows: &mut Rows,
    ) -> Result<(), AxisError> {
        #[cfg(target_arch = "x86_64")]
        if wide::available() && !EXTENDED {
            // SAFETY: `available` has checked that the processor has the instructions.
            #[allow(unsafe_code)]
            match N {
                2 => return unsafe { self.wide_pass_of_two(task, rows) },
                3 => return unsafe { self.wide_pass_of_three(task, rows) },
                _ => {}
            }
        }
        self.pass_of::<PlainLanes, N, EXTENDED>(task, rows)
    }

    // Separate functions for the common chains only. Compiling them for all chains takes minutes.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512dq")]
    fn wide_pass_of_two(&self, task: &Pass<'_>, rows: &mut Rows) -> Result<(), AxisError> {
        self.pass_of::<wide::Wide, 2, false>(task, rows)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512dq")]
    fn wide_pass_of_three(&self, task: &Pass<'_>, rows: &mut Rows) -> Result<(), AxisError> {
        self.pass_of::<wide::Wide, 3, false>(task, rows)
    }

    #[inline(always)]
    fn pass_of<V: Register, const N: usize, const EXTENDED: bool>(
        &self,
        task: &Pass<'_>,
        rows: &mut Rows,
    ) -> Result<(), AxisError> {
        let (theta, data) = (task.theta, &self.sets[task.set]);
        let value = |i: usize| {
            let number = Jet::<V>::constant(theta.get(i).copied().unwrap_or(0.0));
            let seed = task.seeds.iter().position(|s| *s == i);
            seed.map_or(number, |s| number.seeded(s))
        };
        let run = Predictor::<_, N>::new(&self.model, theta, task.set, value, self.predicts);
        let Rows {
            residual, partials, ..
        } = rows;
        run.run::<EXTENDED>(data, self.cancel, |k, _, y: Jet<V>| {
            if task.first {
                residual.push(y.value - data.output[k]);
            }
            partials.push(stored(y.partials));
        })
    }
}

/// A run of one data set with derivatives along up to eight parameters.
struct Pass<'a> {
    theta: &'a [f64],
    seeds: &'a [usize],
    set: usize,
    /// Whether the run also gives the residuals.
    first: bool,
}
