//! The animated scenes of pages in a real browser: they draw the bodies where they are, and obey keys.
#![allow(clippy::unwrap_used)] // a test

use crate::command::{command, folder};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Chromium under one of its names; without it the tests of this file print that and pass.
fn browser() -> Option<&'static str> {
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    let found = names.into_iter().find(|name| {
        Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success())
    });
    if found.is_none() {
        println!("NOT TESTED: no Chromium on this machine, pages are not opened in a browser");
    }
    found
}

/// A shipped model.
fn shipped(model: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/models").join(model)
}

/// The folder of a run of a shipped model.
fn run(case: &str, model: &str, set: &[&str]) -> PathBuf {
    let folder = folder("scene", case);
    let mut command = command(&folder, &["run"]);
    command.arg(shipped(model)).arg("--force").arg("-o").arg(&folder);
    set.iter().for_each(|set| {
        command.args(["--set", set]);
    });
    assert!(command.output().unwrap().status.success());
    folder
}

/// A copy of a page whose scene receives keys when it has been read; whether it is too wide is in `data-overflow`.
fn with_keys(page: &Path, keys: &[&str]) -> PathBuf {
    let html = std::fs::read_to_string(page).unwrap();
    let script = format!(
        "<script>for (const key of {keys:?}) document.querySelector('#scene canvas').dispatchEvent(new \
         KeyboardEvent('keydown', {{ key, bubbles: true }}));document.body.dataset.overflow = \
         document.documentElement.scrollWidth - innerWidth;</script>"
    );
    let pressed = page.with_file_name("keys.html");
    std::fs::write(&pressed, html.replace("</body>", &format!("{script}</body>"))).unwrap();
    pressed
}

/// A page as a browser shows it: the document after its scripts, the console, and the pixels.
struct Shown {
    document: String,
    console: Vec<String>,
    pixels: Vec<u8>,
    width: usize,
}

fn show(browser: &str, page: &Path, fragment: &str, size: [u32; 2]) -> Shown {
    let folder = page.parent().unwrap();
    let picture = folder.join("page.png");
    let mut command = Command::new(browser);
    command.args([
        "--headless=new",
        "--no-sandbox",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--hide-scrollbars",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--enable-logging=stderr",
        "--virtual-time-budget=3000",
        "--dump-dom",
    ]);
    command.arg(format!("--screenshot={}", picture.display()));
    command.arg(format!("--user-data-dir={}", folder.join("browser").display()));
    command.arg(format!("--window-size={},{}", size[0], size[1]));
    command.arg(format!("file://{}#{fragment}", page.display()));
    let output = command.output().unwrap();
    let document = String::from_utf8_lossy(&output.stdout).into_owned();
    let log = String::from_utf8_lossy(&output.stderr).into_owned();
    let console = log.lines().filter(|line| line.contains("CONSOLE")).map(str::to_owned).collect();
    let file = std::io::BufReader::new(std::fs::File::open(&picture).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!(info.bit_depth, png::BitDepth::Eight);
    let samples = info.color_type.samples();
    let pixels = pixels[..info.buffer_size()].chunks(samples).flat_map(|p| [p[0], p[1], p[2]]);
    Shown { document, console, pixels: pixels.collect(), width: info.width as usize }
}

impl Shown {
    fn attribute(&self, name: &str) -> &str {
        let from = self.document.find(&format!("data-{name}=\"")).unwrap();
        self.document[from..].split('"').nth(1).unwrap()
    }

    /// Where a member is on the canvas, px.
    fn member(&self, name: &str) -> [f64; 2] {
        let all = self.attribute("members");
        let one = all.split("; ").find(|one| one.starts_with(&format!("{name} "))).unwrap();
        let mut numbers = one.rsplit(' ').map(|number| number.parse().unwrap());
        let (y, x) = (numbers.next().unwrap(), numbers.next().unwrap());
        [x, y]
    }

    /// The colour of the page at a place of the canvas.
    fn color(&self, [x, y]: [f64; 2]) -> [u8; 3] {
        let corner = ["left", "top"].map(|edge| self.attribute(edge).parse::<f64>().unwrap());
        let [x, y] = [(x + corner[0]) as usize, (y + corner[1]) as usize];
        let at = 3 * (y * self.width + x);
        [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]
    }
}

/// Positions `(x, y)` of members in the row of `trajectory.csv` at a time.
fn positions(folder: &Path, t: f64, members: [&str; 3]) -> [[f64; 2]; 3] {
    let text = std::fs::read_to_string(folder.join("trajectory.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    let row = lines.find(|row| (row[1].parse::<f64>().unwrap() - t).abs() < 1e-9).unwrap();
    let value = |name: String| row[head.iter().position(|h| *h == name).unwrap()].parse().unwrap();
    members.map(|m| [value(format!("{m}.x")), value(format!("{m}.y"))])
}

/// Every chart over time or load factor has a line at that of the scene.
fn assert_marked(shown: &Shown, t: f64, least: usize) {
    let charts: Vec<&str> = shown.document.split("data-plot=\"").skip(1).collect();
    for chart in &charts {
        let edges = chart.split('"').next().unwrap().split(' ').map(|edge| edge.parse().unwrap());
        let edges: Vec<f64> = edges.collect();
        let line = chart.split("class=\"cursor\"").nth(1).expect("a line on each chart");
        let x: f64 =
            line.split("x1=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
        let part = (t - edges[4]) / (edges[5] - edges[4]);
        let off = x - (edges[0] + part * (edges[1] - edges[0]));
        assert!(off.abs() < 0.5, "{off} px");
    }
    assert!(charts.len() >= least, "{} charts", charts.len());
}

#[test]
fn a_plane_motion_is_shown_to_scale() {
    let Some(browser) = browser() else { return };
    let folder = run("plane", "andrews_squeezer.toml", &[]);
    let members = ["K1", "K3", "K7"];
    for t in [0.01, 0.025] {
        let page = folder.join("report.html");
        let shown = show(browser, &page, &format!("t={t}&view=top"), [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        let [a, b, c] = members.map(|name| shown.member(name));
        assert_marked(&shown, t, 6);
        let [x, y, z] = positions(&folder, t, members);
        let scale = (c[0] - a[0]).hypot(c[1] - a[1]) / (z[0] - x[0]).hypot(z[1] - x[1]);
        for (pixel, place) in [(b, y), (c, z)] {
            let expected = [scale * (place[0] - x[0]), -scale * (place[1] - x[1])];
            let found = [pixel[0] - a[0], pixel[1] - a[1]];
            let off = (found[0] - expected[0]).hypot(found[1] - expected[1]);
            println!("t = {t} s: {found:?} px, expected {expected:?} px");
            assert!(off < 1.0 && scale > 100.0, "{off} px");
        }
    }
}

#[test]
fn bodies_are_drawn_in_their_colours() {
    let Some(browser) = browser() else { return };
    let set = ["simulation.end=1.0", "simulation.every=10"];
    let folder = run("colours", "slider_crank.toml", &set);
    let page = folder.join("report.html");
    let size = std::fs::metadata(&page).unwrap().len();
    assert!(size < 3_000_000, "{size} bytes");
    for t in [0.3, 0.9] {
        let shown = show(browser, &page, &format!("t={t}&view=front"), [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        // Okabe and Ito's blue, vermilion and green
        let [crank, rod, slider] =
            ["crank", "rod", "slider"].map(|name| shown.color(shown.member(name)).map(i32::from));
        println!("t = {t} s: {crank:?} {rod:?} {slider:?}");
        assert!(crank[2] > crank[0] + 40, "the crank is blue: {crank:?}");
        assert!(rod[0] > rod[2] + 60, "the rod is vermilion: {rod:?}");
        assert!(slider[1] > slider[0] + 40, "the slider is green: {slider:?}");
    }
}

/// A body of 2 kg that hangs from a revolute joint at rest: the reaction of 19.62 N points upwards to the pin, in the colour
/// of no body; `r` hides it.
const HANGING: &str = r#"
[model]
name = "hanging"
gravity = [0, 0, -9.81]
[simulation]
step = 0.01
end = 0.1
[[body]]
name = "weight"
mass = 2.0
shape = { type = "sphere", dimensions = [0.1] }
position = [0, 0, -1]
[[joint]]
name = "pin"
type = "revolute"
parent = "ground"
child = "weight"
position = [0, 0, 0]
axis = [0, 1, 0]
[[sensor]]
name = "support"
type = "reaction"
of = "pin"
frame = "space"
"#;

/// Two marks, eight metres apart.
const MARKS: &str = r#"
[[body]]
name = "left"
position = [-4, 0, 0]
shape = { type = "sphere", dimensions = [0.1], density = 1.0 }
[[body]]
name = "right"
position = [4, 0, 0]
shape = { type = "sphere", dimensions = [0.1], density = 1.0 }
"#;

/// An angle bar, turned by a quarter about `-y`, between the marks.
const ANGLE_BAR: &str = r#"
model = { name = "angle bar" }
simulation = { step = 0.01, end = 0.1 }
[[body]]
name = "bar"
shape = { type = "mesh", file = "bar.obj", density = 1.0 }
rotation_vector = [0, "= -pi/2", 0]
"#;

/// A model between the marks, seen from the front, and the scale of the picture, px/m.
fn between_marks(browser: &str, folder: &Path, model: &str) -> (Shown, f64) {
    std::fs::write(folder.join("marked.toml"), format!("{model}{MARKS}")).unwrap();
    assert!(command(folder, &["run", "marked.toml", "-o", "."]).output().unwrap().status.success());
    let shown = show(browser, &folder.join("report.html"), "t=0.05&view=front", [1100, 900]);
    assert_eq!(shown.console, Vec::<String>::new());
    let [left, right] = ["left", "right"].map(|name| shown.member(name));
    let scale = (right[0] - left[0]) / 8.0;
    (shown, scale)
}

#[test]
fn a_mesh_is_drawn_where_its_triangles_are() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "mesh");
    std::fs::write(folder.join("bar.obj"), crate::meshes::angle_bar()).unwrap();
    let (shown, scale) = between_marks(browser, &folder, ANGLE_BAR);
    let bar = shown.member("bar");
    assert!(scale > 20.0, "{scale} px/m");
    // in the axes of the file, whose centre of mass is (1.1, 0.25, 1.1): x points upwards now, z to the left
    let color = |x: f64, z: f64| {
        let place = [bar[0] - (z - 1.1) * scale, bar[1] - (x - 1.1) * scale];
        shown.color(place).map(i32::from)
    };
    let blue = |[red, _, blue]: [i32; 3]| blue > red + 40;
    for (x, z) in [(2.7, 0.5), (0.5, 2.7), (0.5, 0.5), (0.1, 1.5), (1.5, 0.9)] {
        assert!(blue(color(x, z)), "({x}, {z}) lies in the bar: {:?}", color(x, z));
    }
    for (x, z) in [(2.0, 2.0), (1.3, 1.3), (-0.3, 1.0), (3.3, 0.5), (0.5, 3.3)] {
        assert!(!blue(color(x, z)), "({x}, {z}) lies beside the bar: {:?}", color(x, z));
    }
}

/// A ball with a box on a long arm beside it, between the marks.
const PICTURE: &str = r#"
model = { name = "picture" }
simulation = { step = 0.01, end = 0.1 }
[[body]]
name = "arm"
mass = 1
inertia = [1, 1, 1]
rotation_vector = [0, "= -pi/2", 0]
picture = [
    { type = "sphere", dimensions = [0.5] },
    { type = "box", dimensions = [2.0, 0.4, 0.4], position = [0, 0, 2] },
]
"#;

#[test]
fn all_shapes_of_a_picture_are_drawn_at_their_places() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "picture");
    let (shown, scale) = between_marks(browser, &folder, PICTURE);
    let arm = shown.member("arm");
    // in the axes of the body: x points upwards, z to the left
    let blue = |x: f64, z: f64| {
        let place = [arm[0] - z * scale, arm[1] - x * scale];
        let [red, _, blue] = shown.color(place).map(i32::from);
        blue > red + 40
    };
    for (x, z) in [(0.0, 0.0), (0.4, 0.0), (0.8, 2.0), (-0.8, 2.0), (0.0, 1.9)] {
        assert!(blue(x, z), "({x}, {z}) lies in the picture");
    }
    for (x, z) in [(0.7, 0.0), (0.0, 1.2), (1.3, 2.0), (0.0, -2.0), (0.8, 1.5)] {
        assert!(!blue(x, z), "({x}, {z}) lies beside it");
    }
}

#[test]
fn reactions_are_arrows_that_a_key_hides() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "reactions");
    std::fs::write(folder.join("hanging.toml"), HANGING).unwrap();
    assert!(
        command(&folder, &["run", "hanging.toml", "-o", "."]).output().unwrap().status.success()
    );
    let html = std::fs::read_to_string(folder.join("report.html")).unwrap();
    let page = folder.join("hidden.html");
    let key = "<script>document.querySelector('#scene canvas').dispatchEvent(new KeyboardEvent('keydown', \
               { key: 'r', bubbles: true }));document.body.dataset.pressed = \
               document.querySelector('[data-reactions]').getAttribute('aria-pressed');</script>";
    std::fs::write(&page, html.replace("</body>", &format!("{key}</body>"))).unwrap();
    let arrow = |page: &Path| {
        let shown = show(browser, page, "t=0.05&view=front", [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        // yellow-brown: much red and green, little blue
        let own = |p: &&[u8]| p[0] > p[2].saturating_add(60) && p[1] > p[2].saturating_add(50);
        let count = shown.pixels.chunks(3).filter(own).count();
        (count, shown.document.contains("data-pressed=\"false\""))
    };
    let (shown, hidden) = (arrow(&folder.join("report.html")), arrow(&page));
    println!("pixels of the arrow: {} shown, {} hidden", shown.0, hidden.0);
    assert!(shown.0 > 100 && hidden.0 < shown.0 / 10, "{} and {} pixels", shown.0, hidden.0);
    assert!(hidden.1 && !shown.1, "the button tells");
}

/// A point mass of 2 kg at rest, 1 m below a bar, 1 m below a spring that is stretched by 0.5 m.
const SUSPENDED: &str = r#"
model = { name = "suspended", gravity = [0, 0, -9.81] }
simulation = { step = 0.01, end = 0.1 }
particle = [{ name = "left", mass = 2.0, position = [0, 0, -1] }, { name = "right", mass = 2.0, position = [1, 0, -1] }]
bar = [{ name = "rod", from = "ground", point = [0, 0, 0], to = "left" }]
spring = [{ name = "coil", from = "ground", point_from = [1, 0, 0], to = "right", stiffness = 39.24, natural_length = 0.5 }]
sensor = [{ name = "pull", type = "reaction", of = "rod" }, { name = "stretch", type = "effort", of = "coil" }]
"#;

#[test]
fn tensions_of_bars_and_springs_are_arrows_at_their_ends() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "tensions");
    std::fs::write(folder.join("suspended.toml"), SUSPENDED).unwrap();
    let run = command(&folder, &["run", "suspended.toml", "-o", "."]).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let shown = show(browser, &folder.join("report.html"), "t=0.05&view=front", [1100, 900]);
    assert_eq!(shown.console, Vec::<String>::new());
    for name in ["left", "right"] {
        // both pull upwards with 19.62 N
        let [x, y] = shown.member(name);
        let arrow = |dy: f64| {
            (-3..=3).any(|dx| {
                let [red, green, blue] = shown.color([x + f64::from(dx), y - dy]);
                red > blue.saturating_add(60) && green > blue.saturating_add(50)
            })
        };
        let above = (15..105).filter(|dy| arrow(f64::from(*dy))).count();
        println!("{name}: {above} of 90 pixels above the point mass show the arrow");
        assert!(above > 80, "{name}: {above} pixels of the arrow");
    }
}

#[test]
fn the_scene_obeys_keys_and_fits_a_phone() {
    let Some(browser) = browser() else { return };
    let folder = run("pendulum", "pendulum.toml", &["simulation.end=2.0"]);
    let page = with_keys(&folder.join("report.html"), &["End", "ArrowLeft", "ArrowLeft", "4"]);
    for size in [[360, 740], [3840, 2160]] {
        let shown = show(browser, &page, "t=0.5", size);
        assert_eq!(shown.console, Vec::<String>::new());
        let t: f64 = shown.attribute("time").parse().unwrap();
        println!(
            "{size:?}: t = {t} s after End and two steps back, view {}",
            shown.attribute("view")
        );
        assert!(t > 1.9 && t < 2.0, "{t}");
        assert_eq!(shown.attribute("view"), "top");
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
    }
}

/// A cantilever of 1 m, softer in bending along `z`: mode 1.
const CANTILEVER: &str = r#"
[model]
name = "cantilever"
[[beam]]
name = "beam"
points = [[0, 0, 0], [1, 0, 0]]
elements = 16
normal = [0, 0, 1]
section = { EA = 1e6, GA1 = 1e6, GA2 = 1e6, EI1 = 4, EI2 = 1, GJ = 1, rhoA = 1, rhoI1 = 1e-6, rhoI2 = 1e-6 }
start = "clamped"
[simulation]
step = 0.01
end = 1.0
"#;

/// Mode 1 of Euler and Bernoulli's cantilever, 1 at the end.
fn first_mode(x: f64) -> f64 {
    let k = 1.875_104_068_711_961_f64;
    let sigma = (k.sinh() - k.sin()) / (k.cosh() + k.cos());
    let shape = |x: f64| (k * x).cosh() - (k * x).cos() - sigma * ((k * x).sinh() - (k * x).sin());
    shape(x) / shape(1.0)
}

#[test]
fn a_mode_is_shown_as_the_shape_of_the_beam() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "modes");
    std::fs::write(folder.join("cantilever.toml"), CANTILEVER).unwrap();
    let output = command(&folder, &["modes", "cantilever.toml", "-n", "4", "-o", "."]).output();
    assert!(output.unwrap().status.success());
    let page = folder.join("modes.html");
    let mut side = 0.0; // to which the shape points
    for (phase, part) in [(0.0, 1.0), (0.25, 0.0), (0.5, -1.0)] {
        let fragment = format!("mode=1&phase={phase}&view=front");
        let shown = show(browser, &page, &fragment, [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        let [root, tip] = ["beam.0", "beam.16"].map(|name| shown.member(name));
        let length = tip[0] - root[0];
        if side == 0.0 {
            side = (root[1] - tip[1]).signum();
        }
        let mut largest = 0.0_f64;
        for k in 0..=16 {
            let x = f64::from(k) / 16.0;
            let node = shown.member(&format!("beam.{k}"));
            let found = (root[1] - node[1]) / length; // of the length, upwards
            let expected = side * part * 0.15 * first_mode(x);
            largest = largest.max((found - expected).abs());
        }
        let end = (root[1] - tip[1]) / length;
        println!("phase {phase}: end at {end:.4} of the length, largest difference {largest:.1e}");
        assert!((end.abs() - 0.15 * part.abs()).abs() < 1e-3 && largest < 2e-3, "{end} {largest}");
    }
    // the tube is where its nodes are, in the colour of the first beam
    let shown = show(browser, &page, "mode=1&phase=0&view=front", [1100, 900]);
    let [middle, rest] = ["beam.8", "beam.0"].map(|name| shown.member(name));
    let [r, _, b] = shown.color(middle).map(i32::from);
    let [r0, _, b0] = shown.color([middle[0], rest[1]]).map(i32::from);
    println!("tube: red {r}, blue {b}; at rest: red {r0}, blue {b0}");
    assert!(b > r + 40 && b0 < r0 + 40, "the tube is displaced");

    let keys = with_keys(&page, &["ArrowDown", "ArrowDown", "ArrowUp", "4"]);
    for size in [[390, 800], [3840, 2160]] {
        let shown = show(browser, &keys, "phase=0", size);
        assert_eq!(shown.console, Vec::<String>::new());
        assert_eq!((shown.attribute("mode"), shown.attribute("view")), ("2", "top"));
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
    }
}

#[test]
fn twenty_modes_of_a_beam_are_a_small_page() {
    let folder = folder("scene", "many-modes");
    let mut command = command(&folder, &["modes"]);
    command.arg(shipped("bend_45.toml")).args(["-n", "20", "-o", "."]);
    assert!(command.output().unwrap().status.success());
    let page = std::fs::read_to_string(folder.join("modes.html")).unwrap();
    println!("{} bytes", page.len());
    assert!(page.len() < 3_000_000 && page.matches("<tr data-mode=").count() == 20);
}

/// A cantilever under an end moment is a circle of `4π EI/L · t` for `2 t` revolutions: at the load factor 0.5 its end is
/// back at the clamp, at 0.25 it is a half circle.
#[test]
fn equilibria_are_shown_over_the_load_factor() {
    let Some(browser) = browser() else { return };
    let folder = run("statics", "roll_up.toml", &[]);
    let page = folder.join("report.html");
    for (factor, expected) in [(0.25, 2.0 / std::f64::consts::PI), (0.5, 0.0)] {
        let shown = show(browser, &page, &format!("t={factor}&view=top"), [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        assert_marked(&shown, factor, 3);
        let [root, next, end] = ["beam.0", "beam.1", "beam.80"].map(|name| shown.member(name));
        let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let gap = distance(root, end) / (80.0 * distance(root, next));
        println!(
            "load factor {factor}: end at {gap:.3} of the length from the clamp, {expected:.3} expected"
        );
        assert!((gap - expected).abs() < 0.02, "{gap}");
        assert!(shown.document.contains(&format!("load factor {factor:.3}")));
        let rise = shown.document.split("data-rise=\"").nth(1).expect("the load path").to_owned();
        let line = rise.split("class=\"cursor\"").nth(1).unwrap();
        let number = |name: &str| -> f64 {
            line.split(&format!(" {name}=\""))
                .nth(1)
                .unwrap()
                .split('"')
                .next()
                .unwrap()
                .parse()
                .unwrap()
        };
        assert!((number("y1") - number("y2")).abs() < 1e-9, "a horizontal line on the load path");
        // on the curve of the end, which was 10 m from the clamp
        let across = rise.split("data-across=\"").nth(1).unwrap().split('"').next().unwrap();
        let across: Vec<f64> = across.split(' ').map(|edge| edge.parse().unwrap()).collect();
        let circle = rise.split("class=\"cursor-mark\"").nth(1).unwrap();
        let mark = circle.split(" cx=\"").nth(1).unwrap().split('"').next().unwrap();
        let mark: f64 = mark.parse().unwrap();
        let way =
            across[4] + (mark - across[0]) / (across[1] - across[0]) * (across[5] - across[4]);
        // end of a circular arc of 10 m, of half a turn and of a full one
        let expected = if factor < 0.3 { 10.0 * 1.0_f64.hypot(expected) } else { 10.0 };
        println!("mark on the load path at a displacement of {way:.3} m, {expected:.3} m expected");
        assert!((way - expected).abs() < 0.1, "{way}");
    }
    let keys = with_keys(&page, &["End", "ArrowLeft", "4"]);
    let shown = show(browser, &keys, "t=0.5", [390, 800]);
    let factor: f64 = shown.attribute("time").parse().unwrap();
    println!("load factor {factor} after End and one equilibrium back");
    assert!((factor - 0.95).abs() < 1e-6 && shown.attribute("view") == "top");
    assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "too wide");
}

#[test]
fn a_checked_model_stands_in_its_initial_configuration() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "check");
    let mut command = command(&folder, &["check"]);
    command.arg(shipped("slider_crank.toml")).args(["--page", "crank.html"]);
    assert!(command.output().unwrap().status.success());
    let page = with_keys(&folder.join("crank.html"), &[" ", "2"]);
    for size in [[390, 800], [1100, 900], [3840, 2160]] {
        let shown = show(browser, &page, "", size);
        assert_eq!(shown.console, Vec::<String>::new());
        let [crank, slider] =
            ["crank", "slider"].map(|name| shown.color(shown.member(name)).map(i32::from));
        println!("{size:?}: crank {crank:?}, slider {slider:?}");
        if size[0] > 500 {
            // the document of a narrower window is not laid out as its picture
            assert!(crank[2] > crank[0] + 40, "the crank is blue: {crank:?}");
            assert!(slider[1] > slider[0] + 40, "the slider is green: {slider:?}");
        }
        assert!(
            shown.document.contains("data-play=\"\" aria-label=\"play\" hidden"),
            "nothing plays"
        );
        assert_eq!(shown.attribute("view"), "front");
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
    }
}

#[test]
fn a_certificate_shows_the_motion_of_its_model() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "certificate");
    let mut command = command(&folder, &["verify"]);
    command.arg(shipped("pendulum.toml")).args(["-o", ".", "--quiet"]);
    assert!(command.output().unwrap().status.success());
    let page = with_keys(&folder.join("certificate.html"), &["2"]);
    let shown = show(browser, &page, "t=0", [1100, 1000]);
    assert_eq!(shown.console, Vec::<String>::new());
    assert_marked(&shown, 0.0, 1);
    let bob = shown.color(shown.member("bob")).map(i32::from);
    println!("the point mass: {bob:?}");
    assert!(bob[2] > bob[0] + 40, "it is blue: {bob:?}");
    for size in [[390, 800], [3840, 2160]] {
        let shown = show(browser, &page, "t=0.5", size);
        assert_eq!(shown.console, Vec::<String>::new());
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
    }
}

/// Two schemes from the same initial values: at the start the body shows the colours of both, and that of the one that is left
/// when the other is hidden.
#[test]
fn schemes_that_coincide_show_both_colours() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "compare");
    let mut command = command(&folder, &["compare"]);
    command.arg(shipped("heavy_top.toml"));
    command.args(["--schemes", "nodal,em-nodal", "--step", "0.01,0.005", "--end", "1"]);
    command.args(["--order", "2", "-o", ".", "--quiet"]);
    assert!(command.output().unwrap().status.success());
    let page = folder.join("compare.html");
    let html = std::fs::read_to_string(&page).unwrap();
    let click =
        "<script>document.querySelectorAll('.scene-legend button')[1].click();</script></body>";
    let alone = folder.join("alone.html");
    std::fs::write(&alone, html.replace("</body>", click)).unwrap();
    let colors = |page: &Path| {
        let shown = show(browser, page, "t=0&view=front", [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        let [x, y] = shown.member("top");
        let near = (-12..=12).flat_map(|i| (-12..=12).map(move |j| (f64::from(i), f64::from(j))));
        let near: Vec<[u8; 3]> = near.map(|(i, j)| shown.color([x + i, y + j])).collect();
        let blue = near.iter().filter(|c| c[2] > c[0].saturating_add(40)).count();
        let vermilion = near.iter().filter(|c| c[0] > c[2].saturating_add(60)).count();
        (blue, vermilion)
    };
    let (both, one) = (colors(&page), colors(&alone));
    println!("pixels, blue and vermilion: {both:?}, the second one hidden: {one:?}");
    assert!(both.0 > 150 && both.1 > 150, "{both:?}");
    assert!(one.0 > 450 && one.1 == 0, "{one:?}");
    let shown = show(browser, &page, "t=0.5", [1100, 900]);
    assert_marked(&shown, 0.5, 2);
    let keys = with_keys(&page, &["4"]);
    for size in [[390, 800], [3840, 2160]] {
        let shown = show(browser, &keys, "t=0.5", size);
        assert_eq!(shown.console, Vec::<String>::new());
        assert_eq!(shown.attribute("view"), "top");
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
    }
}

/// A mode that dies out without a vibration: of its displacement `e⁻¹` is left a quarter of the way, and it never changes sides.
#[test]
fn a_decay_is_not_shown_as_a_vibration() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "decay");
    let mut command = command(&folder, &["modes"]);
    command.arg(shipped("flyball_governor.toml")).args(["-n", "6", "-o", "."]);
    assert!(command.output().unwrap().status.success());
    let page = folder.join("modes.html");
    let heights = [0.0, 0.25, 0.5, 1.0].map(|phase| {
        let shown = show(browser, &page, &format!("mode=6&phase={phase}&view=front"), [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        assert!(shown.document.contains("without a vibration"));
        assert!(shown.document.contains(&format!("t = {:.2}/δ", 4.0 * phase)));
        shown.member("slider")[1]
    });
    let left = |k: usize| (heights[k] - heights[3]) / (heights[0] - heights[3]);
    let end = (-4.0_f64).exp();
    for (k, decayed) in [(1, (-1.0_f64).exp()), (2, (-2.0_f64).exp())] {
        let expected = (decayed - end) / (1.0 - end);
        println!("{:.4} of the displacement, {expected:.4} expected", left(k));
        assert!((left(k) - expected).abs() < 0.02, "{}", left(k));
    }
}
