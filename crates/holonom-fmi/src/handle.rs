//! An instance as the tool holds it.
//!
//! No panic leaves it: the tool lives in the same process. An instance that panicked answers
//! `Fatal` from then on. Errors always go to the callback of the tool, warnings where it asks for
//! messages.

use holonom_fmu::library::ABORTS;
use holonom_fmu::{Instance, Severity, UnitRefusal};
use std::cell::RefCell;
use std::hint::black_box;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

/// How a call ended, with the numbers of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub(crate) enum CallStatus {
    Ok = 0,
    Warning = 1,
    Discard = 2,
    Error = 3,
    Fatal = 4,
}

/// Gives a message with its status and category to the tool.
pub(crate) type Log = Box<dyn Fn(CallStatus, &str, &str)>;

/// What a call returns.
pub(crate) type CallAnswer = Result<CallStatus, UnitRefusal>;

/// An instance with its messages.
pub(crate) struct Handle {
    pub(crate) instance: Instance,
    log: Log,
    verbose: bool,
    is_dead: bool,
    /// An event of the model has ended the motion.
    pub(crate) is_ended: bool,
    /// Where the motion begins, s; FMI 2.0 says it before the initialization.
    pub(crate) start: f64,
}

thread_local! {
    /// The words of the last panic within a call; `None` outside of calls.
    static CAUGHT: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Panics within calls are not printed, but kept.
fn keep_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            let is_own = CAUGHT.with_borrow_mut(|caught| {
                caught.as_mut().map(|words| *words = info.to_string()).is_some()
            });
            if !is_own {
                usual(info);
            }
        }));
    });
}

/// Calls what may panic; the words of the panic.
fn guarded<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    keep_panics();
    let outer = CAUGHT.replace(Some(String::new()));
    let found = catch_unwind(AssertUnwindSafe(call));
    let words = CAUGHT.replace(outer).unwrap_or_default();
    found.map_err(|_| words)
}

impl Handle {
    /// A new instance; `None` where there can be none, for which `log` gets the reason.
    pub(crate) fn new(
        make: impl FnOnce() -> Result<Instance, String>,
        log: Log,
        verbose: bool,
    ) -> Option<Self> {
        // the mark is read where it stands, so that it stands in the library
        if black_box(crate::MARK).ends_with(ABORTS) {
            let words =
                "this library ends the process at a panic: build it with the profile `unwinding`";
            log(CallStatus::Error, ERROR, words);
            return None;
        }
        match guarded(make).unwrap_or_else(|words| Err(internal(&words))) {
            Ok(instance) => {
                let (is_dead, is_ended, start) = (false, false, 0.0);
                Some(Self { instance, log, verbose, is_dead, is_ended, start })
            }
            Err(words) => {
                log(CallStatus::Error, ERROR, &words);
                None
            }
        }
    }

    /// Whether warnings are given to the tool.
    pub(crate) fn set_verbose(&mut self, verbose: bool) {
        self.verbose = verbose;
    }

    /// Gives a warning to the tool.
    pub(crate) fn warn(&self, words: &str) -> CallStatus {
        if self.verbose {
            (self.log)(CallStatus::Warning, WARNING, words);
        }
        CallStatus::Warning
    }

    /// Does a call.
    pub(crate) fn call(&mut self, call: impl FnOnce(&mut Self) -> CallAnswer) -> CallStatus {
        if self.is_dead {
            return CallStatus::Fatal;
        }
        let answer = guarded(|| call(self));
        let (status, words) = match answer {
            Ok(Ok(status)) => return status,
            Ok(Err(UnitRefusal { severity: Severity::Discard, message })) => {
                (CallStatus::Discard, message)
            }
            Ok(Err(UnitRefusal { severity: Severity::Error, message })) => {
                (CallStatus::Error, message)
            }
            Err(words) => {
                self.is_dead = true;
                (CallStatus::Fatal, internal(&words))
            }
        };
        (self.log)(status, ERROR, &words);
        status
    }
}

/// Categories of messages.
const ERROR: &str = holonom_fmu::description::CATEGORIES[0].0;
const WARNING: &str = holonom_fmu::description::CATEGORIES[1].0;

fn internal(words: &str) -> String {
    format!("an error within holonom: {words}; please report it with the model")
}

/// A refusal without effect.
pub(crate) fn refused(message: impl Into<String>) -> UnitRefusal {
    UnitRefusal { severity: Severity::Error, message: message.into() }
}

/// A null pointer where there must be none.
pub(crate) fn null() -> UnitRefusal {
    refused("a pointer is null")
}

/// A function of the standard that units of holonom do not have.
pub(crate) fn absent(function: &str) -> CallAnswer {
    Err(refused(format!("{function}: the unit has nothing of the kind, see its model description")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    fn handle(name: &str, said: &Arc<Mutex<Vec<String>>>) -> Handle {
        let name = format!("holonom-fmi-{name}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        let text = "model = { name = \"pendulum\", dimension = 2, gravity = [0.0, -9.81] }\n\
                    particle = [{ name = \"bob\", mass = 1.0, position = [1.0, 0.0] }]\n\
                    bar = [{ name = \"rod\", from = \"ground\", to = \"bob\" }]\n\
                    simulation = { step = 0.01, end = 1.0 }\n";
        std::fs::write(folder.join("model.toml"), text).unwrap();
        let stored = r#"{"set": [], "inputs": [], "parameters": [], "meshes": []}"#;
        std::fs::write(folder.join("interface.json"), stored).unwrap();
        let resources = holonom_fmu::Resources::read(&folder).unwrap();
        let token = resources.token(&resources.interface().unwrap().1);
        let said = said.clone();
        let log: Log = Box::new(move |status, category, words| {
            said.lock().unwrap().push(format!("{status:?} {category} {words}"));
        });
        let made = Handle::new(|| Instance::new(&folder, &token), log, false).unwrap();
        std::fs::remove_dir_all(&folder).unwrap(); // all is read
        made
    }

    #[test]
    fn a_panic_becomes_a_status_and_ends_the_instance() {
        let said = Arc::default();
        let mut handle = handle("panic", &said);
        let list: Vec<usize> = Vec::new();
        let status = handle.call(|_| Err(refused(list[3].to_string())));
        assert_eq!(status, CallStatus::Fatal);
        let words = said.lock().unwrap().join("\n");
        assert!(words.starts_with("Fatal logStatusError an error within holonom: "), "{words}");
        assert!(words.contains("index out of bounds"), "{words}");
        assert_eq!(handle.call(|_| Ok(CallStatus::Ok)), CallStatus::Fatal);
        // another one lives
        assert_eq!(self::handle("other", &said).call(|_| Ok(CallStatus::Ok)), CallStatus::Ok);
    }

    #[test]
    fn warnings_are_given_where_they_are_asked_for() {
        let said = Arc::default();
        let mut handle = handle("warnings", &said);
        handle.warn("a");
        handle.set_verbose(true);
        handle.warn("b");
        assert_eq!(*said.lock().unwrap(), ["Warning logStatusWarning b"]);
    }
}
