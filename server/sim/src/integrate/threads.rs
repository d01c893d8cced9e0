//! The threads that work on islands, and where they run.

use std::sync::{Mutex, PoisonError};

use rayon::iter::{IndexedParallelIterator, IntoParallelRefMutIterator, ParallelIterator};
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use super::step::{Solve, Workspace};

/// Islands of fewer bodies than this in all are worked on by the calling thread: waking another one costs more.
const PARALLEL_BODIES_MIN: usize = 40;

/// The calling thread, or a pool.
#[derive(Default)]
pub(super) struct Threads {
    pool: Option<ThreadPool>,
    /// One for the calling thread and for each of the pool.
    own: Workspace,
    workspaces: Vec<Mutex<Workspace>>,
}

impl Threads {
    /// A pool of `threads` threads; none for one, which is the caller.
    pub fn new(threads: usize) -> Result<Self, ThreadPoolBuildError> {
        let pool = pool(threads)?;
        let workspaces =
            std::iter::repeat_with(Mutex::default).take(if pool.is_some() { threads } else { 0 }).collect();
        Ok(Self { pool, workspaces, ..Self::default() })
    }

    /// Has `job` done to every island that is pending; which thread does it makes no difference.
    pub fn each(&mut self, solves: &mut [Solve], job: impl Fn(usize, &mut Solve, &mut Workspace) + Sync) {
        let pending = || solves.iter().filter(|solve| solve.is_pending);
        let bodies: usize = pending().map(|solve| solve.blocks).sum();
        match &self.pool {
            Some(pool) if bodies >= PARALLEL_BODIES_MIN && pending().nth(1).is_some() => {
                let workspaces = &self.workspaces;
                let run = |(index, solve): (usize, &mut Solve)| {
                    if solve.is_pending {
                        // Within the pool there is always an index, and its workspace is never asked for by another thread.
                        let mine = &workspaces[rayon::current_thread_index().unwrap_or(0)];
                        job(index, solve, &mut mine.lock().unwrap_or_else(PoisonError::into_inner));
                    }
                };
                pool.install(|| solves.par_iter_mut().enumerate().with_max_len(4).for_each(run));
            }
            _ => {
                let pending = solves.iter_mut().enumerate().filter(|(_, solve)| solve.is_pending);
                pending.for_each(|(index, solve)| job(index, solve, &mut self.own));
            }
        }
    }
}

fn pool(threads: usize) -> Result<Option<ThreadPool>, ThreadPoolBuildError> {
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
