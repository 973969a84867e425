use super::*;
use std::f64::consts::FRAC_PI_2;

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a / b - 1.0).abs() < tolerance, "{a} against {b}");
}

#[test]
fn a_rectangle_bends_about_the_right_axis() {
    let material = Material::from_poisson(2.1e11, 0.3, 7850.0).unwrap();
    let strip = Profile::Rectangle { width: 0.02, height: 0.005 };
    let section = strip.section(&material, &Stated::default()).unwrap();
    let [_, _, EA, EI1, EI2, _] = section.stiffness();
    close(EA, 2.1e11 * 1e-4, 1e-14);
    assert!(EI1 < EI2, "thin along d_2: soft about d_1");
    close(EI2 / EI1, 16.0, 1e-13);
    let [_, I1, I2, I3] = section.inertia();
    close(I2, 7850.0 * EI1 / 2.1e11, 1e-14); // I_2ρ = ρ EI_1/E
    close(I1, 7850.0 * EI2 / 2.1e11, 1e-14);
    assert!(I3 == 0.0);
}

#[test]
fn tables_of_constants() {
    // Timoshenko & Goodier, §109: k_1 for a/b = 1, 2, 10
    for (ratio, factor) in [(1.0, 0.1406), (2.0, 0.229), (10.0, 0.312)] {
        close(rectangle_torsion(ratio, 1.0) / ratio, factor, 2e-3);
    }
    let circle = Profile::Circle { radius: 0.1 };
    let tube = Profile::Tube { outer: 0.1, inner: 1e-9 };
    close(circle.shear_factors(0.3)[0], 0.886, 1e-3);
    close(tube.shear_factors(0.3)[1], circle.shear_factors(0.3)[1], 1e-12);
    close(tube.torsion_constant(), 0.5 * PI * 1e-4, 1e-12);
    let moments = Section::euler_moments([10.0, 10.0, 20.0]).unwrap();
    assert_eq!(moments, [10.0, 10.0, 0.0]);
    let stated = Stated { shear_factors: Some([1.0; 2]), torsion_constant: Some(2e-9) };
    let material = Material { young: 3.0, shear: 2.0, density: 1.0 };
    let section = circle.section(&material, &stated).unwrap();
    close(section.stiffness()[5], 4e-9, 1e-15);
    close(section.stiffness()[0], 2.0 * circle.area(), 1e-15);
}

#[test]
fn impossible_sections_are_refused() {
    let message = Section::new([1.0, 1.0, -2.0, 1.0, 1.0, 1.0], [1.0; 4]).unwrap_err();
    let expected = "EA of the cross-section is -2; it must be a positive finite number";
    assert_eq!(message.to_string(), expected);
    assert!(Section::euler_moments([1.0, 1.0, 3.0]).is_err());
    assert!(Material::from_poisson(1.0, 0.7, 1.0).is_err());
    let material = Material { young: 3.0, shear: 2.0, density: 1.0 };
    let tube = Profile::Tube { outer: 0.1, inner: 0.2 };
    let refused = tube.section(&material, &Stated::default()).unwrap_err().to_string();
    assert!(refused.contains("0.2 m"), "{refused}");
    let strange = Section::new([1.0; 6], [1.0, f64::NAN, 0.0, 0.0]);
    assert!(matches!(strange, Err(SectionError::Negative { what: "rhoI1", .. })));
}

const WALLS: Walls = Walls { width: 0.08, height: 0.1, flange: 2e-4, web: 3e-4 };

/// `∫ f dA` over rectangles `[x_0, x_1, y_0, y_1]`, by the midpoints of many stripes.
fn over(parts: &[[f64; 4]], f: impl Fn(f64, f64) -> f64) -> f64 {
    const N: usize = 400;
    let of = |[x0, x1, y0, y1]: &[f64; 4]| {
        let (dx, dy) = ((x1 - x0) / N as f64, (y1 - y0) / N as f64);
        let at = |i: usize, j: usize| (x0 + (i as f64 + 0.5) * dx, y0 + (j as f64 + 0.5) * dy);
        let all = (0..N).flat_map(|i| (0..N).map(move |j| (i, j)));
        all.map(|(i, j)| f(at(i, j).0, at(i, j).1)).sum::<f64>() * dx * dy
    };
    parts.iter().map(of).sum()
}

#[test]
fn areas_and_second_moments_are_those_of_the_walls() {
    let walls = Walls { width: 0.08, height: 0.1, flange: 0.01, web: 0.006 };
    let (w, h, t) = (walls.width, walls.height, walls.web);
    let (low, high) = (-0.5 * h + walls.flange, 0.5 * h - walls.flange);
    let flanges = |x0: f64| [[x0, x0 + w, -0.5 * h, low], [x0, x0 + w, high, 0.5 * h]];
    let with = |webs: &[[f64; 4]], x0: f64| [&flanges(x0)[..], webs].concat();
    let half = 0.5 * w;
    let shapes = [
        (
            Profile::Box(walls),
            with(&[[-half, t - half, low, high], [half - t, half, low, high]], -half),
        ),
        (Profile::I(walls), with(&[[-0.5 * t, 0.5 * t, low, high]], -half)),
        (Profile::Channel(walls), with(&[[0.0, t, low, high]], 0.0)),
    ];
    for (profile, parts) in shapes {
        let area = over(&parts, |_, _| 1.0);
        let x_c = over(&parts, |x, _| x) / area;
        close(profile.area(), area, 1e-12);
        let [I1, I2] = profile.second_moments();
        close(I1, over(&parts, |_, y| y * y), 1e-4);
        close(I2, over(&parts, |x, _| (x - x_c).powi(2)), 1e-4);
    }
}

/// A line of the middle of a wall: from, to, thickness, shear flow per shear force at its start.
type Wall = ([f64; 2], [f64; 2], f64, f64);

/// `(1/A_s, e)` of thin walls under a shear force of 1 N, by steps along them: the flow is
/// integrated from `q' = −t ξ/I`, its energy and its moment about the origin are summed.
fn flow(walls: &[Wall], along: usize, moment: f64) -> (f64, f64) {
    const N: usize = 20_000;
    let (mut energy, mut torque) = (0.0, 0.0);
    for (from, to, t, start) in walls {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let (ds, mut q) = (length / N as f64, *start);
        let tangent = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
        for k in 0..N {
            let s = (k as f64 + 0.5) * ds;
            let x = [from[0] + s * tangent[0], from[1] + s * tangent[1]];
            let change = -t * x[along] / moment * ds;
            let middle = q + 0.5 * change;
            energy += middle * middle / t * ds;
            torque += (x[0] * tangent[1] - x[1] * tangent[0]) * middle * ds;
            q += change;
        }
    }
    (energy, torque)
}

#[test]
fn shear_of_thin_walls_is_that_of_their_flow() {
    let Walls { width, height, flange, web } = WALLS;
    let (h, b) = (height - flange, width - 0.5 * web);
    let a = 0.5 * h;
    let factor = |profile: Profile, k: usize| profile.shear_factors(0.3)[k] * profile.area();

    // channel, from the tip of the lower flange to that of the upper one, web at x = −x_c
    let x_c = b * flange * b / (2.0 * b * flange + h * web);
    let (tip, back) = (b - x_c, -x_c);
    let corners = [[tip, -a], [back, -a], [back, a], [tip, a]];
    let thickness = [flange, web, flange];
    let channel = |along: usize, moment: f64| {
        let mut start = 0.0;
        let wall = |k: usize| {
            let (from, to, t) = (corners[k], corners[k + 1], thickness[k]);
            let own = (from, to, t, start);
            let length = (to[0] - from[0]).hypot(to[1] - from[1]);
            start -= t * 0.5 * (from[along] + to[along]) / moment * length;
            own
        };
        flow(&(0..3).map(wall).collect::<Vec<_>>(), along, moment)
    };
    let [I1, I2] = [
        2.0 * b * flange * a * a + web * h.powi(3) / 12.0,
        2.0 * flange * (tip.powi(3) + x_c.powi(3)) / 3.0 + h * web * x_c * x_c,
    ];
    let profile = Profile::Channel(WALLS);
    let (energy, torque) = channel(1, I1);
    close(factor(profile, 1), 1.0 / energy, 1e-3);
    // the force along d_2 acts where its moment is that of the flow
    // of full walls, from the middle of the web
    let centroid = channel_centroid(&WALLS) - 0.5 * web;
    close(profile.shear_center()[0], torque + x_c - centroid, 1e-3);
    let (energy, torque) = channel(0, I2);
    close(factor(profile, 0), 1.0 / energy, 1e-3);
    assert!(torque.abs() < 1e-9, "{torque:e}");

    // I: both halves of a flange feed the web
    let I1 = 2.0 * width * flange * a * a + web * h.powi(3) / 12.0;
    let half = 0.5 * width;
    let fed = 2.0 * half * flange * a / I1;
    let walls = [
        ([half, -a], [0.0, -a], flange, 0.0),
        ([-half, -a], [0.0, -a], flange, 0.0),
        ([0.0, -a], [0.0, a], web, fed),
        ([half, a], [0.0, a], flange, 0.0),
        ([-half, a], [0.0, a], flange, 0.0),
    ];
    close(factor(Profile::I(WALLS), 1), 1.0 / flow(&walls, 1, I1).0, 1e-3);
    close(factor(Profile::I(WALLS), 0), 5.0 / 6.0 * 2.0 * width * flange, 1e-12);

    // box: from the middle of the lower flange up both webs
    let c = 0.5 * (width - web);
    let I1 = 4.0 * c * flange * a * a + 2.0 * web * h.powi(3) / 12.0;
    let fed = c * flange * a / I1;
    let side = |sign: f64| {
        [
            ([0.0, -a], [sign * c, -a], flange, 0.0),
            ([sign * c, -a], [sign * c, a], web, fed),
            ([sign * c, a], [0.0, a], flange, fed),
        ]
    };
    let (energy, torque) = flow(&[side(1.0), side(-1.0)].concat(), 1, I1);
    close(factor(Profile::Box(WALLS), 1), 1.0 / energy, 1e-3);
    assert!(torque.abs() < 1e-9, "{torque:e}");
    let turned = Walls { width: height, height: width, flange: web, web: flange };
    close(factor(Profile::Box(WALLS), 0), factor(Profile::Box(turned), 1), 1e-12);
}

#[test]
fn torsion_of_thin_walls() {
    // a square tube: J_t = t b³, with b between the middles of walls; a slit one: ⅓ 4 b t³
    let square = Walls { width: 0.1, height: 0.1, flange: 1e-3, web: 1e-3 };
    close(Profile::Box(square).torsion_constant(), 1e-3 * 0.099_f64.powi(3), 1e-12);
    let of_i = (2.0 * 0.08 * 2e-4_f64.powi(3) + 0.0998 * 3e-4_f64.powi(3)) / 3.0;
    close(Profile::I(WALLS).torsion_constant(), of_i, 1e-12);
    let of_channel = (2.0 * 0.07985 * 2e-4_f64.powi(3) + 0.0998 * 3e-4_f64.powi(3)) / 3.0;
    close(Profile::Channel(WALLS).torsion_constant(), of_channel, 1e-12);
    let thick = Walls { flange: 0.06, ..WALLS };
    let material = Material { young: 3.0, shear: 2.0, density: 1.0 };
    let refused = Profile::I(thick).section(&material, &Stated::default()).unwrap_err().to_string();
    assert_eq!(refused, "walls of 0.12 m do not fit into 0.1 m");
    let channel = Profile::Channel(WALLS).section(&material, &Stated::default()).unwrap();
    let (found, expected) = (channel.centers().shear, Profile::Channel(WALLS).shear_center());
    close(found[0], expected[0], 1e-9);
    assert!(channel.turned(FRAC_PI_2).centers().shear[1] < 0.0, "behind the web");
}
