//! What sensors see of a node.

/// A node as sensors see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View<'a> {
    /// Time, s.
    pub(crate) t: f64,
    /// `q_n`.
    pub(crate) q: &'a [f64],
    /// `v̂`.
    pub(crate) v: &'a [f64],
    /// `λ_n`; read only by sensors of reactions.
    pub(crate) lambda: &'a [f64],
}
