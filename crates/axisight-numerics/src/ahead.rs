//! Memory asked for before it is needed: a batch walks through more than a cache holds, in
//! steps that the processor's own prediction does not follow.

use nalgebra::Complex;

type C = Complex<f64>;

/// Bytes of a line of the cache.
const LINE: usize = 64;

/// Numbers in it.
const NUMBERS: usize = LINE / size_of::<C>();

/// The next pieces of what is read and of what is written.
pub(super) struct Ahead<'a> {
    from: &'a [C],
    to: &'a [C],
}

impl<'a> Ahead<'a> {
    pub(super) fn new(from: &'a [C], to: &'a [C]) -> Self {
        Self { from, to }
    }

    /// Nothing to ask for.
    pub(super) fn nothing() -> Self {
        Self { from: &[], to: &[] }
    }

    /// Ask for the next `lines` lines of both.
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
    // SAFETY: a hint, harmless at any address.
    #[allow(unsafe_code)]
    unsafe {
        _mm_prefetch::<_MM_HINT_T0>(line.as_ptr().cast());
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn fetch(_line: &[C]) {}
