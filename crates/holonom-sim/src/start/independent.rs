//! The coordinates that determine a start.

use holonom_model::Model;
use vi_constraints::InitialValues;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::linear::Singular;
use vi_multibody::design::start::{self, StartCoordinate};
use vi_multibody::mechanism::Mechanism;

/// A coordinate of the start with its joint, if it has one, and which of its coordinates it is.
pub(crate) type TreeCoordinate = (Option<usize>, usize, StartCoordinate);

/// As many coordinates as determine a configuration: of the joints that come `first` (joint,
/// freedom), then of those with stated rates, then of the others of the spanning tree.
///
/// # Errors
/// [`Singular`] where they do not determine the start.
pub(crate) fn independent(
    model: &Model,
    mechanism: &Mechanism,
    rows: &IndependentRows,
    at: InitialValues<'_>,
    first: &[(usize, usize)],
) -> Result<Vec<TreeCoordinate>, Singular> {
    let mut all = StartCoordinate::of_tree(mechanism);
    for &(joint, freedom) in first {
        let is_own = |own: &TreeCoordinate| (own.0, own.1) == (Some(joint), freedom);
        if all.iter().any(is_own) {
            continue;
        }
        // of a joint that closes a loop
        let closing = mechanism.known_coordinate(joint, freedom);
        let closing = closing.map(|own| StartCoordinate::Joint(Box::new(own)));
        all.extend(closing.map(|own| (Some(joint), freedom, own)));
    }
    let stated = |own: &TreeCoordinate| {
        let joint = own.0.and_then(|k| model.joints.get(k));
        joint.is_some_and(|joint| joint.rate.is_some())
    };
    let is_first = |own: &TreeCoordinate| own.0.is_some_and(|k| first.contains(&(k, own.1)));
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by_key(|&k| (!is_first(&all[k]), !stated(&all[k])));
    let plain: Vec<StartCoordinate> = order.iter().map(|&k| all[k].2.clone()).collect();
    let rows = start::of_positions(mechanism, rows);
    let mut chosen = start::independent(mechanism, &rows, at, &plain)?;
    chosen.iter_mut().for_each(|k| *k = order[*k]);
    if !mechanism.has_velocity_constraints() {
        chosen.sort_unstable();
    }
    Ok(chosen.into_iter().map(|k| all[k].clone()).collect())
}
