//! Time that this thread had a core, which is what a core pays, whatever else the machine does.

use rustix::time::{ClockId, clock_gettime};

/// Runs `work`, and answers its result and its CPU time, µs.
pub fn cpu_us<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let now_us = || {
        let time = clock_gettime(ClockId::ThreadCPUTime);
        time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
    };
    let began = now_us();
    let result = work();
    (result, now_us() - began)
}
