//! A robot of which nothing with mass moves.

use crate::remark::NAMED;
use crate::robot::Robot;
use crate::source::Refusal;
use crate::{Base, ImportOptions};

/// Why no body is left, and what helps.
pub(crate) fn nothing_moves(robot: &Robot, options: &ImportOptions) -> Refusal {
    let mut message = "nothing with mass moves".to_owned();
    let unread: Vec<String> =
        robot.unread.iter().map(|mesh| format!("{} ({})", mesh.file, mesh.reason)).collect();
    if !unread.is_empty() && (options.density.is_some() || robot.format == "MJCF") {
        message += &format!("; meshes that could not be read: {}", some(&unread));
    }
    let mut help = Vec::new();
    if !robot.shapes_without_mass.is_empty() {
        let links = some(&robot.shapes_without_mass);
        let lost = match unread.is_empty() {
            true => String::new(),
            false => {
                format!(", which needs these meshes, that could not be read: {}", some(&unread))
            }
        };
        help.push(format!(
            "`--density RHO` gives links that have geometry and no <inertial> ({links}) a mass, as `--density 2700` does{lost}"
        ));
    } else if !unread.is_empty() {
        help.push("put the meshes where the description names them; `package://NAME/…` is looked for in the folders above it".to_owned());
    }
    help.push("state the mass of a link behind a joint".to_owned());
    if robot.format == "URDF" && options.base == Base::Fixed {
        help.push("the root link of a URDF robot moves with `--free-base`".to_owned());
    }
    Refusal::of_all(message, help.join("; "))
}

/// The first of some names.
pub(crate) fn some(names: &[String]) -> String {
    let first = names.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    if names.len() > NAMED { format!("{first}, … ({} in all)", names.len()) } else { first }
}
