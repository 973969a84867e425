//! Consistent initial values, and what the initial configuration says of the constraints.

pub mod agreement;
pub mod initialization;
pub mod nearby;
