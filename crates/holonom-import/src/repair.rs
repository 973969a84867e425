//! Moments of inertia that no body has, replaced by possible ones.

use crate::mass::{ImportedMass, ROUNDED};
use crate::remark::Remarks;
use crate::solid::ImportedSolid;
use crate::tree_body::TreeBody;

/// Density where nothing tells another one, kg/m³.
const WATER: f64 = 1000.0;

/// A figure of three digits.
pub(crate) fn short(value: f64) -> String {
    match (1e-3..1e4).contains(&value.abs()) {
        true => {
            let digits = 2 - libm::floor(libm::log10(value.abs())) as i32;
            format!("{value:.*}", digits.max(0) as usize)
        }
        false => format!("{value:.2e}"),
    }
}

/// Gives a body with a mass possible moments of inertia where its own are not; says so.
pub(crate) fn repaired(node: &mut TreeBody, remarks: &mut Remarks) {
    let before = node.mass.moments();
    if node.mass.mass <= 0.0 || before[1] > 0.0 && node.mass.least_euler_moment() >= -ROUNDED {
        return;
    }
    let (mass, how) = match before.iter().sum::<f64>() {
        sum if sum > 0.0 => (node.mass.balanced(), "their mean"),
        _ => {
            let shown = node.solids.iter().filter(|placed| placed.solid.is_solid());
            let largest =
                shown.max_by(|a, b| a.solid.volume().total_cmp(&b.solid.volume())).map(|p| {
                    ImportedMass {
                        center: node.mass.center,
                        ..p.solid.with_mass(node.mass.mass).moved(&p.pose)
                    }
                });
            match largest {
                Some(mass) => (mass, "those of its largest geometry"),
                None => {
                    let radius = libm::cbrt(0.75 * node.mass.mass / (std::f64::consts::PI * WATER));
                    let ball = ImportedSolid::Sphere(radius).with_mass(node.mass.mass);
                    (
                        ImportedMass { center: node.mass.center, ..ball },
                        "those of a ball of 1000 kg/m³",
                    )
                }
            }
        }
    };
    let shown = |moments: [f64; 3]| moments.map(short).join(", ");
    let label = format!("link \"{}\" ({} -> {})", node.name, shown(before), shown(mass.moments()));
    let message = format!("moments of inertia that no body has, kg·m²: replaced by {how}");
    remarks.mention(message, label, &node.place);
    node.mass = mass;
}
