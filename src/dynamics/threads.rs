//! Our own thread pool: rayon's global one does not survive a fork, so ours is keyed by process.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use rayon::ThreadPool;

type Pools = Mutex<HashMap<(u32, usize), Arc<ThreadPool>>>;

/// A pool of the given size in this process, built on first use; `None` for a single thread.
///
/// A child of a fork gets pools of its own; its parent's are never touched.
pub fn pool(threads: usize) -> Option<Arc<ThreadPool>> {
    static POOLS: OnceLock<Pools> = OnceLock::new();
    if threads <= 1 {
        return None;
    }
    let mut pools = POOLS.get_or_init(Pools::default).lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let key = (std::process::id(), threads);
    if let Some(pool) = pools.get(&key) {
        return Some(Arc::clone(pool));
    }
    // A machine that cannot start threads computes on one.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok().map(Arc::new)?;
    pools.insert(key, Arc::clone(&pool));
    Some(pool)
}

/// The number of threads to use: asked for, else `FLAGRS_THREADS`, else the machine's.
pub fn thread_count(asked: Option<usize>) -> usize {
    asked
        .or_else(|| std::env::var("FLAGRS_THREADS").ok()?.parse().ok())
        .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
        .max(1)
}
