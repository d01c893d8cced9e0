//! Trace files of a run, as the yardstick's judge reads them.
//!
//! `PREFIX.tr`: little-endian f64 `[ticks + 1][bodies][13]` = centre of mass (3), quaternion w x y z, velocity (3),
//! angular velocity in world axes (3); the first record is the start. `PREFIX.ms`: `[ticks][2]` = wall ms and CPU ms of
//! all threads, of the engine alone.

use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use pita_sim::{DofKind, World};
use rustix::time::{ClockId, clock_gettime};

/// What a run leaves behind.
#[derive(Default)]
pub struct Trace {
    states: Vec<f64>,
    times: Vec<[f64; 2]>,
    bodies: Option<usize>,
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
    /// Appends the state of `world`.
    ///
    /// # Errors
    /// [`TraceError::BodiesChanged`].
    pub fn record(&mut self, world: &World) -> Result<(), TraceError> {
        let now = world.body_count();
        let before = *self.bodies.get_or_insert(now);
        if before != now {
            return Err(TraceError::BodiesChanged { before, now });
        }
        for slice in world.slices() {
            let (q, v) = (slice.q, slice.v);
            let (rotation, spin) = match slice.kind {
                DofKind::RigidBody => ([q[6], q[3], q[4], q[5]], [v[3], v[4], v[5]]),
                DofKind::Particle => ([1.0, 0.0, 0.0, 0.0], [0.0; 3]),
            };
            self.states.extend_from_slice(&q[..3]);
            self.states.extend_from_slice(&rotation);
            self.states.extend_from_slice(&v[..3]);
            self.states.extend_from_slice(&spin);
        }
        Ok(())
    }

    /// Runs `tick` and appends what it took. Answers its wall time, ms.
    pub fn time(&mut self, tick: impl FnOnce()) -> f64 {
        let (wall, cpu) = (Instant::now(), process_cpu_ms());
        tick();
        let wall_ms = wall.elapsed().as_secs_f64() * 1e3;
        self.times.push([wall_ms, process_cpu_ms() - cpu]);
        wall_ms
    }

    /// Writes `prefix.tr` and `prefix.ms`.
    ///
    /// # Errors
    /// [`TraceError::Unwritable`].
    pub fn write(&self, prefix: &Path) -> Result<(), TraceError> {
        write(prefix, "tr", &self.states)?;
        write(prefix, "ms", self.times.as_flattened())
    }
}

/// CPU time of all threads, ms.
fn process_cpu_ms() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

fn write(prefix: &Path, extension: &str, numbers: &[f64]) -> Result<(), TraceError> {
    let mut path = prefix.as_os_str().to_owned();
    path.push(format!(".{extension}"));
    let path = Path::new(&path);
    let unwritable = |reason| TraceError::Unwritable { file: path.display().to_string(), reason };
    let mut file = BufWriter::new(std::fs::File::create(path).map_err(unwritable)?);
    for number in numbers {
        file.write_all(&number.to_le_bytes()).map_err(unwritable)?;
    }
    file.flush().map_err(unwritable)
}
