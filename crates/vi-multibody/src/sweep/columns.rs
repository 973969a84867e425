//! The columns of joints ([`crate::pair::columns`]) as the sweeps see them.
//!
//! A joint of several columns is eliminated column by column, the last one first, as if bodies
//! without mass were between them. The columns of a rotation vector are eliminated as a block with
//! row pivoting; the translation of a free body is another.

pub(crate) use crate::pair::columns::{Act, Axis, Column, MotionSubspace as Motion};
