//! Consistent initial values, and what the initial configuration says of the constraints.

pub mod agreement;
pub mod closest;
pub mod initialization;
pub mod nearby;
mod start_error;
