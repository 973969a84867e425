//! Models whose sensors need forces, orientations and accelerations.

use super::tests::LINKAGE;

/// A tree with a hinge and a slide, bars between point masses, a body on a bushing; with a spring,
/// a damper, a bumper, friction, a motor and laws.
pub(super) const FORCES: &str = r#"
[model]
name = "forces"
gravity = [0.0, 0.0, "= -g"]
[simulation]
step = 0.01
end = 0.3
[parameters]
g = 9.81
k = 6.0
c = 0.4
length = 0.8
mass = 1.6
[[body]]
name = "upper"
position = ["= length/2", 0.0, 0.0]
shape = { type = "box", dimensions = ["= length", 0.05, 0.04], density = 780.0 }
[[body]]
name = "lower"
position = ["= 1.4*length", 0.0, 0.0]
shape = { type = "box", dimensions = [0.6, 0.05, 0.03], density = 780.0 }
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.2]
rate = -3.0
spring = { stiffness = "= k", rest = 0.2 }
damper = { damping = "= c" }
limits = [-0.05, 0.02]
bumper = { stiffness = 40.0, damping = 0.05 }
friction = { torque = 0.3, model = { type = "stribeck", transition_velocity = 0.5 } }
motor = { effort = "= 2*c", history = "cos(k*t)", proportional = "= k", derivative = 0.3, path = "0.2*c*t" }
[[joint]]
name = "slide"
type = "prismatic"
parent = "upper"
child = "lower"
position = ["= length", 0.0, 0.0]
axis = [1.0, 0.1, "= 0.2*length"]
rate = 0.4
spring = { stiffness = "= 15*k", rest = 0.05 }
damper = { damping = 3.0 }
[[particle]]
name = "bob"
mass = 0.4
position = [0.0, 2.0, -0.7]
velocity = [0.4, 0.0, 0.0]
[[particle]]
name = "end"
mass = "= 0.2*mass"
position = [0.3, 2.0, -0.7]
velocity = [0.4, 0.3, 0.0]
[[bar]]
name = "string"
from = "ground"
to = "bob"
point = [0.0, 2.0, 0.0]
[[bar]]
name = "rod"
from = "bob"
to = "end"
[[body]]
name = "box"
position = [0.0, 3.0, 0.2]
velocity = [0.4, -0.3, 0.2]
angular_velocity = [0.5, -0.3, 0.8]
shape = { type = "box", dimensions = [0.3, 0.2, 0.1], density = 300.0 }
[[spring]]
name = "tie"
from = "lower"
to = "bob"
point_from = ["= 0.1*length", 0.0, 0.1]
stiffness = "= 4*k"
natural_length = "= 2*length"
damping = "= c"
[[bushing]]
name = "mount"
from = "ground"
to = "box"
position = [0.0, 3.0, 0.2]
stiffness = ["= 100*k", 900.0, 800.0, 5.0, "= k", 3.0]
damping = [3.0, "= 9*c", 2.0, 0.1, 0.1, "= c"]
[[law]]
name = "along"
joint = "slide"
effort = "-k*x - 2*x^3 - c*abs(v)*v + sin(3*t)"
[[law]]
name = "pulls"
from = "ground"
to = "end"
point_from = [0.3, 2.0, 1.0]
tension = "k*max(x - 0.5, 0)^2 + c*v*exp(-3*x)"
[[law]]
name = "blows"
on = "box"
point = [0.1, 0.0, 0.0]
force = ["-c*vx", "2", "k*sin(3*t)"]
torque = ["0", "-c*wy", "-k*wz*x"]
[[law]]
name = "lifts"
on = "bob"
force = ["-k*x", "3 - c*vy*hypot(vx, vy) - k*x", "0"]
[[control]]
name = "drive"
joint = "shoulder"
hold = 10
"#;

/// A load that turns with a body and one that keeps its direction, beside [`FORCES`].
pub(super) const LOADS: &str = r#"
[[load]]
name = "push"
body = "box"
force = ["= c", 0.4, 0.3]
torque = [0.1, "= 0.1*k", 0.0]
point = [0.1, "= 0.1*length", 0.0]
frame = "body"
history = "cos(k*t)"
[[load]]
name = "weighs"
body = "lower"
force = [0.0, 0.2, "= -c"]
"#;

/// A bushing and laws that read joints and other bodies: none of these may change.
pub(super) const READING: &str = r#"
[[bushing]]
name = "soft"
from = "ground"
to = "box"
position = [0.1, 3.0, 0.2]
stiffness = ["100*k*(1 + 3*x1^2) - 9*c*x2", 900.0, "80*shoulder + 500", 5.0, "= k", 7.0]
damping = [3.0, "9*c*(1 + v2^2)", 2.0, 0.1, 0.1, 0.2]
[[law]]
name = "follows"
on = "lower"
relative_to = "upper"
force = ["-c*vx", "0", "-k*z"]
axes = "body"
"#;

/// Laws that read signals with states, beside [`held`].
pub(super) const LAGGING: &str = r#"
[[signal]]
name = "slow"
filter = { of = "slide", time_constant = 0.05 }
[[signal]]
name = "steers"
pid = { of = "0.2*shoulder - slide", proportional = 4.0, integral = 30.0, derivative = 0.3, filter = 0.04 }
[[signal]]
name = "grows"
value = "k*slow^2 + sin(shoulder)"
[[law]]
name = "lags"
joint = "slide"
effort = "-k*slow - 2*x + steers"
[[law]]
name = "swims"
on = "box"
force = ["-c*vx*(1 + slow)", "steers", "-k*slow*z"]
"#;

/// Signals with states whose numbers and expressions change, and laws that read them.
pub(super) const TUNED: &str = r#"
[[signal]]
name = "slow"
filter = { of = "slide + 0.02*k*shoulder", time_constant = "= 0.1*c" }
start = "= 0.05*k"
[[signal]]
name = "steers"
pid = { of = "0.05*k*shoulder - slide - 0.1*slow", proportional = "= k - 2", integral = "= 5*k", derivative = "= 0.75*c", filter = "= 0.1*c", feedforward = "c*sin(k*t)" }
[[signal]]
name = "bounded"
pid = { of = "0.3*c - shoulder", proportional = "= 0.3*k", integral = "= 10*k", limits = ["= -0.2*k", "= 2*c"], tracking = "= 0.1*c" }
[[signal]]
name = "charge"
rate = "k*slide - c*charge + 0.1*steers"
[[signal]]
name = "shaped"
transfer = { of = "shoulder + 0.1*bounded", numerator = ["= 0.5*c", "= k", 3.0], denominator = [1.0, "= 2*k", "= 90*c"] }
[[signal]]
name = "grows"
value = "k*slow^2 + charge + sin(shoulder)"
[[law]]
name = "lags"
joint = "slide"
effort = "-k*slow - 2*x + steers + 0.1*grows"
[[law]]
name = "swims"
on = "box"
force = ["-c*vx*(1 + slow)", "steers + bounded", "-k*slow*z + shaped"]
"#;

/// A bushing that reads a signal of [`LAGGING`] or [`TUNED`].
pub(super) const SLACK: &str = r#"
[[bushing]]
name = "slack"
from = "ground"
to = "box"
position = [0.1, 3.0, 0.2]
stiffness = ["100*k*(1 + slow)", 900.0, 700.0, 5.0, "= k", 7.0]
damping = [3.0, "9*c*(1 + slow)", 2.0, 0.1, 0.1, 0.2]
"#;

/// Sensors of these: type, of what, choices, numbers.
pub(super) const LAGS: [(&str, &str, &str, &[&str]); 12] = [
    ("effort", "lags", "", &[""]),
    ("effort", "swims", "", &["fx", "fz"]),
    ("effort", "slack", "", &["fx", "fy"]),
    ("power", "lags", "", &[""]),
    ("power", "swims", "", &[""]),
    ("power", "slack", "", &[""]),
    ("work", "lags", "", &[""]),
    ("work", "swims", "", &[""]),
    ("work", "slack", "", &[""]),
    ("acceleration", "lower", "", &["z"]),
    ("joint_acceleration", "slide", "", &[""]),
    ("expression", "", "value = \"k*slow + steers*slide.rate - grows\"\n", &[""]),
];

/// [`FORCES`] with [`READING`], the geometry held.
pub(super) fn held() -> String {
    let text = format!("{FORCES}{READING}").replace("\nlength = 0.8\n", "\n");
    text.replace("*length", "*0.8").replace("\"= length", "\"= 0.8")
}

/// The linkage with a law that reads another joint, the geometry held.
pub(super) fn far() -> String {
    let held = LINKAGE.replace("\ncoupler = 0.9\nground = 0.8\n", "\n");
    let held = held.replace("coupler/2", "0.9/2").replace("= ground\"", "= 0.8\"");
    let law = "[[law]]\nname = \"far\"\njoint = \"pivot\"\n\
               effort = \"-stiffness*sin(shaft) - 0.4*shaft.rate + mass*x\"\n";
    without_objectives(&format!("{held}{law}"))
}

/// A model without its objectives.
pub(super) fn without_objectives(text: &str) -> String {
    let mut kept = String::new();
    for (k, part) in text.split("[[").enumerate() {
        if !part.starts_with("objective]]") {
            kept += if k == 0 { "" } else { "[[" };
            kept += part;
        }
    }
    kept
}

/// Sensors of efforts and powers: type and of what, and their numbers.
pub(super) const EFFORTS: [(&str, &str, &[&str]); 19] = [
    ("effort", "shoulder", &["spring", "damper", "bumper", "friction", "motor"]),
    ("effort", "slide", &["spring", "damper"]),
    ("effort", "tie", &[""]),
    ("effort", "mount", &["fx", "fy", "mz"]),
    ("effort", "soft", &["fx", "fy", "fz", "my"]),
    ("effort", "along", &[""]),
    ("effort", "pulls", &[""]),
    ("effort", "blows", &["fx", "fz", "my", "mz"]),
    ("effort", "follows", &["fx", "fz"]),
    ("effort", "lifts", &["fx", "fy"]),
    ("power", "shoulder", &["spring", "bumper", "friction", "motor"]),
    ("power", "tie", &[""]),
    ("power", "mount", &[""]),
    ("power", "soft", &[""]),
    ("power", "along", &[""]),
    ("power", "pulls", &[""]),
    ("power", "blows", &[""]),
    ("power", "follows", &[""]),
    ("power", "lifts", &[""]),
];

/// Sensors of works: of what, and their numbers.
pub(super) const WORKS: [(&str, &[&str]); 11] = [
    ("shoulder", &["spring", "damper", "bumper", "friction", "motor"]),
    ("slide", &["spring", "damper"]),
    ("tie", &[""]),
    ("mount", &[""]),
    ("along", &[""]),
    ("pulls", &[""]),
    ("blows", &[""]),
    ("lifts", &[""]),
    ("push", &[""]),
    ("weighs", &[""]),
    ("drags", &[""]),
];

/// A load on a point mass, beside [`LOADS`].
pub(super) const DRAGGED: &str = r#"
[[load]]
name = "drags"
body = "end"
force = ["= k", "= -c", 0.3]
history = "sin(k*t)"
"#;

/// Sensors of orientations: of what, and seen from where.
pub(super) const ORIENTATIONS: [(&str, &str); 2] =
    [("box", ""), ("lower", "seen_from = \"box\"\n")];

/// Two hinged bodies that a distance holds, with a spring.
pub(super) const HELD: &str = r#"
[model]
name = "held"
gravity = [0.0, 0.0, "= -g"]
[simulation]
step = 0.01
end = 0.3
project_start = true
[parameters]
g = 9.81
k = 6.0
mass = 1.6
reach = 0.4
span = 1.0440306508910551
[[body]]
name = "left"
position = [0.0, 0.0, -0.5]
mass = 0.8
inertia = [0.02, 0.03, 0.015]
[[body]]
name = "right"
position = [1.0, 0.0, "= -reach"]
mass = "= mass"
inertia = [0.01, 0.02, 0.015]
[[joint]]
name = "one"
type = "revolute"
parent = "ground"
child = "left"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = 2.0
spring = { stiffness = "= k", rest = 0.1 }
[[joint]]
name = "other"
type = "revolute"
parent = "ground"
child = "right"
position = [1.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[constraint]]
name = "tether"
type = "distance"
from = "left"
to = "right"
point_from = [0.0, 0.0, -0.2]
point_to = [0.1, 0.0, 0.0]
length = "= span"
"#;

/// A cart that a motion drives along its rail.
pub(super) const DRIVEN: &str = r#"
[[body]]
name = "cart"
position = [0.0, 5.0, 0.0]
mass = "= mass"
inertia = [0.01, 0.02, 0.015]
[[joint]]
name = "rail"
type = "prismatic"
parent = "ground"
child = "cart"
position = [0.0, 5.0, 0.0]
axis = [1.0, 0.0, "= 0.1*k"]
damper = { damping = 0.7 }
[[constraint]]
name = "drives"
type = "motion"
joint = "rail"
path = "0.1*k*t^2"
"#;

/// A nut on a thread with a spring, and an arm on it that a spring between points pulls.
pub(super) const THREADED: &str = r#"
[model]
name = "threaded"
gravity = [0.0, 0.0, "= -g"]
[simulation]
step = 0.01
end = 0.3
[parameters]
g = 9.81
k = 6.0
mass = 1.6
[[body]]
name = "nut"
position = [0.1, 0.0, 0.0]
mass = 0.8
inertia = [0.02, 0.03, 0.015]
[[body]]
name = "arm"
position = [0.5, 0.0, 0.2]
mass = "= mass"
inertia = [0.01, 0.02, 0.015]
[[joint]]
name = "thread"
type = "screw"
pitch = 0.05
parent = "ground"
child = "nut"
position = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
rate = 2.0
spring = { stiffness = "= k", rest = 0.4 }
damper = { damping = 0.2 }
[[joint]]
name = "hinge"
type = "revolute"
parent = "nut"
child = "arm"
position = [0.2, 0.0, 0.0]
axis = [0.0, 1.0, 0.3]
[[spring]]
name = "tie"
from = "ground"
to = "arm"
point_from = [0.0, 0.4, 1.0]
point_to = [0.2, 0.0, 0.1]
stiffness = "= 4*k"
natural_length = 0.5
damping = 0.7
"#;

/// A link on a ball joint of another one, which a spring turns.
pub(super) const BALLS: &str = r#"
[model]
name = "balls"
gravity = [0.0, 0.0, "= -g"]
[simulation]
step = 0.01
end = 0.3
[parameters]
g = 9.81
k = 6.0
mass = 1.6
tilt = 0.3
[[body]]
name = "upper"
position = [0.3, 0.0, 0.0]
mass = 0.8
inertia = [0.02, 0.03, 0.015]
[[body]]
name = "lower"
position = [0.8, 0.1, 0.0]
mass = "= mass"
inertia = [0.01, 0.03, 0.025]
[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.1]
rate = 2.0
damper = { damping = 0.2 }
[[joint]]
name = "ball"
type = "spherical"
parent = "upper"
child = "lower"
position = [0.6, 0.0, 0.0]
axis = [0.1, "= tilt", 1.0]
[[spring]]
name = "tie"
from = "ground"
to = "lower"
point_from = [0.9, 0.4, 1.0]
point_to = [0.2, 0.0, 0.1]
stiffness = "= 4*k"
natural_length = 0.5
damping = 0.7
[[control]]
name = "drive"
joint = "hinge"
hold = 10
"#;

/// Rotation vector, rates and accelerations of the ball joint: type, of what, choices, numbers.
pub(super) const TURNS: [(&str, &str, &str, &[&str]); 3] = [
    ("joint_coordinate", "ball", "", &["x", "y", "z"]),
    ("joint_rate", "ball", "", &["x", "y", "z"]),
    ("joint_acceleration", "ball", "", &["x", "y", "z"]),
];

/// Sensors of reactions and efforts of constraints: type, of what, choices, numbers.
pub(super) const REACTIONS: [(&str, &str, &str, &[&str]); 8] = [
    ("reaction", "shoulder", "", &["fx", "fy", "mx"]),
    ("reaction", "shoulder", "frame = \"child\"\n", &["fx", "mx"]),
    ("reaction", "shoulder", "frame = \"space\"\n", &["fz", "mx", "mz"]),
    ("reaction", "slide", "", &["fy", "mz"]),
    ("reaction", "slide", "frame = \"space\"\n", &["fz", "my"]),
    ("reaction", "string", "", &["tension"]),
    ("reaction", "rod", "", &["tension"]),
    ("power", "slide", "", &["spring"]),
];

/// Sensors of accelerations: type, of what, choices, numbers.
pub(super) const ACCELERATIONS: [(&str, &str, &str, &[&str]); 6] = [
    ("acceleration", "lower", "point = [0.2, \"= 0.1*length\", 0.1]\n", &["x", "z"]),
    ("acceleration", "end", "", &["y"]),
    ("angular_acceleration", "box", "", &["x", "z"]),
    (
        "imu",
        "lower",
        "point = [\"= 0.1*length\", 0.0, 0.1]\nrotation_vector = [0.1, 0.4, -0.2]\n",
        &["ax", "az", "gy"],
    ),
    ("joint_acceleration", "shoulder", "", &[""]),
    ("joint_acceleration", "slide", "", &[""]),
];

/// A model without its controls.
pub(super) fn without_controls(text: &str) -> String {
    let mut kept = String::new();
    for (k, part) in text.split("[[").enumerate() {
        if !part.starts_with("control]]") {
            kept += if k == 0 { "" } else { "[[" };
            kept += part;
        }
    }
    kept
}

/// A model of which nothing dissipates, for compositions.
pub(super) fn conservative() -> String {
    let start = FORCES.find("[[bushing]]\nname = \"mount\"").unwrap();
    let from = FORCES.find("damper = { damping = \"= c\" }").unwrap();
    let to = FORCES.find("[[joint]]\nname = \"slide\"").unwrap();
    let text = format!("{}{}", &FORCES[..from], &FORCES[to..start]);
    let text = text.replace("damper = { damping = 3.0 }\n", "");
    text.replace("damping = \"= c\"\n", "").replace("c = 0.4\n", "")
}
