//! The program `stereology`.
fn main() {}
