//! DOF slices as bytes: Q and Q' of every slice of a snapshot.
//!
//! ```text
//! ┌───────────┬──────┬───────┬───────┬───────────────┬────────────────┐
//! │ slice id  │ kind │ n_q   │ n_v   │ Q             │ Q'             │
//! │ u32 LE    │ u8   │ u8    │ u8    │ n_q × f32 LE  │ n_v × f32 LE   │   repeated, in order of slice id
//! └───────────┴──────┴───────┴───────┴───────────────┴────────────────┘
//! ```
//!
//! Kinds: 0 particle (Q = position, m; Q' = velocity, m/s), 1 rigid body (Q = centre of mass, m, and unit quaternion
//! x y z w, body to world; Q' = velocity, m/s, and angular velocity in world axes, rad/s).
//! Quantisation and prediction will replace the bytes behind the same message field.

use crate::{WireError, codec::require};

/// Q and Q' of one slice, single precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Identifies the slice for as long as it lives; never used twice in a run.
    pub id: u32,
    /// What the numbers mean.
    pub kind: u8,
    /// Generalised positions, in the units of the kind.
    pub q: Vec<f32>,
    /// Their rates, per second.
    pub v: Vec<f32>,
}

/// [`Slice::kind`] of a particle.
pub const KIND_PARTICLE: u8 = 0;
/// [`Slice::kind`] of a rigid body.
pub const KIND_RIGID_BODY: u8 = 1;

/// Most slices in one snapshot.
pub const SLICES_MAX: usize = 65_536;

const HEAD_BYTES: usize = 7;

/// Appends one slice to `out`.
///
/// # Panics
/// Where `q` or `v` has more than 255 numbers; no kind has.
pub fn pack(
    id: u32,
    kind: u8,
    q: impl ExactSizeIterator<Item = f32>,
    v: impl ExactSizeIterator<Item = f32>,
    out: &mut Vec<u8>,
) {
    assert!(q.len() < 256 && v.len() < 256, "slice {id} is longer than its count field");
    out.extend_from_slice(&id.to_le_bytes());
    out.extend_from_slice(&[kind, q.len() as u8, v.len() as u8]);
    q.chain(v).for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
}

/// One slice inside the bytes of a snapshot, its numbers still packed and known to be finite.
#[derive(Clone, Copy, Debug)]
pub struct PackedSlice<'a> {
    /// [`Slice::id`].
    pub id: u32,
    /// [`Slice::kind`].
    pub kind: u8,
    q: &'a [u8],
    v: &'a [u8],
}

impl<'a> PackedSlice<'a> {
    /// Generalised positions, in the units of the kind.
    pub fn q(&self) -> impl ExactSizeIterator<Item = f32> + 'a {
        numbers(self.q)
    }

    /// Their rates, per second.
    pub fn v(&self) -> impl ExactSizeIterator<Item = f32> + 'a {
        numbers(self.v)
    }
}

fn numbers(bytes: &[u8]) -> impl ExactSizeIterator<Item = f32> + '_ {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

/// Walks the slices of a snapshot in order of id, without copying them; ends after the first error.
#[derive(Clone, Debug)]
pub struct PackedSlices<'a> {
    rest: &'a [u8],
    last_id: Option<u32>,
    count: usize,
}

/// Slices of a snapshot, for a reader who wants a few of them.
pub fn walk(bytes: &[u8]) -> PackedSlices<'_> {
    PackedSlices { rest: bytes, last_id: None, count: 0 }
}

impl<'a> PackedSlices<'a> {
    fn take_one(&mut self) -> Result<PackedSlice<'a>, WireError> {
        let (head, rest) = self.rest.split_first_chunk::<HEAD_BYTES>().ok_or(WireError::Malformed)?;
        let [i0, i1, i2, i3, kind, n_q, n_v] = *head;
        let (id, n_q, n_v) = (u32::from_le_bytes([i0, i1, i2, i3]), usize::from(n_q), usize::from(n_v));
        let counts_fit = match kind {
            KIND_PARTICLE => (n_q, n_v) == (3, 3),
            KIND_RIGID_BODY => (n_q, n_v) == (7, 6),
            _ => true,
        };
        require(counts_fit, "slice counts", "3 and 3 for a particle, 7 and 6 for a rigid body")?;
        require(self.last_id < Some(id), "slice id", "ascending")?;
        require(self.count < SLICES_MAX, "slice count", "0 to 65536")?;
        let (body, rest) = rest.split_at_checked(4 * (n_q + n_v)).ok_or(WireError::Malformed)?;
        require(numbers(body).all(f32::is_finite), "slice numbers", "finite")?;
        let (q, v) = body.split_at(4 * n_q);
        *self = Self { rest, last_id: Some(id), count: self.count + 1 };
        Ok(PackedSlice { id, kind, q, v })
    }
}

impl<'a> Iterator for PackedSlices<'a> {
    type Item = Result<PackedSlice<'a>, WireError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let slice = self.take_one();
        if slice.is_err() {
            self.rest = &[];
        }
        Some(slice)
    }
}

/// Reads all slices of a snapshot.
///
/// # Errors
/// [`WireError::Malformed`] where the bytes end inside a slice, [`WireError::Content`] for a non-finite number, counts
/// that do not fit a known kind, ids that do not ascend, or too many slices.
pub fn unpack(bytes: &[u8]) -> Result<Vec<Slice>, WireError> {
    let owned = |s: PackedSlice| Slice { id: s.id, kind: s.kind, q: s.q().collect(), v: s.v().collect() };
    walk(bytes).map(|slice| slice.map(owned)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn packed(slices: &[Slice]) -> Vec<u8> {
        let mut out = Vec::new();
        for s in slices {
            pack(s.id, s.kind, s.q.iter().copied(), s.v.iter().copied(), &mut out);
        }
        out
    }

    fn body(id: u32, x: f32) -> Slice {
        Slice { id, kind: KIND_RIGID_BODY, q: vec![x; 7], v: vec![-x; 6] }
    }

    proptest! {
        #[test]
        fn round_trip(xs in prop::collection::vec(-1e6f32..1e6, 0..20)) {
            let slices: Vec<_> = xs.iter().zip(0..).map(|(&x, i)| body(i * 3, x)).collect();
            prop_assert_eq!(unpack(&packed(&slices)).unwrap(), slices);
        }

        #[test]
        fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            let _ = unpack(&bytes);
        }
    }

    #[test]
    fn refuses_what_is_not_a_state() {
        let good = packed(&[body(1, 1.0), body(2, 2.0)]);
        for length in 1..good.len() {
            if length != good.len() / 2 {
                assert_eq!(unpack(&good[..length]), Err(WireError::Malformed), "length {length}");
            }
        }
        for bad in [vec![body(2, 1.0), body(1, 1.0)], vec![body(1, f32::NAN)], vec![body(1, f32::INFINITY)]] {
            assert!(matches!(unpack(&packed(&bad)), Err(WireError::Content { .. })), "{bad:?}");
        }
    }
}
