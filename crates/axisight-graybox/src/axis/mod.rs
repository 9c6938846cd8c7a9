//! One axis as a chain of masses, fitted by its prediction error (thesis chapter 9).
