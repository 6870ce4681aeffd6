use taxel_core::blob::{Model, ModelParts, encode_to_vec};
use taxel_core::rbf::Network;
use taxel_data::dataset::{AtRest, Dataset};
use taxel_data::exp;
use taxel_data::progress::Silent;

use super::*;
use crate::train::{Features, Kinds, train};
use crate::{Options, Origin, pack};

fn in_testdata(name: &str) -> ModelBlob {
    let path = format!("{}/../../testdata/{name}.bin", env!("CARGO_MANIFEST_DIR"));
    ModelBlob::read(path.as_ref()).unwrap()
}

/// The text of one file of a library.
fn file(files: &[SourceFile], path: &str) -> String {
    files.iter().find(|(name, _)| name == path).unwrap().1.clone()
}

fn source_of(blob: &ModelBlob) -> String {
    file(&library(blob, &Name::new("mat").unwrap()).unwrap(), "src/mat.c")
}

#[test]
fn a_name_is_an_identifier_of_c_and_none_of_its_words_and_headers() {
    for name in ["a", "mat", "my_mat2", &"x".repeat(63)] {
        assert_eq!(Name::new(name).unwrap().lower(), name);
    }
    assert_eq!(Name::new("my_mat2").unwrap().upper(), "MY_MAT2");
    let long = "x".repeat(64);
    for name in ["", "2mat", "_mat", "Mat", "NULL", "my-mat", "mät", "a b", "a/b", "../mat", &long]
    {
        assert_eq!(Name::new(name), Err(BadName::NoIdentifier), "{name}");
    }
    for name in ["int", "class", "string", "arduino", "math", "while", "install", "row"] {
        assert_eq!(Name::new(name), Err(BadName::Taken), "{name}");
    }
}

#[test]
fn floats_in_hexadecimal_are_those_of_c() {
    for (value, text) in [
        (0.0, "0x0p+0f"),
        (-0.0, "-0x0p+0f"),
        (1.0, "0x1p+0f"),
        (-1.5, "-0x1.8p+0f"),
        (0.1, "0x1.99999ap-4f"),
        (f32::MAX, "0x1.fffffep+127f"),
        (f32::MIN_POSITIVE, "0x1p-126f"),
        (1e-45, "0x0.000002p-126f"),
        (-3e-39, "-0x0.41559p-126f"),
    ] {
        assert_eq!(numbers::float(value), text);
    }
}

#[test]
fn texts_of_a_model_end_neither_a_literal_nor_a_comment() {
    assert_eq!(numbers::string("a\"b\\c??/\nµ"), r#""a\042b\134c\077\077/\012\302\265""#);
    assert_eq!(numbers::comment("Fz [N] */ // ??/ \n\\ Ω"), "Fz [N] __ __ ___ __ Ω");
}

#[test]
fn parts_of_a_template_stay_by_their_flags_and_values_are_not_filled_again() {
    let mut values = Values::default();
    values.set("A", "@B@ taxel_model");
    values.set("B", "2");
    let text = "taxel_model @A@ a@b.c @B@ @NONE@\n//@if x\nTAXEL_MODEL_X\n//@if !y\nxy\n//@end\n//@end\n//@if y\nno\n//@end\nend";
    let name = Name::new("mat").unwrap();
    let filled = template::fill(text, &name, &["x"], &values);
    assert_eq!(filled, "mat @B@ taxel_model a@b.c 2 @NONE@\nMAT_X\nxy\nend");
    assert_eq!(template::fill(text, &name, &["y"], &values).lines().count(), 3);
}

#[test]
fn every_file_is_filled_for_every_model() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata");
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    for model in paths.filter(|path| path.extension().is_some_and(|end| end == "bin")) {
        let blob = ModelBlob::read(&model).unwrap();
        let files = library(&blob, &Name::new("my_mat").unwrap()).unwrap();
        assert_eq!(files.len(), 11);
        for (path, text) in files {
            assert!(
                !text.contains("//@") && !text.to_lowercase().contains("taxel_model"),
                "{path}"
            );
            let mut rest = text.split('@');
            rest.next_back();
            let is_key = |part: &str| {
                !part.is_empty()
                    && part.chars().all(|c| c.is_ascii_uppercase() || "_0123456789".contains(c))
            };
            assert!(!rest.any(is_key), "{}, {path}", model.display());
        }
    }
}

#[test]
fn only_what_a_model_needs_is_written() {
    let parts = [
        "struct float32",
        "struct fixed16",
        "exponential(",
        "project(",
        "mat_assess(",
        "mat_fill(",
        "square_root(",
        "mat_set_baseline(",
        "affine",
        "give_up(outputs, NETWORK_OUTPUTS, status, MAT_OVERFLOW)",
    ];
    let of = |model: &str| -> Vec<&str> {
        let source = source_of(&in_testdata(model));
        parts.into_iter().filter(|part| source.contains(part)).collect()
    };
    let overflow = parts[parts.len() - 1];
    assert_eq!(of("row4"), ["struct float32", "exponential(", "affine", overflow]);
    assert_eq!(of("kernels-fixed16"), ["struct fixed16", "affine"]);
    assert_eq!(of("array-fixed16-no-tail"), ["struct fixed16", "project("]);
    // A model that assesses frames fills them, too.
    let full =
        ["struct fixed16", "exponential(", "project(", "mat_assess(", "mat_fill(", "square_root("];
    assert_eq!(of("array-fixed16-confidence"), full);
}

/// A model with other metadata.
fn changed<'m>(
    model: &Model<'m>,
    change: impl FnOnce(&mut taxel_core::blob::Metadata<'m>),
) -> ModelBlob {
    let networks: Vec<Network<'_>> = model.networks().collect();
    let rows: Vec<u8> = (0..model.shape().rows)
        .filter_map(|row| model.network_of_row(row))
        .map(|it| it as u8)
        .collect();
    let mut metadata = *model.metadata();
    change(&mut metadata);
    let parts = ModelParts::new(&networks, &rows, metadata);
    ModelBlob::of_bytes(&encode_to_vec(&parts).unwrap()).unwrap()
}

#[test]
fn a_model_of_ratios_has_a_baseline() {
    let blob = in_testdata("row4");
    let relative = changed(&blob.parse(), |it| it.relative_inputs = true);
    let files = library(&relative, &Name::new("mat").unwrap()).unwrap();
    for (path, text) in [
        ("src/mat.h", "int mat_set_baseline(const float *baseline);"),
        ("src/mat.h", "#define MAT_RELATIVE 1"),
        ("src/mat.c", "test_baseline"),
        ("examples/Decode/Decode.ino", "mat_set_baseline(readings);"),
        ("examples/posix/main.c", "./decode baseline.csv < readings.csv"),
        ("README.md", "mat_set_baseline"),
    ] {
        assert!(file(&files, path).contains(text), "{path}");
    }
}

/// A model of a strip of eight cells, whose outputs are place and force of a touch.
fn strip() -> ModelBlob {
    const FRAMES: usize = 300;
    let names = (1..=8).map(|cell| format!("adc_{cell}")).collect();
    let mut data = Dataset::empty(names, vec!["x_mm".into(), "force_N".into()], 1, FRAMES);
    for frame in 0..FRAMES {
        let (x, force) = ((frame % 29) as f64 * 0.25, (frame % 11) as f64);
        for cell in 0..8 {
            let distance = cell as f64 - x;
            let change = force * exp(-distance * distance / 2.0);
            data.inputs.values[frame * 8 + cell] = 100.0 + change;
        }
        let place = if force > 0.0 { x } else { f64::NAN };
        data.outputs.values[frame * 2..][..2].copy_from_slice(&[place, force]);
    }
    data.at_rest = Some(AtRest { level: vec![100.0; 8], deviation: vec![0.01; 8] });
    let kinds = Some(Kinds::all(Features::Normalised { threshold: 3.0 }));
    let options = Options { centres: 8, kinds, ..Options::default() };
    let trained = train(&data, &options, &Silent).unwrap();
    pack(&trained, &data, &Origin::of_data("strip", 0, 1, &data)).unwrap()
}

#[test]
fn places_and_amounts_of_a_touch_have_parts_of_their_own() {
    let source = source_of(&strip());
    for part in [
        "clamped |= decode_part_0(readings, outputs + 0, &worst, scratch);",
        "clamped |= decode_part_1(readings, outputs + 1, &worst, scratch);",
        "strength < touch_0[LEAST]",
        "strength > touch_1[MOST]",
        "static const float touch_1[21]",
    ] {
        assert!(source.contains(part), "{part}: {source}");
    }
    assert!(!source.contains("project("), "networks are given shape and strength themselves");
    let tests = |name: &str| -> String {
        let (_, text) = source.split_once(&format!("{name}[")).unwrap();
        let (_, text) = text.split_once('=').unwrap();
        let (text, _) = text.split_once(';').unwrap();
        text.chars().filter(char::is_ascii_digit).collect()
    };
    // Two touches, of which the first is like those of training, a missing reading, and no touch.
    assert_eq!(tests("test_status"), "0013");
    assert!(tests("test_clamped").starts_with('0'));
}

#[test]
fn names_of_a_model_are_harmless_wherever_they_are_written() {
    let blob = in_testdata("row4");
    let model = blob.parse();
    let outputs = model.shape().outputs;
    let names = vec!["*/ \"@CRC@\" taxel_model"; outputs].join("\n");
    let hostile = changed(&model, |it| {
        it.name = "??/ */ @CRC@\"\\";
        it.output_names = taxel_core::blob::Columns(&names);
    });
    let files = library(&hostile, &Name::new("mat").unwrap()).unwrap();
    let source = file(&files, "src/mat.c");
    assert!(source.contains(r#""*/ \042@CRC@\042 taxel_model","#), "{source}");
    let header = file(&files, "src/mat.h");
    assert_eq!(header.matches("/*").count(), header.matches("*/").count());
    assert!(!header.contains("??/"));
    assert!(file(&files, "library.properties").contains("Model ___ __ _CRC___,"));
}

#[test]
fn the_header_tells_shape_columns_and_cost() {
    let files = library(&in_testdata("row4"), &Name::new("mat").unwrap()).unwrap();
    let header = file(&files, "src/mat.h");
    for part in [
        "#define MAT_READINGS 18u",
        "MAT_OVERFLOW = 2",
        " *     r4c1_ohm, Ω\n",
        " *     r4e1_dz_mm, mm\n",
        "18 inputs, ",
        " bytes of constants in flash",
        " cycles",
    ] {
        assert!(header.contains(part), "{part}: {header}");
    }
}
