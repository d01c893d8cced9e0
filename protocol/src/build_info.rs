//! Version and commit of this build, for `--version` and status reports.

/// Crate version, `major.minor.patch`.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Short git commit of this build, `unknown` where it was built outside a checkout.
pub const COMMIT: &str = env!("VERGEN_GIT_SHA");

/// `version (commit)`, as every binary prints it.
pub const VERSION_AND_COMMIT: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("VERGEN_GIT_SHA"), ")");
