//! The report page: self-contained, escaped, honest about failures.
#![allow(clippy::unwrap_used)] // a test

use std::path::{Path, PathBuf};

use holonom::model::Columns;
use holonom::output::{ContactCounts, Status, SummaryBuilder};
use holonom::report;
use holonom::{
    AssemblyReport, Counts, Member, MemberKind, Model, ResidualsAtLevels, RunFailure, RunFolder,
    RunOutcome, Sample,
};

const NAME: &str = "<b>&'x'";

fn folder(case: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report").join(case);
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

fn sample(step: u64) -> Sample {
    let t = step as f64 * 0.01;
    Sample {
        step,
        t,
        q: vec![t.cos(), t.sin()],
        energy: 0.5,
        hamiltonian: 0.5 + 1e-12 * t.sin(),
        shadow: None,
        work: 0.0,
        momentum: Default::default(),
        residuals: ResidualsAtLevels { position: 2.2e-16, velocity: 0.0, momentum: 1e-7 },
        newton_iterations: 2.0,
        sensors: vec![],
        energies: vec![],
        momenta: None,
        unstable: None,
        notice: None,
        contacts: vec![],
        events: vec![],
    }
}

/// A folder as a run leaves it, with a name that means something in HTML.
fn run(case: &str, samples: u64, outcome: &RunOutcome) -> RunFolder {
    let text = include_str!("../../examples/models/pendulum.toml")
        .replace("name = \"pendulum\"", &format!("name = \"{NAME}\""));
    let model = Model::from_toml(&text).unwrap();
    let folder = RunFolder::create(folder(case), false).unwrap();
    folder.write("model.toml", &model.to_toml()).unwrap();
    let members = [Member { name: NAME.into(), kind: MemberKind::Particle2 }];
    let mut writer = folder.trajectory(&members, &Columns::usual(), false).unwrap();
    let mut builder = SummaryBuilder::default();
    for step in 0..samples {
        writer.record(&sample(step)).unwrap();
        builder.record(&sample(step));
    }
    writer.finish().unwrap();
    let assembly = AssemblyReport {
        counts: Counts { dof: 1, constraints: 1, ..Counts::default() },
        ..AssemblyReport::default()
    };
    folder.write_summary(&builder.finish(&model, &assembly, outcome, 0.1)).unwrap();
    folder
}

fn page(folder: &RunFolder) -> String {
    let files = report::write(folder).unwrap();
    std::fs::read_to_string(&files[0]).unwrap()
}

#[test]
fn the_page_needs_nothing_else_and_escapes_names() {
    let folder = run("page", 5000, &RunOutcome::Done);
    let page = page(&folder);
    // links to its own sections stay on it
    let without_names = page.replace("http://www.w3.org/2000/svg", "").replace("href=\"#", "");
    for outside in ["http", "src=", "href=", "url(", "@import", "import(", "fetch(", "XMLHttp"] {
        assert!(!without_names.contains(outside), "{outside}");
    }
    assert_eq!(page.matches("<script").count(), 2, "the data of the scene, and its viewer");
    assert!(page.contains("&lt;b&gt;&amp;&#39;x&#39;"));
    assert!(!page.contains("<b>"), "a name is not markup");
    assert!(page.contains("residual <span class=\"number\">2.2e-16</span> at position level"));
    assert!(page.contains("Identically zero: velocity."), "zero curves are named");
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
    for svg in std::fs::read_dir(folder.path().join("plots")).unwrap() {
        let text = std::fs::read_to_string(svg.unwrap().path()).unwrap();
        assert!(text.starts_with("<svg") && text.contains("xmlns"), "{}", &text[..80]);
        assert!(!text.contains("<b>"), "a name is not markup");
        assert!(text.contains("time (s)"), "the axis has a unit");
    }
}

/// What an event releases is drawn until then, and plots over time mark when events act.
#[test]
fn the_page_shows_when_events_act() {
    let text = include_str!("../../examples/models/trebuchet.toml");
    let model = Model::from_toml(text).unwrap();
    let folder = RunFolder::create(folder("events"), false).unwrap();
    let mut simulation = holonom::Simulation::new(&model).unwrap();
    holonom::run::run(&model, &mut simulation, &folder, &mut |_, _| {}).unwrap();
    let page = page(&folder);
    let released = folder.read_events().unwrap()[0].t;
    let until = format!("\"until\":{released}");
    assert_eq!(page.matches(&until).count(), 1, "{until}");
    assert!(page.contains("filter(holds)"));
    let plot = std::fs::read_to_string(folder.path().join("plots/energy.svg")).unwrap();
    let marks = plot.matches("stroke-dasharray=\"1.5 2.5\"").count();
    println!("{marks} marks, released at {released} s");
    assert_eq!(marks, 2, "the release and the end");
    let calm = include_str!("../../examples/models/pendulum.toml");
    assert!(!calm.contains("[[event]]"));
}

/// How often bodies hit one another, what that took out, and what held nearly.
#[test]
fn contacts_are_told() {
    let of = |restitution: &str, change: &dyn Fn(&mut ContactCounts)| {
        let text = format!(
            "[model]\nname = \"ball\"\ngravity = [0.0, 0.0, -9.81]\n[simulation]\nstep = 0.01\n\
             end = 0.5\n[[body]]\nname = \"ball\"\nposition = [0.0, 0.0, 0.6]\n\
             shape = {{ type = \"sphere\", dimensions = [0.1], density = 900.0 }}\n[[contact]]\n\
             name = \"floor\"\nb = \"ball\"\nrestitution = {restitution}\n\
             a = {{ plane = {{ position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }} }}\n"
        );
        let model = Model::from_toml(&text).unwrap();
        let folder = RunFolder::create(folder("told"), true).unwrap();
        let mut simulation = holonom::Simulation::new(&model).unwrap();
        holonom::run::run(&model, &mut simulation, &folder, &mut |_, _| {}).unwrap();
        let mut summary = folder.summary().unwrap();
        summary.contacts.iter_mut().for_each(change);
        report::facts(&summary)
    };
    let finding = |facts: &[report::Fact], subject: &str| {
        let found = facts.iter().find(|fact| fact.subject == subject).unwrap();
        println!("{}", found.finding);
        found.finding.clone()
    };
    // it falls 0.5 m: m g z is lost where nothing is thrown back
    let facts = of("0.0", &|_| ());
    let taken = 900.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-3 * 9.81 * 0.5;
    let words = finding(&facts, "contacts");
    let told: f64 =
        words.split("about ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((told / taken - 1.0).abs() < 2e-3, "{told} J for {taken} J");
    assert!(words.starts_with("at most 1 at once; 1 node at a first touch; "), "{words}");
    assert!(finding(&facts, "energy").contains("work of forces, contacts and prescribed motions"));
    let elastic = finding(&of("1.0", &|_| ()), "contacts");
    assert_eq!(elastic, "at most 1 at once; 1 node at a first touch; 1 impact with restitution");
    let nearly = of("1.0", &|counts| {
        (counts.guarded, counts.relaxed, counts.divided) = (3, 2, 1);
        (counts.largest_deviation, counts.smallest_gap) = (2e-5, Some(-1.5e-6));
    });
    let words = finding(&nearly, "contacts");
    for part in [
        "gaps down to -1.5e-6 m or rad",
        "restitution reduced at 3 nodes",
        "1 node put between two steps",
        "at 2 nodes beside Coulomb's law by up to 2.0e-5 m/s",
    ] {
        assert!(words.contains(part), "{part}: {words}");
    }
    let calm = run("still", 5, &RunOutcome::Done).summary().unwrap();
    assert!(report::facts(&calm).iter().all(|fact| fact.subject != "contacts"));
}

#[test]
fn a_failed_run_says_so() {
    let failure = RunFailure {
        step: 3,
        t: 0.03,
        message: "Newton's method did not converge".into(),
        remedy: "Reduce the step".into(),
    };
    let folder = run("failed", 3, &RunOutcome::Failed(failure.clone()));
    let page = page(&folder);
    assert!(page.contains("The run failed in step 3, at t = 0.03 s: Newton"));
    let summary = folder.summary().unwrap();
    assert_eq!((summary.status, summary.failure), (Status::Failed, Some(failure)));
}

#[test]
fn a_run_with_the_start_alone_states_nothing_of_its_steps() {
    let (message, remedy) = ("Newton's method did not converge".into(), "Reduce the step".into());
    let failure = RunFailure { step: 312, t: 3.12, message, remedy };
    let summary = run("early", 1, &RunOutcome::Failed(failure)).summary().unwrap();
    let subjects: Vec<_> = report::facts(&summary).iter().map(|fact| fact.subject).collect();
    assert_eq!((summary.recorded, summary.steps, subjects), (1, 312, vec!["time"]));
}

#[test]
fn a_run_of_no_step_has_a_page() {
    for samples in [0, 1] {
        assert!(page(&run(&format!("short{samples}"), samples, &RunOutcome::Done)).len() > 1000);
    }
}
