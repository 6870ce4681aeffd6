//! Models exported to Rust: compiled with taxel-core as one program, which compares all bits of the same frames.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use taxel_learn::export::{constant_bytes, rust};

use super::models::Model;
use crate::process::{Outcome, capture, cargo, run};

const HARNESS: &str = include_str!("harness/main.rs");

/// Compares all `models` whose frames are in folders of `folder`.
pub fn compare(models: &[Model], folder: &Path) -> Outcome {
    let failed = |cause: std::io::Error| format!("{}: {cause}", folder.display());
    let (mut source, mut calls) = (HARNESS.to_owned(), String::new());
    println!("\n`export --rust`, the same frames:\n\n| model | constants |\n|---|--:|");
    for model in models {
        let (name, parsed) = (model.name(), model.blob.parse());
        println!("| {name} | {} |", constant_bytes(&model.blob));
        let file = folder.join(&name).join("model.rs");
        fs::write(&file, rust::source(&parsed)).map_err(failed)?;
        let module = name.replace('-', "_");
        let given = if parsed.metadata().relative_inputs { "r, b" } else { "r" };
        let call = |has: bool, function: &str, (all, more): (&str, &str)| {
            let call = format!("{{ let _ = b; {module}::{function}({given}{more}) }}");
            if has { format!("Some(|{all}| {call})") } else { "None".into() }
        };
        let assess = call(parsed.assesses(), "assess", ("r, b, d", ", d"));
        let fill = call(parsed.reading_model().is_some(), "fill", ("r, b", ""));
        // Writing to a string cannot fail.
        let _ = writeln!(source, "mod {module} {{ include!({:?}); }}", file.display().to_string());
        let _ = writeln!(
            calls,
            "    same &= compare({name:?}, &Model {{ decode: |r, b| {{ let _ = b; {module}::decode({given}) }}, \
             assess: {assess}, fill: {fill} }});"
        );
    }
    let _ =
        write!(source, "fn main() {{\n    let mut same = true;\n{calls}    assert!(same);\n}}\n");
    let (main, program) = (folder.join("main.rs"), folder.join("rust"));
    fs::write(&main, source).map_err(failed)?;
    let library = taxel_core()?;
    let mut rustc = Command::new("rustc");
    rustc.args(["--edition", "2024", "-O", "-D", "warnings", "--extern"]);
    rustc.arg(format!("taxel_core={}", library.display()));
    rustc.arg("-L").arg(format!("dependency={}", library.with_file_name("deps").display()));
    run(rustc.arg(&main).arg("-o").arg(&program))?;
    run(Command::new(&program).arg(folder))
}

/// The compiled taxel-core, as cargo tells its place.
fn taxel_core() -> Outcome<PathBuf> {
    let said = capture(&mut cargo(&["build", "--package", "taxel-core", "--message-format=json"]));
    let messages =
        said.out.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let is_library = |file: &str| file.ends_with("libtaxel_core.rlib");
    let files = messages.filter_map(|it| it["filenames"].as_array().cloned()).flatten();
    let mut paths =
        files.filter_map(|file| file.as_str().filter(|it| is_library(it)).map(PathBuf::from));
    paths.next().ok_or_else(|| format!("taxel-core was not built: {}", said.err))
}
