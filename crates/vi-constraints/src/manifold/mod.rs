//! The constraint manifold `g(q) = 0`: its tangent space `P`, and steps along it, `F_d`.

pub mod null_space;
pub mod reparametrization;
pub mod tangent_space;
