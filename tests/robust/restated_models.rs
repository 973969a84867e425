//! Springs, dampers, motors, prescribed motions, gears and reactions of every pair are the same in
//! a mechanism that is turned, moved, stated in another order or in other units.

use holonom::Model;
use holonom_reliability::soak::restated::largest_difference;
use vi_testkit::model::{arm_and_hand, body_at};

/// Pairs with their keys and their lengths (`l`) and angles (`a`).
const PAIRS: [(&str, &str, &str); 7] = [
    ("revolute", "axis = [0.2, -0.3, 1.0]", "a"),
    ("cylindrical", "axis = [0.2, -0.3, 1.0]", "la"),
    ("prismatic", "axis = [0.2, -0.3, 1.0]", "l"),
    ("planar", "axis = [0.2, -0.3, 1.0]", "lla"),
    ("universal", "axis = [1.0, 0.0, 0.0]\naxis2 = [0.0, 0.6, 0.8]", "aa"),
    ("screw", "axis = [0.2, -0.3, 1.0]\npitch = 0.3", "a"),
    ("spherical", "", ""),
];
const SCHEMES: [&str; 4] = ["nodal", "constrained", "em-nodal", "em-constrained"];

fn head(scheme: &str) -> String {
    format!(
        "model = {{ name = \"restated\", gravity = [0.0, 1.0, -9.0] }}\n\
         simulation = {{ step = 0.004, end = 0.08, project_start = true, scheme = \"{scheme}\" }}\n"
    )
}

fn joint(name: &str, ends: [&str; 2], pair: &str, at: &str, keys: &str) -> String {
    let [parent, child] = ends;
    format!(
        "[[joint]]\nname = \"{name}\"\ntype = \"{pair}\"\nparent = \"{parent}\"\nchild = \"{child}\"\n\
         position = {at}\n{keys}\n"
    )
}

/// What acts on a coordinate: keys of the joint, and a constraint.
fn acting(freedom: usize, kind: char) -> [(String, String); 5] {
    let by = if kind == 'l' { 0.1 } else { 0.4 };
    let constraint =
        |keys: String| (String::new(), format!("[[constraint]]\nname = \"c\"\n{keys}\n"));
    [
        (
            format!("spring = {{ freedom = {freedom}, stiffness = 300.0, rest = {by} }}"),
            String::new(),
        ),
        (format!("damper = {{ freedom = {freedom}, damping = 0.3 }}"), String::new()),
        (
            format!(
                "motor = {{ freedom = {freedom}, effort = 0.7, history = {{ type = \"harmonic\", frequency = 4.0 }}, \
                 proportional = 5.0, derivative = 0.1, path = {{ rate = {by} }} }}"
            ),
            String::new(),
        ),
        constraint(format!(
            "type = \"motion\"\njoint = \"wrist\"\nfreedom = {freedom}\n\
             path = {{ moves = [{{ start = 0.0, end = 0.08, by = {by} }}] }}"
        )),
        constraint(format!(
            "type = \"gear\"\njoints = [\"shoulder\", \"wrist\"]\nfreedoms = [1, {freedom}]\nratio = -0.43"
        )),
    ]
}

/// Whether no mechanism shows a difference when it is stated otherwise.
fn hold_however_stated(texts: impl IntoIterator<Item = String>) {
    let (mut worst, mut count) = (0.0_f64, 0);
    for text in texts {
        let model = Model::from_toml(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let found = largest_difference(&model).unwrap_or_else(|fault| panic!("{fault:?}\n{text}"));
        let found = found.unwrap_or_else(|| panic!("not measured\n{text}"));
        assert!(found < 1e-8, "{found:e}\n{text}");
        (worst, count) = (worst.max(found), count + 1);
    }
    println!("{count} mechanisms, largest difference {worst:.1e}");
}

/// Between two bodies, the first of which is held by a universal pair.
#[test]
fn every_pair_does_the_same_however_it_is_stated() {
    let mut texts = Vec::new();
    for (k, (pair, keys, freedoms)) in PAIRS.into_iter().enumerate() {
        let mut all = vec![(String::new(), String::new())];
        all.extend(freedoms.chars().enumerate().flat_map(|(freedom, kind)| acting(freedom, kind)));
        for (n, (acts, constraint)) in all.into_iter().enumerate() {
            let keys = format!("{keys}\n{acts}");
            let shoulder = "axis = [0.0, 0.0, 1.0]\naxis2 = [1.0, 0.0, 0.0]";
            texts.push(
                head(SCHEMES[(n + k) % SCHEMES.len()])
                    + &arm_and_hand("")
                    + &joint(
                        "shoulder",
                        ["ground", "arm"],
                        "universal",
                        "[0.0, 0.1, 0.0]",
                        shoulder,
                    )
                    + &joint("wrist", ["arm", "hand"], pair, "[0.3, 0.2, 0.0]", &keys)
                    + &constraint,
            );
        }
    }
    hold_however_stated(texts);
}

/// Loops with redundant constraints, bars, point masses beside bodies, distances.
#[test]
fn loops_and_points_do_the_same_however_they_are_stated() {
    let hinge = "axis = [0.0, 1.0, 0.0]";
    let bar = |name: &str, x: f64, z: f64| body_at([x, 0.3, z], name, 0.7, [0.02, 0.03, 0.01]);
    let four_bar = bar("crank", 0.0, 0.1)
        + &bar("coupler", 0.3, 0.35)
        + &bar("rocker", 0.6, 0.2)
        + &joint(
            "a",
            ["ground", "crank"],
            "revolute",
            "[0.0, 0.0, 0.0]",
            "axis = [0.0, 1.0, 0.0]\nspring = { stiffness = 40.0, rest = 0.3 }",
        )
        + &joint("b", ["crank", "coupler"], "revolute", "[0.0, 0.0, 0.25]", hinge)
        + &joint("c", ["coupler", "rocker"], "revolute", "[0.6, 0.1, 0.45]", hinge)
        + &joint("d", ["ground", "rocker"], "revolute", "[0.6, 0.0, 0.0]", hinge);
    let drive = "[[constraint]]\nname = \"drive\"\ntype = \"motion\"\njoint = \"a\"\n\
                 path = { moves = [{ start = 0.0, end = 0.08, by = 0.2 }] }\n";
    let points = r#"
particle = [{ name = "p", mass = 0.2, position = [1.0, 0.1, 0.0] },
            { name = "q", mass = 0.3, position = [1.2, 0.9, 0.3], velocity = [0.0, 0.0, 0.5] },
            { name = "r", mass = 0.1, position = [2.5, 0.0, 0.2] }]
bar = [{ name = "gp", from = "ground", to = "p" }, { name = "pq", from = "p", to = "q" },
       { name = "gr", from = "ground", to = "r", point = [2.0, 1.0, 0.0] }, { name = "qr", from = "q", to = "r" }]
"#;
    let rod = "[[constraint]]\nname = \"rod\"\ntype = \"distance\"\nfrom = \"ground\"\nto = \"hand\"\n\
               point_from = [0.9, 0.2, 0.4]\npoint_to = [0.05, 0.0, 0.02]\n";
    let arm = arm_and_hand("")
        + &joint("shoulder", ["ground", "arm"], "spherical", "[0.0, 0.1, 0.0]", "")
        + &joint(
            "wrist",
            ["arm", "hand"],
            "cylindrical",
            "[0.3, 0.2, 0.0]",
            "axis = [0.2, -0.3, 1.0]\nspring = { freedom = 0, stiffness = 90.0 }",
        );
    let mut texts = Vec::new();
    for scheme in SCHEMES {
        let head = head(scheme);
        texts.push(head.clone() + &four_bar);
        texts.push(head.clone() + &four_bar + drive);
        texts.push(head.clone() + points);
        texts.push(head.clone() + points + &four_bar);
        texts.push(head.clone() + points + &arm + rod);
        texts.push(head + &arm + rod);
    }
    hold_however_stated(texts);
}

/// Drives beside point masses: one that is free and fast, one that is tied to a body.
#[test]
fn motions_beside_point_masses_do_the_same_in_other_units() {
    let drive = |freedom: usize, by: f64| {
        format!(
            "[[constraint]]\nname = \"drive\"\ntype = \"motion\"\njoint = \"wrist\"\nfreedom = {freedom}\n\
             path = {{ moves = [{{ start = 0.0, end = 0.06, by = {by:?} }}] }}\n"
        )
    };
    let shoulder = |pair: &str, axis: &str| {
        joint("shoulder", ["ground", "arm"], pair, "[0.0, 0.1, 0.0]", axis)
    };
    let wrist =
        |pair: &str, axis: &str| joint("wrist", ["arm", "hand"], pair, "[0.3, 0.2, 0.0]", axis);
    let axis = "axis = [0.2, -0.3, 1.0]";
    let points = r#"
particle = [{ name = "free", mass = 3.0, position = [4.0, 0.1, 0.0], velocity = [20.0, -7.0, 3.0] },
            { name = "tied", mass = 0.2, position = [0.9, 0.4, 0.2], velocity = [0.0, 0.3, 0.0] }]
"#;
    let tie = |keys: &str| {
        format!("[[spring]]\nname = \"tie\"\nfrom = \"hand\"\nto = \"tied\"\n{keys}\n")
    };
    let spring = tie("stiffness = 60.0");
    let damped = tie("stiffness = 5.0\ndamping = 0.7");
    let hung =
        "bar = [{ name = \"hung\", from = \"ground\", to = \"tied\", point = [0.9, 1.1, 0.2] }]\n";
    let mut texts = Vec::new();
    for scheme in SCHEMES {
        let head = head(scheme);
        let turned = wrist("revolute", axis) + &drive(0, 0.4);
        let pushed = wrist("cylindrical", axis) + &drive(0, 0.1);
        let both = wrist("planar", axis) + &drive(2, -0.3);
        let hinged = shoulder("revolute", "axis = [0.0, 1.0, 0.0]");
        texts.push(head.clone() + points + &arm_and_hand("") + &hinged + &turned);
        texts.push(
            head.clone()
                + points
                + &arm_and_hand("")
                + &shoulder("spherical", "")
                + &pushed
                + &spring,
        );
        texts.push(head.clone() + points + hung + &arm_and_hand("") + &hinged + &both + &damped);
    }
    hold_however_stated(texts);
}

/// Redundant constraints of a tree with one more hinge on the line of the first: multipliers of the
/// acceleration level, at the start and, with order 4, at every node.
#[test]
fn a_door_with_two_hinges_does_the_same_however_it_is_stated() {
    let bodies = body_at([0.274, -0.208, 0.722], "door", 4.05, [0.396, 0.378, 0.329])
        + "rotation_vector = [-1.73, -1.18, 0.006]\n"
        + &body_at([-0.48, -0.782, -0.262], "latch", 0.69, [0.0644, 0.0589, 0.0619]);
    let hinge = |name: &str, along: f64| {
        let axis = [-0.528, -0.792, -0.305].map(|x| along * x);
        let at =
            format!("[{:?}, {:?}, {:?}]", 0.0186 + axis[0], -0.0309 + axis[1], 0.3634 + axis[2]);
        joint(name, ["ground", "door"], "revolute", &at, "axis = [-0.528, -0.792, -0.305]")
    };
    let latch = joint(
        "guide",
        ["door", "latch"],
        "cylindrical",
        "[-0.0029, -0.5519, 0.2648]",
        "axis = [0.5847, 0.1711, 0.793]",
    );
    let mut texts = Vec::new();
    for scheme in ["nodal", "reduced", "constrained", "dalembert", "em-nodal", "em-dalembert"] {
        for order in [2, 4] {
            let head = head(scheme).replace("project", &format!("order = {order}, project"));
            texts.push(head + &bodies + &hinge("first", 0.0) + &latch + &hinge("second", 0.15));
        }
    }
    hold_however_stated(texts);
}
