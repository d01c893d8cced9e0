//! The daemon's clocks: monotonic time, CPU time of a thread, and its wait for a core.

use std::fs::File;
use std::time::Instant;

use rustix::time::{ClockId, clock_gettime};

/// Monotonic time since the start of the daemon.
#[derive(Clone, Copy, Debug)]
pub struct Clock(Instant);

impl Clock {
    /// Begins at zero.
    pub fn start() -> Self {
        Self(Instant::now())
    }

    /// Since the start, ns.
    pub fn ns(&self) -> u64 {
        // 2^64 ns are 584 years.
        self.0.elapsed().as_nanos() as u64
    }

    /// Since the start, ms.
    pub fn ms(&self) -> u64 {
        self.ns() / 1_000_000
    }

    /// Since the start, s.
    pub fn seconds(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

/// What the calling thread used since it was asked last: CPU time, and time in which it was ready and waited for a core.
///
/// The wait is the second number of `/proc/thread-self/schedstat`, which stays open; reading it costs about a
/// microsecond and never touches a disk. Where there is none, the wait is 0.
pub struct ThreadUse {
    schedstat: Option<File>,
    cpu_ns: u64,
    wait_ns: u64,
}

impl ThreadUse {
    /// Watches the calling thread; must be asked by the same one.
    pub fn of_this_thread() -> Self {
        let mut this = Self { schedstat: File::open("/proc/thread-self/schedstat").ok(), cpu_ns: 0, wait_ns: 0 };
        this.lap_ns();
        this
    }

    /// CPU time and wait for a core since the last lap, ns.
    pub fn lap_ns(&mut self) -> (u64, u64) {
        let (cpu_ns, wait_ns) = (cpu_ns(ClockId::ThreadCPUTime), self.read_wait_ns().unwrap_or(0));
        let lap = (cpu_ns.saturating_sub(self.cpu_ns), wait_ns.saturating_sub(self.wait_ns));
        (self.cpu_ns, self.wait_ns) = (cpu_ns, wait_ns);
        lap
    }

    fn read_wait_ns(&self) -> Option<u64> {
        let mut text = [0; 96];
        let length = rustix::io::pread(self.schedstat.as_ref()?, &mut text, 0).ok()?;
        let numbers = std::str::from_utf8(text.get(..length)?).ok()?;
        numbers.split_ascii_whitespace().nth(1)?.parse().ok()
    }
}

/// CPU time of the whole process since its start, s.
pub fn process_cpu_s() -> f64 {
    cpu_ns(ClockId::ProcessCPUTime) as f64 * 1e-9
}

/// Resident memory of the process, bytes; 0 where `/proc` does not tell.
pub fn resident_bytes() -> u64 {
    let kilobytes = || -> Option<u64> {
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.trim().strip_suffix("kB")?.trim().parse().ok()
    };
    kilobytes().unwrap_or(0) * 1024
}

fn cpu_ns(clock: ClockId) -> u64 {
    let time = clock_gettime(clock);
    // CPU clocks begin at zero and are not negative.
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lap_is_the_cpu_time_since_the_last_one() {
        let mut watch = ThreadUse::of_this_thread();
        let mut sum = 0u64;
        let spinning = Clock::start();
        while cpu_ns(ClockId::ThreadCPUTime) < watch.cpu_ns + 5_000_000 {
            sum = std::hint::black_box(sum + 1);
        }
        let (cpu_ns, _) = watch.lap_ns();
        assert!((5_000_000..=spinning.ns() + 5_000_000).contains(&cpu_ns), "{cpu_ns} ns");
        assert!(watch.lap_ns().0 < cpu_ns, "the second lap begins where the first ended");
    }
}
