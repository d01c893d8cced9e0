//! One island: its unknowns, its potentials, and the residual that a solver makes zero.

use glam::{DMat3, DVec3};

use super::block::{Block, Entry};
use super::figures::{Blocks, Figures};
use crate::autodiff::Dual;
use crate::dof::{BLOCK_RATES_MAX, Frame, Node, Pose, Twist};
use crate::potential::anti_roll_bar::AntiRollTerm;
use crate::potential::axle::AxleTerm;
use crate::potential::ball_joint::BallJointTerm;
use crate::potential::contact::{ContactTerm, Slide};
use crate::potential::fixed_joint::FixedJointTerm;
use crate::potential::gravity::Gravity;
use crate::potential::hinge::HingeTerm;
use crate::potential::limit::AngleLimitTerm;
use crate::potential::motor::MotorTerm;
use crate::potential::pd::PdTerm;
use crate::potential::rod::RodTerm;
use crate::potential::rolling::RollingTerm;
use crate::potential::slider::SliderTerm;
use crate::potential::spring::SpringTerm;
use crate::potential::universal_joint::UniversalJointTerm;
use crate::potential::{FIXED, FrameIndex, Term, Wrench};

/// Something to be done with every potential, in a fixed order.
pub(super) trait Visitor {
    fn visit<T: Term>(&mut self, terms: &mut [T]);
}

macro_rules! terms {
    ($($name:ident: $Term:ty,)*) => {
        /// The potentials of an island, by type.
        #[derive(Default)]
        pub(crate) struct Terms {
            $(pub $name: Vec<$Term>,)*
        }

        impl Terms {
            pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
                $(visitor.visit(&mut self.$name);)*
            }

            pub fn clear(&mut self) {
                $(self.$name.clear();)*
            }
        }
    };
}

terms! {
    contacts: ContactTerm,
    rolling: RollingTerm,
    springs: SpringTerm,
    rods: RodTerm,
    own_rods: RodTerm,
    ball_joints: BallJointTerm,
    hinges: HingeTerm,
    universal_joints: UniversalJointTerm,
    fixed_joints: FixedJointTerm,
    sliders: SliderTerm,
    distance_limits: RodTerm,
    angle_limits: AngleLimitTerm,
    motors: MotorTerm,
    axles: AxleTerm,
    anti_roll_bars: AntiRollTerm,
    pds: PdTerm,
}

/// A block of unknowns: rates at the end of the tick.
// Nearly all unknowns are bodies, and they are read all the time: a box around them would cost more than it saves.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug)]
pub(crate) enum Unknown {
    /// The twist of a particle or rigid body.
    Body(Node),
    /// Rates of a figure.
    Rates(Rates),
}

/// A block of a figure's rates. Numbers beyond its size are zero.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Rates {
    pub size: u8,
    /// At the start of the tick.
    pub before: [f64; BLOCK_RATES_MAX],
    /// At the end of it without potentials, as far as that is known.
    pub target: [f64; BLOCK_RATES_MAX],
    /// At the end of it if everything happens once more that happened in the last tick.
    pub repeated: [f64; BLOCK_RATES_MAX],
    /// What resists each rate, kg or kg m².
    pub masses: [f64; BLOCK_RATES_MAX],
    /// Of the whole body, kg.
    pub body_mass: f64,
}

/// Below this a body is taken for resting when a start is guessed, m/s and rad/s. It decides the order of guesses alone.
const RESTING_SPEED: f64 = 1e-2;

/// Where a solver may start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Guess {
    /// The motion without potentials.
    Target,
    /// Last tick's motion.
    Before,
    /// No motion.
    Rest,
    /// Last tick's impulses once more.
    Repeated,
    /// Where the last solve of this tick ended.
    Solution,
}

impl Unknown {
    fn guess<const D: usize>(&self, guess: Guess) -> Entry<D> {
        match (self, guess) {
            (Self::Body(node), Guess::Target) => entry_of(node.start_from(node.target)),
            // Known to the problem, not to its unknowns.
            (_, Guess::Solution) => [0.0; D],
            (Self::Body(node), Guess::Before) => entry_of(node.start_from(node.before)),
            (Self::Body(node), Guess::Rest) => entry_of(node.start_from(Twist::REST)),
            (Self::Body(node), Guess::Repeated) => entry_of(node.repeated()),
            (Self::Rates(rates), Guess::Target) => leading(&rates.target),
            (Self::Rates(rates), Guess::Before) => leading(&rates.before),
            (Self::Rates(_), Guess::Rest) => [0.0; D],
            (Self::Rates(rates), Guess::Repeated) => leading(&rates.repeated),
        }
    }

    /// Whether it hardly moved at the start of the tick.
    fn rests(&self) -> bool {
        match self {
            Self::Body(node) => {
                let Twist { linear, angular } = node.before;
                linear.length_squared().max(angular.length_squared()) < RESTING_SPEED * RESTING_SPEED
            }
            Self::Rates(rates) => rates.before.iter().all(|rate| rate.abs() < RESTING_SPEED),
        }
    }

    /// Its own inertia times rates; a figure's is added elsewhere.
    pub(super) fn inertia_product<const D: usize>(&self, x: &Entry<D>) -> Entry<D> {
        let Self::Body(node) = self else { return [0.0; D] };
        let Twist { linear, angular } = twist_of(x);
        entry_of(Twist { linear: node.mass * linear, angular: node.inertia * angular })
    }

    /// A body's momentum at rates `u` beyond what it would have without potentials, kg m/s and kg m²/s; nothing of a
    /// figure's.
    pub(super) fn momentum_gained<const D: usize>(&self, u: &Entry<D>) -> Entry<D> {
        let Self::Body(node) = self else { return [0.0; D] };
        let Twist { linear, angular } = twist_of(u);
        let (linear, angular) = (linear - node.target.linear, angular - node.target.angular);
        entry_of(Twist { linear: node.mass * linear, angular: node.inertia * angular })
    }

    /// Whether three numbers do not say it all.
    pub fn is_wide(&self) -> bool {
        match self {
            Self::Body(node) => node.rotates,
            Self::Rates(rates) => rates.size > 3,
        }
    }

    /// The rates of a momentum; of a figure's, each rate by itself.
    fn divide_by_mass<const D: usize>(&self, momentum: &Entry<D>) -> Entry<D> {
        match self {
            Self::Body(node) => entry_of(node.divide_by_mass(twist_of(momentum))),
            Self::Rates(rates) => {
                std::array::from_fn(|i| if i < usize::from(rates.size) { momentum[i] / rates.masses[i] } else { 0.0 })
            }
        }
    }

    /// Squared residual in energy norm, over the mass: a squared speed, m²/s².
    pub(super) fn residual_speed_squared<const D: usize>(&self, entry: &Entry<D>) -> f64 {
        match self {
            Self::Body(node) => {
                let Twist { linear, angular } = twist_of(entry);
                let turning = if node.rotates { angular.dot(node.inverse_inertia * angular) } else { 0.0 };
                (linear.length_squared() / node.mass + turning) / node.mass
            }
            Self::Rates(rates) => {
                let of_rate = |(r, m): (&f64, &f64)| r * r / m;
                let size = usize::from(rates.size);
                entry.iter().zip(&rates.masses[..size]).map(of_rate).sum::<f64>() / rates.body_mass
            }
        }
    }
}

/// An island. Unknowns are in elimination order.
#[derive(Default)]
pub(crate) struct Problem {
    pub dt: f64,
    pub gravity: Gravity,
    pub unknowns: Vec<Unknown>,
    pub terms: Terms,
    pub figures: Figures,
    /// At the candidate state: where each particle or rigid body is; nowhere for other unknowns.
    pub poses: Vec<Pose>,
    /// At the candidate state: one for every unknown, then one for every attachment. After solving, at the end of the tick.
    pub frames: Vec<Frame<f64>>,
    /// Where a solve of this tick ended; empty before. Numbers beyond a block's size are zero.
    pub(super) solution: Vec<[f64; BLOCK_RATES_MAX]>,
    /// That solve parted bodies at speeds that they shall not keep.
    pub(super) is_parting: bool,
    /// It has contacts of the second look.
    pub looked_again: bool,
    pub(super) products: ProductMemory,
}

/// Memory of Hessian products.
#[derive(Default)]
pub(super) struct ProductMemory {
    /// The frames as they move along the vector.
    moving: Vec<Frame<Dual<1>>>,
    /// How the gradient on each changes.
    tangents: Vec<Wrench>,
}

impl Problem {
    /// Starts an island of no bodies.
    pub fn clear(&mut self, dt: f64, gravity: Gravity) {
        (self.dt, self.gravity) = (dt, gravity);
        self.unknowns.clear();
        self.terms.clear();
        self.figures.clear();
        self.poses.clear();
        self.frames.clear();
        self.solution.clear();
        (self.is_parting, self.looked_again) = (false, false);
    }

    /// Of bodies that stand still, this is where their solve ended.
    pub(super) fn stand_still(&mut self, blocks: usize) {
        self.solution.resize(blocks, [0.0; BLOCK_RATES_MAX]);
    }

    /// Blocks of unknowns.
    pub fn len(&self) -> usize {
        self.unknowns.len()
    }

    /// The guesses that are worth a look, most likely first. What rests goes on resting, what moves does again what it
    /// did; only an impact makes a difference that the first iteration does not mend, and what figures of parts do to
    /// themselves, at their joints' limits, is not seen from here.
    pub(super) fn guesses(&mut self) -> &'static [Guess] {
        if self.is_parting {
            return &[Guess::Solution, Guess::Target, Guess::Before, Guess::Rest];
        } else if !self.solution.is_empty() {
            return &[Guess::Solution];
        }
        // What joints carry does not fall freely. Where nothing but contacts does, looking at all guesses leaves heaps
        // calmer: without it 901 cubes that one rolls through took a tenth more bits.
        let falls = !self.bends();
        let hits = |contact: &ContactTerm| contact.is_impact() || falls && contact.may_hit();
        let is_hit = self.figures.have_parts() || self.terms.contacts.iter().any(hits);
        match (is_hit, self.unknowns.iter().all(Unknown::rests)) {
            // A crack that is nearly shut counts as an impact in every tick: what rests there is not to move for it.
            (true, true) => &[Guess::Rest, Guess::Repeated, Guess::Before, Guess::Target],
            (true, false) => &[Guess::Repeated, Guess::Before, Guess::Target, Guess::Rest],
            (false, true) => &[Guess::Rest, Guess::Repeated],
            (false, false) => &[Guess::Repeated],
        }
    }

    /// Replaces `u` by a guess.
    pub(super) fn guess<const D: usize>(&self, guess: Guess, u: &mut Vec<Entry<D>>) {
        u.clear();
        if guess == Guess::Solution {
            u.extend(self.solution.iter().map(leading));
        } else {
            u.extend(self.unknowns.iter().map(|unknown| unknown.guess(guess)));
        }
    }

    /// Where a solve of this tick ended, from unknown `start` on.
    pub(super) fn solution(&self, start: usize) -> &[[f64; BLOCK_RATES_MAX]] {
        &self.solution[start..]
    }

    /// Unknowns from number `known` on start at `solution`, without one at the motion without potentials.
    pub(super) fn start_from(&mut self, known: usize, solution: Option<&[[f64; BLOCK_RATES_MAX]]>) {
        let new = &self.unknowns[known..];
        match solution {
            Some(solution) => self.solution.extend_from_slice(&solution[..new.len()]),
            None => self.solution.extend(new.iter().map(|unknown| unknown.guess(Guess::Target))),
        }
    }

    /// Remembers where a solve ended, in case that it is to go on from there.
    pub(super) fn remember_solution<const D: usize>(&mut self, u: &[Entry<D>]) {
        self.solution.clear();
        self.solution.extend(u.iter().map(|entry| {
            let mut rates = [0.0; BLOCK_RATES_MAX];
            rates[..D].copy_from_slice(entry);
            rates
        }));
    }

    /// Moves the candidate to the rates `u`.
    pub(super) fn move_to<const D: usize>(&mut self, u: &[Entry<D>]) {
        let Self { poses, frames, unknowns, dt, .. } = self;
        poses.clear();
        frames.clear();
        for (unknown, u) in unknowns.iter().zip(u) {
            let twist = twist_of(u);
            let (pose, frame) = match unknown {
                Unknown::Body(node) => {
                    let pose = node.pose(twist, *dt);
                    (pose, pose.frame(twist))
                }
                Unknown::Rates(_) => (Pose::IDENTITY, Frame::WORLD),
            };
            poses.push(pose);
            frames.push(frame);
        }
        self.figures.move_to(u, self.dt, &mut self.frames);
    }

    /// Incremental potential ½ |u − u*|²_M + Φ at the candidate, J, and its gradient, the residual, in kg m/s and
    /// kg m²/s.
    pub(super) fn evaluate<const D: usize>(&mut self, residual: &mut Vec<Entry<D>>) -> f64 {
        self.evaluate_terms(residual, false)
    }

    /// Takes what is frozen during a Newton iteration from the candidate, then as [`Problem::evaluate`], in one pass.
    pub(super) fn relinearise_and_evaluate<const D: usize>(&mut self, residual: &mut Vec<Entry<D>>) -> f64 {
        self.evaluate_terms(residual, true)
    }

    fn evaluate_terms<const D: usize>(&mut self, residual: &mut Vec<Entry<D>>, relinearise: bool) -> f64 {
        residual.clear();
        let mut energy = 0.0;
        for (unknown, frame) in self.unknowns.iter().zip(&self.frames) {
            let mut entry = [0.0; D];
            if let Unknown::Body(node) = unknown {
                let linear = DVec3::from(frame.linear) - node.target.linear;
                let angular = DVec3::from(frame.angular) - node.target.angular;
                let momentum = Wrench { force: (node.mass * linear).into(), torque: (node.inertia * angular).into() };
                energy += 0.5 * (momentum.force.dot(linear.into()) + momentum.torque.dot(angular.into()));
                add_wrench(&mut entry, momentum, 1.0);
            }
            residual.push(entry);
        }
        let Self { dt, gravity, terms, figures, frames, .. } = self;
        figures.begin_gradient();
        let mut visitor = Evaluate { dt: *dt, frames, residual, figures, energy, relinearise };
        terms.visit(&mut visitor);
        energy = visitor.energy;
        energy + figures.evaluate(*dt, *gravity, frames, residual)
    }

    /// y = H x, H the second derivative of the incremental potential at the candidate: exact for terms, by automatic
    /// differentiation along x (talk, "The Cel Damage Solver": a procedural representation of the Hessian), and as
    /// assembled for figures. Unlike the assembled matrix it can be indefinite.
    pub(super) fn hessian_product<const D: usize>(&mut self, x: &[Entry<D>], y: &mut Vec<Entry<D>>) {
        let Self { dt, unknowns, terms, figures, frames, products, .. } = self;
        let ProductMemory { moving, tangents } = products;
        y.clear();
        y.extend(unknowns.iter().zip(x).map(|(unknown, x)| unknown.inertia_product(x)));
        figures.begin_hessian();
        figures.assemble(*dt, frames, &mut TimesVector { x, y });
        let along = Propose { step: x, figures, dt: *dt };
        moving.clear();
        moving.extend((0..).zip(frames.iter()).map(|(i, frame)| frame.along([along.displacement(i)], *dt)));
        tangents.clear();
        tangents.resize(moving.len(), Wrench::ZERO);
        terms.visit(&mut Product { dt: *dt, moving, tangents });
        for (frame, tangent) in (0..).zip(tangents.iter()) {
            pull_back(figures, frame, *tangent, *dt, y);
        }
    }

    /// y += C x, C what `slides` say.
    pub(super) fn add_slide_product<const D: usize>(&self, slides: &[Slide], x: &[Entry<D>], y: &mut [Entry<D>]) {
        let along = Propose { step: x, figures: &self.figures, dt: self.dt };
        for slide in slides {
            let changes = slide.change(slide.frames.map(|frame| along.displacement(frame)));
            for (frame, change) in slide.frames.into_iter().zip(changes) {
                pull_back(&self.figures, frame, change, self.dt, y);
            }
        }
    }

    /// From now on the figures' second derivatives are positive semidefinite, as the terms' always are. Answers whether
    /// that changes anything.
    pub(super) fn require_definite(&mut self) -> bool {
        self.figures.require_definite()
    }

    /// v ← M⁻¹ p, rates out of momenta. Of figures, M is the diagonal.
    pub(super) fn divide_by_mass<const D: usize>(&self, p: &[Entry<D>], v: &mut Vec<Entry<D>>) {
        v.clear();
        v.extend(self.unknowns.iter().zip(p).map(|(unknown, p)| unknown.divide_by_mass(p)));
    }

    /// Tells the potentials which step the linear model proposes.
    pub(super) fn propose<const D: usize>(&mut self, step: &[Entry<D>]) {
        let Self { dt, terms, figures, .. } = self;
        terms.visit(&mut Propose { step, figures, dt: *dt });
    }

    /// Whether there are potentials that hold something on an arc.
    pub(super) fn bends(&mut self) -> bool {
        let mut visitor = Bends(false);
        self.terms.visit(&mut visitor);
        visitor.0
    }

    /// Raises the stiffness of joints that are open although the candidate is nearly the solution. Answers whether there
    /// was one: the solution is then another.
    pub(super) fn stiffen(&mut self) -> bool {
        let mut visitor = Stiffen { dt: self.dt, frames: &self.frames, any: false };
        self.terms.visit(&mut visitor);
        visitor.any
    }

    /// Largest residual of any block in energy norm, as a speed of its body, m/s.
    pub(super) fn residual_speed<const D: usize>(&self, residual: &[Entry<D>]) -> f64 {
        let squared = self.unknowns.iter().zip(residual).map(|(unknown, r)| unknown.residual_speed_squared(r));
        squared.fold(0.0, |worst: f64, x| if x > worst || x.is_nan() { x } else { worst }).sqrt()
    }

    /// Frames of a term at the candidate.
    pub fn pair<T: Term>(&self, term: &T) -> [&Frame<f64>; 2] {
        pair(&self.frames, term)
    }
}

/// Frames of a term.
pub(super) fn pair<'a, T: Term>(frames: &'a [Frame<f64>], term: &T) -> [&'a Frame<f64>; 2] {
    term.frames().map(|i| frames.get(i as usize).unwrap_or(&Frame::WORLD))
}

/// y += `factor` Jᵀ w, J the derivative of a frame.
fn pull_back<const D: usize>(figures: &Figures, frame: FrameIndex, w: Wrench, factor: f64, y: &mut [Entry<D>]) {
    if let Some(entry) = y.get_mut(frame as usize) {
        add_wrench(entry, w, factor);
    } else if frame != FIXED {
        let numbers = w.numbers();
        for influence in figures.influences(frame as usize - y.len()) {
            for (entry, column) in y[influence.block as usize].iter_mut().zip(&influence.columns) {
                *entry += factor * (0..6).map(|i| column[i] * numbers[i]).sum::<f64>();
            }
        }
    }
}

/// Multiplies the blocks of figures with a vector.
struct TimesVector<'a, const D: usize> {
    x: &'a [Entry<D>],
    y: &'a mut [Entry<D>],
}

impl<const D: usize> TimesVector<'_, D> {
    fn add_entry(&mut self, row: u32, column: u32, (i, j): (usize, usize), entry: f64) {
        let (row, column) = (row as usize, column as usize);
        self.y[row][i] += entry * self.x[column][j];
        if row != column {
            self.y[column][j] += entry * self.x[row][i];
        }
    }
}

impl<const D: usize> Blocks for TimesVector<'_, D> {
    fn add<const R: usize>(&mut self, row: u32, column: u32, block: &Block<R>) {
        for (i, j) in (0..D.min(R)).flat_map(|i| (0..D.min(R)).map(move |j| (i, j))) {
            self.add_entry(row, column, (i, j), block[i][j]);
        }
    }

    fn add_point(&mut self, row: u32, column: u32, block: &DMat3, mass: f64) {
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let mass = if i == j { mass } else { 0.0 };
            self.add_entry(row, column, (i, j), block.col(j)[i] + mass);
        }
    }
}

struct Evaluate<'a, const D: usize> {
    dt: f64,
    frames: &'a [Frame<f64>],
    residual: &'a mut [Entry<D>],
    figures: &'a mut Figures,
    energy: f64,
    /// Whether what is frozen is to be taken anew first.
    relinearise: bool,
}

impl<const D: usize> Visitor for Evaluate<'_, D> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for term in terms {
            let at = pair(self.frames, term);
            let (energy, wrenches) =
                if self.relinearise { term.relinearise_and_evaluate(self.dt, at) } else { term.evaluate(self.dt, at) };
            self.energy += energy;
            for (frame, wrench) in term.frames().into_iter().zip(wrenches) {
                if let Some(entry) = self.residual.get_mut(frame as usize) {
                    add_wrench(entry, wrench, self.dt);
                } else if frame != FIXED {
                    let scaled = Wrench { force: wrench.force * self.dt, torque: wrench.torque * self.dt };
                    self.figures.push(frame as usize - self.residual.len(), scaled);
                }
            }
        }
    }
}

struct Product<'a> {
    dt: f64,
    moving: &'a [Frame<Dual<1>>],
    tangents: &'a mut [Wrench],
}

impl Visitor for Product<'_> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for term in terms {
            let frames = term.frames();
            let at = frames.map(|i| self.moving.get(i as usize).unwrap_or(&Frame::WORLD));
            let (_, wrenches) = term.evaluate(self.dt, at);
            for (frame, wrench) in frames.into_iter().zip(wrenches) {
                if let Some(tangent) = self.tangents.get_mut(frame as usize) {
                    *tangent += wrench.tangent();
                }
            }
        }
    }
}

struct Bends(bool);

impl Visitor for Bends {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        self.0 |= T::BENDS && !terms.is_empty();
    }
}

struct Stiffen<'a> {
    dt: f64,
    frames: &'a [Frame<f64>],
    any: bool,
}

impl Visitor for Stiffen<'_> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for term in terms {
            self.any |= term.stiffen(self.dt, pair(self.frames, term));
        }
    }
}

struct Propose<'a, const D: usize> {
    step: &'a [Entry<D>],
    figures: &'a Figures,
    dt: f64,
}

impl<const D: usize> Propose<'_, D> {
    /// Displacement of a frame, m and rad.
    fn displacement(&self, frame: FrameIndex) -> Twist {
        let scaled = |t: Twist| Twist { linear: t.linear * self.dt, angular: t.angular * self.dt };
        if let Some(entry) = self.step.get(frame as usize) {
            return scaled(twist_of(entry));
        }
        let mut twist = Twist::REST;
        if frame != FIXED {
            for influence in self.figures.influences(frame as usize - self.step.len()) {
                for (column, &rate) in influence.columns.iter().zip(&self.step[influence.block as usize]) {
                    twist.linear += DVec3::from_slice(column) * rate;
                    twist.angular += DVec3::from_slice(&column[3..]) * rate;
                }
            }
        }
        scaled(twist)
    }
}

impl<const D: usize> Visitor for Propose<'_, D> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for term in terms.iter_mut().filter(|_| T::BENDS) {
            term.propose(term.frames().map(|frame| self.displacement(frame)));
        }
    }
}

/// A body's share of a vector as a twist; without rotation where D is 3.
pub(super) fn twist_of<const D: usize>(entry: &Entry<D>) -> Twist {
    let angular = if D == 6 { DVec3::from_slice(&entry[3..]) } else { DVec3::ZERO };
    Twist { linear: DVec3::from_slice(entry), angular }
}

/// A twist as a body's share of a vector.
fn entry_of<const D: usize>(twist: Twist) -> Entry<D> {
    let mut entry = [0.0; D];
    add_wrench(&mut entry, Wrench { force: twist.linear.into(), torque: twist.angular.into() }, 1.0);
    entry
}

fn leading<const D: usize>(numbers: &[f64; BLOCK_RATES_MAX]) -> Entry<D> {
    std::array::from_fn(|i| numbers[i])
}

fn add_wrench<const D: usize>(entry: &mut Entry<D>, wrench: Wrench, factor: f64) {
    for (entry, x) in entry.iter_mut().zip(wrench.numbers()) {
        *entry += factor * x;
    }
}
