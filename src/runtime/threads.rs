//! Our own thread pool: rayon's global one does not survive a fork, so ours is keyed by process.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, TryLockError};
use std::time::Duration;

use rayon::ThreadPool;

type Pools = HashMap<(u32, usize), Arc<ThreadPool>>;

/// How long the list of pools is waited for, in looks and their distance: it is held while a pool is built.
const LOOKS: usize = 500;
const PAUSE: Duration = Duration::from_millis(1);

/// A number of threads; the pool itself is looked up where it is used, as a child of a fork has none of its parent's threads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threads(pub usize);

impl Threads {
    /// The pool of this process; `None` for a single thread.
    pub fn pool(self) -> Option<Arc<ThreadPool>> {
        pool(self.0)
    }
}

/// A pool of the given size in this process, built on first use; `None` for a single thread.
///
/// A child of a fork gets pools of its own; its parent's are never touched.
pub fn pool(threads: usize) -> Option<Arc<ThreadPool>> {
    static POOLS: OnceLock<Mutex<Pools>> = OnceLock::new();
    if threads <= 1 {
        return None;
    }
    // A machine that cannot start threads computes on one.
    let build = || rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok().map(Arc::new);
    let Some(mut pools) = lock(POOLS.get_or_init(Mutex::default)) else { return build() };
    let key = (std::process::id(), threads);
    if let Some(pool) = pools.get(&key) {
        return Some(Arc::clone(pool));
    }
    let pool = build()?;
    pools.insert(key, Arc::clone(&pool));
    Some(pool)
}

/// The list, or `None` if it stays locked: by a thread that a fork has left behind in the parent.
fn lock(pools: &Mutex<Pools>) -> Option<MutexGuard<'_, Pools>> {
    for _ in 0..LOOKS {
        match pools.try_lock() {
            Ok(guard) => return Some(guard),
            Err(TryLockError::Poisoned(poisoned)) => return Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
        }
    }
    None
}

/// The number of threads to use: asked for, else `FLAGRS_THREADS`, else the machine's.
pub fn thread_count(asked: Option<usize>) -> usize {
    asked
        .or_else(|| std::env::var("FLAGRS_THREADS").ok()?.parse().ok())
        .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
        .max(1)
}
