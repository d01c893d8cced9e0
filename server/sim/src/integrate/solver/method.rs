//! The names of methods and preconditioners, as configuration and command lines have them.

use std::fmt;
use std::str::FromStr;

use crate::error::SimError;

/// How an island's residual is made zero. The talk's, slide by slide.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The cheapest for the island, by its size and couplings: [`Method::Newton`] where the exact factorisation is no
    /// dearer than conjugate gradients, else [`Method::TruncatedNewton`] with incomplete factorisation.
    #[default]
    Auto,
    /// "Divide and conquer": every body on its own, the others where they were.
    Jacobi,
    /// One body after another, each hears of those before it.
    GaussSeidel,
    /// Gauss-Seidel with steps that are stretched by `relaxation`.
    Sor,
    /// Along the residual, over the mass.
    SteepestDescent,
    /// Polak-Ribière+ with restarts, with `preconditioner`. Cel Damage's on the Xbox.
    NonlinearConjugateGradient,
    /// Direct: an exact sparse factorisation of the Hessian.
    Newton,
    /// Newton with a Hessian from finite differences of the residual.
    DiscreteNewton,
    /// L-BFGS: the inverse Hessian is built from the last steps.
    QuasiNewton,
    /// Newton with capped conjugate gradients and `preconditioner`. Cel Damage's on the GameCube.
    TruncatedNewton,
    /// The same with a procedural Hessian: products by automatic differentiation.
    CelDamage,
}

/// What conjugate gradients are preconditioned with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preconditioner {
    /// Nothing; in the non-linear method the mass.
    None,
    /// The diagonal.
    Jacobi,
    /// The diagonal blocks.
    BlockJacobi,
    /// A sweep of SOR forwards and one backwards, with `relaxation`.
    Ssor,
    /// Incomplete Cholesky factorisation without fill, IC(0).
    #[default]
    IncompleteFactorization,
}

impl Method {
    /// Every method, with its name.
    pub const ALL: [(&'static str, Self); 11] = [
        ("auto", Self::Auto),
        ("jacobi", Self::Jacobi),
        ("gauss_seidel", Self::GaussSeidel),
        ("sor", Self::Sor),
        ("steepest_descent", Self::SteepestDescent),
        ("nonlinear_conjugate_gradient", Self::NonlinearConjugateGradient),
        ("newton", Self::Newton),
        ("discrete_newton", Self::DiscreteNewton),
        ("quasi_newton", Self::QuasiNewton),
        ("truncated_newton", Self::TruncatedNewton),
        ("cel_damage", Self::CelDamage),
    ];

    /// Iterations after which the method gives up, where the settings do not say. Below 8, impacts leave joints open by
    /// centimetres with Newton's; the others take hundreds of cheaper ones.
    pub fn iterations(self) -> usize {
        match self {
            Self::Auto | Self::Newton | Self::DiscreteNewton | Self::TruncatedNewton | Self::CelDamage => 16,
            _ => 1000,
        }
    }
}

impl Preconditioner {
    /// Every preconditioner, with its name.
    pub const ALL: [(&'static str, Self); 5] = [
        ("none", Self::None),
        ("jacobi", Self::Jacobi),
        ("block_jacobi", Self::BlockJacobi),
        ("ssor", Self::Ssor),
        ("incomplete_factorization", Self::IncompleteFactorization),
    ];
}

/// The value of a name.
fn find<T: Copy>(all: &[(&'static str, T)], what: &'static str, name: &str) -> Result<T, SimError> {
    let found = all.iter().find(|(known, _)| *known == name);
    found.map(|&(_, value)| value).ok_or_else(|| {
        let known: Vec<_> = all.iter().map(|&(known, _)| known).collect();
        SimError::UnknownName { what, name: name.chars().take(64).collect(), known: known.join(", ") }
    })
}

/// The name of a value.
fn name<T: PartialEq>(all: &[(&'static str, T)], value: &T) -> &'static str {
    all.iter().find(|(_, known)| known == value).map_or("", |&(name, _)| name)
}

impl FromStr for Method {
    type Err = SimError;

    fn from_str(text: &str) -> Result<Self, SimError> {
        find(&Self::ALL, "method", text)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(name(&Self::ALL, self))
    }
}

impl FromStr for Preconditioner {
    type Err = SimError;

    fn from_str(text: &str) -> Result<Self, SimError> {
        find(&Self::ALL, "preconditioner", text)
    }
}

impl fmt::Display for Preconditioner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(name(&Self::ALL, self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_there_and_back() {
        for (name, method) in Method::ALL {
            assert_eq!((name.parse(), method.to_string()), (Ok(method), name.to_owned()));
        }
        for (name, preconditioner) in Preconditioner::ALL {
            assert_eq!((name.parse(), preconditioner.to_string()), (Ok(preconditioner), name.to_owned()));
        }
    }

    #[test]
    fn unknown_names_are_told_what_there_is() {
        let error = "newtn".parse::<Method>().unwrap_err().to_string();
        assert!(error.starts_with("method \"newtn\" is unknown, known are auto, jacobi,"), "{error}");
        let error = "ic0".parse::<Preconditioner>().unwrap_err().to_string();
        assert!(error.starts_with("preconditioner \"ic0\" is unknown, known are none, jacobi,"), "{error}");
    }
}
