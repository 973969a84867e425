//! Models of beams, and of what hangs in equilibrium, for tests of gradients.

/// A cantilever with a weight at its tip, a load along it and one at its tip.
pub(super) const CANTILEVER: &str = r#"
model = { name = "cantilever", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.1 }
[parameters]
young = 2.0e9
radius = 0.012
density = 1400.0
relaxation = 0.004
force = -30.0
line = 8.0
speed = 0.7
[[beam]]
name = "rod"
points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
elements = 4
start = "clamped"
angular_velocity = [0.0, 0.0, 0.0]
[beam.section]
shape = { type = "circle", dimensions = ["= radius"] }
material = { E = "= young", nu = 0.3, density = "= density" }
damping = "= relaxation"
[[body]]
name = "weight"
mass = 0.3
inertia = [0.001, 0.002, 0.002]
position = [1.0, 0.0, 0.0]
[[joint]]
name = "grip"
type = "fixed"
parent = "rod.end"
child = "weight"
position = [1.0, 0.0, 0.0]
[[load]]
name = "pull"
body = "rod.end"
force = [5.0, 3.0, "= force"]
[[load]]
name = "wind"
beam = "rod"
force = [0.0, "= line", 0.0]
[[sensor]]
name = "tip"
type = "position"
of = "rod.end"
[[objective]]
name = "sag"
type = "sensor"
sensor = "tip.z"
at = "path"
target = 0.1
weight = 5.0
[[objective]]
name = "aside"
type = "sensor"
sensor = "tip.y"
target = -0.2
"#;

/// A beam that flies and turns, with full matrices.
pub(super) const FLYING: &str = r#"
model = { name = "flying", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.08 }
[parameters]
shear = 900.0
bend = 6.0
twist = 0.7
line = 0.6
moment = 2.0e-3
viscous = 0.05
spin = 2.0
[[beam]]
name = "wing"
points = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.0]]
normal = [0.0, 0.0, 1.0]
elements = 3
velocity = [0.3, 0.0, "= 0.5*spin"]
angular_velocity = [0.2, "= spin", 0.5]
[beam.section]
stiffness = [
    ["= shear", 20.0, 0.0, 0.0, 0.0, 3.0],
    [20.0, 1100.0, 0.0, 0.0, 0.0, -2.0],
    [0.0, 0.0, 4000.0, 5.0, -8.0, 0.0],
    [0.0, 0.0, 5.0, "= bend", 0.4, "= twist"],
    [0.0, 0.0, -8.0, 0.4, 9.0, -0.3],
    [3.0, -2.0, 0.0, "= twist", -0.3, 4.0],
]
mass = [
    ["= line", 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, "= line", 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, "= line", 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, "= moment", 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.003, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, "= moment + 0.003"],
]
damping = { EA = 0.001, GA1 = 0.001, GA2 = 0.001, EI1 = "= viscous", EI2 = 0.002, GJ = 0.003 }
[[load]]
name = "push"
body = "wing.1"
force = [0.0, 4.0, 3.0]
frame = "body"
[[sensor]]
name = "tip"
type = "position"
of = "wing.end"
[[objective]]
name = "place"
type = "sensor"
sensor = "tip.z"
target = 0.4
[[objective]]
name = "course"
type = "sensor"
sensor = "tip.y"
at = "path"
weight = 20.0
"#;

/// A tapered blade with a twist of its axes and centres off the line of its nodes.
pub(super) const BLADE: &str = r#"
model = { name = "blade", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.06 }
[parameters]
root = 0.05
tip = 0.02
young = 6.0e8
factor = 0.8
place = 0.004
angle = 0.2
[[beam]]
name = "blade"
points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
normal = [0.0, 0.0, 1.0]
elements = 3
start = "clamped"
[beam.section]
material = { E = "= young", G = 2.0e8, density = 900.0 }
shear_factors = ["= factor", 0.7]
mass_center = ["= place", 0.0]
angle = "= angle"
[[beam.stations]]
at = 0.0
section = { shape = { type = "rectangle", dimensions = ["= root", 0.03] } }
[[beam.stations]]
at = 0.45
section = { shape = { type = "rectangle", dimensions = ["= 0.5*root + 0.5*tip", 0.03] } }
[[beam.stations]]
at = 1.0
section = { shape = { type = "rectangle", dimensions = ["= tip", 0.02] } }
[[sensor]]
name = "tip"
type = "position"
of = "blade.end"
[[objective]]
name = "sag"
type = "sensor"
sensor = "tip.z"
target = 0.1
[[objective]]
name = "aside"
type = "sensor"
sensor = "tip.y"
at = "path"
target = 0.05
weight = 30.0
"#;

/// A crank that drives a flexible coupler on a rocker.
pub(super) const LINKAGE: &str = r#"
model = { name = "linkage", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.1 }
[parameters]
young = 4.0e8
width = 0.03
density = 1100.0
mass = 0.8
stiffness = 9.0
[[body]]
name = "crank"
position = [0.0, 0.0, 0.2]
mass = "= mass"
inertia = [0.02, 0.02, 0.001]
[[body]]
name = "rocker"
position = [1.0, 0.0, 0.2]
mass = 0.7
inertia = [0.015, 0.015, 0.001]
[[beam]]
name = "coupler"
points = [[0.0, 0.0, 0.4], [1.0, 0.0, 0.4]]
normal = [0.0, 0.0, 1.0]
elements = 3
[beam.section]
shape = { type = "rectangle", dimensions = [0.02, "= width"] }
material = { E = "= young", nu = 0.3, density = "= density" }
damping = { loss_factor = 0.05, frequency = 20.0 }
[[joint]]
name = "shaft"
type = "revolute"
parent = "ground"
child = "crank"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= stiffness", rest = 0.5 }
[[joint]]
name = "pin"
type = "revolute"
parent = "crank"
child = "coupler.start"
position = [0.0, 0.0, 0.4]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "pivot"
type = "revolute"
parent = "ground"
child = "rocker"
position = [1.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "knee"
type = "revolute"
parent = "rocker"
child = "coupler.end"
position = [1.0, 0.0, 0.4]
axis = [0.0, 1.0, 0.0]
[[sensor]]
name = "middle"
type = "position"
of = "coupler.1"
[[objective]]
name = "place"
type = "sensor"
sensor = "middle.z"
at = "path"
target = 0.3
weight = 9.0
[[objective]]
name = "reach"
type = "sensor"
sensor = "middle.x"
target = 0.6
"#;

/// A rope that swings with a weight.
pub(super) const ROPE: &str = r#"
model = { name = "rope", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.08 }
[parameters]
stretch = 900.0
bend = 0.02
line = 0.3
[[beam]]
name = "rope"
points = [[0.0, 0.0, 0.0], [0.8, 0.0, -0.6]]
elements = 4
element = "rope"
start = "pinned"
normal = [0.0, 1.0, 0.0]
[beam.section]
EA = "= stretch"
EI1 = "= bend"
EI2 = "= bend"
GJ = 0.02
rhoA = "= line"
rhoI1 = 2.0e-5
rhoI2 = 2.0e-5
damping = 0.01
[[body]]
name = "weight"
mass = 0.5
inertia = [0.001, 0.001, 0.001]
position = [0.8, 0.0, -0.6]
[[joint]]
name = "grip"
type = "spherical"
parent = "rope.end"
child = "weight"
position = [0.8, 0.0, -0.6]
[[load]]
name = "pull"
body = "weight"
force = [0.0, 4.0, 0.0]
[[sensor]]
name = "tip"
type = "position"
of = "weight"
[[objective]]
name = "depth"
type = "sensor"
sensor = "tip.z"
target = -0.2
[[objective]]
name = "course"
type = "sensor"
sensor = "tip.y"
at = "path"
weight = 40.0
"#;

/// A chain of two bodies on springs, a rod on a spring: where they hang.
pub(super) const CHAIN: &str = r#"
model = { name = "chain", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.005, end = 0.1, start = "relaxed" }
[parameters]
mass = 1.4
stiffness = 30.0
rest = 0.2
arm = 0.5
force = 2.0
damping = 0.3
[[body]]
name = "upper"
position = ["= arm", 0.0, 0.0]
mass = "= mass"
inertia = [0.01, 0.1, 0.1]
[[body]]
name = "lower"
position = ["= 2.5*arm", 0.0, 0.0]
mass = 0.8
inertia = [0.01, 0.05, 0.05]
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= stiffness", rest = "= rest" }
damper = { damping = "= damping" }
[[joint]]
name = "elbow"
type = "revolute"
parent = "upper"
child = "lower"
position = ["= 2*arm", 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[load]]
name = "pull"
body = "lower"
force = ["= force", 0.0, 1.0]
history = { type = "harmonic", frequency = 3.0, phase = 0.7 }
[[sensor]]
name = "tip"
type = "position"
of = "lower"
[[objective]]
name = "depth"
type = "sensor"
sensor = "tip.z"
at = "path"
weight = 3.0
[[objective]]
name = "reach"
type = "sensor"
sensor = "tip.x"
target = 0.3
"#;

/// Two beams in a row on a body that a joint turns: rates carry them.
pub(super) const CARRIED: &str = r#"
model = { name = "carried", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.04 }
parameters = { spin = -1.3, bend = -0.8, place = 0.8 }
[[body]]
name = "hub"
position = [0.4, 0.0, 0.0]
mass = 2.0
inertia = [0.01, 0.1, 0.1]
[[joint]]
name = "root"
type = "revolute"
parent = "ground"
child = "hub"
position = [0.0, 0.0, "= 0.1*(place - 0.8)"]
axis = [0.0, 1.0, 0.3]
rate = "= spin"
[[beam]]
name = "first"
points = [[0.8, 0.0, 0.0], [1.4, 0.0, 0.0]]
elements = 2
section = { shape = { type = "circle", dimensions = [0.02] }, material = { E = 2e8, nu = 0.33, density = 2700.0 } }
[[joint]]
name = "elbow"
type = "revolute"
parent = "hub"
child = "first.start"
position = [0.8, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = "= bend"
spring = { stiffness = 50.0, rest = 0.0 }
[[beam]]
name = "second"
points = [[1.4, 0.0, 0.0], [1.4, 0.5, 0.0]]
elements = 2
section = { shape = { type = "circle", dimensions = [0.02] }, material = { E = 2e8, nu = 0.33, density = 2700.0 } }
[[joint]]
name = "wrist"
type = "revolute"
parent = "first.end"
child = "second.start"
position = [1.4, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
[[sensor]]
name = "tip"
type = "position"
of = "second.end"
[[sensor]]
name = "speed"
type = "velocity"
of = "first.2"
[[objective]]
name = "high"
type = "sensor"
sensor = "tip.z"
target = 0.4
[[objective]]
name = "fast"
type = "sensor"
sensor = "speed.z"
target = 0.2
at = "path"
"#;
