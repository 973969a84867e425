//! Signals that ask for the end of a run.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::captured::{self, Patience};

/// What was received since the program began to watch.
pub(crate) struct ReceivedSignals {
    caught: Arc<AtomicUsize>,
    patience: Option<Patience>,
}

impl ReceivedSignals {
    /// From now on SIGINT and SIGTERM are remembered; a second SIGINT ends the program at once. A
    /// file that exceeds the limit of its size is an error of the file, not the end of the program.
    ///
    /// A captured call hears no signals: it is interrupted when its patience ends.
    pub(crate) fn watch() -> Self {
        let patience = captured::patience();
        if patience.is_some() {
            return Self { caught: Arc::default(), patience };
        }
        let (caught, pressed) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicBool::new(false)));
        // where one cannot be registered it ends the program, as without this
        let _ = flag::register_conditional_shutdown(SIGINT, 128 + SIGINT, Arc::clone(&pressed));
        let _ = flag::register(SIGINT, pressed);
        for signal in [SIGINT, SIGTERM] {
            let _ = flag::register_usize(signal, Arc::clone(&caught), signal as usize);
        }
        #[cfg(unix)]
        let _ = flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
        Self { caught, patience }
    }

    /// The signal that was received last.
    pub(crate) fn caught(&self) -> Option<u8> {
        if self.patience.as_ref().is_some_and(Patience::ends) {
            self.caught.store(SIGTERM as usize, Ordering::Relaxed);
        }
        u8::try_from(self.caught.load(Ordering::Relaxed)).ok().filter(|signal| *signal > 0)
    }
}
