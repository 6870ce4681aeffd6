//! Models as a library in C.

use taxel_core::blob::{Model, ModelParts, encode_to_vec};
use taxel_core::health::Limits;
use taxel_core::rbf::Network;
use taxel_learn::ModelBlob;
use taxel_learn::export::c::template::{self, Values};
use taxel_learn::export::c::{BadName, Name, SourceFile, library, numbers};

const LIMITS: Option<Limits> = Some(Limits::USUAL);

fn in_testdata(name: &str) -> ModelBlob {
    let path = format!("{}/../../testdata/{name}.bin", env!("CARGO_MANIFEST_DIR"));
    ModelBlob::read(path.as_ref()).unwrap()
}

/// The text of one file of a library.
fn file(files: &[SourceFile], path: &str) -> String {
    files.iter().find(|(name, _)| name == path).unwrap().1.clone()
}

#[test]
fn a_name_is_a_c_identifier_and_no_keyword_or_header() {
    for name in ["a", "mat", "my_mat2", &"x".repeat(63)] {
        assert_eq!(Name::new(name).unwrap().lower(), name);
    }
    assert_eq!(Name::new("my_mat2").unwrap().upper(), "MY_MAT2");
    let long = "x".repeat(64);
    for name in ["", "2mat", "_mat", "Mat", "NULL", "my-mat", "mät", "a b", "a/b", "../mat", &long]
    {
        assert_eq!(Name::new(name), Err(BadName::NoIdentifier), "{name}");
    }
    for name in
        ["int", "class", "string", "arduino", "math", "while", "install", "row", "size", "uint8"]
    {
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
fn flags_select_parts_of_a_template_and_values_are_filled_once() {
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
        let files = library(&blob, &Name::new("my_mat").unwrap(), LIMITS).unwrap();
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
    let files = library(&relative, &Name::new("mat").unwrap(), LIMITS).unwrap();
    for (path, text) in [
        ("src/mat.h", "int mat_set_baseline(mat_t *sensor, const float *baseline);"),
        ("src/mat.h", "#define MAT_RELATIVE 1"),
        ("src/mat.c", "test_baseline"),
        ("examples/Decode/Decode.ino", "mat_set_baseline(&sensor, readings);"),
        ("examples/posix/main.c", "./decode baseline.csv < readings.csv"),
        ("README.md", "mat_set_baseline"),
    ] {
        assert!(file(&files, path).contains(text), "{path}");
    }
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
    let files = library(&hostile, &Name::new("mat").unwrap(), LIMITS).unwrap();
    let source = file(&files, "src/mat.c");
    assert!(source.contains(r#""*/ \042@CRC@\042 taxel_model","#), "{source}");
    let header = file(&files, "src/mat.h");
    assert_eq!(header.matches("/*").count(), header.matches("*/").count());
    assert!(!header.contains("??/"));
    assert!(file(&files, "library.properties").contains("Model ___ __ _CRC___,"));
}

#[test]
fn the_header_tells_shape_columns_and_cost() {
    let files = library(&in_testdata("row4"), &Name::new("mat").unwrap(), LIMITS).unwrap();
    let header = file(&files, "src/mat.h");
    for part in [
        "#define MAT_READINGS 18u",
        "#define MAT_OPEN_ABOVE_OHM 1000.0f\n",
        "#define MAT_OUTPUT_R4E1_DZ_MM 0u\n",
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
