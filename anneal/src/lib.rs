//! Periodic packing of particles, with a certificate that none overlap.
