//! Keys of the results of every main command, which programs rely on, held to `testdata/json-keys.txt`.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use crate::common::{Folder, small_scene_with_table1, tiny_scene};

/// Commands of a study from its scene to its plans, one after the other in one folder.
const COMMANDS: [&str; 19] = [
    "synth scene.toml -n 200 -o data.csv",
    "forward scene.toml data.csv -o ideal.csv",
    "train scene.toml --reading-model full -o m.bin",
    "train data.csv --select --no-refine --centres 4,8 --spread 0.5,1 -o d.bin",
    "train scene.toml --solver rls -o r.bin",
    "decode m.bin data.csv --confidence -o e.csv",
    "eval m.bin data.csv --without r4c5_ohm",
    "inspect m.bin",
    "export m.bin --c lib",
    "run data.csv --no-refine",
    "run scene.toml",
    "table1 scene.toml",
    "limit scene.toml -n 4 --model m.bin",
    "limit scene.toml tiny.toml -n 4",
    "trade scene.toml --centres 6 --max-error 1",
    "compare tiny.toml --centres 4,6 -o both",
    "sweep plan.toml --list",
    "sweep plan.toml --shard 1/2 -o out/tiny",
    "sweep plan.toml",
];

/// Adds the keys in `value`, each with those that it stands in.
fn add_keys(value: &Value, path: &str, keys: &mut BTreeSet<String>) {
    match value {
        Value::Object(members) => {
            for (key, member) in members {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                add_keys(member, &path, keys);
                keys.insert(path);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| add_keys(item, path, keys)),
        _ => {}
    }
}

#[test]
fn keys_of_results_stay_as_they_are() {
    let folder = Folder::new("json_keys");
    let scene = small_scene_with_table1();
    folder.write("scene.toml", scene.replace("frames = 3000", "frames = 600"));
    let tiny = tiny_scene().replace("name = \"small\"", "name = \"tiny\"");
    folder.write("tiny.toml", tiny);
    folder.write("plan.toml", crate::sweep::PLAN.replace("scene.toml", "tiny.toml"));
    let mut found = String::from(
        "# Keys of each command's JSON. TAXEL_ACCEPT=1 cargo test -p host-sim --test all json_keys writes them anew.\n",
    );
    for command in COMMANDS {
        let arguments: Vec<&str> = command.split(' ').collect();
        let result = folder.json(&arguments);
        assert_eq!(result["command"], arguments[0]);
        let mut keys = BTreeSet::new();
        add_keys(&result, "", &mut keys);
        found.extend(["\n", command, "\n"]);
        found.extend(keys.iter().flat_map(|key| ["    ", key, "\n"]));
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata/json-keys.txt");
    if std::env::var_os("TAXEL_ACCEPT").is_some() {
        std::fs::write(&path, &found).unwrap();
    }
    let accepted = std::fs::read_to_string(&path).unwrap();
    let changed = found.lines().zip(accepted.lines()).find(|(found, accepted)| found != accepted);
    assert_eq!(changed, None, "keys changed: docs/json.md and CHANGELOG.md name them");
    assert_eq!(found.lines().count(), accepted.lines().count());
}
