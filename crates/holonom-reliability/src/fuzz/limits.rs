//! Inputs that are large, deep, or no files: each is answered in words.

use super::targets::Answer;
use crate::guard::guarded;
use crate::scratch::ScratchFolder;
use holonom::model::{Meshes, read_text};
use holonom::{Model, ModelError, Override};
use std::path::Path;

/// A pendulum whose parts can be replaced.
const MODEL: &str = "\
[model]
name = \"limits\"
[simulation]
step = 0.01
end = 0.1
[[body]]
name = \"body\"
mass = 1.0
inertia = [1.0, 1.0, 1.0]
";

/// An input with its name.
type Limit = (&'static str, Box<dyn Fn() -> Result<Model, ModelError> + Send>);

/// All inputs, each with the answer to it.
#[must_use]
pub fn all() -> Vec<(&'static str, Answer)> {
    let folder = ScratchFolder::new("limits");
    let (files, meshes) = (files(folder.path()), meshes(folder.path()));
    let limits = texts().into_iter().chain(overrides()).chain(files).chain(meshes);
    limits.map(|(name, read)| (name, answer(read))).collect()
}

/// The answer of a thread with the stack of a program.
fn answer(read: Box<dyn Fn() -> Result<Model, ModelError> + Send>) -> Answer {
    let run = move || guarded(|| read().map(|model| model.to_toml().len()));
    let thread = std::thread::Builder::new().stack_size(8 << 20).spawn(run);
    match thread.map(std::thread::JoinHandle::join) {
        Ok(Ok(Ok(Ok(_)))) => Answer::Accepted,
        Ok(Ok(Ok(Err(error)))) => Answer::Refused(error.to_string()),
        Ok(Ok(Err(panic))) => Answer::Wrong(panic),
        Ok(Err(_)) => Answer::Wrong("a panic outside".into()),
        Err(error) => Answer::Wrong(error.to_string()),
    }
}

/// A limit of a text.
fn text(name: &'static str, text: String) -> Limit {
    (name, Box::new(move || Model::from_toml(&text)))
}

fn texts() -> Vec<Limit> {
    let bodies = |count: usize| {
        let body = |k| format!("[[body]]\nname = \"b{k}\"\nmass = 1\ninertia = [1, 1, 1]\n");
        let head = &MODEL[..MODEL.find("[[body]]").unwrap_or(0)];
        head.to_owned() + &(0..count).map(body).collect::<String>()
    };
    vec![
        text("100,000 nested arrays", format!("x = {}", "[".repeat(100_000))),
        text("100,000 nested and closed arrays", {
            format!("x = {}{}", "[".repeat(100_000), "]".repeat(100_000))
        }),
        text("30,000 nested tables", format!("x = {}", "{a=".repeat(30_000))),
        text("a key of 100,000 parts", format!("{}a = 1", "a.".repeat(100_000))),
        text("a header of 100,000 parts", format!("[{}a]", "a.".repeat(100_000))),
        text("an array of a million numbers", {
            MODEL.replace("[1.0, 1.0, 1.0]", &format!("[{}1.0]", "1.0, ".repeat(1_000_000)))
        }),
        text("an expression of 100,000 brackets", {
            MODEL.replace("mass = 1.0", &format!("mass = \"= {}\"", "(".repeat(100_000)))
        }),
        text("an expression of 100,000 signs", {
            MODEL.replace("mass = 1.0", &format!("mass = \"= {}1\"", "-".repeat(100_000)))
        }),
        text("an expression of 100,000 powers", {
            MODEL.replace("mass = 1.0", &format!("mass = \"= 1{}\"", "^1".repeat(100_000)))
        }),
        text("2,000 parameters in a chain", {
            let parameter = |k: usize| format!("p{k} = \"= p{}\"\n", k + 1);
            let chain: String = (0..2000).map(parameter).collect();
            format!("{MODEL}[parameters]\n{chain}p2000 = 1\n")
        }),
        text("10^18 steps", MODEL.replace("end = 0.1", "end = 1e16")),
        text(
            "an order of 10^18",
            MODEL.replace("end = 0.1", "end = 0.1\norder = 1000000000000000000"),
        ),
        text("10^18 elements", beam("elements = 1000000000000000000")),
        text("10^18 elements in a leg", beam("elements = [1000000000000000000]")),
        text("100,000 bodies", bodies(100_000)),
        text("64 MiB and a byte", "#".repeat(holonom::model::MAX_BYTES + 1)),
        text("16 MiB of a name", format!("[model]\nname = \"{}\"", "n".repeat(15 << 20))),
        text("16 MiB of quotation marks", "\"".repeat(16 << 20)),
    ]
}

fn beam(elements: &str) -> String {
    format!(
        "[model]\nname = \"beam\"\n[simulation]\nstep = 0.01\nend = 0.1\n[[beam]]\nname = \"b\"\n\
         points = [[0, 0, 0], [1, 0, 0]]\n{elements}\nsection = {{ EA = 1, GA1 = 1, GA2 = 1, EI1 = 1, \
         EI2 = 1, GJ = 1, rhoA = 1, rhoI1 = 1, rhoI2 = 1 }}\n"
    )
}

fn overrides() -> Vec<Limit> {
    let set = |name, key: String, value: String| -> Limit {
        let replaced = [Override::new(key, value)];
        (name, Box::new(move || Model::from_toml_with(MODEL, &replaced)))
    };
    let dots = |count: usize| format!("model{}", ".a".repeat(count));
    vec![
        set("--set with a key of 13,000 parts", dots(13_000), "1".into()),
        set("--set with a key of 65,000 parts", dots(65_000), "1".into()),
        set("--set below a number", format!("model.name{}", ".a".repeat(65_000)), "1".into()),
        set("--set with 50,000 nested arrays", "model.name".into(), "[".repeat(50_000)),
        set(
            "--set of an index of 10^30",
            "body.body.inertia.1000000000000000000000000000000".into(),
            "1".into(),
        ),
        set("--set without a key", String::new(), "1".into()),
        set("--set of dots", "....".into(), "1".into()),
    ]
}

/// Things that are no files, or no text.
fn files(folder: &Path) -> Vec<Limit> {
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        let _ = std::fs::write(&path, bytes); // where it cannot be written the answer is in words
        path
    };
    let latin = file("latin.toml", b"[model]\nname = \"\xe9\"\n");
    let zeros = file("zeros.toml", &[0; 4096]);
    let pipe = folder.join("pipe");
    let _ = std::process::Command::new("mkfifo").arg(&pipe).status(); // where there are such
    let read = |path: &Path| {
        let path = path.to_owned();
        Box::new(move || read_text(&path).and_then(|text| Model::from_toml(&text)))
    };
    vec![
        ("a directory", read(folder)),
        ("a named pipe that nobody writes to", read(&pipe)),
        ("text that is not UTF-8", read(&latin)),
        ("4096 zeros", read(&zeros)),
        ("a file that does not exist", read(&folder.join("absent"))),
    ]
}

/// Files of meshes that are large, or no files.
fn meshes(folder: &Path) -> Vec<Limit> {
    let read = |name: &'static str, file: &str, bytes: Vec<u8>| -> Limit {
        if !bytes.is_empty() {
            let _ = std::fs::write(folder.join(file), bytes); // likewise
        }
        let shape = format!("shape = {{ type = \"mesh\", file = \"{file}\", density = 1.0 }}\n");
        let text = MODEL.replace("mass = 1.0\ninertia = [1.0, 1.0, 1.0]\n", &shape);
        let meshes = Meshes::in_folder(folder);
        (name, Box::new(move || Model::from_toml_in(&text, &[], meshes.clone())))
    };
    let pipe = folder.join("pipe.stl");
    let _ = std::process::Command::new("mkfifo").arg(&pipe).status(); // where there are such
    let fan = |count: usize| {
        let corner = |k: usize| format!("v {k} {} 1\nf 1 {} {}\n", k * k, k + 1, k + 2);
        "v 0 0 0\nv 0 1 0\n".to_owned() + &(1..count).map(corner).collect::<String>()
    };
    vec![
        read("a named pipe as a mesh", "pipe.stl", Vec::new()),
        read("a mesh of 64 MiB and a byte", "large.stl", vec![0; (64 << 20) + 1]),
        read("a mesh of 64 MiB of zeros", "zeros.obj", vec![0; 64 << 20]),
        read("a polygon of 4 million corners", "polygon.obj", {
            format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1{}", " 2 3".repeat(2_000_000)).into_bytes()
        }),
        read("4 million corners of no triangle", "corners.obj", "v 0 0 1\n".repeat(4 << 20).into()),
        read("500,000 triangles with one corner", "fan.obj", fan(500_000).into_bytes()),
    ]
}
