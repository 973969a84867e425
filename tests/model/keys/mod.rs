//! Every key of the model file stands in a case with a value that is not its default, and each case
//! has a judgement of its own: a closed form, an identity, a geometric fact. Defects are planted in
//! the document: a key dropped, as if the reader ignored it; its value changed; entries or names
//! exchanged, as if they were wired to the neighbour; a key moved to another entry. Each has to
//! change the judgement.
#![allow(clippy::unwrap_used)] // a test

mod beams;
mod bodies;
mod bushings;
mod compliant;
mod connections;
mod contacts;
mod controls;
mod curves;
mod defects;
mod events;
pub(crate) mod forces;
mod frames;
mod general_sections;
mod identify;
mod joints;
mod judged;
mod laws;
mod methods;
mod pictures;
mod rolling;
mod schema;
mod sections;
mod sensors;
mod settings;
mod signals;
mod stops;

use std::collections::{BTreeMap, BTreeSet};

pub(crate) use judged::{Checks, Run};

/// A small model with its judgement.
pub(crate) struct Case {
    /// What it is called in messages.
    pub(crate) name: String,
    /// The model file.
    pub(crate) text: String,
    /// Files beside it.
    pub(crate) files: Vec<(&'static str, String)>,
    /// Compares what a run shows with what the keys of `text` mean.
    pub(crate) judge: Box<dyn Fn(&Run) -> Checks>,
    /// Whether it judges `[simulation]`; others are of any step.
    pub(crate) settings: bool,
    /// The beginning of the paths whose defects are planted; the others are those of another case.
    pub(crate) only: &'static str,
    /// Keys or defects, as messages begin with them (or with what stands before a `*`), that change
    /// nothing here, each with the reason.
    pub(crate) blind: Vec<(&'static str, &'static str)>,
}

impl Case {
    pub(crate) fn new(
        name: impl Into<String>,
        text: impl Into<String>,
        judge: impl Fn(&Run) -> Checks + 'static,
    ) -> Self {
        let (name, text) = (name.into(), text.into());
        let (files, blind) = (Vec::new(), Vec::new());
        Self { name, text, files, judge: Box::new(judge), settings: false, only: "", blind }
    }

    /// Plants defects below these paths alone.
    pub(crate) fn only(self, only: &'static str) -> Self {
        Self { only, ..self }
    }

    /// It judges `[simulation]`, too.
    pub(crate) fn settings(self) -> Self {
        Self { settings: true, ..self }
    }

    pub(crate) fn file(mut self, name: &'static str, text: impl Into<String>) -> Self {
        self.files.push((name, text.into()));
        self
    }

    pub(crate) fn blind(mut self, key: &'static str, reason: &'static str) -> Self {
        self.blind.push((key, reason));
        self
    }

    /// The same on a condition.
    pub(crate) fn blind_if(self, holds: bool, key: &'static str, reason: &'static str) -> Self {
        if holds { self.blind(key, reason) } else { self }
    }

    /// The entry of the list of what it does not see.
    fn blind_to(&self, defect: &defects::Defect) -> Option<&'static str> {
        let full = format!("{} {}", defect.path, defect.what);
        let hides = |key: &&str| match key.strip_suffix('*') {
            Some(begin) => full.starts_with(begin),
            None => full
                .strip_prefix(*key)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with([' ', '.', '['])),
        };
        self.blind.iter().map(|(key, _)| *key).find(hides)
    }

    /// The verdict of a defect: of several values in the place of one, that of the first that the
    /// reader takes.
    fn verdict_of(&self, defect: &defects::Defect) -> Verdict {
        let mut verdicts = defect.documents.iter().map(|document| self.verdict(document));
        let refused = Verdict::Refused(String::new());
        verdicts.find(|verdict| !matches!(verdict, Verdict::Refused(_))).unwrap_or(refused)
    }

    /// What the judgement says of a document: how far it is off, in tolerances; or why there is
    /// nothing to judge.
    fn verdict(&self, document: &toml::Table) -> Verdict {
        match Run::of(&self.name, document, &self.files) {
            Ok(run) => match (self.judge)(&run).worst() {
                (what, off) if off > 1.0 => Verdict::Off(what, off),
                (what, off) => Verdict::Holds(what, off),
            },
            Err(message) => Verdict::Refused(message),
        }
    }
}

/// What a case says of a document.
enum Verdict {
    Holds(String, f64),
    Off(String, f64),
    Refused(String),
}

/// Keys for which no defect reaches the judgement, or of which nothing can be judged, each with the
/// reason.
const EXCEPTIONS: [(&str, &str); 26] = [
    ("condition.of", "rest is one of controls: holonom-sim with the feature `pounce`"),
    ("condition.sensor", "under another name it is refused"),
    ("condition.type", "rest is one of controls: holonom-sim with the feature `pounce`"),
    ("optimize.guess", "of controls: holonom-sim with the feature `pounce`"),
    ("optimize.max_iterations", "with enough of them nothing changes"),
    ("optimize.refine", "of controls: holonom-sim with the feature `pounce`"),
    ("optimize.time", "of controls: holonom-sim with the feature `pounce`"),
    ("optimize.time.guess", "of controls: holonom-sim with the feature `pounce`"),
    ("optimize.time.max", "of controls: holonom-sim with the feature `pounce`"),
    ("optimize.time.min", "of controls: holonom-sim with the feature `pounce`"),
    ("contact.overlap", "without it such a start is refused"),
    ("control.max", "bounds are those of an optimum"),
    ("control.min", "bounds are those of an optimum"),
    ("constraint[rolling].plane.on", "a fixed body is one with the ground"),
    ("law.conservative", "without it compositions refuse the law"),
    ("model.dimension", "refused: positions have as many numbers"),
    ("objective.sensor", "under another name it is refused"),
    ("simulation.arc_length", "without it the run ends at the limit point"),
    ("simulation.bifurcation", "which branch a path follows: `statics/critical_loads`"),
    ("simulation.on_failure", "without it the run fails"),
    ("body.collision.density", "refused: shapes of contacts weigh nothing"),
    ("body.collision.type", "cylinders, rods and cones touch nothing yet: refused"),
    ("body.picture.density", "refused: pictures weigh nothing"),
    ("simulation.project_start", "without it such a start is refused"),
    ("table.grid", "without it the first line has to be headings"),
    ("table.name", "under another name the law that reads it is refused"),
];

/// What is found in one case.
#[derive(Default)]
struct Found {
    /// Keys in the case with a value that is not the default.
    stated: BTreeSet<String>,
    /// Words of keys.
    words: BTreeSet<String>,
    /// Keys with defects that the judgement finds; the one that shows least, with its deviation in
    /// tolerances.
    judged: BTreeMap<String, (f64, String)>,
    /// Defects that nothing finds.
    survivors: Vec<String>,
    /// Entries of the lists of what cases do not see that hide a defect, and those that hide none
    /// in all cases of a subject.
    hidden: BTreeSet<&'static str>,
    needless: Vec<String>,
    defects: usize,
}

impl Found {
    fn add(&mut self, other: Self) {
        self.stated.extend(other.stated);
        self.words.extend(other.words);
        other.judged.into_iter().for_each(|(path, shown)| self.judge(path, shown));
        self.survivors.extend(other.survivors);
        self.hidden.extend(other.hidden);
        self.needless.extend(other.needless);
        self.defects += other.defects;
    }

    fn judge(&mut self, path: String, shown: (f64, String)) {
        let least = self.judged.entry(path).or_insert_with(|| shown.clone());
        if shown.0 < least.0 {
            *least = shown;
        }
    }

    /// Of all cases of a subject.
    fn of_all(subject: &str, cases: &[Case]) -> Self {
        let (start, keys) = (std::time::Instant::now(), schema::Keys::read());
        let mut all = Self::default();
        cases.iter().for_each(|case| all.add(Self::of(case, &keys)));
        let listed = cases.iter().flat_map(|case| &case.blind);
        let needless = listed.filter(|(key, _)| !all.hidden.contains(key));
        let needless: Vec<_> = needless.map(|(key, _)| format!("{subject}: {key}")).collect();
        all.needless.extend(needless);
        let (count, seconds) = (cases.len(), start.elapsed().as_secs_f64());
        println!("{subject}: {count} cases, {} defects, {seconds:.1} s", all.defects);
        all
    }

    fn of(case: &Case, keys: &schema::Keys) -> Self {
        let document: toml::Table =
            case.text.parse().unwrap_or_else(|e| panic!("{}: {e}", case.name));
        match case.verdict(&document) {
            Verdict::Holds(what, off) => println!("{}: holds, {what} {off:.1e}", case.name),
            Verdict::Off(what, off) => panic!("{}: {what} is off by {off:e} tolerances", case.name),
            Verdict::Refused(message) => panic!("{}: {message}", case.name),
        }
        let mut found = Self::default();
        for (path, value) in keys.stated(&document) {
            if keys.default(&path) != Some(&value) {
                found.stated.insert(path.clone());
            }
            if let Some(word) = value.as_str().filter(|word| keys.words(&path).contains(*word)) {
                found.words.insert(format!("{path} = {word}"));
            }
        }
        let files: Vec<&str> = case.files.iter().map(|(name, _)| *name).collect();
        let planted = defects::of(&document, keys, &files).into_iter();
        let planted = planted.filter(|defect| defect.path.starts_with(case.only));
        let titled = document["model"].get("description").is_some();
        let planted = planted.filter(|defect| match defect.path.split('.').next() {
            Some("simulation") => case.settings,
            _ => titled || defect.path != "model.name",
        });
        for defect in planted {
            let verdict = case.verdict_of(&defect);
            found.defects += 1;
            match verdict {
                Verdict::Off(what, off) => {
                    let shown = format!("{}: {}, {what}", case.name, defect.what);
                    found.judge(defect.path, (off, shown));
                }
                Verdict::Holds(..) => match case.blind_to(&defect) {
                    Some(key) => drop(found.hidden.insert(key)),
                    None => {
                        found
                            .survivors
                            .push(format!("{}: {} {}", case.name, defect.path, defect.what));
                    }
                },
                Verdict::Refused(_) => {}
            }
        }
        found
    }
}

/// A subject with its cases.
type Subject = (&'static str, fn() -> Vec<Case>);

const SUBJECTS: [Subject; 22] = [
    ("bodies", bodies::cases),
    ("pictures", pictures::cases),
    ("forces", forces::cases),
    ("joints", joints::cases),
    ("stops", stops::cases),
    ("contacts", contacts::cases),
    ("compliant", compliant::cases),
    ("laws", laws::cases),
    ("bushings", bushings::cases),
    ("signals", signals::cases),
    ("connections", connections::cases),
    ("controls", controls::cases),
    ("identify", identify::cases),
    ("frames", frames::cases),
    ("beams", beams::cases),
    ("sections", sections::cases),
    ("general_sections", general_sections::cases),
    ("curves", curves::cases),
    ("sensors", sensors::cases),
    ("methods", methods::cases),
    ("settings", settings::cases),
    ("events", events::cases),
];

#[test]
fn every_key_has_a_judgement_that_finds_defects() {
    let keys = schema::Keys::read();
    let mut all = Found::default();
    let mut subjects = Vec::new();
    let only = std::env::var("HOLONOM_KEYS").ok().filter(|subject| !subject.is_empty());
    for (subject, cases) in SUBJECTS {
        if only.as_deref().is_some_and(|only| !subject.contains(only)) {
            continue;
        }
        subjects.push(std::thread::spawn(move || Found::of_all(subject, &cases())));
    }
    for subject in subjects {
        all.add(subject.join().unwrap());
    }
    let excepted = |path: &str| EXCEPTIONS.iter().any(|(key, _)| *key == path);
    let missing = |found: &BTreeSet<String>| -> Vec<String> {
        keys.all().filter(|key| !found.contains(*key) && !excepted(key)).cloned().collect()
    };
    for (path, (off, shown)) in &all.judged {
        println!("{path}: off by {off:.1e} tolerances at least, {shown}");
    }
    // a table is judged by its keys
    let below = |path: &str| {
        all.judged.keys().any(|key| {
            key.strip_prefix(path)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        })
    };
    let judged = keys.all().filter(|key| below(key)).cloned().collect();
    let (stated, judged) = (missing(&all.stated), missing(&judged));
    let excepted_word = |word: &str| excepted(word.split(" = ").next().unwrap_or(word));
    let words: Vec<String> =
        keys.all_words().filter(|word| !all.words.contains(word) && !excepted_word(word)).collect();
    println!(
        "{} keys, {} words, {} defects",
        keys.all().count(),
        keys.all_words().count(),
        all.defects
    );
    if only.is_none() {
        assert!(stated.is_empty(), "only with their defaults: {stated:#?}");
        assert!(words.is_empty(), "words in no case: {words:#?}");
        assert!(judged.is_empty(), "no defect is found: {judged:#?}");
    }
    assert!(all.needless.is_empty(), "hide nothing: {:#?}", all.needless);
    assert!(all.survivors.is_empty(), "what nothing finds: {:#?}", all.survivors);
}
