//! Block coordinate descent, or nonlinear block Gauss-Seidel: one body after the other goes to the bottom of its own
//! incremental potential, while the others wait.
//!
//! A start for Newton's method where things hit one another: there a Newton step serves all bodies with one length, and
//! that is short as long as contacts close one after the other, while here each goes as far as it may. A sweep goes from
//! the lowest body to the highest, so that what the ground bears is known to whatever lies on it, the next one goes back.
//! Friction's limits follow the load at every look, not once an iteration. Only bodies that nothing but contacts acts on
//! are moved: along chains of joints it takes as many sweeps as there are links.

use glam::DVec3;

use super::super::block::{Block, Entry, backward_substitute, cholesky, dot, forward_substitute};
use super::super::line_search::{self, Walk};
use super::super::matrix::inertia_block;
use super::super::problem::{Problem, Unknown, Visitor, pair, twist_of};
use super::work::{Work, block, block_product};
use crate::dof::{Frame, Twist};
use crate::potential::contact::ContactTerm;
use crate::potential::{BetweenFrames, PointSum, Term, Wrench};

/// Most Newton steps of a body in a visit.
const STEPS: usize = 8;

/// A visit ends where the residual has shrunk to this fraction, or below this speed, m/s.
const SHRINK: f64 = 0.1;
const SLOW: f64 = 1e-3;

/// Evaluations and linearisations of a contact that a visit is expected to take.
const LOOKS_EXPECTED: u64 = 4;

/// Memory of the sweeps.
#[derive(Default)]
pub(super) struct BlockDescent<const D: usize> {
    /// Bodies that it moves, from the lowest to the highest.
    order: Vec<u32>,
    /// Contacts of body i are `sides[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    sides: Vec<Side>,
    /// Terms that act on each body.
    terms: Vec<u32>,
    visit: Visit,
}

/// A contact and which of its ends.
#[derive(Clone, Copy, Default)]
struct Side {
    contact: u32,
    end: u8,
}

/// A body that is visited: its contacts as it sees them.
#[derive(Default)]
struct Visit {
    points: Vec<Point>,
}

/// A contact as one of its bodies sees it.
struct Point {
    side: Side,
    /// Displacement by a velocity of the body's point, s; negative for the first body.
    dt: f64,
    /// From the body's origin, m.
    arm: DVec3,
    /// Displacement by what the other body does, m.
    base: DVec3,
    /// Displacement, m.
    at: DVec3,
    /// The same along the step, m.
    along: DVec3,
}

impl Point {
    fn displacement(&self, Twist { linear, angular }: Twist) -> DVec3 {
        self.dt * (linear + angular.cross(self.arm))
    }
}

impl<const D: usize> BlockDescent<D> {
    /// Finds which bodies to visit, in which order. Answers whether there is any.
    pub fn begin(&mut self, problem: &mut Problem) -> bool {
        let n = problem.len();
        self.terms.clear();
        self.terms.resize(n, 0);
        problem.terms.visit(&mut Count { terms: &mut self.terms });
        self.find_sides(&problem.terms.contacts, n);
        let Self { order, starts, terms, .. } = self;
        order.clear();
        order.extend((0..n as u32).filter(|&i| {
            let [start, end] = [starts[i as usize], starts[i as usize + 1]];
            matches!(problem.unknowns[i as usize], Unknown::Body(_)) && end > start && terms[i as usize] == end - start
        }));
        let up = -problem.gravity.acceleration;
        let height = |i: u32| match &problem.unknowns[i as usize] {
            Unknown::Body(node) => up.dot(node.start.position),
            Unknown::Rates(_) => 0.0,
        };
        order.sort_unstable_by(|&a, &b| height(a).total_cmp(&height(b)).then(a.cmp(&b)));
        !order.is_empty()
    }

    /// Sorts contacts by the bodies that they act on.
    fn find_sides(&mut self, contacts: &[ContactTerm], bodies: usize) {
        let sides = || {
            let ends = |(contact, term): (u32, &ContactTerm)| {
                let [a, b] = term.frames();
                [(a, Side { contact, end: 0 }), (b, Side { contact, end: 1 })]
            };
            (0..).zip(contacts).flat_map(ends).filter(|&(frame, _)| (frame as usize) < bodies)
        };
        let Self { starts, sides: sorted, .. } = self;
        starts.clear();
        starts.resize(bodies + 1, 0);
        sides().for_each(|(frame, _)| starts[frame as usize] += 1);
        let mut end = 0;
        for start in starts.iter_mut() {
            end += *start;
            *start = end;
        }
        sorted.clear();
        sorted.resize(end as usize, Side::default());
        // From the end of each body's to its start.
        for (frame, side) in sides() {
            starts[frame as usize] -= 1;
            sorted[starts[frame as usize] as usize] = side;
        }
    }

    /// Multiply-adds that a sweep may well take: bodies that are off take a step and look where it led.
    pub fn expected_work(&self) -> u64 {
        let looks = LOOKS_EXPECTED * self.sides.len() as u64 * block(D);
        looks + self.order.len() as u64 * (block_product(D) / 6 + block(D))
    }

    /// Visits every body once; leaves `u` where they are then, and the candidate's velocities.
    pub fn sweep(&mut self, problem: &mut Problem, u: &mut [Entry<D>], work: &mut Work) {
        let Problem { dt, unknowns, terms, frames, .. } = problem;
        for &body in &self.order {
            let body = body as usize;
            let sides = &self.sides[self.starts[body] as usize..self.starts[body + 1] as usize];
            self.visit.arrive(*dt, &terms.contacts, sides, frames);
            self.visit.descend(&unknowns[body], &mut terms.contacts, &mut u[body], work);
            let Twist { linear, angular } = twist_of(&u[body]);
            (frames[body].linear, frames[body].angular) = (linear.into(), angular.into());
        }
        self.order.reverse();
    }
}

/// Counts the terms that act on bodies.
struct Count<'a> {
    terms: &'a mut [u32],
}

impl Visitor for Count<'_> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for frame in terms.iter().flat_map(T::frames) {
            if let Some(count) = self.terms.get_mut(frame as usize) {
                *count += 1;
            }
        }
    }
}

impl Visit {
    fn arrive(&mut self, dt: f64, contacts: &[ContactTerm], sides: &[Side], frames: &[Frame<f64>]) {
        self.points.clear();
        self.points.extend(sides.iter().map(|&side| {
            let contact = &contacts[side.contact as usize];
            let [own, other] = if side.end == 0 { [0, 1] } else { [1, 0] };
            let sign = if side.end == 0 { -dt } else { dt };
            let base = -sign * DVec3::from(pair(frames, contact)[other].velocity_at(contact.arms()[other]));
            Point { side, dt: sign, arm: contact.arms()[own], base, at: DVec3::ZERO, along: DVec3::ZERO }
        }));
    }

    /// Newton's method for one body.
    fn descend<const D: usize>(
        &mut self,
        unknown: &Unknown,
        contacts: &mut [ContactTerm],
        u: &mut Entry<D>,
        work: &mut Work,
    ) {
        let mut enough = SLOW;
        for step in 0..STEPS {
            let residual = self.residual(unknown, contacts, u);
            work.add(self.points.len() as u64 * block(D));
            let speed = unknown.residual_speed_squared(&residual).sqrt();
            if step == 0 {
                enough = enough.max(SHRINK * speed);
            }
            if speed <= enough {
                return;
            }
            work.add(self.points.len() as u64 * block(D) + block_product(D) / 6 + block(D));
            let Some(factor) = cholesky(&self.hessian::<D>(unknown, contacts), 0.0) else { return };
            let mut direction = residual.map(|r| -r);
            forward_substitute(&factor, &mut direction);
            backward_substitute(&factor, &mut direction);
            let slopes = Slopes {
                start: dot(&residual, &direction),
                by_inertia: dot(&unknown.inertia_product(&direction), &direction),
            };
            let alpha = self.search(contacts, &direction, slopes, work);
            for (u, d) in u.iter_mut().zip(direction) {
                *u += alpha * d;
            }
        }
    }

    /// Residual of the body by itself. Friction is limited as its load is there.
    fn residual<const D: usize>(&mut self, unknown: &Unknown, contacts: &mut [ContactTerm], u: &Entry<D>) -> Entry<D> {
        let twist = twist_of(u);
        let mut residual = unknown.momentum_gained(u);
        for point in &mut self.points {
            point.at = point.base + point.displacement(twist);
            let contact = &mut contacts[point.side.contact as usize];
            let wrench = Wrench::at_fixed(contact.limited_gradient(point.at).into(), point.arm);
            residual.iter_mut().zip(wrench.numbers()).for_each(|(r, x)| *r += point.dt * x);
        }
        residual
    }

    /// Hessian of the body by itself, where its residual was taken.
    fn hessian<const D: usize>(&self, unknown: &Unknown, contacts: &[ContactTerm]) -> Block<D> {
        let mut sum = PointSum::ZERO;
        for point in &self.points {
            let stiffness = contacts[point.side.contact as usize].stiffness(point.at);
            sum.join(&PointSum::at(stiffness * (point.dt * point.dt), [point.arm; 2]));
        }
        let mut hessian = inertia_block(unknown);
        let own = sum.own::<D>(0);
        hessian.as_flattened_mut().iter_mut().zip(own.as_flattened()).for_each(|(h, x)| *h += x);
        hessian
    }

    /// How far to go along a direction.
    fn search<const D: usize>(
        &mut self,
        contacts: &[ContactTerm],
        direction: &Entry<D>,
        slopes: Slopes,
        work: &mut Work,
    ) -> f64 {
        let direction = twist_of(direction);
        for point in &mut self.points {
            point.along = point.displacement(direction);
        }
        let by_contacts = |alpha: f64| -> f64 {
            let slope = |p: &Point| contacts[p.side.contact as usize].gradient(p.at + alpha * p.along).dot(p.along);
            self.points.iter().map(slope).sum()
        };
        let by_contacts_at_start = by_contacts(0.0);
        let mut looks = 0;
        let alpha = line_search::search(slopes.start, Walk::NEWTON, |alpha| {
            looks += 1;
            slopes.start + alpha * slopes.by_inertia + by_contacts(alpha) - by_contacts_at_start
        });
        work.add(looks * self.points.len() as u64 * D as u64);
        alpha
    }
}

/// Of the incremental potential along a direction, J.
struct Slopes {
    start: f64,
    /// How much inertia adds to it a step.
    by_inertia: f64,
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat};

    use super::*;
    use crate::collide::ContactPoint;
    use crate::dof::{Node, Pose};
    use crate::potential::contact::Approach;
    use crate::potential::{Anchor, End, FIXED, SpringDesc, spring::SpringTerm};
    use crate::settings::ContactSettings;

    const DT: f64 = 1.0 / 30.0;

    fn cube(height: f64, speed: f64) -> Unknown {
        let inertia = DMat3::from_diagonal(DVec3::splat(1.0 / 6.0));
        let twist = |linear: DVec3| Twist { linear, angular: DVec3::new(0.3, 0.1, -0.2) };
        Unknown::Body(Node {
            start: Pose { position: DVec3::Y * height, rotation: DQuat::IDENTITY },
            free_rotation: DQuat::IDENTITY,
            free_spin: DVec3::ZERO,
            target: twist(DVec3::new(0.5, -speed - 9.81 * DT, 0.0)),
            before: twist(DVec3::new(0.5, -speed, 0.0)),
            impulse: Twist::REST,
            mass: 1.0,
            inertia,
            inverse_inertia: inertia.inverse(),
            rotates: true,
            wheel_axis: None,
            guessed_spin: None,
        })
    }

    /// Cubes of a metre that fall, one on the other, onto the ground, the highest one last in the order of unknowns.
    fn tower(count: usize, speed: f64) -> Problem {
        let settings = ContactSettings::default();
        let mut problem = Problem { dt: DT, ..Problem::default() };
        problem.gravity.acceleration = DVec3::Y * -9.81;
        problem.unknowns.extend((0..count).map(|i| cube(0.5 + i as f64, speed)));
        for upper in 0..count as u32 {
            let lower = upper.checked_sub(1).unwrap_or(FIXED);
            for corner in [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]] {
                let [x, z] = corner;
                let position = DVec3::new(x, f64::from(upper), z);
                let point = ContactPoint::at(position, DVec3::NEG_Y, 0.0, 0.6);
                let closing = if lower == FIXED { speed } else { 0.0 };
                let approach = Approach { now: closing, free: closing, mass: 1.0 };
                let below = if lower == FIXED { position } else { DVec3::new(x, 0.5, z) };
                let arms = [DVec3::new(x, -0.5, z), below];
                let term = ContactTerm::new([upper, lower], &point, arms, 0.5, approach, &settings, DT);
                problem.terms.contacts.push(term);
            }
        }
        problem
    }

    /// Rates, residual speed and incremental potential after so many sweeps from free fall.
    fn swept(problem: &mut Problem, sweeps: usize) -> (Vec<Entry<6>>, f64, f64) {
        let (mut u, mut residual, mut work) = (Vec::new(), Vec::<Entry<6>>::new(), Work::unlimited());
        problem.guess(super::super::super::problem::Guess::Target, &mut u);
        problem.move_to(&u);
        let mut blocks = BlockDescent::<6>::default();
        if blocks.begin(problem) {
            (0..sweeps).for_each(|_| blocks.sweep(problem, &mut u, &mut work));
        }
        problem.move_to(&u);
        let merit = problem.relinearise_and_evaluate(&mut residual);
        (u, problem.residual_speed(&residual), merit)
    }

    /// A sweep from the ground up takes most of what a falling tower has to lose; many lead to where nothing is left to do.
    #[test]
    fn sweeps_lead_to_the_solution() {
        let (_, start, fall) = swept(&mut tower(5, 3.0), 0);
        let (_, _, once) = swept(&mut tower(5, 3.0), 1);
        let (_, end, rest) = swept(&mut tower(5, 3.0), 2000);
        assert!(start > 1.0, "{start}");
        assert!(end < 10.0 * SLOW, "{end}");
        assert!(once - rest < 0.4 * (fall - rest), "{fall} {once} {rest}");
    }

    /// What anything else acts on stays where it is.
    #[test]
    fn bodies_with_other_potentials_are_left_alone() {
        let mut problem = tower(3, 3.0);
        let ends = [End { frame: 2, point: DVec3::ZERO }, End { frame: FIXED, point: DVec3::ZERO }];
        let world = Anchor::world(DVec3::ZERO);
        let desc = SpringDesc { a: world, b: world, rest_length: 1.0, stiffness: 1.0, damping: 0.0 };
        problem.terms.springs.push(SpringTerm::new(ends, &desc, 1.0));
        let (before, ..) = swept(&mut problem, 0);
        let (after, ..) = swept(&mut problem, 1);
        let moved: Vec<_> = before.iter().zip(&after).map(|(a, b)| a != b).collect();
        assert_eq!(moved, [true, true, false]);
    }
}
