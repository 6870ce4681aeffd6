//! The workspace's crates and files, as cargo and git list them.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::process::{Outcome, cargo, root};

/// A crate of the workspace.
#[derive(Debug, PartialEq, Eq)]
pub struct Package {
    pub name: String,
    /// The crate's folder, relative to the workspace's root.
    pub directory: PathBuf,
    pub dependencies: Vec<Dependency>,
    /// The files that its libraries, programs and build scripts start with; tests and benches are left out.
    pub roots: Vec<PathBuf>,
}

/// A dependency of a crate, in the workspace or not.
#[derive(Debug, PartialEq, Eq)]
pub struct Dependency {
    pub name: String,
    pub kind: Kind,
}

/// Purpose of a dependency.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Normal,
    Build,
    Dev,
}

/// The workspace's crates.
///
/// # Errors
/// Cargo fails, or its answer cannot be parsed.
pub fn packages() -> Outcome<Vec<Package>> {
    let json = output(&mut cargo(&["metadata", "--no-deps", "--format-version", "1"]))?;
    let metadata = serde_json::from_str(&json).map_err(|cause| cause.to_string())?;
    parse(&metadata, root()).ok_or("what `cargo metadata` prints is not understood".into())
}

/// The workspace's Rust files, relative to its root: those that git tracks, and new ones that it does not ignore.
///
/// # Errors
/// Git fails.
pub fn sources() -> Outcome<Vec<PathBuf>> {
    let mut command = Command::new("git");
    command.args(["ls-files", "--cached", "--others", "--exclude-standard", "--", "*.rs"]);
    let listed = output(command.current_dir(root()))?;
    let mut files: Vec<PathBuf> = listed.lines().map(PathBuf::from).collect();
    files.sort();
    files.dedup();
    // Git also lists a file that was removed, while that is not committed.
    files.retain(|file| root().join(file).is_file());
    if files.is_empty() { Err("git lists no file of Rust".into()) } else { Ok(files) }
}

fn output(command: &mut Command) -> Outcome<String> {
    let program = command.get_program().display().to_string();
    let output = command.output().map_err(|cause| format!("cannot start {program}: {cause}"))?;
    if !output.status.success() {
        return Err(format!("{program}: {}", String::from_utf8_lossy(&output.stderr)));
    }
    String::from_utf8(output.stdout).map_err(|cause| format!("{program}: {cause}"))
}

/// Parses cargo's metadata; `None` if a documented field is missing.
fn parse(metadata: &Value, root: &Path) -> Option<Vec<Package>> {
    metadata["packages"].as_array()?.iter().map(|package| of_package(package, root)).collect()
}

fn of_package(package: &Value, root: &Path) -> Option<Package> {
    let from_root = |path: &Value| {
        let path = Path::new(path.as_str()?);
        Some(path.strip_prefix(root).unwrap_or(path).to_owned())
    };
    let manifest = from_root(&package["manifest_path"])?;
    let mut roots = Vec::new();
    for target in package["targets"].as_array()? {
        let mut kinds = target["kind"].as_array()?.iter();
        if !kinds.any(|kind| ["test", "bench", "example"].contains(&kind.as_str().unwrap_or(""))) {
            roots.push(from_root(&target["src_path"])?);
        }
    }
    let dependencies = package["dependencies"].as_array()?.iter().map(|dependency| {
        let kind = match dependency["kind"].as_str() {
            None => Kind::Normal,
            Some("build") => Kind::Build,
            Some(_) => Kind::Dev,
        };
        Some(Dependency { name: dependency["name"].as_str()?.to_owned(), kind })
    });
    Some(Package {
        name: package["name"].as_str()?.to_owned(),
        directory: manifest.parent()?.to_owned(),
        dependencies: dependencies.collect::<Option<_>>()?,
        roots,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cargo_prints_is_read() {
        let metadata = serde_json::json!({"packages": [{
            "name": "a",
            "manifest_path": "/house/in/a/Cargo.toml",
            "targets": [
                {"kind": ["lib"], "src_path": "/house/in/a/src/lib.rs"},
                {"kind": ["test"], "src_path": "/house/in/a/tests/all.rs"},
                {"kind": ["custom-build"], "src_path": "/house/in/a/build.rs"},
            ],
            "dependencies": [{"name": "b", "kind": null}, {"name": "c", "kind": "dev"}],
        }]});
        let expected = Package {
            name: "a".into(),
            directory: "in/a".into(),
            dependencies: vec![
                Dependency { name: "b".into(), kind: Kind::Normal },
                Dependency { name: "c".into(), kind: Kind::Dev },
            ],
            roots: vec!["in/a/src/lib.rs".into(), "in/a/build.rs".into()],
        };
        assert_eq!(parse(&metadata, Path::new("/house")), Some(vec![expected]));
        assert_eq!(parse(&serde_json::json!({"packages": [{}]}), Path::new("/")), None);
    }

    #[test]
    fn this_file_is_among_the_workspaces() {
        let sources = sources().unwrap();
        assert!(sources.contains(&PathBuf::from("xtask/src/structure/workspace.rs")));
        let packages = packages().unwrap();
        let xtask = packages.iter().find(|package| package.name == "xtask").unwrap();
        assert_eq!(xtask.roots, [PathBuf::from("xtask/src/main.rs")]);
    }
}
