//! Laws along joint coordinates of the tree that read other coordinates, other members, signals.
//!
//! ```text
//! r_j += σ (h/2) τ(y)
//! −h D r = M + U Vᵀ,    U = [σ e_j],   V = [−h (h/2) Σ_k dτ/dy_k ∂y_k/∂u]      of foreign y_k; own ones on the diagonal of M
//! x = M⁻¹ b − M⁻¹ U (I + Vᵀ M⁻¹ U)⁻¹ Vᵀ M⁻¹ b
//! ```
//! `M = L L'` is eliminated link by link, so `Vᵀ M⁻¹ U = v̂ᵀ û` with `û = L⁻¹ U` and `v̂ = L'ᵀ⁻¹ V`
//! from the joints up to the root alone, four columns side by side, as of closed loops. The
//! correction is that of the exact matrix; what rounding leaves in it, the next one takes.
//!
//! Source: Golub & Van Loan 2013, §2.1.4, for the inverse of `M + U Vᵀ`.
#![allow(non_snake_case)] // M, U, V

use super::closed_loop::cluster_link::ClusterLink;
use super::closed_loop::four_rows::FourRows;
use super::closed_loop::row_sweeps::RowSweeps;
use super::law_along::LawInStep;
use super::tree_step::part::Links;
use crate::pair::Twist;
use crate::tree::Tree;
use nalgebra::{DMatrix, Vector3};
use vi_core::configuration::Configuration;
use vi_core::coordinate_force::SignedUnknown;
use vi_core::interval::Interval;
use vi_core::linear::DenseLu;
use vi_core::newton::Fault;
use vi_core::quantity_effort::{QuantityEffort, StepQuantity};
use vi_core::{MechanicalSystem, SeparableSystem};
use vi_rigid::directors::FRAME;
use vi_rigid::null_space;

/// Columns at most: their number times that of the unknowns is kept.
const MOST: usize = 32;

crate::opaque_debug!(QuantityEfforts);

/// Up to four columns side by side.
struct Bundle {
    laws: Vec<usize>,    // of each column
    path: Vec<usize>,    // links of the sweeps that its rows reach, deepest first
    has_members: bool,   // some quantity is no unknown
    left: Vec<FourRows>, // d  û
    touched: Vec<usize>, // columns of û that are not zero
}

/// All such laws, and what they add to the linear system of a step.
pub(in crate::solver) struct QuantityEfforts {
    forces: Vec<usize>,
    all: Vec<LawInStep>,
    bundles: Vec<Bundle>,
    links: Vec<ClusterLink>, // of the tree, deepest first
    owner: Vec<usize>,       // of each unknown among these
    link_of: Vec<usize>,     // of each frame
    four: RowSweeps,
    product: DMatrix<f64>, // I + Vᵀ M⁻¹ U
    lu: DenseLu,
    side: Vec<f64>,     // Vᵀ M⁻¹ b, then the factors of û
    covector: Vec<f64>, // n  scratch: a row over the coordinates
    needs_interval: bool,
    is_affine: bool,
}

impl QuantityEfforts {
    /// Of those forces of the system for which `is_apart`; `None` where there are too many.
    pub(in crate::solver) fn new(
        tree: &Tree,
        system: &SeparableSystem,
        s: &Interval,
        is_apart: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let (count, d) = (tree.links().len(), tree.dof());
        let place = |k: usize| count - 1 - k;
        let cluster = |k: usize| {
            let link = &tree.links()[k];
            let (parent, first) = (link.parent.map(place), link.offset);
            ClusterLink { link: k, parent, first, offset: first, dof: link.dof() }
        };
        let links: Vec<ClusterLink> = (0..count).rev().map(cluster).collect();
        let mut owner = vec![0; d];
        for (k, link) in links.iter().enumerate() {
            owner[link.columns()].fill(k);
        }
        let mut own = Self {
            forces: Vec::new(),
            all: Vec::new(),
            bundles: Vec::new(),
            four: RowSweeps::new(count, d),
            links,
            owner,
            link_of: tree.link_of().to_vec(),
            product: DMatrix::zeros(0, 0),
            lu: DenseLu::new(0),
            side: Vec::new(),
            covector: vec![0.0; system.dim()],
            needs_interval: false,
            is_affine: true,
        };
        for (force, effort) in system.quantity_efforts().filter(|(force, _)| is_apart(*force)) {
            own.add(force, effort);
        }
        own.find_bundles(system, s);
        let columns = own.side.len();
        own.product = DMatrix::zeros(columns, columns);
        own.lu = DenseLu::new(columns);
        (columns <= MOST).then_some(own)
    }

    fn add(&mut self, force: usize, effort: &dyn QuantityEffort) {
        let link = self.links[self.owner[effort.unknown().index]].link;
        let along = LawInStep::new(force, link, effort);
        self.forces.push(force);
        self.needs_interval |= along.quantities.contains(&StepQuantity::Configuration);
        self.is_affine &= effort.is_affine();
        self.all.push(along);
    }

    /// Groups the laws that read anything but time, what is held and their own coordinate.
    fn find_bundles(&mut self, system: &SeparableSystem, s: &Interval) {
        let foreign: Vec<usize> =
            (0..self.all.len()).filter(|k| self.all[*k].is_foreign()).collect();
        self.side = vec![0.0; foreign.len()];
        for laws in foreign.chunks(4) {
            let (mut reached, mut has_members) = (vec![false; self.links.len()], false);
            let mut reach = |link: usize| {
                let mut at = Some(link);
                while let Some(k) = at {
                    reached[k] = true;
                    at = self.links[k].parent;
                }
            };
            for along in laws.iter().map(|k| &self.all[*k]) {
                for (j, quantity) in along.quantities.iter().enumerate() {
                    match quantity {
                        StepQuantity::Fixed => {}
                        StepQuantity::Coordinate(k) | StepQuantity::Rate(k) => {
                            reach(self.owner[k.index])
                        }
                        StepQuantity::Configuration => {
                            has_members = true;
                            let Some(effort) = along.effort(system) else { continue };
                            effort.for_each_slope(j, s, &mut |i, _| {
                                reach(self.links.len() - 1 - self.link_of[i / FRAME]);
                            });
                        }
                    }
                }
            }
            let path = (0..reached.len()).filter(|k| reached[*k]).collect();
            self.bundles.push(Bundle {
                laws: laws.to_vec(),
                path,
                has_members,
                left: vec![[0.0; 4]; self.owner.len()],
                touched: Vec::with_capacity(self.owner.len()),
            });
        }
    }

    /// The indices of these forces in the system.
    pub(in crate::solver) fn forces(&self) -> &[usize] {
        &self.forces
    }

    /// Whether they read the end of the step beyond the unknowns.
    pub(in crate::solver) fn needs_interval(&self) -> bool {
        self.needs_interval
    }

    /// Whether they are affine functions of the increments.
    pub(in crate::solver) fn are_affine(&self) -> bool {
        self.is_affine && !self.needs_interval
    }

    /// What is fixed over a step, and the coordinates at its start.
    pub(in crate::solver) fn begin(
        &mut self,
        system: &SeparableSystem,
        at: Configuration<'_>,
        s: &Interval,
    ) {
        self.all.iter_mut().for_each(|along| along.begin(system, at, s));
    }

    /// `(h/2) τ` at the increments `u`.
    pub(in crate::solver) fn evaluate(
        &mut self,
        system: &SeparableSystem,
        s: &Interval,
        u: &[f64],
    ) {
        self.all.iter_mut().for_each(|along| along.evaluate(system, s, u));
    }

    /// `r ← r + σ (h/2) τ`.
    pub(in crate::solver) fn add_balance(&self, r: &mut [f64]) {
        for along in &self.all {
            r[along.unknown.index] += along.unknown.sign * along.impulse;
        }
    }

    /// `p ← p + (h/2) τ ∇θ(q)`.
    pub(in crate::solver) fn add_momentum(
        &self,
        system: &SeparableSystem,
        q: &[f64],
        p: &mut [f64],
    ) {
        for along in &self.all {
            let Some(effort) = along.effort(system) else { continue };
            effort.add_gradient(q, along.impulse, p);
        }
    }

    /// The links and unknowns along which they act.
    pub(in crate::solver) fn places(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.all.iter().map(|along| (along.link, along.unknown.index))
    }

    /// The slopes at the increments of the last evaluation; what they add to `M`, for each link and
    /// unknown.
    pub(in crate::solver) fn slopes(
        &mut self,
        system: &SeparableSystem,
        s: &Interval,
        mut add: impl FnMut(usize, usize, f64),
    ) {
        for along in &mut self.all {
            let slope = along.own_slope(system, s);
            add(along.link, along.unknown.index, -s.h * slope);
        }
    }

    /// Turns the swept right-hand side `x = L⁻¹ b` into the one whose substitution solves
    /// `(M + U Vᵀ) x = b`.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    pub(in crate::solver) fn correct(
        &mut self,
        system: &SeparableSystem,
        s: &Interval,
        at: Links<'_>,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        if self.side.is_empty() {
            return Ok(());
        }
        for bundle in 0..self.bundles.len() {
            self.sweep_columns(bundle, at);
        }
        for bundle in 0..self.bundles.len() {
            self.sweep_rows(bundle, system, s, at);
            self.multiply(bundle, x);
            self.four.clear(&self.links);
        }
        let Self { product, lu, side, bundles, .. } = self;
        lu.solve(product, side).map_err(|_| Fault::SingularTangent)?;
        for (bundle, factors) in bundles.iter().zip(side.chunks(4)) {
            for &column in &bundle.touched {
                let parts = bundle.left[column].iter().zip(factors);
                x[column] -= parts.map(|(u, factor)| u * factor).sum::<f64>();
            }
        }
        Ok(())
    }

    /// `û` of a bundle.
    fn sweep_columns(&mut self, bundle: usize, at: Links<'_>) {
        let Self { four, links, owner, bundles, all, .. } = self;
        let Bundle { laws, left, touched, .. } = &mut bundles[bundle];
        for (row, law) in laws.iter().enumerate() {
            let SignedUnknown { index, sign } = all[*law].unknown;
            four.values[index][row] = sign;
            four.touch(owner[index], links);
        }
        four.order_touched();
        four.transmit_all(links, at);
        touched.clear();
        for column in four.touched.iter().flat_map(|k| links[*k].columns()) {
            left[column] = four.values[column];
            touched.push(column);
        }
        four.clear(links);
    }

    /// `v̂` of a bundle, in `self.four`.
    fn sweep_rows(&mut self, bundle: usize, system: &SeparableSystem, s: &Interval, at: Links<'_>) {
        let Self { four, links, bundles, all, covector, link_of, .. } = self;
        let Bundle { laws, path, has_members, .. } = &bundles[bundle];
        four.take_places(path);
        for (row, along) in laws.iter().map(|law| &all[*law]).enumerate() {
            for (j, quantity) in along.quantities.iter().enumerate() {
                match quantity {
                    StepQuantity::Coordinate(k) | StepQuantity::Rate(k)
                        if !along.is_own(*quantity) =>
                    {
                        four.values[k.index][row] -= s.h * along.by_unknown(j, s.h);
                    }
                    StepQuantity::Configuration => {
                        let scale = -0.5 * s.h * s.h * along.slopes[j];
                        let Some(effort) = along.effort(system) else { continue };
                        effort.for_each_slope(j, s, &mut |i, slope| covector[i] += scale * slope);
                    }
                    _ => {}
                }
            }
            if *has_members {
                for frame in path.iter().map(|k| at.constants[links[*k].link].frame) {
                    let own = frame..frame + FRAME;
                    let wrench = null_space::pull_back(&s.q1[own.clone()], &covector[own.clone()]);
                    covector[own].fill(0.0);
                    let part = |first: usize| Vector3::from_fn(|i, _| wrench[first + i]);
                    let link = link_of[frame / FRAME];
                    let wrench = at.about_reference(link, &s.q1, &Twist::new(part(0), part(3)));
                    let place = (links.len() - 1 - link, row);
                    four.add_wrench(place, Some(wrench.linear), wrench.angular);
                }
            }
        }
        if *has_members {
            four.carry(links, path, None, at, true);
        }
        path.iter().for_each(|k| four.touch(*k, links));
        four.order_touched();
        four.transmit_all_transposed(links, at);
    }

    /// Rows of `I + Vᵀ M⁻¹ U` and of `Vᵀ M⁻¹ b` from the `v̂` at hand.
    fn multiply(&mut self, bundle: usize, x: &[f64]) {
        let Self { four, links, bundles, product, side, .. } = self;
        let columns = || four.touched.iter().flat_map(|k| links[*k].columns());
        let own = 4 * bundle..4 * bundle + bundles[bundle].laws.len();
        for (row, i) in own.enumerate() {
            side[i] = columns().map(|column| four.values[column][row] * x[column]).sum();
            for (other, Bundle { laws, left, .. }) in bundles.iter().enumerate() {
                let mut sums = [0.0; 4];
                for column in columns() {
                    let v = four.values[column][row];
                    sums.iter_mut().zip(&left[column]).for_each(|(sum, u)| *sum += v * u);
                }
                for (lane, sum) in sums.into_iter().take(laws.len()).enumerate() {
                    let k = 4 * other + lane;
                    product[(i, k)] = f64::from(u8::from(i == k)) + sum;
                }
            }
        }
    }
}
