//! Every command's JSON against its published schema, docs/json.schema.json.

mod validator;

use std::collections::BTreeSet;

use serde::Serialize;
use serde_json::{Value, json};
use taxel_core::filter::Settings;
use taxel_data::Silent;
use taxel_rig::device::check::{Plan, check};
use taxel_rig::device::upload;

use crate::common::{Folder, small_scene, small_scene_with_table1};
use crate::device;
use validator::Schema;

pub fn schema() -> Schema {
    Schema::parse(include_str!("../../../docs/json.schema.json"))
}

/// Commands that the schema knows.
fn known_commands(schema: &Schema) -> BTreeSet<String> {
    let commands = schema.documents().into_iter().flat_map(|document| {
        let command = &document["properties"]["command"];
        command["enum"].as_array().cloned().unwrap_or_else(|| vec![command["const"].clone()])
    });
    commands.map(|name| name.as_str().unwrap().to_owned()).collect()
}

/// Runs a command with `--json`, and holds what it prints to the schema.
pub fn checked(folder: &Folder, schema: &Schema, arguments: &[&str]) -> Value {
    let text = folder.succeed(&[arguments, &["--json"]].concat());
    let document: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(schema.faults(&document), [""; 0], "{arguments:?}");
    assert_eq!(document["command"], arguments[0]);
    assert!(document["seconds"].as_f64().unwrap() > 0.0, "{arguments:?}");
    document
}

fn check_file(folder: &Folder, schema: &Schema, file: &str) {
    let text = std::fs::read_to_string(folder.path(file)).unwrap();
    let document: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(schema.faults(&document), [""; 0], "{file}");
    assert_eq!(document.get("seconds"), None, "{file}");
}

/// Folder with a scene, frames of it, and a model with a confidence.
fn prepared(name: &str, schema: &Schema) -> Folder {
    let folder = Folder::new(name);
    folder.write("scene.toml", small_scene().replace("frames = 3000", "frames = 600"));
    checked(&folder, schema, &["synth", "scene.toml", "-n", "200", "-o", "data.csv"]);
    let train = ["train", "scene.toml", "--confidence", "--fill", "-o", "m.bin"];
    checked(&folder, schema, &train);
    folder
}

#[test]
fn models_and_data_are_told_by_the_schema() {
    let schema = &schema();
    let folder = prepared("json_models", schema);
    let checked = |arguments: &[&str]| checked(&folder, schema, arguments);
    checked(&["forward", "scene.toml", "data.csv", "-o", "ideal.csv"]);
    let select = ["train", "data.csv", "--select", "--no-refine", "--centres", "4,8"];
    let selected = checked(&[&select[..], &["--spread", "0.5,1", "-o", "d.bin"]].concat());
    assert!(selected["selection"]["chosen"].is_u64());
    let decoded = checked(&["decode", "m.bin", "data.csv", "--confidence", "-o", "e.csv"]);
    let evaluated = checked(&["eval", "m.bin", "data.csv", "--without", "r4c5_ohm"]);
    assert_eq!(evaluated["health"]["frames_filled"], 200);
    assert_eq!(evaluated["health"]["columns"][0]["column"], "r4c5_ohm");
    let inspected = checked(&["inspect", "m.bin"]);
    assert_eq!(decoded["model_crc"], inspected["model_crc"]);
    assert_eq!(evaluated["model_crc"], inspected["model_crc"]);
    assert_eq!(inspected["fill"]["factors"], 16);
    checked(&["train", "scene.toml", "--format", "f32-direct", "-o", "direct.bin"]);
    assert_eq!(checked(&["export", "direct.bin", "--rust", "direct.rs"])["rows"], 2);
    assert_eq!(checked(&["export", "m.bin", "--c", "lib"])["rows"], 2);
    checked(&["synth", "scene.toml", "-n", "9", "-o", "data.mcap"]);
    assert_eq!(checked(&["recover", "data.mcap"])["was_cut"], false);
    // The width that the scene gives, not the blob's rounded one.
    assert_eq!(inspected["networks"][0]["spread"], json!([0.8]));
    folder.write("a.csv", "t_s,a\n0,1\n1,2\n2,4\n");
    folder.write("b.csv", "t_s,b\n0.01,1\n0.99,2\n");
    let join = ["join", "a.csv", "b.csv", "--on", "t_s", "--tolerance", "0.1", "-o", "ab.csv"];
    assert_eq!(checked(&join)["frames_without_partner"], 1);
}

#[test]
fn experiments_are_told_by_the_schema() {
    let schema = &schema();
    let folder = prepared("json_experiments", schema);
    let checked = |arguments: &[&str]| checked(&folder, schema, arguments);
    let limit = ["limit", "scene.toml", "-n", "4", "--model", "m.bin", "-o", "limit"];
    let limit = checked(&limit);
    check_file(&folder, schema, "limit/limit.json");
    let trade = ["trade", "scene.toml", "--centres", "6"];
    let trade = checked(&[&trade[..], &["--max-error", "1"]].concat());
    check_file(&folder, schema, "out/small/trade.json");
    for document in [limit, trade] {
        assert_eq!((&document["subject"], &document["seed"]), (&json!("small"), &json!(1)));
    }
}

#[test]
fn sweeps_are_told_by_the_schema() {
    let schema = &schema();
    let folder = Folder::new("json_sweeps");
    folder.write("scene.toml", crate::sweep::tiny_scene());
    folder.write("plan.toml", crate::sweep::PLAN);
    let checked = |arguments: &[&str]| checked(&folder, schema, arguments);
    assert_eq!(checked(&["sweep", "plan.toml", "--list"])["points"].as_array().unwrap().len(), 4);
    assert_eq!(checked(&["sweep", "plan.toml", "--dry-run"])["points"], 4);
    let shard = ["sweep", "plan.toml", "--shard", "1/2", "-o", "out/tiny"];
    assert_eq!(checked(&shard)["there_already"], 0);
    let all = checked(&["sweep", "plan.toml"]);
    assert_eq!(all["settings"].as_array().unwrap().len(), 4);
    check_file(&folder, schema, "out/tiny/results.json");
    let compared = checked(&["compare", "scene.toml", "--centres", "4,6", "-o", "both"]);
    assert_eq!(compared["points"].as_array().unwrap().len(), 2);
    let limits = checked(&["limit", "scene.toml", "press", "--row", "4", "-n", "4"]);
    assert_eq!(limits["scenes"][1]["subject"], "press");
}

#[test]
fn runs_are_told_by_the_schema() {
    let schema = &schema();
    let folder = prepared("json_runs", schema);
    checked(&folder, schema, &["run", "data.csv", "--no-refine"]);
    folder.write("table1.toml", small_scene_with_table1().replace("frames = 1500", "frames = 300"));
    let run = checked(&folder, schema, &["run", "table1.toml"]);
    check_file(&folder, schema, "out/small/metrics.json");
    let table1 = checked(&folder, schema, &["table1", "table1.toml"]);
    assert_eq!(run["table1"]["columns"], table1["columns"]);
}

/// What a command would print of `result`.
fn document(command: &str, result: &impl Serialize) -> Value {
    let mut document = json!({"version": "1.2.3", "command": command, "seconds": 1.5});
    let result = serde_json::to_value(result).unwrap();
    document.as_object_mut().unwrap().extend(result.as_object().unwrap().clone());
    document
}

#[test]
fn what_devices_tell_is_told_by_the_schema() {
    let schema = schema();
    let model = device::model(4);
    let mut device = device::device(device::SOUND, &model);
    let plan = Plan { window: 2, filter: Settings::default() };
    let findings = check(&mut device, &device::frames_of(5), &model, &plan, &Silent).unwrap();
    for command in ["emulate", "link check"] {
        assert_eq!(schema.faults(&document(command, &findings)), [""; 0]);
    }
    upload::replace(&mut device, model.bytes(), &Silent).unwrap();
    let configuration = device.configuration().unwrap();
    let mut status = document("link identify", &json!({"configuration": configuration}));
    status["device"] = serde_json::to_value(device.identify().unwrap()).unwrap();
    status["statistics"] = serde_json::to_value(device.statistics().unwrap()).unwrap();
    assert_eq!(schema.faults(&status), [""; 0]);
    let kept = device.kept().unwrap();
    let settings = json!({"configuration": configuration, "constants": null, "kept": kept});
    assert_eq!(schema.faults(&document("link settings", &settings)), [""; 0]);
}

#[test]
fn damaged_documents_are_refused() {
    let schema = schema();
    let sound = json!({
        "version": "0.1.0", "command": "decode", "seconds": 0.5, "model_crc": "0123abcd", "frames": 3,
        "frames_with_missing_readings": 0, "frames_novel": null, "exponential": "libm", "file": "e.csv", "frames_clamped": 0,
        "health": {
            "readings_missing": 0, "readings_shorted": 0, "readings_open": 0, "readings_filled": 0, "frames_filled": 0,
            "columns": [], "faults": []
        }
    });
    assert_eq!(schema.faults(&sound), [""; 0]);
    for (key, value) in [
        ("version", json!(1)),
        ("command", json!("encode")),
        ("seconds", json!(-1)),
        ("model_crc", json!(19_114_957)),
        ("model_crc", json!("0123ABCD")),
        ("frames", json!(2.5)),
        ("frames", json!(null)),
        ("exponential", json!("exact")),
        ("no_such_key", json!(1)),
    ] {
        let mut damaged = sound.clone();
        damaged[key] = value.clone();
        assert!(!schema.faults(&damaged).is_empty(), "{key}: {value}");
    }
    for key in sound.as_object().unwrap().keys() {
        let mut damaged = sound.clone();
        damaged.as_object_mut().unwrap().remove(key);
        assert!(!schema.faults(&damaged).is_empty(), "{key}");
    }
}

/// Commands that have actions of their own, and those that print no result.
const UNTOLD: [&str; 3] = ["link", "completions", "man"];

#[test]
fn the_schema_knows_every_command() {
    let folder = Folder::new("json_commands");
    let listed = |arguments: &[&str]| -> Vec<String> {
        let help = folder.succeed(arguments);
        let (_, commands) = help.split_once("Commands:\n").unwrap();
        let commands = commands.lines().take_while(|line| !line.trim().is_empty());
        let first = |line: &str| line.split_whitespace().next().unwrap_or_default().to_owned();
        // Lines that go on are further to the right.
        let names = commands.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
        names.map(first).filter(|name| name != "help").collect()
    };
    let of_link = listed(&["link", "--help"]).into_iter().map(|name| format!("link {name}"));
    let others = listed(&["--help"]).into_iter().filter(|name| !UNTOLD.contains(&name.as_str()));
    assert_eq!(others.chain(of_link).collect::<BTreeSet<_>>(), known_commands(&schema()));
}

/// Adds the names of the properties in `schema`: all, and those that have a description.
fn collect_names<'a>(schema: &'a Value, names: &mut [BTreeSet<&'a str>; 2]) {
    match schema {
        Value::Object(members) => {
            if let Some(Value::Object(properties)) = members.get("properties") {
                for (name, property) in properties {
                    names[0].insert(name);
                    if property["description"].as_str().is_some_and(|it| !it.trim().is_empty()) {
                        names[1].insert(name);
                    }
                }
            }
            members.values().for_each(|member| collect_names(member, names));
        }
        Value::Array(items) => items.iter().for_each(|item| collect_names(item, names)),
        _ => {}
    }
}

#[test]
fn the_schema_describes_every_key() {
    let schema = include_str!("../../../docs/json.schema.json");
    let schema: Value = serde_json::from_str(schema).unwrap();
    let mut names = [BTreeSet::new(), BTreeSet::new()];
    collect_names(&schema, &mut names);
    let [all, described] = names;
    let missing: Vec<_> = all.difference(&described).collect();
    assert!(missing.is_empty(), "docs/json.schema.json describes none of {missing:?}");
}
