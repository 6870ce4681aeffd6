use taxel_core::blob::{Floats, Metadata, ModelParts, encode_to_vec};
use taxel_core::rbf::{Format, Shape};
use taxel_data::{Dataset, Purpose, Random, Silent, Stream};
use taxel_simulate::{Synthesis, World, synthesise};

use super::*;
use crate::train::train;
use crate::{Options, Origin, confidence, fill, pack, relative};

/// `readings` times a factor of each channel.
fn drifted(readings: &Table, gains: &[f64]) -> Table {
    let mut readings = readings.clone();
    let values = readings.values.iter_mut().zip(gains.iter().cycle());
    values.for_each(|(reading, gain)| *reading *= gain);
    readings
}

#[test]
fn two_hundred_presses_bring_every_format_within_3_percent_of_fresh_training() {
    let world = World { read_rows: vec![2, 3], ..World::press() };
    let [training, presses, test] =
        [(Stream::Training, 2000), (Stream::Calibration, 200), (Stream::Test, 1000)]
            .map(|(stream, frames)| synthesise(&world, stream, frames));
    // Baseline of before any drift: nobody could leave the sensor untouched since.
    let rest = Synthesis::new(&world).untouched().frames(Stream::Calibration, 100).inputs;
    let mut random = Random::new(1, Stream::Test, Purpose::Drift, 0, 0);
    let gains: Vec<f64> = (0..36).map(|_| random.between([0.9, 1.1])).collect();
    for (format, whole_array, relative_inputs) in [
        (Format::F32, false, false),
        (Format::Fixed16, false, false),
        (Format::Fixed16, true, false),
        (Format::F32, false, true),
    ] {
        let options = Options { format, each_row: !whole_array, centres: 32, ..Options::of_rows() };
        let model = |gains: &[f64]| {
            let mut seen = Dataset { inputs: drifted(&training.inputs, gains), ..training.clone() };
            if relative_inputs {
                seen = relative::dataset(seen, &rest.mean_line());
            }
            let trained = train(&seen, &options, &Silent).unwrap();
            pack(&trained, &seen, &Origin::of_data("press", 0, 1, &seen)).unwrap()
        };
        let baseline = rest.mean_line().values;
        let prepared = |blob: &'_ ModelBlob| {
            blob.prepare().with_baseline(&baseline).decode_table(&drifted(&test.inputs, &gains))
        };
        let z_error = |blob: &ModelBlob| {
            let squares = test.outputs.squared_errors(&prepared(blob).values);
            squares.iter().skip(2).step_by(3).sum::<f64>().sqrt()
        };
        let old = model(&[1.0; 36]);
        let readings = drifted(&presses.inputs, &gains);
        let recalibrated = old.prepare().with_baseline(&baseline);
        let found = recalibrate(&recalibrated, &readings, &presses.outputs).unwrap();
        assert_eq!((found.presses, found.networks), (200, if whole_array { 1 } else { 2 }));
        let (before, after, fresh) = (z_error(&old), z_error(&found.blob), z_error(&model(&gains)));
        assert!(before > 3.0 * fresh, "the drift must hurt");
        assert!(after <= 1.03 * fresh, "{format:?}: {after} for {fresh}");
        assert!(found.error_before > 3.0 && (0.9..1.1).contains(&found.error_after), "{found:?}");
    }
    // Without a drift no row is better by a tenth.
    let trained = train(&training, &Options::of_rows(), &Silent).unwrap();
    let blob = pack(&trained, &training, &Origin::of_data("press", 0, 1, &training)).unwrap();
    let same = recalibrate(&blob.prepare(), &presses.inputs, &presses.outputs);
    let refused = same.unwrap_err().to_string();
    assert!(refused.contains("no better model"), "{refused}");
}

fn first(presses: &Dataset, count: usize) -> Dataset {
    presses.subset(&(0..count).collect::<Vec<_>>())
}

/// Rows 4 and 5 of `press`, a model of them, and frames.
fn small(options: Options) -> (ModelBlob, Dataset) {
    let world = World { read_rows: vec![3, 4], ..World::press() };
    let seen = synthesise(&world, Stream::Training, 1500);
    let options = Options { centres: 12, ..options };
    let trained = train(&seen, &options, &Silent).unwrap();
    let blob = pack(&trained, &seen, &Origin::of_data("rows", 0, 1, &seen)).unwrap();
    (blob, synthesise(&world, Stream::Test, 400))
}

#[test]
fn slopes_of_a_smooth_network_are_differences_of_its_outputs() {
    let (blob, frames) = small(Options::of_rows());
    let smooth = Smooth::new(&blob.prepare().networks()[0]);
    let Shape { inputs, outputs, .. } = smooth.shape;
    for frame in 0..20 {
        let scale = smooth.zeros.iter().zip(&smooth.per_unit);
        let readings = frames.inputs.line(frame).iter().zip(scale);
        let x: Vec<f64> = readings.map(|(r, (zero, per_unit))| (r - zero) * per_unit).collect();
        let i = frame * 5 % inputs;
        let at = |step: f64| {
            let mut x = x.clone();
            x[i] += step;
            smooth.infer(&x, &mut [])
        };
        let mut slopes = vec![0.0; inputs * outputs];
        smooth.infer(&x, &mut slopes);
        for (o, (below, above)) in at(-1e-4).iter().zip(at(1e-4)).enumerate() {
            let (found, expected) = (slopes[o * inputs + i], (above - below) / 2e-4);
            assert!((found - expected).abs() <= 1e-6, "{found} for {expected}");
        }
    }
}

#[test]
fn errors_before_and_after_are_those_of_decoding_and_of_presses_that_no_fit_has_seen() {
    for (format, tolerance) in [(Format::F32, 1e-3), (Format::Fixed16, 3e-2)] {
        let (blob, frames) = small(Options { format, ..Options::of_rows() });
        let frames = first(&frames, 80);
        let model = blob.prepare();
        // Far beyond the clamp.
        let readings = drifted(&frames.inputs, &[1.3]);
        let inputs = model.inputs_of_networks(&readings.values).concat();
        let mut unit = Unit::new(0, &model, &inputs, &frames.outputs);
        assert_eq!(unit.numbers, (0..80).collect::<Vec<_>>());
        let decoded = model.decode_table(&readings);
        let none = vec![0.0; 18];
        for press in 0..80 {
            let errors = unit.in_errors(&decoded.line(press)[..18]);
            let expected = mean_square(&errors, &unit.stated[press]);
            let square = unit.square_decoded(&none, press);
            assert!((square / expected - 1.0).abs() < tolerance, "{format:?}: {square} {expected}");
        }
        // What the presses of a part state changes nothing of the network that judges them.
        let squares = unit.squares_after();
        let part: Vec<usize> = (0..80).step_by(PARTS).collect();
        unit.stated[0].iter_mut().for_each(|output| *output += 100.0);
        let again = unit.squares_after();
        assert!(again[0] > squares[0] + 1000.0);
        assert!(part[1..].iter().all(|press| again[*press] == squares[*press]), "{format:?}");
    }
}

#[test]
fn zeros_of_inputs_that_have_drifted_change_and_nothing_else() {
    for format in Format::ALL {
        let (blob, frames) = small(Options { format, ..Options::of_rows() });
        let frames = first(&frames, 80);
        let model = blob.prepare();
        // Row 5 has drifted; in row 4, a press misses a reading and another has a wild one.
        let mut readings = frames.inputs.clone();
        for line in readings.values.chunks_exact_mut(36) {
            line[18..].iter_mut().for_each(|reading| *reading *= 1.1);
        }
        readings.values[3] = f64::NAN;
        readings.values[36 + 3] = 1e5;
        let found = recalibrate(&model, &readings, &frames.outputs).unwrap();
        assert_eq!((found.presses, found.networks), (80, 2));
        let (old, new) = (blob.bytes(), found.blob.bytes());
        let words = |bytes: &[u8]| bytes.as_chunks::<4>().0.to_vec();
        let differs: Vec<usize> = words(old)
            .iter()
            .zip(words(new))
            .enumerate()
            .filter_map(|(place, (old, new))| (*old != new).then_some(place))
            .collect();
        assert_eq!((old.len(), differs.len()), (new.len(), 18 + 1), "{format:?}: {differs:?}");
        assert!(
            differs[..18].windows(2).all(|pair| pair[1] == pair[0] + 1),
            "one array, and the CRC"
        );
        let again = recalibrate(&model, &readings, &frames.outputs).unwrap();
        assert_eq!(again.blob.bytes(), new, "the same presses, the same bytes");
    }
}

#[test]
fn what_cannot_be_recalibrated_is_refused_by_name() {
    let (blob, frames) = small(Options::of_rows());
    let model = blob.prepare();
    let say = |outcome: Result<Recalibrated>| outcome.unwrap_err().to_string();
    let with = |count: usize, line: Option<usize>| {
        let lines: Vec<usize> = (0..count).map(|number| line.unwrap_or(number)).collect();
        let presses = frames.subset(&lines);
        say(recalibrate(&model, &presses.inputs, &presses.outputs))
    };
    assert!(with(17, None).contains("row 1 has seen too few presses"), "{}", with(17, None));
    assert!(with(80, Some(1)).contains("too alike"), "{}", with(80, Some(1)));
    // Outputs in another unit are no possible ones.
    let mut outputs = frames.outputs.clone();
    outputs.values.iter_mut().for_each(|output| *output *= 1e6);
    let said = say(recalibrate(&model, &frames.inputs, &outputs));
    assert!(said.contains("row 1 has seen too few"), "{said}");

    let shared = model.model().networks().next().unwrap();
    let parts = |networks: &[Network<'_>], row_network: &[u8], rmse: f32| {
        let bytes = [rmse, 0.0].map(|value| value.to_le_bytes().repeat(36));
        let [training_rmse, full_scale] = bytes.each_ref().map(|bytes| Floats(bytes));
        let metadata = Metadata { training_rmse, full_scale, ..*model.model().metadata() };
        let parts = ModelParts::new(networks, row_network, metadata);
        ModelBlob::of_bytes(&encode_to_vec(&parts).unwrap()).unwrap()
    };
    let settings = confidence::Settings { components: 2, ..Default::default() };
    let density = confidence::Density::fit(&frames, &settings);
    let mut held_out = confidence::HeldOut::default();
    held_out.add(&blob, &density, &frames);
    for (blob, says) in [
        (parts(&[shared], &[0, 0], 0.1), "share a network"),
        (parts(&model.model().networks().collect::<Vec<_>>(), &[0, 1], 0.0), "no training errors"),
        (confidence::add(&blob, &density, &held_out).unwrap(), "--confidence"),
        (fill::add(&blob, &frames.inputs).unwrap(), "--fill"),
    ] {
        let said = check(&blob.parse()).unwrap_err().to_string();
        assert!(said.contains(says), "{said}");
    }
}
