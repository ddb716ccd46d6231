//! A way out of a long step: a hook of the caller's, asked now and then whether to stop.

use std::time::{Duration, Instant};

/// How often the hook is asked; looks between cost the reading of a clock.
pub const INTERVAL: Duration = Duration::from_millis(50);

/// Asked whether to stop.
pub type Hook = Box<dyn FnMut() -> bool + Send + Sync>;

/// Whether the step at hand is to be given up.
///
/// Once the hook has said so every further question is answered alike, so that all loops of a step end one after another;
/// the next step starts anew.
#[derive(Default)]
pub struct Interrupt {
    hook: Option<Hook>,
    asked: Option<Instant>,
    stopped: bool,
}

impl Interrupt {
    /// Sets the hook; `None` lets steps run to their end.
    pub fn set(&mut self, hook: Option<Hook>) {
        *self = Self { hook, ..Self::default() };
    }

    /// Forgets what an earlier step was told.
    pub(crate) fn begin(&mut self) {
        self.stopped = false;
    }

    /// Whether to stop, by asking the hook if it has not been asked for a while.
    pub(crate) fn requested(&mut self) -> bool {
        let Some(hook) = self.hook.as_mut().filter(|_| !self.stopped) else { return self.stopped };
        let now = Instant::now();
        if self.asked.is_none_or(|asked| now - asked >= INTERVAL) {
            self.asked = Some(now);
            self.stopped = hook();
        }
        self.stopped
    }

    /// Whether the hook has said so since [`Self::begin`].
    pub(crate) fn stopped(&self) -> bool {
        self.stopped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hook_is_asked_once_an_interval_and_its_yes_lasts() {
        let mut interrupt = Interrupt::default();
        assert!(!interrupt.requested());
        let mut asked = 0;
        interrupt.set(Some(Box::new(move || {
            asked += 1;
            asked == 2
        })));
        assert!(!interrupt.requested() && !interrupt.requested() && !interrupt.stopped());
        std::thread::sleep(INTERVAL);
        assert!(interrupt.requested() && interrupt.requested() && interrupt.stopped());
        interrupt.begin();
        assert!(!interrupt.stopped());
    }
}
