//! Elementwise arithmetic on arrays in 256-bit registers.
//!
//! The compiler alone turns only some loops over lanes into vector instructions, and moves the
//! other lanes through memory.

/// One operation on `[f64; L]`: a packed instruction for each group of four, the plain operation
/// for the rest.
///
/// The groups are written out, because a loop over them takes several times as long to compile: the
/// compiler has to unroll it before the numbers can stay in registers.
macro_rules! operation {
    ($(#[$doc:meta])* $name:ident ( $($argument:ident),+ ), $packed:expr, $plain:expr) => {
        $(#[$doc])*
        #[inline(always)]
        pub(super) fn $name<const L: usize>($($argument: [f64; L]),+) -> [f64; L] {
            let mut out = [0.0; L];
            let mut first = 0;
            #[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
            {
                use std::arch::x86_64::{_mm256_loadu_pd, _mm256_storeu_pd};
                if L >= 4 {
                    // SAFETY: entries 0 to 3 lie inside arrays of `L` numbers, the unaligned
                    // instructions take any address, and the features are compiled in.
                    #[allow(unsafe_code)]
                    unsafe {
                        $(let $argument = _mm256_loadu_pd($argument.as_ptr());)+
                        _mm256_storeu_pd(out.as_mut_ptr(), ($packed)($($argument),+));
                    }
                    first = 4;
                }
                if L >= 8 {
                    // SAFETY: the same for entries 4 to 7.
                    #[allow(unsafe_code)]
                    unsafe {
                        $(let $argument = _mm256_loadu_pd($argument.as_ptr().add(4));)+
                        _mm256_storeu_pd(out.as_mut_ptr().add(4), ($packed)($($argument),+));
                    }
                    first = 8;
                }
            }
            while first < L {
                out[first] = ($plain)($($argument[first]),+);
                first += 1;
            }
            out
        }
    };
}

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m256d, _CMP_GT_OQ, _MM_FROUND_NO_EXC, _MM_FROUND_TO_NEAREST_INT, _MM_FROUND_TO_NEG_INF,
    _mm256_add_pd, _mm256_andnot_pd, _mm256_blendv_pd, _mm256_cmp_pd, _mm256_div_pd,
    _mm256_fmadd_pd, _mm256_fnmadd_pd, _mm256_max_pd, _mm256_mul_pd, _mm256_round_pd,
    _mm256_set1_pd, _mm256_setzero_pd, _mm256_sqrt_pd, _mm256_sub_pd, _mm256_xor_pd,
};

operation!(add(a, b), |a, b| _mm256_add_pd(a, b), |a, b| a + b);
operation!(sub(a, b), |a, b| _mm256_sub_pd(a, b), |a, b| a - b);
operation!(mul(a, b), |a, b| _mm256_mul_pd(a, b), |a, b| a * b);
operation!(div(a, b), |a, b| _mm256_div_pd(a, b), |a, b| a / b);
operation!(
    /// `a * b + c` with one rounding.
    fma(a, b, c),
    |a, b, c| _mm256_fmadd_pd(a, b, c),
    |a: f64, b, c| a.mul_add(b, c)
);
operation!(
    /// `c - a * b` with one rounding.
    fnma(a, b, c),
    |a, b, c| _mm256_fnmadd_pd(a, b, c),
    |a: f64, b, c| (-a).mul_add(b, c)
);
operation!(
    magnitude(a),
    |a| _mm256_andnot_pd(_mm256_set1_pd(-0.0), a),
    |a: f64| a.abs()
);
operation!(
    /// The larger of `a` and `b`; `b` where either is NaN.
    larger(a, b),
    |a, b| _mm256_max_pd(a, b),
    |a: f64, b: f64| if a > b { a } else { b }
);
operation!(
    neg(a),
    |a| _mm256_xor_pd(a, _mm256_set1_pd(-0.0)),
    |a: f64| -a
);
operation!(sqrt(a), |a| _mm256_sqrt_pd(a), |a: f64| a.sqrt());
operation!(
    /// The nearest whole number, ties to even.
    round(a),
    |a| _mm256_round_pd::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(a),
    |a: f64| a.round_ties_even()
);
operation!(
    floor(a),
    |a| _mm256_round_pd::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(a),
    |a: f64| a.floor()
);
operation!(
    /// `a` where `x > 0`, `b` elsewhere, also where `x` is NaN.
    if_positive(x, a, b),
    |x, a, b| {
        let positive: __m256d = _mm256_cmp_pd::<_CMP_GT_OQ>(x, _mm256_setzero_pd());
        _mm256_blendv_pd(b, a, positive)
    },
    |x: f64, a, b| if x > 0.0 { a } else { b }
);
