//! Trained models on the host and on a device.

use taxel_core::rbf::Format;
use taxel_core::relative::reciprocal;
use taxel_core::{AlignedBytes, Decoder, Frame};
use taxel_data::{Silent, Stream};
use taxel_learn::train::train;
use taxel_learn::{Options, Origin, pack, relative};
use taxel_simulate::{Synthesis, World, synthesise};

/// The device's entry point and the host's give the same bits, for models of each row and of the whole array, of readings
/// and of ratios; and no outputs where readings or parts of the baseline are missing, or features overflow.
#[test]
fn device_and_host_decode_alike() {
    let world = World { read_rows: vec![3, 4], ..World::press() };
    let readings = synthesise(&world, Stream::Training, 400);
    let rest = Synthesis::new(&world).untouched().frames(Stream::Calibration, 100).inputs;
    let rest = rest.mean_line();
    let ratios = relative::dataset(readings.clone(), &rest);
    let mut test = synthesise(&world, Stream::Test, 900).inputs;
    let odd = [f64::NAN, 1e300, -3e38, f64::from(f32::MAX)];
    for (frame, line) in test.values.chunks_exact_mut(36).enumerate().take(800) {
        let some = if frame % 3 == 0 { 0..36 } else { frame % 36..frame % 36 + 1 };
        line[some].fill(odd[frame % 4]);
    }
    for (format, whole_array) in Format::ALL.into_iter().flat_map(|it| [(it, false), (it, true)]) {
        for (dataset, missing) in
            [(&readings, f64::NAN), (&ratios, rest.values[20]), (&ratios, f64::NAN), (&ratios, 0.0)]
        {
            let options =
                Options { format, centres: 8, each_row: !whole_array, ..Options::of_rows() };
            let trained = train(dataset, &options, &Silent).unwrap();
            let blob = pack(&trained, dataset, &Origin::of_data("press", 0, 1, dataset)).unwrap();
            let mut baseline = rest.values.clone();
            baseline[20] = missing;
            let host = blob.prepare().with_baseline(&baseline).decode_table(&test);
            let bytes = AlignedBytes::copy_of(blob.bytes());
            let decoder = Decoder::<2>::load(&bytes).unwrap();
            let reciprocals: Vec<f32> = baseline.iter().map(|it| reciprocal(*it as f32)).collect();
            let mut decoded = [0; 2];
            for (line, expected) in test.lines().zip(host.lines()) {
                let line: Vec<f32> = line.iter().map(|reading| *reading as f32).collect();
                let frame = Frame { readings_ohm: &line, reciprocals: &reciprocals };
                let outputs = decoder.decode(frame).unwrap().outputs;
                for (y, expected) in outputs.iter().zip(expected) {
                    let is_same = f64::from(*y).to_bits() == expected.to_bits();
                    assert!(is_same || y.is_nan() && expected.is_nan(), "{y} {expected}");
                }
                decoded[0] += usize::from(outputs[0].is_finite());
                decoded[1] += usize::from(outputs[35].is_finite());
            }
            // The baseline is missing in the second row.
            let [first, second] = decoded.map(|count| count > 50);
            let is_unknown = dataset.relative_inputs && reciprocal(missing as f32).is_nan();
            assert_eq!((first, second), (!(whole_array && is_unknown), !is_unknown), "{decoded:?}");
        }
    }
}
