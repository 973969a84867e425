//! Models in equilibrium, for tests of gradients.

/// A parallelogram on a spring: a closed loop with redundant rows, pushed aside by a load that
/// grows, with a weight.
pub(super) const FRAME: &str = r#"
model = { name = "frame", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.25, end = 1.0, scheme = "static" }
parameters = { width = 0.8, mass = 0.7, stiffness = 14.0, push = 6.0, arm = 0.1, rest = 0.15 }
[[body]]
name = "left"
mass = 0.5
inertia = [0.02, 0.03, 0.02]
position = [0.0, 0.0, 0.3]
[[body]]
name = "top"
mass = "= mass"
inertia = [0.02, "= 0.04*mass", 0.03]
position = ["= width/2", 0.0, 0.6]
[[body]]
name = "right"
mass = 0.5
inertia = [0.02, 0.03, 0.02]
position = ["= width", 0.0, 0.3]
[[joint]]
name = "a"
type = "revolute"
parent = "ground"
child = "left"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= stiffness", rest = "= rest" }
[[joint]]
name = "b"
type = "revolute"
parent = "left"
child = "top"
position = [0.0, 0.0, 0.6]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "c"
type = "revolute"
parent = "top"
child = "right"
position = ["= width", 0.0, 0.6]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "d"
type = "revolute"
parent = "right"
child = "ground"
position = ["= width", 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[load]]
name = "push"
body = "top"
force = ["= push", 0.0, -1.0]
point = [0.05, 0.0, "= arm"]
[[spring]]
name = "brace"
from = "ground"
to = "top"
point_to = [0.1, 0.0, 0.0]
stiffness = "= 3*stiffness"
natural_length = 0.4
"#;

/// Laws, a table, a signal, a motor and histories on a tree, with a point mass on a bar.
pub(super) const MIXED: &str = r#"
model = { name = "mixed", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.5, end = 2.0, scheme = "static" }
parameters = { k = 3.0, c = 0.4, mass = 0.9, gain = 8.0, turn = 0.3, length = 0.6 }
[[body]]
name = "beam"
mass = "= mass"
inertia = [0.01, 0.05, 0.05]
position = [0.5, 0.0, 0.0]
[[body]]
name = "slider"
mass = 0.6
inertia = [0.01, 0.01, 0.01]
position = [1.0, 0.0, 0.0]
[[particle]]
name = "bob"
mass = "= 0.5*mass"
position = [1.0, "= length", 0.0]
[[bar]]
name = "thread"
from = "ground"
to = "bob"
point = [1.0, "= length", 0.4]
[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "beam"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= 10*k", rest = "= 0.25*c", table = "rubber" }
[[joint]]
name = "slide"
type = "prismatic"
parent = "beam"
child = "slider"
position = [1.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
motor = { proportional = "= 5*gain", derivative = 0.5, path = "0.1*turn + 0.02*t" }
[[table]]
name = "rubber"
points = [[-1.0, -4.0], [-0.4, -1.0], [0.0, 0.0], [0.5, 1.5], [1.0, 5.0]]
[[signal]]
name = "slow"
value = "hinge + 0.1*slide"
[[law]]
name = "stiffens"
joint = "hinge"
effort = "-k*x^3 - c*x - 2*slow"
[[law]]
name = "draws"
from = "ground"
to = "bob"
point_from = [0.3, 1.2, 1.0]
tension = "k*max(x - 0.5, 0)^2"
[[load]]
name = "wind"
body = "slider"
force = [1.0, 0.3, "= -gain"]
history = "0.2 + sin(turn*t)"
[[load]]
name = "gust"
body = "bob"
force = ["= c", 0.4, 0.2]
"#;

/// A motion that is prescribed and a gear, with the effort and the reactions that hold them.
pub(super) const DRIVEN: &str = r#"
model = { name = "driven", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.5, end = 1.5, scheme = "static" }
parameters = { turn = 0.4, ratio = 1.7, mass = 0.9, stiffness = 6.0, speed = 0.9 }
[[body]]
name = "one"
mass = "= mass"
inertia = [0.01, 0.05, 0.05]
position = [0.4, 0.0, 0.0]
[[body]]
name = "two"
mass = 0.5
inertia = [0.01, 0.02, 0.02]
position = [1.1, 0.0, 0.1]
[[body]]
name = "three"
mass = 0.4
inertia = [0.01, 0.02, 0.02]
position = [1.4, 0.0, 0.3]
[[joint]]
name = "p"
type = "revolute"
parent = "ground"
child = "one"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "q"
type = "revolute"
parent = "one"
child = "two"
position = [0.8, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "r"
type = "revolute"
parent = "two"
child = "three"
position = [1.2, 0.0, 0.2]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= stiffness" }
[[constraint]]
name = "leads"
type = "motion"
joint = "p"
path = "turn*sin(speed*t)"
[[constraint]]
name = "wheels"
type = "gear"
joints = ["p", "q"]
ratio = "= ratio"
[[body]]
name = "cart"
mass = "= mass"
inertia = [0.01, 0.02, 0.02]
position = [0.0, 5.0, 0.0]
[[joint]]
name = "rail"
type = "prismatic"
parent = "ground"
child = "cart"
position = [0.0, 5.0, 0.0]
axis = [1.0, 0.0, 0.2]
spring = { stiffness = "= 3*stiffness", rest = 0.1 }
[[constraint]]
name = "pushes"
type = "motion"
joint = "rail"
path = "0.2*turn*t^2 + 0.1*sin(speed*t)"
"#;

/// A ball that lies on a soft floor, held by a spring.
pub(super) const LYING: &str = r#"
model = { name = "lying", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.5, end = 1.0, scheme = "static" }
parameters = { mass = 0.7, stiffness = 4.0e4, exponent = 1.4, held = 30.0, pull = 3.0 }
[[body]]
name = "ball"
mass = "= mass"
inertia = [0.002, 0.002, 0.002]
position = [0.0, 0.0, 0.0999]
collision = [{ type = "sphere", dimensions = [0.1] }]
[[joint]]
name = "guide"
type = "prismatic"
parent = "ground"
child = "ball"
position = [0.0, 0.0, 0.0999]
axis = [0.0, 0.0, 1.0]
[[spring]]
name = "tether"
from = "ground"
to = "ball"
point_from = [0.5, 0.0, 0.3]
point_to = [0.03, 0.0, 0.02]
stiffness = "= held"
natural_length = 0.3
[[contact]]
name = "floor"
a = { plane = { position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] } }
b = "ball"
model = { type = "hunt_crossley", stiffness = "= stiffness", exponent = "= exponent" }
[[load]]
name = "pull"
body = "ball"
force = ["= -0.2*pull", 0.0, "= -pull"]
point = [0.01, 0.0, 0.03]
"#;

/// A rod upright on a spring, pressed: unstable beyond `P l = k`.
pub(super) const UPRIGHT: &str = r#"
model = { name = "upright" }
simulation = { step = 0.5, end = 1.0, scheme = "static" }
parameters = { stiffness = 8.0, press = 20.0 }
[[body]]
name = "rod"
mass = 1.0
inertia = [0.1, 0.1, 0.01]
position = [0.0, 0.0, 0.5]
[[joint]]
name = "foot"
type = "revolute"
parent = "ground"
child = "rod"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= stiffness" }
[[load]]
name = "press"
body = "rod"
force = [0.0, 0.0, "= -press"]
point = [0.0, 0.0, 0.5]
"#;
