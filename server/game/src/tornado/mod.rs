//! The talk's worked example: a tornado that travels around the level, picks up what it meets and swirls it around, spins
//! and warps, appears and disappears, and spawns dust.
//!
//! Owns the logic, one function for each line of the slide "Code: Loop". What it is made of are `column`'s spheres, where
//! it goes is `path`'s, whom it holds are `victims`', how it swirls them is `vortex`'s, how it looks is [`mesh`]'s,
//! whether it is there is [`life`]'s. It pushes on its own spheres and dust, and on its victims, through controllers alone.

mod column;
pub mod life;
pub mod mesh;
pub mod parameters;
mod path;
mod victims;
mod vortex;

use std::sync::Arc;

use glam::{DQuat, DVec3};
use pita_sim::{BodyId, Phase, Shape, SimError, World};

use crate::Pose;
use crate::actor::{Actor, ActorInfo, Contact, Partner, Response, WhenLost};
use crate::arena_file::{ArenaError, ArenaFile, Key};
use crate::kinds::{ActorKind, Site};
use crate::part::PartInfo;
use crate::particles::Particles;
use crate::step::Step;
use column::Column;
use life::Life;
use mesh::Warping;
pub use parameters::TornadoParameters;
use path::Path;
use victims::Victims;
use vortex::Vortex;

/// Weaker than this it takes hold of nobody, and holds nobody.
const LEAST_STRENGTH: f64 = 0.3;

/// Particles of dust that are spawned at a time.
const DUST_AT_A_TIME: usize = 3;

/// Turn from each particle of dust to the next about the foot, rad: the golden angle, which never comes round.
const DUST_ANGLE: f64 = 2.399_963;

/// After this time 1/e of the difference between dust and flow is left, s.
const DUST_GRIP: f64 = 0.15;

/// Size at which a particle of dust is drawn, m.
const DUST_RADIUS: f64 = 0.08;

/// A tornado.
pub struct Tornado {
    info: ActorInfo,
    parameters: TornadoParameters,
    bodies: Vec<BodyId>,
    column: Column,
    path: Path,
    life: Life,
    warping: Warping,
    victims: Victims,
    dust: Particles,
    dust_angle: f64,
    /// What the collision procedure saw since the last step.
    touches_ground: bool,
    seen: Vec<BodyId>,
}

impl ActorKind for Tornado {
    const KIND: &'static str = "tornado";
    type Parameters = TornadoParameters;

    fn check(parameters: &TornadoParameters, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        parameters.check(key, file)
    }

    /// Its foot is at the place that the file gives it, and goes to the end of the first leg from there.
    fn add(site: &mut Site, parameters: &TornadoParameters) -> Result<Self, SimError> {
        let (start, p) = (site.pose.position, parameters);
        let column = Column::add(site.world, p, start)?;
        let path = Path::add(site.world, column.foot(), &p.legs, p.path_acceleration)?;
        let warping = Warping::add(site.world, p, start)?;
        // Out of sight, below the ground, and where nothing is lost.
        let parked = (start - DVec3::Y).max(site.file.bounds.min.into());
        let dust = Particles::add(site.world, p.dust, DUST_GRIP, parked)?;
        let grain = Shape::Ball { radius: DUST_RADIUS };
        // The funnel is of a kind of the game's own: its shape is the mesh before it is warped.
        let funnel = Shape::Mesh(Arc::new(mesh::mesh(p)?));
        let spheres = column.bodies().iter().copied().zip(column.shapes().iter().cloned());
        let all = spheres.chain([(warping.body(), funnel)]).chain(dust.bodies().map(|body| (body, grain.clone())));
        let (bodies, parts) = all.map(|(body, shape)| (body, PartInfo::new(site.world, body, shape))).unzip();
        Ok(Self {
            info: site.info(Self::KIND, parts),
            life: Life::new(p.lifespan()),
            warping,
            victims: Victims::default(),
            dust_angle: 0.0,
            touches_ground: false,
            seen: Vec::new(),
            bodies,
            column,
            path,
            dust,
            parameters: p.clone(),
        })
    }
}

impl Tornado {
    /// Moves it along its path, and lets it come and go.
    fn update_forces(&mut self, step: &mut Step) -> Result<(), SimError> {
        if self.life.pass(step.dt) == Some(life::Phase::Appearing) {
            self.path.go_on(step.world, self.column.foot())?;
            self.column.place(step.world, self.path.target())?;
        }
        self.column.push(step.world, &mut self.path, step.dt)
    }

    /// Spins and warps its mesh.
    fn update_warp(&mut self, step: &mut Step) -> Result<(), SimError> {
        let spheres = self.column.spheres(step.world)?;
        self.warping.step(step.world, &self.parameters, spheres, self.life.strength())
    }

    /// Takes hold of those that the collision procedure saw, and swirls those that it holds.
    fn update_victims(&mut self, step: &mut Step) -> Result<(), SimError> {
        let is_weak = self.life.strength() < LEAST_STRENGTH;
        if is_weak {
            self.victims.drop_all(step.world, self.parameters.peace_time);
        }
        let is_looking = step.is_due(self.parameters.sense_period) && !is_weak;
        for seen in self.seen.drain(..) {
            if let Some(victim) = step.owner(seen).filter(|_| is_looking) {
                self.victims.add(step.world, &self.parameters, victim.body)?;
            }
        }
        let vortex = Vortex::about(&self.column, step.world, &self.parameters, self.life.strength())?;
        self.victims.swirl(step.world, &self.parameters, &vortex, step.dt)
    }

    /// Spawns dust where it touches the ground, and swirls it.
    fn update_fx(&mut self, step: &mut Step) -> Result<(), SimError> {
        let p = &self.parameters;
        let vortex = Vortex::about(&self.column, step.world, p, self.life.strength())?;
        let passed = step.dt * f64::from(p.fx_period);
        let spawns = if self.touches_ground && self.life.strength() >= LEAST_STRENGTH { DUST_AT_A_TIME } else { 0 };
        let flow = |at: DVec3| vortex.target(at, DUST_GRIP);
        self.dust.steer(step.world, passed, flow)?;
        for _ in 0..spawns {
            self.dust_angle = (self.dust_angle + DUST_ANGLE).rem_euclid(std::f64::consts::TAU);
            let at = vortex.foot() + DQuat::from_rotation_y(self.dust_angle) * DVec3::X * p.foot_radius;
            self.dust.spawn(step.world, at, flow(at), p.dust_life)?;
        }
        Ok(())
    }

    fn is_valid_victim(&self, contact: &Contact) -> bool {
        let is_other_thing = matches!(contact.partner, Partner::Actor { kind, .. } if kind != Self::KIND);
        is_other_thing && !contact.other.is_sensor && contact.phase != Phase::End
    }
}

impl Actor for Tornado {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    /// The spheres, foot first, the funnel, then the dust.
    fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    /// Its foot: it may be higher than the world, and blow its dust out of it.
    fn whereabouts(&self) -> &[BodyId] {
        &self.bodies[..1]
    }

    fn collide(&mut self, contact: &Contact) -> Response {
        let is_ground = matches!(contact.partner, Partner::Ground(_));
        if is_ground && contact.own.body == Some(self.column.foot()) {
            // Its sphere reaches farther than the foot itself.
            let p = &self.parameters;
            self.touches_ground |= contact.phase != Phase::End && contact.gap <= p.foot_radius - p.reach;
        }
        if let Some(body) = contact.other.body.filter(|_| self.is_valid_victim(contact)) {
            self.seen.push(body);
        }
        Response::Pass
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        self.update_forces(step)?;
        self.update_warp(step)?;
        self.update_victims(step)?;
        if step.is_due(self.parameters.fx_period) {
            self.update_fx(step)?;
        }
        self.touches_ground = false;
        Ok(())
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Home(Pose { position: self.path.target(), yaw: 0.0 })
    }

    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        self.victims.drop_all(world, self.parameters.peace_time);
        self.column.place(world, pose.position)?;
        self.dust.park(world)
    }

    fn leave(&mut self, world: &mut World) {
        self.victims.drop_all(world, self.parameters.peace_time);
    }
}
