//! Random numbers as a function of (seed, purpose, run).

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Purpose of random numbers. Each purpose has its own key, so that disabling one source of
/// randomness does not change the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Phases of the excitation.
    Phases = 1,
    /// Parameters that vary from run to run.
    Spread = 2,
}

/// The generator of one run. Runs are streams of one `ChaCha8` key.
pub fn generator(seed: u64, purpose: Purpose, run: u64) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8] = purpose as u8;
    let mut rng = ChaCha8Rng::from_seed(key);
    rng.set_stream(run);
    rng
}
