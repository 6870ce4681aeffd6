//! Models as source code: what `export` writes, and the firmware's example that decodes with it.

use std::fs;

use taxel_data::Stream;
use taxel_simulate::{World, synthesise};

use crate::common::{Folder, small_scene};
use crate::virtual_board::{NoDelay, Series, VirtualBoard, all_readings};

#[path = "../../../firmware/examples/minimal.rs"]
mod minimal;

fn in_testdata(name: &str) -> String {
    format!("{}/../testdata/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn exported(folder: &Folder, blob: &str) -> String {
    folder.succeed(&["export", &in_testdata(blob), "--rust", "model.rs"]);
    folder.read("model.rs")
}

#[test]
fn sources_in_testdata_are_those_that_the_command_writes() {
    let folder = Folder::new("export");
    for name in ["array-touch", "hand-made", "row4"] {
        let source = fs::read_to_string(in_testdata(&format!("{name}.rs"))).unwrap();
        assert!(
            exported(&folder, &format!("{name}.bin")) == source,
            "changed on purpose? taxel export testdata/{name}.bin --rust testdata/{name}.rs"
        );
    }
}

#[test]
fn an_export_to_rust_has_functions_only_for_parts_of_its_model() {
    let folder = Folder::new("export_rust");
    folder.write("scene.toml", small_scene().replace("frames = 3000", "frames = 400"));
    let functions = ["pub fn decode(", "pub fn assess(", "pub fn fill("];
    for (options, has) in [
        (&["--each-row", "--relative-inputs"][..], [true, false, false]),
        (&["--reading-model", "full"], [true; 3]),
    ] {
        folder.succeed(&[&["train", "scene.toml", "-o", "m.bin"], options].concat());
        let said = folder.succeed(&["export", "m.bin", "--rust", "m.rs"]);
        assert!(said.contains("rows: 2\n") && said.ends_with("m.rs\n"), "{said}");
        let source = folder.read("m.rs");
        assert_eq!(functions.map(|function| source.contains(function)), has);
        assert_eq!(source.contains("reciprocals: &[["), options.contains(&"--relative-inputs"));
    }
    let said = folder.fail(&["export", "m.bin", "--rust", "m.bin"], 2);
    assert!(said.contains("m.bin") && said.contains("(--rust)"), "{said}");
    // A full disk is no fault of the option.
    let said = folder.fail(&["export", "m.bin", "--rust", "/dev/full"], 2);
    assert!(said.contains("No space left") && !said.contains("--rust"), "{said}");
}

#[test]
fn a_source_that_leaves_the_tracker_out_says_so() {
    let folder = Folder::new("export_tracker");
    let train = ["train", "moving", "-n", "200", "--no-refine", "--centres", "4", "-o", "m.bin"];
    for is_tracked in [true, false] {
        folder.succeed(&[&train[..], if is_tracked { &["--track"] } else { &[] }].concat());
        for language in ["--rust=m.rs", "--c=m"] {
            let notes = folder.notes(&["export", "m.bin", language]);
            assert_eq!(notes.contains("without the model's tracker"), is_tracked, "{notes}");
        }
    }
}

#[test]
fn an_export_to_c_is_a_whole_library_with_the_given_name() {
    let folder = Folder::new("export_c");
    let blob = in_testdata("array-fixed16-confidence.bin");
    let export = ["export", &blob, "--c", "lib/mat", "--name", "mat"];
    let said = folder.succeed(&export);
    assert!(said.contains("numbers: 7480 bytes\n") && said.contains(": 67f65bbc\n"), "{said}");
    assert_eq!(folder.names(), ["lib"]);
    let files = [
        "CMakeLists.txt",
        "LICENSE",
        "README.md",
        "examples/Decode/Decode.ino",
        "examples/posix/main.c",
        "library.json",
        "library.properties",
        "src/mat.c",
        "src/mat.h",
        "zephyr/CMakeLists.txt",
        "zephyr/module.yml",
    ];
    let text = |file: &str| fs::read_to_string(folder.path("lib/mat").join(file)).unwrap();
    assert!(files.iter().all(|file| text(file).contains("mat") || *file == "LICENSE"));
    assert!(text("src/mat.h").contains("float mat_assess(float *readings"));
    // Again, with a file of the user's.
    fs::write(folder.path("lib/mat/notes.txt"), "mine").unwrap();
    fs::write(folder.path("lib/mat/src/mat.c"), "old").unwrap();
    folder.succeed(&export);
    assert!(text("src/mat.c").starts_with("/* Model ") && text("notes.txt") == "mine");
    // Neither the user's own files nor another library's are replaced or mixed with.
    let said = folder.fail(&["export", &blob, "--c", "lib/mat", "--name", "sole"], 2);
    assert!(said.contains("lib/mat: it has files that are not of library sole"), "{said}");
    fs::create_dir(folder.path("own")).unwrap();
    fs::write(folder.path("own/README.md"), "mine").unwrap();
    folder.fail(&["export", &blob, "--c", "own", "--name", "mat"], 2);
    assert_eq!(fs::read_dir(folder.path("own")).unwrap().count(), 1);
    let row4 = in_testdata("row4.bin");
    folder.succeed(&["export", &row4, "--c", "other", "--limits", "20,inf"]);
    let header = folder.read("other/src/taxel_model.h");
    let limits = "_SHORTED_BELOW_OHM 20.0f\n#define TAXEL_MODEL_OPEN_ABOVE_OHM 3.4028235e38f\n";
    assert!(header.contains(limits), "{header}");
    folder.succeed(&["export", &row4, "--c", "other", "--limits", "none"]);
    assert!(!folder.read("other/src/taxel_model.h").contains("_OHM "));
}

#[test]
fn the_example_estimates_compression_from_pins_and_converters() {
    const FRAMES: usize = 200;
    let world = World::press();
    // The example corrects for its switches.
    let board = VirtualBoard::new(Series { row_switch: 0.26, lead: 0.0 });
    let mut sensor = minimal::Sensor::new(board.pins(), board.chips(), NoDelay);
    let truth = synthesise(&world, Stream::Test, FRAMES);
    let names = (1..=6).map(|electrode| format!("r4e{electrode}_dz_mm"));
    let places: Vec<usize> =
        names.map(|name| truth.outputs.names.iter().position(|it| *it == name).unwrap()).collect();
    let (mut squares, mut of_mean) = (0.0, 0.0);
    for (readings, outputs) in all_readings(&world, FRAMES).lines().zip(truth.outputs.lines()) {
        board.set_readings(readings);
        let estimate = sensor.estimate_dz_mm();
        for (place, estimate) in places.iter().zip(estimate) {
            squares += (outputs[*place] - f64::from(estimate)).powi(2);
            of_mean += outputs[*place].powi(2);
        }
    }
    let rmse_mm = (squares / (FRAMES * places.len()) as f64).sqrt();
    assert!(rmse_mm < 0.055, "{rmse_mm} mm");
    assert!(squares < 0.15 * of_mean, "{squares} against {of_mean}");
}
