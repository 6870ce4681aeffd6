//! The model in force: its identity, its shape, and the memory that it is decoded from.

use taxel_core::Decoder;
use taxel_core::blob::{Columns, Floats, Metadata, ModelShape};
use taxel_core::checksum::CRC_32;
use taxel_firmware::link::message::{
    Configuration, EstimateReport, ModelFault, Refusal, Report, Request, Setting,
};

use super::requests::{bits, decode, expected};
use crate::mock::*;

#[test]
fn the_identity_tells_what_the_model_was_trained_on() {
    let shape = ModelShape { rows: 1, inputs: 3, outputs: 2 };
    let plain = Metadata::unnamed(shape);
    let read = |metadata: Metadata<'static>| {
        let (mut session, board) = started(quiet(), &blob_of_a_row(shape, metadata));
        answer!(&mut session, &board, &Request::Identify, Report::Identity(identity) => {
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
    let long = "äöüßäöüßäöüßäöüßäöüßäöüß";
    let (name, _) = read(Metadata { name: long, ..plain });
    assert_eq!(name, &long[..40]);
    let (name, _) =
        read(Metadata { name: "xäöüßäöüßäöüßäöüßäöüßäöüß", ..plain });
    assert_eq!(name.len(), 39);
}

/// Reports on the first scan with the model in `blob`: readings, and then the estimate.
fn reports_on_a_scan(blob: &[u8]) -> Vec<(u16, String)> {
    let scanning = Configuration { frame_period_us: 1000, send_readings: true, ..quiet() };
    let (mut session, board) = started(scanning, blob);
    run_until(&mut session, &board, 1500);
    reports(&board.pins.borrow().to_host)
}

#[test]
fn the_model_says_which_cells_are_scanned_in_which_order_and_what_is_decoded() {
    let [first, second] = frame_at_rest();
    // Without names of wires, the first ones: a column and an output less; one network for all six readings.
    for (outputs, names, readings) in [
        (1, "a\nb", first[..2].to_vec()),
        (4, "x\nx\nx\nx\nx\nx", [first, second].concat()),
        // Cells that are not all between their wires, and another order.
        (2, "r2c1_ohm\nr2c2_ohm", second[..2].to_vec()),
        (1, "r1c3_ohm\nr2c1_ohm\nr1c2_ohm", vec![first[2], second[0], first[1]]),
    ] {
        let shape = ModelShape { rows: 1, inputs: readings.len(), outputs };
        let metadata = Metadata { input_names: Columns(names), ..Metadata::unnamed(shape) };
        let blob = blob_of_a_row(shape, metadata);
        let decoder = Decoder::<1>::load(&blob).unwrap();
        let outputs = decoder.decode(&readings[..]).unwrap().outputs;
        let all = reports_on_a_scan(&blob);
        let found = |debug: String| all.iter().any(|(_, text)| text.contains(&debug));
        assert!(found(format!("readings_ohm: {:?}", Floats::new(&readings))), "{names}: {all:?}");
        let row = format!("row_status: [0], outputs: {:?}", Floats::new(&outputs));
        assert!(found(row), "{names}: {all:?}");
    }
}

#[test]
fn a_model_that_does_not_fit_the_board_is_refused_and_not_put_in_force() {
    let old = blob(1, 3);
    let check = |blob: &[u8], fault: ModelFault| {
        let (mut session, board) = started(quiet(), blob);
        assert_eq!(model_crc(&mut session, &board), None, "{fault:?}");
        let mut device = Device::new(Flash::slots_with(&old));
        assert_eq!(device.install(blob), Err(Refusal::BadModel(fault)));
        assert_eq!(device.restart(), Some(crc_of(&old)));
    };
    for (inputs, outputs, names, fault) in [
        (2, 1, "r3c1_ohm\nr3c2_ohm", ModelFault::Wires),
        (2, 1, "r1c1_ohm\nrest", ModelFault::Wires),
        (7, 1, "", ModelFault::Shape),
        (3, 5, "", ModelFault::Shape),
    ] {
        let shape = ModelShape { rows: 1, inputs, outputs };
        let unnamed = Metadata::unnamed(shape);
        let input_names = if names.is_empty() { unnamed.input_names } else { Columns(names) };
        check(&blob_of_a_row(shape, Metadata { input_names, ..unnamed }), fault);
    }
    // Working space has room for 14 numbers: two for each feature.
    check(&blob_of_features(8), ModelFault::Shape);
    let few = blob_of_features(7);
    assert_eq!(Device::new(Flash::slots()).install(&few), Ok(confirmed(&few)));
}

#[test]
fn a_kept_baseline_is_that_of_its_wires_in_their_order() {
    let shape = ModelShape { rows: 1, inputs: 2, outputs: 1 };
    let [first, second] = ["r1c1_ohm\nr1c2_ohm", "r1c2_ohm\nr1c1_ohm"].map(|names| {
        blob_of_a_row(shape, Metadata { input_names: Columns(names), ..Metadata::unnamed(shape) })
    });
    let mut bench = Bench::new(quiet(), &first);
    let (mut session, board) = bench.session();
    let baseline = Request::SetBaseline { readings_ohm: Floats::new(&[60.0, 50.0]) };
    tell(&mut session, &board, &baseline);
    tell(&mut session, &board, &Request::Keep(Setting::Baseline));
    for (next, contact) in [(&second, 0), (&first, EstimateReport::CONTACT)] {
        bench.install(next).unwrap();
        let (mut session, board) = bench.session();
        let request =
            Request::Decode { frame: 1, start_us: 0, readings_ohm: Floats::new(&[30.0; 2]) };
        let flags = answer!(&mut session, &board, &request, Report::Estimate(it) => it.flags);
        assert_eq!(flags & EstimateReport::CONTACT, contact);
    }
}

#[test]
fn a_model_is_decoded_from_ram_where_it_fits() {
    let blob = blob(3, 4);
    let words = blob.len().div_ceil(4);
    for (room, in_ram) in [(words, true), (words - 1, false)] {
        let mut bench = Bench::new(quiet(), &blob);
        bench.weights = vec![0; room];
        let (mut session, board) = bench.session();
        assert_eq!(model(&mut session, &board).unwrap().in_ram, in_ram);
        let frame = frame_at_rest();
        let (_, _, found) = decode(&mut session, &board, &frame);
        assert_eq!(found, bits(expected(&blob, &frame).into_iter().flatten()));
        assert_eq!(bytemuck::cast_slice::<u32, u8>(&bench.weights).starts_with(&blob), in_ram);
    }
}
