//! Solving on after the second look: islands are found anew with its points. What they touch is gathered again and goes on
//! from where it was, what they do not touch is taken over as it is.

use super::solver::SolveReport;
use super::spots::{Active, Spot, second_spots};
use super::step::{Integrator, Scene, Solve};
use crate::collide::{Bodies, Candidates, Course, Detector};
use crate::dof::{BLOCK_RATES_MAX, Twist};

/// Memory of solving on.
#[derive(Default)]
pub(super) struct Onward {
    /// Where the solver wants to put bodies, by their index in the tick.
    courses: Vec<Course>,
    /// Positions and rates of figures.
    positions: Vec<f64>,
    rates: Vec<f64>,
    /// Whether new points act on a body, by its index in the tick.
    touched: Vec<bool>,
    /// Island of each body before, and its first block there.
    places: Vec<(u32, u32)>,
    /// The solves before.
    solves: Vec<Solve>,
    /// What solves took that are no more.
    pub spent: SolveReport,
}

impl Onward {
    /// Where the solve before ended for a body, from its first block on; `None` where nothing acted on it.
    pub fn solution_of(&self, body: u32) -> Option<&[[f64; BLOCK_RATES_MAX]]> {
        let (island, start) = self.places[body as usize];
        Some(self.solves.get(island as usize)?.problem.solution(start as usize))
    }
}

impl Integrator {
    /// Where the solver wants to put bodies, by their index in the tick.
    pub fn find_candidates(&mut self, scene: &Scene) {
        let Self { onward, active, islands, solves, .. } = self;
        let Onward { courses, positions, rates, .. } = onward;
        courses.clear();
        positions.clear();
        rates.clear();
        courses.extend((0..).zip(active.iter()).map(|(index, active)| {
            let body = &scene.bodies[active.id];
            let solve = solves.get(islands.island_of(index) as usize);
            if body.figure.is_some() {
                let start = [positions.len(), rates.len()];
                let figure = solve.and_then(|solve| solve.problem.figures.list().get(active.figure as usize));
                // A figure is always in an island.
                positions.extend_from_slice(figure.map_or(scene.state.q(body.slice), |figure| &figure.q1));
                rates.extend_from_slice(figure.map_or(scene.state.v(body.slice), |figure| &figure.v1));
                return Course::Figure(start);
            }
            if let Some(Solve { rest: Some(_), .. }) = solve {
                return Course::Body(body.pose(scene.state), Twist::REST);
            }
            if let Some(solve) = solve {
                let start = active.start as usize;
                return Course::Body(solve.problem.poses[start], solve.problem.frames[start].twist());
            }
            let node = body.node(scene.state, scene.settings.dt, scene.settings.field());
            Course::Body(node.pose(node.target, scene.settings.dt), node.target)
        }));
    }

    /// What [`Integrator::find_candidates`] found.
    pub fn candidates<'a>(&'a self, bodies: Bodies<'a>) -> Candidates<'a> {
        let Onward { courses, positions, rates, .. } = &self.onward;
        Candidates { bodies, courses, rates: [positions, rates] }
    }

    /// Tells all contact points how wide their linear models believe them to be at the candidate.
    pub fn tell_beliefs(&self, detector: &mut Detector) {
        for solve in &self.solves[..self.islands.len()] {
            let problem = &solve.problem;
            let mut gaps = problem.terms.contacts.iter().map(|term| -term.final_depth(problem.dt, problem.pair(term)));
            for (&source, gap) in solve.contacts.iter().zip(&mut gaps) {
                detector.contacts[source as usize].believed_gap = gap;
            }
            for (&source, gap) in solve.second.iter().zip(&mut gaps) {
                detector.second[source as usize].contact.believed_gap = gap;
            }
        }
    }

    /// Solves on with the points of the second look from number `first` on.
    pub fn solve_on(&mut self, scene: &Scene, first: usize) {
        let Self { onward, active, islands, solves, .. } = self;
        onward.touched.clear();
        onward.touched.resize(active.len(), false);
        for point in &scene.second[first..] {
            for index in second_spots(scene, point).into_iter().flatten().filter_map(Spot::body) {
                onward.touched[index as usize] = true;
            }
        }
        onward.places.clear();
        let place = |(index, active): (u32, &Active)| (islands.island_of(index), active.start);
        onward.places.extend((0..).zip(active.iter()).map(place));
        std::mem::swap(&mut onward.solves, solves);
        self.find_islands(scene);
        let mut onward = std::mem::take(&mut self.onward);
        for island in 0..self.islands.len() {
            self.go_on(island, &mut onward, scene);
        }
        self.solve(scene, Some(&onward));
        self.onward = onward;
    }

    /// Takes an island over, or starts it anew.
    fn go_on(&mut self, island: usize, onward: &mut Onward, scene: &Scene) {
        let members = self.islands.members(island);
        if !members.iter().any(|&member| onward.touched[member as usize]) {
            let (before, _) = onward.places[members[0] as usize];
            return std::mem::swap(&mut self.solves[island], &mut onward.solves[before as usize]);
        }
        for &member in members {
            let (before, _) = onward.places[member as usize];
            if let Some(before) = onward.solves.get_mut(before as usize) {
                onward.spent.add_effort(&std::mem::take(&mut before.report));
            }
        }
        self.seat(island, scene);
    }
}
