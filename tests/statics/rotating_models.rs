//! Vibrations of rotating and damped model files against closed forms and published frequencies;
//! relaxed starts.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{model, samples};
use holonom::Model;
use holonom::model::Scheme;
use holonom::modes::{About, Campbell, ModalAnalysis, ModeKind, Report};
use holonom::vi_statics::{
    MotionKind, StaticLinearization, Vibrations, vibrations as all_vibrations,
};
use holonom::{Simulation, Statics};
use std::f64::consts::PI;
use vi_testkit::model::{AXES, beam, body, changed, guide, head, hinge, joint, motion, section};

fn modes(model: &Model, about: About, count: usize) -> Report {
    ModalAnalysis::new(model, about).unwrap().modes(count).unwrap()
}

fn vibrations(report: &Report) -> Vec<f64> {
    let of = report.modes.iter().filter(|mode| mode.kind == ModeKind::Vibration);
    of.map(|mode| mode.omega).collect()
}

/// A slender cantilever, L = 1 m, ρA = 1 kg/m, EI = 1 N·m² for flapping, on a driven hub without
/// radius. Rotary inertia and shear are small.
fn blade(speed: f64, elements: usize) -> String {
    [
        head("blade", "step = 0.01, end = 1.0"),
        body("hub", 1.0, [1.0; 3]),
        hinge("mast", ["ground", "hub"], [0.0; 3], AXES[2]) + &format!("rate = {speed:?}\n"),
        beam("blade", &[[0.0; 3], [1.0, 0.0, 0.0]], elements) + "normal = [0, 0, 1]\n",
        section([1e7, 1e7, 1e7, 1e4, 1.0, 1e3], [1.0, 1e-7, 1e-7]),
        joint("fixed", "root", ["hub", "blade.start"], [0.0; 3]),
        motion("drive", "mast", &format!("{{ rate = {speed:?} }}")),
    ]
    .concat()
}

#[test]
fn a_rotating_blade_is_stiffened_as_published() {
    // D. H. Hodges, M. J. Rutkowski, AIAA J. 19 (1981) 1459–1466, table 1: flapping, no hub radius,
    // ω and Ω in √(EI/ρAL⁴)
    let published = [
        (0.0, [3.5160, 22.0345]),
        (1.0, [3.6816, 22.1810]),
        (2.0, [4.1373, 22.6149]),
        (4.0, [5.5850, 24.2733]),
        (6.0, [7.3604, 26.8091]),
        (10.0, [11.2023, 33.6404]),
    ];
    for (speed, exact) in published {
        let about = if speed == 0.0 { About::Start } else { About::Rotation };
        let report = modes(&model(&blade(speed, 10), &[]), about, 3);
        let found = vibrations(&report);
        let errors = [0, 1].map(|k| found[k] / exact[k] - 1.0);
        println!("Ω = {speed}: {:.5?}, relative errors {errors:?}", &found[..2]);
        // the table has five digits; shear, extension and rotary inertia are 1e-4 of the stiffness
        // and less
        assert!(errors.iter().all(|e| e.abs() < 1.5e-4), "{errors:?}");
        assert_eq!((report.unstable, report.zero), (0, 0));
    }
}

#[test]
fn flapping_and_lagging_differ_by_the_square_of_the_speed() {
    // R. V. Southwell, B. S. Gough, ARC R&M 766 (1921): the same bending stiffness in both planes,
    // ω_lag² = ω_flap² − Ω²
    for speed in [2.0, 6.0] {
        let changes = [("beam.blade.section.EI1", "1.0")];
        let found = vibrations(&modes(&model(&blade(speed, 10), &changes), About::Rotation, 2));
        let off = found[1].powi(2) - found[0].powi(2) - speed * speed;
        println!("Ω = {speed}: ω_flap² − ω_lag² − Ω² = {off:.1e} of {:.3}", found[1].powi(2));
        assert!(off.abs() < 2e-5 * found[1].powi(2), "{off:e}");
    }
}

/// The same blade under gravity.
fn falling(text: &str) -> String {
    changed(text, "name = \"blade\" }", "name = \"blade\", gravity = [0, 0, -9.81] }")
}

/// A round shaft along z between two bearings, spinning at `speed`.
fn shaft(speed: f64, elements: usize) -> String {
    [
        head("shaft", "step = 0.01, end = 1.0"),
        beam("shaft", &[[0.0; 3], [0.0, 0.0, 1.0]], elements) + "normal = [1, 0, 0]\n",
        format!("angular_velocity = [0, 0, {speed:?}]\n"),
        section([1e7, 1e7, 1e7, 1.0, 1.0, 1.0], [1.0, 5e-3, 5e-3]),
        joint("spherical", "lower", ["ground", "shaft.start"], [0.0; 3]),
        guide("point_on_line", "upper", ["ground", "shaft.end"], AXES[2], AXES[2]),
    ]
    .concat()
}

#[test]
fn a_spinning_shaft_whirls_as_its_closed_form() {
    // Rayleigh's shaft in space, k = nπ/L: (ρA + ρI k²) ω² − 2 ρI k² Ω ω − EI k⁴ = 0; in its own
    // frame ω − Ω
    let (inertia, speed) = (5e-3, 6.0);
    let [coarse, report] =
        [16, 32].map(|n| modes(&model(&shaft(speed, n), &[]), About::Rotation, 6));
    // rotary inertia is lumped: of order 2
    let both = vibrations(&coarse).into_iter().zip(vibrations(&report));
    let found: Vec<f64> = both.map(|(coarse, fine)| fine + (fine - coarse) / 3.0).collect();
    let mut exact: Vec<f64> = Vec::new();
    for n in [1.0, 2.0] {
        let square = (n * PI).powi(2);
        let (a, b, c) = (1.0 + inertia * square, inertia * square * speed, square * square);
        let root = (b * b + a * c).sqrt();
        exact.extend([(b + root) / a, (b - root) / a].map(|omega| (omega - speed).abs()));
    }
    exact.sort_by(f64::total_cmp);
    println!("found {found:.6?}\nexact {exact:.6?}");
    for exact in &exact {
        let off = found.iter().map(|f| (f / exact - 1.0).abs()).fold(f64::INFINITY, f64::min);
        assert!(off < 2e-5, "{exact}: {off:e}");
    }
    assert_eq!(report.unstable, 0);
    let decay = report.modes.iter().map(|mode| mode.decay).fold(0.0, f64::max);
    assert!(decay < 1e-9, "nothing dissipates: {decay:e}");
}

#[test]
fn a_damped_beam_has_the_damping_ratio_of_its_relaxation_time() {
    // Kelvin and Voigt with one time for all strains: λ² + τω₀²λ + ω₀² = 0
    let tau = 0.01;
    let text = blade(0.0, 6);
    let free = vibrations(&modes(&model(&text, &[]), About::Start, 4));
    let damped = model(&text, &[("beam.blade.section.damping", "0.01")]);
    let report = modes(&damped, About::Start, 4);
    let vibrating = report.modes.iter().filter(|mode| mode.kind == ModeKind::Vibration);
    for (mode, omega) in vibrating.zip(&free) {
        let ratio = 0.5 * tau * omega;
        let damped = omega * (1.0 - ratio * ratio).sqrt();
        let errors = [mode.damping_ratio - ratio, mode.omega / damped - 1.0];
        println!("ω₀ = {omega:.5}: ζ = {:.6}, errors {errors:?}", mode.damping_ratio);
        assert!(errors.iter().all(|e| e.abs() < 1e-9), "{errors:?}");
    }
    let decays = report.modes.iter().filter(|mode| mode.kind == ModeKind::Decay).count();
    println!("{decays} motions die out without vibrating, residual {:.1e}", report.residual);
    assert!(decays > 0 && report.residual < 1e-9 && report.warnings.is_empty());
}

#[test]
fn modes_are_followed_over_the_speed_by_their_shapes() {
    // flapping rises past the first lagging mode, whose frequency hardly changes
    let text = blade(1.0, 6);
    let model = model(&text, &[("beam.blade.section.EI1", "25.0")]);
    let speeds: Vec<f64> = (0..=10).map(|k| 2.5 * f64::from(k)).collect();
    let diagram = Campbell::new(&model, &speeds, 3).unwrap();
    let curve = |k: usize| -> Vec<f64> {
        diagram.speeds.iter().map(|at| at.vibrations[k].as_ref().unwrap().omega).collect()
    };
    let (flap, lag) = (curve(0), curve(1));
    println!("flap {flap:.3?}\nlag  {lag:.3?}");
    assert!(flap[0] < lag[0] && flap[10] > lag[10], "the curves cross");
    for list in [&flap, &lag] {
        let bends = list.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs());
        assert!(bends.fold(0.0, f64::max) < 1.2, "each curve is smooth: {list:?}");
    }
    assert!(diagram.csv().lines().count() == 1 + 3 * speeds.len());
}

#[test]
fn modes_of_equal_blades_are_followed_as_well() {
    let one = blade(1.0, 2);
    let beam = &one[one.find("[[beam]]").unwrap()..one.find("[[constraint]]").unwrap()];
    let other =
        changed(&changed(beam, "\"blade", "\"other"), "[1.0, 0.0, 0.0]", "[-1.0, 0.0, 0.0]");
    let other = changed(&other, "\"root\"", "\"root2\"");
    let model = model(&format!("{one}\n{other}"), &[("beam.blade.section.EI1", "25.0")]);
    let speeds: Vec<f64> = (0..=8).map(|k| 2.0 * f64::from(k)).collect();
    let diagram = Campbell::new(&model, &speeds, 4).unwrap();
    for k in 0..4 {
        let curve: Vec<f64> =
            diagram.speeds.iter().map(|at| at.vibrations[k].as_ref().unwrap().omega).collect();
        let bend = curve.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).fold(0.0, f64::max);
        println!("mode {}: {curve:.3?}, second difference {bend:.2}", k + 1);
        assert!(bend < 1.2, "{curve:?}");
    }
}

#[test]
fn what_does_not_rotate_steadily_is_refused_by_name() {
    let swinging = changed(&blade(2.0, 2), "axis = [0.0, 0.0, 1.0]", "axis = [0.0, 1.0, 0.0]");
    let swinging = falling(&swinging);
    for (text, words) in [(swinging, "forces do not turn"), (blade(0.0, 2), "there is no rotation")]
    {
        let found = ModalAnalysis::new(&model(&text, &[]), About::Rotation);
        let message = found.err().map(|error| error.to_string()).unwrap_or_default();
        println!("{message}");
        assert!(message.contains(words), "{message}");
    }
}

/// The shaft lies across gravity, its axis z.
fn lying(text: &str, name: &str) -> String {
    let head = format!("name = \"{name}\", gravity = [-0.05, 0.0, 0.0] }}");
    changed(text, &format!("name = \"{name}\" }}"), &head)
}

/// In space, where the bearings stand, a round shaft under its weight has the whirl of the closed
/// form without the speed taken off.
#[test]
fn a_lying_shaft_whirls_in_space_as_its_closed_form() {
    let (inertia, speed) = (5e-3, 6.0);
    let [coarse, report] = [16, 32].map(|n| {
        let own = model(&lying(&shaft(speed, n), "shaft"), &[("simulation.start", "\"relaxed\"")]);
        modes(&own, About::Motion, 5)
    });
    assert!(report.rotation.is_none(), "{:?}", report.rotation);
    assert_eq!(report.motion.as_ref().unwrap().spins.len(), 33);
    let both = vibrations(&coarse).into_iter().zip(vibrations(&report));
    let found: Vec<f64> = both.map(|(coarse, fine)| fine + (fine - coarse) / 3.0).collect();
    let square = PI.powi(2);
    let (a, b, c) = (1.0 + inertia * square, inertia * square * speed, square * square);
    let root = (b * b + a * c).sqrt();
    println!("found {found:.6?}, exact {:.6} {:.6}", (root - b) / a, (root + b) / a);
    for exact in [(root - b) / a, (root + b) / a] {
        let off = found.iter().map(|f| (f / exact - 1.0).abs()).fold(f64::INFINITY, f64::min);
        assert!(off < 2e-5, "{exact}: {off:e}");
    }
    assert_eq!(report.unstable, 0);
    // a run begins as the shaft spins for ever: it stays as it sags
    let range = |start: &str| {
        let own =
            [("simulation.start", start), ("simulation.step", "0.002"), ("simulation.end", "0.5")];
        elastic(&model(&lying(&shaft(speed, 16), "shaft"), &own))
    };
    let ([low, high], stated) = (range("\"relaxed\""), range("\"stated\""));
    println!("elastic energy {low:e} to {high:e} J, stated {stated:?}");
    assert!(low > 0.0 && high - low < 1e-3 * (stated[1] - stated[0]), "{low:e} {high:e}");
}

/// A stiff rod of 2 m, 2 kg that spins about its axis z in two bearings, `k` across at each end.
fn rod(speed: f64, [k_x, k_y]: [f64; 2], unround: f64) -> String {
    let bearing = |name: &str, node: &str, z: f64| {
        format!(
            "[[bushing]]\nname = \"{name}\"\nfrom = \"ground\"\nto = \"rod.{node}\"\n\
             position = [0.0, 0.0, {z:?}]\nrotation = \"tilt\"\n\
             stiffness = [{k_x:?}, {k_y:?}, 1e3, 0.0, 0.0, 0.0]\n"
        )
    };
    [
        head("rod", "step = 0.001, end = 0.2"),
        beam("rod", &[[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]], 4) + "normal = [1, 0, 0]\n",
        format!("angular_velocity = [0, 0, {speed:?}]\n"),
        section([1e9, 1e9, 1e9, 1e9, (1.0 + unround) * 1e9, 1e9], [1.0, 0.05, 0.05]),
        bearing("lower", "start", -1.0),
        bearing("upper", "end", 1.0),
    ]
    .concat()
}

/// `m λ² + 2k = 0` across; `(J_t λ² + 2k_x a²)(J_t λ² + 2k_y a²) + (J_a w λ)² = 0` for the tilt.
#[test]
fn a_lying_rotor_in_unequal_bearings_whirls_as_its_closed_form() {
    let (speed, k, m) = (40.0_f64, [400.0, 900.0_f64], 2.0_f64);
    let (across, axial) = (m / 3.0 + 0.05 * 2.0, 0.2_f64);
    let mut exact: Vec<f64> = k.iter().map(|k| (2.0 * k / m).sqrt()).collect();
    let (a, b) = (across * across, across * 2.0 * (k[0] + k[1]) + (axial * speed).powi(2));
    let root = (b * b - 16.0 * a * k[0] * k[1]).sqrt();
    exact.extend([((b - root) / (2.0 * a)).sqrt(), ((b + root) / (2.0 * a)).sqrt()]);
    let own = model(&lying(&rod(speed, k, 0.0), "rod"), &[("simulation.start", "\"relaxed\"")]);
    let report = modes(&own, About::Motion, 8);
    let found = vibrations(&report);
    println!("found {found:.6?}\nexact {exact:.6?}");
    for exact in &exact {
        let off = found.iter().map(|f| (f / exact - 1.0).abs()).fold(f64::INFINITY, f64::min);
        assert!(off < 1e-5, "{exact}: {off:e}");
    }
    assert_eq!(report.unstable, 0);
}

/// What stands in space is named where the rotor turns as a whole, and where it is not alike in
/// all directions.
#[test]
fn what_stands_in_space_is_named() {
    let damper = "[[spring]]\nname = \"damper\"\nfrom = \"ground\"\nto = \"rod.start\"\n\
                  point_from = [1.0, 0.0, -1.0]\nstiffness = 0.0\ndamping = 2.0\n";
    for (unround, about) in [(0.0, About::Rotation), (0.5, About::Rotation), (0.5, About::Motion)] {
        let even = rod(40.0, [400.0; 2], unround);
        for (text, word) in [
            (lying(&even, "rod"), "the weight"),
            (rod(40.0, [400.0, 900.0], unround), "a spring or a bushing"),
            (even.clone() + damper, "`damper`"),
        ] {
            let found = ModalAnalysis::new(&model(&text, &[]), about);
            let message = found.err().map(|error| error.to_string()).unwrap_or_default();
            println!("{message}");
            let (turn, go) = ("do not turn with the system: ", "do not move with the system: ");
            let own = [turn, go].iter().any(|words| message.contains(&format!("{words}{word}")));
            assert!(own, "{unround}, {about:?}: {message}");
        }
        // alike bearings do turn with any shaft
        assert!(ModalAnalysis::new(&model(&even, &[]), about).is_ok(), "{unround}, {about:?}");
    }
}

/// Extremes of the elastic energy of a run.
fn elastic(model: &Model) -> [f64; 2] {
    let mut run = Simulation::new(model).unwrap();
    let place = run.energy_columns().iter().position(|name| name == "elastic").unwrap();
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for sample in samples(&mut run) {
        let energy = sample.energies[place];
        range = [range[0].min(energy), range[1].max(energy)];
    }
    range
}

#[test]
fn a_relaxed_start_is_free_of_vibration() {
    let text = blade(4.0, 12);
    let hanging = falling(&text);
    for (what, text) in [("rotating", text), ("rotating under gravity", hanging)] {
        let changes = [
            ("beam.blade.section.EI1", "1.0"),
            ("simulation.step", "0.002"),
            ("simulation.end", "0.5"),
        ];
        let stated = elastic(&model(&text, &changes));
        let relaxed: Vec<(&str, &str)> =
            changes.into_iter().chain([("simulation.start", "\"relaxed\"")]).collect();
        let [low, high] = elastic(&model(&text, &relaxed));
        let part = (high - low) / (stated[1] - stated[0]);
        println!("{what}: elastic energy {low:.6e} to {high:.6e} J, {part:.1e} of a stated start");
        assert!(part < 2e-3, "{part:e}");
    }
}

#[test]
fn a_relaxed_start_that_is_none_is_refused() {
    let text = changed(&blade(2.0, 2), "axis = [0.0, 0.0, 1.0]", "axis = [0.0, 1.0, 0.0]");
    let text = falling(&text);
    let error = Simulation::new(&model(&text, &[("simulation.start", "\"relaxed\"")])).unwrap_err();
    println!("{error}");
    assert!(error.to_string().contains("no relaxed start"), "{error}");
}

/// Frequencies and decay rates of the vibrations, and the counts of the other motions.
fn spectrum(found: &Vibrations, count: usize) -> (Vec<[f64; 2]>, [usize; 2], f64) {
    let listed = (0..count).map(|k| found.get(MotionKind::Vibration, k).unwrap());
    let list: Vec<_> = listed.collect();
    let residual = list.iter().map(|v| v.residual).fold(0.0, f64::max);
    let values = list.iter().map(|v| [v.value.im, v.value.re]).collect();
    (values, [MotionKind::Growth, MotionKind::Rigid].map(|motion| found.count(motion)), residual)
}

#[test]
fn the_lowest_modes_are_those_of_all() {
    let gyroscopic = blade(6.0, 5);
    let damped = changed(&gyroscopic, "rhoA = 1.0,", "damping = 1e-3, rhoA = 1.0,");
    let free = changed(&shaft(0.0, 24), "spherical", "fixed");
    let free = &free[..free.find("[[joint]]").unwrap()];
    for (what, text, speed) in [
        ("damped rotating blade", damped.as_str(), 6.0), // gyroscopic terms as well
        ("free shaft", free, 0.0),
        ("spinning shaft", &shaft(6.0, 24), 6.0),
    ] {
        let problem = || {
            let mut model = model(text, &[]);
            model.settings.scheme = Scheme::Static;
            let statics = Statics::with_loads_as_stated(&model).unwrap();
            let rotation = statics.rotation().unwrap();
            assert_eq!(rotation.is_some(), speed != 0.0);
            let mut statics = match rotation {
                Some(rotation) => statics.in_rotation(&rotation, None),
                None => statics,
            };
            statics.relax().unwrap();
            statics
        };
        let count = 5;
        let all = all_vibrations(problem().problem()).unwrap();
        let lowest =
            StaticLinearization::lowest(problem().problem(), count).unwrap().vibrations().unwrap();
        let (exact, kinds, _) = spectrum(&all, count);
        let (found, own, residual) = spectrum(&lowest, count);
        let off =
            |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]) / b[0].hypot(b[1]);
        let worst = found.iter().zip(&exact).map(off).fold(0.0, f64::max);
        println!(
            "{what}, {} degrees of freedom: {worst:.1e} apart, residual {residual:.1e}",
            all.dof()
        );
        assert!(worst < 1e-7 && residual < 1e-7, "{found:?}\n{exact:?}");
        assert_eq!((kinds, all.dof()), (own, lowest.dof()), "{what}");
    }
}
