//! Gathering of joints that hold turns, of what limits and drives them, and of axles.

use glam::DVec3;

use super::attachment::Follows;
use super::step::{Integrator, Scene, Solve};
use crate::potential::alignment::{Aligned, Alignment, Captured};
use crate::potential::anti_roll_bar::AntiRollTerm;
use crate::potential::axle::AxleTerm;
use crate::potential::ball_joint::BallJointTerm;
use crate::potential::hold::Held;
use crate::potential::limit::AngleLimitTerm;
use crate::potential::motor::MotorTerm;
use crate::potential::rod::RodTerm;
use crate::potential::slider::LineTerm;
use crate::potential::universal_joint::RightAngle;
use crate::potential::{Anchor, AxleDesc, Driven, End, MotorDesc};

impl Integrator {
    pub(super) fn gather_joints(&mut self, scene: &Scene) {
        let least = scene.settings.solver.joint_stiffness;
        for (id, &Held { desc: Captured { desc, axes: [axis, _] }, memory }) in scene.potentials.hinges.awake() {
            let Some((solve, ends)) = self.localise_anchors(scene, [desc.a, desc.b], Follows::Figure) else { continue };
            let scale = solve.scale(ends, solve.places(ends), least);
            let place = BallJointTerm::new(ends, desc.tolerance, scale, memory);
            let mut turns = Alignment::new([axis], desc.tilt, solve.turn_scale(ends, least), memory);
            if let Some(axis) = solve.carry_wheel(ends, axis) {
                turns = turns.of_wheel(axis);
            }
            solve.problem.terms.hinges.push(Aligned { place, turns });
            solve.hinges.push(id);
        }
        for (id, &Held { desc, memory }) in scene.potentials.universal_joints.awake() {
            let Some((solve, ends)) = self.localise_anchors(scene, [desc.a, desc.b], Follows::Figure) else { continue };
            let scale = solve.scale(ends, solve.places(ends), least);
            let place = BallJointTerm::new(ends, desc.tolerance, scale, memory);
            let axes = [desc.axis_a.normalize(), desc.axis_b.normalize()];
            let turns = RightAngle::new(axes, desc.tilt, solve.turn_scale(ends, least), memory);
            solve.problem.terms.universal_joints.push(Aligned { place, turns });
            solve.universal_joints.push(id);
        }
        for (id, &Held { desc: Captured { desc, axes }, memory }) in scene.potentials.fixed_joints.awake() {
            let Some((solve, ends)) = self.localise_anchors(scene, [desc.a, desc.b], Follows::Figure) else { continue };
            let scale = solve.scale(ends, solve.places(ends), least);
            let place = BallJointTerm::new(ends, desc.tolerance, scale, memory);
            let turns = Alignment::new(axes, desc.tilt, solve.turn_scale(ends, least), memory);
            solve.problem.terms.fixed_joints.push(Aligned { place, turns });
            solve.fixed_joints.push(id);
        }
        for (id, &Held { desc: Captured { desc, axes }, memory }) in scene.potentials.sliders.awake() {
            let Some((solve, ends)) = self.localise_anchors(scene, [desc.a, desc.b], Follows::Figure) else { continue };
            let scale = solve.scale(ends, solve.places(ends), least);
            let place = LineTerm::new(ends, axes[0][0], desc.tolerance, scale, memory);
            let turns = Alignment::new(axes, desc.tilt, solve.turn_scale(ends, least), memory);
            solve.problem.terms.sliders.push(Aligned { place, turns });
            solve.sliders.push(id);
        }
        self.gather_limits(scene);
        self.gather_motors(scene);
    }

    fn gather_limits(&mut self, scene: &Scene) {
        let least = scene.settings.solver.joint_stiffness;
        for (id, &Held { desc, memory }) in scene.potentials.distance_limits.awake() {
            let Some((solve, ends)) = self.localise_anchors(scene, [desc.a, desc.b], Follows::Place) else { continue };
            let scale = solve.scale(ends, solve.places(ends), least);
            let term = RodTerm::new(ends, [desc.at_least, desc.at_most], desc.tolerance, scale, memory);
            solve.problem.terms.distance_limits.push(term);
            solve.distance_limits.push(id);
        }
        for (id, &Held { desc, memory }) in scene.potentials.angle_limits.awake() {
            let Captured { desc: hinge, axes } = scene.potentials.hinges[desc.hinge].desc;
            let Some((solve, ends)) = self.localise_anchors(scene, [hinge.a, hinge.b], Follows::Figure) else {
                continue;
            };
            let frames = ends.map(|end| end.frame);
            let term = AngleLimitTerm::new(frames, axes, &desc, solve.turn_scale(ends, least), memory);
            solve.problem.terms.angle_limits.push(term);
            solve.angle_limits.push(id);
        }
    }

    fn gather_motors(&mut self, scene: &Scene) {
        for (_, &MotorDesc { joint, motor }) in scene.potentials.motors.awake() {
            let (anchors, axis) = match joint {
                Driven::Hinge(id) => {
                    let Captured { desc, axes } = scene.potentials.hinges[id].desc;
                    ([desc.a, desc.b], axes[0][0])
                }
                Driven::Slider(id) => {
                    let Captured { desc, axes } = scene.potentials.sliders[id].desc;
                    ([desc.a, desc.b], axes[0][0])
                }
                Driven::Wheels(_) => match scene.potentials.ends_of(joint) {
                    Some(anchors) => (anchors, DVec3::Z),
                    None => continue,
                },
            };
            let Some((solve, ends)) = self.localise_anchors(scene, anchors, Follows::Figure) else { continue };
            let (frames, starts) = (ends.map(|end| end.frame), ends.map(|end| solve.start(end)));
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
            solve.problem.terms.motors.push(term);
        }
    }

    pub(super) fn gather_axles(&mut self, scene: &Scene) {
        let (dt, stiffness) = (scene.settings.dt, scene.settings.solver.joint_stiffness);
        for (_, desc) in scene.potentials.axles.awake() {
            let Some((solve, ends)) = self.localise_axle(scene, desc) else { continue };
            let frames = ends.map(|end| end.frame);
            let [Some(chassis), Some(wheel)] = frames.map(|frame| solve.node(frame)) else { continue };
            let term = AxleTerm::new(frames, desc, [chassis, wheel], stiffness, dt);
            solve.carry_wheel(ends, [term.axis(), DVec3::Z]);
            solve.problem.terms.axles.push(term);
        }
        for (_, bar) in scene.potentials.anti_roll_bars.awake() {
            let axles = bar.axles.map(|id| &scene.potentials.axles[id]);
            let [Some(left), Some(right)] = axles.map(|axle| self.expected_travel(scene, axle)) else { continue };
            for (axle, other) in axles.into_iter().zip([right, left]) {
                let Some((solve, ends)) = self.localise_axle(scene, axle) else { continue };
                let term = AntiRollTerm::new(ends.map(|end| end.frame), axle, bar.stiffness, other);
                solve.problem.terms.anti_roll_bars.push(term);
            }
        }
    }

    /// See [`AntiRollTerm::expected_travel`].
    fn expected_travel(&mut self, scene: &Scene, axle: &AxleDesc) -> Option<f64> {
        let (solve, ends) = self.localise_axle(scene, axle)?;
        let [chassis, wheel] = ends.map(|end| solve.node(end.frame));
        Some(AntiRollTerm::expected_travel(axle, [chassis?, wheel?], scene.settings.dt))
    }

    fn localise_axle(&mut self, scene: &Scene, axle: &AxleDesc) -> Option<(&mut Solve, [End; 2])> {
        self.localise_anchors(
            scene,
            [axle.chassis, axle.wheel].map(|id| Anchor::body(id, DVec3::ZERO)),
            Follows::Figure,
        )
    }
}
