//! What the two harnesses of reliability share, and `RELIABILITY.md`.
//!
//! | file | concept |
//! |---|---|
//! | [`guard`] | panics as data |
//! | [`shape`] | kinds of messages |

pub mod guard;
pub mod shape;
