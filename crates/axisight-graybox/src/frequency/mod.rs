//! The linearized robot fitted to frequency responses (thesis section 3.4.2).
