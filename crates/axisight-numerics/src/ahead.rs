//! Prefetching of memory for batches that are larger than the cache.
//!
//! The processor does not predict the steps in which such a batch is read.

use nalgebra::Complex;

type C = Complex<f64>;

/// Bytes of a cache line.
const LINE: usize = 64;

/// Complex numbers in a cache line.
const NUMBERS: usize = LINE / size_of::<C>();

/// The next parts of the input and of the output.
pub(super) struct Ahead<'a> {
    from: &'a [C],
    to: &'a [C],
}

impl<'a> Ahead<'a> {
    pub(super) fn new(from: &'a [C], to: &'a [C]) -> Self {
        Self { from, to }
    }

    /// Prefetch nothing.
    pub(super) fn nothing() -> Self {
        Self { from: &[], to: &[] }
    }

    /// Prefetch the next `lines` cache lines of input and output.
    #[inline(always)]
    pub(super) fn ask(&mut self, lines: usize) {
        for list in [&mut self.from, &mut self.to] {
            let (now, later) = list.split_at((lines * NUMBERS).min(list.len()));
            for line in now.chunks(NUMBERS) {
                fetch(line);
            }
            *list = later;
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn fetch(line: &[C]) {
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
    // SAFETY: a prefetch is a hint and harmless at any address.
    #[allow(unsafe_code)]
    unsafe {
        _mm_prefetch::<_MM_HINT_T0>(line.as_ptr().cast());
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn fetch(_line: &[C]) {}
