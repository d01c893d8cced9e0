//! What an articulated figure is made of, and what is refused.

use glam::{DMat3, DQuat, DVec3};

use super::joint::{Joint, JointKind};
use super::limit::JointLimit;
use super::motor::{JointMotor, JointSpring};
use crate::dof::PartInertia;
use crate::eigen::symmetric_eigen;
use crate::error::{LARGEST, SimError, require, require_rotation, require_vector};
use crate::mass::MassProperties;

/// Most parts of a figure: the work of a tick grows with the square of the depth of the tree.
pub const PARTS_MAX: usize = 64;

/// Sine of the smallest angle between the axes of a universal joint.
const UNIVERSAL_ANGLE_MIN: f64 = 0.1;

/// A part of an articulated figure, and the joint that carries it.
#[derive(Clone, Debug, PartialEq)]
pub struct PartDesc {
    /// What messages call it.
    pub name: String,
    /// In the part's frame.
    pub mass: MassProperties,
    /// Index of the part that carries it, smaller than its own; `None` is the world.
    pub parent: Option<u32>,
    /// How it moves against its parent.
    pub joint: JointDesc,
}

/// A joint between a part and its parent.
#[derive(Clone, Debug, PartialEq)]
pub struct JointDesc {
    /// Which movements it leaves.
    pub kind: JointKind,
    /// Where it is in the parent's frame, or in the world, m.
    pub in_parent: DVec3,
    /// Where it is in the part's frame, m. A free figure spins best about its root's centre of mass: see the decay in
    /// the [module](super).
    pub in_part: DVec3,
    /// Turns the part's axes into its parent's at rest.
    pub rest: DQuat,
    /// What keeps it within a range.
    pub limits: Vec<JointLimit>,
    /// What pulls it to rest.
    pub spring: Option<JointSpring>,
    /// What drives it.
    pub motor: Option<JointMotor>,
}

impl JointDesc {
    /// A joint at both origins that leaves the axes parallel at rest, and on which nothing acts.
    pub fn new(kind: JointKind) -> Self {
        let (in_parent, in_part, rest) = (DVec3::ZERO, DVec3::ZERO, DQuat::IDENTITY);
        Self { kind, in_parent, in_part, rest, limits: Vec::new(), spring: None, motor: None }
    }

    /// The same joint at other points of the parent and of the part, m.
    #[must_use]
    pub fn at(self, in_parent: DVec3, in_part: DVec3) -> Self {
        Self { in_parent, in_part, ..self }
    }

    fn validate(&self) -> Result<(), SimError> {
        require_vector(self.in_parent, "the joint's point in the parent")?;
        require_vector(self.in_part, "the joint's point in the part")?;
        require_rotation(self.rest, "the joint's rotation at rest")?;
        self.limits.iter().try_for_each(|limit| limit.validate(self.kind))?;
        self.spring.map_or(Ok(()), |spring| spring.validate())?;
        self.motor.map_or(Ok(()), |motor| motor.validate())?;
        let pulled = self.spring.is_some() || self.motor.is_some();
        if pulled && matches!(self.kind, JointKind::Fixed | JointKind::Free) {
            return Err(SimError::Unusable { what: "fixed and free joints have no springs and motors" });
        }
        Ok(())
    }
}

impl PartDesc {
    /// How messages call the `index`th part.
    pub(super) fn called(&self, index: usize) -> String {
        format!("part {index} ({})", self.name)
    }

    pub(super) fn validate(&self, index: usize) -> Result<(), SimError> {
        self.check(index).map_err(|reason| reason.of(self.called(index)))
    }

    fn check(&self, index: usize) -> Result<(), SimError> {
        let MassProperties { mass, centre, moments } = self.mass;
        require((1e-6..LARGEST).contains(&mass), "mass", mass, "1e-6 to below 1e9 kg")?;
        require_vector(centre, "centre of mass")?;
        [moments.x_axis, moments.y_axis, moments.z_axis].iter().try_for_each(|&m| require_vector(m, "moments"))?;
        let (spread, _) = symmetric_eigen(moments);
        let (least, most) = (spread.min_element(), spread.max_element());
        require(least >= -1e-9 * most, "smallest second moment", least, "0 kg m² or more")?;
        let inertia = least + (spread.element_sum() - least - most);
        require(inertia >= 1e-12, "smallest moment of inertia", inertia, "1e-12 kg m² or more")?;
        if let Some(parent) = self.parent {
            let earlier = (parent as usize) < index;
            require(earlier, "parent", f64::from(parent), "the index of an earlier part")?;
        }
        self.joint.validate()
    }

    /// The part's joint with axes of length 1.
    pub(super) fn joint(&self, index: usize) -> Result<Joint, SimError> {
        let JointDesc { kind, in_parent, in_part, rest, ref limits, spring, motor } = self.joint;
        Ok(Joint {
            kind: unit_axes(kind).map_err(|reason| reason.of(self.called(index)))?,
            parent: self.parent,
            in_parent,
            in_part,
            rest: DMat3::from_quat(rest.normalize()),
            block: None,
            starts: (0, 0),
            limits: limits.iter().map(|limit| limit.normalized()).collect(),
            spring,
            motor,
            controls: 0..0,
        })
    }

    pub(super) fn inertia(&self) -> PartInertia {
        PartInertia { mass: self.mass.mass, centre: self.mass.centre, inertia: self.mass.inertia() }
    }
}

fn unit_axes(kind: JointKind) -> Result<JointKind, SimError> {
    let unit = |axis: DVec3| {
        require_vector(axis, "axis of the joint")?;
        axis.try_normalize().ok_or(SimError::Unusable { what: "the joint's axis is zero" })
    };
    Ok(match kind {
        JointKind::Hinge { axis } => JointKind::Hinge { axis: unit(axis)? },
        JointKind::Slider { axis } => JointKind::Slider { axis: unit(axis)? },
        JointKind::Universal { axes: [a, b] } => {
            let (a, b) = (unit(a)?, unit(b)?);
            let sine = a.cross(b).length();
            let apart = sine >= UNIVERSAL_ANGLE_MIN;
            require(apart, "sine of the angle between the axes of the universal joint", sine, "0.1 or more")?;
            JointKind::Universal { axes: [a, b] }
        }
        JointKind::Fixed | JointKind::Ball | JointKind::Free => kind,
    })
}
