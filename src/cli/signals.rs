//! Ctrl-C and SIGTERM: the first ends a run with what it has, the second skips its figures, the third leaves at once.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU8, Ordering};

/// How many signals came. A process has one signal handler, hence the one static of the program.
static COUNT: AtomicU8 = AtomicU8::new(0);

/// Makes the signals end a run with what it has.
pub fn watch() {
    // Without a handler they end the program as usual: no reason to refuse the run.
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
            // Whatever was written aside is cleaned away by the next run into the directory.
            _ => std::process::exit(1),
        }
    });
}

/// True if the run is to end with what it has; runs look at it after every step.
pub fn interrupted() -> bool {
    COUNT.load(Ordering::Relaxed) > 0
}

/// The signals as hooks of a study.
pub struct Signals;

impl Signals {
    /// Makes the signals end a study with what it has.
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

/// True if figures are not waited for any longer.
pub fn hurried() -> bool {
    COUNT.load(Ordering::Relaxed) > 1
}
