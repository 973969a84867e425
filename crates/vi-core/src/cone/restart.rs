//! Other impulses to begin with, where Newton's method ends above the tolerance.
//!
//! Bodies that touch at more points than they have freedoms take many impulses for one motion. A
//! contact that slides the wrong way, or sticks outside of its cone, has no state that obeys its
//! law near these impulses: some contact has to let go. So the contact that violates its law most
//! is loosened, to half of its impulse and to none in turn; then parts of the warm start follow,
//! even ones, and ones that differ from contact to contact.
#![allow(non_snake_case)] // F

use super::problem::Placed;
use crate::linear::norm_inf;

/// Contacts that are loosened, one after the other, from each start.
const LOOSENED: usize = 4;
/// Parts of the warm start, and how far those of single contacts lie apart.
const STARTS: [[f64; 2]; 5] = [[0.5, 0.0], [0.8, 0.0], [1.0, 0.2], [1.0, 0.7], [0.3, 0.0]];

/// Where a solver stands.
pub(super) struct Standing<'a> {
    pub cones: &'a [Placed],
    pub warm: &'a [f64],        // k
    pub F: &'a [f64],           // k  at `impulse`
    pub impulse: &'a mut [f64], // k
}

/// A solver that begins where it is told.
pub(super) trait Restart {
    fn standing(&mut self) -> Standing<'_>;

    /// Newton's method from the present impulses; its residual where the laws hold.
    fn attempt(&mut self) -> Option<f64>;
}

/// Newton's method from the present impulses with contacts loosened, then from one start after the
/// other: the residual, and how many there were.
pub(super) fn from_elsewhere(solver: &mut impl Restart) -> Option<(f64, usize)> {
    let mut count = 0;
    let is_at_rest = solver.standing().warm.iter().all(|own| *own == 0.0);
    let starts = &STARTS[..if is_at_rest { 0 } else { STARTS.len() }];
    for start in std::iter::once(None).chain(starts.iter().map(Some)) {
        if let Some(start) = start {
            begin_with(*start, solver.standing());
        }
        for turn in usize::from(start.is_none())..=LOOSENED {
            if turn > 0 {
                loosen(if turn % 2 == 1 { 0.5 } else { 0.0 }, solver.standing());
            }
            count += 1;
            if let Some(residual) = solver.attempt() {
                return Some((residual, count));
            }
        }
    }
    None
}

/// Leaves a part of the impulse of the contact that violates its law most.
fn loosen(part: f64, Standing { cones, F, impulse, .. }: Standing<'_>) {
    let rows = |own: &Placed| own.row..own.row + own.cone.rows();
    let fault = |own: &Placed| norm_inf(&F[rows(own)]);
    if let Some(worst) = cones.iter().max_by(|a, b| fault(a).total_cmp(&fault(b))) {
        impulse[rows(worst)].iter_mut().for_each(|own| *own *= part);
    }
}

/// Takes `part (1 + spread r)` of the warm start, `r` in `[-1, 1)` of each contact.
fn begin_with([part, spread]: [f64; 2], Standing { cones, warm, impulse, .. }: Standing<'_>) {
    let mut seed = 1_u64;
    for &Placed { cone, row } in cones {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let r = (seed >> 33) as f64 / f64::from(1 << 30) - 1.0;
        let part = part * (1.0 + spread * r);
        (row..row + cone.rows()).for_each(|i| impulse[i] = part * warm[i]);
    }
}
