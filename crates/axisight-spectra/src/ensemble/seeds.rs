//! Random numbers as a function of (seed, purpose, run).

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What random numbers are for; each purpose has a key of its own, so that
/// switching one source of randomness off leaves the others as they were.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Phases of the excitation.
    Phases = 1,
    /// Parameters that vary from run to run.
    Spread = 2,
}

/// The generator of one run; runs are streams of one `ChaCha8` key.
pub fn generator(seed: u64, purpose: Purpose, run: u64) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8] = purpose as u8;
    let mut rng = ChaCha8Rng::from_seed(key);
    rng.set_stream(run);
    rng
}
