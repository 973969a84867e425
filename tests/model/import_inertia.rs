//! Mass and inertia of imported robots: shells, impossible moments, links without mass, armatures.

use super::import_dialects::{apart, dof, imported, plain, refused, remarks, two_links};

use holonom::import::ImportOptions;
use holonom::modes::{About, ModalAnalysis};

/// Masses and principal moments of MuJoCo 4.0.0 at 1 kg/m².
#[test]
fn shells_have_the_mass_of_their_surface() {
    let cases = [
        ("sphere", ".3", 1.1309733552923256, [0.0678584, 0.0678584, 0.0678584]),
        ("box", ".1 .2 .3", 0.88, [0.05413333, 0.04213333, 0.02426667]),
        ("cylinder", ".05 .3", 0.20420352248333654, [0.00731402, 0.00731402, 0.00049087]),
        ("capsule", ".05 .3", 0.2199114857512855, [0.00924152, 0.00924152, 0.0005236]),
        ("ellipsoid", ".1 .2 .3", 0.4897193333371731, [0.01807517, 0.01406837, 0.00810268]),
    ];
    for (kind, size, mass, moments) in cases {
        let text = format!(
            r#"<mujoco><worldbody><body><joint/><geom type="{kind}" size="{size}" shellinertia="true" density="1"/></body></worldbody></mujoco>"#
        );
        let body = plain(&text).model.bodies.remove(0);
        let tensor = body.inertia_tensor();
        let found = apart([0, 1, 2].map(|i| tensor[(i, i)]), moments);
        println!("{kind}: mass off by {:.1e}, moments by {found:.1e}", body.mass() - mass);
        // eight digits; of an ellipsoid MuJoCo takes a layer of 1 µm
        let digits = if kind == "ellipsoid" { 1e-7 } else { 6e-9 };
        assert!((body.mass() - mass).abs() < 1e-12 * mass && found < digits, "{kind}: {found:e}");
    }
    let stated = r#"<mujoco><worldbody><body><joint/><geom type="sphere" size=".3" shellinertia="true" mass="2"/></body></worldbody></mujoco>"#;
    let body = plain(stated).model.bodies.remove(0);
    assert!((body.inertia_tensor()[(0, 0)] - 2.0 / 3.0 * 2.0 * 0.09).abs() < 1e-15);
}

#[test]
fn impossible_moments_of_inertia_are_replaced_on_request() {
    let robot = |inertia: &str, visual: &str| {
        format!(
            r#"<robot name="r"><link name="base"/><link name="a"><inertial><mass value="1"/><inertia {inertia}/></inertial>{visual}</link>
<joint name="j" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/></joint></robot>"#
        )
    };
    let repair = ImportOptions { repair_inertia: true, ..ImportOptions::default() };
    let ball = 0.4 * (0.75 / (std::f64::consts::PI * 1000.0)).powf(2.0 / 3.0);
    let cube = "<visual><geometry><box size=\"0.6 0.6 0.6\"/></geometry></visual>";
    let cases = [
        ("ixx=\"0.01\" iyy=\"0.02\" izz=\"0.05\"", "", 0.08 / 3.0, "their mean"),
        ("ixx=\"0.3\" iyy=\"0.2\" izz=\"-0.1\"", "", 0.4 / 3.0, "their mean"),
        ("ixx=\"0\" iyy=\"0\" izz=\"0\"", "", ball, "of a ball"),
        ("ixx=\"-1\" iyy=\"-1\" izz=\"-1\"", "", ball, "of a ball"),
        ("ixx=\"0\" iyy=\"0\" izz=\"0\"", cube, 0.06, "largest geometry"),
    ];
    for (inertia, visual, moment, how) in cases {
        let text = robot(inertia, visual);
        let found = imported(&text, &repair);
        let said = remarks(&found);
        assert!(said.contains(how) && said.contains("link \"a\" ("), "{said}");
        let tensor = found.model.bodies[0].inertia_tensor();
        let missed = (tensor - holonom::nalgebra::Matrix3::identity() * moment).amax() / moment;
        println!("{how}: {moment:.3e} kg·m², off by {missed:.1e}");
        assert!(missed < 1e-14, "{inertia}: {tensor}");
    }
    let problem =
        refused(&robot("ixx=\"0.01\" iyy=\"0.02\" izz=\"0.05\"", ""), &ImportOptions::default());
    assert!(
        problem.help.as_deref().unwrap_or_default().contains("--repair-inertia"),
        "{problem:?}"
    );
    let sound = two_links("revolute", "", "");
    assert_eq!(imported(&sound, &repair).text, plain(&sound).text, "sound inertia is left alone");
}

#[test]
fn a_robot_without_mass_is_refused_with_what_gives_it_one() {
    let robot = |geometry: &str| {
        format!(
            r#"<robot name="r"><link name="base"/><link name="a">{geometry}</link><joint name="j" type="revolute"><parent link="base"/><child link="a"/></joint></robot>"#
        )
    };
    let of = |kind: &str, shape: &str| format!("<{kind}><geometry>{shape}</geometry></{kind}>");
    let dense = ImportOptions { density: Some(500.0), ..ImportOptions::default() };
    let cube = "<box size=\"0.1 0.2 0.3\"/>";
    let mesh = "<mesh filename=\"package://arm/link_1.stl\"/>";
    let said = |text: &str, options: &ImportOptions| {
        let problem = refused(text, options);
        format!("{}\n{}", problem.message, problem.help.unwrap_or_default())
    };
    let words = said(&robot(&of("visual", cube)), &ImportOptions::default());
    assert!(words.contains("`--density RHO`") && words.contains("link \"a\""), "{words}");
    let words = said(&robot(""), &ImportOptions::default());
    assert!(!words.contains("--density"), "there is no geometry: {words}");
    let words = said(&robot(&of("visual", mesh)), &ImportOptions::default());
    assert!(words.contains("--density") && words.contains("link_1.stl"), "{words}");
    let words = said(&robot(&of("visual", mesh)), &dense);
    assert!(words.contains("link_1.stl (") && !words.contains("`--density"), "{words}");
    // 0.006 m³; where nothing is to be seen, the geometry for contact counts
    for geometry in
        [of("visual", cube), of("collision", cube), of("visual", mesh) + &of("collision", cube)]
    {
        let model = imported(&robot(&geometry), &dense).model;
        let mass = model.bodies[0].mass();
        assert!((mass - 3.0).abs() < 1e-15, "{geometry}: {mass}");
    }
    let both = imported(&robot(&(of("visual", cube) + &of("collision", cube))), &dense).model;
    assert!((both.bodies[0].mass() - 3.0).abs() < 1e-15, "one of both counts");
}

/// A slide and a hinge in one body: the body between them gets a rod.
#[test]
fn mass_that_is_moved_between_bodies_is_listed() {
    let robot = r#"<mujoco><worldbody><body name="a"><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 0 1"/><inertial pos=".15 .05 -.1" mass="2" diaginertia=".02 .03 .04"/></body></worldbody></mujoco>"#;
    let found = plain(robot);
    let said = remarks(&found);
    let moved = found.model.bodies[0].mass();
    println!("{moved} kg: {said}");
    assert!(said.contains("centres of mass of these bodies are not those of the description"));
    assert!(said.contains("0.160 kg of \"a\" to \"a_a_joint1\""), "{said}");
    let mass: f64 = found.model.bodies.iter().map(|b| b.mass()).sum();
    assert!((mass - 2.0).abs() < 1e-15, "{mass}");
}

/// `½ a q̇²` of a joint as a rotor about a fixed axis: the accelerations are those with the inertia
/// `a` beside that of the link.
#[test]
fn an_armature_is_inertia_of_the_joint_alone() {
    let pendulum = |armature: &str| {
        format!(
            r#"<mujoco><option gravity="0 0 -10"/><worldbody><body name="p"><joint name="j" axis="0 1 0" armature="{armature}"/><inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.1"/></body></worldbody></mujoco>"#
        )
    };
    let found = plain(&pendulum("0.4"));
    assert!(remarks(&found).contains("armature: a rotor"), "{}", remarks(&found));
    let hidden: Vec<bool> = found.model.bodies.iter().map(|body| !body.is_visible()).collect();
    assert_eq!(hidden, [false, true], "the rotor is not drawn");
    assert!(found.text.contains("visible = false"), "{}", found.text);
    assert_eq!((found.model.bodies.len(), dof(&found.model)), (2, 1));
    let left_out =
        imported(&pendulum("0.4"), &ImportOptions { armature: false, ..ImportOptions::default() });
    assert_eq!(left_out.model.bodies.len(), 1);
    assert!(remarks(&left_out).contains("armature: left out"));
    let without = plain(&pendulum("0"));
    assert_eq!(without.model.bodies.len(), 1);
    // small vibrations: ω² = m g l/(J + m l² + a)
    for (model, armature) in [(&found.model, 0.4), (&without.model, 0.0)] {
        let modes = ModalAnalysis::new(model, About::Start).unwrap().modes(1).unwrap();
        let omega = modes.modes[0].omega;
        let exact = (2.0_f64 * 10.0 * 0.5 / (0.1 + 2.0 * 0.25 + armature)).sqrt();
        println!("ω {omega}, exactly {exact}");
        assert!((omega - exact).abs() < 1e-9 * exact, "{omega} {exact}");
    }
}
