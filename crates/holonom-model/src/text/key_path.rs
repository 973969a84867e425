//! The key path of a value while a model text is walked: `body.top.position[0]`.

use std::fmt::{Display, Write};

/// Walks a part of the value at `path`; the path has its end, such as `.mass` or `[2]`, only
/// meanwhile.
pub(crate) fn below(path: &mut String, end: impl Display, walk: impl FnOnce(&mut String)) {
    let length = path.len();
    let _ = write!(path, "{end}"); // a String takes everything
    walk(path);
    path.truncate(length);
}
