//! The model in force: its identity, its shape, and the memory that it is decoded from.

use taxel_core::Decoder;
use taxel_core::blob::{Columns, Floats, Metadata, ModelShape};
use taxel_core::checksum::CRC_32;
use taxel_firmware::link::message::{Configuration, ModelFault, Refusal, Report, Request, Setting};

use crate::mock::*;

#[test]
fn the_identity_tells_what_the_model_was_trained_on() {
    let shape = ModelShape { rows: 1, inputs: 3, outputs: 2 };
    let plain = Metadata::unnamed(shape);
    let read = |metadata: Metadata<'static>| {
        let mut host = started(quiet(), &blob_of_a_row(shape, metadata));
        answer!(host, &Request::Identify, Report::Identity(identity) => {
            (identity.model_name.to_owned(), identity.model.unwrap())
        })
    };
    let (name, model) = read(Metadata { name: "press", scene_digest: 7, ..plain });
    assert_eq!((&name[..], model.scene_digest), ("press", 7));
    let crc = |text: &str| CRC_32.checksum(text.as_bytes());
    assert_eq!((model.inputs_crc_32, model.outputs_crc_32), (crc("x\nx\nx\n\n"), crc("y\ny\n")));
    let (_, other) = read(Metadata { output_units: Columns("N\nN"), ..plain });
    assert_eq!(other.inputs_crc_32, model.inputs_crc_32);
    assert_eq!(other.outputs_crc_32, crc("y\nyN\nN"));
    // A long name is cut between letters.
    for (name, length) in [("äöüßäöüßäöüßäöüßäöüßäöüß", 40), ("xäöüßäöüßäöüßäöüßäöüßäöüß", 39)]
    {
        assert_eq!(read(Metadata { name, ..plain }).0, &name[..length]);
    }
}

#[test]
fn the_model_determines_which_cells_are_scanned_and_decoded() {
    let [first, second] = frame_at_rest();
    // Without names of wires, the first ones: a column and an output less; one network for all six readings.
    for (outputs, names, readings) in [
        (1, "a\nb", first[..2].to_vec()),
        (4, "x\nx\nx\nx\nx\nx", [first, second].concat()),
        // Cells that are not all between their wires, and another order.
        (2, "r2c1_ohm\nr2c2_ohm", second[..2].to_vec()),
        (1, "r1c3_ohm\nr2c1_ohm\nr1c2_ohm", vec![first[2], second[0], first[1]]),
    ] {
        let blob = blob_of_names(names, outputs);
        let outputs = Decoder::<1>::load(&blob).unwrap().decode(&readings[..]).unwrap().outputs;
        let mut host = started(Configuration { send_readings: true, ..every(1000) }, &blob);
        host.run_until(1500);
        let [scanned, decoded] = &host.answers(0)[..] else { panic!("one scan") };
        assert!(scanned.ends_with(&format!("{:?} }}", Floats::new(&readings))), "{scanned}");
        let row = format!("row_status: [0], outputs: {:?}", Floats::new(&outputs));
        assert!(decoded.contains(&row), "{names}: {decoded}");
    }
}

#[test]
fn a_model_that_does_not_fit_the_board_is_refused() {
    let old = blob(1, 3);
    let unnamed = |inputs, outputs| {
        let shape = ModelShape { rows: 1, inputs, outputs };
        blob_of_a_row(shape, Metadata::unnamed(shape))
    };
    // Working space has room for 14 numbers: two for each feature.
    let few = blob_of_features(7);
    for (blob, fault) in [
        (blob_of_names("r3c1_ohm\nr3c2_ohm", 1), Some(ModelFault::Wires)),
        (blob_of_names("r1c1_ohm\nrest", 1), Some(ModelFault::Wires)),
        (unnamed(7, 1), Some(ModelFault::Shape)),
        (unnamed(3, 5), Some(ModelFault::Shape)),
        (blob_of_features(8), Some(ModelFault::Shape)),
        (few, None),
    ] {
        let in_force = started(quiet(), &blob).model_crc();
        assert_eq!(in_force, fault.is_none().then(|| crc_of(&blob)), "{fault:?}");
        let mut device = Device::new(Flash::slots_with(&old));
        let expected = fault.map_or(Ok(confirmed(&blob)), |it| Err(Refusal::BadModel(it)));
        assert_eq!(device.install(&blob), expected);
        assert_eq!(device.restart(), Some(in_force.unwrap_or(crc_of(&old))));
    }
}

#[test]
fn a_kept_baseline_is_that_of_its_wires_in_their_order() {
    let [first, second] =
        ["r1c1_ohm\nr1c2_ohm", "r1c2_ohm\nr1c1_ohm"].map(|names| blob_of_names(names, 1));
    let mut bench = Bench::new(quiet(), &first);
    let mut host = bench.session();
    host.set_baseline(&[60.0, 50.0]);
    host.tell(&Request::Keep(Setting::Baseline));
    for (next, is_contact) in [(&second, false), (&first, true)] {
        bench.install(next).unwrap();
        assert_eq!(bench.session().is_contact(&[30.0; 2]), is_contact);
    }
}

#[test]
fn a_model_is_decoded_from_ram_where_it_fits() {
    let blob = blob(3, 4);
    let words = blob.len().div_ceil(4);
    for (room, in_ram) in [(words, true), (words - 1, false)] {
        let mut bench = Bench::new(quiet(), &blob);
        bench.weights = vec![0; room];
        let mut host = bench.session();
        assert_eq!(host.model().unwrap().in_ram, in_ram);
        let frame = frame_at_rest();
        assert_eq!(host.decode(&frame).2, expected(&blob, &frame));
        assert_eq!(bytemuck::cast_slice::<u32, u8>(&bench.weights).starts_with(&blob), in_ram);
    }
}
