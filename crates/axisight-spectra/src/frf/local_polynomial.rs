//! Local polynomial method for periodic excitation; Pintelon and Schoukens (2012), sections 7.2 and
//! 7.3.
//!
//! The records hold several consecutive periods, so the lines between the harmonics contain only
//! transient and noise. A polynomial through these lines gives the transient at the harmonic, which
//! is subtracted from input and output. The residuals of the polynomial give the noise. The
//! response is then `Y U^-1` of that one line, or the pseudo-inverse if there are more experiments
//! than inputs. The response is not smoothed.
//!
//! For arbitrary excitation, response and transient are both polynomials over the window. That is
//! the local rational method with denominator one, see `local_rational`.

use super::flag::LineFlag;
use super::local_estimate::{Line, LocalEstimate, LocalModelError, expect};
use super::local_least_squares::{C, Columns, Polynomials, Triangle, energy};
use super::local_rational::MAX_ORDER;
use super::record_spectra::{RecordSpectra, Records};

/// Estimate the response at lines of the period from records of `n_periods` whole periods.
///
/// The window holds `half_width` lines between harmonics on each side.
///
/// # Errors
/// [`LocalModelError`] if there is a single period, the window is longer than the band or too short
/// for the order, there are fewer experiments than inputs, or a line is out of range.
pub fn local_polynomial_periodic(
    records: &Records<'_>,
    n_periods: usize,
    lines: &[usize],
    order: usize,
    half_width: usize,
) -> Result<LocalEstimate, LocalModelError> {
    let spectra = RecordSpectra::new(records);
    let points = half_width.saturating_mul(2);
    let top = || format!("at most {MAX_ORDER}");
    expect(order <= MAX_ORDER, "order", top, order)?;
    expect(
        n_periods > 1,
        "n_periods",
        || "at least 2".into(),
        n_periods,
    )?;
    let last = spectra.last_line();
    let between = last - last / n_periods;
    let room = || {
        format!(
            "2 half_width above order + 1 = {} and at most the {between} lines between harmonics",
            order + 1
        )
    };
    expect(
        points > order + 1 && points <= between,
        "half_width",
        room,
        half_width,
    )?;
    let enough = spectra.n_experiments >= spectra.n_inputs;
    let inputs = || format!("at least {} (one for each input)", spectra.n_inputs);
    expect(enough, "n_experiments", inputs, spectra.n_experiments)?;
    let highest = last / n_periods;
    let outside = lines.iter().find(|k| **k < 1 || **k > highest);
    let range = || format!("lines from 1 to {highest}");
    expect(
        outside.is_none(),
        "lines",
        range,
        outside.copied().unwrap_or_default(),
    )?;
    let freedom = spectra.n_experiments * (points - order - 1);
    let elements = spectra.n_outputs * spectra.n_inputs;
    let peaks = spectra.input_peaks();
    let kernel = Kernel {
        spectra,
        n_periods,
        order,
        points,
        peaks,
        freedom,
    };
    Ok(LocalEstimate::over_lines(
        lines.len(),
        elements,
        freedom,
        || Scratch::new(&kernel),
        |i, scratch, line| kernel.line(lines[i] * n_periods, scratch, line),
    ))
}

struct Kernel {
    spectra: RecordSpectra,
    n_periods: usize,
    order: usize,
    points: usize,
    peaks: Vec<f64>,
    freedom: usize,
}

/// Scratch memory of one thread.
struct Scratch {
    window: Vec<usize>,
    points: Vec<f64>,
    polynomials: Polynomials,
    /// Noise over the windows of all experiments: one column per channel, and one for combinations.
    noise: Columns,
    /// Channels at the harmonic without transient: one column per channel, one row per experiment.
    harmonic: Columns,
    norms: Vec<f64>,
    triangle: Triangle,
}

impl Scratch {
    fn new(kernel: &Kernel) -> Self {
        let spectra = &kernel.spectra;
        let channels = spectra.n_inputs + spectra.n_outputs;
        Self {
            window: Vec::with_capacity(kernel.points),
            points: Vec::with_capacity(kernel.points),
            polynomials: Polynomials::default(),
            noise: Columns::new(spectra.n_experiments * kernel.points, channels + 1),
            harmonic: Columns::new(spectra.n_experiments, channels),
            norms: vec![0.0; spectra.n_inputs],
            triangle: Triangle::new(spectra.n_inputs),
        }
    }
}

impl Kernel {
    fn line(&self, line: usize, scratch: &mut Scratch, mut out: Line<'_>) {
        self.window(line, scratch);
        self.remove_transients(line, scratch);
        let n = self.spectra.n_inputs;
        let Scratch {
            harmonic,
            norms,
            triangle,
            polynomials,
            noise,
            ..
        } = scratch;
        for (i, norm) in norms.iter_mut().enumerate() {
            *norm = energy(harmonic.get(i)).sqrt();
            if *norm <= 1e-12 * self.peaks[i] {
                return out.fail(LineFlag::NoExcitation);
            }
        }
        if !triangle.orthonormalise(harmonic, norms) {
            return out.fail(LineFlag::RankDeficient);
        }
        out.condition(triangle.condition(norms));
        // The interpolated transient adds noise of its own.
        let excess: f64 = (0..=self.order)
            .map(|s| polynomials.at_target(s).powi(2))
            .sum();
        let combined = n + self.spectra.n_outputs;
        for o in 0..self.spectra.n_outputs {
            let response = &mut out.response[o * n..(o + 1) * n];
            response.fill(C::default());
            for c in 0..n {
                let part = harmonic.project(n + o, c);
                for (i, g) in response.iter_mut().enumerate().take(c + 1) {
                    *g += triangle.inverse_row(i)[c] * part;
                }
            }
            // Subtract from the noise of the output what the noise of the inputs explains.
            noise.get_mut(combined).fill(0.0);
            noise.accumulate(combined, C::new(1.0, 0.0), n + o);
            for (i, g) in response.iter().enumerate() {
                noise.accumulate(combined, -g, i);
            }
            let power = energy(noise.get(combined)) / self.freedom as f64 * (1.0 + excess);
            for i in 0..n {
                let gain: f64 = triangle.inverse_row(i).iter().map(C::norm_sqr).sum();
                out.variance[o * n + i] = power * gain;
            }
        }
    }

    /// The nearest lines that are not harmonics, alternately below and above `line`.
    fn window(&self, line: usize, scratch: &mut Scratch) {
        let (mut below, mut above) = (line, line);
        scratch.window.clear();
        let last = self.spectra.last_line();
        while scratch.window.len() < self.points && (below > 1 || above < last) {
            if below > 1 {
                below -= 1;
                if !below.is_multiple_of(self.n_periods) {
                    scratch.window.push(below);
                }
            }
            if above < last && scratch.window.len() < self.points {
                above += 1;
                if !above.is_multiple_of(self.n_periods) {
                    scratch.window.push(above);
                }
            }
        }
        let step = std::f64::consts::PI / self.spectra.n_samples as f64;
        let place = |k: &usize| ((*k as f64 - line as f64) * step).tan();
        scratch.points.clear();
        scratch.points.extend(scratch.window.iter().map(place));
        let widest = scratch.points.iter().fold(0.0_f64, |w, x| w.max(x.abs()));
        scratch.points.iter_mut().for_each(|x| *x /= widest);
        scratch.polynomials.build(&scratch.points, 0.0, self.order);
    }

    /// Compute the harmonics without transient, and the noise around them.
    fn remove_transients(&self, line: usize, scratch: &mut Scratch) {
        let Scratch {
            window,
            polynomials,
            noise,
            harmonic,
            ..
        } = scratch;
        let points = self.points;
        for channel in 0..self.spectra.n_inputs + self.spectra.n_outputs {
            for e in 0..self.spectra.n_experiments {
                let spectrum = self.spectra.channel(e, channel);
                for (j, k) in window.iter().enumerate() {
                    noise.set(channel, e * points + j, spectrum[k - 1]);
                }
                let (re, im) = noise.halves(channel);
                let own = e * points..(e + 1) * points;
                let transient = C::new(
                    polynomials.remove(&mut re[own.clone()]),
                    polynomials.remove(&mut im[own]),
                );
                harmonic.set(channel, e, spectrum[line - 1] - transient);
            }
        }
    }
}
