//! Host and emulator answer alike to the last bit: what the emulator's programs log, `cargo xtask
//! emulate` compares with the files beside them; what the host computes is compared with them here.

use std::fs;

use model_core::Aligned;
use model_core::blob::{
    Columns, Floats, Metadata, ModelParts, NoiseKind, encode, encoded_length_bound,
};
use model_core::exp::{ExpKernel, Libm, Micromath, Polynomial};
use model_core::rbf::direct::{self, Parameters};
use model_core::rbf::{Network, Shape};

#[path = "../qemu/src/checks.rs"]
mod checks;

use checks::{COLS, Numbers, OUTPUTS, ROWS};

const CENTRES: usize = 12;
const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/hand-made.bin");

/// Room for the model, at a multiple of four.
type Room = Aligned<[u8; 16384]>;

fn draw(numbers: &mut Numbers, count: usize, middle: f32, reach: f32) -> Vec<f32> {
    (0..count).map(|_| middle + reach * numbers.draw()).collect()
}

fn network(
    [minimum, per_span, centres, decay, weights, bias, affine]: &[Vec<f32>; 7],
) -> Network<'_> {
    let shape = Shape { inputs: COLS, centres: CENTRES, outputs: OUTPUTS };
    let parameters = Parameters {
        input_minimum: minimum,
        input_per_span: per_span,
        centres,
        decay,
        output_weights: weights,
        bias,
        affine,
    };
    direct::Network::try_new(shape, parameters).unwrap().into()
}

/// A model of the paper's shape: two networks, which the rows use in turn.
fn hand_made_model(room: &mut Room) -> &[u8] {
    let mut numbers = Numbers::new(0);
    let mut parameters = || {
        [
            draw(&mut numbers, COLS, 54.0, 1.0),
            draw(&mut numbers, COLS, 0.08, 0.01),
            draw(&mut numbers, CENTRES * COLS, 0.5, 0.5),
            draw(&mut numbers, CENTRES, 0.75, 0.5),
            draw(&mut numbers, CENTRES * OUTPUTS, 0.0, 1.0),
            draw(&mut numbers, OUTPUTS, 0.0, 1.0),
            draw(&mut numbers, COLS * OUTPUTS, 0.0, 0.1),
        ]
    };
    let (even, odd) = (parameters(), parameters());
    let (inputs, outputs) = (["x"; ROWS * COLS].join("\n"), ["y"; ROWS * OUTPUTS].join("\n"));
    let zeros = [0; ROWS * OUTPUTS * 4];
    let metadata = Metadata {
        name: "hand-made",
        scene_digest: 0,
        noise_kind: NoiseKind::None,
        noise_level: 0.0,
        seed: 0,
        training_frames: 0,
        thickness_mm: 5.0,
        input_names: Columns(&inputs),
        input_units: Columns(&inputs),
        output_names: Columns(&outputs),
        output_units: Columns(&outputs),
        training_rmse: Floats(&zeros),
        full_scale: Floats(&zeros),
    };
    let networks = [network(&even), network(&odd)];
    let row_network = [0, 1, 0, 1, 0, 1, 0, 1];
    let parts = ModelParts { networks: &networks, row_network: &row_network, metadata };
    assert!(encoded_length_bound(&parts) <= room.0.len());
    encode(&parts, &mut room.0).unwrap()
}

/// What the emulator logs, line by line.
fn expected_log(program: &str) -> String {
    let path = format!("{}/qemu/src/bin/{program}.out", env!("CARGO_MANIFEST_DIR"));
    fs::read_to_string(&path).unwrap_or_else(|cause| panic!("{path}: {cause}"))
}

fn decoding<E: ExpKernel>(blob: &[u8]) -> String {
    let crc = checks::decoding::<E>(blob).expect("the model loads");
    format!("INFO decoding with {}: {crc:08x}\n", E::NAME)
}

#[test]
fn the_model_in_testdata_is_the_one_made_here() {
    let committed = fs::read(MODEL).unwrap();
    let mut room = Aligned([0; _]);
    assert!(
        hand_made_model(&mut room) == committed,
        "changed on purpose? cargo test --package firmware --test bit_for_bit -- --ignored"
    );
}

#[test]
#[ignore = "writes testdata/hand-made.bin"]
fn write_the_model_in_testdata() {
    let mut room = Aligned([0; _]);
    fs::write(MODEL, hand_made_model(&mut room)).unwrap();
}

#[test]
fn every_kernel_decodes_on_the_host_as_in_the_emulator() {
    let mut room = Aligned([0; _]);
    let blob = hand_made_model(&mut room);
    let of_host =
        [decoding::<Polynomial>(blob), decoding::<Libm>(blob), decoding::<Micromath>(blob)];
    let end = "INFO within 4 KiB of RAM\nexit status 0\n";
    assert_eq!(of_host.concat() + end, expected_log("decode"));
}

#[test]
fn recursive_least_squares_learns_on_the_host_as_in_the_emulator() {
    let crc = checks::recalibration().expect("sound parameters");
    let of_host = format!("INFO recalibration: {crc:08x}\nexit status 0\n");
    assert_eq!(of_host, expected_log("rls"));
}
