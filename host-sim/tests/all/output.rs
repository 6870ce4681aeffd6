//! Where outputs go, and what is left when the work is interrupted.

use std::fs::{self, File, OpenOptions};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{Folder, program, shell_status, small_scene};

/// The program, with the folder of its work.
fn host(folder: &Folder, arguments: &[&str]) -> Command {
    let mut command = program();
    command
        .args(arguments)
        .current_dir(folder.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

/// Command of a shell that ends as the program, `"$0"`.
fn shell(folder: &Folder, script: &str) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", script, env!("CARGO_BIN_EXE_taxel")]).current_dir(folder.path("."));
    command
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status();
    assert!(status.unwrap().success());
}

/// Waits until something is in the folder besides `known` files.
fn wait_for_more(folder: &Folder, known: usize) {
    let start = Instant::now();
    while folder.names().len() <= known {
        assert!(start.elapsed() < Duration::from_mins(1), "no file appears");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn stdout_as_output_is_a_stream_and_results_go_to_stderr() {
    let folder = Folder::new("stdout");
    folder.write("scene.toml", small_scene());
    let fifo = folder.path("fifo");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    let synth = ["synth", "scene.toml", "-n", "2", "-o"];
    let waiting = host(&folder, &[&synth[..], &["fifo"]].concat()).stderr(Stdio::piped()).spawn();
    assert!(Command::new("mkfifo").arg(folder.path("silent")).status().unwrap().success());
    let unwritten = host(&folder, &["inspect", "silent"]).stderr(Stdio::piped()).spawn();

    for path in ["-", "/dev/stdout", "/dev/fd/1", "link"] {
        if path == "link" {
            symlink("/dev/stdout", folder.path(path)).unwrap();
        }
        // A file that is appended to keeps what it has.
        folder.write("log.csv", "precious\n");
        let log = OpenOptions::new().append(true).open(folder.path("log.csv")).unwrap();
        let arguments = [&["--json"], &synth[..], &[path]].concat();
        let output = host(&folder, &arguments).stdout(log).stderr(Stdio::piped()).output().unwrap();
        assert!(output.status.success(), "{path}");
        let text = folder.read("log.csv");
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0] == "precious" && lines[1].starts_with("r4c1_ohm,"), "{path}: {text}");
        assert_eq!(lines.len(), 4, "{path}");
        let summary: serde_json::Value = serde_json::from_slice(&output.stderr).unwrap();
        assert_eq!(summary["frames"], 2);
    }
    // Another file that the shell has open.
    folder.write("log.csv", "precious\n");
    let script = "exec 3>> log.csv; exec \"$0\" synth scene.toml -n 2 -o /dev/fd/3";
    assert!(shell(&folder, script).stdout(Stdio::null()).status().unwrap().success());
    let text = folder.read("log.csv");
    assert!(text.starts_with("precious\nr4c1_ohm,") && text.lines().count() == 4, "{text}");
    assert!(!folder.names().contains(&"-".to_owned()));

    // Somebody who has seen enough.
    let script = "\"$0\" synth scene.toml -n 3000 -o -; echo $? >&2";
    let mut child =
        shell(&folder, script).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let told = String::from_utf8(child.wait_with_output().unwrap().stderr).unwrap();
    assert!(told.ends_with("file: -\n0\n"), "{told}");
    let full = File::create("/dev/full").unwrap();
    let mut command = host(&folder, &[&synth[..], &["-"]].concat());
    let output = command.stdout(full).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("No space left"));
    // Rust would write into /dev/null.
    let output = shell(&folder, "exec \"$0\" synth scene.toml -n 2 -o - >&-").output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("cannot write -: stdout is closed"));
    folder.succeed(&[&synth[..], &["/dev/null"]].concat());
    assert!(host(&folder, &[&synth[..], &["-"]].concat()).status().unwrap().success());
    // A log that cannot be written is no reason to stop.
    let full = File::create("/dev/full").unwrap();
    let status = host(&folder, &["run", "scene.toml"]).stderr(full).status().unwrap();
    assert_eq!(status.code(), Some(0));

    let output = waiting.unwrap().wait_with_output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("cannot write fifo: no program reads this pipe"), "{message}");
    let output = unwritten.unwrap().wait_with_output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("cannot read silent: no program writes to this pipe"), "{message}");
    let reader = Command::new("cat").arg(&fifo).stdout(Stdio::piped()).spawn().unwrap();
    folder.succeed(&[&synth[..], &["fifo"]].concat());
    assert!(reader.wait_with_output().unwrap().stdout.starts_with(b"r4c1_ohm,"));
}

#[test]
fn an_open_file_that_is_read_is_not_written() {
    let folder = Folder::new("read-streams");
    let text = "t,a\n1,2\n3,4\n5,6\n7,9\n";
    folder.write("a.csv", text);
    fs::hard_link(folder.path("a.csv"), folder.path("same.csv")).unwrap();
    let train = ["train", "a.csv", "--inputs", "t", "--outputs", "a", "--centres", "1"];
    folder.succeed(&[&train[..], &["--no-refine", "-o", "m.bin"]].concat());
    let decode =
        |input: &str, output: &str| format!("exec \"$0\" decode m.bin {input} -o {output}");
    for (script, says) in [
        (format!("{} < a.csv", decode("a.csv", "/dev/stdin")), "stdin cannot be written"),
        (format!("{} < a.csv", decode("m.bin", "/proc/self/fd/0")), "stdin cannot be written"),
        (format!("exec 3>> a.csv; {}", decode("a.csv", "/dev/fd/3")), "written over a.csv"),
        (format!("exec 3<> a.csv; {}", decode("same.csv", "/dev/fd/3")), "written over same.csv"),
        (format!("{} >> a.csv", decode("a.csv", "-")), "written over a.csv"),
    ] {
        let output = shell(&folder, &script).stderr(Stdio::piped()).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{script}: {stderr}");
        assert!(stderr.contains(says), "{script}: {stderr}");
        assert_eq!(folder.read("a.csv"), text, "{script}");
    }
    let good = format!("exec 3>> log.csv; {}", decode("a.csv", "/dev/fd/3"));
    assert!(shell(&folder, &good).stderr(Stdio::null()).status().unwrap().success());
    assert_eq!(folder.read("log.csv").lines().count(), 5);
}

#[test]
fn a_signal_leaves_no_temporary_file_and_a_kill_a_hidden_one() {
    let folder = Folder::new("signals");
    folder.write("y.csv", "old");
    let synth = ["synth", "press", "-n", "20000", "-o", "y.csv"];
    for (name, status) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129), ("-KILL", 137)] {
        let mut child = host(&folder, &synth).spawn().unwrap();
        wait_for_more(&folder, 1);
        // Past the check, which removes its temporary at once.
        while !folder.names().iter().any(|name| is_large(&folder.path(name))) {
            assert!(child.try_wait().unwrap().is_none(), "too late for {name}");
            std::thread::sleep(Duration::from_millis(1));
        }
        signal(&child, name);
        assert_eq!(shell_status(child.wait().unwrap()), Some(status), "{name}");
        assert_eq!(folder.read("y.csv"), "old");
        assert_eq!(folder.names().len(), if status == 137 { 2 } else { 1 }, "{name}");
    }
    let names = folder.names();
    assert!(names[0].starts_with(".y.csv."), "{names:?}");
    folder.succeed(&["synth", "press", "-n", "2", "-o", "y.csv"]);
    assert_eq!(folder.names(), names);
    fs::remove_file(folder.path(&names[0])).unwrap();

    // Whoever starts it may want a signal to be ignored, as `nohup` does.
    let script = "trap '' INT HUP; exec \"$0\" synth press -n 3000 -o y.csv";
    let mut child = shell(&folder, script).stdout(Stdio::null()).spawn().unwrap();
    wait_for_more(&folder, 1);
    signal(&child, "-INT");
    signal(&child, "-HUP");
    assert!(child.wait().unwrap().success());
    assert!(is_large(&folder.path("y.csv")) && folder.names() == ["y.csv"]);
}

fn is_large(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| found.len() > 100_000)
}
