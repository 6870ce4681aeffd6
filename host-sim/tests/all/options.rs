//! Every option of every command has an effect on the result that it names; `options.toml` has the list.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use serde::Deserialize;
use serde_json::Value;

use crate::common::{Folder, small_scene_with_table1, tiny_moving_scene, tiny_scene};

/// Commands without options of their own here, as they need a device.
const OTHERS: [&str; 5] = ["emulate", "link", "view", "completions", "help"];

#[derive(Deserialize)]
struct Options {
    exempt: BTreeMap<String, BTreeSet<String>>,
    group: Vec<Group>,
}

#[derive(Deserialize)]
struct Group {
    bases: Vec<[String; 2]>,
    options: Vec<Vec<String>>,
}

/// The value without what merely repeats options, or differs from run to run.
fn result(value: &Value) -> Value {
    let is_told = |key: &str| key.contains('.') || ["id", "seconds"].contains(&key);
    match value {
        Value::Object(members) => {
            let members = members.iter().filter(|(key, _)| !is_told(key));
            members.map(|(key, value)| (key.clone(), result(value))).collect()
        }
        Value::Array(items) => items.iter().map(result).collect(),
        value => value.clone(),
    }
}

/// What a command makes, at `place`; `None` if it is refused.
fn outcome(folder: &Folder, line: &str, place: &str) -> Option<String> {
    let mut arguments: Vec<&str> = line.split_whitespace().collect();
    arguments.extend((place != "stdout").then_some("--json"));
    let _ = fs::remove_file(folder.path(place));
    let output = folder.run(&arguments);
    output.status.success().then(|| match place {
        "stdout" => String::from_utf8(output.stdout).unwrap(),
        _ if place.starts_with('/') => {
            let json = result(&serde_json::from_slice(&output.stdout).unwrap());
            json.pointer(place).map_or("missing".into(), ToString::to_string)
        }
        _ => fs::read(folder.path(place)).map_or(String::new(), |it| format!("{it:?}")),
    })
}

/// Names of the options that a command's help has.
fn names(folder: &Folder, command: &str) -> BTreeSet<String> {
    let help = folder.succeed(&[command, "-h"]);
    let starts = help.lines().map(str::trim_start).filter(|line| line.starts_with('-'));
    let names = starts.filter_map(|line| line.split_once("--")?.1.split([' ', '\n']).next());
    names.map(str::to_owned).collect()
}

/// A log of [`crate::json_keys::log`] with a part of each line, an outlier and a line that is cut.
fn log() -> String {
    let add = |(i, line): (usize, &str)| match i {
        0 => format!("{line},part"),
        300 => format!("2.99,1e6,{},1", line.splitn(3, ',').nth(2).unwrap()),
        302 => "3.01,3".into(),
        _ => format!("{line},{}", i * i / 7 % 3),
    };
    let lines = crate::json_keys::log();
    lines.lines().take(700).enumerate().map(|line| add(line) + "\n").collect()
}

fn prepared() -> Folder {
    let folder = Folder::new("options");
    let tiny = tiny_scene().replace("test_frames = 50", "test_frames = 16");
    folder.write("tiny.toml", &tiny);
    let format = "each_row = true\nformat = \"f32\"\n";
    folder.write("array.toml", tiny.replace(format, ""));
    folder.write("table1.toml", small_scene_with_table1());
    folder
        .write("moving.toml", tiny_moving_scene().replace("duration_s = 0.6", "duration_s = 0.1"));
    let log = log();
    let some = |from: usize, count: usize| {
        let lines = log.lines().take(1).chain(log.lines().skip(from).take(count));
        lines.map(|line| line.to_owned() + "\n").collect::<String>()
    };
    folder.write("rest.csv", some(470, 20));
    folder.write("other.csv", some(580, 20));
    folder.write("test.csv", some(50, 200));
    folder.write(
        "numbers.csv",
        some(1, 400)
            .replace("time_s,ch1_ohm,ch2_ohm,ch3_ohm,ch4_ohm,fx_n,fz_n,part", "1,2,3,4,5,6,7,8"),
    );
    folder.write("log.csv", log);
    let of_log = "train log.csv --inputs ch* --outputs f* --no-refine --centres 3 -o";
    for line in [
        "train tiny.toml -o tiny.bin",
        "train array.toml --centres 6 -o array.bin",
        &format!("{of_log} full.bin --reading-model full"),
        &format!("{of_log} relative.bin --relative-inputs"),
        "train numbers.csv --header --inputs 2,3 --outputs 4 --no-refine --centres 3 -o numbers.bin",
    ] {
        folder.succeed(&line.split_whitespace().collect::<Vec<_>>());
    }
    folder
}

#[test]
fn every_option_has_an_effect() {
    let Options { exempt, group } = toml::from_str(include_str!("options.toml")).unwrap();
    let folder = prepared();
    let mut compared: BTreeMap<String, BTreeSet<String>> = exempt.clone();
    let mut known = BTreeMap::new();
    let mut failures: Vec<String> = vec![];
    for ([base, place], values) in group.iter().flat_map(|group| {
        group.bases.iter().flat_map(|base| group.options.iter().map(move |values| (base, values)))
    }) {
        let [first, second] = match &values[..] {
            [value] => ["", value],
            [first, second] => [first.as_str(), second],
            _ => panic!("{values:?}"),
        };
        let [first, second] = [first, second].map(|value| {
            let line = format!("{base} {value}");
            known
                .entry([line.clone(), place.clone()])
                .or_insert_with(|| outcome(&folder, &line, place))
                .clone()
        });
        if first == second {
            failures.push(format!(
                "{base} {values:?}: {place} is the same ({})",
                if first.is_some() { "both run" } else { "both refused" }
            ));
        }
        let command = compared.entry(base.split(' ').next().unwrap().into()).or_default();
        let words = values.iter().flat_map(|value| value.split(' '));
        command.extend(words.filter_map(|word| Some(word.strip_prefix("--")?.to_owned())));
    }
    let help = folder.succeed(&["help"]);
    let commands =
        help.split("Commands:\n").nth(1).unwrap().lines().take_while(|line| !line.is_empty());
    for command in commands.filter_map(|line| line.split_whitespace().next()) {
        if OTHERS.contains(&command) {
            continue;
        }
        let of_command = compared.get(command).cloned().unwrap_or_default();
        let unknown = &(&names(&folder, command) - &of_command) - &exempt["*"];
        if !unknown.is_empty() {
            failures.push(format!("{command}: options.toml has not {unknown:?}"));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
