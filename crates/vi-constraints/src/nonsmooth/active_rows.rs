//! The laws of an island at the last step, as one problem for the next impulses.
//!
//! ```text
//! y(Λ') = ξ + W_s (Λ' − Λ)
//! ```
//! Few rows are solved exactly; `W_s` is `W`, or where the iteration with that is slow the response
//! of the step, of those rows that a step drives. More rows, and few ones for which no impulses are
//! found, are solved by proximal steps with `W = L Lᵀ`, until what violates a law is less than what
//! the node before leaves. After `LEADS` solutions of the step, of many rows after `VAIN` ones in a
//! row that do not obey the laws, or where they stand still, a compliance about the impulses of
//! then ends the iteration: rows that contradict one another, as those of a face that turns in the
//! step, would move impulses without end.

use super::ContactFault;
use super::delassus::Delassus;
use super::holding::Holding;
use super::islands::Islands;
use super::node_law::{Contact, Drive, Kind, Rows};
use super::unilateral::{ContactRows, Elements};
use crate::scheme::StepError;
use vi_core::cone::{Cone, ConeFault, ConeSolver, ConvexSolver, Repeated, SparseRows};
use vi_core::linear::norm_inf;

/// A step far from its solution moves the points of a body apart by its rotation squared: no
/// impulses obey the laws then, and the nearest ones up to this part lead on.
const NEARBY: f64 = 1e-3;
/// In so many solutions of a step the nearest ones are not looked for any further.
pub(super) const EARLY: usize = 4;
/// Impulses of more rows than these that grow by more than this balance one another: rounding would
/// be left of momenta.
const MANY: usize = 60;
const GROWS: f64 = 100.0;
/// So often many rows are solved exactly in vain.
const TRIES: usize = 3;
/// Most rows that are always solved exactly.
const FEW: usize = 12;
/// Most rows of a dense matrix.
pub(super) const DENSE: usize = 300;
/// What the node before leaves of the laws, relative to the largest velocity: rows that `W` does
/// not tell apart contradict one another by several times the change that an iteration ends with.
const LEFT: f64 = 4e-10;
/// What may be left to see where a step leads, likewise.
const ROUGH: f64 = 1e-2;
/// What may be left of large problems that change yet, relative to their last change.
const FORCING: f64 = 1e-3;
/// A change of velocities with which an exact solution is near, likewise.
const NEAR: f64 = 1e-6;
/// `ρ` of the first proximal step, and of that of more rows than a dense matrix has; by how much it
/// grows with solutions that obey the laws, and the largest one, of more rows another one.
const FIRST: f64 = 10.0;
const FIRST_OF_MANY: f64 = 1e3;
const NEARER: f64 = 10.0;
const LAST: f64 = 1e5;
const LAST_OF_MANY: f64 = 1e4;
/// By how much it shrinks where Coulomb's law has no solution that is found with a compliance.
const SOFTER: f64 = 0.3;
/// In so many solutions of a step impulses of more rows than a dense matrix has are looked for from
/// nowhere.
const AFRESH: usize = 2;
/// Solutions of a step before there is a compliance, and before the least slip counts with it.
const LEADS: usize = 12;
const VAIN: usize = 4; // those in a row that do not obey the laws
pub(super) const FROZEN: usize = 24;
/// What laws with a compliance may leave, relative to velocities.
const WIDE: f64 = 1e-2;
/// A change of velocities that the iteration ends with, relative to velocities: of many rows and
/// with a compliance, and with the least slip.
const LARGE: f64 = 1e-10;
const RELAXED: f64 = 1e-6;

/// The rows of an island whose impulses are not known beforehand.
#[derive(Debug, Default)]
pub(super) struct ActiveRows {
    all: Vec<usize>,    // m  rows of the island
    active: Vec<usize>, // m  places among those to be found, or `KNOWN`
    drives: Vec<Drive>, // m
    cones: Vec<Cone>,
    owners: Vec<usize>, // contacts of the cones
    W: Vec<f64>,
    w: Vec<f64>,
    errors: Vec<f64>, // of w
    found: Vec<f64>,
    solver: ConeSolver,
    model: Vec<f64>,    // m × m  W, of not too many rows
    response: Vec<f64>, // m × m  W_s, where it is not W
    by_step: Vec<bool>, // m  whether the step drives a row, or the velocity at the node
    lambda: Vec<f64>,   // m  Λ of the last step
    holding: Holding,   // k  −Λ_2 of what is kept
    is_kept: bool,      // something is, beside an impact
    is_exact: bool,
    passes: usize,
    in_vain: usize,      // in a row that proximal steps violate the laws
    failures: usize,     // of exact solutions in this iteration
    failed_first: usize, // from the last impulses, for this node
    pub(super) by_proximal_steps: bool,
    roughly: bool, // to see where the step leads
    proximal: ProximalRows,
}

/// What proximal steps take and leave.
#[derive(Debug, Default)]
struct ProximalRows {
    solver: ConvexSolver,
    L: (Vec<usize>, Vec<u32>, Vec<f64>), // in sparse rows
    columns: Vec<u32>,                   // of the factor of W: their places in the island
    u: Vec<f64>,                         // Lᵀ Λ
    rho: f64,
    left: f64,   // by what velocities violate the laws, m/s
    within: f64, // what they may
    change: f64, // of a velocity by the last solution, m/s
    is_compliant: bool,
    reference: Vec<f64>, // m  impulses that a compliance is about
    given: Vec<f64>,     // those of the rows to be found; what proximal steps found
}

impl ProximalRows {
    /// From now on there is a compliance about these impulses.
    fn comply(&mut self, lambda: &[f64], speeds: f64) {
        self.is_compliant = true;
        self.reference.clear();
        self.reference.extend_from_slice(lambda);
        self.rho = (speeds / self.left).clamp(FIRST, LAST);
    }
}

/// The impulse of a row is known.
const KNOWN: usize = usize::MAX;

/// The contacts of a node at the last step.
pub(super) struct Present<'a> {
    pub(super) contacts: &'a mut [Contact],
    pub(super) W: &'a mut Delassus,
    pub(super) islands: &'a Islands,
    pub(super) minus: &'a [f64],
    pub(super) plus: &'a [f64],
    pub(super) lambda: &'a [f64],
    pub(super) next: &'a mut [f64],
    pub(super) speeds: f64, // the largest of `minus` and `plus`
    pub(super) h: f64,
}

impl ActiveRows {
    /// A node begins.
    pub(super) fn begin_node(&mut self) {
        self.failed_first = 0;
    }

    /// An iteration begins, or one that ends `roughly`.
    pub(super) fn begin(
        &mut self,
        roughly: bool,
        contacts: &[Contact],
        W: &Delassus,
        islands: &Islands,
        k: usize,
    ) {
        let Self { all, model, .. } = self;
        all.clear();
        for contact in islands.contacts(k).iter().map(|place| &contacts[*place]) {
            all.extend(contact.row..contact.row + contact.law.rows());
        }
        let m = all.len();
        model.clear();
        if m <= DENSE {
            model.resize(m * m, 0.0);
            for (place, row) in all.iter().enumerate() {
                for (j, entry) in W.row(*row) {
                    if let Some(j) = islands.local(j, k) {
                        model[place * m + j] = entry;
                    }
                }
            }
        }
        self.response.clear();
        (self.passes, self.in_vain, self.failures) = (0, 0, 0);
        (self.is_exact, self.roughly) = (false, roughly);
        let first = if self.is_large() { FIRST_OF_MANY } else { FIRST };
        let own = &mut self.proximal;
        (own.rho, own.left, own.is_compliant) = (first, 0.0, false);
    }

    /// Takes `W_s` from the changes `dq` of the end of the last step with the impulses of all rows,
    /// as tangents at the node, shape `n × k` by columns.
    pub(super) fn respond(&mut self, rows: &ContactRows, dq: &[f64], n: usize, h: f64) {
        let Self { all, response, model, .. } = self;
        response.clear();
        if model.is_empty() {
            return;
        }
        let entry = |i: usize, j: usize| rows.dot(i, &dq[j * n..(j + 1) * n]) / h;
        for i in &*all {
            response.extend(all.iter().map(|j| 0.5 * (entry(*i, *j) + entry(*j, *i))));
        }
    }

    /// By what velocities the laws are violated beside what the node before leaves, where the last
    /// ones changed by this.
    pub(super) fn deviation(&self, change: f64) -> Option<f64> {
        let most = self.proximal.left.max(change).max(self.passing());
        (self.proximal.is_compliant && most > self.proximal.within).then_some(most)
    }

    /// By what velocity the last step passes a normal law at most, `−ξ_N`. The compliance along the
    /// tangents is part of it: where the laws hold for `y + δ`, `y_N ≥ −|δ_N| − μ|δ_T|`.
    fn passing(&self) -> f64 {
        let (mut most, mut row) = (0.0_f64, 0);
        for cone in &self.cones {
            while self.active[row] == KNOWN {
                row += 1;
            }
            if let (Drive::Zero { xi, .. }, false) =
                (self.drives[row], matches!(cone, Cone::Bounded { .. }))
            {
                most = most.max(-xi);
            }
            row += cone.rows();
        }
        most
    }

    /// A compliance is to end the iteration, where proximal steps violate the laws; whether it is
    /// new.
    pub(super) fn comply(&mut self, speeds: f64) -> bool {
        let own = &mut self.proximal;
        let is_new = !own.is_compliant && !self.is_exact && own.left > 0.0;
        if is_new {
            own.comply(&self.lambda, speeds);
        }
        is_new
    }

    /// Whether there is a compliance.
    pub(super) fn is_compliant(&self) -> bool {
        self.proximal.is_compliant
    }

    /// Whether it has more rows than a dense matrix.
    fn is_large(&self) -> bool {
        self.all.len() > DENSE
    }

    /// The change of velocities that the iteration ends with, relative to velocities.
    pub(super) fn least_change(&self) -> f64 {
        match self.proximal.is_compliant {
            true if self.passes > FROZEN => RELAXED,
            true => LARGE,
            false if self.is_large() => LARGE,
            false => 4.0 * f64::EPSILON,
        }
    }

    /// Whether the laws hold at the impulses that were found.
    pub(super) fn is_exact(&self) -> bool {
        self.is_exact
    }

    /// `next`: the impulses of an island by the laws at the last step.
    pub(super) fn next_impulses(
        &mut self,
        island: usize,
        present: Present<'_>,
        elements: &Elements,
    ) -> Result<(), StepError> {
        let Present { contacts, W, islands, minus, plus, lambda, next, speeds, h } = present;
        self.lambda.clear();
        self.lambda.extend(self.all.iter().map(|row| lambda[*row]));
        self.drives.clear();
        self.cones.clear();
        self.owners.clear();
        self.active.clear();
        self.errors.clear();
        self.by_step.clear();
        let places = islands.contacts(island);
        let mut count = 0;
        part_friction(contacts, W, places);
        self.part_kept(contacts, W, places, plus, lambda);
        for place in places {
            let contact = &mut contacts[*place];
            let first = contact.row;
            let of = first..first + contact.law.rows();
            let [minus, plus, lambda] = [minus, plus, lambda].map(|all| &all[of.clone()]);
            let diagonal = W.at(first, first);
            let (own, cone) = contact.equations(Rows { minus, plus, lambda, w: diagonal });
            self.drives.extend_from_slice(&own[..of.len()]);
            let is_impact = contact.kind != Kind::Position;
            let by_step = |row: usize| !(is_impact || row > first && contact.slides);
            self.by_step.extend(of.clone().map(by_step));
            if let Drive::Known(value) = own[0] {
                next[first] = value;
                self.active.push(KNOWN);
            } else {
                self.active.extend(count..count + of.len());
                count += of.len();
                self.errors.resize(count, contact.error(speeds, h));
                self.cones.push(cone);
                self.owners.push(*place);
            }
        }
        self.passes += 1;
        let solved = self.solve(W, speeds);
        if let Err(fault) = solved {
            let cone = match fault {
                ConeFault::Wedged { cone } => cone,
                _ => 0,
            };
            let element = contacts[self.owners[cone]].id.element;
            let element = elements[element as usize].name().to_owned();
            return Err(match fault {
                ConeFault::Wedged { .. } => ContactFault::Immovable { element }.into(),
                fault => ContactFault::Laws { element, fault }.into(),
            });
        }
        for (row, active) in self.all.iter().zip(&self.active) {
            if *active != KNOWN {
                next[*row] = self.found[*active];
            }
        }
        Ok(())
    }

    /// What the step from an impact adds to its velocities by the impulses of what is kept [N9].
    fn part_kept(
        &mut self,
        contacts: &mut [Contact],
        W: &Delassus,
        places: &[usize],
        plus: &[f64],
        lambda: &[f64],
    ) {
        let rests = |place: &usize| contacts[*place].rests;
        self.is_kept = places.iter().any(rests) && has_impact(contacts, places);
        if !self.is_kept {
            return;
        }
        let holding = &mut self.holding;
        holding.begin();
        let mut own = places.iter().peekable();
        for (k, contact) in contacts.iter().enumerate() {
            let is_own = own.next_if(|place| **place == k).is_some();
            let of = contact.row..contact.row + contact.law.rows();
            for i in 0..of.len() {
                holding.add(is_own && contact.rests_after(i, &lambda[of.clone()]), 0.0, W);
            }
        }
        holding.hold(W, plus);
        for place in places {
            let contact = &mut contacts[*place];
            let row = contact.row;
            let velocities = contact.parted_velocity.iter_mut().take(contact.law.rows());
            velocities.enumerate().for_each(|(i, own)| {
                *own += W.product(row + i, |j| holding.part[j]);
            });
        }
    }

    /// Kinetic energy that the impulses of what is kept have after an impact, J.
    pub(super) fn hidden(&self, plus: &[f64]) -> f64 {
        let rows = self.all.iter().map(|row| -0.5 * self.holding.part[*row] * plus[*row]);
        if self.is_kept { rows.sum() } else { 0.0 }
    }

    /// Solves the laws: of few rows exactly; of more ones so from the last impulses, first or where
    /// proximal steps end near those, else by proximal steps.
    fn solve(&mut self, W: &mut Delassus, speeds: f64) -> Result<(), ConeFault> {
        let is_convex = !self.cones.iter().any(|cone| matches!(cone, Cone::Sliding { .. }));
        let are_many = self.errors.len() > FEW;
        let approaches = is_convex && (are_many || self.by_proximal_steps);
        let tries = !self.by_proximal_steps
            && !self.proximal.is_compliant
            && !self.model.is_empty()
            && self.failures < TRIES;
        let is_some = self.errors.len() <= MANY && self.failed_first < TRIES;
        let begins = tries && (is_some || !self.response.is_empty());
        if !approaches || begins {
            self.state();
            let solved = self.solve_exactly(approaches);
            if solved.is_ok() || !approaches {
                return solved;
            }
            self.failed_first += 1;
        }
        let is_vain = begins && self.response.is_empty(); // to try the same again
        self.response.clear(); // it has no factor
        W.factorize();
        self.state_factor(W);
        self.approach(speeds)?;
        if tries && !is_vain && !self.roughly && self.change() <= NEAR * speeds {
            let is_exact = self.is_exact;
            self.proximal.given.clone_from(&self.found);
            self.state();
            if self.solve_exactly(true).is_err() {
                self.found.clone_from(&self.proximal.given);
                self.is_exact = is_exact;
            }
        }
        Ok(())
    }

    /// The largest change of a velocity by the impulses that were found by proximal steps.
    fn change(&mut self) -> f64 {
        let ProximalRows { L: (ends, places, values), u, .. } = &mut self.proximal;
        let L = SparseRows { ends, places, values };
        let known = self.active.iter().zip(&self.lambda).filter(|row| *row.0 != KNOWN);
        u.fill(0.0);
        for (i, (found, (_, lambda))) in self.found.iter().zip(known).enumerate() {
            L.row(i).for_each(|(place, value)| u[place] += value * (found - lambda));
        }
        let of = |i| L.row(i).map(|(place, value)| value * u[place]).sum::<f64>().abs();
        (0..L.ends.len()).map(of).fold(0.0, f64::max)
    }

    /// Solves the problem that is stated to rounding; from the impulses that were found where it
    /// only `looks` near those.
    fn solve_exactly(&mut self, looks: bool) -> Result<(), ConeFault> {
        if self.model.is_empty() {
            let (residual, cones) = (f64::INFINITY, self.cones.len());
            return Err(ConeFault::NoConvergence { residual, cones });
        }
        let is_early = self.passes <= EARLY;
        let Self { cones, W, w, errors, found, .. } = self;
        let most = if w.len() > MANY { GROWS * norm_inf(found) } else { f64::INFINITY };
        self.solver.end_early(looks || is_early);
        let mut solved = self.solver.solve_within(cones, W, (w, errors), found);
        if norm_inf(found) > most && looks {
            solved = Err(ConeFault::NoConvergence { residual: f64::INFINITY, cones: cones.len() });
        }
        self.is_exact = solved.is_ok();
        self.failures += usize::from(!self.is_exact);
        match solved {
            Err(ConeFault::NoConvergence { residual, .. })
                if is_early && !looks && residual < NEARBY =>
            {
                Ok(())
            }
            solved => solved.map(|_| ()),
        }
    }

    /// Proximal steps towards the laws, or with a compliance one about the reference.
    fn approach(&mut self, speeds: f64) -> Result<(), ConeFault> {
        let is_large = self.is_large();
        let Self { cones, w, errors, found, active, lambda, proximal: own, .. } = self;
        let (ends, places, values) = &own.L;
        let L = SparseRows { ends, places, values };
        let rounding = norm_inf(errors);
        let least = match (self.roughly, is_large) {
            (true, _) => ROUGH * speeds,
            (false, true) if self.passes == 1 => FORCING * ROUGH * speeds,
            (false, true) => FORCING * own.change,
            (false, false) => 0.0,
        };
        own.within = rounding.max(LEFT * speeds);
        let solved = if own.is_compliant {
            let of = active.iter().zip(&own.reference).filter(|row| *row.0 != KNOWN);
            own.given.clear();
            own.given.extend(of.map(|row| *row.1));
            loop {
                let solved = own.solver.step(cones, L, w, own.rho, &own.given, found);
                match solved {
                    Ok(report) if !report.follows && own.rho > FIRST => own.rho *= SOFTER,
                    _ => break solved,
                }
            }
        } else {
            let afresh = is_large && self.passes <= AFRESH;
            let within = rounding.max(least);
            let enough = own.within.max(least);
            let central = is_large && self.in_vain == 0; // laws do not contradict one another yet
            let repeated = Repeated { first: own.rho, within, enough, afresh, central };
            own.solver.follow(cones, L, w, repeated, found)
        };
        own.left = match solved {
            Ok(report) => report.left,
            Err(ConeFault::NoConvergence { .. }) => f64::INFINITY,
            Err(fault) => return Err(fault),
        };
        self.is_exact = own.left <= if own.is_compliant { WIDE * speeds } else { own.within };
        let suffices = own.left <= own.within.max(least);
        self.in_vain = if suffices { 0 } else { self.in_vain + 1 };
        let leads = self.passes < LEADS && (self.in_vain < VAIN || !is_large);
        if !leads && !own.is_compliant {
            own.comply(lambda, speeds);
        } else if self.is_exact || suffices {
            let last = if is_large && !own.is_compliant { LAST_OF_MANY } else { LAST };
            own.rho = (own.rho * NEARER).min(last);
        }
        if is_large {
            self.proximal.change = self.change();
        }
        Ok(())
    }

    /// States the problem of the rows to be found: `L` of `W = L Lᵀ` and `w = ξ − W Λ`.
    fn state_factor(&mut self, W: &Delassus) {
        let Self { all, active, drives, w, found, lambda, proximal, .. } = self;
        let ProximalRows { L: (ends, places, values), columns, u, .. } = proximal;
        for vector in [&mut *values, w, found, u] {
            vector.clear();
        }
        ends.clear();
        places.clear();
        columns.clear();
        for ((row, drive), lambda) in all.iter().zip(&*drives).zip(&*lambda) {
            // y(Λ') = ξ + W (Λ' − Λ), where what is known of Λ' is part of ξ
            let less = match drive {
                Drive::Known(value) => lambda - value,
                Drive::Zero { .. } => *lambda,
            };
            for (column, value) in W.factor.row(*row) {
                if column >= columns.len() {
                    columns.resize(column + 1, u32::MAX);
                }
                if columns[column] == u32::MAX {
                    columns[column] = u.len() as u32;
                    u.push(0.0);
                }
                u[columns[column] as usize] += value * less;
            }
        }
        for (l, row) in all.iter().enumerate().filter(|(l, _)| active[*l] != KNOWN) {
            let Drive::Zero { xi, compliance } = drives[l] else { continue };
            let mut rest = xi - compliance * lambda[l];
            for (column, value) in W.factor.row(*row) {
                places.push(columns[column]);
                values.push(value);
                rest -= value * u[columns[column] as usize];
            }
            if compliance > 0.0 {
                places.push(u.len() as u32); // a column of its own
                values.push(compliance.sqrt());
                u.push(0.0);
            }
            ends.push(places.len());
            w.push(rest);
            found.push(lambda[l]);
        }
    }

    /// States the problem of the rows to be found: `W_s` and `w = ξ − W_s Λ`.
    fn state(&mut self) {
        let m = self.all.len();
        let Self { active, drives, W, w, found, model, lambda, response, by_step, .. } = self;
        for vector in [&mut *W, w, found] {
            vector.clear();
        }
        for l in (0..m).filter(|l| active[*l] != KNOWN && !model.is_empty()) {
            let Drive::Zero { xi, compliance } = drives[l] else { continue };
            let mut rest = xi;
            for j in 0..m {
                let responds = !response.is_empty() && by_step[l] && by_step[j];
                let entry = if responds { response[l * m + j] } else { model[l * m + j] };
                match drives[j] {
                    Drive::Known(value) => rest += entry * (value - lambda[j]),
                    Drive::Zero { .. } => {
                        W.push(if l == j { entry + compliance } else { entry });
                        rest -= W[W.len() - 1] * lambda[j];
                    }
                }
            }
            w.push(rest);
            found.push(lambda[l]);
        }
    }
}

/// Whether one of these contacts is an impact.
fn has_impact(contacts: &[Contact], places: &[usize]) -> bool {
    places.iter().any(|place| contacts[*place].kind == Kind::Impact)
}

/// What dry friction of the steps beside an impact adds to its velocities [N7].
fn part_friction(contacts: &mut [Contact], W: &Delassus, places: &[usize]) {
    let is_hit = has_impact(contacts, places);
    for place in places {
        let contact = &mut contacts[*place];
        contact.part(is_hit, W.at(contact.row, contact.row));
        contact.parted_velocity = [0.0; 3];
    }
    for friction in places {
        let Contact { row, .. } = contacts[*friction];
        let Some([first, last]) = contacts[*friction].parts() else { continue };
        for contact in places {
            let contact = &mut contacts[*contact];
            for i in 0..contact.law.rows() {
                let e = contact.reduction * contact.restitution_of(i);
                contact.parted_velocity[i] += W.at(contact.row + i, row) * (e * first - last);
            }
        }
    }
}

#[cfg(test)]
mod tests;
