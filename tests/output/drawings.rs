//! Drawings of chosen columns: what they show, their formats read back, what is refused.
#![allow(clippy::unwrap_used)] // a test

use crate::output::export::{compared, python, run};
use crate::program::command::{code, folder, holonom, words};
use std::fs;
use std::path::Path;

/// Two runs of the slider crank, of 20 and 40 steps.
fn runs(case: &str) -> std::path::PathBuf {
    let folder = folder("drawings", case);
    run(&folder, "slider_crank.toml", 40);
    fs::rename(folder.join("run"), folder.join("long")).unwrap();
    run(&folder, "slider_crank.toml", 20);
    folder
}

fn drawn(folder: &Path, arguments: &[&str]) -> String {
    let all = [&["plot"], arguments, &["-o", "drawn.svg", "--force"]].concat();
    assert_eq!(code(folder, &all), 0);
    fs::read_to_string(folder.join("drawn.svg")).unwrap()
}

/// The words of an SVG.
fn texts(svg: &str) -> Vec<String> {
    let texts = svg.split("<text").skip(1).filter_map(|part| part.split_once('>'));
    texts.filter_map(|(_, rest)| rest.split_once("</text>")).map(|(text, _)| text.into()).collect()
}

/// The points of the longest line of a colour, px.
fn points(svg: &str, color: &str) -> Vec<(f64, f64)> {
    let lines = svg.lines().filter(|line| line.starts_with("<polyline") && line.contains(color));
    let longest = lines.max_by_key(|line| line.len()).unwrap();
    let list = longest.split("points=\"").nth(1).unwrap().trim_end_matches("\"/>");
    let pair = |p: &str| p.split_once(',').map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()));
    list.split(' ').filter_map(pair).collect()
}

#[test]
fn columns_with_one_unit_share_a_chart() {
    let folder = runs("units");
    let svg = drawn(&folder, &["run", "--what", "crank,momentum"]);
    let texts = texts(&svg);
    for word in ["position (m)", "angular momentum", "linear momentum", "crank.x", "Ly", "Pz"] {
        assert!(texts.iter().any(|text| text.starts_with(word)), "{word}: {texts:?}");
    }
    assert_eq!(texts.iter().filter(|text| *text == "time (s)").count(), 1, "a common axis");
}

/// A table has the numbers of the files, to the last digit.
#[test]
fn chosen_columns_are_a_table() {
    let folder = runs("table");
    let table =
        ["plot", "run", "--what", "crank.x,H:rod.y,position,energy_error", "-o", "table.csv"];
    assert_eq!(code(&folder, &table), 0);
    let read = |file: &str| -> Vec<Vec<String>> {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
    };
    let (table, trajectory) = (read("table.csv"), read("run/trajectory.csv"));
    let names = ["t", "crank.x", "rod.y", "H", "position", "change of E", "change of H"];
    assert_eq!(table[0], names);
    assert_eq!(table.len(), trajectory.len());
    let of = |name: &str| trajectory[0].iter().position(|column| column == name).unwrap();
    for (own, full) in table.iter().zip(&trajectory).skip(1) {
        for (k, name) in ["t", "crank.x", "rod.y", "H"].iter().enumerate() {
            let [own, full] = [&own[k], &full[of(name)]].map(|text| text.parse::<f64>().unwrap());
            assert_eq!(own.to_bits(), full.to_bits(), "{name}");
        }
        let change = own[3].parse::<f64>().unwrap() - table[1][3].parse::<f64>().unwrap();
        assert_eq!(own[6].parse::<f64>().unwrap().to_bits(), change.to_bits());
    }
    assert_eq!(code(&folder, &["plot", "run", "--what", "H", "-o", "table.csv"]), 2, "it exists");
}

#[test]
fn several_runs_are_compared_by_the_names_of_their_folders() {
    let folder = runs("several");
    let texts = texts(&drawn(&folder, &["run", "long", "--what", "rod.x"]));
    assert!(texts.contains(&"run".to_owned()) && texts.contains(&"long".to_owned()), "{texts:?}");
    let texts = self::texts(&drawn(&folder, &["run", "long", "--what", "rod.x,rod.y"]));
    assert!(texts.contains(&"rod.x, long".to_owned()), "{texts:?}");
}

/// A centre on a circle about the origin of the plane: the curve of one coordinate over the other
/// is one, too.
#[test]
fn a_coordinate_over_another_has_one_scale() {
    let folder = folder("drawings", "phases");
    run(&folder, "pendulum.toml", 400);
    let svg = drawn(&folder, &["run", "--what", "bob.y:bob.x"]);
    let points = points(&svg, "#0072B2");
    let lowest = points.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    let side = points[0];
    let radius = (side.0 - lowest.0).abs();
    let center = (lowest.0, lowest.1 - radius);
    let of = |p: &(f64, f64)| ((p.0 - center.0).hypot(p.1 - center.1) / radius - 1.0).abs();
    let worst = points.iter().map(of).fold(0.0, f64::max);
    assert!(points.len() > 100 && worst < 0.02, "{} points, {worst:.1e} off", points.len());
}

/// The mechanism moves in a plane; what is left across it is round-off and no curve.
#[test]
fn what_is_constant_to_round_off_is_a_straight_line() {
    let folder = folder("drawings", "flat");
    run(&folder, "andrews_squeezer.toml", 200);
    let table = fs::read_to_string(folder.join("run/trajectory.csv")).unwrap();
    let wild: String = table
        .lines()
        .enumerate()
        .map(|(k, line)| {
            let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
            if k > 0 {
                fields[4] = format!("{:e}", 1e-18 * (k % 5) as f64); // K1.z
            }
            fields.join(",") + "\n"
        })
        .collect();
    assert!(table.lines().next().unwrap().split(',').nth(4) == Some("K1.z"));
    fs::write(folder.join("run/trajectory.csv"), wild).unwrap();
    let svg = drawn(&folder, &["run", "--what", "K1.z"]);
    let heights: Vec<f64> = points(&svg, "#0072B2").iter().map(|p| p.1).collect();
    let off = heights.iter().map(|y| (y - heights[0]).abs()).fold(0.0, f64::max);
    assert!(heights.len() > 20 && off <= 0.0, "{} points, {off} px", heights.len());
    assert!(texts(&svg).contains(&"K1.z ≈ 0".to_owned()), "{:?}", texts(&svg));
}

#[test]
fn labels_of_ticks_have_few_digits() {
    let folder = folder("drawings", "digits");
    run(&folder, "heavy_top.toml", 200);
    for what in ["energy", "energy_error", "angular_momentum", "top", "total:top.z", "balance"] {
        let svg = drawn(&folder, &["run", "--what", what]);
        let digit = |c: char| c.is_ascii_digit();
        let ticks = texts(&svg).into_iter().filter(|text| text.ends_with(digit));
        let ticks: Vec<String> =
            ticks.filter(|text| !text.starts_with(char::is_alphabetic)).collect();
        let most = ticks.iter().map(|t| t.chars().filter(|c| digit(*c)).count()).max().unwrap();
        assert!(ticks.len() >= 5 && most <= 5, "{what}: {ticks:?}");
    }
}

#[test]
fn words_about_what_can_be_drawn_and_what_cannot() {
    let folder = runs("words");
    let list = holonom(&folder, &["plot", "run", "--list"]);
    insta::assert_snapshot!("drawings_list", String::from_utf8(list.stdout).unwrap());
    let cases = [
        &["--what", "crank.q", "-o", "a.svg"][..],
        &["--what", "position:t2", "-o", "a.svg"],
        &["--what", "x:crank", "-o", "a.svg"],
        &["--what", "E:crank", "-o", "a.svg"],
        &["--what", "kinetc,E", "-o", "a.svg"],
        &["--what", "E", "--against", "nothing", "-o", "a.svg"],
        &["--what", "E", "-o", "a.jpg"],
        &["run", "--what", "E", "-o", "a.csv"],
        &["--what", "E", "-o", "no/such/folder/a.svg"],
        &["--what", "E", "-o", "taken.svg"],
        &["--what", "E", "-o", "a.svg", "--size", "5x5"],
        &["--what", "E"],
        &["-o", "a.svg"],
    ];
    fs::write(folder.join("taken.svg"), "mine").unwrap();
    let mut said = String::new();
    for case in cases {
        let output = holonom(&folder, &[&["plot", "run"], case].concat());
        said += &format!(
            "$ {}\n[{}] {}\n",
            case.join(" "),
            output.status.code().unwrap(),
            words(&output)
        );
    }
    insta::assert_snapshot!("drawings_refused", said);
    assert_eq!(fs::read_to_string(folder.join("taken.svg")).unwrap(), "mine");
    assert!(!folder.join("a.svg").exists());
}

#[test]
fn more_curves_than_can_be_distinguished_are_left_out_and_counted() {
    let folder = folder("drawings", "many");
    run(&folder, "rotating_strip.toml", 2);
    let output = holonom(&folder, &["plot", "run", "--what", "positions", "-o", "many.svg"]);
    let said = words(&output);
    assert!(said.contains("note: the first 12 of ") && said.contains("many.svg"), "{said}");
    let svg = fs::read_to_string(folder.join("many.svg")).unwrap();
    let axis = |text: &&String| [".x", ".y", ".z"].iter().any(|axis| text.contains(axis));
    assert_eq!(texts(&svg).iter().filter(axis).count(), 12);
}

const PDF: &str = r#"
import pypdf
page = pypdf.PdfReader("a.pdf").pages[0]
size = [float(v) / 72 * 25.4 for v in page.mediabox[2:]]
assert abs(size[0] - 84) < 0.01 and abs(size[1] - 50) < 0.01, size
fonts = {str(f.get_object()["/BaseFont"]) for f in page["/Resources"]["/Font"].values()}
text = page.extract_text()
for word in ["angular momentum (kg·m", "time (s)", "Lx"]:
    assert word in text, text
print(fonts.pop())
"#;

#[test]
fn a_pdf_has_the_size_that_was_asked_for_and_its_words() {
    let Some(python) = python("pypdf") else { return };
    let folder = runs("pdf");
    let what = ["plot", "run", "--what", "angular_momentum", "--style", "paper-serif"];
    assert_eq!(code(&folder, &[&what[..], &["--size", "84x50", "-o", "a.pdf"]].concat()), 0);
    assert_eq!(compared(&python, PDF, &folder), "/HOLONO+LiberationSerif");
}

const PNG: &str = r#"
import vtk
from vtk.util.numpy_support import vtk_to_numpy
reader = vtk.vtkPNGReader()
reader.SetFileName("a.png")
reader.Update()
image = reader.GetOutput()
width, height, _ = image.GetDimensions()
pixels = vtk_to_numpy(image.GetPointData().GetScalars())
assert pixels.shape == (width * height, 3), pixels.shape
print(width, height, int((pixels.min(axis=1) < 128).sum() > 1000))
"#;

#[test]
fn a_png_has_600_pixels_for_each_inch_in_print() {
    let folder = runs("png");
    let what = ["plot", "run", "--what", "energies", "--style", "paper", "--size", "50.8x25.4"];
    assert_eq!(code(&folder, &[&what[..], &["-o", "a.png"]].concat()), 0);
    let file = fs::File::open(folder.join("a.png")).unwrap();
    let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    assert_eq!(reader.info().size(), (1200, 600));
    if let Some(python) = python("vtk") {
        assert_eq!(compared(&python, PNG, &folder), "1200 600 1");
    }
}
