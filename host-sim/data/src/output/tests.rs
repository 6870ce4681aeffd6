use std::cell::Cell;
use std::fs::{self, File, Permissions};
use std::io;
use std::path::PathBuf;

use super::*;

const SET: FileSet = FileSet { name: "run", files: &["model", "metrics", "table", "page"] };
const OLD: &[(&str, &[u8])] =
    &[("model", b"old"), ("metrics", b"old"), ("table", b"old"), ("page", b"old")];
const NEW: &[(&str, &[u8])] = &[("model", b"new"), ("metrics", b"new"), ("page", b"new")];

/// Folder that is removed after the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("taxel-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Names and contents of everything in it.
    fn contents(&self) -> Vec<(String, String)> {
        let mut contents: Vec<(String, String)> = fs::read_dir(&self.0)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .map(|path| {
                let name = path.file_name().unwrap().to_string_lossy().into_owned();
                (name, fs::read_to_string(path).unwrap_or_default())
            })
            .collect();
        contents.sort();
        contents
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Disk of which one call fails; that and all later ones, if the program is killed there.
struct Failing {
    calls_left: Cell<usize>,
    is_killed: bool,
}

impl Failing {
    fn at(call: usize, is_killed: bool) -> Self {
        Self { calls_left: Cell::new(call), is_killed }
    }

    fn call<T>(&self, call: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
        let left = self.calls_left.get();
        let fails = left == 1 || (left == 0 && self.is_killed);
        self.calls_left.set(left.saturating_sub(1));
        if fails { Err(ErrorKind::StorageFull.into()) } else { call() }
    }
}

impl Disk for Failing {
    fn create(&self, path: &Path) -> io::Result<File> {
        self.call(|| System.create(path))
    }
    fn write(&self, file: &File, bytes: &[u8]) -> io::Result<usize> {
        self.call(|| System.write(file, bytes))
    }
    fn set_permissions(&self, file: &File, permissions: Permissions) -> io::Result<()> {
        self.call(|| System.set_permissions(file, permissions))
    }
    fn sync(&self, _: &File) -> io::Result<()> {
        // Power is not lost here, and waiting takes time.
        self.call(|| Ok(()))
    }
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.call(|| System.rename(from, to))
    }
    fn remove(&self, path: &Path) -> io::Result<()> {
        self.call(|| System.remove(path))
    }
    fn make_folder(&self, path: &Path) -> io::Result<()> {
        self.call(|| System.make_folder(path))
    }
    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        self.call(|| System.remove_folder(path))
    }
}

#[test]
fn whichever_call_fails_a_file_is_the_old_or_the_new_one_and_no_temporary_stays() {
    let folder = Folder::new("file-fault");
    let path = folder.path("x.csv");
    for call in 1.. {
        fs::write(&path, "old").unwrap();
        let outcome = write_whole_on(&Failing::at(call, false), &path, |file| {
            file.write_all(b"new").map_err(|cause| Error::write(&path, cause))
        });
        let found = if outcome.is_ok() { "new" } else { "old" };
        let mut contents = folder.contents();
        // Only if its own removal failed, after all was renamed, is there anything to remove.
        contents.retain(|(name, _)| name == "x.csv" || outcome.is_err());
        assert_eq!(contents, [("x.csv".to_owned(), found.to_owned())], "call {call}");
        if outcome.is_ok() {
            assert!(call > 5, "only {call} calls");
            return;
        }
        assert!(outcome.unwrap_err().to_string().contains("x.csv"));
    }
}

#[test]
fn whichever_call_fails_a_folder_holds_the_files_of_one_run() {
    let folder = Folder::new("set-fault");
    for is_killed in [false, true] {
        for call in 1.. {
            assert!(call < 100);
            SET.write_on(&Failing::at(0, false), &folder.0, OLD).unwrap();
            let disk = Failing::at(call, is_killed);
            let outcome = SET.write_on(&disk, &folder.0, NEW);
            let (hidden, seen): (Vec<_>, Vec<_>) =
                folder.contents().into_iter().partition(|(name, _)| name.starts_with('.'));
            let of = |text: &str| seen.iter().filter(|(_, content)| content == text).count();
            assert!(of("old") == 0 || of("new") == 0, "call {call}: {seen:?}");
            if !is_killed {
                let whole = if outcome.is_ok() { of("new") == 3 } else { of("old") == 4 };
                assert!(whole && hidden.is_empty(), "call {call}: {seen:?} {hidden:?}");
            }
            // Who comes next completes what was begun, or removes it.
            SET.check(&folder.0, &[]).unwrap();
            let names: Vec<String> = folder.contents().into_iter().map(|it| it.0).collect();
            let whole = [&["metrics", "model", "page", "table"][..], &["metrics", "model", "page"]];
            assert!(whole.contains(&&names.iter().map(String::as_str).collect::<Vec<_>>()[..]));
            if disk.calls_left.get() > 0 {
                assert!(call > 15, "only {call} calls");
                break;
            }
        }
    }
}

#[test]
fn files_of_an_earlier_run_go_and_those_of_others_stay() {
    let folder = Folder::new("set-stale");
    fs::write(folder.path("notes.txt"), "mine").unwrap();
    SET.write(&folder.0, OLD).unwrap();
    SET.write(&folder.0, NEW).unwrap();
    let names: Vec<String> = folder.contents().into_iter().map(|it| it.0).collect();
    assert_eq!(names, ["metrics", "model", "notes.txt", "page"]);
}

#[test]
fn a_check_leaves_no_folder_and_no_file() {
    let folder = Folder::new("set-check");
    SET.check(&folder.path("a/b"), &[]).unwrap();
    check_writable(&folder.path("x.csv"), &[]).unwrap();
    assert!(folder.contents().is_empty());
    let made = folder.path("a/b");
    assert!(SET.write_on(&Failing::at(5, false), &made, NEW).is_err());
    assert!(folder.contents().is_empty());
}

#[test]
fn leftovers_go_with_the_next_run_unless_somebody_is_at_work_on_them() {
    let folder = Folder::new("leftovers");
    let path = folder.path("x.csv");
    let others = [".x.csv.12345.tmp", ".y.csv.0123456789abcdef.tmp", ".x.csv.0123456789abcdef"];
    others.iter().for_each(|name| fs::write(folder.path(name), "").unwrap());
    fs::write(folder.path(".x.csv.0123456789abcdef.tmp"), "half a fi").unwrap();
    let at_work = Temporary::beside(&System, &path).unwrap();
    write_bytes(&path, b"new").unwrap();
    at_work.rename(&folder.path("at work")).unwrap();
    let mut names: Vec<String> = folder.contents().into_iter().map(|it| it.0).collect();
    names.retain(|name| !others.contains(&&**name));
    assert_eq!(names, ["at work", "x.csv"]);
    assert_eq!(folder.contents().len(), 5);
}

#[cfg(unix)]
#[test]
fn links_are_followed_even_to_nothing_and_read_only_files_are_refused() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Folder::new("links");
    symlink("real.csv", folder.path("link.csv")).unwrap();
    write_bytes(&folder.path("link.csv"), b"new").unwrap();
    assert!(folder.path("link.csv").is_symlink());
    assert_eq!(fs::read(folder.path("real.csv")).unwrap(), b"new");
    symlink("ring", folder.path("ring")).unwrap();
    let refused = check_writable(&folder.path("ring"), &[]).unwrap_err().to_string();
    assert!(refused.contains("too many links"), "{refused}");

    fs::set_permissions(folder.path("real.csv"), Permissions::from_mode(0o444)).unwrap();
    for path in ["real.csv", "link.csv"] {
        let refused = check_writable(&folder.path(path), &[]).unwrap_err().to_string();
        assert!(refused.contains("read-only") && refused.contains(path), "{refused}");
        assert!(write_bytes(&folder.path(path), b"other").is_err());
    }
    fs::rename(folder.path("real.csv"), folder.path("model")).unwrap();
    let refused = SET.check(&folder.0, &[]).unwrap_err().to_string();
    assert!(refused.contains("read-only") && refused.contains("model"), "{refused}");
    fs::remove_file(folder.path("model")).unwrap();
    symlink("elsewhere", folder.path("page")).unwrap();
    let refused = SET.check(&folder.0, &[]).unwrap_err().to_string();
    assert!(refused.contains("link") && refused.contains("page"), "{refused}");
}
