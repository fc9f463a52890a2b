//! A name means one thing in all kernels, and every name in a condition is known: the preprocessor would take an unknown one for 0.

use std::collections::HashMap;

use cloudchamber::device::program::Source;
use cloudchamber::run;

fn sources() -> Vec<Source> {
    run::sources().collect()
}

/// The names that a text defines, with their definitions.
fn defined(text: &str) -> Vec<(String, String)> {
    let definition = |line: &str| {
        let rest = line.trim_start().strip_prefix("#define ")?;
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        Some((rest[..end].to_owned(), rest[end..].trim().to_owned()))
    };
    text.lines().filter_map(definition).collect()
}

/// The enums' part of a program, before its first file, and the files.
fn parts(source: &Source) -> (String, String) {
    let text = source.text(None).unwrap();
    let (enums, files) = text.split_once("#line 1 \"kernels/").unwrap();
    (enums.to_owned(), files.to_owned())
}

#[test]
fn a_name_of_an_enum_means_one_thing_in_all_kernels() {
    let mut known: HashMap<String, String> = HashMap::new();
    for source in sources() {
        for (name, value) in defined(&parts(&source).0) {
            let before = known.insert(name.clone(), value.clone());
            assert!(
                before.as_ref().is_none_or(|b| *b == value),
                "{name} is {value} in {} and {before:?} in others",
                source.kernel
            );
        }
    }
    for source in sources() {
        for (name, _) in defined(&parts(&source).1) {
            assert!(!known.contains_key(&name), "{} defines {name}, which is an enum's", source.kernel);
        }
    }
    assert!(known.contains_key("TRACKING_DELTA") && known.contains_key("LEDGER_LENGTH"), "{known:?}");
}

#[test]
fn names_of_enums_in_conditions_are_defined() {
    let mut looked_at = 0;
    for source in sources() {
        let (enums, files) = parts(&source);
        let names: Vec<String> =
            [defined(&enums), defined(&files)].concat().into_iter().map(|(name, _)| name).collect();
        let prefixes: Vec<&str> = names.iter().filter_map(|name| name.strip_suffix("LENGTH")).collect();
        for line in
            files.lines().filter(|l| l.starts_with("#if ") || l.starts_with("#elif ") || l.starts_with("#define "))
        {
            for word in line.split(|c: char| !c.is_ascii_alphanumeric() && c != '_') {
                if prefixes.iter().any(|prefix| word.starts_with(prefix)) {
                    assert!(names.iter().any(|name| name == word), "{}: {line}", source.kernel);
                    looked_at += 1;
                }
            }
        }
    }
    assert!(looked_at > 50, "{looked_at} names were looked at");
}
