//! The types of the model file: one section or key each.

pub(crate) mod beam;
pub(crate) mod body;
pub(crate) mod bushing;
pub(crate) mod columns;
pub(crate) mod connection;
pub(crate) mod contact;
pub(crate) mod control;
pub(crate) mod damping;
pub(crate) mod drive;
pub(crate) mod event;
pub(crate) mod formula_or_table;
pub(crate) mod frame;
pub(crate) mod joint_contact;
pub(crate) mod law;
pub(crate) mod load;
pub(crate) mod motion_path;
pub(crate) mod orientation;
pub(crate) mod outline;
pub(crate) mod reference_frame;
pub(crate) mod section;
pub(crate) mod sensor;
pub(crate) mod settings;
pub(crate) mod shape;
pub(crate) mod signal;
pub(crate) mod station;
pub(crate) mod table;
