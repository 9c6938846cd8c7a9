//! Quantiles of positive numbers from a logarithmic histogram of fixed relative accuracy.
//!
//! Bucket `i` holds `(g^(i-1), g^i]` with `g = (1 + a) / (1 - a)`, so its midpoint
//! `2 g^i / (g + 1)` is within a factor `1 ± a` of every value in it: Masson, Rim, Lee (2019),
//! `DDSketch`, PVLDB 12(12).
//!
//! Counts are integers, so merging is exactly associative and commutative. Buckets are sparse and
//! never collapsed. A magnitude range of 10^6 at 1 % accuracy fills at most 691 buckets.

use super::MergeError;

/// Bucket of exact zeros and of magnitudes below the smallest normal number.
const ZERO: i32 = i32::MIN;

/// Error: a sketch has an invalid field.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, got {got}")]
pub struct SketchError {
    /// Name of the field.
    pub field: &'static str,
    /// Expected value.
    pub expected: String,
    /// Actual value.
    pub got: String,
}

/// Histograms of `size` elements.
#[derive(Debug, Clone, PartialEq)]
pub struct QuantileSketch {
    accuracy: f64,
    /// For each element: pairs of bucket and count, in increasing order of buckets.
    buckets: Vec<Vec<(i32, u64)>>,
}

impl QuantileSketch {
    /// Empty histograms of relative accuracy `accuracy` (between 1e-5 and 0.5).
    ///
    /// # Errors
    /// [`SketchError`] if the accuracy is out of range.
    pub fn new(size: usize, accuracy: f64) -> Result<Self, SketchError> {
        if !(1e-5..=0.5).contains(&accuracy) {
            return Err(SketchError {
                field: "relative_accuracy",
                expected: "between 1e-5 and 0.5".to_owned(),
                got: accuracy.to_string(),
            });
        }
        Ok(Self {
            accuracy,
            buckets: vec![Vec::new(); size],
        })
    }

    /// Number of elements.
    pub fn size(&self) -> usize {
        self.buckets.len()
    }

    fn log_base(&self) -> f64 {
        ((1.0 + self.accuracy) / (1.0 - self.accuracy)).ln()
    }

    /// Add one magnitude, which must be finite and not negative.
    pub fn push(&mut self, element: usize, magnitude: f64) {
        let bucket = if magnitude < f64::MIN_POSITIVE {
            ZERO
        } else {
            // At most 708 / 2e-5 in size, far below the limit of i32.
            #[allow(clippy::cast_possible_truncation)]
            let index = (magnitude.ln() / self.log_base()).ceil() as i32;
            index
        };
        add(&mut self.buckets[element], bucket, 1);
    }

    /// Add the counts of `other`.
    ///
    /// # Errors
    /// [`MergeError`] if sizes or accuracies differ.
    pub fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        let describe = |s: &Self| format!("{} elements at accuracy {}", s.size(), s.accuracy);
        if self.size() != other.size() || self.accuracy.to_bits() != other.accuracy.to_bits() {
            return Err(MergeError {
                field: "quantiles",
                expected: describe(self),
                got: describe(other),
            });
        }
        for (mine, theirs) in self.buckets.iter_mut().zip(&other.buckets) {
            for (bucket, count) in theirs {
                add(mine, *bucket, *count);
            }
        }
        Ok(())
    }

    /// The `q`-quantile of an element, `0 <= q <= 1`, or NaN if the element is empty.
    ///
    /// The result has the relative accuracy of the sketch, compared with the sorted value at
    /// position `floor(q (n - 1))`.
    pub fn quantile(&self, element: usize, q: f64) -> f64 {
        let Some(buckets) = self.buckets.get(element).filter(|b| !b.is_empty()) else {
            return f64::NAN;
        };
        let total: u64 = buckets.iter().map(|(_, c)| c).sum();
        let rank = (q.clamp(0.0, 1.0) * (total - 1) as f64).floor();
        let mut seen = 0;
        let found = buckets.iter().find(|(_, c)| {
            seen += c;
            seen as f64 > rank
        });
        match found.or(buckets.last()) {
            Some((ZERO, _)) | None => 0.0,
            Some((bucket, _)) => {
                let base = self.log_base();
                2.0 * (base * f64::from(*bucket)).exp() / (base.exp() + 1.0)
            }
        }
    }

    /// Three flat arrays: the start of each element (`size + 1` entries), the buckets and the
    /// counts.
    pub fn to_parts(&self) -> (Vec<u64>, Vec<i32>, Vec<u64>) {
        let (mut starts, mut buckets, mut counts) = (vec![0], Vec::new(), Vec::new());
        for element in &self.buckets {
            buckets.extend(element.iter().map(|(b, _)| *b));
            counts.extend(element.iter().map(|(_, c)| *c));
            starts.push(buckets.len() as u64);
        }
        (starts, buckets, counts)
    }

    /// A sketch from the arrays of [`QuantileSketch::to_parts`].
    ///
    /// # Errors
    /// [`SketchError`] if the arrays do not fit together.
    pub fn from_parts(
        accuracy: f64,
        starts: &[u64],
        buckets: &[i32],
        counts: &[u64],
    ) -> Result<Self, SketchError> {
        let mut out = Self::new(starts.len().saturating_sub(1), accuracy)?;
        let wrong = |expected: &str, got: String| SketchError {
            field: "sketch",
            expected: expected.to_owned(),
            got,
        };
        if buckets.len() != counts.len() {
            let got = format!("{} and {}", buckets.len(), counts.len());
            return Err(wrong("as many counts as buckets", got));
        }
        for (element, range) in out.buckets.iter_mut().zip(starts.windows(2)) {
            let range = usize::try_from(range[0])
                .ok()
                .zip(usize::try_from(range[1]).ok());
            let part =
                range.and_then(|(from, to)| Some((buckets.get(from..to)?, &counts[from..to])));
            let Some((buckets, counts)) = part else {
                return Err(wrong("increasing starts", format!("{starts:?}")));
            };
            for (b, c) in buckets.iter().zip(counts) {
                add(element, *b, *c);
            }
        }
        Ok(out)
    }
}

fn add(buckets: &mut Vec<(i32, u64)>, bucket: i32, count: u64) {
    match buckets.binary_search_by_key(&bucket, |(b, _)| *b) {
        Ok(i) => buckets[i].1 += count,
        Err(i) => buckets.insert(i, (bucket, count)),
    }
}
