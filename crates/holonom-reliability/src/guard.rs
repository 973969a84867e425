//! Panics as data: what was said, and where.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    static WATCHED: RefCell<Option<Option<String>>> = const { RefCell::new(None) };
}

/// Runs `f`; a panic becomes the text of its message with its place.
///
/// # Errors
/// The message and the place of a panic.
pub fn guarded<T>(f: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(listen);
    WATCHED.set(Some(None));
    let result = catch_unwind(AssertUnwindSafe(f));
    let said = WATCHED.replace(None).flatten();
    result.map_err(|_| said.unwrap_or_else(|| "a panic without a message".to_owned()))
}

/// From now on panics of guarded calls are remembered and not printed.
fn listen() {
    let before = take_hook();
    set_hook(Box::new(move |info| {
        let watched = WATCHED.with_borrow_mut(|watched| match watched {
            Some(said) => {
                said.get_or_insert_with(|| words(info));
                true
            }
            None => false,
        });
        if !watched {
            before(info);
        }
    }));
}

fn words(info: &PanicHookInfo<'_>) -> String {
    let payload = info.payload();
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    let text = text.unwrap_or("a panic without words");
    let place = info.location().map_or_else(String::new, |at| format!(" ({at})"));
    format!("{text}{place}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_told_with_its_place() {
        assert_eq!(guarded(|| 7), Ok(7));
        let said = guarded(|| -> u8 { panic!("on purpose {}", 1 + 1) }).unwrap_err();
        println!("{said}");
        assert!(said.starts_with("on purpose 2 (") && said.contains("guard.rs"), "{said}");
    }
}
