//! The program as people call it.

#![allow(clippy::unwrap_used)] // a test that fails to set itself up should stop there

mod contract;
