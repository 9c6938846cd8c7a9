//! Evaluation of the regressor: samples in lanes, blocks of samples in parallel.

use super::chain::{Geometry, JointMotion, LINK_PARAMETERS, Sweep};
use super::extra::Extra;
use super::{RegressorError, check_rows};
use axisight_plant::robot::RobotDescription;
use axisight_scalar::{Lanes, Scalar};
use rayon::prelude::*;

/// Number of samples in lock-step.
pub(super) const LANES: usize = 8;
pub(super) type Lane = Lanes<LANES>;

/// Number of samples of a parallel task.
const TASK: usize = 128;

/// Motions of all joints, row-major `(n_samples, n_joints)` [rad, rad/s, rad/s^2; m].
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Joint positions.
    pub q: &'a [f64],
    /// Joint velocities.
    pub v: &'a [f64],
    /// Joint accelerations.
    pub a: &'a [f64],
}

/// One nonzero entry of a row, with its source.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) column: usize,
    /// Cells of the sweep, with coefficients; empty for an extra column.
    cells: Vec<(usize, f64)>,
    extra: Option<(usize, f64)>,
}

/// The regressor of a chain or tree.
#[derive(Debug, Clone)]
pub struct Regressor {
    pub(super) geometry: Geometry,
    extras: Vec<Extra>,
    /// The structurally nonzero columns of each row.
    pub(super) rows: Vec<Vec<Entry>>,
}

/// Scratch memory of one task.
pub(super) struct Scratch {
    sweep: Sweep<Lane>,
    motion: Vec<JointMotion<Lane>>,
    signals: Vec<Lane>,
}

impl Regressor {
    /// The regressor for the rows `row_map (n_rows, n_joints) * joint torques` of `robot`. The
    /// columns `extras` follow those of the links. With a floating base, the joints are those of
    /// [`RobotDescription::on_base_joints`].
    ///
    /// # Errors
    /// [`RegressorError`] if there is no row, or if the row map or an extra column has the wrong
    /// size or is not finite.
    pub fn new(
        robot: &RobotDescription,
        row_map: &[f64],
        extras: Vec<Extra>,
    ) -> Result<Self, RegressorError> {
        let geometry = Geometry::new(robot);
        let n = geometry.segments.len();
        let n_rows = row_map.len().checked_div(n).unwrap_or(0);
        if n_rows == 0 {
            return Err(RegressorError::new("rows", "at least one row", &"none"));
        }
        check_rows("rows", row_map, n_rows, n)?;
        for extra in &extras {
            extra.check(n, n_rows)?;
        }
        let rows = row_map.chunks_exact(n).enumerate();
        let rows = rows.map(|(r, weights)| entries(&geometry, r, weights, &extras));
        Ok(Self {
            rows: rows.collect(),
            geometry,
            extras,
        })
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.geometry.segments.len()
    }

    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.rows.len()
    }

    /// Number of columns: ten for each loaded link, then the extras.
    pub fn n_parameters(&self) -> usize {
        self.geometry.links.len() * LINK_PARAMETERS + self.extras.len()
    }

    /// Joints whose links have mass.
    pub fn links(&self) -> &[usize] {
        &self.geometry.links
    }

    /// Check a motion; returns its number of samples.
    pub(super) fn check(&self, motion: &Motion<'_>) -> Result<usize, RegressorError> {
        let n = self.n_joints();
        let n_samples = motion.q.len() / n;
        check_rows("q", motion.q, n_samples, n)?;
        check_rows("v", motion.v, n_samples, n)?;
        check_rows("a", motion.a, n_samples, n)?;
        Ok(n_samples)
    }

    pub(super) fn scratch(&self) -> Scratch {
        Scratch {
            sweep: Sweep::new(&self.geometry),
            motion: Vec::with_capacity(self.n_joints()),
            signals: Vec::with_capacity(self.extras.len()),
        }
    }

    /// Evaluate the samples from `first` on, one per lane. The last sample fills unused lanes.
    #[inline]
    pub(super) fn sweep(&self, scratch: &mut Scratch, motion: &Motion<'_>, first: usize) {
        let n = self.n_joints();
        let last = (motion.q.len() / n).saturating_sub(1);
        let lanes =
            |x: &[f64], j: usize| Lane::from_lanes(|lane| x[(first + lane).min(last) * n + j]);
        scratch.motion.clear();
        scratch.motion.extend((0..n).map(|j| JointMotion {
            q: lanes(motion.q, j),
            v: lanes(motion.v, j),
            a: lanes(motion.a, j),
        }));
        scratch.sweep.run(&self.geometry, &scratch.motion);
        scratch.signals.clear();
        for extra in &self.extras {
            let mut sums = [Lane::zero(); 3];
            for (weight, at) in extra.motion.iter().zip(&scratch.motion) {
                if *weight != 0.0 {
                    for (sum, x) in sums.iter_mut().zip([at.q, at.v, at.a]) {
                        *sum = x.fma(Lane::constant(*weight), *sum);
                    }
                }
            }
            let [q, v, a] = sums;
            scratch.signals.push(extra.signal.value(q, v, a));
        }
    }

    /// The entries of all rows, as runs of adjacent entries.
    fn runs(&self) -> Vec<Run> {
        let n_parameters = self.n_parameters();
        let places = self
            .rows
            .iter()
            .enumerate()
            .flat_map(|(r, row)| row.iter().map(move |entry| r * n_parameters + entry.column));
        let mut out: Vec<Run> = Vec::new();
        for (first, place) in places.enumerate() {
            match out.last_mut() {
                Some(run) if run.place + run.len == place => run.len += 1,
                _ => out.push(Run {
                    place,
                    first,
                    len: 1,
                }),
            }
        }
        out
    }

    /// The regressor, row-major `(n_samples, n_rows, n_parameters)`.
    ///
    /// # Errors
    /// [`RegressorError`] if an array has the wrong size or is not finite.
    pub fn evaluate(&self, motion: &Motion<'_>) -> Result<Vec<f64>, RegressorError> {
        let n_samples = self.check(motion)?;
        let n_parameters = self.n_parameters();
        let width = self.n_rows() * n_parameters;
        let mut out = vec![0.0; n_samples * width];
        if width == 0 {
            return Ok(out);
        }
        let runs = self.runs();
        out.par_chunks_mut(TASK * width).enumerate().for_each_init(
            || (self.scratch(), Vec::new()),
            |(scratch, values), (task, out)| {
                for (group, out) in out.chunks_mut(LANES * width).enumerate() {
                    self.sweep(scratch, motion, task * TASK + group * LANES);
                    values.clear();
                    let entries = self.rows.iter().flatten();
                    values.extend(entries.map(|entry| entry.value(scratch)));
                    for (lane, sample) in out.chunks_exact_mut(width).enumerate() {
                        copy_lane(&runs, values, lane, sample);
                    }
                }
            },
        );
        Ok(out)
    }
}

impl Entry {
    #[inline(always)]
    pub(super) fn value(&self, scratch: &Scratch) -> Lane {
        if let Some((i, weight)) = self.extra {
            return scratch.signals[i] * weight;
        }
        let mut terms = self.cells.iter();
        let Some((cell, weight)) = terms.next() else {
            return Lane::zero();
        };
        let mut sum = scratch.sweep.cells[*cell] * *weight;
        for (cell, weight) in terms {
            sum = scratch.sweep.cells[*cell].fma(Lane::constant(*weight), sum);
        }
        sum
    }
}

/// A run of adjacent entries: its place in a sample, its first entry, its length.
struct Run {
    place: usize,
    first: usize,
    len: usize,
}

/// Copy one lane of the values to its sample.
#[inline(always)]
fn copy_lane(runs: &[Run], values: &[Lane], lane: usize, sample: &mut [f64]) {
    for run in runs {
        let to = &mut sample[run.place..run.place + run.len];
        for (to, value) in to.iter_mut().zip(&values[run.first..run.first + run.len]) {
            *to = value.0[lane];
        }
    }
}

/// The structurally nonzero columns of row `r`.
fn entries(geometry: &Geometry, r: usize, weights: &[f64], extras: &[Extra]) -> Vec<Entry> {
    let n = weights.len();
    let mut out = Vec::new();
    for (l, link) in geometry.links.iter().enumerate() {
        let felt: Vec<(usize, f64)> = weights
            .iter()
            .enumerate()
            .filter(|(joint, w)| geometry.moves(*joint, *link) && **w != 0.0)
            .map(|(joint, w)| (joint, *w))
            .collect();
        if felt.is_empty() {
            continue;
        }
        for parameter in 0..LINK_PARAMETERS {
            let cell = |joint: usize| (l * n + joint) * LINK_PARAMETERS + parameter;
            out.push(Entry {
                column: l * LINK_PARAMETERS + parameter,
                cells: felt.iter().map(|(joint, w)| (cell(*joint), *w)).collect(),
                extra: None,
            });
        }
    }
    let first = geometry.links.len() * LINK_PARAMETERS;
    for (i, extra) in extras.iter().enumerate() {
        let weight = extra.rows.get(r).copied().unwrap_or(0.0);
        if weight != 0.0 {
            out.push(Entry {
                column: first + i,
                cells: Vec::new(),
                extra: Some((i, weight)),
            });
        }
    }
    out
}
