//! Solvers: how an island's residual is made zero. One file a method, named as in the talk.
//!
//! Every method is a [`Solver`]: it says where to go. `descent` does what they share: the starting guess (`guess`), the
//! line search, the stop, the best state so far, and the [`SolveReport`]; it counts `work`. The settings choose the
//! `method`; `auto` chooses by itself. Nothing here knows a potential or a DOF kind.

mod auto;
mod block_descent;
mod cel_damage;
mod descent;
mod discrete_newton;
mod gauss_seidel;
mod guess;
mod jacobi;
pub(super) mod method;
mod newton;
mod nonlinear_conjugate_gradient;
mod quasi_newton;
mod sor;
mod steepest_descent;
mod step_length;
#[cfg(test)]
mod tests;
mod truncated_newton;
mod watchdog;
pub(super) mod work;

use self::descent::Descent;
use self::method::Method;
use self::work::Work;
use super::StepReport;
use super::block::Entry;
use super::line_search::Walk;
use super::matrix::Matrix;
use super::problem::Problem;
use crate::settings::SolverSettings;

/// A method: from where it stands, where to go.
pub(super) trait Solver<const D: usize> {
    /// Writes a direction of descent, a change of the unknowns, to `step`. Answers the iterations of a linear solver
    /// that this took. The first call of a solve has [`Standpoint::iteration`] 0: nothing holds from before.
    fn direction(&mut self, at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize;

    /// Makes of the direction that it gave last one that knows how friction changes with the load; that is no direction
    /// of descent. Answers the iterations that this took, 0 if it did nothing.
    fn follow_friction(&mut self, _problem: &Problem, _work: &mut Work, _step: &mut [Entry<D>]) -> usize {
        0
    }

    /// Hears how far the line search went, in steps, and of the residual there, before anything is taken anew.
    fn walked(&mut self, _alpha: f64, _step: &[Entry<D>], _residual: &[Entry<D>]) {}

    /// Whether block descent comes first where things hit one another.
    fn starts_by_blocks(&self) -> bool {
        false
    }

    /// How the line search walks.
    fn walk(&self) -> Walk {
        Walk::NEWTON
    }
}

/// Where a method stands when it is asked for a direction.
pub(super) struct Standpoint<'a, const D: usize> {
    /// Its trial is at `u`, and what is frozen during an iteration is taken from there.
    pub problem: &'a mut Problem,
    /// The unknowns.
    pub u: &'a [Entry<D>],
    /// The residual at `u`.
    pub residual: &'a [Entry<D>],
    /// For the Hessian, where the method wants it.
    pub matrix: &'a mut Matrix<D>,
    pub settings: &'a SolverSettings,
    pub work: &'a mut Work,
    /// Directions that were asked for before in this solve.
    pub iteration: usize,
}

impl<const D: usize> Standpoint<'_, D> {
    /// Assembles the Hessian in `matrix`; finds its pattern first where this is a solve's first iteration.
    pub fn assemble(&mut self) {
        if self.iteration == 0 {
            self.matrix.analyse(self.problem);
        }
        self.matrix.assemble(self.problem);
        self.work.assembled();
    }

    /// Assembles again, a matrix that is definite, after the first turned out not to be. Answers whether there is
    /// another one; it stays definite for the rest of the solve.
    pub fn assemble_definite(&mut self) -> bool {
        let changes = self.problem.require_definite();
        if changes {
            self.matrix.assemble(self.problem);
            self.work.assembled();
        }
        changes
    }
}

/// Why a solver stopped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StoppedBecause {
    /// The residual of every body is within the tolerance.
    #[default]
    Tolerance,
    /// The limit of iterations was reached.
    IterationLimit,
    /// The work that it was given was used up.
    Budget,
    /// Steps change nothing any more, or there is no direction of descent.
    Stagnation,
    /// The residual overflowed.
    NonFinite,
}

/// What solving an island took, and where it ended: unless it stopped because of the tolerance, at the best state that it
/// saw, which is the one with the least merit, or with the least residual among those about as good.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SolveReport {
    pub iterations: usize,
    /// Iterations of a linear solver.
    pub linear_iterations: usize,
    /// Evaluations of the residual.
    pub evaluations: usize,
    /// Block operations, see [`work`].
    pub work: u64,
    /// Largest residual of a body at the end, as the speed that it misses, m/s.
    pub residual: f64,
    /// What is made small: the incremental potential at the end, with friction limited as at the end, J. The norm of the
    /// residual would not do: it is stiffness times what is missing, and rises along the curved valleys of joints, at
    /// whose bottom the solution is.
    pub merit: f64,
    pub stopped_because: StoppedBecause,
}

impl SolveReport {
    /// Counts in what another solve took.
    pub fn add_effort(&mut self, other: &Self) {
        self.iterations += other.iterations;
        self.linear_iterations += other.linear_iterations;
        self.evaluations += other.evaluations;
        self.work += other.work;
    }

    /// Counts what it took in.
    pub fn add_to(&self, report: &mut StepReport) {
        report.iterations += self.iterations;
        report.linear_iterations += self.linear_iterations;
        report.evaluations += self.evaluations;
        report.work += self.work;
    }
}

/// All methods with their memory; those that are not in use are empty. D is 3 where no body of the island rotates, else 6.
#[derive(Default)]
pub(crate) struct Solvers<const D: usize> {
    descent: Descent<D>,
    auto: auto::Auto<D>,
    jacobi: jacobi::Jacobi<D>,
    gauss_seidel: gauss_seidel::GaussSeidel<D>,
    sor: sor::Sor<D>,
    steepest_descent: steepest_descent::SteepestDescent<D>,
    nonlinear_conjugate_gradient: nonlinear_conjugate_gradient::NonlinearConjugateGradient<D>,
    newton: newton::Newton<D>,
    discrete_newton: discrete_newton::DiscreteNewton<D>,
    quasi_newton: quasi_newton::QuasiNewton<D>,
    truncated_newton: truncated_newton::TruncatedNewton<D>,
    cel_damage: cel_damage::CelDamage<D>,
}

impl<const D: usize> Solvers<D> {
    /// Moves `problem`'s trial to the end of the tick, within `budget` block operations.
    pub fn solve(&mut self, problem: &mut Problem, settings: &SolverSettings, budget: Option<u64>) -> SolveReport {
        let (method, descent) = self.parts(settings.method);
        descent.solve(method, problem, settings, budget)
    }

    /// A method, and what drives it.
    fn parts(&mut self, method: Method) -> (&mut dyn Solver<D>, &mut Descent<D>) {
        let method: &mut dyn Solver<D> = match method {
            Method::Auto => &mut self.auto,
            Method::Jacobi => &mut self.jacobi,
            Method::GaussSeidel => &mut self.gauss_seidel,
            Method::Sor => &mut self.sor,
            Method::SteepestDescent => &mut self.steepest_descent,
            Method::NonlinearConjugateGradient => &mut self.nonlinear_conjugate_gradient,
            Method::Newton => &mut self.newton,
            Method::DiscreteNewton => &mut self.discrete_newton,
            Method::QuasiNewton => &mut self.quasi_newton,
            Method::TruncatedNewton => &mut self.truncated_newton,
            Method::CelDamage => &mut self.cel_damage,
        };
        (method, &mut self.descent)
    }
}
