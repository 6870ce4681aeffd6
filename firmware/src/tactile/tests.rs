use model_core::blob::{
    Columns, DecodeError, Floats, Metadata, ModelParts, NoiseKind, encode, encoded_length_bound,
};
use model_core::exp::{ExpKernel, Libm, Micromath, Polynomial};
use model_core::rbf::direct::{self, Parameters};
use model_core::rbf::{Network, Shape};
use model_core::{Decoder, Frame, RowStatus};

use super::{PaperSensor, Tactile};
use crate::store::blob_in_slot;

const ROWS: usize = 8;
const COLS: usize = 18;
const OUTPUTS: usize = 18;
const CENTRES: usize = 5;

/// Bytes at an address that is a multiple of four, however many.
struct AlignedBytes {
    words: Vec<u32>,
    length: usize,
}

impl AlignedBytes {
    fn filled(length: usize, value: u8) -> Self {
        Self { words: vec![u32::from_ne_bytes([value; 4]); length.div_ceil(4)], length }
    }

    fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.length]
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        &mut bytemuck::cast_slice_mut(&mut self.words)[..self.length]
    }

    fn copy_of(bytes: &[u8]) -> Self {
        let mut copy = Self::filled(bytes.len(), 0);
        copy.bytes_mut().copy_from_slice(bytes);
        copy
    }
}

/// Hand-made numbers that differ from place to place, in [−1, 1].
fn spread_out(seed: usize, count: usize) -> Vec<f32> {
    (0..count).map(|i| (((i * 37 + seed * 11) % 101) as f32 - 50.0) / 50.0).collect()
}

/// The parameters of one network of the paper's shape.
struct Numbers {
    minimum: Vec<f32>,
    per_span: Vec<f32>,
    centres: Vec<f32>,
    weights: Vec<f32>,
    bias: Vec<f32>,
    affine: Vec<f32>,
}

impl Numbers {
    fn new(seed: usize) -> Self {
        Self {
            minimum: spread_out(seed, COLS).iter().map(|v| 55.0 + v).collect(),
            per_span: vec![0.1; COLS],
            centres: spread_out(seed + 1, CENTRES * COLS).iter().map(|v| 0.5 + v / 2.0).collect(),
            weights: spread_out(seed + 2, CENTRES * OUTPUTS),
            bias: spread_out(seed + 3, OUTPUTS),
            affine: spread_out(seed + 4, COLS * OUTPUTS),
        }
    }

    fn network(&self) -> Network<'_> {
        let parameters = Parameters {
            input_minimum: &self.minimum,
            input_per_span: &self.per_span,
            centres: &self.centres,
            decay: &[0.75],
            output_weights: &self.weights,
            bias: &self.bias,
            affine: &self.affine,
        };
        let shape = Shape { inputs: COLS, centres: CENTRES, outputs: OUTPUTS };
        direct::Network::try_new(shape, parameters).unwrap().into()
    }
}

/// Two networks that the rows use in turn.
fn blob(seed: usize, rows: usize) -> AlignedBytes {
    let (even, odd) = (Numbers::new(seed), Numbers::new(seed + 50));
    let names = |count: usize| vec!["x"; rows * count].join("\n");
    let (inputs, outputs) = (names(COLS), names(OUTPUTS));
    let zeros = vec![0; rows * OUTPUTS * 4];
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
    let row_network: Vec<u8> = (0..rows).map(|row| (row % 2) as u8).collect();
    let parts = ModelParts {
        projection: None,
        networks: &[even.network(), odd.network()],
        row_network: &row_network,
        metadata,
    };
    let mut buffer = AlignedBytes::filled(encoded_length_bound(&parts), 0);
    AlignedBytes::copy_of(encode(&parts, buffer.bytes_mut()).unwrap())
}

fn frame() -> Frame<ROWS, COLS> {
    let mut frame = Frame::missing();
    let readings = spread_out(9, ROWS * COLS);
    let places = frame.row_column_resistance_ohm.as_flattened_mut();
    places.iter_mut().zip(readings).for_each(|(place, v)| *place = 60.0 + 4.0 * v);
    frame
}

fn bits(outputs: &[[f32; OUTPUTS]; ROWS]) -> Vec<u32> {
    outputs.as_flattened().iter().map(|v| v.to_bits()).collect()
}

/// What the networks themselves answer, through the interface with sizes known when it runs.
fn inferred<E: ExpKernel>(seed: usize, frame: &Frame<ROWS, COLS>) -> [[f32; OUTPUTS]; ROWS] {
    let numbers = [Numbers::new(seed), Numbers::new(seed + 50)];
    let mut outputs = [[0.0; OUTPUTS]; ROWS];
    for (row, output) in outputs.iter_mut().enumerate() {
        let reading = &frame.row_column_resistance_ohm[row];
        let network = numbers[row % 2].network();
        network.infer::<E>(reading, &mut [0.0; COLS], output).unwrap();
    }
    outputs
}

fn decodes_as_model_core<E: ExpKernel>() {
    let blob = blob(1, ROWS);
    let frame = frame();
    let sensor = PaperSensor::<E>::load(blob.bytes()).unwrap();
    let decoder = Decoder::<ROWS, COLS, OUTPUTS, E>::load(blob.bytes()).unwrap();

    let estimate = sensor.decode(&frame);

    assert_eq!(estimate.status, [RowStatus::Decoded; ROWS]);
    assert_eq!(bits(&estimate.outputs), bits(&decoder.decode(&frame).outputs), "{}", E::NAME);
    assert_eq!(bits(&estimate.outputs), bits(&inferred::<E>(1, &frame)), "{}", E::NAME);
    assert_eq!(sensor.model_crc(), decoder.model_crc());
    assert_eq!(sensor.metadata().name, "hand-made");
}

#[test]
fn it_decodes_bit_for_bit_as_model_core_does_with_every_kernel() {
    decodes_as_model_core::<Polynomial>();
    decodes_as_model_core::<Libm>();
    decodes_as_model_core::<Micromath>();
}

#[test]
fn a_sound_blob_takes_over_from_the_next_frame_on() {
    let (first, second) = (blob(1, ROWS), blob(2, ROWS));
    let frame = frame();
    let mut sensor: PaperSensor = Tactile::load(first.bytes()).unwrap();
    let before = sensor.model_crc();

    sensor.replace(second.bytes()).unwrap();

    assert_ne!(sensor.model_crc(), before);
    let expected = inferred::<Polynomial>(2, &frame);
    assert_eq!(bits(&sensor.decode(&frame).outputs), bits(&expected));
}

#[test]
fn a_refused_blob_leaves_the_previous_model_in_force() {
    let in_force = blob(1, ROWS);
    let frame = frame();
    let mut sensor: PaperSensor = Tactile::load(in_force.bytes()).unwrap();
    let (crc, outputs) = (sensor.model_crc(), bits(&sensor.decode(&frame).outputs));

    let sound = blob(2, ROWS);
    let mut corrupt = AlignedBytes::copy_of(sound.bytes());
    corrupt.bytes_mut()[sound.length / 2] ^= 0x10;
    let mut newer = AlignedBytes::copy_of(sound.bytes());
    newer.bytes_mut()[4] += 1;
    let seven_rows = blob(2, ROWS - 1);
    let erased = AlignedBytes::filled(sound.length, 0xFF);
    let mut shifted = AlignedBytes::filled(sound.length + 1, 0);
    shifted.bytes_mut()[1..].copy_from_slice(sound.bytes());

    for (refused, name) in [
        (corrupt.bytes(), "Corrupt"),
        (&sound.bytes()[..sound.length - 1], "Truncated"),
        (&sound.bytes()[..0], "Truncated"),
        (newer.bytes(), "UnsupportedVersion"),
        (seven_rows.bytes(), "ShapeMismatch"),
        (erased.bytes(), "BadMagic"),
        (&shifted.bytes()[1..], "Misaligned"),
    ] {
        let error = sensor.replace(refused).unwrap_err();
        assert!(format!("{error:?}").starts_with(name), "{error:?} instead of {name}");
        assert_eq!(sensor.model_crc(), crc, "{name}");
        assert_eq!(bits(&sensor.decode(&frame).outputs), outputs, "{name}");
    }
}

#[test]
fn no_sensor_starts_without_a_sound_model() {
    let seven_rows = blob(1, ROWS - 1);
    let error = PaperSensor::<Polynomial>::load(seven_rows.bytes()).unwrap_err();
    assert!(matches!(error, DecodeError::ShapeMismatch { .. }));
}

#[test]
fn a_blob_loads_from_a_larger_erased_flash_slot() {
    let blob = blob(1, ROWS);
    let mut slot = AlignedBytes::filled(128 * 1024, 0xFF);
    slot.bytes_mut()[..blob.length].copy_from_slice(blob.bytes());

    assert_eq!(blob_in_slot(slot.bytes()), blob.bytes());
    let sensor: PaperSensor = Tactile::load(blob_in_slot(slot.bytes())).unwrap();
    assert_eq!(bits(&sensor.decode(&frame()).outputs), bits(&inferred::<Polynomial>(1, &frame())));

    // The slot as a whole is not a blob.
    let error = PaperSensor::<Polynomial>::load(slot.bytes()).unwrap_err();
    assert_eq!(error, DecodeError::TrailingBytes { extra: slot.length - blob.length });
}

#[test]
fn a_slot_without_a_whole_blob_tells_why() {
    let blob = blob(1, ROWS);
    let erased = AlignedBytes::filled(4096, 0xFF);
    let cut = &blob.bytes()[..4096];

    let load = |slot| PaperSensor::<Polynomial>::load(blob_in_slot(slot)).unwrap_err();

    assert_eq!(load(erased.bytes()), DecodeError::BadMagic);
    assert_eq!(load(cut), DecodeError::Truncated { expected: blob.length, found: 4096 });
}
