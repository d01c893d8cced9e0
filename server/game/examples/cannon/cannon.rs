//! A weapon: a cannon that fires iron balls at the nearest car, and a ball, which hurts whom it hits.

use pita_game::arena_file::{ArenaError, ArenaFile, Key};
use pita_game::assembly::{Assembly, Piece};
use pita_game::{Actor, ActorInfo, ActorKind, Contact, Message, Partner, Pose, Response, Site, Step, WhenLost};
use pita_sim::{BodyId, DVec3, Shape, SimError, World};
use serde::Deserialize;

/// Of the barrel's mouth, m.
const HEIGHT: f64 = 1.2;
/// Of a ball, m, and its mass, kg.
const BALL: (f64, f64) = (0.12, 20.0);
/// A ball is gone after so many ticks.
const LIFETIME: u32 = 150;
/// Points of health that 1 N s takes.
const HARM: f64 = 0.05;

/// The cannon's own keys in an arena file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CannonParameters {
    /// How far it sees, m.
    range: f64,
    /// Of its balls, m/s.
    speed: f64,
    /// Ticks between two shots.
    period: u32,
}

/// The cannon.
pub struct Cannon {
    info: ActorInfo,
    block: Assembly,
    parameters: CannonParameters,
}

impl ActorKind for Cannon {
    const KIND: &'static str = "cannon";
    type Parameters = CannonParameters;

    fn check(p: &CannonParameters, key: &Key, _file: &ArenaFile) -> Result<(), ArenaError> {
        key.at("range").number(p.range, 1.0, 500.0, "m")?;
        key.at("speed").number(p.speed, 1.0, 200.0, "m/s")?;
        key.at("period").count(p.period as usize, 1, 3_000, "ticks")
    }

    fn add(site: &mut Site, parameters: &CannonParameters) -> Result<Self, SimError> {
        let mut block = Assembly::at(site.pose);
        let shape = Shape::Box { half: DVec3::new(0.6, 0.4, 0.4) };
        block.add(site.world, Piece::new(shape, 2_000.0, 0.8, DVec3::Y * 0.4))?;
        Ok(Self { info: site.info(Self::KIND, block.parts()), block, parameters: parameters.clone() })
    }
}

impl Actor for Cannon {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.block.bodies()
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        if !step.is_due(self.parameters.period) {
            return Ok(());
        }
        let mouth = self.block.point(DVec3::Y * HEIGHT);
        let Some(target) = step.nearest(mouth, self.parameters.range, |other| other.kind == "vehicle") else {
            return Ok(());
        };
        // Where it will be when the ball is there, and as much higher as the ball falls on its way.
        let time = target.position.distance(mouth) / self.parameters.speed;
        let fall = -0.5 * step.world.settings().gravity * time * time;
        let aim = (target.position + time * target.velocity + fall - mouth).normalize_or(DVec3::X);
        let velocity = self.parameters.speed * aim;
        step.add(move |world, id| Ok(Box::new(Ball::fire(world, id, mouth, velocity)?)));
        step.effect("muzzle", mouth, aim, 1.0);
        Ok(())
    }
}

/// A ball on its way.
pub struct Ball {
    info: ActorInfo,
    body: Assembly,
    /// Whom it hit in this tick, and how hard in the last, N s.
    hit: Option<(u32, f64)>,
    ticks_left: u32,
}

impl Ball {
    fn fire(world: &mut World, id: u32, from: DVec3, velocity: DVec3) -> Result<Self, SimError> {
        let mut body = Assembly::at(Pose { position: from, yaw: 0.0 });
        let (radius, mass) = BALL;
        let ball = body.add(world, Piece::new(Shape::Ball { radius }, mass, 0.3, DVec3::ZERO))?;
        world.set_velocity(ball, velocity, DVec3::ZERO)?;
        let info = ActorInfo { id, kind: "cannonball", name: "cannonball".to_owned(), slot: None, parts: body.parts() };
        Ok(Self { info, body, hit: None, ticks_left: LIFETIME })
    }
}

impl Actor for Ball {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.body.bodies()
    }

    fn collide(&mut self, contact: &Contact) -> Response {
        if let Partner::Actor { id, .. } = contact.partner
            && contact.impulse > 0.0
        {
            self.hit = Some((id, contact.impulse));
        }
        Response::Collide
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        if let Some((victim, impulse)) = self.hit.take() {
            step.tell(victim, Message::Damage { amount: HARM * impulse, by: None });
        }
        self.ticks_left = self.ticks_left.saturating_sub(1);
        if self.ticks_left == 0 {
            step.remove_self();
        }
        Ok(())
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Expire
    }
}
