//! Trace files of a run, as the yardstick's judge reads them.
//!
//! `PREFIX.tr`: little-endian f64 `[ticks + 1][bodies][13]` = centre of mass (3), quaternion w x y z, velocity (3),
//! angular velocity in world axes (3); the first record is the start. `PREFIX.ms`: `[ticks][2]` = wall ms and CPU ms of
//! all threads, of the engine alone.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use pita_sim::{DofKind, SliceView, World};
use rustix::time::{ClockId, clock_gettime};

/// What a run leaves behind, written while it runs.
pub struct Trace {
    states: Output,
    times: Output,
    bodies: Option<usize>,
}

struct Output {
    path: PathBuf,
    file: BufWriter<File>,
}

/// Why a trace cannot go on or be written.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The file format has one number of bodies.
    #[error("a trace needs the same bodies at every tick: there were {before}, now there are {now}")]
    BodiesChanged {
        /// At the first record.
        before: usize,
        /// At this one.
        now: usize,
    },
    /// The file format has a record for every point.
    #[error("a trace holds particles, rigid bodies and points; {kind:?} is none of them")]
    NoPoints {
        /// What there is.
        kind: DofKind,
    },
    /// The disk says no.
    #[error("{file}: {reason}")]
    Unwritable {
        /// The file.
        file: String,
        /// Why.
        reason: io::Error,
    },
}

impl Trace {
    /// Opens `prefix.tr` and `prefix.ms`.
    ///
    /// # Errors
    /// [`TraceError::Unwritable`].
    pub fn create(prefix: &Path) -> Result<Self, TraceError> {
        Ok(Self { states: Output::create(prefix, "tr")?, times: Output::create(prefix, "ms")?, bodies: None })
    }

    /// Appends the state of `world`.
    ///
    /// # Errors
    /// [`TraceError`].
    pub fn record(&mut self, world: &World) -> Result<(), TraceError> {
        let now = world.body_count();
        let before = *self.bodies.get_or_insert(now);
        if before != now {
            return Err(TraceError::BodiesChanged { before, now });
        }
        for slice in world.slices() {
            for state in states(slice)? {
                self.states.write(&state)?;
            }
        }
        Ok(())
    }

    /// Appends what a tick took, ms.
    ///
    /// # Errors
    /// [`TraceError::Unwritable`].
    pub fn record_time(&mut self, took: TickTime) -> Result<(), TraceError> {
        self.times.write(&[took.wall_ms, took.cpu_ms])
    }

    /// Writes what is still in memory.
    ///
    /// # Errors
    /// [`TraceError::Unwritable`].
    pub fn finish(mut self) -> Result<(), TraceError> {
        self.states.flush()?;
        self.times.flush()
    }
}

/// A body as a trace has it, 13 numbers a record: one for a particle or rigid body, one for each point of what is made
/// of points. What has no rotation gets none.
///
/// # Errors
/// [`TraceError::NoPoints`].
pub fn states(slice: SliceView<'_>) -> Result<impl Iterator<Item = [f64; 13]>, TraceError> {
    let (positions, rates) = match slice.kind {
        DofKind::RigidBody => (7, 6),
        DofKind::Particle | DofKind::Natural | DofKind::FiniteElements | DofKind::Lattice => (3, 3),
        DofKind::Articulated | DofKind::Own(_) => return Err(TraceError::NoPoints { kind: slice.kind }),
    };
    Ok(slice.q.chunks_exact(positions).zip(slice.v.chunks_exact(rates)).map(|(q, v)| {
        let [qx, qy, qz, qw] = q.get(3..).and_then(|q| q.try_into().ok()).unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let [wx, wy, wz] = v.get(3..).and_then(|w| w.try_into().ok()).unwrap_or([0.0; 3]);
        [q[0], q[1], q[2], qw, qx, qy, qz, v[0], v[1], v[2], wx, wy, wz]
    }))
}

/// What a tick took.
#[derive(Clone, Copy, Debug)]
pub struct TickTime {
    /// On the clock, ms.
    pub wall_ms: f64,
    /// CPU time of all threads, ms.
    pub cpu_ms: f64,
}

/// Runs `tick` and answers what it took.
pub fn time(tick: impl FnOnce()) -> TickTime {
    let (wall, cpu) = (Instant::now(), process_cpu_ms());
    tick();
    TickTime { wall_ms: wall.elapsed().as_secs_f64() * 1e3, cpu_ms: process_cpu_ms() - cpu }
}

/// CPU time of all threads, ms.
fn process_cpu_ms() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

impl Output {
    fn create(prefix: &Path, extension: &str) -> Result<Self, TraceError> {
        let mut path = prefix.as_os_str().to_owned();
        path.push(format!(".{extension}"));
        let path = PathBuf::from(path);
        match File::create(&path) {
            Ok(file) => Ok(Self { path, file: BufWriter::new(file) }),
            Err(reason) => Err(unwritable(&path, reason)),
        }
    }

    fn write(&mut self, numbers: &[f64]) -> Result<(), TraceError> {
        let Self { path, file } = self;
        numbers.iter().try_for_each(|x| file.write_all(&x.to_le_bytes())).map_err(|reason| unwritable(path, reason))
    }

    fn flush(&mut self) -> Result<(), TraceError> {
        self.file.flush().map_err(|reason| unwritable(&self.path, reason))
    }
}

fn unwritable(path: &Path, reason: io::Error) -> TraceError {
    TraceError::Unwritable { file: path.display().to_string(), reason }
}
