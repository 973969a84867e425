//! All links of a tree, and the sweeps over them in the registers of this processor.

use super::emitted::{self, Emitted};
use crate::geometry::matrix::Spatial;
use crate::geometry::one_tree::{HeldVector, Narrow, One, OneTree, Width, sweep};
use crate::mechanism::Mechanism;
use crate::sweep::advance::{self, Seen, Turn};
use crate::sweep::columns::Motion;
use crate::sweep::costate::{self, Pulled};
use crate::sweep::coupled::{self, Couplings};
use crate::sweep::eliminate::{self, UpToApex};
use crate::sweep::finish::{self, Next, StepEnds};
use crate::sweep::link::{self, ColumnWork, Gain, Link, Sums, Work};
use crate::sweep::{moved_joints, open, pull_back, substitute, velocity};
use crate::tree::Tree;
use nalgebra::Matrix4;
use std::ops::Range;
use vi_core::SeparableSystem;
use vi_core::interval::{Interval, IntervalParts};
use vi_core::newton::Fault;
use vi_core::state::State;
use vi_rigid::rotation::MAX_ROTATION;

/// What the sweeps of [`super::TreeStep`] read and write.
#[derive(Debug)]
pub(in crate::solver) struct Workspace {
    pub(in crate::solver) links: Vec<Link<One>>,
    pub(in crate::solver) works: Vec<Work<One>>,
    pub(in crate::solver) columns: Vec<ColumnWork<One>>, // d  of joints of several columns
    pub(super) turns: Vec<Turn<f64>>,                    // d
    pub(in crate::solver) gains: Vec<Gain<One>>,
    pub(super) sums: Vec<Sums<One>>,
    pub(in crate::solver) part: UpToApex<One>,
    couplings: Option<Couplings<One>>, // of links with their parents
}

impl Workspace {
    /// `None` where a pair, or the mass of a body, is of another kind.
    pub(in crate::solver) fn new(mechanism: &Mechanism, system: &SeparableSystem) -> Option<Self> {
        Some(Self::of(link::constants(mechanism, system)?, mechanism.tree().dof()))
    }

    /// Of links without mass, for matrices over the coordinates; `None` where a pair is of another
    /// kind.
    pub(in crate::solver) fn massless(tree: &Tree) -> Option<Self> {
        let masses = vec![Matrix4::zeros(); tree.links().len()];
        Some(Self::of(link::constants_with(tree, &masses)?, tree.dof()))
    }

    fn of((links, slots): (Vec<Link<One>>, usize), d: usize) -> Self {
        let (count, s) = (links.len(), OneTree(Narrow));
        let several = links.iter().any(|link| matches!(link.motion, Motion::Several(_)));
        Self {
            links,
            works: vec![Work::zero(s); count],
            columns: vec![ColumnWork::zero(s); if several { d } else { 0 }],
            turns: vec![Turn::by(s, 0.0); d],
            gains: vec![Gain::<One>::default(); count],
            sums: vec![Sums::zero(s); slots],
            part: UpToApex::new(s),
            couplings: None,
        }
    }

    /// From now on links are coupled with their parents.
    pub(in crate::solver) fn couple_links(&mut self) {
        let (links, unknowns) = (self.links.len(), self.turns.len());
        self.couplings = Some(Couplings::new(OneTree(Narrow), links, unknowns));
    }

    /// Takes what is emitted along unknowns and between links and their parents.
    pub(in crate::solver) fn take(&mut self, emitted: &Emitted, ends: [&[f64]; 2]) {
        let Self { links, works, columns, couplings, .. } = self;
        for (link, work) in links.iter().zip(works) {
            for unknown in link.unknown..link.unknown + link.motion.columns().len() {
                link::column_mut(link, work, columns, unknown).slope = emitted.along[unknown];
            }
        }
        if let Some(couplings) = couplings {
            emitted.write_couplings(links, ends, &mut couplings.links);
        }
    }

    /// `r ← P(q_n)ᵀ w`.
    pub(in crate::solver) fn pull_back_of(&mut self, q: &[f64], w: &[f64], r: &mut [f64]) {
        for (link, work) in self.links.iter().zip(&mut self.works) {
            work.wrench = emitted::wrench(link, q, w).held();
        }
        self.pull_back(r);
    }

    /// Eliminates and substitutes all links, with what is `added` to their blocks.
    pub(in crate::solver) fn solve(
        &mut self,
        added: &[Spatial<HeldVector>],
        u: &[f64],
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let all = 0..self.links.len();
        let Self { links, works, columns, gains, couplings, .. } = self;
        let Some(couplings) = couplings else {
            self.eliminate(all.clone(), added, x)?;
            self.substitute(all, u, x);
            return Ok(());
        };
        let pivots = eliminate_coupled(links, works, (columns, gains), (couplings, added), x);
        follow_coupled(links, works, (columns, gains), couplings, u, x);
        if pivots.is_finite() { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    /// [`open::open`].
    pub(in crate::solver) fn open(&mut self, at: [&[f64]; 3]) {
        open_links(&self.links, &mut self.works, &mut self.columns, at);
    }

    /// [`advance::advance`].
    pub(in crate::solver) fn advance(&mut self, u: &[f64], h: Option<f64>) -> Result<(), Fault> {
        let Self { links, works, columns, turns, .. } = self;
        let seen = advance_links(links, works, (columns, turns), u, h);
        let is_small = seen.rotation <= MAX_ROTATION * MAX_ROTATION;
        if is_small && seen.finite.is_finite() { Ok(()) } else { refuse(&self.links, u) }
    }

    /// [`pull_back::pull_back`].
    pub(in crate::solver) fn pull_back(&mut self, r: &mut [f64]) {
        pull_back_links(&self.links, &mut self.works, &self.columns, r);
    }

    /// [`eliminate::eliminate`] of a range of links, with what is `added` to their blocks.
    pub(in crate::solver) fn eliminate(
        &mut self,
        range: Range<usize>,
        added: &[Spatial<HeldVector>],
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { links, works, columns, gains, sums, part, .. } = self;
        part.links = range;
        let pivots = eliminate_links(links, works, (columns, gains), (sums, added, part), x);
        if pivots.is_finite() { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    /// [`substitute::substitute`] of a range of links; their largest rotation, rad.
    pub(in crate::solver) fn substitute(
        &mut self,
        range: Range<usize>,
        u: &[f64],
        x: &mut [f64],
    ) -> f64 {
        let Self { links, works, columns, gains, .. } = self;
        substitute_links((links, range), works, (columns, gains), u, x).sqrt()
    }

    /// The column of an unknown of a link.
    pub(in crate::solver) fn column_mut(
        &mut self,
        link: usize,
        unknown: usize,
    ) -> &mut ColumnWork<One> {
        link::column_mut(&self.links[link], &mut self.works[link], &mut self.columns, unknown)
    }

    /// [`finish::close`] of an interval.
    pub(in crate::solver) fn close(&self, s: &mut Interval) {
        close_links(&self.links, &self.works, s);
    }

    /// [`finish::finish`]; whether each link was as it should be.
    pub(super) fn finish(
        &mut self,
        tree: &Tree,
        impulse: Option<&[f64]>,
        s: &mut Interval,
        state: &mut State,
    ) -> bool {
        finish_links(&self.links, &mut self.works, tree, impulse, s, state)
    }

    /// [`open::open_back`].
    pub(in crate::solver) fn open_back(&mut self, ends: [&[f64]; 2]) {
        open_links_back(&self.links, &mut self.works, &mut self.columns, ends);
    }

    /// [`costate::release`].
    pub(in crate::solver) fn release_unknowns(&mut self) {
        costate::release(OneTree(Narrow), &mut self.works, &mut self.columns);
    }

    /// `r ← P(q_{n+1})ᵀ c` of the costates `a'`, `b'` ([`costate::weigh`]).
    pub(in crate::solver) fn weigh(&mut self, s: &Interval, a: &[f64], b: &[f64], r: &mut [f64]) {
        weigh_links(&self.links, &mut self.works, 1.0 / s.h, [&s.q1, a, b]);
        self.pull_back(r);
    }

    /// [`costate::pull`] at `q` with `w` and `m`; `a`, `b`, `μ`; `rate`: `1/h`, 0 without inertia.
    pub(in crate::solver) fn pull(
        &mut self,
        q: &[f64],
        rate: f64,
        w: &[f64],
        m: &[f64],
        [a, b, mu]: [&mut [f64]; 3],
    ) {
        let pulled = Pulled { a, b, mu };
        pull_links(&self.links, &mut self.works, rate, ([q, w], m), pulled);
    }

    /// [`moved_joints::at_start`] with `m`, after [`Workspace::pull`].
    pub(in crate::solver) fn moved_at_start(&self, q: &[f64], m: &[f64], out: &mut [f64]) {
        moved_at_start(&self.links, &self.works, [q, m], out);
    }

    /// [`moved_joints::at_end`] at `q` with what is not inertia of `c − Aᵀ μ`, `b'` and `μ`.
    pub(in crate::solver) fn moved_at_end(
        &mut self,
        q: &[f64],
        rate: f64,
        [c, b, mu]: [&[f64]; 3],
        out: &mut [f64],
    ) {
        moved_at_end(&self.links, &mut self.works, rate, [q, c, b, mu], out);
    }

    /// [`velocity::push_forward`].
    pub(in crate::solver) fn push_forward(&self, q: &[f64], v: &mut [f64]) {
        push_forward_links(&self.links, &self.works, q, v);
    }
}

/// The increment that is no number, or a rotation of more than half a revolution.
#[cold]
fn refuse(links: &[Link<One>], u: &[f64]) -> Result<(), Fault> {
    if u.iter().any(|u| !u.is_finite()) {
        return Err(Fault::NotFinite);
    }
    let check = |link: &Link<One>| {
        advance::check_rotations(link.motion, link.unknown, |k| u[link.unknown + k])
    };
    links.iter().try_for_each(check)
}

sweep! {
    open_links = sweep_open(
        links: &'a [Link<One>], works: &'a mut [Work<One>], columns: &'a mut [ColumnWork<One>],
        at: [&'a [f64]; 3]
    ) -> ()
}
use open::open as sweep_open;

sweep! {
    advance_links = sweep_advance(
        links: &'a [Link<One>], works: &'a mut [Work<One>],
        joints: (&'a mut [ColumnWork<One>], &'a mut [Turn<f64>]), u: &'a [f64], h: Option<f64>
    ) -> Seen<f64>
}
use advance::advance as sweep_advance;

sweep! {
    pull_back_links = sweep_pull_back(
        links: &'a [Link<One>], works: &'a mut [Work<One>], columns: &'a [ColumnWork<One>],
        r: &'a mut [f64]
    ) -> ()
}
use pull_back::pull_back as sweep_pull_back;

sweep! {
    eliminate_links = sweep_eliminate(
        links: &'a [Link<One>], works: &'a mut [Work<One>],
        joints: (&'a mut [ColumnWork<One>], &'a mut [Gain<One>]),
        more: (&'a mut [Sums<One>], &'a [Spatial<HeldVector>], &'a mut UpToApex<One>), x: &'a mut [f64]
    ) -> f64
}
use eliminate::eliminate as sweep_eliminate;

sweep! {
    substitute_links = sweep_substitute(
        links: (&'a [Link<One>], Range<usize>), works: &'a mut [Work<One>],
        joints: (&'a [ColumnWork<One>], &'a [Gain<One>]), u: &'a [f64], x: &'a mut [f64]
    ) -> f64
}
use substitute::substitute as sweep_substitute;

sweep! {
    eliminate_coupled = sweep_eliminate_coupled(
        links: &'a [Link<One>], works: &'a mut [Work<One>],
        joints: (&'a mut [ColumnWork<One>], &'a mut [Gain<One>]),
        more: (&'a mut Couplings<One>, &'a [Spatial<HeldVector>]), x: &'a mut [f64]
    ) -> f64
}
use coupled::eliminate as sweep_eliminate_coupled;

sweep! {
    follow_coupled = sweep_follow_coupled(
        links: &'a [Link<One>], works: &'a mut [Work<One>],
        joints: (&'a [ColumnWork<One>], &'a [Gain<One>]), couplings: &'a Couplings<One>,
        u: &'a [f64], x: &'a mut [f64]
    ) -> ()
}
use coupled::follow as sweep_follow_coupled;

sweep! {
    open_links_back = sweep_open_back(
        links: &'a [Link<One>], works: &'a mut [Work<One>], columns: &'a mut [ColumnWork<One>],
        ends: [&'a [f64]; 2]
    ) -> ()
}
use open::open_back as sweep_open_back;

sweep! {
    weigh_links = sweep_weigh(
        links: &'a [Link<One>], works: &'a mut [Work<One>], rate: f64, at: [&'a [f64]; 3]
    ) -> ()
}
use costate::weigh as sweep_weigh;

sweep! {
    pull_links = sweep_pull(
        links: &'a [Link<One>], works: &'a mut [Work<One>], rate: f64,
        at: ([&'a [f64]; 2], &'a [f64]), out: Pulled<'a, f64>
    ) -> ()
}
use costate::pull as sweep_pull;

sweep! {
    moved_at_start = sweep_moved_at_start(
        links: &'a [Link<One>], works: &'a [Work<One>], at: [&'a [f64]; 2], out: &'a mut [f64]
    ) -> ()
}
use moved_joints::at_start as sweep_moved_at_start;

sweep! {
    moved_at_end = sweep_moved_at_end(
        links: &'a [Link<One>], works: &'a mut [Work<One>], rate: f64, at: [&'a [f64]; 4],
        out: &'a mut [f64]
    ) -> ()
}
use moved_joints::at_end as sweep_moved_at_end;

sweep! {
    push_forward_links = sweep_push_forward(
        links: &'a [Link<One>], works: &'a [Work<One>], q: &'a [f64], v: &'a mut [f64]
    ) -> ()
}
use velocity::push_forward as sweep_push_forward;

sweep! {
    close_links = sweep_close(links: &'a [Link<One>], works: &'a [Work<One>], s: &'a mut Interval) -> ()
}

#[inline(always)]
fn sweep_close<W: Width>(
    s: OneTree<W>,
    links: &[Link<One>],
    works: &[Work<One>],
    at: &mut Interval,
) {
    finish::close(s, links, works, ends(at));
}

sweep! {
    finish_links = sweep_finish(
        links: &'a [Link<One>], works: &'a mut [Work<One>], tree: &'a Tree,
        impulse: Option<&'a [f64]>, s: &'a mut Interval, state: &'a mut State
    ) -> bool
}

#[inline(always)]
fn sweep_finish<W: Width>(
    s: OneTree<W>,
    links: &[Link<One>],
    works: &mut [Work<One>],
    tree: &Tree,
    impulse: Option<&[f64]>,
    at: &mut Interval,
    state: &mut State,
) -> bool {
    let clean = |k: usize, _, q: &mut [f64]| u8::from(tree.clean_link(&tree.links()[k], q));
    let State { q, p, compensation, .. } = state;
    let next = Next { q, rounding: &mut compensation.q, p };
    finish::finish(s, links, works, clean, impulse, ends(at), next) == 0
}

/// The coordinates of an interval.
#[inline(always)]
fn ends(s: &mut Interval) -> StepEnds<'_, f64> {
    let h = s.h;
    let IntervalParts { q0, compensation, q1, dq, q_mid, v_mid } = s.parts_mut();
    StepEnds { h, q0, compensation, q1, dq, middle: Some([q_mid, v_mid]) }
}
