//! Who competes: every method as the talk has it, and truncated Newton's conjugate gradients under each preconditioner.

use pita_sim::{Method, Preconditioner, SolverSettings};

/// Most Newton iterations of an island: enough for all but the worst impacts.
const NEWTON_ITERATIONS: usize = 64;

/// A solver with a name.
pub struct Contender {
    /// For tables and plots.
    pub name: String,
    /// What it is.
    pub solver: SolverSettings,
}

/// All of them; `auto` is the first.
pub fn contenders() -> Vec<Contender> {
    let mut contenders = Vec::new();
    for (name, method) in Method::ALL {
        match method {
            Method::NonlinearConjugateGradient => {
                for preconditioner in [Preconditioner::None, Preconditioner::BlockJacobi] {
                    contenders.push(contender(format!("{name}, {preconditioner}"), method, preconditioner));
                }
            }
            Method::TruncatedNewton => {
                for (preconditioner, kind) in Preconditioner::ALL {
                    contenders.push(contender(format!("{name}, {preconditioner}"), method, kind));
                }
            }
            _ => contenders.push(contender(name.to_owned(), method, Preconditioner::default())),
        }
    }
    contenders
}

fn contender(name: String, method: Method, preconditioner: Preconditioner) -> Contender {
    let iterations = method.iterations().max(NEWTON_ITERATIONS);
    let solver = SolverSettings { method, preconditioner, iterations: Some(iterations), ..SolverSettings::default() };
    Contender { name, solver }
}
