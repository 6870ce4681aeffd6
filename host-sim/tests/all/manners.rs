//! What the program says of its work, and what it tells a shell of itself.

use crate::common::{Folder, tiny_scene};

#[test]
fn quiet_runs_print_no_notes_and_verbose_runs_print_times() {
    let folder = Folder::new("manners");
    folder.write("scene.toml", tiny_scene());
    let run = ["run", "scene.toml", "--no-refine"];
    let usual = folder.notes(&run);
    assert!(usual.contains("fit weights …") && !usual.contains("took"), "{usual}");
    let verbose = folder.notes(&[&run[..], &["-v"]].concat());
    assert!(verbose.contains("fit weights: took 0."), "{verbose}");
    assert_eq!(folder.notes(&[&run[..], &["--quiet"]].concat()), "");
    // Notes of a data file too.
    folder.write("log.csv", "ch1,ch2,f_n\n1,7,2\n3,7,4\n5,7,5\n7,7,9\n9,7,9\n");
    let train = ["train", "log.csv", "--inputs", "ch*", "--outputs", "f_n", "-o", "m.bin"];
    let train = [&train[..], &["--centres", "2", "--no-refine"]].concat();
    assert!(folder.notes(&train).contains("ch2"));
    assert_eq!(folder.notes(&[&train[..], &["-q"]].concat()), "");
    // Errors are said.
    assert!(folder.fail(&["-q", "inspect", "none.bin"], 2).contains("none.bin"));
}

#[test]
fn help_says_what_holds_for_its_command() {
    let folder = Folder::new("help");
    let help = |command: &[&str]| {
        let text = folder.succeed(&[command, &["--help"]].concat());
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let (repeated, readings) = ("lines of a CSV file are repeated", "a CSV file with the readings");
    for check in [&["emulate"][..], &["link", "port", "check"]] {
        assert!(help(check).contains(repeated) && help(check).contains(readings));
    }
    let synth = help(&["synth"]);
    assert!(!synth.contains(repeated) && !synth.contains(readings), "{synth}");
    let decodes = "decodes frames that are not decoded yet";
    assert!(help(&["view"]).contains(decodes));
    assert!(!help(&["link", "port", "baseline"]).contains(decodes));
    // An option that is refused.
    assert!(!help(&["sweep"]).contains("--seed"));
}
