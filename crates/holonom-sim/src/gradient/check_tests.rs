//! What gradients and their comparisons say: growth, what is not resolved, what jumps.

use super::tests::{changed, found};
use super::{Wanted, gradient, inexact};
use holonom_model::{Model, ModelText};
use std::path::Path;

/// A double pendulum from the horizontal, whose mass does not move its start.
const CHAOS: &str = r#"
[model]
name = "chaos"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 20.0
[parameters]
mass = 1.0
bias = 0.0
[[body]]
name = "upper"
mass = 1.0
inertia = [0.01, 0.08, 0.08]
position = [0.5, 0.0, 0.0]
[[body]]
name = "lower"
mass = "= mass"
inertia = [0.01, 0.08, 0.08]
position = [1.5, 0.0, 0.0]
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = "= bias"
[[joint]]
name = "elbow"
type = "revolute"
parent = "upper"
child = "lower"
position = [1.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[control]]
name = "drive"
joint = "elbow"
hold = 500
[[sensor]]
name = "tip"
type = "position"
of = "lower"
point = [0.5, 0.0, 0.0]
[[sensor]]
name = "bend"
type = "joint_coordinate"
of = "elbow"
[[objective]]
name = "height"
type = "value"
sensor = "tip.z"
"#;

fn read(text: &str) -> (ModelText, Model) {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[]).unwrap();
    (text, model)
}

fn by(parameters: bool, controls: bool, initial: bool, step: bool) -> Wanted {
    Wanted { parameters, controls, initial, step, ..Wanted::everything() }
}

#[test]
fn growth_is_that_of_the_motion_whatever_is_differentiated() {
    let (text, model) = read(CHAOS);
    let mut times = Vec::new();
    for wanted in [
        by(true, false, false, false),
        by(false, true, false, false),
        by(false, false, true, false),
        by(false, false, false, true),
    ] {
        let found = gradient(&text, &[], &model, &wanted).unwrap();
        assert!(found.growth.unwrap() > 1e6, "{:?}", found.growth);
        times.push(found.meaningless_from.unwrap());
    }
    println!("{times:?}");
    assert!(
        times.iter().all(|t| t.total_cmp(&times[0]).is_eq()) && (5.0..18.0).contains(&times[0]),
        "{times:?}"
    );
    // Newton's tolerance is no growth
    let (text, model) =
        read(&changed(CHAOS, &[("end = 20.0", "end = 3.0\nnewton_tolerance = 1e-4")]));
    let found = gradient(&text, &[], &model, &Wanted::everything()).unwrap();
    assert!(found.growth.is_none_or(|own| own < 1e4) && found.warning().is_none());
    assert!(inexact(&model).unwrap().contains("newton_tolerance"));
}

/// A turntable hides nothing, a driven mechanism has no neighbour.
#[test]
fn growth_is_seen_beside_a_symmetry_and_none_where_nothing_is_free() {
    let table = "[[body]]\nname = \"table\"\nmass = 50.0\ninertia = [9.0, 9.0, 9.0]\n[[joint]]\nname = \"turn\"\n\
                 type = \"revolute\"\nparent = \"ground\"\nchild = \"table\"\nposition = [0.0, 0.0, 0.0]\n\
                 axis = [0.0, 0.0, 1.0]\n[[body]]\nname = \"upper\"";
    let turned = changed(
        CHAOS,
        &[
            ("[[body]]\nname = \"upper\"", table),
            ("parent = \"ground\"\nchild = \"upper\"", "parent = \"table\"\nchild = \"upper\""),
        ],
    );
    assert!(found(&turned, false).unwrap().growth.unwrap() > 1e6);
    let motion = |name: &str| {
        format!(
            "[[constraint]]\nname = \"of {name}\"\ntype = \"motion\"\njoint = \"{name}\"\n\
             path = \"t\"\n"
        )
    };
    let driven = changed(
        CHAOS,
        &[
            ("rate = \"= bias\"", "rate = 1.0"),
            ("position = [1.0, 0.0, 0.0]\n", "rate = 1.0\nposition = [1.0, 0.0, 0.0]\n"),
            ("[[control]]\nname = \"drive\"\njoint = \"elbow\"\nhold = 500\n", ""),
            ("bias = 0.0\n", "long = 0.5\n"),
            ("point = [0.5, 0.0, 0.0]", "point = [\"= long\", 0.0, 0.0]"),
            ("[[objective]]", &(motion("shoulder") + &motion("elbow") + "[[objective]]")),
        ],
    );
    let found = found(&driven, false).unwrap();
    assert!(found.growth.is_none_or(|own| own <= 1.0) && found.meaningless_from.is_none());
}

#[test]
fn differences_say_what_they_do_not_resolve() {
    // curvature hid what was wrong there
    let (text, model) = read(&changed(CHAOS, &[("end = 20.0", "end = 5.0")]));
    let wanted = Wanted::everything();
    let mut own = gradient(&text, &[], &model, &wanted).unwrap();
    let exact = own.clone();
    own.check(&text, &[], &model, &wanted).unwrap();
    assert!(own.meaningless_from.is_none() && own.worst() < 1e-6, "{:#?}", own.checks);
    let resolved = own.checks.iter().filter(|own| own.resolved).count();
    assert!(resolved > own.checks.len() / 2, "{:#?}", own.checks);
    let mut wrong = exact;
    wrong.parameters.iter_mut().for_each(|own| own.derivative *= 1.0 + 1e-4);
    wrong.check(&text, &[], &model, &wanted).unwrap();
    assert!(wrong.worst() > 1e-5, "{:#?}", wrong.checks);
    // beyond sense nothing is judged
    let (text, model) = read(CHAOS);
    let mut own = gradient(&text, &[], &model, &wanted).unwrap();
    own.check(&text, &[], &model, &wanted).unwrap();
    assert!(own.worst() < 1e-6 && own.checks.iter().any(|own| !own.resolved), "{:#?}", own.checks);
}

#[test]
fn what_counts_and_jumps_is_refused() {
    let counted = |value: &str| {
        let sensor =
            format!("[[sensor]]\nname = \"own\"\ntype = \"expression\"\nvalue = \"{value}\"\n");
        let text = changed(
            CHAOS,
            &[("end = 20.0", "end = 0.2"), ("[[objective]]", &(sensor + "[[objective]]"))],
        );
        found(&text.replace("sensor = \"tip.z\"", "sensor = \"own\""), false)
    };
    for jumping in [
        "bend + 0.1*floor(30*bend)",
        "sign(bend - 0.1)*tip.z",
        "select(bend, 2, 1)*tip.x",
        "tip.z - floor(tip.z/0.3)*0.3",
    ] {
        let error = counted(jumping).unwrap_err().to_string();
        assert!(error.contains("jumps") && error.contains("sensor.own.value"), "{error}");
    }
    for smooth in [
        "floor(3*1.3)*bend + floor(100*t)",
        "abs(bend + 1) + max(tip.z, -5) + clamp(bend, -9, 9)",
        "select(bend, 2, 1)*bend + sign(bend)*bend",
    ] {
        counted(smooth).unwrap();
    }
    // a signal that is read
    let signal = "[[signal]]\nname = \"s\"\nvalue = \"floor(30*elbow)\"\n";
    let text = changed(
        CHAOS,
        &[
            ("end = 20.0", "end = 0.2"),
            (
                "[[sensor]]\nname = \"tip\"",
                &(signal.to_owned()
                    + "[[sensor]]\nname = \"own\"\ntype = \"expression\"\nvalue = \"tip.z + s\"\n[[sensor]]\nname = \"tip\""),
            ),
        ],
    );
    let error = found(&text.replace("sensor = \"tip.z\"", "sensor = \"own\""), false);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("jumps"), "{error}");
}

#[test]
fn what_is_not_there_is_named() {
    let (text, model) = read(CHAOS);
    let refused = |model: &Model, wanted: &Wanted| {
        format!("{:?}", gradient(&text, &[], model, wanted).unwrap_err()) // with the remedy
    };
    let bare = changed(
        CHAOS,
        &[("[[objective]]\nname = \"height\"\ntype = \"value\"\nsensor = \"tip.z\"\n", "")],
    );
    let (_, bare) = read(&bare);
    for model in [&model, &bare] {
        for (name, near) in [("top.z", "`tip.z`"), ("tipp", "`tip`"), ("zebra", "tip, bend")] {
            let wanted = Wanted { of: vec![name.to_owned()], ..Wanted::everything() };
            let error = refused(model, &wanted);
            assert!(error.contains(&format!("`{name}`")) && error.contains(near), "{error}");
        }
    }
    let none =
        changed(CHAOS, &[("[[control]]\nname = \"drive\"\njoint = \"elbow\"\nhold = 500\n", "")]);
    let (text, model) = read(&none);
    let error = gradient(&text, &[], &model, &by(false, true, false, false)).unwrap_err();
    assert!(format!("{error:?}").contains("[[control]]"), "{error:?}");
    assert!(gradient(&text, &[], &model, &by(false, true, true, false)).is_ok());
}
