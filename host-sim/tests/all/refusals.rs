//! Refusals of bad input: exit status 2, a message that names file, place, value and fix, and no file
//! left.

use crate::common::{Folder, small_scene};

/// Runs a command and expects a refusal that contains all of `says`, with no file left.
fn refused(folder: &Folder, arguments: &[&str], says: &[&str]) {
    let before = folder.names();
    let output = folder.run(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
    for part in says {
        assert!(stderr.contains(part), "{arguments:?}: {part:?} is not in {stderr:?}");
    }
    assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
    assert_eq!(folder.names(), before, "{arguments:?} left something behind");
}

#[test]
fn options_replace_a_scenes_numbers_before_these_are_checked() {
    let folder = Folder::new("replaced-sizes");
    let good = small_scene();
    folder.write("good.toml", &good);
    folder.write("centres.toml", good.replacen("centres = 12", "centres = 3000", 1));
    folder.write("frames.toml", good.replacen("frames = 3000", "frames = 100000000", 1));
    let train = |scene: &'static str, more: &[&'static str]| {
        [&["train", scene, "--no-refine", "-o", "m.bin"], more].concat()
    };
    for (arguments, says) in [
        (train("good.toml", &["-n", "10"]), "training.centres = 12: there must be fewer"),
        (train("good.toml", &["-n", "10"]), "lower it or raise -n"),
        (train("good.toml", &["-n", "1"]), "-n 1: it must be at least 2"),
        (train("good.toml", &["-n", "100000000"]), "-n 100000000: give from 1 to"),
        (train("good.toml", &["--centres", "4000"]), "--centres 4000: there must be fewer"),
        (train("good.toml", &["--centres", "4000"]), "raise training.frames"),
        (train("centres.toml", &["-n", "2000"]), "training.centres = 3000"),
        (train("frames.toml", &[]), "training.frames = 100000000"),
    ] {
        refused(&folder, &arguments, &[says]);
    }
    folder.succeed(&train("centres.toml", &["--centres", "12", "-n", "300"]));
    folder.succeed(&train("frames.toml", &["-n", "300"]));
    folder.succeed(&["synth", "frames.toml", "-n", "2", "-o", "two.csv"]);
}

#[test]
fn a_fill_is_refused_before_training() {
    let folder = Folder::new("early-fill");
    let lines = (0..60).map(|i| format!("{i},{},{}\n", i * i % 17, 3 * i % 11));
    folder.write("two.csv", format!("a,b,y\n{}", lines.collect::<String>()));
    folder.write("rest.csv", "a,b\n1,2\n1,2\n");
    let two = ["train", "two.csv", "--inputs", "a,b", "--outputs", "y", "--fill", "-o", "m.bin"];
    let relative = ["--relative-inputs", "--baseline", "rest.csv"];
    for (more, says) in [(&[][..], "fewer than four"), (&relative[..], "relative to the baseline")]
    {
        let said = folder.fail(&[&two, more].concat(), 2);
        assert!(said.contains(says) && said.contains("leave --fill"), "{said}");
        assert!(!said.contains("fit "), "{said}");
    }
}

#[test]
fn bad_scenes() {
    let folder = Folder::new("bad-scenes");
    let good = small_scene();
    for (from, to, says) in [
        ("row_wires = 8", "row_wires = 0", &["sensor.row_wires = 0", "from 1 to 255"][..]),
        ("row_wires = 8", "row_wires = \"8\"", &["row_wires", "invalid type"]),
        ("row_wires = 8", "rows = 8", &["unknown field `rows`", "row_wires"]),
        ("[20.0, 18.0, 5.0]", "[20.0, 18.0, -5.0]", &["sensor.size_mm (z) = -5", "positive"]),
        ("[20.0, 18.0, 5.0]", "[20.0, nan, 5.0]", &["sensor.size_mm (y) = NaN"]),
        (
            "[20.0, 18.0, 5.0]",
            "[20.0, 1e-300, 5.0]",
            &["sensor.size_mm (y) = 1e-300", "1e-9 to 1e9"],
        ),
        ("[20.0, 18.0, 5.0]", "[1e300, 18.0, 5.0]", &["sensor.size_mm (x) = 1e300", "1e-9 to 1e9"]),
        (
            "resistance_ohm_per_mm = 100.0",
            "resistance_ohm_per_mm = 1e-34",
            &["sensor.resistance_ohm_per_mm = 1e-34", "1e-9 to 1e9"],
        ),
        (
            "resistance_ohm_per_mm = 100.0",
            "resistance_ohm_per_mm = 0.0",
            &["sensor.resistance_ohm_per_mm = 0"],
        ),
        (
            "resistance_ohm_per_mm = 100.0",
            "resistance_ohm_per_mm = 100.0\nupper_electrodes_mm = [[1.0, 2.0, 5.0]]",
            &["sensor.upper_electrodes_mm = a list of 1 positions", "48"],
        ),
        ("dent_depth_mm = [0.0, 1.0]", "dent_depth_mm = [0.0, 2.0]", &["2 mm along z", "20 %"]),
        ("dent_depth_mm = [0.0, 1.0]", "dent_depth_mm = [1.0, 0.0]", &["dent_depth_mm", "low ≤"]),
        ("dent_radius_mm = [2.0, 5.0]", "dent_radius_mm = [0.0, 5.0]", &["dent_radius_mm"]),
        ("kind = \"press\"", "kind = \"hit\"", &["unknown variant `hit`", "press"]),
        ("kind = \"relative\"", "kind = \"pink\"", &["unknown variant `pink`", "span"]),
        ("seed = 1", "seed = -1", &["seed = -1", "expected a whole number from 0 on"]),
        (
            "row_wires = 8",
            "row_wires = -8",
            &["row_wires = -8", "expected a whole number from 0 on"],
        ),
        ("seed = 1", "precision = \"f16\"", &["unknown variant `f16`", "f64"]),
        ("level = 0.005", "level = 5.0", &["noise.level = 5", "0.005 is 0.5 %"]),
        ("[noise]", "[drift]\ngain = 1.0\n\n[noise]", &["drift.gain = 1", "0.02 is ±2 %"]),
        ("[noise]", "[drift]\nrate = 1.0\n\n[noise]", &["unknown field `rate`", "gain"]),
        ("row_wires = [4, 5]", "row_wires = [0]", &["readout.row_wires = [0]", "from 1 to 8"]),
        ("row_wires = [4, 5]", "row_wires = [9]", &["readout.row_wires = [9]"]),
        ("row_wires = [4, 5]", "row_wires = [5, 4]", &["ascending"]),
        ("axes = [\"x\", \"y\", \"z\"]", "axes = [\"z\", \"x\"]", &["outputs.axes", "order"]),
        ("axes = [\"x\", \"y\", \"z\"]", "axes = []", &["outputs.axes"]),
        ("axes = [\"x\", \"y\", \"z\"]", "", &["[outputs]", "missing field `axes`"]),
        ("quantity = \"deformation\"", "", &["[outputs]", "missing field `quantity`", "`contact`"]),
        ("[outputs]", "[outputs]\ncontact = [\"depth\"]", &["`contact` stands alone", "leave out"]),
        (
            "[outputs]",
            "[outputs]\ncontact = [\"torque\"]",
            &["unknown variant `torque`", "`centre`"],
        ),
        ("centres = 12", "centres = 0", &["training.centres = 0"]),
        ("centres = 12", "centres = 3000", &["training.centres = 3000", "fewer centres than"]),
        ("spread = 0.8", "spread = 0.0", &["training.spread = 0", "positive"]),
        (
            "spread = 0.8",
            "spread = 0.8\nwidths = \"own\"",
            &["unknown variant `own`", "`neighbours`"],
        ),
        ("frames = 3000", "frames = 1", &["training.frames = 1"]),
        ("spreads = [0.1,", "spreads = [0.0,", &["table1.spreads = 0"]),
        ("spreads = [0.1,", "spreads = [1e300,", &["table1.spreads = 1e300", "f32"]),
        ("spread = 0.8", "spread = 1e-30", &["training.spread = 1e-30", "f32"]),
        ("frames = 3000", "frames = 100000000", &["training.frames", "does not fit in memory"]),
        ("standard_frames = 40", "standard_frames = 4000", &["table1.standard_frames = 4000"]),
        ("name = \"small\"", "name = \"../up\"", &["name = \"../up\"", "letters"]),
        ("name = \"small\"", "name = small", &["TOML parse error", "line 3"]),
    ] {
        assert!(good.contains(from), "{from}");
        let scene = folder.write("scene.toml", good.replacen(from, to, 1));
        let mut says = says.to_vec();
        says.push("scene.toml");
        // `synth` does not train.
        let command = if says[0].starts_with("training.") { "train" } else { "synth" };
        refused(&folder, &[command, scene.to_str().unwrap(), "-o", "data"], &says);
    }
}

#[test]
fn bad_scenes_of_a_contact() {
    let folder = Folder::new("bad-contact");
    let contact = include_str!("../../../scenes/contact.toml");
    for (from, to, says) in [
        ("\"depth\", \"force\"", "\"force\", \"depth\"", &["outputs.contact", "in this order"][..]),
        (
            "kind = \"press\"\ndent_radius_mm = [2.0, 5.0]\ndent_depth_mm = [0.0, 1.0]\nshear_ratio = [0.0, 0.5]",
            "kind = \"independent\"\ndx_mm = [0.0, 1.0]\ndy_mm = [0.0, 1.0]\ndz_mm = [0.0, 1.0]",
            &["outputs.contact = [\"centre\"", "deformation.kind = \"press\""],
        ),
        (
            "[training]",
            "[table1]\nspreads = [0.5]\nnoise_levels = [0.01]\nframes = 100\ntest_frames = 100\ncentres = 5\n\
             affine_tail = true\nstandard_frames = 10\n\n[training]",
            &["table1", "outputs of electrodes", "leave it out"],
        ),
    ] {
        assert!(contact.contains(from), "{from}");
        let scene = folder.write("scene.toml", contact.replacen(from, to, 1));
        refused(&folder, &["synth", scene.to_str().unwrap(), "-o", "data.csv"], says);
    }
    let contact = |more: &[&'static str]| [&["train", "contact", "-o", "m.bin"], more].concat();
    refused(&folder, &contact(&["--features", "144"]), &["features = 144", "from 1 to 143"]);
    refused(
        &folder,
        &["train", "press", "-o", "m.bin", "--features", "5"],
        &["features = 5", "leave it out"],
    );
    let of_fixed16 = ["--format", "fixed16", "--widths", "neighbours"];
    refused(
        &folder,
        &[&["train", "press", "-o", "m.bin"][..], &of_fixed16].concat(),
        &["widths = neighbours", "fixed16", "give the format f32-direct, or common widths"],
    );
    refused(&folder, &["table1", "contact"], &["no [table1]"]);
    refused(&folder, &["run", "no-such.toml"], &["no-such.toml", "paper, press"]);
    refused(&folder, &["train", "pres", "-o", "m.bin"], &["pres:", "paper, press"]);
}

#[test]
fn bad_csv_files() {
    let folder = Folder::new("bad-csv");
    for (content, says) in [
        (&b""[..], &["the file is empty"][..]),
        (b"ch1,f_n\n", &["no line of data"]),
        (b"ch1,ch1\n1,2\n", &["line 1", "\"ch1\" stands twice"]),
        (b"ch1,\n1,2\n", &["line 1", "column 2 has no usable name"]),
        (b"ch1,f_n\n1,2\n3,four\n", &["line 3", "\"f_n\"", "\"four\" is not a number"]),
        (b"ch1,f_n\n1,inf\n", &["line 2", "\"inf\" is not a number"]),
        (b"ch1,f_n\n1,2\n3\n", &["line 3 has 1 fields", "names 2"]),
        (b"ch1,f_n\n1,2,3\n", &["line 2 has 3 fields"]),
        (b"ch1,g_n\n1,2\n3,4\n", &["no column matches \"f_n\"", "ch1, g_n"]),
        (b"ch1,f_n\n1,\n,2\n", &["no line has a value in every chosen column"]),
        (b"ch1,f\x07n\n1,2\n", &["column 2 has no usable name"]),
        (b"ch1\n1\n\n2\n", &["line 3 is blank", "NaN"]),
        (b"ch\xff,f_n\n1,2\n", &["line 1: it is no UTF-8 text", "save as UTF-8"]),
        (b"ch1,f_n\n1,2\n-1e31,4\n", &["line 3", "\"ch1\"", "beyond 1e30"]),
    ] {
        folder.write("data.csv", content);
        let train = ["train", "data.csv", "--inputs", "ch*", "--outputs", "f_n", "-o", "m.bin"];
        refused(&folder, &train, &[says, &["data.csv"]].concat());
    }
    folder.write("data.csv", "ch1,f_n\n1,2\n3,4\n");
    refused(&folder, &["train", "data.csv", "-o", "m.bin"], &["r*c*_ohm", "--inputs"]);
    let twice = ["train", "data.csv", "--inputs", "*", "--outputs", "f_n", "-o", "m.bin"];
    refused(
        &folder,
        &twice,
        &["\"f_n\" is chosen as an input and as an output", "--inputs", "--outputs"],
    );
}

#[test]
fn bad_training_options() {
    let folder = Folder::new("bad-options");
    folder.write("data.csv", "ch1,f_n,fold\n1,2,0\n3,4,1\n5,5,0\n7,9,1\n");
    let train = |options: &[&'static str], says: &[&str]| {
        let base = ["train", "data.csv", "--inputs", "ch*", "--outputs", "f_n", "-o", "m.bin"];
        refused(&folder, &[&base, options].concat(), says);
    };
    train(&["--centres", "0"], &["centres = 0"]);
    train(&["--centres", "5"], &["centres = 5", "4 training frames"]);
    train(&["--centres", "4"], &["centres = 4", "fewer than"]);
    train(&["--centres", "two"], &["two", "--centres"]);
    train(&["--centres", "2", "--spread", "0"], &["spread = 0"]);
    train(&["--centres", "2", "--spread", "nan"], &["spread = NaN"]);
    train(&["--centres", "2", "--spread", "1e-30"], &["spread = 1e-30", "f32"]);
    train(&["--centres", "2", "--penalty", "2"], &["penalty = 2", "1e-15 to 1"]);
    train(&["--fold-blocks", "5", "--centres", "1"], &["--fold-blocks 5", "from 2 to 4"]);
    train(&["--centres", "1,2"], &["--centres [1, 2]", "--select"]);
    train(&["--fast"], &["unexpected argument '--fast'"]);
    train(&["-n", "10"], &["-n sets a scene's frames"]);
    train(&["--select", "--folds", "9", "--centres", "1"], &["--folds 9", "from 2 to 4"]);
    train(&["--select", "--fold-column", "day"], &["\"day\" is missing", "ch1, f_n, fold"]);
    let two_folds = ["--select", "--fold-column", "fold", "--centres", "2"];
    train(&[&two_folds[..], &["--no-refine"]].concat(), &["centres = 2", "2 training"]);
    train(&two_folds, &["folds = 2", "at least 4"]);
    train(&two_folds[1..], &["folds = 2", "at least 3", "without refinement"]);
    train(&["--whole-array", "--centres", "2", "--no-refine"], &["leave it out (--whole-array)"]);
    let of_scene = ["train", "press", "--folds", "4", "-o", "m.bin"];
    refused(&folder, &of_scene, &["--folds", "a scene has fresh frames: leave it out"]);
    refused(
        &folder,
        &["train", "press", "--inputs", "ch*", "-o", "m.bin"],
        &["--inputs picks columns of a CSV file"],
    );
    refused(&folder, &["synth", "press", "-n", "0", "-o", "x.csv"], &["-n = 0"]);
    refused(&folder, &["synth", "press", "--noise", "2", "-o", "x.csv"], &["noise level = 2"]);
    refused(&folder, &["fly"], &["fly"]);
    refused(&folder, &["table1", "press", "--grouping", "z"], &["--grouping"]);
}

#[test]
fn what_cannot_be_traded_leaves_no_folder_behind() {
    let folder = Folder::new("bad-trade");
    for centres in ["0", "30000"] {
        refused(&folder, &["trade", "press", "--centres", centres], &["--centres", centres]);
    }
    refused(&folder, &["trade", "press", "--average", "4,4"], &["--average gives 4 twice"]);
    refused(&folder, &["trade", "press", "--max-error", "0", "-o", "a/b"], &["--max-error 0"]);
    refused(&folder, &["trade", "press", "--max-cycles", "0"], &["--max-cycles 0", "positive"]);
    refused(&folder, &["trade", "press", "--max-flash", "0"], &["--max-flash 0", "positive"]);
}

#[test]
fn unwritable_output_is_found_before_the_work() {
    let folder = Folder::new("unwritable");
    folder.write("file", "not a folder");
    folder.write("data.csv", "ch1,f_n\n1,2\n3,4\n5,5\n");
    folder.write("scene.toml", small_scene());
    for output in ["file/m.bin", "no/such/folder/m.bin", "."] {
        let says = &["cannot write", output, "-o"][..];
        refused(&folder, &["synth", "press", "-n", "5", "-o", output], says);
        refused(&folder, &["train", "press", "-o", output], says);
        refused(&folder, &["table1", "press", "-o", output], says);
    }
    refused(&folder, &["run", "scene.toml", "-o", "file"], &["cannot write", "file/small"]);
}

#[test]
fn bad_models_and_data_that_does_not_fit_them() {
    let folder = Folder::new("bad-models");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["train", "scene.toml", "-n", "100", "-o", "m.bin"]);
    folder.succeed(&["synth", "scene.toml", "-n", "10", "-o", "data.csv"]);
    let mut blob = std::fs::read(folder.path("m.bin")).unwrap();
    blob[500] ^= 1;
    folder.write("corrupt.bin", &blob);
    folder.write("other.bin", "name = \"a scene\"");
    folder.write("short.csv", "r4c1_ohm\n60\n");
    let decode = |model, data, says: &[&str]| {
        refused(&folder, &["decode", model, data, "-o", "e.csv"], says);
    };
    decode("corrupt.bin", "data.csv", &["corrupt.bin", "CRC-32"]);
    decode("other.bin", "data.csv", &["other.bin", "not a weight blob"]);
    decode("none.bin", "data.csv", &["cannot read none.bin"]);
    decode("m.bin", "none.csv", &["cannot read none.csv"]);
    decode("m.bin", "short.csv", &["short.csv", "\"r4c2_ohm\" is missing"]);
    refused(&folder, &["eval", "m.bin", "short.csv"], &["\"r4c2_ohm\" is missing"]);
    refused(&folder, &["inspect", "data.csv"], &["not a weight blob"]);
    folder.write("deformation.csv", "r4e1_dx_mm\n0\n");
    refused(
        &folder,
        &["forward", "scene.toml", "deformation.csv", "-o", "r.csv"],
        &["deformation.csv", "\"r4e1_dy_mm\" is missing"],
    );
}

#[test]
fn relative_inputs_without_a_baseline() {
    let folder = Folder::new("no-baseline");
    folder.write("scene.toml", small_scene());
    folder.write("data.csv", "ch1,ch2,f_n\n1,5,2\n2,6,3\n3,6,4\n4,6,5\n");
    folder.write("rest.csv", "ch1,ch2\n0.5,0\n1.5,0\n");
    folder.write("other.csv", "ch1\n0.5\n");
    folder.succeed(&["train", "scene.toml", "-n", "100", "-o", "readings.bin"]);
    folder.succeed(&["train", "scene.toml", "-n", "100", "--relative-inputs", "-o", "m.bin"]);
    folder.succeed(&["synth", "scene.toml", "-n", "10", "-o", "d.csv"]);
    let needs = &["m.bin", "relative to the baseline", "--baseline FILE", "untouched"][..];
    refused(&folder, &["decode", "m.bin", "d.csv", "-o", "e.csv"], needs);
    refused(&folder, &["eval", "m.bin", "d.csv"], needs);
    let needless = &["readings.bin", "as they are", "leave --baseline out"][..];
    refused(&folder, &["eval", "readings.bin", "d.csv", "--baseline", "d.csv"], needless);
    let other = &["other.csv", "\"r4c1_ohm\" is missing"][..];
    refused(&folder, &["eval", "m.bin", "d.csv", "--baseline", "other.csv"], other);
    let onto_baseline = ["decode", "m.bin", "d.csv", "--baseline", "rest.csv", "-o", "rest.csv"];
    refused(&folder, &onto_baseline, &["would be written over"]);

    let train = |options: &[&'static str], says: &[&str]| {
        let base = ["train", "data.csv", "--inputs", "ch*", "--outputs", "f_n", "-o", "x.bin"];
        refused(&folder, &[&base, options].concat(), says);
    };
    train(&["--relative-inputs"], &["--baseline FILE", "untouched"]);
    train(&["--baseline", "rest.csv"], &["--relative-inputs"]);
    let zero = &["rest.csv", "no baseline for ch2", "missing or zero", "--inputs"][..];
    train(&["--relative-inputs", "--baseline", "rest.csv"], zero);
    train(&["--relative-inputs", "--baseline", "other.csv"], &["\"ch2\" is missing"]);
    let of_scene = ["train", "press", "--relative-inputs", "--baseline", "rest.csv", "-o", "x.bin"];
    refused(&folder, &of_scene, &["--baseline is for a CSV file"]);
    refused(&folder, &["drift", "press", "--gain", "1"], &["--gain 1", "below 1"]);
    refused(
        &folder,
        &["synth", "press", "--scale", "0", "-o", "x.csv"],
        &["--scale 0", "positive"],
    );
}

#[test]
fn a_failure_keeps_the_file_that_was_there() {
    let folder = Folder::new("keeps");
    folder.write("m.bin", "the old model");
    folder.write("data.csv", "ch1,f_n\n1,2\n3,x\n");
    let train = ["train", "data.csv", "--inputs", "ch*", "--outputs", "f_n", "-o", "m.bin"];
    refused(&folder, &train, &["line 3"]);
    assert_eq!(std::fs::read(folder.path("m.bin")).unwrap(), b"the old model");
}

#[test]
fn an_input_is_never_written_over() {
    let folder = Folder::new("own-input");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["train", "scene.toml", "-n", "100", "-o", "m.bin"]);
    folder.succeed(&["synth", "scene.toml", "-n", "20", "-o", "d.csv"]);
    let whole = |name: &str| std::fs::read(folder.path(name)).unwrap();
    let before = [whole("scene.toml"), whole("m.bin"), whole("d.csv")];
    let says = &["would be written over"][..];
    refused(&folder, &["synth", "scene.toml", "-o", "scene.toml"], says);
    refused(&folder, &["train", "d.csv", "--centres", "4", "-o", "./d.csv"], says);
    refused(&folder, &["decode", "m.bin", "d.csv", "-o", "m.bin"], says);
    refused(&folder, &["decode", "m.bin", "d.csv", "-o", "d.csv"], says);
    refused(&folder, &["forward", "scene.toml", "d.csv", "-o", "d.csv"], says);
    assert_eq!([whole("scene.toml"), whole("m.bin"), whole("d.csv")], before);
}

#[test]
fn what_cannot_be_done_is_found_before_anything_is_written() {
    let folder = Folder::new("before");
    folder.write("scene.toml", small_scene());
    let groups = &["--group dq_mm", "dx_mm, dy_mm, dz_mm"][..];
    refused(&folder, &["table1", "scene.toml", "--group", "dq_mm", "-o", "t.csv"], groups);
    refused(&folder, &["table1", "scene.toml", "--noise", "0.1"], &["--noise"]);
    let enormous = &["100000000", "does not fit in memory"][..];
    refused(&folder, &["synth", "press", "-n", "100000000", "-o", "d.csv"], enormous);
    std::fs::create_dir_all(folder.path("out/small/report.html")).unwrap();
    refused(&folder, &["run", "scene.toml"], &["cannot write", "report.html"]);
    assert_eq!(std::fs::read_dir(folder.path("out/small")).unwrap().count(), 1);
}

/// Lines of two inputs and an output that follows from them. Names stand before what becomes of their values.
fn columns(first: fn(f64) -> f64, output: fn(f64) -> f64) -> String {
    let line = |i: i32| {
        let (a, b) = (f64::from(i * 37 % 101) / 101.0, f64::from(i * 53 % 97) / 97.0);
        let y = (3.0 * a).sin() * (2.0 * b).cos();
        format!("{:?},{b:?},{:?}\n", first(a), output(y))
    };
    format!("a,b,y\n{}", (0..200).map(line).collect::<String>())
}

#[test]
fn a_column_that_f32_does_not_hold_is_named() {
    let folder = Folder::new("scale");
    let train = |content: String, more: &[&'static str]| {
        folder.write("d.csv", content);
        let usual = ["train", "d.csv", "--inputs", "a,b", "--outputs", "y", "--centres", "12"];
        [&usual[..], &["--no-refine", "-o", "m.bin"], more].concat()
    };
    for (content, says) in [
        (columns(|a| a * 1e-30, |y| y), &["d.csv: column \"a\"", "multiply it by 1e31"][..]),
        (columns(|a| a * 1e-300, |y| y), &["d.csv: column \"a\"", "range below 1e-28"]),
        (columns(|a| a + 1e8, |y| y), &["d.csv: column \"a\"", "8.0 apart", "subtract 100000000"]),
        (columns(|a| a, |y| y * 1e-36), &["d.csv: column \"y\"", "range below 1e-28"]),
        (columns(|a| a, |y| y + 1e9), &["d.csv: column \"y\"", "64.0 apart", "subtract 99999999"]),
        (columns(|a| a * 1e300, |y| y), &["column \"a\"", "beyond 1e30", "e299"]),
    ] {
        refused(&folder, &train(content, &[]), says);
    }
    let offset = train(columns(|a| a, |y| y + 1e5), &["--format", "fixed16"]);
    refused(&folder, &offset, &["fixed16 loses the output \"y\"", "Subtract 100000", "f32"]);
    let wide = train(columns(|a| a, |y| y), &["--format", "fixed16", "--spread", "1e6"]);
    refused(&folder, &wide, &["spread = 1000000", "give a smaller spread"]);
    for scale in [|y| y * 1e-27, |y| y * 1e29] {
        let squares = train(columns(|a| a, scale), &["--confidence"]);
        refused(&folder, &squares, &["column \"y\"", "from 1e-15 to 1e15", "leave the confidence"]);
    }
    // At any scale in between, nothing is lost, and `train` says how good the model is.
    for content in [columns(|a| a * 1e-27, |y| y * 1e29), columns(|a| a * 1e30, |y| y * 1e-27)] {
        let page = folder.succeed(&train(content, &[]));
        assert!(page.contains("R² there: y 0.99"), "{page}");
    }
}

#[test]
fn lines_that_are_all_equal_have_no_r_squared() {
    let folder = Folder::new("equal");
    folder.write("d.csv", columns(|a| a, |y| y));
    let inputs = ["--inputs", "a,b", "--outputs", "y", "--centres", "8", "--no-refine"];
    folder.succeed(&[&["train", "d.csv", "-o", "m.bin"], &inputs[..]].concat());
    folder.write("equal.csv", format!("a,b,y\n{}", "0.3,0.3,0.1\n".repeat(300)));
    let page = folder.succeed(&["eval", "m.bin", "equal.csv"]);
    let line = page.lines().find(|line| line.starts_with("network")).unwrap();
    let r_squared = line.split_whitespace().rev().nth(2).unwrap();
    assert_eq!(r_squared, "-", "{page}");
    assert!(page.contains("y does not change in these frames"), "{page}");
}

#[test]
fn what_a_scene_makes_doubtful_is_said() {
    let folder = Folder::new("doubtful");
    // Noise as large as the readings.
    folder.write("noise.toml", small_scene().replace("level = 0.005", "level = 1.0"));
    let output = folder.run(&["synth", "noise.toml", "-n", "100", "-o", "d.csv"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && said.contains("(readings-not-positive)"), "{said}");
    // Too few frames for what is to be learnt: fresh frames show it.
    folder.write("few.toml", small_scene().replace("level = 0.005", "level = 0.0"));
    let few = ["train", "few.toml", "-n", "300", "--centres", "8", "-o", "m.bin"];
    let page = folder.succeed(&few);
    assert!(page.contains("On fresh frames") && page.contains("(no-gain-over-mean)"), "{page}");
}

#[test]
fn nothing_to_evaluate_is_an_error_and_less_is_said() {
    let folder = Folder::new("evaluate");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["train", "scene.toml", "-n", "200", "-o", "m.bin"]);
    folder.succeed(&["synth", "scene.toml", "-n", "2", "-o", "d.csv"]);
    let data = std::fs::read_to_string(folder.path("d.csv")).unwrap();
    let mut lines: Vec<Vec<&str>> = data.lines().map(|line| line.split(',').collect()).collect();
    lines[1][0] = "1e39"; // beyond f32: missing to the device
    let text = |lines: &[Vec<&str>]| lines.iter().map(|l| l.join(",") + "\n").collect::<String>();
    folder.write("less.csv", text(&lines));
    let page = folder.succeed(&["eval", "m.bin", "less.csv"]);
    assert!(page.contains("54 of 72 values count"), "{page}");
    let results = folder.succeed(&["--json", "eval", "m.bin", "less.csv"]);
    let results: serde_json::Value = serde_json::from_str(&results).unwrap();
    for errors in results["decoders"][1]["errors"].as_array().unwrap() {
        // The mean is that of the values that count.
        assert!(errors["r_squared"].as_f64().unwrap().abs() < 1e-12, "{errors}");
    }
    let page = folder.succeed(&["decode", "m.bin", "less.csv", "-o", "e.csv"]);
    assert!(page.contains("1 of them"), "{page}");
    lines.truncate(2);
    lines[1][20] = "";
    folder.write("none.csv", text(&lines));
    refused(&folder, &["eval", "m.bin", "none.csv"], &["none.csv", "no line has both"]);
}

#[test]
fn a_link_is_followed_and_permissions_stay() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Folder::new("links");
    folder.write("scene.toml", small_scene());
    let real = folder.write("real.csv", "old");
    std::fs::set_permissions(&real, std::fs::Permissions::from_mode(0o600)).unwrap();
    symlink("real.csv", folder.path("link.csv")).unwrap();
    folder.succeed(&["synth", "scene.toml", "-n", "3", "-o", "link.csv"]);
    assert!(folder.path("link.csv").is_symlink());
    assert_eq!(std::fs::read_to_string(&real).unwrap().lines().count(), 4);
    assert_eq!(std::fs::metadata(&real).unwrap().permissions().mode() & 0o777, 0o600);
    let printed = folder.succeed(&["synth", "scene.toml", "-n", "3", "-o", "/dev/stdout"]);
    assert!(printed.starts_with("r4c1_ohm,"), "{printed}");
}

#[test]
fn an_emulator_or_an_image_that_is_not_there_is_named() {
    let folder = Folder::new("no_emulator");
    refused(&folder, &["emulate", "--image", "none.elf"], &["none.elf", "cargo xtask firmware"]);
    let not_elf = folder.write("image.txt", "not really");
    refused(&folder, &["emulate", "--image", not_elf.to_str().unwrap()], &["image.txt", "no ELF"]);
    let image = folder.write("image.elf", "\x7FELF, or so it says");
    let image = image.to_str().unwrap();
    folder.write("small.toml", small_scene());
    let arguments = ["emulate", "small.toml", "--image", image, "--qemu", "no-such-qemu"];
    refused(&folder, &arguments, &["no-such-qemu", "qemu-system-arm"]);
    // Scenes with another readout than the image's.
    for (field, other, only) in [
        ("circuit", "divider", "zero-potential"),
        ("sampler", "on-chip", "mcp3208"),
        ("row_drive", "pins", "shift-register"),
    ] {
        let readout = format!("[readout]\n{field} = \"{other}\"\n");
        folder.write("other.toml", small_scene().replace("[readout]\n", &readout));
        let arguments = ["emulate", "other.toml", "--scans", "1", "--image", image];
        refused(&folder, &arguments, &["--scans", &format!("readout.{field}"), only]);
    }
    // Model of another scene.
    folder.succeed(&["train", "small.toml", "-o", "small.bin"]);
    let arguments = ["emulate", "press", "--model", "small.bin", "--image", image];
    refused(&folder, &arguments, &["--model", "press"]);
}

#[test]
fn bad_studies() {
    let folder = Folder::new("bad-studies");
    let map = |more: &[&'static str]| [&["study", "map"], more].concat();
    refused(&folder, &map(&["--row", "9"]), &["--row 9", "rows 1 to 8"]);
    refused(&folder, &map(&["--group", "dw_mm"]), &["--group dw_mm", "dz_mm"]);
    refused(&folder, &map(&["--samples", "2,30"]), &["--samples 2", "from 4 to 100000"]);
    refused(&folder, &map(&["--samples", "30,200000"]), &["--samples 200000", "from 4 to 100000"]);
    refused(&folder, &map(&["--centres", "0,64"]), &["--centres 0", "from 1 to 1024"]);
    refused(&folder, &map(&["--spread", "1,0.1"]), &["--spread", "larger than the one before"]);
    refused(&folder, &map(&["--noise", "2"]), &["--noise 2"]);
    refused(
        &folder,
        &map(&["--initial-covariance", "-1"]),
        &["--initial-covariance -1", "such as 1e6"],
    );
    let widths = |more: &[&'static str]| [&["study", "widths", "press"], more].concat();
    refused(&folder, &widths(&["--spread", "-1"]), &["--spread -1", "positive"]);
    refused(&folder, &widths(&["--centres", "0"]), &["--centres 0", "from 1 to 65535"]);
}
