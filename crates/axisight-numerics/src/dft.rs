//! Discrete Fourier transform of periodic records; sign and scale are defined here only.
//!
//! `X_k = 1/sqrt(N) sum_{n=0}^{N-1} x_n exp(-2 pi i k n / N)`, with line `k` at the frequency
//! `k / (N T)`. See Ljung (1999), section 2.2. Wernholt (2004), (3.16), counts samples from one,
//! which adds a common phase that cancels in every response.

use crate::plan::plan;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};
use std::sync::Arc;

/// Plans for records of one length. They are cheap to clone and shared between threads.
#[derive(Clone)]
pub struct Dft {
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
}

/// Work space of one thread.
#[derive(Debug, Clone, Default)]
pub struct DftScratch {
    data: Vec<Complex<f64>>,
    work: Vec<Complex<f64>>,
}

impl std::fmt::Debug for Dft {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Dft({})", self.len())
    }
}

impl Dft {
    /// A plan for records of `n` samples.
    pub fn new(n: usize) -> Self {
        Self {
            forward: plan(n, FftDirection::Forward),
            inverse: plan(n, FftDirection::Inverse),
        }
    }

    /// Samples per record.
    pub fn len(&self) -> usize {
        self.forward.len()
    }

    /// Whether the record length is zero.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Lines `1 <= k <= N/2` of two real records at once, with `(a_n, b_n)` as sample `n`.
    ///
    /// One complex transform of `a + i b` serves both records; symmetry separates them.
    pub fn pair(
        &self,
        samples: impl Iterator<Item = (f64, f64)>,
        lines: &[usize],
        scratch: &mut DftScratch,
        mut out: impl FnMut(usize, Complex<f64>, Complex<f64>),
    ) {
        let n = self.len();
        let DftScratch { data, work } = scratch;
        data.clear();
        data.extend(samples.take(n).map(|(a, b)| Complex::new(a, b)));
        data.resize(n, Complex::default());
        work.resize(self.forward.get_inplace_scratch_len(), Complex::default());
        self.forward.process_with_scratch(data, work);
        let half = 0.5 / (n as f64).sqrt();
        for (i, k) in lines.iter().enumerate() {
            let (here, mirror) = (data[k % n], data[(n - k % n) % n].conj());
            let (sum, difference) = (here + mirror, here - mirror);
            let b = Complex::new(difference.im, -difference.re);
            out(i, sum * half, b * half);
        }
    }

    /// The record `x_n = sum_k amplitude_k sin(2 pi k n / N + phase_k)`.
    pub fn sum_of_sines(&self, lines: &[usize], amplitude: &[f64], phase: &[f64]) -> Vec<f64> {
        let n = self.len();
        let mut data = vec![Complex::default(); n];
        for ((k, a), p) in lines.iter().zip(amplitude).zip(phase) {
            data[k % n] += Complex::from_polar(*a, *p);
        }
        self.inverse.process(&mut data);
        data.iter().map(|c| c.im).collect()
    }
}
