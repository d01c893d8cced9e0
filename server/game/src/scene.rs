//! Scene files: exact definitions of small worlds, shared by `simulate`, the tests and the yardstick.
//!
//! One item a line; a body's index is the order of the `body` lines; a body's frame is its principal axes:
//!
//! ```text
//! ticks T                                     number of ticks of the run, at most once
//! gravity gx gy gz                            m/s², at most once
//! plane nx ny nz mu                           static half-space through the origin
//! body SHAPE a b c  mass Ix Iy Iz  px py pz  qw qx qy qz  vx vy vz  wx wy wz  mu collide
//!      SHAPE box: half extents a b c; sphere: radius a; capsule: radius a, half segment b, along x
//! ball i j  ax ay az  bx by bz                ball joint, i = -1: world; i and j do not collide
//! wheel i j  ax ay az  steer  k c  tmax wtarget kv
//!      j slides along y of i (spring k, damper c, at rest at a) and spins about its own z, driven by
//!      clamp(kv (wtarget - w), ±tmax)
//! ```

use pita_sim::{
    Anchor, AxleControl, AxleDesc, BallJointDesc, BodyId, Collider, DQuat, DVec3, Motor, RigidBodyDesc, Settings,
    Shape, SimError, StaticDesc, World,
};

/// Most lines of a scene.
pub const LINES_MAX: usize = 200_000;

/// A world out of a scene file.
pub struct Scene {
    /// Ready for its first tick.
    pub world: World,
    /// In the order of the file.
    pub bodies: Vec<BodyId>,
    /// Ticks that the scene is meant to run.
    pub ticks: usize,
}

/// What is wrong with a scene file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct SceneError {
    /// Counted from 1.
    pub line: usize,
    /// What is wrong, and what would be right.
    pub what: String,
}

impl Scene {
    /// Reads a scene. `settings` gives tick length and solver; the scene's gravity replaces theirs, and nothing sleeps:
    /// scenes are measured beside engines whose bodies do not.
    ///
    /// # Errors
    /// [`SceneError`] naming the line.
    pub fn parse(text: &str, settings: &Settings) -> Result<Self, SceneError> {
        let lines: Vec<Line> = (1..).zip(text.lines()).map(|(number, text)| Line::split(number, text)).collect();
        if lines.len() > LINES_MAX {
            return Err(SceneError { line: LINES_MAX, what: format!("more than {LINES_MAX} lines") });
        }
        let mut settings = Settings { sleep: None, ..settings.clone() };
        for word in ["ticks", "gravity"] {
            let mut given = lines.iter().filter(|line| line.word == word);
            if let (Some(first), Some(second)) = (given.next(), given.next()) {
                return Err(second.error(&format!("{word} is given in line {} already", first.number)));
            }
        }
        if let Some(line) = lines.iter().find(|line| line.word == "gravity") {
            settings.gravity = line.numbers::<3>()?.into();
        }
        let world = World::new(settings).map_err(|error| SceneError { line: 0, what: error.to_string() })?;
        let mut scene = Self { world, bodies: Vec::new(), ticks: 300 };
        for line in &lines {
            scene.add(line)?;
        }
        Ok(scene)
    }

    fn add(&mut self, line: &Line) -> Result<(), SceneError> {
        let added = match line.word {
            "" | "gravity" => Ok(()),
            "ticks" => {
                let [ticks] = line.numbers()?;
                if !(0.0..=1e7).contains(&ticks) {
                    return Err(line.error("ticks must be 0 to 10000000"));
                }
                self.ticks = ticks as usize;
                Ok(())
            }
            "plane" => self.add_plane(line.numbers()?),
            "body" => self.add_body(line)?,
            "ball" => self.add_ball(line)?,
            "wheel" => self.add_wheel(line)?,
            _ => return Err(line.error("expected ticks, gravity, plane, body, ball or wheel")),
        };
        added.map_err(|error: SimError| line.error(&error.to_string()))
    }

    fn add_plane(&mut self, [x, y, z, friction]: [f64; 4]) -> Result<(), SimError> {
        let normal = DVec3::new(x, y, z).normalize_or_zero();
        let shape = Shape::HalfSpace { normal };
        let plane = StaticDesc::new(Collider::new(shape, friction));
        self.world.add_static(plane).map(|_| ())
    }

    fn add_body(&mut self, line: &Line) -> Result<Result<(), SimError>, SceneError> {
        let [a, b, c, mass, ix, iy, iz, x, y, z, qw, qx, qy, qz, vx, vy, vz, wx, wy, wz, friction, collide] =
            line.after(1)?;
        let shape = match line.rest.first().copied() {
            Some("box") => Shape::Box { half: DVec3::new(a, b, c) },
            Some("sphere") => Shape::Ball { radius: a },
            Some("capsule") => Shape::Capsule { half_length: b, radius: a },
            _ => return Err(line.error("shape must be box, sphere or capsule")),
        };
        let body = RigidBodyDesc {
            position: DVec3::new(x, y, z),
            rotation: DQuat::from_xyzw(qx, qy, qz, qw),
            velocity: DVec3::new(vx, vy, vz),
            angular_velocity: DVec3::new(wx, wy, wz),
            mass,
            inertia: DVec3::new(ix, iy, iz),
            collider: (collide != 0.0).then(|| Collider::new(shape, friction)),
        };
        Ok(self.world.add_rigid_body(body).map(|id| self.bodies.push(id)))
    }

    fn add_ball(&mut self, line: &Line) -> Result<Result<(), SimError>, SceneError> {
        let [i, j, ax, ay, az, bx, by, bz] = line.numbers()?;
        let a = Anchor { body: self.body(i, line)?, part: 0, point: DVec3::new(ax, ay, az) };
        let b = Anchor { body: self.body(j, line)?, part: 0, point: DVec3::new(bx, by, bz) };
        Ok(self.world.add_ball_joint(BallJointDesc::new(a, b)).map(|_| ()))
    }

    fn add_wheel(&mut self, line: &Line) -> Result<Result<(), SimError>, SceneError> {
        let [i, j, ax, ay, az, steer, stiffness, damping, max_torque, target_speed, gain] = line.numbers()?;
        let (Some(chassis), Some(wheel)) = (self.body(i, line)?, self.body(j, line)?) else {
            return Err(line.error("a wheel needs two bodies"));
        };
        let drive = Motor { target_speed, gain, max_torque };
        let control = AxleControl { steer, drive, brake: 0.0 };
        let hub = DVec3::new(ax, ay, az);
        Ok(self.world.add_axle(AxleDesc { chassis, wheel, hub, stiffness, damping, control }).map(|_| ()))
    }

    /// The body of an index in the file; `None` for -1, the world.
    fn body(&self, index: f64, line: &Line) -> Result<Option<BodyId>, SceneError> {
        if index == -1.0 {
            return Ok(None);
        }
        let known = (index >= 0.0 && index.fract() == 0.0).then(|| self.bodies.get(index as usize)).flatten();
        known.map(|&id| Some(id)).ok_or_else(|| line.error(&format!("no body {index} above this line")))
    }
}

struct Line<'a> {
    number: usize,
    word: &'a str,
    rest: Vec<&'a str>,
}

impl<'a> Line<'a> {
    fn split(number: usize, text: &'a str) -> Self {
        let mut words = text.split('#').next().unwrap_or("").split_whitespace();
        Self { number, word: words.next().unwrap_or(""), rest: words.collect() }
    }

    fn numbers<const N: usize>(&self) -> Result<[f64; N], SceneError> {
        self.after(0)
    }

    /// Exactly N numbers behind the first `skipped` words.
    fn after<const N: usize>(&self, skipped: usize) -> Result<[f64; N], SceneError> {
        let words = self.rest.get(skipped..).unwrap_or(&[]);
        if words.len() != N {
            return Err(self.error(&format!("{} takes {N} numbers, not {}", self.word, words.len())));
        }
        let mut numbers = [0.0; N];
        for (number, word) in numbers.iter_mut().zip(words) {
            let parsed = word.parse::<f64>().ok().filter(|x| x.is_finite());
            *number = parsed.ok_or_else(|| self.error(&format!("{word:?} is not a finite number")))?;
        }
        Ok(numbers)
    }

    fn error(&self, what: &str) -> SceneError {
        SceneError { line: self.number, what: what.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL: &str = "body sphere 0.5 0 0 1 0.1 0.1 0.1 0 2 0 1 0 0 0 0 0 0 0 0 0 0.5 1\n";

    fn error(text: &str) -> String {
        Scene::parse(text, &Settings::at(1.0 / 30.0)).err().map(|error| error.to_string()).unwrap_or_default()
    }

    #[test]
    fn a_ball_falls() {
        let text = format!("ticks 7\ngravity 0 -10 0\n# ground\nplane 0 1 0 0.5\n{BALL}");
        let mut scene = Scene::parse(&text, &Settings::at(0.1)).unwrap();
        assert_eq!(scene.ticks, 7);
        scene.world.step();
        assert!((scene.world.velocity(scene.bodies[0]).unwrap().y + 1.0).abs() < 1e-9);
    }

    #[test]
    fn errors_name_line_and_reason() {
        for (text, expected) in [
            ("bodies 3", "line 1: expected ticks"),
            ("\nticks -3", "line 2: ticks must be 0 to 10000000"),
            ("ticks 1\nplane 0 1 0 1\nticks 3", "line 3: ticks is given in line 1 already"),
            ("gravity 0 -9 0\ngravity 0 -1 0", "line 2: gravity is given in line 1 already"),
            ("plane 0 0 0 1", "line 1: normal is 0"),
            ("plane 0 1 0", "line 1: plane takes 4 numbers, not 3"),
            ("gravity 0 NaN 0", "line 1: \"NaN\" is not a finite number"),
            (&format!("{BALL}ball 0 1 0 0 0 0 0 0"), "line 2: no body 1 above this line"),
            (&format!("{BALL}ball 0 0 0 0 0 0 0 0"), "line 2: both ends are at the same body"),
            (&format!("{BALL}wheel 0 -1 0 0 0 0 1 1 1 1 1"), "line 2: a wheel needs two bodies"),
            (&BALL.replace("0.5 0 0 1 0.1", "0.5 0 0 -1 0.1"), "line 1: mass is -1, allowed is 1e-6 to below 1e9 kg"),
            (&BALL.replace("sphere", "teapot"), "line 1: shape must be box, sphere or capsule"),
        ] {
            assert!(error(text).starts_with(expected), "{text}: {}", error(text));
        }
    }
}
