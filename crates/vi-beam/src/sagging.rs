//! How far an element of order 4 stands for a rope that sags.
//!
//! ```text
//! s = N ℓ² ψ²/B,        ψ = ℓ|K|,   B the least of EI_1, EI_2, GJ
//! ```
//! Such an element takes the bending within it from the moments at its middle. Where the tension
//! is beyond all that its bending holds and turns by `ψ` along it, it has directions without
//! stability that the rope does not have. `s` falls with the fourth power of the length of
//! elements; measured on catenaries with `ψ` from 0.01 to 0.2 and `Nℓ²/EI` from 3 to 10⁵ they are
//! there from `s = 12` on where `GJ = EI/10`, from 30 to 60 on where `GJ = EI`.
//!
//! Letters: `N` tension, `K` elastic curvature, `ℓ` length.
#![allow(non_snake_case)] // C, N

use crate::element::{Element, ElementKind};
use crate::elements::Elements;

/// `s` beyond which an element does not stand for a rope.
pub const SLACK: f64 = 10.0;

/// The element of a beam that stands for a rope least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SaggingElement {
    /// Which one, counted along the elements asked for.
    pub element: usize,
    /// `N ℓ²/B`.
    pub ratio: f64,
    /// `ψ`, rad.
    pub angle: f64,
}

impl SaggingElement {
    /// `s`.
    #[must_use]
    pub fn sag(&self) -> f64 {
        self.ratio * self.angle * self.angle
    }

    /// By how many times as many elements it stands for a rope.
    #[must_use]
    pub fn refinement(&self) -> f64 {
        (self.sag() / SLACK).sqrt().sqrt()
    }
}

/// Of some elements with strains of order 4 the one with the largest `s` in the configuration `q`;
/// `None` where none is in tension and bent.
#[must_use]
pub fn most_sagging<'a>(
    elements: &Elements,
    own: impl IntoIterator<Item = &'a Element>,
    q: &[f64],
) -> Option<SaggingElement> {
    let own = own.into_iter().enumerate();
    let helicoidal = own.filter(|(_, own)| own.law.kind() == ElementKind::Helicoidal);
    let found = helicoidal.map(|(element, own)| {
        let strain = own.strain(&own.coordinates(q));
        let C = elements.stiffness(own);
        let N = C.row(2).tr_dot(&strain);
        let least = C[(3, 3)].min(C[(4, 4)]).min(C[(5, 5)]);
        let angle = own.length * strain.fixed_rows::<3>(3).norm();
        SaggingElement { element, ratio: N * own.length * own.length / least, angle }
    });
    found.filter(|own| own.sag() > 0.0).max_by(|a, b| a.sag().total_cmp(&b.sag()))
}
