//! Refusals of bad input: exit status 2, a message that names file, place, value and fix, and no file
//! left. `refusals.toml` lists them; here are those whose files a program writes.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::common::{Folder, small_scene, small_scene_with_table1};

/// Refusals in one folder; `refusals.toml` says what the fields mean.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Group {
    name: String,
    #[serde(default)]
    files: BTreeMap<String, Vec<String>>,
    #[serde(default)]
    given: Vec<String>,
    #[serde(default)]
    base: String,
    #[serde(default)]
    refused: Vec<Vec<String>>,
    #[serde(default)]
    edits: String,
    #[serde(default)]
    edited: Vec<Vec<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Refusals {
    group: Vec<Group>,
}

/// Content of a file of a group.
fn content(description: &[String]) -> String {
    let [content, edits @ ..] = description else { panic!("a file without content") };
    let content = match &**content {
        "small" => small_scene(),
        "table1" => small_scene_with_table1(),
        "contact" => include_str!("../../../scenes/contact.toml").to_owned(),
        content => content.to_owned(),
    };
    edits.chunks(2).fold(content, |content, edit| {
        assert!(content.contains(&edit[0]), "{edit:?}");
        content.replacen(&edit[0], &edit[1], 1)
    })
}

/// Runs a command and expects a refusal that contains all of `says`, with no file left.
fn refused<S: AsRef<str>>(folder: &Folder, arguments: &[&str], says: &[S]) {
    let before = folder.names();
    let output = folder.run(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
    for part in says.iter().map(AsRef::as_ref) {
        assert!(stderr.contains(part), "{arguments:?}: {part:?} is not in {stderr:?}");
    }
    assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
    assert_eq!(folder.names(), before, "{arguments:?} left something behind");
}

#[test]
fn what_cannot_be_done_is_refused_by_name_and_with_the_fix() {
    let Refusals { group: groups } = toml::from_str(include_str!("refusals.toml")).unwrap();
    for (i, group) in groups.iter().enumerate() {
        println!("{}", group.name);
        let folder = Folder::new(&format!("refusals-{i}"));
        let contents: BTreeMap<_, _> =
            group.files.iter().map(|(name, file)| (name, content(file))).collect();
        contents.iter().for_each(|(name, text)| drop(folder.write(name, text)));
        for command in &group.given {
            folder.succeed(&command.split_whitespace().collect::<Vec<_>>());
        }
        for case in &group.refused {
            let words = group.base.split_whitespace().chain(case[0].split_whitespace());
            assert!(case.len() > 1, "{case:?} says nothing");
            refused(&folder, &words.collect::<Vec<_>>(), &case[1..]);
        }
        contents.iter().for_each(|(name, text)| {
            let found = folder.read(name);
            assert!(found == *text, "{}: {name} has changed", group.name);
        });
        for case in &group.edited {
            let [from, to, says @ ..] = &case[..] else { panic!("{case:?} is no edit") };
            let text = &contents[&group.edits];
            assert!(text.contains(from) && !says.is_empty(), "{case:?}");
            folder.write(&group.edits, text.replacen(from, to, 1));
            let words: Vec<&str> = group.base.split_whitespace().collect();
            refused(&folder, &words, &[says, std::slice::from_ref(&group.edits)].concat());
        }
    }
}

/// Lines of two inputs and an output that follows from them. Names stand before what becomes of their values.
fn columns(first: fn(f64) -> f64, output: fn(f64) -> f64) -> String {
    let line = |i: i32| {
        let (a, b) = (f64::from(i * 37 % 101) / 101.0, f64::from(i * 53 % 97) / 97.0);
        let y = (3.0 * a).sin() * (2.0 * b).cos();
        format!("{:?},{b:?},{:?}\n", first(a), output(y))
    };
    format!("a,b,y\n{}", (0..200).map(line).collect::<String>())
}

#[test]
fn a_column_that_f32_does_not_hold_is_named() {
    let folder = Folder::new("scale");
    let train = |content: String, more: &[&'static str]| {
        folder.write("d.csv", content);
        let usual = ["train", "d.csv", "--inputs", "a,b", "--outputs", "y", "--centres", "12"];
        [&usual[..], &["--no-refine", "-o", "m.bin"], more].concat()
    };
    let tiny = train(columns(|a| a * 1e-30, |y| y), &[]);
    refused(&folder, &tiny, &["d.csv: column \"a\"", "multiply it by 1e31"]);
    let offset = train(columns(|a| a, |y| y + 1e5), &["--format", "fixed16"]);
    refused(&folder, &offset, &["fixed16 loses the output \"y\"", "Subtract 100000", "f32"]);
    let wide = train(columns(|a| a, |y| y), &["--format", "fixed16", "--spread", "1e6"]);
    refused(&folder, &wide, &["spread = 1000000", "give a smaller spread"]);
    for scale in [|y| y * 1e-27, |y| y * 1e29] {
        let squares = train(columns(|a| a, scale), &["--reading-model", "full"]);
        refused(
            &folder,
            &squares,
            &["column \"y\"", "from 1e-15 to 1e15", "leave the reading model"],
        );
    }
}
