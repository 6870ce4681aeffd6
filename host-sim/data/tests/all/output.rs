//! Output files: whole or not there, whichever step fails.

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::fs::{self, Permissions};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use taxel_data::Result;
use taxel_data::output::{
    FileSet, Inner, Step, Written, check_writable, watched, write_bytes, write_folder,
};
use tempfile::TempDir;

const SET: FileSet = FileSet { files: &["model", "metrics", "table"], inner: INNER };
const INNER: Inner = Inner { folder: "inner", names: &["a", "level-*"], endings: &["svg", "csv"] };

/// Names and contents of everything in a folder.
fn contents(folder: &TempDir) -> Vec<(String, String)> {
    let entries = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
    let mut contents: Vec<(String, String)> = entries
        .map(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            (name, fs::read_to_string(path).unwrap_or_default())
        })
        .collect();
    contents.sort();
    contents
}

/// Does `work`, of which step number `failing` fails; returns the steps.
fn steps_of(failing: usize, work: impl FnOnce() -> Result<()>) -> (Vec<String>, Result<()>) {
    let steps = Rc::new(RefCell::new(Vec::new()));
    let seen = steps.clone();
    let watcher = move |step: Step<'_>| {
        let name = |path: &Path| match path.extension() {
            Some(end) if end == "tmp" => "temporary".to_owned(),
            _ => path.file_name().unwrap().to_string_lossy().into_owned(),
        };
        seen.borrow_mut().push(match step {
            Step::Create(path) => format!("create beside {}", name(path)),
            Step::Write(path) => format!("write {}", name(path)),
            Step::Sync(path) if path.is_dir() => "sync folder".to_owned(),
            Step::Sync(path) => format!("sync {}", name(path)),
            Step::Rename(from, to) => format!("rename {} to {}", name(from), name(to)),
            Step::Remove(path) => format!("remove {}", name(path)),
        });
        let fails = seen.borrow().len() == failing;
        if fails { Err(ErrorKind::StorageFull.into()) } else { Ok(()) }
    };
    let outcome = watched(watcher, work);
    (steps.take(), outcome)
}

#[test]
fn whichever_step_fails_files_are_whole_and_no_temporary_stays() {
    for failing in 1.. {
        let folder = tempfile::tempdir().unwrap();
        let all = |text: &'static [u8]| [("model", text), ("metrics", text), ("table", text)];
        SET.write(folder.path(), &all(b"old")).unwrap();
        fs::write(folder.path().join("notes"), "old").unwrap();
        let (steps, outcome) = steps_of(failing, || SET.write(folder.path(), &all(b"new")[..2]));
        let step = steps[failing - 1].as_str();
        let text: Vec<String> = contents(&folder).into_iter().map(|(n, c)| n + " " + &c).collect();
        if step == "sync folder" {
            // The files are there.
            outcome.unwrap();
            assert_eq!(text, ["metrics new", "model new", "notes old"]);
            return;
        }
        assert!(outcome.unwrap_err().to_string().contains("cannot write"));
        let [metrics, model] = match step {
            "rename temporary to metrics" => ["metrics old", "model new"],
            "remove table" => ["metrics new", "model new"],
            _ => ["metrics old", "model old"],
        };
        assert_eq!(text, [metrics, model, "notes old", "table old"], "{step}");
    }
}

#[test]
fn files_of_several_folders_are_written_before_any_is_renamed() {
    let around = tempfile::tempdir().unwrap();
    let folders = ["one", "two"].map(|name| around.path().join(name));
    let (steps, outcome) = steps_of(0, || {
        let written = folders.iter().map(|folder| SET.written(folder, &[("model", b"new")]));
        Written::put_in_place(written.collect::<Result<_>>()?)
    });
    outcome.unwrap();
    let renamed = steps.iter().position(|step| step.starts_with("rename")).unwrap();
    assert!(steps[renamed..].iter().all(|step| !step.starts_with("write")), "{steps:?}");
    assert!(folders.iter().all(|folder| folder.join("model").exists()));
}

#[test]
fn files_are_whole_after_a_kill_or_a_loss_of_power() {
    let folder = tempfile::tempdir().unwrap();
    let all = |text: &'static [u8]| [("model", text), ("metrics", text), ("table", text)];
    SET.write(folder.path(), &all(b"old")).unwrap();
    // A disk forgets what was written and not made safe.
    let (path, mut forgotten) = (folder.path().to_path_buf(), BTreeSet::new());
    let steps = Rc::new(Cell::new(0));
    let seen = steps.clone();
    let watcher = move |step: Step<'_>| {
        for name in ["model", "metrics", "table"] {
            let found = fs::read(path.join(name)).ok();
            let is_missing = found.is_none() && name == "table" && matches!(step, Step::Sync(_));
            let is_whole = found.is_some_and(|it| it == b"old" || it == b"new");
            assert!(is_whole || is_missing, "{name} before {step:?}");
            assert!(!forgotten.contains(&path.join(name)), "{name} is not safe before {step:?}");
        }
        match step {
            Step::Write(file) => drop(forgotten.insert(file.to_path_buf())),
            Step::Sync(file) => drop(forgotten.remove(file)),
            Step::Rename(from, to) if forgotten.remove(from) => {
                forgotten.insert(to.to_path_buf());
            }
            _ => {}
        }
        seen.set(seen.get() + 1);
        Ok(())
    };
    watched(watcher, || SET.write(folder.path(), &all(b"new")[..2])).unwrap();
    assert_eq!(contents(&folder).len(), 2);
    assert!(steps.get() > 6, "{} steps", steps.get());
}

#[test]
fn a_check_leaves_no_folder_and_no_file() {
    let folder = tempfile::tempdir().unwrap();
    SET.check(&folder.path().join("a/b"), &[]).unwrap();
    SET.check(folder.path(), &[]).unwrap();
    check_writable(&folder.path().join("x.csv"), &[]).unwrap();
    assert!(contents(&folder).is_empty());
    fs::write(folder.path().join("x.csv"), "old").unwrap();
    let input = folder.path().join("./x.csv");
    let refused = check_writable(&folder.path().join("x.csv"), &[&input]).unwrap_err().to_string();
    assert!(refused.contains("which is read"), "{refused}");
    let refused = SET.check(&folder.path().join("x.csv/out"), &[]).unwrap_err().to_string();
    assert!(refused.contains("cannot write") && refused.contains("out"), "{refused}");
}

#[cfg(unix)]
#[test]
fn links_are_followed_modes_kept_and_read_only_files_refused() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| -> PathBuf { folder.path().join(name) };
    let mode = |name| fs::metadata(path(name)).unwrap().permissions().mode() & 0o777;
    symlink("model", path("link")).unwrap();
    fs::write(path("ordinary"), "").unwrap();
    write_bytes(&path("link"), b"new").unwrap();
    assert!(path("link").is_symlink());
    assert_eq!(fs::read(path("model")).unwrap(), b"new");
    assert_eq!(mode("model"), mode("ordinary"));
    fs::set_permissions(path("model"), Permissions::from_mode(0o604)).unwrap();
    SET.write(folder.path(), &[("model", b"newer")]).unwrap();
    assert_eq!(mode("model"), 0o604);

    symlink("ring", path("ring")).unwrap();
    let refused = check_writable(&path("ring"), &[]).unwrap_err().to_string();
    assert!(refused.contains("too many links"), "{refused}");
    fs::set_permissions(path("model"), Permissions::from_mode(0o444)).unwrap();
    for refused in [
        check_writable(&path("link"), &[]),
        write_bytes(&path("link"), b"other"),
        SET.check(folder.path(), &[]),
        SET.write(folder.path(), &[("model", b"other")]),
    ] {
        let message = refused.unwrap_err().to_string();
        assert!(message.contains("read-only"), "{message}");
    }
    assert_eq!(fs::read(path("model")).unwrap(), b"newer");
    fs::remove_file(path("model")).unwrap();
    symlink("/dev/null", path("metrics")).unwrap();
    let refused = SET.check(folder.path(), &[]).unwrap_err().to_string();
    assert!(refused.contains("it is not a file"), "{refused}");
}

#[test]
fn files_of_an_inner_folder_belong_to_the_set() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| -> PathBuf { folder.path().join(name) };
    let files =
        |text: &'static [u8]| [("model", text), ("inner/a.svg", text), ("inner/a.csv", text)];
    // Nothing is left of a folder whose files could not be written.
    let (_, outcome) = steps_of(5, || SET.write(folder.path(), &files(b"old")));
    outcome.unwrap_err();
    assert!(contents(&folder).is_empty());
    SET.write(folder.path(), &files(b"old")).unwrap();
    for other in ["inner/b.svg", "inner/a.pdf", "inner/level-3.csv"] {
        fs::write(path(other), "other").unwrap();
    }
    let (steps, outcome) = steps_of(8, || SET.write(folder.path(), &files(b"new")));
    outcome.unwrap_err();
    assert!(steps.iter().all(|step| !step.starts_with("rename")), "{steps:?}");
    SET.write(folder.path(), &files(b"new")[..2]).unwrap();
    assert_eq!(fs::read(path("inner/a.svg")).unwrap(), b"new");
    assert!(
        !path("inner/a.csv").exists() && !path("inner/level-3.csv").exists(),
        "of the run before"
    );
    assert!(path("inner/b.svg").exists() && path("inner/a.pdf").exists(), "of others");
    SET.check(folder.path(), &[]).unwrap();
    assert_eq!(fs::read_dir(path("inner")).unwrap().count(), 3);
    fs::remove_dir_all(path("inner")).unwrap();
    fs::write(path("inner"), "a file").unwrap();
    assert!(SET.check(folder.path(), &[]).unwrap_err().to_string().contains("cannot write"));
}

fn texts(text: &str) -> Vec<(String, String)> {
    ["readme", "src/model.c", "src/model.h"].map(|path| (path.to_owned(), text.to_owned())).into()
}

#[test]
fn whichever_step_fails_a_new_folder_is_whole_or_not_there() {
    for failing in 1.. {
        let around = tempfile::tempdir().unwrap();
        let folder = around.path().join("new");
        let (steps, outcome) = steps_of(failing, || write_folder(&folder, &texts("text")));
        if steps.len() < failing {
            outcome.unwrap();
            assert_eq!(steps.last().unwrap(), "rename temporary to new");
            let files = ["readme", "src/model.c", "src/model.h"].map(|path| folder.join(path));
            assert!(files.iter().all(|path| fs::read_to_string(path).unwrap() == "text"));
            assert_eq!(contents(&around).len(), 1);
            return;
        }
        // The files are safe; only that of their folder could not be told.
        if steps[failing - 1] == "sync folder" {
            outcome.unwrap();
            continue;
        }
        assert!(outcome.unwrap_err().to_string().contains("cannot write"));
        assert_eq!(contents(&around), [], "step {failing}: {}", steps[failing - 1]);
    }
}

#[test]
fn an_existing_folder_keeps_its_files_and_takes_all_new_ones() {
    let folder = tempfile::tempdir().unwrap();
    write_folder(folder.path(), &texts("old")).unwrap();
    fs::write(folder.path().join("notes"), "mine").unwrap();
    let (steps, outcome) = steps_of(6, || write_folder(folder.path(), &texts("new")));
    outcome.unwrap_err();
    assert!(steps.iter().all(|step| !step.starts_with("rename")));
    let text = |path: &str| fs::read_to_string(folder.path().join(path)).unwrap();
    assert_eq!([text("readme"), text("src/model.c"), text("notes")], ["old", "old", "mine"]);
    write_folder(folder.path(), &texts("new")).unwrap();
    assert_eq!([text("readme"), text("src/model.h"), text("notes")], ["new", "new", "mine"]);
    assert_eq!(contents(&folder).len(), 3);
}
