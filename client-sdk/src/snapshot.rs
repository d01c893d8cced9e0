//! A snapshot as it was received: its head read, its slices still packed.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Instant,
};

use pita_protocol::{
    WireError,
    message::{InputAck, Snapshot},
    slices::{self, PackedSlice, Slice},
};

/// State of all slices after one tick. Slices are read when they are asked for: whoever wants one of them, or none of
/// a snapshot, does not pay for all.
#[derive(Debug)]
pub struct ReceivedSnapshot {
    head: Snapshot,
    received: Instant,
    malformed: Arc<AtomicU64>,
}

impl ReceivedSnapshot {
    pub(crate) fn new(head: Snapshot, received: Instant, malformed: Arc<AtomicU64>) -> Self {
        Self { head, received, malformed }
    }

    /// Tick whose end this is.
    pub fn tick(&self) -> u64 {
        self.head.tick
    }

    /// What became of this session's inputs.
    pub fn ack(&self) -> InputAck {
        self.head.ack
    }

    /// Number of the last event before it.
    pub fn event_sequence(&self) -> u32 {
        self.head.event_sequence
    }

    /// When it arrived.
    pub fn received(&self) -> Instant {
        self.received
    }

    /// All slices, in order of id.
    ///
    /// # Errors
    /// What [`slices::unpack`] says; it is counted in [`Statistics::malformed`](crate::Statistics::malformed).
    pub fn slices(&self) -> Result<Vec<Slice>, WireError> {
        self.counted(slices::unpack(&self.head.dof))
    }

    /// Those slices whose ids are in `wanted`, which ascends; ids that the snapshot lacks are left out.
    ///
    /// # Errors
    /// What [`slices::walk`] says of the slices up to the last wanted one; counted as for [`Self::slices`].
    pub fn select(&self, wanted: &[u32]) -> Result<Vec<PackedSlice<'_>>, WireError> {
        self.counted(self.selected(wanted))
    }

    fn selected(&self, mut wanted: &[u32]) -> Result<Vec<PackedSlice<'_>>, WireError> {
        let mut found = Vec::with_capacity(wanted.len());
        for slice in slices::walk(&self.head.dof) {
            let slice = slice?;
            while wanted.first().is_some_and(|&id| id < slice.id) {
                wanted = &wanted[1..];
            }
            if wanted.first() == Some(&slice.id) {
                found.push(slice);
                wanted = &wanted[1..];
            }
            if wanted.is_empty() {
                break;
            }
        }
        Ok(found)
    }

    fn counted<T>(&self, result: Result<T, WireError>) -> Result<T, WireError> {
        if result.is_err() {
            self.malformed.fetch_add(1, Ordering::Relaxed);
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pita_protocol::slices::{KIND_PARTICLE, pack};

    fn received(dof: Vec<u8>) -> ReceivedSnapshot {
        let head = Snapshot { epoch: 0, tick: 1, ack: InputAck::default(), event_sequence: 0, dof };
        ReceivedSnapshot::new(head, Instant::now(), Arc::default())
    }

    #[test]
    fn selects_what_is_wanted_and_there() {
        let mut dof = Vec::new();
        for id in [2, 4, 6, 8] {
            pack(id, KIND_PARTICLE, [id as f32; 3].into_iter(), [0.0; 3].into_iter(), &mut dof);
        }
        let snapshot = received(dof);
        for (wanted, found) in [(&[][..], &[][..]), (&[4], &[4]), (&[1, 2, 5, 8, 9], &[2, 8]), (&[9], &[])] {
            let slices = snapshot.select(wanted).unwrap();
            assert_eq!(slices.iter().map(|s| s.id).collect::<Vec<_>>(), found);
        }
        assert_eq!(snapshot.slices().unwrap().len(), 4);
    }

    #[test]
    fn counts_what_cannot_be_read() {
        let snapshot = received(vec![1, 2, 3]);
        assert_eq!(snapshot.slices(), Err(WireError::Malformed));
        assert!(snapshot.select(&[1]).is_err());
        assert_eq!(snapshot.malformed.load(Ordering::Relaxed), 2);
    }
}
