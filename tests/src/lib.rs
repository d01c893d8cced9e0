//! PITA's proof: end to end tests, yardstick runner, benchmarks, load test.
//!
//! Owns everything that looks at the other packages from outside. Nothing of PITA depends on it.

pub mod bench;
pub mod loadtest;
pub mod observer;
pub mod process;
pub mod relay;
pub mod server_process;
pub mod table;
pub mod yardstick;
