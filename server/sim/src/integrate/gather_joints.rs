//! Gathering of springs, rods, joints, of what limits and drives them, of axles and of controllers.

use glam::DVec3;

use super::attachment::Follows;
use super::gather::Sources;
use super::step::Solve;
use crate::potential::alignment::{Aligned, Alignment, Captured};
use crate::potential::anti_roll_bar::AntiRollTerm;
use crate::potential::axle::AxleTerm;
use crate::potential::ball_joint::BallJointTerm;
use crate::potential::hold::{Held, Memory};
use crate::potential::limit::AngleLimitTerm;
use crate::potential::motor::MotorTerm;
use crate::potential::pd::PdTerm;
use crate::potential::rod::RodTerm;
use crate::potential::slider::LineTerm;
use crate::potential::spring::SpringTerm;
use crate::potential::universal_joint::RightAngle;
use crate::potential::{Anchor, AngleLimitDesc, AntiRollBarDesc, AxleDesc, Driven, End, MotorDesc, PotentialId};

impl Solve {
    /// Makes terms of the potentials on the list: one of each, in the order of the list, so that what a joint's term
    /// remembers finds its way back. Both ends of each take part, or it would not be on the list.
    pub(super) fn gather_potentials(&mut self, sources: Sources) {
        for index in 0..self.potentials.len() {
            let what = self.potentials[index];
            let _: Option<()> = self.gather_potential(what, sources);
        }
    }

    /// `None` where one side takes no part.
    fn gather_potential(&mut self, what: PotentialId, sources: Sources) -> Option<()> {
        let potentials = &*sources.scene.potentials;
        match what {
            PotentialId::Spring(id) => {
                let desc = &potentials.springs[id];
                let ends = self.anchored([desc.a, desc.b], Follows::Place, sources)?;
                let points = self.places(ends);
                self.problem.terms.springs.push(SpringTerm::new(ends, desc, points[0].distance(points[1])));
            }
            PotentialId::Motor(id) => self.gather_motor(&potentials.motors[id], sources)?,
            PotentialId::Axle(id) => self.gather_axle(&potentials.axles[id], sources)?,
            PotentialId::AntiRollBar(id) => self.gather_anti_roll_bar(&potentials.anti_roll_bars[id], sources)?,
            PotentialId::Pd(id) => {
                let (desc, gains) = &potentials.pds[id];
                let anchors = [desc.at, Anchor::world(DVec3::ZERO)];
                let [end, _] = self.anchored(anchors, Follows::Place, sources)?;
                let (mass, start) = (self.mass(end), self.start(end).place(end.point));
                let dt = sources.scene.settings.dt;
                self.problem.terms.pds.push(PdTerm::new(end, desc, *gains, mass, start, dt));
            }
            _ => self.gather_joint(what, sources)?,
        }
        Some(())
    }

    /// Of all that the integrator keeps closed.
    fn gather_joint(&mut self, what: PotentialId, sources: Sources) -> Option<()> {
        let (potentials, least) = (&*sources.scene.potentials, sources.scene.settings.solver.joint_stiffness);
        match what {
            PotentialId::Rod(id) => {
                let Held { desc, memory } = potentials.rods[id];
                let ends = self.anchored([desc.a, desc.b], Follows::Place, sources)?;
                let scale = self.scale(ends, self.places(ends), least);
                self.problem.terms.rods.push(RodTerm::new(ends, [desc.length; 2], desc.tolerance, scale, memory));
            }
            PotentialId::BallJoint(id) => {
                let Held { desc, memory } = potentials.ball_joints[id];
                let ends = self.anchored([desc.a, desc.b], Follows::Place, sources)?;
                let place = self.ball_joint(ends, desc.tolerance, least, memory);
                self.problem.terms.ball_joints.push(place);
            }
            PotentialId::Hinge(id) => {
                let Held { desc: Captured { desc, axes: [axis, _] }, memory } = potentials.hinges[id];
                let ends = self.anchored([desc.a, desc.b], Follows::Figure, sources)?;
                let place = self.ball_joint(ends, desc.tolerance, least, memory);
                let mut turns = Alignment::new([axis], desc.tilt, self.turn_scale(ends, least), memory);
                if let Some(axis) = self.carry_wheel(ends, axis) {
                    turns = turns.of_wheel(axis);
                }
                self.problem.terms.hinges.push(Aligned { place, turns });
            }
            PotentialId::UniversalJoint(id) => {
                let Held { desc, memory } = potentials.universal_joints[id];
                let ends = self.anchored([desc.a, desc.b], Follows::Figure, sources)?;
                let place = self.ball_joint(ends, desc.tolerance, least, memory);
                let axes = [desc.axis_a.normalize(), desc.axis_b.normalize()];
                let turns = RightAngle::new(axes, desc.tilt, self.turn_scale(ends, least), memory);
                self.problem.terms.universal_joints.push(Aligned { place, turns });
            }
            PotentialId::FixedJoint(id) => {
                let Held { desc: Captured { desc, axes }, memory } = potentials.fixed_joints[id];
                let ends = self.anchored([desc.a, desc.b], Follows::Figure, sources)?;
                let place = self.ball_joint(ends, desc.tolerance, least, memory);
                let turns = Alignment::new(axes, desc.tilt, self.turn_scale(ends, least), memory);
                self.problem.terms.fixed_joints.push(Aligned { place, turns });
            }
            PotentialId::Slider(id) => {
                let Held { desc: Captured { desc, axes }, memory } = potentials.sliders[id];
                let ends = self.anchored([desc.a, desc.b], Follows::Figure, sources)?;
                let scale = self.scale(ends, self.places(ends), least);
                let place = LineTerm::new(ends, axes[0][0], desc.tolerance, scale, memory);
                let turns = Alignment::new(axes, desc.tilt, self.turn_scale(ends, least), memory);
                self.problem.terms.sliders.push(Aligned { place, turns });
            }
            PotentialId::DistanceLimit(id) => {
                let Held { desc, memory } = potentials.distance_limits[id];
                let ends = self.anchored([desc.a, desc.b], Follows::Place, sources)?;
                let scale = self.scale(ends, self.places(ends), least);
                let term = RodTerm::new(ends, [desc.at_least, desc.at_most], desc.tolerance, scale, memory);
                self.problem.terms.distance_limits.push(term);
            }
            PotentialId::AngleLimit(id) => {
                let Held { desc, memory } = potentials.angle_limits[id];
                self.gather_angle_limit(&desc, memory, sources)?;
            }
            // Nothing holds the others.
            _ => {}
        }
        Some(())
    }

    fn ball_joint(&self, ends: [End; 2], tolerance: f64, least: f64, memory: Memory) -> BallJointTerm {
        BallJointTerm::new(ends, tolerance, self.scale(ends, self.places(ends), least), memory)
    }

    fn gather_angle_limit(&mut self, desc: &AngleLimitDesc, memory: Memory, sources: Sources) -> Option<()> {
        let Captured { desc: hinge, axes } = sources.scene.potentials.hinges.get(desc.hinge)?.desc;
        let ends = self.anchored([hinge.a, hinge.b], Follows::Figure, sources)?;
        let scale = self.turn_scale(ends, sources.scene.settings.solver.joint_stiffness);
        let term = AngleLimitTerm::new(ends.map(|end| end.frame), axes, desc, scale, memory);
        self.problem.terms.angle_limits.push(term);
        Some(())
    }

    fn gather_motor(&mut self, &MotorDesc { joint, motor }: &MotorDesc, sources: Sources) -> Option<()> {
        let potentials = &*sources.scene.potentials;
        let axis = match joint {
            Driven::Hinge(id) => potentials.hinges.get(id)?.desc.axes[0][0],
            Driven::Slider(id) => potentials.sliders.get(id)?.desc.axes[0][0],
            Driven::Wheels(_) => DVec3::Z,
        };
        let ends = self.anchored(potentials.ends_of(joint)?, Follows::Figure, sources)?;
        let (frames, starts) = (ends.map(|end| end.frame), ends.map(|end| self.start(end)));
        let axis: DVec3 = starts[0].arm(axis).into();
        let term = match joint {
            Driven::Hinge(_) => MotorTerm::turning(frames, motor, axis),
            Driven::Wheels(_) => {
                let other: DVec3 = starts[1].arm(DVec3::Z).into();
                MotorTerm::turning(frames, motor, (axis + other).normalize_or(axis))
            }
            Driven::Slider(_) => {
                let driven = starts[1].place(ends[1].point);
                let arms = starts.map(|start| driven - DVec3::from(start.position));
                MotorTerm::sliding(frames, motor, axis, arms)
            }
        };
        self.problem.terms.motors.push(term);
        Some(())
    }

    fn gather_axle(&mut self, desc: &AxleDesc, sources: Sources) -> Option<()> {
        let ends = self.axle_ends(desc, sources)?;
        let frames = ends.map(|end| end.frame);
        let [chassis, wheel] = frames.map(|frame| self.node(frame));
        let (dt, stiffness) = (sources.scene.settings.dt, sources.scene.settings.solver.joint_stiffness);
        let term = AxleTerm::new(frames, desc, [chassis?, wheel?], stiffness, dt);
        self.head_wheel(ends[1]);
        self.problem.terms.axles.push(term);
        Some(())
    }

    fn gather_anti_roll_bar(&mut self, bar: &AntiRollBarDesc, sources: Sources) -> Option<()> {
        let [left, right] = bar.axles.map(|id| sources.scene.potentials.axles.get(id));
        let axles = [left?, right?];
        let [left, right] = axles.map(|axle| self.expected_travel(axle, sources));
        for (axle, other) in axles.into_iter().zip([right?, left?]) {
            let frames = self.axle_ends(axle, sources)?.map(|end| end.frame);
            self.problem.terms.anti_roll_bars.push(AntiRollTerm::new(frames, axle, bar.stiffness, other));
        }
        Some(())
    }

    /// See [`AntiRollTerm::expected_travel`].
    fn expected_travel(&mut self, axle: &AxleDesc, sources: Sources) -> Option<f64> {
        let [chassis, wheel] = self.axle_ends(axle, sources)?.map(|end| self.node(end.frame));
        Some(AntiRollTerm::expected_travel(axle, [chassis?, wheel?], sources.scene.settings.dt))
    }

    fn axle_ends(&mut self, axle: &AxleDesc, sources: Sources) -> Option<[End; 2]> {
        let anchors = [axle.chassis, axle.wheel].map(|id| Anchor::body(id, DVec3::ZERO));
        self.anchored(anchors, Follows::Figure, sources)
    }
}
