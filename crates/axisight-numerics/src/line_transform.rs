//! Transforms between a few spectral lines and real samples on a fine grid.
//!
//! A grid of `n` real samples is stored as `n / 2` complex numbers `x_{2m} + i x_{2m+1}`, so that
//! one complex transform of half the length serves each direction. Only the requested lines are
//! packed and unpacked. A line `k` with coefficient `d_k` is `Re(d_k exp(2 pi i k j / n))`.

use crate::plan::plan;
use rustfft::num_complex::Complex;
use rustfft::num_traits::Float;
use rustfft::{Fft, FftDirection, FftNum};
use std::sync::Arc;

/// A number type for grids. Its transforms are compiled in this crate only, not in every crate that
/// uses a grid.
pub trait GridNumber: FftNum + Float {
    /// Forward and inverse transform of `n` complex numbers.
    fn transforms(n: usize) -> (Arc<dyn Fft<Self>>, Arc<dyn Fft<Self>>);
}

macro_rules! grid_number {
    ($number:ty) => {
        impl GridNumber for $number {
            fn transforms(n: usize) -> (Arc<dyn Fft<Self>>, Arc<dyn Fft<Self>>) {
                (
                    plan(n, FftDirection::Forward),
                    plan(n, FftDirection::Inverse),
                )
            }
        }
    };
}
grid_number!(f32);
grid_number!(f64);

/// Transforms between lines and a real grid. They are cheap to clone and shared between threads.
#[derive(Clone)]
pub struct LineTransform<T> {
    forward: Arc<dyn Fft<T>>,
    inverse: Arc<dyn Fft<T>>,
    lines: Vec<usize>,
    /// `exp(2 pi i k / n)` of each line.
    twiddle: Vec<Complex<T>>,
}

/// One grid and the work space of its transforms.
#[derive(Debug, Clone)]
pub struct LineGrid<T> {
    /// Samples in pairs: `x_{2m} + i x_{2m+1}`.
    pub pairs: Vec<Complex<T>>,
    work: Vec<Complex<T>>,
}

impl<T: GridNumber> LineGrid<T> {
    /// Largest absolute sample.
    pub fn peak(&self) -> T {
        /// Independent maxima let the compiler use vector registers.
        const LANES: usize = 16;
        let larger = |a: T, b: T| if b > a { b } else { a };
        let mut lanes = [T::zero(); LANES];
        let mut chunks = self.pairs.chunks_exact(LANES);
        for chunk in &mut chunks {
            for (lane, v) in lanes.iter_mut().zip(chunk) {
                *lane = larger(*lane, larger(v.re.abs(), v.im.abs()));
            }
        }
        let rest = chunks.remainder().iter();
        let rest = rest.map(|v| larger(v.re.abs(), v.im.abs()));
        lanes.into_iter().chain(rest).fold(T::zero(), larger)
    }

    /// Set every sample to `f` of the sample of `other`.
    pub fn map_from(&mut self, other: &Self, f: impl Fn(T) -> T) {
        for (to, from) in self.pairs.iter_mut().zip(&other.pairs) {
            *to = Complex::new(f(from.re), f(from.im));
        }
    }
}

impl<T: GridNumber> LineTransform<T> {
    /// Transforms for `lines` on a grid of `half` pairs of samples. Every line must be below
    /// `half`.
    pub fn new(half: usize, lines: &[usize]) -> Self {
        let (forward, inverse) = T::transforms(half);
        let step = std::f64::consts::PI / half as f64;
        let cast = |x: f64| T::from_f64(x).unwrap_or_else(T::zero);
        let twiddle = lines.iter().map(|k| {
            let (sin, cos) = (step * *k as f64).sin_cos();
            Complex::new(cast(cos), cast(sin))
        });
        Self {
            forward,
            inverse,
            twiddle: twiddle.collect(),
            lines: lines.to_vec(),
        }
    }

    /// Lines, in the order of the coefficients.
    pub fn lines(&self) -> &[usize] {
        &self.lines
    }

    /// Number of samples of the grid.
    pub fn samples(&self) -> usize {
        2 * self.forward.len()
    }

    /// A grid of zeros.
    pub fn grid(&self) -> LineGrid<T> {
        let work = self
            .forward
            .get_inplace_scratch_len()
            .max(self.inverse.get_inplace_scratch_len());
        LineGrid {
            pairs: vec![Complex::new(T::zero(), T::zero()); self.forward.len()],
            work: vec![Complex::new(T::zero(), T::zero()); work],
        }
    }

    /// Fill `grid` with the sum of the lines.
    pub fn synthesize(&self, coefficient: &[Complex<T>], grid: &mut LineGrid<T>) {
        let half = self.forward.len();
        let zero = Complex::new(T::zero(), T::zero());
        grid.pairs.fill(zero);
        let point5 = T::one() / (T::one() + T::one());
        for ((k, w), d) in self.lines.iter().zip(&self.twiddle).zip(coefficient) {
            let even = d.scale(point5);
            let odd = even * w;
            // Even plus i odd samples, and the mirror line of both.
            let here = Complex::new(even.re - odd.im, even.im + odd.re);
            let mirror = Complex::new(even.re + odd.im, odd.re - even.im);
            grid.pairs[k % half] = grid.pairs[k % half] + here;
            let back = (half - k % half) % half;
            grid.pairs[back] = grid.pairs[back] + mirror;
        }
        self.inverse
            .process_with_scratch(&mut grid.pairs, &mut grid.work);
    }

    /// Coefficients of the lines in `grid`; overwrites the grid with its transform.
    ///
    /// This is the inverse of [`Self::synthesize`] on the span of the lines.
    pub fn analyze(&self, grid: &mut LineGrid<T>, coefficient: &mut [Complex<T>]) {
        let half = self.forward.len();
        self.forward
            .process_with_scratch(&mut grid.pairs, &mut grid.work);
        // X = E + conj(w) O, where E and O are the transforms of the even and odd samples; d = 2 X
        // / n.
        let scale = T::from_usize(self.samples()).map_or_else(T::zero, |n| T::one() / n);
        for ((k, w), d) in self.lines.iter().zip(&self.twiddle).zip(coefficient) {
            let here = grid.pairs[k % half];
            let mirror = grid.pairs[(half - k % half) % half].conj();
            let (even, difference) = (here + mirror, here - mirror);
            let odd = Complex::new(difference.im, -difference.re);
            *d = (even + w.conj() * odd).scale(scale);
        }
    }
}
