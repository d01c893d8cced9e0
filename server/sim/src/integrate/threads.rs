//! Where the threads that solve islands run.

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// A pool of `threads` threads; none for one, which is the caller.
pub(super) fn pool(threads: usize) -> Result<Option<ThreadPool>, ThreadPoolBuildError> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("island-{i}"));
    if threads > 1 { pool.start_handler(move |index| settle(index, threads)).build().map(Some) } else { Ok(None) }
}

/// Keeps this thread, the pool's `index`-th, on a core of its own where the pool takes up every core that there is. Where
/// cores do not tell Linux that they share a cache, as in some virtual machines, a thread that is woken is run where it
/// was woken from, and two of them take turns on one core while the other one idles.
#[cfg(target_os = "linux")]
fn settle(index: usize, threads: usize) {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

    let Ok(allowed) = sched_getaffinity(None) else { return };
    let mut cores = (0..CpuSet::MAX_CPU).filter(|&core| allowed.is_set(core));
    let count = cores.clone().count();
    if threads < count {
        return;
    }
    if let Some(core) = cores.nth(index % count.max(1)) {
        let mut own = CpuSet::new();
        own.set(core);
        // Where that is not allowed the thread runs wherever it is put.
        let _ = sched_setaffinity(None, &own);
    }
}

#[cfg(not(target_os = "linux"))]
fn settle(_index: usize, _threads: usize) {}
