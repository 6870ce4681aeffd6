//! Trained models on the host and on a device.

use taxel_core::rbf::Format;
use taxel_core::{AlignedBytes, Decoder};
use taxel_data::{Silent, Stream};
use taxel_learn::train::train;
use taxel_learn::{Options, Origin, pack};
use taxel_simulate::{World, synthesise};

/// The device's entry point and the host's give the same bits, for models of each row and of the whole array.
#[test]
fn device_and_host_decode_alike() {
    let world = World { read_rows: vec![3, 4], ..World::press() };
    let dataset = synthesise(&world, Stream::Training, 400);
    let test = synthesise(&world, Stream::Test, 500);
    for (format, whole_array) in Format::ALL.into_iter().flat_map(|it| [(it, false), (it, true)]) {
        let options = Options { format, centres: 8, each_row: !whole_array, ..Options::of_rows() };
        let trained = train(&dataset, &options, &Silent).unwrap();
        let blob = pack(&trained, &dataset, &Origin::of_data("press", 0, 1, &dataset)).unwrap();
        let host = blob.prepare().decode_table(&test.inputs);
        let bytes = AlignedBytes::copy_of(blob.bytes());
        let decoder = Decoder::<2>::load(&bytes).unwrap();
        for (readings, expected) in test.inputs.lines().zip(host.lines()) {
            let frame: Vec<f32> = readings.iter().map(|reading| *reading as f32).collect();
            let estimate = decoder.decode(&frame[..]).unwrap();
            for (y, expected) in estimate.outputs.iter().zip(expected) {
                assert_eq!(f64::from(*y).to_bits(), expected.to_bits());
            }
        }
    }
}
