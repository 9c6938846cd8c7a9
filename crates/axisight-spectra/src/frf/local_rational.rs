//! Local rational method: least squares for `D(x) Y = N(x) U + C(x)` around each line.
//!
//! `McKelvey` and Guérin (2012), "Non-parametric frequency response estimation using a local
//! rational model". The local polynomial method is the case `D = 1`; see Pintelon and Schoukens
//! (2012), chapter 7.
//!
//! `N` (one row per output) and the transient `C` (one per output and experiment) are polynomials
//! over the window. `D` is one polynomial per output, with `D = 1` at the line itself, so that
//! `G = N` there.
//!
//! The local variable is `x = tan(pi r / N)` at `r` lines from the middle of the window. A rational
//! function of `z = exp(i w T)` is a rational function of `x` of the same orders, up to a common
//! factor. Sampled systems of low order are therefore estimated exactly. For windows that are short
//! compared with the record, `x` is proportional to `r`.
//!
//! The error of the equation is `D V`, where `V` is the noise, white over the window. With the
//! leverages `h`, the noise variance is `s^2 = |E|^2 / sum_r |D_r|^2 (1 - h_r)`. With the weights
//! `w` that map the error to the error of `G`, `var G = s^2 sum_r |w_r D_r|^2`. This is exact for
//! `D = 1`, otherwise to first order in the noise; noise in the regressors `x^s Y` is of second
//! order.

use super::flag::LineFlag;
use super::local_estimate::{Line, LocalEstimate, LocalModelError, expect};
use super::local_least_squares::{C, Columns, DEPENDENT, Polynomials, Triangle, add, energy};
use super::record_spectra::{RecordSpectra, Records};

/// Orders and window of a local model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LocalModel {
    /// Order of the numerators and of the transients.
    pub order: usize,
    /// Order of the denominators; 0 for the local polynomial method.
    pub denominator_order: usize,
    /// Number of lines on each side of the estimated line.
    pub half_width: usize,
    /// First and last line that a window may cover. At these ends the window moves inwards.
    pub band: (usize, usize),
}

/// Largest order of a local polynomial.
pub(super) const MAX_ORDER: usize = 8;

/// Estimate the response at the given lines of the whole record.
///
/// # Errors
/// [`LocalModelError`] if an order is too high, the band is out of range, the window is longer than
/// the band or too short for the number of unknowns, or a line is out of range.
pub fn local_rational(
    records: &Records<'_>,
    lines: &[usize],
    model: LocalModel,
) -> Result<LocalEstimate, LocalModelError> {
    let spectra = RecordSpectra::new(records);
    let freedom = check(&spectra, lines, model)?;
    let (m, width) = (2 * model.half_width + 1, model.half_width as f64);
    let step = std::f64::consts::PI / spectra.n_samples as f64;
    let x: Vec<f64> = (0..m)
        .map(|j| ((j as f64 - width) * step).tan() / (width * step).tan())
        .collect();
    let mut polynomials = Polynomials::default();
    polynomials.build(&x, 0.0, model.order);
    let peaks = spectra.input_peaks();
    let kernel = Kernel {
        spectra,
        model,
        x,
        polynomials,
        peaks,
    };
    let elements = kernel.spectra.n_outputs * kernel.spectra.n_inputs;
    Ok(LocalEstimate::over_lines(
        lines.len(),
        elements,
        freedom,
        || Scratch::new(&kernel),
        |i, scratch, line| kernel.line(lines[i], scratch, line),
    ))
}

/// Check the settings; returns the degrees of freedom of the residuals of one output.
fn check(
    spectra: &RecordSpectra,
    lines: &[usize],
    model: LocalModel,
) -> Result<usize, LocalModelError> {
    let LocalModel {
        order,
        denominator_order,
        half_width,
        band: (first, last),
    } = model;
    let top = || format!("at most {MAX_ORDER}");
    expect(order <= MAX_ORDER, "order", top, order)?;
    expect(
        denominator_order <= MAX_ORDER,
        "denominator_order",
        top,
        denominator_order,
    )?;
    let m = half_width.saturating_mul(2).saturating_add(1);
    let highest = spectra.last_line();
    let within = || format!("first and last line from 1 to {highest}");
    let right = 1 <= first && first <= last && last <= highest;
    expect(right, "band", within, format!("{first} and {last}"))?;
    let room = last - first + 1;
    let longest = || format!("a window 2 half_width + 1 of at most the {room} lines of the band");
    expect(
        half_width >= 1 && m <= room,
        "half_width",
        longest,
        half_width,
    )?;
    let unknowns = (order + 1) * (spectra.n_inputs + spectra.n_experiments) + denominator_order;
    let least = || {
        format!(
            "more than {unknowns} equations (lines of the window times experiments) for as many unknowns of the orders asked"
        )
    };
    let equations = m * spectra.n_experiments;
    // A transient belongs to one experiment, so the window of this experiment alone must determine
    // it.
    expect(
        equations > unknowns && m > order + 1,
        "half_width",
        least,
        equations,
    )?;
    let outside = lines.iter().find(|k| **k < first || **k > last);
    let range = || format!("lines from {first} to {last}");
    expect(
        outside.is_none(),
        "lines",
        range,
        outside.copied().unwrap_or_default(),
    )?;
    Ok(equations - unknowns)
}

struct Kernel {
    spectra: RecordSpectra,
    model: LocalModel,
    x: Vec<f64>,
    polynomials: Polynomials,
    peaks: Vec<f64>,
}

/// Scratch memory of one thread.
///
/// The columns are: the numerators (input by input); then for each output its denominator columns
/// and the output itself; then the weights.
struct Scratch {
    columns: Columns,
    norms: Vec<f64>,
    triangle: Triangle,
    /// Coefficients of the later columns along the numerators, `(column, numerator)`.
    parts: Vec<C>,
    /// Row of the inverse triangle for each input: `(input, numerator)`.
    rows: Vec<C>,
    leverage: Vec<f64>,
    output: OutputScratch,
}

/// Scratch memory for one output.
struct OutputScratch {
    triangle: Vec<C>,
    coefficients: Vec<C>,
    leverage: Vec<f64>,
    denominator: Vec<f64>,
    weights: Vec<f64>,
}

impl Scratch {
    fn new(kernel: &Kernel) -> Self {
        let (spectra, model) = (&kernel.spectra, &kernel.model);
        let rows = spectra.n_experiments * kernel.x.len();
        let numerators = kernel.numerators();
        let later = spectra.n_outputs * (model.denominator_order + 1);
        let d = model.denominator_order;
        Self {
            columns: Columns::new(rows, numerators + later + spectra.n_inputs),
            norms: vec![0.0; numerators + later],
            triangle: Triangle::new(numerators),
            parts: vec![C::default(); later * numerators],
            rows: vec![C::default(); spectra.n_inputs * numerators],
            leverage: vec![0.0; rows],
            output: OutputScratch {
                triangle: vec![C::default(); d * d],
                coefficients: vec![C::default(); d],
                leverage: vec![0.0; rows],
                denominator: vec![0.0; rows],
                weights: vec![0.0; 2 * rows],
            },
        }
    }
}

impl Kernel {
    fn numerators(&self) -> usize {
        self.spectra.n_inputs * (self.model.order + 1)
    }

    fn line(&self, line: usize, scratch: &mut Scratch, mut out: Line<'_>) {
        let band = self.model.band;
        let first = line
            .saturating_sub(self.model.half_width)
            .clamp(band.0, band.1 + 1 - self.x.len());
        let here = line - first;
        if self.silent_input(first) {
            return out.fail(LineFlag::NoExcitation);
        }
        self.fill(first, here, scratch);
        let Scratch {
            columns,
            norms,
            triangle,
            ..
        } = scratch;
        if !triangle.orthonormalise(columns, norms) {
            return out.fail(LineFlag::RankDeficient);
        }
        out.condition(triangle.condition(norms));
        self.prepare(here, scratch);
        for o in 0..self.spectra.n_outputs {
            self.output(o, here, scratch, &mut out);
        }
    }

    fn silent_input(&self, first: usize) -> bool {
        (0..self.spectra.n_inputs).any(|i| {
            let largest = (0..self.spectra.n_experiments)
                .flat_map(|e| &self.spectra.channel(e, i)[first - 1..first - 1 + self.x.len()])
                .map(|c| c.norm())
                .fold(0.0, f64::max);
            // Rounding of the DFT stays below this share of the largest line.
            largest <= 1e-12 * self.peaks[i]
        })
    }

    /// Fill all columns over the window, with transients removed.
    fn fill(&self, first: usize, here: usize, scratch: &mut Scratch) {
        let (spectra, m) = (&self.spectra, self.x.len());
        let (order, d) = (self.model.order, self.model.denominator_order);
        let columns = &mut scratch.columns;
        for e in 0..spectra.n_experiments {
            for i in 0..spectra.n_inputs {
                let u = &spectra.channel(e, i)[first - 1..first - 1 + m];
                for s in 0..=order {
                    let p = self.polynomials.over(s);
                    for j in 0..m {
                        columns.set(i * (order + 1) + s, e * m + j, u[j] * p[j]);
                    }
                }
            }
            for o in 0..spectra.n_outputs {
                let y = &spectra.channel(e, spectra.n_inputs + o)[first - 1..first - 1 + m];
                let start = self.later(o);
                for j in 0..m {
                    let x = self.x[j] - self.x[here];
                    let mut value = y[j];
                    columns.set(start + d, e * m + j, value);
                    for s in 0..d {
                        value *= x;
                        columns.set(start + s, e * m + j, -value);
                    }
                }
            }
        }
        for (c, norm) in scratch.norms.iter_mut().enumerate() {
            let column = columns.get_mut(c);
            *norm = energy(column).sqrt();
            for part in column.chunks_exact_mut(m) {
                self.polynomials.remove(part);
            }
        }
    }

    /// Index of the first column of an output.
    fn later(&self, output: usize) -> usize {
        self.numerators() + output * (self.model.denominator_order + 1)
    }

    /// Compute what all outputs share: coefficients along the numerators, weights and leverages.
    fn prepare(&self, here: usize, scratch: &mut Scratch) {
        let Scratch {
            columns,
            triangle,
            parts,
            rows,
            leverage,
            ..
        } = scratch;
        let (n, order, m) = (self.numerators(), self.model.order, self.x.len());
        for (c, parts) in parts.chunks_exact_mut(n).enumerate() {
            for (b, part) in parts.iter_mut().enumerate() {
                *part = columns.project(n + c, b);
            }
        }
        let weights = self.later(self.spectra.n_outputs);
        for (i, row) in rows.chunks_exact_mut(n).enumerate() {
            row.fill(C::default());
            for s in 0..=order {
                let value = self.polynomials.over(s)[here];
                let inverse = triangle.inverse_row(i * (order + 1) + s);
                row.iter_mut()
                    .zip(inverse)
                    .for_each(|(r, v)| *r += v * value);
            }
            columns.get_mut(weights + i).fill(0.0);
            for (c, r) in row.iter().enumerate() {
                columns.accumulate(weights + i, r.conj(), c);
            }
        }
        for (row, h) in leverage.iter_mut().enumerate() {
            *h = (0..=order)
                .map(|s| self.polynomials.over(s)[row % m].powi(2))
                .sum();
        }
        for c in 0..n {
            add_leverage(leverage, columns.get(c));
        }
    }

    /// Compute denominator, response and variance of one output.
    fn output(&self, o: usize, here: usize, scratch: &mut Scratch, out: &mut Line<'_>) {
        let (n, m, d) = (
            self.numerators(),
            self.x.len(),
            self.model.denominator_order,
        );
        let start = self.later(o);
        solve_denominator(
            &mut scratch.columns,
            &scratch.norms,
            start,
            &mut scratch.output,
        );
        let Scratch {
            columns,
            parts,
            rows,
            leverage,
            output,
            ..
        } = scratch;
        output.leverage.copy_from_slice(leverage);
        for s in 0..d {
            add_leverage(&mut output.leverage, columns.get(start + s));
        }
        for (row, squared) in output.denominator.iter_mut().enumerate() {
            let x = self.x[row % m] - self.x[here];
            // Horner's rule, from the highest coefficient down to D = 1 at the line.
            let higher = output.coefficients.iter().rev();
            let value = higher.fold(C::default(), |sum, a| (sum + a) * x);
            *squared = (value + 1.0).norm_sqr();
        }
        let residual = energy(columns.get(start + d));
        let freedom: f64 = output
            .denominator
            .iter()
            .zip(&output.leverage)
            .map(|(d, h)| d * (1.0 - h))
            .sum();
        let noise = residual / freedom;
        let later = |s: usize| &parts[(o * (d + 1) + s) * n..(o * (d + 1) + s + 1) * n];
        for i in 0..self.spectra.n_inputs {
            let row = &rows[i * n..(i + 1) * n];
            let along = |s: usize| -> C { row.iter().zip(later(s)).map(|(r, p)| r * p).sum() };
            let denominator: C = (0..d).map(|s| output.coefficients[s] * along(s)).sum();
            let element = o * self.spectra.n_inputs + i;
            out.response[element] = along(d) - denominator;
            output
                .weights
                .copy_from_slice(columns.get(self.later(self.spectra.n_outputs) + i));
            // The uncertainty of the denominator follows by forward substitution with its own
            // triangle.
            let mut through = [C::default(); MAX_ORDER];
            for s in 0..d {
                let diagonal = output.triangle[s * d + s].re;
                if diagonal > 0.0 {
                    let known: C = (0..s)
                        .map(|t| through[t] * output.triangle[t * d + s])
                        .sum();
                    through[s] = -(along(s) + known) / diagonal;
                    add(
                        &mut output.weights,
                        through[s].conj(),
                        columns.get(start + s),
                    );
                }
            }
            let (re, im) = output.weights.split_at(output.denominator.len());
            let amplified: f64 = re
                .iter()
                .zip(im)
                .zip(&output.denominator)
                .map(|((re, im), d)| (re * re + im * im) * d)
                .sum();
            let variance = noise * amplified;
            out.variance[element] = if variance.is_finite() {
                variance
            } else {
                f64::NAN
            };
        }
    }
}

fn add_leverage(leverage: &mut [f64], column: &[f64]) {
    let (re, im) = column.split_at(leverage.len());
    for ((h, re), im) in leverage.iter_mut().zip(re).zip(im) {
        *h += re * re + im * im;
    }
}

/// Coefficients of the denominator of the output whose columns begin at `start`.
///
/// On return the columns are orthonormal, and the last one holds the residual.
///
/// A denominator of too high an order shares factors with the numerators. Its column is then
/// dependent and is left out, which only lowers the order.
fn solve_denominator(
    columns: &mut Columns,
    norms: &[f64],
    start: usize,
    space: &mut OutputScratch,
) {
    let d = space.coefficients.len();
    for s in 0..d {
        for t in 0..s {
            space.triangle[t * d + s] = columns.project(start + s, start + t);
        }
        let norm = columns.normalise(start + s, DEPENDENT * norms[start + s]);
        space.triangle[s * d + s] = C::new(norm, 0.0);
    }
    for s in 0..d {
        space.coefficients[s] = columns.project(start + d, start + s);
    }
    for s in (0..d).rev() {
        let known: C = (s + 1..d)
            .map(|t| space.triangle[s * d + t] * space.coefficients[t])
            .sum();
        let diagonal = space.triangle[s * d + s].re;
        let rest = space.coefficients[s] - known;
        space.coefficients[s] = if diagonal > 0.0 {
            rest / diagonal
        } else {
            C::default()
        };
    }
}
