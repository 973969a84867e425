//! Numbers of four rows side by side, in registers and in memory.

use crate::geometry::members::{LanesScrew, LanesVector};
use crate::geometry::space::Space;
use vi_core::lanes::{Lanes, Register};

/// A number of each of four rows.
pub(in crate::solver) type FourRows = [f64; 4];

/// Calls `$run` with the widest registers.
macro_rules! in_registers {
    ($lanes:ident => $run:expr) => {{
        #[cfg(target_arch = "x86_64")]
        if let Some($lanes) = vi_core::lanes::Wide::detect() {
            return $lanes.run(
                #[inline(always)]
                || $run,
            );
        }
        let $lanes = vi_core::lanes::Plain;
        $run
    }};
}
pub(super) use in_registers;

#[inline(always)]
pub(super) fn load<T: Register>(lanes: T, x: &FourRows) -> T::Lanes {
    lanes.gather(
        #[inline(always)]
        |row| x[row],
    )
}

#[inline(always)]
pub(super) fn held(x: impl Lanes) -> FourRows {
    [x.at(0), x.at(1), x.at(2), x.at(3)]
}

#[inline(always)]
pub(super) fn take<T: Register>(lanes: T, x: &[FourRows; 6]) -> LanesScrew<T::Lanes> {
    let [a, b, c, d, e, f] = x;
    LanesScrew {
        linear: LanesVector([load(lanes, a), load(lanes, b), load(lanes, c)]),
        angular: LanesVector([load(lanes, d), load(lanes, e), load(lanes, f)]),
    }
}

#[inline(always)]
pub(super) fn hold<L: Lanes>(x: LanesScrew<L>) -> [FourRows; 6] {
    let ([a, b, c], [d, e, f]) = (x.linear.0, x.angular.0);
    [held(a), held(b), held(c), held(d), held(e), held(f)]
}

/// The same for all rows.
#[inline(always)]
pub(super) fn screw<T: Register>(
    lanes: T,
    [linear, angular]: [[f64; 3]; 2],
) -> LanesScrew<T::Lanes> {
    LanesScrew { linear: lanes.vector(linear), angular: lanes.vector(angular) }
}
