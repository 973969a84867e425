//! The rows of `G`: which of them are independent, systems over them, multipliers.

pub(crate) mod choice;
pub mod connected;
pub(crate) mod independent_rows;
pub mod least_norm;
mod normal_matrix;
pub mod redundancy;
pub mod saddle_point;
pub mod unit_rows;
