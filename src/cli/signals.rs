//! Ctrl-C and SIGTERM: the first ends a run early with its results, the second skips its figures, the third exits at
//! once.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU8, Ordering};

/// Number of signals received. A process has one signal handler, hence the one static of the program.
static COUNT: AtomicU8 = AtomicU8::new(0);

/// Installs the handler: a signal ends a run early, with the results up to then.
pub fn watch() {
    // Without a handler signals end the program as usual, which is no reason to refuse the run.
    let _ = ctrlc::set_handler(|| {
        let count = COUNT.load(Ordering::Relaxed).saturating_add(1);
        COUNT.store(count, Ordering::Relaxed);
        match count {
            1 if std::io::stderr().is_terminal() => {
                super::files::print_error(
                    "\ninterrupted: writing what is computed (again: without figures; a third time: nothing)",
                );
            }
            1 | 2 => {}
            // The next run into the directory removes the unfinished files.
            _ => std::process::exit(1),
        }
    });
}

/// True if a signal asks for the end of the run; checked after every step.
pub fn interrupted() -> bool {
    COUNT.load(Ordering::Relaxed) > 0
}

/// The signals as hooks of a study.
pub struct Signals;

impl Signals {
    /// Installs the handler, and returns the hooks.
    pub fn watched() -> Self {
        watch();
        Self
    }
}

impl snaprod::study::Hooks for Signals {
    fn interrupted(&mut self) -> bool {
        interrupted()
    }
}

/// True if the program no longer waits for figures.
pub fn hurried() -> bool {
    COUNT.load(Ordering::Relaxed) > 1
}
