//! The threads that share the work of a tick, and where they run.

use std::sync::{Mutex, PoisonError};

use rayon::iter::{IndexedParallelIterator, IntoParallelRefMutIterator, ParallelIterator};
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// Most items that a thread takes at a time. Halves of halves would leave one of two threads waiting for a quarter of the
/// work.
const CHUNK: usize = 4;

/// The calling thread, or a pool.
#[derive(Default)]
pub(crate) struct Threads {
    pool: Option<ThreadPool>,
}

/// Room to work in, for the calling thread and for each of the pool.
#[derive(Default)]
pub(crate) struct Workspaces<W> {
    own: W,
    pooled: Vec<Mutex<W>>,
}

impl<W> Workspaces<W> {
    /// The calling thread's.
    pub fn own(&mut self) -> &mut W {
        &mut self.own
    }
}

impl Threads {
    /// A pool of `threads` threads; none for one, which is the caller.
    pub fn new(threads: usize) -> Result<Self, ThreadPoolBuildError> {
        let pool = ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("island-{i}"));
        let pool = pool.start_handler(move |index| settle(index, threads));
        Ok(Self { pool: if threads > 1 { Some(pool.build()?) } else { None } })
    }

    /// Has `job` done to every item, by more than one thread where that is worth it; which thread does it makes no
    /// difference. The job is told the item's index.
    pub fn each<T: Send, W: Default + Send>(
        &self,
        items: &mut [T],
        workspaces: &mut Workspaces<W>,
        is_worth_it: bool,
        job: impl Fn(usize, &mut T, &mut W) + Sync,
    ) {
        let Some(pool) = self.pool.as_ref().filter(|_| is_worth_it) else {
            return items.iter_mut().enumerate().for_each(|(index, item)| job(index, item, &mut workspaces.own));
        };
        workspaces.pooled.resize_with(pool.current_num_threads(), Mutex::default);
        let pooled = &workspaces.pooled;
        let run = |(index, item): (usize, &mut T)| {
            // Within the pool there is always an index, and its workspace is never asked for by another thread.
            let mine = &pooled[rayon::current_thread_index().unwrap_or(0)];
            job(index, item, &mut mine.lock().unwrap_or_else(PoisonError::into_inner));
        };
        pool.install(|| items.par_iter_mut().enumerate().with_max_len(CHUNK).for_each(run));
    }
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
