//! The preconditioner that is in use.

use super::super::block::Entry;
use super::super::matrix::Matrix;
use super::super::solver::method::Preconditioner;
use super::ApproximateInverse;
use super::block_jacobi::BlockJacobi;
use super::incomplete_factorization::IncompleteFactorization;
use super::jacobi::Jacobi;
use super::ssor::Ssor;

/// All preconditioners, of which one is in use; the others are empty.
#[derive(Default)]
pub(crate) struct Selected<const D: usize> {
    kind: Preconditioner,
    identity: Identity,
    jacobi: Jacobi<D>,
    block_jacobi: BlockJacobi<D>,
    ssor: Ssor<D>,
    incomplete_factorization: IncompleteFactorization<D>,
}

/// No preconditioner.
#[derive(Default)]
struct Identity;

impl<const D: usize> ApproximateInverse<D> for Identity {
    fn prepare(&mut self, _a: &Matrix<D>) -> u64 {
        0
    }

    fn apply(&self, _a: &Matrix<D>, _x: &mut [Entry<D>]) {}

    fn apply_work(&self, _a: &Matrix<D>) -> u64 {
        0
    }
}

impl<const D: usize> Selected<D> {
    /// Puts `kind` into use; `relaxation` is for SSOR.
    pub fn select(&mut self, kind: Preconditioner, relaxation: f64) {
        self.kind = kind;
        self.ssor.relaxation = relaxation;
    }

    fn get(&self) -> &dyn ApproximateInverse<D> {
        match self.kind {
            Preconditioner::None => &self.identity,
            Preconditioner::Jacobi => &self.jacobi,
            Preconditioner::BlockJacobi => &self.block_jacobi,
            Preconditioner::Ssor => &self.ssor,
            Preconditioner::IncompleteFactorization => &self.incomplete_factorization,
        }
    }

    fn get_mut(&mut self) -> &mut dyn ApproximateInverse<D> {
        match self.kind {
            Preconditioner::None => &mut self.identity,
            Preconditioner::Jacobi => &mut self.jacobi,
            Preconditioner::BlockJacobi => &mut self.block_jacobi,
            Preconditioner::Ssor => &mut self.ssor,
            Preconditioner::IncompleteFactorization => &mut self.incomplete_factorization,
        }
    }
}

impl<const D: usize> ApproximateInverse<D> for Selected<D> {
    fn analyse(&mut self, a: &Matrix<D>) {
        self.get_mut().analyse(a);
    }

    fn prepare(&mut self, a: &Matrix<D>) -> u64 {
        self.get_mut().prepare(a)
    }

    fn apply(&self, a: &Matrix<D>, x: &mut [Entry<D>]) {
        self.get().apply(a, x);
    }

    fn apply_work(&self, a: &Matrix<D>) -> u64 {
        self.get().apply_work(a)
    }
}
