//! Pages in a real browser: what they show, and where.

use super::browser_process::Browser;
use crate::program::command::{command, folder};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Chromium under one of its names; without it the tests of pages print that and pass.
pub(crate) fn browser() -> Option<&'static str> {
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
pub(crate) fn shipped(model: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/models").join(model)
}

/// The folder of a run of a shipped model.
pub(crate) fn run(case: &str, model: &str, set: &[&str]) -> PathBuf {
    let folder = folder("scene", case);
    let mut command = command(&folder, &["run"]);
    command.arg(shipped(model)).arg("--force").arg("-o").arg(&folder);
    set.iter().for_each(|set| {
        command.args(["--set", set]);
    });
    assert!(command.output().unwrap().status.success());
    folder
}

/// A copy of a page whose scene receives keys when it has been read; whether it is too wide is in
/// `data-overflow`.
pub(crate) fn with_keys(page: &Path, keys: &[&str]) -> PathBuf {
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
pub(crate) struct Shown {
    pub(crate) document: String,
    pub(crate) console: Vec<String>,
    pub(crate) pixels: Vec<u8>, // red, green, blue
    pub(crate) width: usize,
}

pub(crate) fn show(browser: &str, page: &Path, fragment: &str, size: [u32; 2]) -> Shown {
    show_with(browser, page, fragment, size, &[])
}

/// The same with more options of the browser.
pub(crate) fn show_with(
    browser: &str,
    page: &Path,
    fragment: &str,
    size: [u32; 2],
    flags: &[&str],
) -> Shown {
    let address = format!("file://{}#{fragment}", page.display());
    // a browser that hangs under load is not what a page is judged by
    let shown = (0..2).find_map(|_| {
        let mut open = Browser::taken(browser, flags);
        let shown = open.show(&address, size)?;
        open.give_back();
        Some(shown)
    });
    shown.expect("the browser hung twice")
}

impl Shown {
    pub(crate) fn attribute(&self, name: &str) -> &str {
        let from = self.document.find(&format!("data-{name}=\"")).unwrap();
        self.document[from..].split('"').nth(1).unwrap()
    }

    /// Where a member is on the canvas, px.
    pub(crate) fn member(&self, name: &str) -> [f64; 2] {
        let all = self.attribute("members");
        let one = all.split("; ").find(|one| one.starts_with(&format!("{name} "))).unwrap();
        let mut numbers = one.rsplit(' ').map(|number| number.parse().unwrap());
        let (y, x) = (numbers.next().unwrap(), numbers.next().unwrap());
        [x, y]
    }

    /// The colour of the page at a place of the canvas.
    pub(crate) fn color(&self, [x, y]: [f64; 2]) -> [u8; 3] {
        let corner = ["left", "top"].map(|edge| self.attribute(edge).parse::<f64>().unwrap());
        let [x, y] = [(x + corner[0]) as usize, (y + corner[1]) as usize];
        let at = 3 * (y * self.width + x);
        [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]
    }
}

/// Every chart over time or load factor has a line at that of the scene.
pub(crate) fn assert_marked(shown: &Shown, t: f64, least: usize) {
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
