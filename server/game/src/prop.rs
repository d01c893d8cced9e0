//! Props: what stands around in an arena and gets knocked over, broken or ridden on. One kind, one file.

mod drawbridge;
mod fence;
mod jelly;
mod loose;
mod seesaw;

pub use drawbridge::{Drawbridge, DrawbridgeParameters};
pub use fence::{Fence, FenceParameters};
pub use jelly::{Jelly, JellyParameters};
pub use loose::{Barrel, BarrelParameters, Crate, CrateParameters, Loose, LooseThing, Prop, PropParameters};
pub use seesaw::{Seesaw, SeesawParameters};
