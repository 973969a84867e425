//! Mass matrices of the bodies of a tree, read off that of the system.

use nalgebra::Matrix4;
use vi_core::isotropic::IsotropicBlocks;

/// The masses of each frame between its vectors `φ, d_1, d_2, d_3`, from a mass matrix over `dim`
/// coordinates; `None` where it has other entries than multiples of `I_3`, couples two frames, or
/// has coordinates of anything else.
pub(crate) fn body_masses(
    frames: usize,
    mass: &IsotropicBlocks,
    dim: usize,
) -> Option<Vec<Matrix4<f64>>> {
    if mass.entries() > 0 || dim != 12 * frames {
        return None;
    }
    let (mut masses, mut apart) = (vec![Matrix4::zeros(); frames], true);
    mass.for_each_multiple(|row, column, value| {
        apart &= row / 12 == column / 12 && row % 3 == 0 && column % 3 == 0;
        if apart {
            masses[row / 12][(row % 12 / 3, column % 12 / 3)] += value;
        }
    });
    let symmetric = masses.iter().all(|mass| *mass == mass.transpose());
    (apart && symmetric).then_some(masses)
}
