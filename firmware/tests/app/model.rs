//! The model in force: its identity, its shape, and the memory that it is decoded from.

use taxel_core::blob::{Columns, Floats, Metadata, Model, ModelParts, ModelShape, encode_to_vec};
use taxel_core::checksum::CRC_32;
use taxel_core::{AlignedBytes, Decoder};
use taxel_firmware::app::Session;
use taxel_firmware::link::message::{
    Configuration, EstimateReport, ModelFault, Refusal, Report, Request, Setting,
};

use super::requests::{bits, decode, expected};
use crate::mock::*;

#[test]
fn the_identity_tells_what_the_model_was_trained_on() {
    let network = |metadata: Metadata<'static>| {
        let network = blob_of_one_row(3, 2);
        let model = Model::decode(&network).unwrap();
        let networks: Vec<_> = model.networks().collect();
        let parts = ModelParts::new(&networks, &[0], metadata);
        encode_to_vec(&parts).unwrap()
    };
    let plain = Metadata::unnamed(ModelShape { rows: 1, inputs: 3, outputs: 2 });
    let read = |metadata: Metadata<'static>| {
        let (mut session, board) = started(quiet(), &network(metadata));
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

/// A blob for one row of `inputs` readings and `outputs` outputs.
fn blob_of_one_row(inputs: usize, outputs: usize) -> AlignedBytes {
    let shape = ModelShape { rows: 1, inputs, outputs };
    blob_of_a_row(shape, Metadata::unnamed(shape))
}

/// Reports on the first scan with the model in `blob`: readings, and then the estimate.
fn reports_on_a_scan(blob: &[u8]) -> Vec<(u16, String)> {
    let scanning = Configuration { frame_period_us: 1000, send_readings: true, ..quiet() };
    let (mut slots, mut bench) = (Flash::slots_with(blob), Bench::new(scanning));
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    run_until(&mut session, &bench.board, 1500);
    reports(&bench.board.pins.borrow().to_host)
}

#[test]
fn the_model_says_what_is_scanned_and_decoded() {
    let rest = frame_at_rest();
    // A column and an output less; one network for all six readings; one output of one row.
    for (inputs, outputs, wires) in [(2, 1, 2), (6, 4, 6), (3, 2, 3), (1, 1, 1)] {
        let blob = blob_of_one_row(inputs, outputs);
        let readings = &rest.as_flattened()[..wires];
        let decoder = Decoder::<1>::load(&blob).unwrap();
        let outputs = decoder.decode(readings).unwrap().outputs;
        let all = reports_on_a_scan(&blob);
        let found = |debug: String| all.iter().any(|(_, text)| text.contains(&debug));
        assert!(found(format!("readings_ohm: {:?}", Floats::new(readings))), "{all:?}");
        let row = format!("row_status: [0], outputs: {:?}", Floats::new(&outputs));
        assert!(found(row), "{all:?}");
    }
}

#[test]
fn the_names_of_readings_say_which_cells_are_scanned_and_in_which_order() {
    let shape = ModelShape { rows: 1, inputs: 2, outputs: 1 };
    let [first, second] = frame_at_rest();
    for (names, readings) in [
        ("r1c1_ohm\nr1c2_ohm", first[..2].to_vec()),
        ("r2c1_ohm\nr2c2_ohm", second[..2].to_vec()),
        ("a\nb", first[..2].to_vec()),
        // One row of the model with the readings of both row-wires, in the other order.
        ("r2c1_ohm\nr2c2_ohm\nr2c3_ohm\nr1c1_ohm\nr1c2_ohm\nr1c3_ohm", [second, first].concat()),
        // Some columns, another order, and cells that are not all between their wires.
        ("r1c2_ohm\nr1c3_ohm\nr2c2_ohm\nr2c3_ohm", [&first[1..], &second[1..]].concat()),
        ("r2c3_ohm\nr2c1_ohm", vec![second[2], second[0]]),
        ("r1c3_ohm\nr2c1_ohm\nr1c2_ohm", vec![first[2], second[0], first[1]]),
        ("r2c2_ohm", vec![second[1]]),
    ] {
        let shape = ModelShape { inputs: readings.len(), ..shape };
        let metadata = Metadata { input_names: Columns(names), ..Metadata::unnamed(shape) };
        let all = reports_on_a_scan(&blob_of_a_row(shape, metadata));
        let expected = format!("readings_ohm: {:?}", Floats::new(&readings));
        assert!(all[0].1.contains(&expected), "{names}: {all:?}");
    }
}

#[test]
fn a_model_of_wires_that_the_board_lacks_is_refused_and_not_put_in_force() {
    let shape = ModelShape { rows: 1, inputs: 2, outputs: 1 };
    for names in
        ["r3c1_ohm\nr3c2_ohm", "r1c1_ohm\nr1c4_ohm", "r1c1_ohm\nrest", "r0c1_ohm\nr1c1_ohm"]
    {
        let metadata = Metadata { input_names: Columns(names), ..Metadata::unnamed(shape) };
        let blob = blob_of_a_row(shape, metadata);
        let mut slots = Flash::slots_with(&blob);
        let mut bench = Bench::new(quiet());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        assert_eq!(model_crc(&mut session, &bench.board), None, "{names}");
        let mut slots = Flash::slots_with(&[]);
        let refused = upload(&mut bench, &mut slots, &mut [], &upload_steps(&blob, 64));
        assert_eq!(refused, Err(Refusal::BadModel(ModelFault::Wires)), "{names}");
    }
}

#[test]
fn a_kept_baseline_is_that_of_its_wires_in_their_order() {
    let shape = ModelShape { rows: 1, inputs: 2, outputs: 1 };
    let [first, second] = ["r1c1_ohm\nr1c2_ohm", "r1c2_ohm\nr1c1_ohm"].map(|names| {
        blob_of_a_row(shape, Metadata { input_names: Columns(names), ..Metadata::unnamed(shape) })
    });
    let mut slots = Flash::slots_with(&first);
    let mut bench = Bench::new(quiet());
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let baseline = Request::SetBaseline { readings_ohm: Floats::new(&[60.0, 50.0]) };
    tell(&mut session, &board, &baseline);
    tell(&mut session, &board, &Request::Keep(Setting::Baseline));
    for (next, contact) in [(&second, 0), (&first, EstimateReport::CONTACT)] {
        install(&mut bench, &mut slots, &mut [], (next, 64)).unwrap();
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        let request =
            Request::Decode { frame: 1, start_us: 0, readings_ohm: Floats::new(&[30.0; 2]) };
        let flags = answer!(&mut session, &board, &request, Report::Estimate(it) => it.flags);
        assert_eq!(flags & EstimateReport::CONTACT, contact);
    }
}

#[test]
fn a_model_without_room_is_not_put_in_force() {
    for (inputs, outputs) in [(4, 1), (7, 1), (3, 5)] {
        let (mut session, board) = started(quiet(), &blob_of_one_row(inputs, outputs));
        assert_eq!(model_crc(&mut session, &board), None, "{inputs} {outputs}");
    }
}

#[test]
fn a_model_is_decoded_from_ram_where_it_fits() {
    let blob = blob(3, 4);
    let words = blob.len().div_ceil(4);
    for (room, in_ram) in [(words, true), (words - 1, false)] {
        let mut slots = Flash::slots_with(&blob);
        let mut weights = vec![0; room];
        let mut bench = Bench::new(quiet());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut weights);
        assert_eq!(model(&mut session, &bench.board).unwrap().in_ram, in_ram);
        let frame = frame_at_rest();
        let (_, _, found) = decode(&mut session, &bench.board, &frame);
        assert_eq!(found, bits(expected(&blob, &frame).into_iter().flatten()));
        assert_eq!(bytemuck::cast_slice::<u32, u8>(&weights).starts_with(&blob), in_ram);
    }
}

#[test]
fn behind_a_damaged_model_the_other_slots_is_decoded_from_there() {
    let (first, second) = (blob(3, 4), blob(5, 4));
    let mut slots = Flash::slots_with(&first);
    let mut weights = vec![0; second.len().div_ceil(4)];
    let mut bench = Bench::new(quiet());
    install(&mut bench, &mut slots, &mut weights, (&second, 64)).unwrap();
    let mut in_force = |slots: &mut [Flash; 2]| {
        let mut session = Session::start(&mut bench.app, slots, &mut weights);
        let frame = frame_at_rest();
        let (_, _, found) = decode(&mut session, &bench.board, &frame);
        (model(&mut session, &bench.board).map(|model| (model.slot, model.in_ram)), found)
    };
    let outputs = |blob: &[u8]| bits(expected(blob, &frame_at_rest()).into_iter().flatten());
    assert_eq!(in_force(&mut slots), (Some((1, true)), outputs(&second)));
    slots[1].decay(second.len() / 8, 1);
    assert_eq!(in_force(&mut slots), (Some((0, false)), outputs(&first)));
}
