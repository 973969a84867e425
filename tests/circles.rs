//! No files of a crate use one another in a circle.
//!
//! A file uses another where it names an item that stands there. A folder speaks for its files, so
//! what a module takes from those below it does not count, and what they take from it does.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

type ModulePath = Vec<String>;

/// What a file says of modules.
#[derive(Default)]
struct File {
    defined: BTreeSet<String>,
    /// What is imported, under which name.
    imports: Vec<(ModulePath, String)>,
    /// Paths in the code, and imports that the code names.
    used: BTreeSet<ModulePath>,
}

/// Words and the signs that paths are made of, without comments, texts and the module of tests.
fn tokens(text: &str) -> Vec<String> {
    let own = text.lines().collect::<Vec<_>>();
    let is_test = |k: usize| {
        let module = own[k..].iter().find(|line| !line.starts_with("#["));
        own[k] == "#[cfg(test)]" && module.is_some_and(|line| line.ends_with('{'))
    };
    let end = (0..own.len()).find(|k| is_test(*k)).unwrap_or(own.len());
    let mut found: Vec<String> = Vec::new();
    let mut rest = own[..end].join("\n");
    rest = rest.replace("'\"'", "").replace(r"'\''", "");
    let mut rest = &rest[..];
    while let Some(first) = rest.chars().next() {
        let word = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        if word > 0 {
            found.push(rest[..word].to_owned());
            rest = &rest[word..];
        } else if rest.starts_with("//") {
            rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
        } else if first == '"' {
            let mut escaped = false;
            let closes = |c: char| {
                let closes = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                closes
            };
            rest = &rest[1..];
            rest = &rest[rest.find(closes).map_or(rest.len(), |k| k + 1)..];
        } else {
            let sign = if rest.starts_with("::") { "::" } else { &rest[..first.len_utf8()] };
            if matches!(sign, "::" | "{" | "}" | "," | ";" | "*") {
                found.push(sign.to_owned());
            }
            rest = &rest[sign.len()..];
        }
    }
    found
}

/// Adds the paths of an import with their names; returns what follows it.
fn import<'t>(
    prefix: &[String],
    mut rest: &'t [String],
    out: &mut Vec<(ModulePath, String)>,
) -> &'t [String] {
    let mut path = prefix.to_vec();
    while let Some((word, after)) = rest.split_first() {
        rest = after;
        match word.as_str() {
            "::" => {}
            "{" => {
                while rest.first().is_some_and(|word| word != "}") {
                    rest = import(&path, rest, out);
                    rest = rest.strip_prefix(&[",".to_owned()][..]).unwrap_or(rest);
                }
                return &rest[1.min(rest.len())..];
            }
            "as" => {
                out.push((path, rest[0].clone()));
                return &rest[1..];
            }
            "self" if !path.is_empty() => {}
            _ => path.push(word.clone()),
        }
        if rest.first().is_none_or(|next| matches!(next.as_str(), "," | "}" | ";")) {
            break;
        }
    }
    let name = path.last().cloned().unwrap_or_default();
    out.push((path, name));
    rest
}

fn read(text: &str) -> File {
    const ITEMS: [&str; 7] = ["struct", "enum", "trait", "type", "fn", "const", "static"];
    let all = tokens(text);
    let (mut file, mut rest, mut depth) = (File::default(), &all[..], 0_usize);
    let mut words = BTreeSet::new();
    while let Some((word, after)) = rest.split_first() {
        rest = after;
        match word.as_str() {
            "use" => {
                rest = import(&[], rest, &mut file.imports);
                continue;
            }
            "{" => depth += 1,
            "}" => depth = depth.saturating_sub(1),
            word if ITEMS.contains(&word) && depth == 0 => {
                file.defined.extend(rest.first().cloned());
            }
            word if rest.first().is_some_and(|next| next == "::") => {
                let mut path = vec![word.to_owned()];
                while let [sign, next, ..] = rest
                    && sign == "::"
                    && next.starts_with(|c: char| c.is_alphabetic() || c == '_')
                {
                    path.push(next.clone());
                    rest = &rest[2..];
                }
                words.insert(path[0].clone());
                file.used.insert(path);
            }
            word => _ = words.insert(word.to_owned()),
        }
    }
    let named = file.imports.iter().filter(|(_, name)| words.contains(name) || name == "*");
    file.used.extend(named.map(|(path, _)| path.clone()));
    file
}

type Crate = BTreeMap<ModulePath, File>;

/// The file in which the item of a path stands, as the file `from` names it.
fn place(files: &Crate, from: &[String], path: &[String], depth: usize) -> Option<ModulePath> {
    let (first, mut rest) = path.split_first()?;
    let mut at = from.to_vec();
    match first.as_str() {
        _ if depth > 8 => return None,
        "crate" => at.clear(),
        "self" => {}
        "super" => {
            at.pop()?;
            while let Some(after) = rest.strip_prefix(&["super".to_owned()][..]) {
                (at, rest) = (at[..at.len().checked_sub(1)?].to_vec(), after);
            }
        }
        _ if files.contains_key(&[from, std::slice::from_ref(first)].concat()) => rest = path,
        _ => {
            let own = files[from].imports.iter().find(|(own, name)| {
                let known = ["crate", "self", "super"].contains(&own[0].as_str());
                name == first && (known || files.contains_key(&[from, &own[..1]].concat()))
            })?;
            return place(files, from, &[&own.0[..], rest].concat(), depth + 1);
        }
    }
    while let Some((next, after)) = rest.split_first() {
        let below = [&at[..], std::slice::from_ref(next)].concat();
        if !files.contains_key(&below) {
            break;
        }
        (at, rest) = (below, after);
    }
    let (item, file) = (rest.first()?, files.get(&at)?); // a module itself is no item
    if file.defined.contains(item) {
        return Some(at);
    }
    let own = |name: &str| file.imports.iter().find(|own| own.1 == name);
    let through = own(item).map(|(path, _)| [&path[..], &rest[1..]].concat());
    through.and_then(|path| place(files, &at, &path, depth + 1)).or(Some(at))
}

/// The files of a crate that use one another in circles.
fn circles(files: &Crate) -> Vec<String> {
    let uses = |from: &ModulePath| -> BTreeSet<ModulePath> {
        let used = files[from].used.iter().filter_map(|path| place(files, from, path, 0));
        used.filter(|to| !to.starts_with(from)).collect()
    };
    let mut reached: BTreeMap<ModulePath, BTreeSet<ModulePath>> =
        files.keys().map(|file| (file.clone(), uses(file))).collect();
    for through in files.keys() {
        let beyond = reached[through].clone();
        for own in reached.values_mut().filter(|own| own.contains(through)) {
            own.extend(beyond.iter().cloned());
        }
    }
    let turns = reached.iter().filter(|(file, reached)| reached.contains(*file));
    turns.map(|(file, _)| file.join("/")).collect()
}

fn collect(folder: &Path, module: &[String], files: &mut Crate) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let below = [module, std::slice::from_ref(&name)].concat();
        if path.is_dir() {
            collect(&path, &below, files);
        } else if path.extension().is_some_and(|e| e == "rs") && !name.ends_with("tests") {
            let is_module = ["lib", "mod", "main"].contains(&&name[..]);
            let module = if is_module { module.to_vec() } else { below };
            files.insert(module, read(&std::fs::read_to_string(&path).unwrap()));
        }
    }
}

#[test]
fn no_files_use_one_another_in_a_circle() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let (mut found, mut count) = (Vec::new(), 0);
    let folders =
        std::fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path());
    for folder in folders.chain([root.join("xtask")]).filter(|f| f.join("src").is_dir()) {
        let mut files = Crate::new();
        collect(&folder.join("src"), &[], &mut files);
        count += files.len();
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
        found.extend(circles(&files).into_iter().map(|file| format!("{name}: {file}")));
    }
    println!("{count} files, {} in circles", found.len());
    assert!(count > 500, "{count}");
    assert!(found.is_empty(), "files that use one another in circles:\n{}", found.join("\n"));
}

#[test]
fn circles_are_found() {
    let of = |texts: &[(&str, &str)]| {
        let path = |name: &str| -> ModulePath {
            name.split('/').filter(|n| !n.is_empty()).map(str::to_owned).collect()
        };
        let files: Crate = texts.iter().map(|(name, text)| (path(name), read(text))).collect();
        circles(&files)
    };
    // one names the other in its code, the other takes it from the folder
    let root = ("", "mod a;\nmod b;\npub use a::A;");
    let (a, b) = ("pub struct A;\nfn f() { crate::b::g() }", "use super::A;\nfn g() -> A { A }");
    assert_eq!(of(&[root, ("a", a), ("b", b)]), ["a", "b"]);
    // a comment, a text and a test are no uses; neither is the folder that names its files
    let a = "pub struct A; // crate::b::g\nfn f() -> &str { \"crate::b::g\" }\n#[cfg(test)]\nmod tests {\n    use crate::b::g;\n}";
    assert!(of(&[root, ("a", a), ("b", b)]).is_empty());
    // three files, by an import under another name
    let files = [
        ("", "mod a;\nmod b;\nmod c;"),
        ("a", "use crate::{b::B as Other, c};\npub struct A(Other, c::C);"),
        ("b", "pub struct B(super::c::C);"),
        ("c", "use super::a::A;\npub struct C(Box<A>);"),
    ];
    assert_eq!(of(&files), ["a", "b", "c"]);
    // files of a folder
    let files = [
        ("f", "mod a;\nmod b;\npub struct F(a::A);"),
        ("f/a", "pub struct A(super::b::B);"),
        ("f/b", "use super::F;\npub struct B(Box<F>);"),
    ];
    assert!(of(&files).is_empty());
}
