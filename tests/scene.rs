//! The animated scene of a run in a real browser: it draws the bodies where they are, and obeys keys.
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

/// The folder of a run of a shipped model.
fn run(case: &str, model: &str, set: &[&str]) -> PathBuf {
    let folder = folder("scene", case);
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/models").join(model);
    let mut command = command(&folder, &["run"]);
    command.arg(model).arg("--force").arg("-o").arg(&folder);
    set.iter().for_each(|set| {
        command.args(["--set", set]);
    });
    assert!(command.output().unwrap().status.success());
    folder
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
    let open = |what: &str| {
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
        ]);
        command.arg(format!("--user-data-dir={}", folder.join("browser").display()));
        command.arg(format!("--window-size={},{}", size[0], size[1]));
        command.arg(what).arg(format!("file://{}#{fragment}", page.display()));
        let output = command.output().unwrap();
        (String::from_utf8_lossy(&output.stdout).into_owned(), output.stderr)
    };
    open(&format!("--screenshot={}", picture.display()));
    let (document, log) = open("--dump-dom");
    let log = String::from_utf8_lossy(&log).into_owned();
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

/// Every chart over time has a line at the time of the scene.
fn assert_marked(shown: &Shown, t: f64) {
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
    assert!(charts.len() > 5, "{} charts", charts.len());
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
        assert_marked(&shown, t);
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

/// An angle bar, turned by a quarter about `-y`, between two marks.
const ANGLE_BAR: &str = r#"
model = { name = "angle bar" }
simulation = { step = 0.01, end = 0.1 }
[[body]]
name = "bar"
shape = { type = "mesh", file = "bar.obj", density = 1.0 }
rotation_vector = [0, "= -pi/2", 0]
[[body]]
name = "left"
position = [-4, 0, 0]
shape = { type = "sphere", dimensions = [0.1], density = 1.0 }
[[body]]
name = "right"
position = [4, 0, 0]
shape = { type = "sphere", dimensions = [0.1], density = 1.0 }
"#;

#[test]
fn a_mesh_is_drawn_where_its_triangles_are() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "mesh");
    std::fs::write(folder.join("bar.obj"), crate::meshes::angle_bar()).unwrap();
    std::fs::write(folder.join("bar.toml"), ANGLE_BAR).unwrap();
    assert!(command(&folder, &["run", "bar.toml", "-o", "."]).output().unwrap().status.success());
    let page = folder.join("report.html");
    let shown = show(browser, &page, "t=0.05&view=front", [1100, 900]);
    assert_eq!(shown.console, Vec::<String>::new());
    let [bar, left, right] = ["bar", "left", "right"].map(|name| shown.member(name));
    let scale = (right[0] - left[0]) / 8.0;
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

#[test]
fn the_scene_obeys_keys_and_fits_a_phone() {
    let Some(browser) = browser() else { return };
    let folder = run("pendulum", "pendulum.toml", &["simulation.end=2.0"]);
    let page = folder.join("keys.html");
    let html = std::fs::read_to_string(folder.join("report.html")).unwrap();
    let keys = "<script>for (const key of ['End', 'ArrowLeft', 'ArrowLeft', '4']) \
                document.querySelector('#scene canvas').dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));\
                document.body.dataset.overflow = document.documentElement.scrollWidth - innerWidth;</script>";
    std::fs::write(&page, html.replace("</body>", &format!("{keys}</body>"))).unwrap();
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
