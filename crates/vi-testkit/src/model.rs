//! Texts of model files, part by part: a test states what differs, and appends further keys below a
//! part.

use nalgebra::{Matrix3, Rotation3, Vector3};
use std::fmt::Write;

/// The unit vectors of space.
pub const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The name of a model without gravity, and its settings: `step = 0.01, end = 1.0`.
pub fn head(name: &str, settings: &str) -> String {
    format!("model = {{ name = \"{name}\" }}\nsimulation = {{ {settings} }}\n")
}

/// The same under gravity.
pub fn heavy(name: &str, gravity: [f64; 3], settings: &str) -> String {
    format!(
        "model = {{ name = \"{name}\", gravity = {gravity:?} }}\nsimulation = {{ {settings} }}\n"
    )
}

/// The text with `old` replaced everywhere.
///
/// # Panics
///
/// Where the text does not contain it.
pub fn changed(text: &str, old: &str, new: &str) -> String {
    assert!(text.contains(old), "`{old}` is not in\n{text}");
    text.replace(old, new)
}

/// A part with its name; its keys follow.
pub fn part(section: &str, name: &str) -> String {
    format!("[[{section}]]\nname = \"{name}\"\n")
}

/// A frame that is turned by a rotation vector and moved.
pub fn frame(name: &str, turned: [f64; 3], position: [f64; 3]) -> String {
    format!("{}rotation_vector = {turned:?}\nposition = {position:?}\n", part("frame", name))
}

/// A point mass.
pub fn particle(name: &str, mass: f64, position: [f64; 3]) -> String {
    format!("{}mass = {mass:?}\nposition = {position:?}\n", part("particle", name))
}

/// A rigid body with its principal moments of inertia, at the origin.
pub fn body(name: &str, mass: f64, inertia: [f64; 3]) -> String {
    format!("{}mass = {mass:?}\ninertia = {inertia:?}\n", part("body", name))
}

/// The same with its centre of mass elsewhere.
pub fn body_at(position: [f64; 3], name: &str, mass: f64, inertia: [f64; 3]) -> String {
    format!("{}position = {position:?}\n", body(name, mass, inertia))
}

/// A joint without an axis, between parent and child.
pub fn joint(kind: &str, name: &str, [parent, child]: [&str; 2], position: [f64; 3]) -> String {
    let head = part("joint", name);
    format!(
        "{head}type = \"{kind}\"\nparent = \"{parent}\"\nchild = \"{child}\"\nposition = {position:?}\n"
    )
}

/// A joint along an axis.
pub fn along(
    axis: [f64; 3],
    kind: &str,
    name: &str,
    bodies: [&str; 2],
    position: [f64; 3],
) -> String {
    format!("{}axis = {axis:?}\n", joint(kind, name, bodies, position))
}

/// A revolute joint.
pub fn hinge(name: &str, bodies: [&str; 2], position: [f64; 3], axis: [f64; 3]) -> String {
    along(axis, "revolute", name, bodies, position)
}

/// A body on a slide along x.
pub fn slider(name: &str, slide: &str, mass: f64) -> String {
    let slide = along(AXES[0], "prismatic", slide, ["ground", name], [0.0; 3]);
    body(name, mass, [1.0; 3]) + &slide
}

/// Two links that hang from the ground on hinges about y, 1 m apart: `upper` by `shoulder`, which
/// has the keys `own[0]`, and `lower` by `elbow`.
pub fn two_links(masses: [f64; 2], inertias: [[f64; 3]; 2], own: [&str; 2]) -> String {
    let link = |k: usize, [name, pivot, parent]: [&str; 3], x: f64| {
        let at = [k as f64, 0.0, 0.0];
        body_at([x, 0.0, 0.0], name, masses[k], inertias[k])
            + &hinge(pivot, [parent, name], at, AXES[1])
            + own[k]
    };
    link(0, ["upper", "shoulder", "ground"], 0.5) + &link(1, ["lower", "elbow", "upper"], 1.4)
}

/// A bar, a spring or a constraint between a point of `from` and one of `to`.
pub fn between(section: &str, name: &str, [from, to]: [&str; 2]) -> String {
    format!("{}from = \"{from}\"\nto = \"{to}\"\n", part(section, name))
}

/// A point of the child on a line or a plane of the parent.
pub fn guide(
    kind: &str,
    name: &str,
    bodies: [&str; 2],
    position: [f64; 3],
    axis: [f64; 3],
) -> String {
    along(axis, kind, name, bodies, position).replace("[[joint]]", "[[constraint]]")
}

/// A gear between freedoms of two joints.
pub fn gear(name: &str, joints: [&str; 2], freedoms: [usize; 2], ratio: f64) -> String {
    let head = part("constraint", name);
    format!(
        "{head}type = \"gear\"\njoints = {joints:?}\nfreedoms = {freedoms:?}\nratio = {ratio:?}\n"
    )
}

/// The prescribed motion of a joint along a path, the value of its key.
pub fn motion(name: &str, joint: &str, path: &str) -> String {
    format!("{}type = \"motion\"\njoint = \"{joint}\"\npath = {path}\n", part("constraint", name))
}

/// A path that begins at rest: `amplitude · (1 − cos 2π frequency t)`.
pub fn to_and_fro(amplitude: f64, frequency: f64) -> String {
    let phase = -std::f64::consts::FRAC_PI_2;
    format!("{{ amplitude = {amplitude:?}, frequency = {frequency:?}, phase = {phase:?} }}")
}

/// A force at the centre of mass of a body, and a torque.
pub fn load(name: &str, body: &str, [force, torque]: [[f64; 3]; 2]) -> String {
    let head = part("load", name);
    format!("{head}body = \"{body}\"\nforce = {force:?}\ntorque = {torque:?}\n")
}

/// A sensor of a kind.
pub fn sensor(name: &str, kind: &str, of: &str) -> String {
    format!("{}type = \"{kind}\"\nof = \"{of}\"\n", part("sensor", name))
}

/// A beam through points; its section follows.
pub fn beam(name: &str, points: &[[f64; 3]], elements: usize) -> String {
    format!("{}points = {points:?}\nelements = {elements}\n", part("beam", name))
}

/// A beam `beam` of 1 m along x that is clamped at the origin.
pub fn cantilever(elements: usize, section: &str) -> String {
    let line = beam("beam", &[[0.0; 3], AXES[0]], elements);
    format!("{line}normal = {:?}\nstart = \"clamped\"\n{section}", AXES[2])
}

/// A section: `EA, GA1, GA2, EI1, EI2, GJ` and `rhoA, rhoI1, rhoI2`.
pub fn section(stiffness: [f64; 6], mass: [f64; 3]) -> String {
    let [ea, ga1, ga2, ei1, ei2, gj] = stiffness;
    let [a, i1, i2] = mass;
    let stiffness = format!(
        "EA = {ea:?}, GA1 = {ga1:?}, GA2 = {ga2:?}, EI1 = {ei1:?}, EI2 = {ei2:?}, GJ = {gj:?}"
    );
    format!("section = {{ {stiffness}, rhoA = {a:?}, rhoI1 = {i1:?}, rhoI2 = {i2:?} }}\n")
}

/// A soft section whose stiffnesses all differ.
pub fn soft_section() -> String {
    section([90.0, 25.0, 40.0, 0.4, 0.7, 0.3], [0.1, 1e-3, 2e-3])
}

/// A soft section with a relaxation time for each strain.
pub fn damped_section() -> String {
    let section = section([60.0, 25.0, 40.0, 0.4, 0.7, 0.3], [0.1, 1e-3, 2e-3]);
    let times = "EA = 3e-3, GA1 = 1e-3, GA2 = 2e-3, EI1 = 5e-3, EI2 = 4e-3, GJ = 6e-3";
    section.replace(" }", &format!(", damping = {{ {times} }} }}"))
}

/// A rigid body with its motion, and what Newton and Euler say of it.
#[derive(Clone, Copy, Debug)]
pub struct Rigid {
    /// kg.
    pub mass: f64,
    /// Principal moments of inertia, kg m².
    pub moments: [f64; 3],
    /// Centre of mass, m.
    pub center: [f64; 3],
    /// Rotation vector.
    pub turned: [f64; 3],
    /// Velocity of the centre, m/s.
    pub velocity: [f64; 3],
    /// Angular velocity in space, rad/s.
    pub spin: [f64; 3],
}

/// A body all of whose numbers differ.
pub const FIRST: Rigid = Rigid {
    mass: 1.7,
    moments: [0.3, 0.5, 0.6],
    center: [0.5, 0.2, -0.3],
    turned: [0.4, -0.3, 0.7],
    velocity: [0.3, -0.4, 0.8],
    spin: [0.5, 0.9, -0.6],
};

/// Another one.
pub const SECOND: Rigid = Rigid {
    mass: 0.8,
    moments: [0.2, 0.15, 0.25],
    center: [-0.6, 1.1, 0.4],
    turned: [-0.2, 0.6, 0.3],
    velocity: [-0.5, 0.2, 0.1],
    spin: [-0.7, 0.3, 0.4],
};

impl Rigid {
    /// Its part of a model file.
    pub fn text(&self, name: &str) -> String {
        let Self { velocity, spin, .. } = self;
        format!("{}velocity = {velocity:?}\nangular_velocity = {spin:?}\n", self.still(name))
    }

    /// The same at rest.
    pub fn still(&self, name: &str) -> String {
        let at = body_at(self.center, name, self.mass, self.moments);
        format!("{at}rotation_vector = {:?}\n", self.turned)
    }

    /// From its own axes to space.
    pub fn rotation(&self) -> Matrix3<f64> {
        Rotation3::new(self.turned.into()).into_inner()
    }

    /// From the centre to a point of the body, in space.
    pub fn arm(&self, point: [f64; 3]) -> Vector3<f64> {
        self.rotation() * Vector3::from(point)
    }

    /// A point of the body in space.
    pub fn place(&self, point: [f64; 3]) -> Vector3<f64> {
        Vector3::from(self.center) + self.arm(point)
    }

    /// The velocity of a point of the body.
    pub fn rate(&self, point: [f64; 3]) -> Vector3<f64> {
        Vector3::from(self.velocity) + Vector3::from(self.spin).cross(&self.arm(point))
    }

    /// Accelerations of the centre and of the rotation under a force at a point and a torque.
    pub fn accelerations(
        &self,
        point: [f64; 3],
        force: Vector3<f64>,
        torque: Vector3<f64>,
    ) -> [Vector3<f64>; 2] {
        let rotation = self.rotation();
        let inertia =
            rotation * Matrix3::from_diagonal(&self.moments.into()) * rotation.transpose();
        let spin = Vector3::from(self.spin);
        let moment = torque + self.arm(point).cross(&force) - spin.cross(&(inertia * spin));
        let turning = inertia.lu().solve(&moment);
        [force / self.mass, turning.unwrap_or_else(|| Vector3::repeat(f64::NAN))]
    }
}

/// An arm and a hand beside it, each with the keys `own`; the arm moves.
pub fn arm_and_hand(own: &str) -> String {
    let arm = body_at([0.1, 0.2, 0.0], "arm", 1.0, [0.03, 0.02, 0.04]);
    let tensor = "[[0.03, 0.002, 0.0], [0.002, 0.02, 0.001], [0.0, 0.001, 0.04]]";
    let arm = arm.replace("[0.03, 0.02, 0.04]", tensor);
    let motion = "rotation_vector = [0.2, 0.1, -0.4]\nvelocity = [0.3, -0.2, 0.1]\n\
                  angular_velocity = [0.5, 1.0, -1.5]\n";
    let hand = body_at([0.4, 0.1, 0.1], "hand", 0.5, [0.01, 0.02, 0.015]);
    format!("{arm}{motion}{own}{hand}rotation_vector = [-0.3, 0.8, 0.2]\n{own}")
}

/// The surface of a cube of length 1 about the origin, each face in `squares` by `squares`: the
/// text of an `.obj` file.
#[must_use]
pub fn cube_of_squares(squares: usize) -> String {
    let (mut text, mut count) = (String::new(), 0);
    for face in 0..6 {
        let (axis, side) = (face / 2, face % 2);
        for (i, j) in (0..squares).flat_map(|i| (0..squares).map(move |j| (i, j))) {
            let mut around = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            if side == 0 {
                around.reverse();
            }
            for (i, j) in around {
                let at = |k: usize| k as f64 / squares as f64 - 0.5;
                let mut x = [side as f64 - 0.5; 3];
                (x[(axis + 1) % 3], x[(axis + 2) % 3]) = (at(i), at(j));
                let _ = writeln!(text, "v {} {} {}", x[0], x[1], x[2]);
            }
            let _ = writeln!(text, "f {} {} {} {}", count + 1, count + 2, count + 3, count + 4);
            count += 4;
        }
    }
    text
}
