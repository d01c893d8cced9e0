//! What a sheep is made of: the talk's worked example, "a real two legged sheep" of a body, a head and two legs on three
//! ball joints. The same parts for all three forms.

use glam::DVec3;
use pita_sim::mass::{Density, MassProperties};
use pita_sim::{Shape, SimError};

/// A box of the sheep. Part frames have their origin at the centre and are parallel where the sheep stands.
pub struct Part {
    /// What messages call it.
    pub name: &'static str,
    /// Half of the edges, m.
    pub half: DVec3,
    /// kg.
    pub mass: f64,
    /// Where the centre is from that of the body, m.
    pub centre: DVec3,
    /// Its ball joint in the body's frame and in its own, m; the body has none.
    pub joint: Option<[DVec3; 2]>,
    /// The points in its own frame, m, that describe its DOF in natural coordinates; the first is its joint, and of the
    /// body the first three are the others'.
    pub points: [DVec3; 4],
}

/// Index of the body among [`PARTS`].
pub const BODY: u32 = 0;
/// Of the head.
pub const HEAD: u32 = 1;
/// Of the front leg.
pub const FRONT_LEG: u32 = 2;
/// Of the hind leg.
pub const HIND_LEG: u32 = 3;

/// Body, head, front leg and hind leg.
pub const PARTS: [Part; 4] = [
    Part {
        name: "body",
        half: DVec3::new(0.5, 0.3, 0.25),
        mass: 40.0,
        centre: DVec3::ZERO,
        joint: None,
        points: [NECK, FRONT_HIP, HIND_HIP, DVec3::new(0.0, 0.0, 0.4)],
    },
    Part {
        name: "head",
        half: DVec3::splat(0.175),
        mass: 5.0,
        centre: DVec3::new(0.675, 0.3, 0.0),
        joint: Some([NECK, NECK_IN_HEAD]),
        points: [DVec3::new(-0.175, -0.1, 0.0), DVec3::new(0.0, 0.175, 0.1), DVec3::new(0.0, 0.175, -0.1), MUZZLE],
    },
    leg("front leg", FRONT_HIP),
    leg("hind leg", HIND_HIP),
];

/// Where the head is jointed, in the body's frame, m.
pub const NECK: DVec3 = DVec3::new(0.5, 0.2, 0.0);
/// Where the front leg is jointed, in the body's frame, m.
pub const FRONT_HIP: DVec3 = DVec3::new(0.35, -0.3, 0.0);
/// Where the hind leg is jointed, in the body's frame, m.
pub const HIND_HIP: DVec3 = DVec3::new(-0.35, -0.3, 0.0);
/// The same in the head's frame, m.
pub const NECK_IN_HEAD: DVec3 = DVec3::new(-0.175, -0.1, 0.0);
/// In the head's frame, m.
pub const CROWN: DVec3 = DVec3::new(0.0, 0.175, 0.0);
/// In the head's frame, m.
pub const MUZZLE: DVec3 = DVec3::new(0.175, -0.1, 0.0);
/// In a leg's frame, m.
pub const FOOT: DVec3 = DVec3::new(0.0, -0.25, 0.0);
/// From hip to foot, m.
pub const LEG: f64 = 0.5;
/// Of the body's centre above the ground where it stands, m.
pub const STANDING: f64 = 0.8;
/// kg.
pub const MASS: f64 = 51.0;

const fn leg(name: &'static str, hip: DVec3) -> Part {
    Part {
        name,
        half: DVec3::new(0.075, 0.25, 0.075),
        mass: 3.0,
        centre: DVec3::new(hip.x, -0.55, 0.0),
        joint: Some([hip, DVec3::new(0.0, 0.25, 0.0)]),
        points: [
            DVec3::new(0.0, 0.25, 0.0),
            DVec3::new(0.1, -0.2, 0.0),
            DVec3::new(-0.06, -0.2, 0.09),
            DVec3::new(-0.06, -0.2, -0.09),
        ],
    }
}

impl Part {
    /// What it collides with.
    pub fn shape(&self) -> Shape {
        Shape::Box { half: self.half }
    }

    /// By integration over the box.
    ///
    /// # Errors
    /// What the engine says.
    pub fn mass_properties(&self) -> Result<MassProperties, SimError> {
        self.shape().mass_properties(Density::constant(1.0))?.scaled_to(self.mass)
    }
}

/// Points of a sheep in natural coordinates: the body's, then three of every other part.
pub const POINTS: usize = 13;

/// Which of the sheep's points a part is embedded in.
pub fn points_of(part: usize) -> [u32; 4] {
    let first = 1 + 3 * part as u32;
    if part == 0 { [0, 1, 2, 3] } else { [part as u32 - 1, first, first + 1, first + 2] }
}
