//! Discrete Newton (talk, "Discrete Newton": "finite differences to approximate the Hessian", for those who cannot
//! build it).
//!
//! Exactly: forward differences of the residual in the pattern of the Hessian. Bodies that share no neighbour are moved
//! together (Curtis, Powell and Reid, 1974), so that an evaluation serves a column of each; what comes twice, once from
//! either side of the diagonal, is averaged. Differences know nothing of positive parts: where the factorisation finds
//! the matrix indefinite, the diagonal is made heavier, as Marquardt did. The Newton system is then solved as by
//! [`newton`](super::newton).

use super::super::block::{Block, Entry, zero};
use super::super::matrix::Matrix;
use super::super::problem::Problem;
use super::newton::Newton;
use super::work::Work;
use super::{Solver, Standpoint};

/// By how much an unknown is moved, m/s and rad/s: a displacement of 3e-8 m in a tick, small against the millimetre over
/// which contacts change, and large against the rounding of positions.
const DIFFERENCE: f64 = 1e-6;

/// By which fraction the diagonal is made heavier at first where the matrix is indefinite; ten times more at each further
/// try.
const LEAST_DAMPING: f64 = 1e-3;

/// The last try. Beyond it steps become too short to lead anywhere; pivots that are indefinite still are replaced.
const MOST_DAMPING: f64 = 0.1;

/// The method's memory.
#[derive(Default)]
pub(super) struct DiscreteNewton<const D: usize> {
    colours: Colouring,
    moved: Vec<Entry<D>>,
    changed: Vec<Entry<D>>,
    newton: Newton<D>,
}

/// A colour for each body, such that bodies of one colour neither are neighbours nor have one in common.
#[derive(Default)]
struct Colouring {
    /// `neighbours[starts[i]..starts[i + 1]]`: of body i, with the place of their block below the diagonal.
    starts: Vec<u32>,
    neighbours: Vec<(u32, u32)>,
    colour: Vec<u32>,
    /// The last body that must not have a colour.
    forbidden_for: Vec<u32>,
    colours: u32,
}

/// Neither a body nor a colour.
const NONE: u32 = u32::MAX;

impl Colouring {
    /// Greedy, in elimination order.
    fn find<const D: usize>(&mut self, a: &Matrix<D>) {
        self.list_neighbours(a);
        let n = a.diagonal.len();
        self.colour.clear();
        self.colour.resize(n, NONE);
        self.forbidden_for.clear();
        self.forbidden_for.resize(n, NONE);
        self.colours = 0;
        for i in 0..n {
            for &(j, _) in &self.neighbours[span(&self.starts, i)] {
                forbid(&mut self.forbidden_for, self.colour[j as usize], i);
                for &(k, _) in &self.neighbours[span(&self.starts, j as usize)] {
                    forbid(&mut self.forbidden_for, self.colour[k as usize], i);
                }
            }
            let free = self.forbidden_for.iter().position(|&body| body != i as u32);
            self.colour[i] = free.map_or(NONE, |colour| colour as u32);
            self.colours = self.colours.max(self.colour[i] + 1);
        }
    }

    fn list_neighbours<const D: usize>(&mut self, a: &Matrix<D>) {
        let n = a.diagonal.len();
        self.starts.clear();
        self.starts.resize(n + 1, 0);
        for i in 0..n {
            for k in a.row(i) {
                self.starts[i + 1] += 1;
                self.starts[a.columns[k] as usize + 1] += 1;
            }
        }
        for i in 0..n {
            self.starts[i + 1] += self.starts[i];
        }
        self.neighbours.clear();
        self.neighbours.resize(2 * a.columns.len(), (NONE, NONE));
        // The next free place of each body's share; the colours' memory serves until they are found.
        let next = &mut self.colour;
        next.clear();
        next.extend_from_slice(&self.starts[..n]);
        for i in 0..n {
            for k in a.row(i) {
                let j = a.columns[k] as usize;
                for (from, to) in [(i, j), (j, i)] {
                    self.neighbours[next[from] as usize] = (to as u32, k as u32);
                    next[from] += 1;
                }
            }
        }
    }
}

fn span(starts: &[u32], i: usize) -> std::ops::Range<usize> {
    starts[i] as usize..starts[i + 1] as usize
}

fn forbid(forbidden_for: &mut [u32], colour: u32, body: usize) {
    if let Some(last) = forbidden_for.get_mut(colour as usize) {
        *last = body as u32;
    }
}

impl<const D: usize> DiscreteNewton<D> {
    /// Fills `a` by differences of the residual about `u`, where it is `residual`. Leaves the trial at `u`.
    fn difference(
        &mut self,
        problem: &mut Problem,
        u: &[Entry<D>],
        residual: &[Entry<D>],
        work: &mut Work,
        a: &mut Matrix<D>,
    ) {
        a.diagonal.fill(zero());
        a.lower.fill(zero());
        for colour in 0..self.colours.colours {
            for axis in 0..D {
                self.moved.clear();
                self.moved.extend_from_slice(u);
                for (entry, _) in self.moved.iter_mut().zip(&self.colours.colour).filter(|(_, c)| **c == colour) {
                    entry[axis] += DIFFERENCE;
                }
                problem.move_to(&self.moved);
                problem.evaluate(&mut self.changed);
                work.moved_and_evaluated();
                work.vectors(3);
                for i in (0..u.len()).filter(|&i| self.colours.colour[i] == colour) {
                    self.add_column(i, axis, self.moved[i][axis] - u[i][axis], residual, a);
                }
            }
        }
        problem.move_to(u);
        work.moved();
    }

    /// Adds the column of body i's unknown `axis`, which was moved by `h`: half of it, as the other half comes from the
    /// rows.
    fn add_column(&self, i: usize, axis: usize, h: f64, residual: &[Entry<D>], a: &mut Matrix<D>) {
        let derivative = |j: usize, row: usize| (self.changed[j][row] - residual[j][row]) / (2.0 * h);
        for row in 0..D {
            a.diagonal[i][row][axis] += derivative(i, row);
            a.diagonal[i][axis][row] += derivative(i, row);
        }
        for &(j, place) in &self.colours.neighbours[span(&self.colours.starts, i)] {
            let block: &mut Block<D> = &mut a.lower[place as usize];
            for row in 0..D {
                let (p, q) = if j as usize > i { (row, axis) } else { (axis, row) };
                block[p][q] += derivative(j as usize, row);
            }
        }
    }
}

impl<const D: usize> Solver<D> for DiscreteNewton<D> {
    fn direction(&mut self, at: Standpoint<D>, step: &mut Vec<Entry<D>>) -> usize {
        if at.iteration == 0 {
            at.matrix.analyse(at.problem);
            self.colours.find(at.matrix);
            self.newton.analyse(at.matrix);
        }
        self.difference(at.problem, at.u, at.residual, at.work, at.matrix);
        let mut damping = LEAST_DAMPING;
        while self.newton.factorise(at.matrix, at.work) > 0 && damping <= MOST_DAMPING {
            for block in &mut at.matrix.diagonal {
                (0..D).for_each(|i| block[i][i] += damping * block[i][i].abs());
            }
            damping *= 10.0;
        }
        self.newton.solve(at.residual, at.work, step);
        1
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::super::matrix::tests::{matrix, pattern};
    use super::super::super::problem::Guess;
    use super::super::tests::net;
    use super::*;

    /// Stretched springs have the Hessian that is assembled, so their differences must come to it.
    #[test]
    fn differences_come_to_the_assembled_hessian() {
        let (mut problem, mut u, mut residual) = (net(3e3), Vec::new(), Vec::new());
        problem.guess::<3>(Guess::Before, &mut u);
        problem.move_to(&u);
        problem.evaluate(&mut residual);
        let (mut assembled, mut differenced) = (Matrix::<3>::default(), Matrix::<3>::default());
        for matrix in [&mut assembled, &mut differenced] {
            matrix.analyse(&mut problem);
            matrix.assemble(&mut problem);
        }
        let mut method = DiscreteNewton::default();
        method.colours.find(&differenced);
        let mut work = Work::unlimited();
        method.difference(&mut problem, &u, &residual, &mut work, &mut differenced);
        assert_eq!(work.evaluations(), 3 * method.colours.colours as usize);
        assert!(method.colours.colours < problem.len() as u32, "nothing was moved together");
        let size = assembled.diagonal.as_flattened().as_flattened().iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let blocks = |m: &Matrix<3>| [m.diagonal.clone(), m.lower.clone()].concat();
        for (a, d) in blocks(&assembled)
            .as_flattened()
            .as_flattened()
            .iter()
            .zip(blocks(&differenced).as_flattened().as_flattened())
        {
            assert!((a - d).abs() < 1e-5 * size, "{a} {d} of {size}");
        }
        let mut product = Vec::new();
        problem.hessian_product(&u, &mut product);
        let mut expected = vec![[0.0; 3]; u.len()];
        assembled.multiply(&u, &mut expected);
        for (p, e) in product.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((p - e).abs() < 1e-9 * size, "{p} {e} of {size}");
        }
    }

    proptest! {
        /// Neither neighbours nor those with a neighbour in common have the same colour.
        #[test]
        fn bodies_of_one_colour_are_far_apart(pairs in pattern(9)) {
            let (matrix, _) = matrix(9, &pairs, &[0.0]);
            let mut colours = Colouring::default();
            colours.find(&matrix);
            let near = |i: u32, j: u32| i == j || pairs.contains(&(i.max(j), i.min(j)));
            for (i, j) in (0..9).flat_map(|i| (0..i).map(move |j| (i, j))) {
                let share = (0..9).any(|k| near(i, k) && near(k, j));
                prop_assert!(!share || colours.colour[i as usize] != colours.colour[j as usize], "{} {}", i, j);
            }
            prop_assert!(colours.colour.iter().all(|&colour| colour < colours.colours));
        }
    }
}
