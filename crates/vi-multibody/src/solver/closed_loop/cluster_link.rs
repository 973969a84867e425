//! The links of a cluster of loops.

/// A link of a cluster.
#[derive(Clone, Copy)]
pub(crate) struct ClusterLink {
    /// The link of the tree.
    pub(crate) link: usize,
    /// Its parent in the cluster; `None`: the apex.
    pub(crate) parent: Option<usize>,
    /// Its first column in the cluster.
    pub(crate) first: usize,
    /// Its first unknown in the tree.
    pub(crate) offset: usize,
    /// Number of its degrees of freedom.
    pub(crate) dof: usize,
}

impl ClusterLink {
    /// Its columns in the cluster.
    #[inline(always)]
    pub(crate) fn columns(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.dof
    }
}
