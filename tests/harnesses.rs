//! The tools that judge the integrators are judged themselves: verification and reliability find
//! what is wrong on purpose.
#![allow(clippy::unwrap_used)] // tests

mod reliability;

mod robust {
    mod broken_integrators;
    mod restated_models;
}
