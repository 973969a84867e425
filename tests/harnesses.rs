//! The verifier is judged itself: it finds what is wrong on purpose. So is the text of the sources.
#![allow(clippy::unwrap_used)] // tests

mod comments;

mod robust {
    mod broken_integrators;
}
