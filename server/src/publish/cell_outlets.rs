//! Where cells are put: a declared publisher for each layer of each.

use std::collections::BTreeMap;
use std::sync::Arc;

use pita_protocol::message::CellId;

use super::outlet::Outlet;
use crate::cells::Cells;
use crate::shared::Shared;

/// The publishers of all cells.
pub struct CellOutlets {
    shared: Arc<Shared>,
    session: zenoh::Session,
    layers: BTreeMap<(CellId, u8), Outlet>,
}

impl CellOutlets {
    /// None yet.
    pub fn new(shared: Arc<Shared>, session: zenoh::Session) -> Self {
        Self { shared, session, layers: BTreeMap::new() }
    }

    /// Puts what the last tick of `cells` came to, and keeps what newcomers ask for up to date.
    pub fn publish(&mut self, cells: &Cells) {
        for published in cells.published() {
            let (cell, layer) = (published.cell, published.layer);
            if published.is_keyframe {
                self.shared.set_keyframes(cell, cells.epoch(cell));
            }
            if let Some(outlet) = self.outlet(cell, layer) {
                outlet.put(published.bytes.clone());
            }
        }
        for &cell in cells.over() {
            self.shared.set_keyframes(cell, &[]);
            self.layers.retain(|(of, _), _| *of != cell);
        }
    }

    fn outlet(&mut self, cell: CellId, layer: u8) -> Option<&Outlet> {
        if !self.layers.contains_key(&(cell, layer)) {
            match Outlet::for_cells(&self.session, self.shared.keys.cell(cell, layer)) {
                Ok(outlet) => drop(self.layers.insert((cell, layer), outlet)),
                Err(reason) => tracing::error!("no publisher for a cell: {reason}"),
            }
        }
        self.layers.get(&(cell, layer))
    }
}
