//! What peers cost on the yardstick's scenes on the machine and the day of the kit's `PEERS.md` (2026-11-21).
//!
//! Rapier runs here as well, so that its figures then and now tell how fast this machine is; the others' are scaled by
//! that. "Accepted" is each peer's cheapest setting that the judge accepts, tuned ones included.

use crate::yardstick::rapier::Setting;

/// A scene's figures.
pub struct Published {
    /// Name of the scene.
    pub scene: &'static str,
    /// Rapier at its defaults, one step a tick, ms p50.
    pub rapier_default_ms: f64,
    /// Rapier at its cheapest accepted setting, ms p50; `None` where none was found.
    pub rapier_accepted: Option<(Setting, f64)>,
    /// The other peers at theirs; those without an accepted setting are left out.
    pub others: &'static [Other],
}

/// A peer that does not run here.
#[derive(Clone, Copy, Debug)]
pub struct Other {
    /// Its name.
    pub peer: &'static str,
    /// Its cheapest accepted setting, in the words of `PEERS.md`.
    pub setting: &'static str,
    /// ms p50.
    pub ms: f64,
}

const fn jolt(setting: &'static str, ms: f64) -> Other {
    Other { peer: "Jolt", setting, ms }
}

const fn mujoco(setting: &'static str, ms: f64) -> Other {
    Other { peer: "MuJoCo", setting, ms }
}

const fn box3d(setting: &'static str, ms: f64) -> Other {
    Other { peer: "Box3D", setting, ms }
}

const fn steps(steps: u32) -> Setting {
    Setting { steps, iterations: None }
}

const fn iterations(iterations: usize) -> Setting {
    Setting { steps: 1, iterations: Some(iterations) }
}

/// All scenes, in the order of the catalogue.
pub const PUBLISHED: &[Published] = &[
    Published {
        scene: "pile100",
        rapier_default_ms: 0.18,
        rapier_accepted: Some((steps(2), 0.392)),
        others: &[jolt("vel=20,pos=4 k=2", 0.691), mujoco("k=4", 13.4), box3d("k=4 sub=1", 0.432)],
    },
    Published {
        scene: "pile500",
        rapier_default_ms: 1.11,
        rapier_accepted: Some((steps(2), 2.41)),
        others: &[jolt("k=2", 3.32), box3d("k=4 sub=1", 2.62)],
    },
    Published {
        scene: "pile1000",
        rapier_default_ms: 2.42,
        rapier_accepted: Some((steps(4), 11.0)),
        others: &[jolt("k=4", 14.8), box3d("k=4 sub=2", 8.57)],
    },
    Published { scene: "pilethrown500", rapier_default_ms: 1.14, rapier_accepted: Some((steps(4), 4.16)), others: &[] },
    Published {
        scene: "stack10",
        rapier_default_ms: 0.0159,
        rapier_accepted: Some((iterations(16), 0.0412)),
        others: &[jolt("k=8", 0.105), mujoco("k=2", 0.0863), box3d("k=1 sub=8 chz=240 cdr=1", 0.029)],
    },
    Published {
        scene: "stack20",
        rapier_default_ms: 0.0273,
        rapier_accepted: None,
        others: &[jolt("k=32", 0.77), mujoco("k=4", 0.339), box3d("k=1 sub=8 chz=240 cdr=1", 0.05)],
    },
    Published {
        scene: "sheep100",
        rapier_default_ms: 0.75,
        rapier_accepted: Some((iterations(16), 2.01)),
        others: &[
            jolt("vel=20,pos=4 k=4", 3.15),
            mujoco("discrete k=1", 1.93),
            box3d("k=2 sub=12 noccd jhz=1000 jdr=1", 3.76),
        ],
    },
    Published {
        scene: "sheep400",
        rapier_default_ms: 3.31,
        rapier_accepted: Some((iterations(32), 14.1)),
        others: &[jolt("k=8", 19.4), mujoco("discrete k=2", 14.6), box3d("tuned", 16.1)],
    },
    Published {
        scene: "chain",
        rapier_default_ms: 0.0256,
        rapier_accepted: Some((iterations(256), 1.36)),
        others: &[jolt("k=128", 2.02), mujoco("k=32", 0.741), box3d("k=1 sub=160 jhz=4000 jdr=1", 0.83)],
    },
    Published {
        scene: "cars16",
        rapier_default_ms: 0.174,
        rapier_accepted: Some((steps(8), 1.3)),
        others: &[jolt("k=8", 1.24), mujoco("discrete k=1", 0.187), box3d("k=4 sub=8", 1.36)],
    },
    Published {
        scene: "cars64",
        rapier_default_ms: 0.698,
        rapier_accepted: Some((steps(8), 5.16)),
        others: &[jolt("k=8", 4.99), mujoco("discrete k=1", 0.963), box3d("k=4 sub=8", 5.37)],
    },
    Published {
        scene: "cars128",
        rapier_default_ms: 1.43,
        rapier_accepted: Some((steps(8), 10.7)),
        others: &[jolt("k=8", 10.1), mujoco("discrete k=1", 2.54), box3d("k=4 sub=8", 10.8)],
    },
    Published {
        scene: "spin",
        rapier_default_ms: 0.00224,
        rapier_accepted: Some((steps(4), 0.00759)),
        others: &[jolt("k=16", 0.0354), mujoco("RK4 k=1", 0.00792), box3d("k=2 sub=28, tuned", 0.018)],
    },
    Published {
        scene: "slope45",
        rapier_default_ms: 0.00503,
        rapier_accepted: Some((iterations(8), 0.00723)),
        others: &[jolt("k=1", 0.0037), mujoco("discrete,elliptic,impratio=10 k=8", 0.038), box3d("k=1 sub=8", 0.0085)],
    },
    Published {
        scene: "slope55",
        rapier_default_ms: 0.0051,
        rapier_accepted: Some((Setting::DEFAULT, 0.0051)),
        others: &[jolt("k=1", 0.00416), mujoco("k=1", 0.00475), box3d("k=1 sub=1", 0.0031)],
    },
    Published {
        scene: "soft",
        rapier_default_ms: 1.0,
        rapier_accepted: Some((Setting::DEFAULT, 1.0)),
        others: &[mujoco("discrete k=1", 0.613)],
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::yardstick::catalogue;

    #[test]
    fn every_scene_has_its_figures() {
        let published: Vec<_> = PUBLISHED.iter().map(|entry| entry.scene).collect();
        assert_eq!(published, catalogue::names().collect::<Vec<_>>());
    }
}
