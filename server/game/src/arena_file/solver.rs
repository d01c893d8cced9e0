//! The `[solver]` table: how the engine integrates this arena. What is left out is as the engine has it; the engine
//! checks the ranges.

use std::str::FromStr;

use pita_sim::{Method, Preconditioner, SimError, SolverSettings};
use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// The table.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolverFile {
    /// How residuals are made zero.
    #[serde(deserialize_with = "named")]
    pub method: Option<Method>,
    /// Of conjugate gradients.
    #[serde(deserialize_with = "named")]
    pub preconditioner: Option<Preconditioner>,
    /// Most that a body's acceleration may be wrong, m/s².
    pub tolerance: Option<f64>,
    /// Most iterations of an island.
    pub iterations: Option<usize>,
    /// Work that a tick may take, block operations.
    pub budget: Option<u64>,
    /// Residual that the linear solver leaves, as a fraction.
    pub forcing: Option<f64>,
    /// Of SOR and SSOR.
    pub relaxation: Option<f64>,
    /// Of an iteration of Gauss-Seidel and SOR.
    pub sweeps: Option<usize>,
}

impl SolverFile {
    /// The engine's settings with what the table says.
    pub fn settings(&self) -> SolverSettings {
        let default = SolverSettings::default();
        SolverSettings {
            method: self.method.unwrap_or(default.method),
            preconditioner: self.preconditioner.unwrap_or(default.preconditioner),
            tolerance: self.tolerance.unwrap_or(default.tolerance),
            iterations: self.iterations.or(default.iterations),
            budget: self.budget.or(default.budget),
            forcing: self.forcing.unwrap_or(default.forcing),
            relaxation: self.relaxation.unwrap_or(default.relaxation),
            sweeps: self.sweeps.unwrap_or(default.sweeps),
            ..default
        }
    }
}

/// Reads one of the engine's names.
fn named<'de, D: Deserializer<'de>, T: FromStr<Err = SimError>>(deserializer: D) -> Result<Option<T>, D::Error> {
    let name = String::deserialize(deserializer)?;
    name.parse().map(Some).map_err(D::Error::custom)
}
