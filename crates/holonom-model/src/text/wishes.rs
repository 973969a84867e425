//! What other programs have under names that no key, type or section of a model file has, and what
//! there is here instead.

/// Words, and the answer to them.
type Wish = (&'static [&'static str], &'static str);

const WISHES: [Wish; 34] = [
    (&["parallel", "threads", "gpu", "cores"], "a run uses one core; `holonom sweep` uses all"),
    (
        &[
            "collision",
            "restitution",
            "bounce",
            "penetration",
            "floor",
            "obstacle",
            "wall",
            "contact_pair",
            "ground_contact",
            "collide",
            "contype",
            "conaffinity",
        ],
        "bodies touch planes and one another in a [[contact]]: a = { plane = { position = …, normal = … } } or a body, b = [\"ball*\"], \
         `friction`, `restitution`; their shapes are `collision` or `shape` of the [[body]]. Stops of a joint are its `limits`",
    ),
    (
        &["rolling_friction", "rolling_resistance", "torsional_friction", "spinning_friction"],
        "a [[contact]] has no resistance to rolling or spinning",
    ),
    (
        &["mu_s", "mu_static", "static_coefficient"],
        "static friction is `static_friction` of a rigid [[contact]], and `static_ratio` of the friction of a joint or of a `model`: static over \
         sliding friction",
    ),
    (
        &[
            "contact_stiffness",
            "contact_damping",
            "hertz",
            "hunt_crossley",
            "penalty",
            "solref",
            "solimp",
        ],
        "a [[contact]] is rigid, or compliant with model = { type = \"hunt_crossley\", stiffness = …, exponent = 1.5, dissipation = … }",
    ),
    (
        &[
            "friction",
            "coulomb",
            "stiction",
            "mu",
            "mu_k",
            "dry_friction",
            "frictionloss",
            "friction_coefficient",
            "coefficient_of_friction",
        ],
        "dry friction of a joint is `friction = { torque = … }`, `{ force = … }` or `{ coefficient = …, radius = … }` of a \
         [[joint]], that of bodies which touch `friction` of a [[contact]]; viscous friction is `damper = { damping = … }` of a joint, `damping` of a [[spring]]",
    ),
    (
        &[
            "limit",
            "lower",
            "upper",
            "stop",
            "end_stop",
            "joint_limit",
            "joint_stop",
            "range",
            "min",
            "max",
            "lower_limit",
            "upper_limit",
            "min_angle",
            "max_angle",
            "bounds",
        ],
        "stops of a joint are `limits = [lower, upper]` of a [[joint]], or a table with `restitution`; a `bumper` makes them \
         elastic. A [[sensor]] of type \"joint_coordinate\" shows the coordinate",
    ),
    (
        &["bush", "mount", "compliance", "isolator", "sixdof_spring", "field"],
        "write a [[bushing]]: stiffness and damping between two frames, six numbers or 6 by 6",
    ),
    (
        &[
            "rolling",
            "roll",
            "wheel",
            "no_slip",
            "nonholonomic",
            "rolling_contact",
            "knife_edge",
            "skate",
        ],
        "a wheel or a sphere that rolls on a plane is a [[constraint]] of type \"rolling\", an edge that does not slide \
         sideways one of type \"blade\". A rack and its pinion, or two gears, are one of type \"gear\"",
    ),
    (
        &[
            "release",
            "detach",
            "disconnect",
            "break",
            "attach",
            "deactivate",
            "activate",
            "lock",
            "unlock",
            "fuse",
        ],
        "an [[event]] releases joints, bars, constraints, springs and laws, and locks joint coordinates, when a condition becomes \
         true",
    ),
    (
        &["trigger", "switch", "when", "if", "zero_crossing", "terminate", "halt"],
        "an [[event]] acts `when` a condition becomes true, or `at` a time: it releases, locks, enables, disables parts, or ends the \
         run. A load and a motor have a `history` of their own, a motion has a `path`",
    ),
    (
        &["armature", "rotor_inertia", "reflected_inertia", "motor_inertia", "gear_ratio"],
        "a rotor is a [[body]] of its own with a revolute joint, and a [[constraint]] of type \"gear\" couples it",
    ),
    (
        &[
            "mimic",
            "multiplier",
            "follow",
            "coupler",
            "coupling",
            "rack",
            "pulley",
            "differential",
            "gearbox",
            "transmission",
            "equality",
            "rack_and_pinion",
            "belt",
        ],
        "a joint follows another by a [[constraint]] of type \"gear\": joints = [\"a\", \"b\"], ratio = …, \
         θ_a + ratio θ_b is constant",
    ),
    (
        &["tire", "tyre", "pacejka", "magic_formula", "slip", "road"],
        "forces of a tire by its slip are not modelled. One that rolls without slipping is a [[constraint]] of type \"rolling\"; a \
         [[law]] on a body is a force by its positions and velocities",
    ),
    (
        &[
            "adaptive",
            "variable_step",
            "rtol",
            "atol",
            "reltol",
            "abstol",
            "max_step",
            "min_step",
            "step_size_control",
            "error_control",
            "initial_step",
            "rel_tol",
            "abs_tol",
            "relative_tolerance",
            "absolute_tolerance",
        ],
        "the step is constant: `step`. `order` raises the accuracy, `on_failure = \"substep\"` divides a step that is \
         refused, `holonom verify` recommends a step",
    ),
    (
        &[
            "controller",
            "pid",
            "feedback",
            "servo",
            "regulator",
            "integral",
            "ki",
            "setpoint",
            "target",
            "reference",
        ],
        "a controller is a [[signal]] with `pid`, `filter` or `transfer`, sampled with `every`; the `effort` of a [[law]] reads it. A \
         `motor` of a joint has gains `proportional` and `derivative` about its `path`",
    ),
    (
        &["cable", "rope", "tendon", "string", "wire", "chain", "muscle", "sling"],
        "a rope is a [[beam]] with `element = \"rope\"`: it carries tension only and starts in its catenary. One without mass that stays \
         taut is a [[constraint]] of type \"distance\", one that goes slack a [[law]]. Through several points \
         without friction it pulls by a [[law]] for each part, which reads a [[signal]] of the sum of their lengths, sensors of `distance`. Ropes with mass over pulleys are not modelled",
    ),
    (
        &[
            "drag",
            "lift",
            "wind",
            "aerodynamics",
            "fluid",
            "buoyancy",
            "water",
            "hydraulic",
            "pneumatic",
            "air",
        ],
        "forces of fluids are written down: a [[law]] on a body or a point is an expression of its positions and velocities, such as \
         drag; a [[load]] with a `history` is a given force",
    ),
    (
        &[
            "plate",
            "shell",
            "solid",
            "fem",
            "finite_element",
            "flexible_body",
            "superelement",
            "craig_bampton",
            "modal_body",
            "flexible",
            "cloth",
            "membrane",
            "deformable",
        ],
        "flexible bodies are beams: [[beam]]. Plates, solids and reduced bodies of finite element programs are not modelled",
    ),
    (
        &[
            "plasticity",
            "yield",
            "hysteresis",
            "creep",
            "thermal",
            "temperature",
            "fatigue",
            "fracture",
        ],
        "materials are linear elastic, with `damping` of a section",
    ),
    (
        &["cam", "curve", "point_on_curve", "slot", "contour", "follower"],
        "a cam that holds contact is the `path` of a [[constraint]] of type \"motion\"; points are held on straight lines and \
         planes: \"point_on_line\", \"point_on_plane\"",
    ),
    (
        &["backlash", "clearance", "play", "gap", "freeplay"],
        "joints have no clearance. A joint of more freedoms with a [[law]] that is zero in the middle has: \
         effort = \"-1e6*(max(x - 1e-4, 0) + min(x + 1e-4, 0))\"",
    ),
    (
        &[
            "python",
            "script",
            "function",
            "formula",
            "expression",
            "equation",
            "user",
            "plugin",
            "subroutine",
            "code",
            "matlab",
        ],
        "forces by expressions of time, positions and velocities are a [[law]], states of their own a [[signal]]; functions of time \
         stand in a `history` or a `path`. Functions in Python act by the package: holonom.simulate(…, laws=…, forces=…)",
    ),
    (
        &["fmu", "fmi", "cosimulation", "co_simulation"],
        "a model becomes a functional mock-up unit by `holonom export-fmu`; one of another program is not read",
    ),
    (
        &["unit", "units", "degrees", "length_unit", "angle_unit"],
        "all numbers are in SI units, angles in rad; \"= 30*deg\" and \"= 12/1000\" convert them",
    ),
    (
        &["output", "result", "log", "record", "probe", "measure", "monitor", "plot", "request"],
        "what is measured is a [[sensor]]; `every` and `columns` under [simulation] say what is recorded, \
         `holonom run MODEL -o DIR` where",
    ),
    (
        &["initial", "initial_condition", "ic", "state", "q0", "v0", "qpos", "qvel", "start"],
        "initial values stand with the parts: `position`, orientation and velocities of a [[body]], `rate` of a [[joint]]",
    ),
    (
        &[
            "newmark",
            "hht",
            "generalized_alpha",
            "bdf",
            "rk4",
            "rk45",
            "ode45",
            "ode15s",
            "euler_scheme",
            "runge_kutta",
            "implicit_euler",
            "semi_implicit",
            "verlet",
            "dassl",
            "ida",
            "radau",
            "gstiff",
            "leapfrog",
            "rattle",
        ],
        "schemes are variational or energy–momentum ones with a constant step: scheme = \"nodal\" with order = 2 to 16, \
         \"em-nodal\"",
    ),
    (
        &["random", "noise", "stochastic", "psd", "spectrum"],
        "there are no random inputs: a `history` of type \"table\" takes values made elsewhere",
    ),
    (
        &["optimization", "optimise", "design", "optimal_control", "design_variable"],
        "`holonom optimize MODEL` finds parameters and controls: [optimize] says what is free, [[control]], [[objective]] and \
         [[condition]] what is wanted",
    ),
    (
        &[
            "identification",
            "calibration",
            "calibrate",
            "estimate",
            "estimation",
            "fit",
            "parameter_estimation",
        ],
        "unknown numbers are found by `holonom identify MODEL DATA.csv`: [identify] names them, [[measurement]] puts sensors beside \
         columns of data",
    ),
    (
        &["monte_carlo", "sweep"],
        "parameters are varied by the program: `holonom sweep MODEL --vary KEY=A:B:N`",
    ),
    (
        &["magnet", "magnetic", "electric", "voltage", "current", "circuit", "charge"],
        "electric and magnetic parts are written down: a [[signal]] with a `rate` is the equation of a circuit, a [[law]] its force",
    ),
    (
        &["import", "urdf", "mjcf", "cad", "step_file", "iges"],
        "robots in URDF and MJCF are translated by `holonom import`; model files are included by `include = [\"part.toml\"]`; a \
         shape of type \"mesh\" reads STL and OBJ",
    ),
];

/// Sections of other programs for what stands elsewhere here.
const SECTIONS: [Wish; 8] = [
    (
        &["actuator", "drive", "driver", "motor", "prescribed", "imposed", "input", "motion_input"],
        "a drive with a force is `motor = { … }` of a [[joint]], or a [[law]] with a characteristic; a prescribed motion is a [[constraint]] of type \"motion\" with a \
         `path`",
    ),
    (
        &["motion", "distance", "gear", "point_on_line", "point_on_plane", "blade"],
        "it is a [[constraint]] with this `type`",
    ),
    (
        &[
            "spring_damper",
            "rotational_spring",
            "torsion_spring",
            "torsional_spring",
            "damper",
            "dashpot",
            "shock",
        ],
        "between points: [[spring]] with `stiffness` and `damping`; along a joint coordinate: `spring = { stiffness = … }` and \
         `damper = { damping = … }` of the [[joint]]",
    ),
    (
        &["force", "torque", "moment", "thrust", "thruster", "pressure"],
        "forces and torques are a [[load]]: body = \"…\", force = [x, y, z], torque = [x, y, z], history = { … }",
    ),
    (
        &["hinge_joint", "link", "part", "rigid_body", "solid_body", "mass", "inertial"],
        "a rigid body is a [[body]], a point mass a [[particle]]",
    ),
    (
        &["material", "geometry", "geom", "visual", "collision_geometry", "mesh"],
        "`shape = { type = …, density = … }` of a [[body]] gives mass and picture; `material` belongs to the section of a [[beam]]",
    ),
    (
        &["solver_settings", "settings", "options", "integrator", "time", "analysis", "option"],
        "the scheme, its step and the end time stand under [simulation]",
    ),
    (
        &["world", "ground", "environment", "gravity_field", "gravitation"],
        "the inertial frame is called `ground`; gravity is `gravity = [0, 0, -9.81]` under [model]",
    ),
];

/// What there is instead of something that model files do not have.
pub(crate) fn answer(word: &str) -> Option<&'static str> {
    among(&WISHES, word)
}

/// The same for a section.
pub(crate) fn answer_to_section(word: &str) -> Option<&'static str> {
    answer(word).or_else(|| among(&SECTIONS, word))
}

fn among(wishes: &[Wish], word: &str) -> Option<&'static str> {
    let plain = word.to_lowercase().replace(['-', ' '], "_");
    let one = plain.strip_suffix('s');
    let is = |known: &&str| *known == plain || Some(*known) == one;
    wishes.iter().find(|(words, _)| words.iter().any(is)).map(|(_, answer)| *answer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::sections::{LISTS, TABLES};
    use std::collections::BTreeSet;

    #[test]
    fn every_word_has_one_answer_and_no_section_is_wished_for() {
        let mut known = BTreeSet::new();
        for word in WISHES.iter().chain(&SECTIONS).flat_map(|(words, _)| words.iter()) {
            assert!(known.insert(*word), "`{word}` stands twice");
            assert!(answer_to_section(word).is_some());
            assert!(!TABLES.contains(word) && !LISTS.contains(word));
        }
        assert_eq!(answer("Limits"), answer("limit"));
        assert_eq!(answer("dry-friction"), answer("friction"));
        assert_eq!(answer("masse"), None);
    }
}
