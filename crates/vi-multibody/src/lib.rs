//! Rigid multibody systems: kinematic pairs, trees, closed loops.
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![cfg_attr(test, allow(clippy::float_cmp))] // tests compare exactly representable numbers

pub mod articulated;
pub mod closed_loop;
pub mod coordinates;
pub mod form;
pub mod joint;
pub mod map;
pub mod mechanism;
pub mod pair;
pub mod particle;
pub mod reaction;
pub mod run;
pub mod spring;
pub mod tree;

pub use coordinates::JointCoordinates;
pub use joint::{FrameId, Joint, Side};
pub use mechanism::{Description, Mechanism};
pub use pair::PairKind;
pub use reaction::{Reaction, Reactions, Tension};
