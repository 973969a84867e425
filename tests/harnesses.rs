//! The verifier is judged itself: it finds what is wrong on purpose. So are the sources and the
//! packages.
#![allow(clippy::unwrap_used)] // tests

mod circles;
mod comments;
mod packages;

mod robust {
    mod broken_integrators;
    mod planted_sources;
}
