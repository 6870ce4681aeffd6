//! Models with inputs relative to the baseline: what they take, and what cancels in it.

use taxel_core::blob::Model;
use taxel_data::{Dataset, Silent, Stream};
use taxel_learn::train::train;
use taxel_learn::{ModelBlob, Options, Origin, PreparedModel, pack, relative};
use taxel_simulate::{Synthesis, World};

const ROWS: usize = 2;
const READINGS: usize = ROWS * 18;

fn world() -> World {
    World { read_rows: vec![3, 4], ..World::press() }
}

fn frames(stream: Stream, frames: usize) -> Dataset {
    let world = world();
    let synthesis = Synthesis::new(&world);
    let readings = synthesis.frames(stream, frames);
    relative::dataset(readings, &synthesis.baselines(stream, frames, 100))
}

fn blob(options: Options) -> ModelBlob {
    let training = frames(Stream::Training, 1500);
    let trained = train(&training, &options, &Silent).unwrap();
    pack(&trained, &training, &Origin::of_data("relative", 0, 1, &training)).unwrap()
}

/// Readings in Ω, and a baseline of them.
fn readings_and_baseline() -> (Vec<f64>, Vec<f64>) {
    let world = world();
    let synthesis = Synthesis::new(&world);
    let readings = synthesis.frames(Stream::Test, 70).inputs.values;
    (readings, synthesis.baselines(Stream::Test, 1, 100).values)
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Outputs by taxel-core alone: its arithmetic of ratios, then its networks, line after line.
fn by_model_core(model: &Model<'_>, readings: &[f64], baseline: &[f64]) -> Vec<f64> {
    let mut all = Vec::new();
    for line in readings.chunks_exact(READINGS) {
        let pairs = line.iter().zip(baseline).map(|(r, b)| (*r as f32, *b as f32));
        let ratios: Vec<f32> = pairs.map(|(r, b)| r * (1.0_f32 / b)).collect();
        for (row, network) in model.networks().enumerate() {
            let (mut scaled, mut outputs) = ([0.0; 18], [0.0; 18]);
            let inputs = &ratios[row * 18..][..18];
            network.infer(inputs, &mut scaled, &mut outputs).unwrap();
            all.extend(outputs.map(f64::from));
        }
    }
    all
}

#[test]
fn readings_are_divided_as_model_core_does_before_everything_else() {
    let blob = blob(Options { centres: 16, ..Options::of_rows() });
    let model = blob.prepare();
    let metadata = model.model().metadata();
    assert!(metadata.relative_inputs);
    assert!(metadata.input_units.iter().all(str::is_empty));
    assert_eq!(metadata.input_units.iter().count(), READINGS);
    assert_eq!(metadata.input_names.iter().next(), Some("r4c1_ohm"));

    let (readings, baseline) = readings_and_baseline();
    let with_baseline = model.clone().with_baseline(&baseline);
    let outputs = with_baseline.decode_lines(&readings);
    assert_eq!(bits(&outputs), bits(&by_model_core(model.model(), &readings, &baseline)));
    assert_eq!(with_baseline.share_out_of_range(&readings), 0.0);
    // The same ratios, computed outside.
    let ratios = with_baseline.model_inputs(&readings);
    assert_eq!(bits(&outputs), bits(&model.of_inputs().decode_lines(&ratios)));
}

#[test]
fn a_channel_without_a_baseline_is_missing_and_no_baseline_leaves_nothing() {
    let rows = blob(Options { centres: 8, ..Options::of_rows() });
    let array = blob(Options { centres: 8, each_row: false, ..Options::of_rows() });
    let (readings, baseline) = readings_and_baseline();
    let missing = |model: &PreparedModel<'_>| -> Vec<bool> {
        let outputs = model.decode_lines(&readings);
        let of_frame = |output: usize| {
            let of_frames: Vec<bool> =
                outputs.iter().skip(output).step_by(READINGS).map(|v| v.is_nan()).collect();
            assert!(of_frames.iter().all(|missing| *missing == of_frames[0]));
            of_frames[0]
        };
        (0..READINGS).map(of_frame).collect()
    };
    let (rows, array) = (rows.prepare(), array.prepare());
    assert!(missing(&rows).iter().all(|missing| *missing));
    for unusable in [f64::NAN, 0.0, f64::INFINITY, 1e300, 1e-300] {
        let mut baseline = baseline.clone();
        baseline[20] = unusable; // of the second row
        let of_rows = missing(&rows.clone().with_baseline(&baseline));
        assert!(of_rows[..18].iter().all(|m| !m) && of_rows[18..].iter().all(|m| *m), "{unusable}");
        assert!(missing(&array.clone().with_baseline(&baseline)).iter().all(|missing| *missing));
    }
}
