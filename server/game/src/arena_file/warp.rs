//! Free-form deformation as an arena file writes it: `{ scale = [1, 2, 1], twist = 0.1, bend = [0.2, 0] }`, and key-frames of it.

use glam::DVec3;
use serde::Deserialize;

use super::{ArenaError, Key};
use crate::free_form::{FreeForm, KEYS_MAX, KeyFrames, Warp};

/// How something is deformed about the vertical axis through its origin: scaled, then twisted, then bent.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WarpFile {
    /// Stretch along x, y and z.
    pub scale: [f64; 3],
    /// Turn about the axis with each metre up, rad/m.
    pub twist: f64,
    /// Curvature of the axis towards x and z, rad/m.
    pub bend: [f64; 2],
}

impl Default for WarpFile {
    fn default() -> Self {
        Self { scale: [1.0; 3], twist: 0.0, bend: [0.0; 2] }
    }
}

impl WarpFile {
    /// # Errors
    /// [`ArenaError::OutOfRange`] for the first number out of range, below `key`.
    pub fn check(&self, key: &Key) -> Result<(), ArenaError> {
        for axis in 0..3 {
            key.at("scale").index(axis).number(self.scale[axis], 0.1, 10.0, "")?;
        }
        key.at("twist").number(self.twist, -10.0, 10.0, "rad/m")?;
        (0..2).try_for_each(|axis| key.at("bend").index(axis).number(self.bend[axis], -1.0, 1.0, "rad/m"))
    }

    /// The deformations, one after the other, of something whose lowest point is at this height, m.
    pub fn free_form(self, lowest: f64) -> [FreeForm; 2] {
        Warp::from(self).free_form(DVec3::Y * lowest)
    }
}

impl From<WarpFile> for Warp {
    fn from(file: WarpFile) -> Self {
        Self { scale: file.scale.into(), twist: file.twist, bend: file.bend.into() }
    }
}

/// A key-frame: a time, and the keys of [`WarpFile`].
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarpKeyFile {
    /// When, s.
    pub at: f64,
    /// Stretch along x, y and z.
    #[serde(default = "unscaled")]
    pub scale: [f64; 3],
    /// Turn about the axis with each metre up, rad/m.
    #[serde(default)]
    pub twist: f64,
    /// Curvature of the axis towards x and z, rad/m.
    #[serde(default)]
    pub bend: [f64; 2],
}

fn unscaled() -> [f64; 3] {
    [1.0; 3]
}

impl WarpKeyFile {
    fn warp(&self) -> WarpFile {
        WarpFile { scale: self.scale, twist: self.twist, bend: self.bend }
    }
}

/// Checks the keys `warp` and `warp_period` of the table at `key`.
///
/// # Errors
/// [`ArenaError::OutOfRange`] for the first that is out of range.
pub fn check_warp(key: &Key, warp: &[WarpKeyFile], period: f64) -> Result<(), ArenaError> {
    let frames = key.at("warp");
    frames.count(warp.len(), 0, KEYS_MAX, "key-frames")?;
    let mut last = f64::NEG_INFINITY;
    for (i, frame) in warp.iter().enumerate() {
        let key = frames.index(i);
        key.at("at").number(frame.at, 0.0, 3_600.0, "s")?;
        key.at("at").require(frame.at > last, frame.at, "later than the key-frame before")?;
        last = frame.at;
        frame.warp().check(&key)?;
    }
    let lasts = warp.first().map_or(0.0, |first| last - first.at);
    let longer = warp.is_empty() || period > lasts && period <= 3_600.0;
    key.at("warp_period").require(longer, period, "longer than its key-frames, at most 3600 s")
}

/// What was checked so, over time; `None` without key-frames.
pub fn key_frames(warp: &[WarpKeyFile], period: f64) -> Option<KeyFrames<{ Warp::NUMBERS }>> {
    let numbers = |frame: &WarpKeyFile| (frame.at, Warp::from(frame.warp()).numbers());
    // Where there are any, they were checked by the same rules.
    KeyFrames::new(warp.iter().map(numbers).collect(), Some(period)).ok()
}
