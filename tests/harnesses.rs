//! The tools that judge the integrators are judged themselves: verification and reliability find
//! what is wrong on purpose. So is the text of the sources.
#![allow(clippy::unwrap_used)] // tests

mod comments;
mod reliability;

mod robust {
    mod broken_integrators;
    mod restated_models;
}
