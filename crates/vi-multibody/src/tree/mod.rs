//! Trees of frames: velocity map, null space operators and reparametrization by sweeps.
//!
//! ```text
//! t_α = X_α t_parent + S_α τ_α          root → leaf:   P ν
//! b_parent += X_αᵀ b_α,  r_α = S_αᵀ b_α     leaf → root:   Pᵀ w  with b_α = P_in(q)ᵀ w_α
//! F_d: pair maps, root first             LMO08 (76)–(86)
//! ```
//! The links are stored root first, so a sweep is a loop over an array. `P` is never formed.
//!
//! Source: LMO08 §5; sweeps after Featherstone, Rigid Body Dynamics Algorithms, §5.

pub(crate) mod maps;
pub mod particle;

use crate::pair::joint::{FrameId, GROUND, Joint, JointConfiguration};
use crate::pair::{FrameMotion, Twist, VelocityMap};
use nalgebra::{DMatrix, Vector3};
use vi_core::coordinate_force::SignedUnknown;
use vi_core::interval::Interval;
use vi_core::newton::{BlockKind, Fault, UnknownBlock};
use vi_rigid::{directors, null_space, reparametrization, rotation};

/// Round-off that is left in relative attitudes, and in gaps relative to their size.
pub(crate) const SLACK: f64 = 8.0 * f64::EPSILON;

/// Increments below this, m or rad, do not matter in any configuration.
pub(crate) const FLOOR: f64 = 1e-6;

/// A frame of the tree with its inboard joint.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeLink {
    /// The frame; its coordinates start at `12 frame`.
    pub frame: usize,
    /// Index of the parent link; `None`: the ground, or a free root.
    pub parent: Option<usize>,
    /// The joint, oriented from the parent to this frame; free roots have a free joint to the
    /// ground.
    pub joint: Joint,
    /// First unknown of its joint among `u`.
    pub offset: usize,
}

impl TreeLink {
    /// Number of its degrees of freedom.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.joint.kind.dof()
    }

    fn coordinates<'a>(&self, q: &'a [f64]) -> &'a [f64] {
        &q[12 * self.frame..12 * self.frame + 12]
    }
}

/// A forest of frames, root first.
#[derive(Clone, Debug, PartialEq)]
pub struct Tree {
    links: Vec<TreeLink>,
    link_of: Vec<usize>, // of each frame
    dof: usize,
}

impl Tree {
    /// From links in an order in which parents precede their children, one for each frame; offsets
    /// are assigned here.
    ///
    /// # Panics
    /// When a parent does not precede its child, or frames are not numbered from 0 on.
    #[must_use]
    pub fn new(mut links: Vec<TreeLink>) -> Self {
        let (mut dof, mut link_of) = (0, vec![0; links.len()]);
        for (k, link) in links.iter_mut().enumerate() {
            assert!(link.parent.is_none_or(|p| p < k), "parents precede their children");
            link_of[link.frame] = k;
            link.offset = dof;
            dof += link.joint.kind.dof();
        }
        Self { links, link_of, dof }
    }

    /// The links, root first.
    #[must_use]
    pub fn links(&self) -> &[TreeLink] {
        &self.links
    }

    /// The links by frame: where the link of each frame stands among [`Tree::links`].
    #[must_use]
    pub fn link_of(&self) -> &[usize] {
        &self.link_of
    }

    /// The unknown that coordinate `freedom` of a joint is, up to its sign; `None` where the joint
    /// is not in the tree, or axes that turn with the child measure the coordinate.
    #[must_use]
    pub fn unknown_of(&self, joint: &Joint, freedom: usize) -> Option<SignedUnknown> {
        let link = |frame| match frame {
            FrameId::Frame(k) => Some(&self.links[self.link_of[k]]),
            FrameId::Ground => None,
        };
        if let Some(link) = link(joint.child.frame).filter(|link| link.joint == *joint) {
            return Some(SignedUnknown { index: link.offset + freedom, sign: 1.0 });
        }
        let reversed = joint.reversed();
        let link = link(joint.parent.frame).filter(|link| link.joint == reversed)?;
        let column = joint.kind.properties().motion.reversed(freedom)?;
        Some(SignedUnknown { index: link.offset + column, sign: -1.0 })
    }

    /// Degrees of freedom of the tree.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Units and scales of the increments.
    #[must_use]
    pub fn blocks(&self) -> Vec<UnknownBlock> {
        let mut blocks: Vec<UnknownBlock> = Vec::new();
        for link in &self.links {
            for k in 0..link.dof() {
                let angle = link.joint.kind.is_angle(k);
                let kind = if angle { BlockKind::Rotation } else { BlockKind::Position };
                let at = link.offset + k;
                match blocks.last_mut() {
                    Some(last) if last.kind == kind && last.range.end == at => last.range.end += 1,
                    _ => blocks.push(UnknownBlock { kind, range: at..at + 1, floor: FLOOR }),
                }
            }
        }
        blocks
    }

    /// The configuration of a link's joint at `q`.
    #[must_use]
    #[inline]
    pub fn configuration<'a>(&self, link: &'a TreeLink, q: &'a [f64]) -> JointConfiguration<'a> {
        let parent = link.parent.map_or(&GROUND[..], |p| self.links[p].coordinates(q));
        JointConfiguration::new(&link.joint, parent, link.coordinates(q))
    }

    /// `maps ← X_α, S_α` at `q`.
    pub fn velocity_maps<'m>(
        &self,
        q: &[f64],
        maps: impl IntoIterator<Item = &'m mut VelocityMap>,
    ) {
        for (link, map) in self.links.iter().zip(maps) {
            link.joint.kind.write_velocity_map(&self.configuration(link, q), map);
        }
    }

    /// `maps ← X'_α, S'_α` at `q_{n+1}`, with the tangent maps of the increments `u`.
    pub fn tangents<'m>(
        &self,
        u: &[f64],
        q: &[f64],
        maps: impl IntoIterator<Item = &'m mut VelocityMap>,
    ) {
        for (link, map) in self.links.iter().zip(maps) {
            let own = &u[link.offset..link.offset + link.dof()];
            link.joint.kind.write_tangent(own, &self.configuration(link, q), map);
        }
    }

    /// Twists of all links from joint rates: `P_ex ν`.
    pub fn push_forward(&self, maps: &[VelocityMap], nu: &[f64], twists: &mut [Twist]) {
        for (k, (link, map)) in self.links.iter().zip(maps).enumerate() {
            // (71), (75)
            let mut twist = link.parent.map_or(Twist::zero(), |p| map.transfer.apply(&twists[p]));
            for (column, rate) in map.columns().iter().zip(&nu[link.offset..]) {
                twist.linear += *rate * column.linear;
                twist.angular += *rate * column.angular;
            }
            twists[k] = twist;
        }
    }

    /// `out ← P_in(q) P_ex` with the velocity map of each link, a sweep for each column; `nu` and
    /// `twists` are scratch.
    pub fn write_null_space(
        &self,
        maps: &[VelocityMap],
        q: &[f64],
        nu: &mut [f64],
        twists: &mut [Twist],
        out: &mut DMatrix<f64>,
    ) {
        for (k, mut column) in out.column_iter_mut().take(self.dof).enumerate() {
            nu.fill(0.0);
            nu[k] = 1.0;
            self.push_forward(maps, nu, twists);
            for (link, twist) in self.links.iter().zip(&*twists) {
                let own = &mut column.as_mut_slice()[12 * link.frame..12 * link.frame + 12];
                null_space::push_forward(link.coordinates(q), &twist.to_vector(), own);
            }
        }
    }

    /// `out ← P_exᵀ P_in(q)ᵀ w` with the velocity map of each link; `wrenches` holds `b` of the
    /// links.
    pub fn pull_back<'m>(
        &self,
        map_of: impl Fn(usize) -> &'m VelocityMap,
        q: &[f64],
        w: &[f64],
        wrenches: &mut [Twist],
        out: &mut [f64],
    ) {
        wrenches.fill(Twist::zero());
        for (k, link) in self.links.iter().enumerate().rev() {
            let own = null_space::pull_back(link.coordinates(q), link.coordinates(w));
            let (mut wrench, map) = (wrenches[k], map_of(k));
            wrench.add_scaled(1.0, &Twist::from_vector(&own));
            for (column, r) in map.columns().iter().zip(&mut out[link.offset..]) {
                *r = column.dot(&wrench);
            }
            if let Some(parent) = link.parent {
                wrenches[parent].add_scaled(1.0, &map.transfer.apply_transposed(&wrench));
            }
        }
    }

    /// `F_d(u, q_n)`: writes the frames of the tree in `s.q1` and `s.dq`.
    ///
    /// # Errors
    /// [`Fault::OutsideChart`], [`Fault::NotFinite`].
    pub fn reparametrize(
        &self,
        u: &[f64],
        s: &mut Interval,
        motions: &mut [FrameMotion],
    ) -> Result<(), Fault> {
        for (k, link) in self.links.iter().enumerate() {
            let at = self.configuration(link, &s.q0);
            let parent = link.parent.map_or(FrameMotion::rest(), |p| motions[p]);
            let own = &u[link.offset..link.offset + link.dof()];
            if own.iter().any(|u| !u.is_finite()) {
                return Err(Fault::NotFinite);
            }
            let motion = link.joint.kind.reparametrize(own, &parent, &at).map_err(|too_large| {
                let unknown = link.offset + too_large.index;
                Fault::OutsideChart { kind: BlockKind::Rotation, unknown, size: too_large.angle }
            })?;
            motions[k] = motion; // (76)
            let turn = |i: usize| -> [f64; 3] {
                let own = &s.q0[12 * link.frame..12 * link.frame + 12];
                (motion.rotation_minus_identity * directors::director(own, i)).into()
            };
            let turns = [turn(0), turn(1), turn(2)];
            self.move_link(k, &motion.translation.into(), &turns, s);
        }
        Ok(())
    }

    /// Moves the frame of link `k` by `Δφ` and `Δd_I`, after its parent, in `s.q1` and `s.dq`.
    pub(crate) fn move_link(&self, k: usize, x: &[f64; 3], d: &[[f64; 3]; 3], s: &mut Interval) {
        let link = &self.links[k];
        let (at, closes_gap) = (12 * link.frame, link.joint.kind.closes_gap());
        for i in 0..3 {
            if closes_gap {
                s.dq[at + i] = x[i];
                s.q1[at + i] = s.q0[at + i] + x[i]; // nothing adds up there
            } else {
                s.increment(at + i, x[i]);
            }
        }
        for (j, d) in d.iter().enumerate() {
            (0..3).for_each(|i| s.increment(at + 3 + 3 * j + i, d[i]));
        }
        // where the pair has no gap, round-off of it is removed in every step
        if closes_gap {
            let closure = link.joint.kind.gap_correction(&self.configuration(link, &s.q1));
            for i in 0..3 {
                s.q1[at + i] += closure[i];
            }
        }
    }

    /// `u ←` the increment of `first` and then `u`: rotation vectors are composed, the rest is
    /// added.
    pub(crate) fn compose(&self, first: &[f64], u: &mut [f64]) {
        let vector = |u: &[f64], at: usize| Vector3::new(u[at], u[at + 1], u[at + 2]);
        for link in &self.links {
            let turning = link.joint.kind.rotation_vector().map(|k| link.offset + k);
            for at in link.offset..turning.unwrap_or(link.offset + link.dof()) {
                u[at] += first[at];
            }
            if let Some(at) = turning {
                let turn = rotation::composed(&vector(first, at), &vector(u, at));
                u[at..at + 3].copy_from_slice(turn.as_slice());
            }
        }
    }

    /// Removes accumulated round-off from directors and of what C, P, E and the axes transport,
    /// root first, where it has passed a few ulp.
    pub fn clean(&self, q: &mut [f64]) {
        self.links.iter().for_each(|link| {
            self.clean_link(link, q);
        });
    }

    /// [`Tree::clean`] of one link; whether anything has changed.
    pub(crate) fn clean_link(&self, link: &TreeLink, q: &mut [f64]) -> bool {
        let own = 12 * link.frame..12 * link.frame + 12;
        let mut changed = reparametrization::clean_directors(&mut q[own.clone()]);
        let at = self.configuration(link, q);
        let turn = link.joint.kind.attitude_correction(&at);
        if turn.amax() > SLACK {
            let triad = directors::triad(&q[own.clone()]);
            directors::set_triad(&mut q[own.clone()], &(rotation::exp(&turn) * triad));
            reparametrization::clean_directors(&mut q[own.clone()]);
            changed = true;
        }
        let at = self.configuration(link, q);
        let shift = link.joint.kind.gap_correction(&at);
        if shift.amax() > SLACK * (1.0 + at.c().amax()) {
            for i in 0..3 {
                q[own.start + i] += shift[i];
            }
            changed = true;
        }
        changed
    }

    /// The link that owns an unknown, which is its degree of freedom `unknown − offset`.
    #[must_use]
    pub fn owner(&self, unknown: usize) -> Option<&TreeLink> {
        let k = self.links.partition_point(|link| link.offset <= unknown);
        let link = self.links[..k].iter().rev().find(|link| link.dof() > 0)?;
        (unknown < link.offset + link.dof()).then_some(link)
    }
}
