//! Reading models: what they fill, deviations and novelty.

mod mixture;

use std::sync::OnceLock;

use taxel_core::Decoder;
use taxel_data::{Dataset, Purpose, Random, Silent, Stream, Table};
use taxel_learn::reading_model::{Extent, HeldOut, Statistics, add, check, quantile};
use taxel_learn::train::train;
use taxel_learn::{ModelBlob, Options, Origin, Result, pack, relative};
use taxel_simulate::{World, synthesise};

/// The model of `blob` with a reading model.
fn fitted(world: &World, training: &Dataset, blob: &ModelBlob) -> ModelBlob {
    let statistics = Statistics::fit(&training.inputs, Extent::Full, 1).unwrap();
    let mut held_out = HeldOut::default();
    held_out.add(blob, &statistics, &synthesise(world, Stream::Calibration, 4000));
    add(blob, &statistics, &held_out).unwrap()
}

/// A model of row 4 without a reading model and with one, and what it was fitted to.
fn row_4() -> &'static (World, Dataset, ModelBlob, ModelBlob) {
    static FITTED: OnceLock<(World, Dataset, ModelBlob, ModelBlob)> = OnceLock::new();
    FITTED.get_or_init(|| {
        let world = World { read_rows: vec![3], ..World::press() };
        let training = synthesise(&world, Stream::Training, 4000);
        let options = Options { centres: 16, ..Options::of_rows() };
        let trained = train(&training, &options, &Silent).unwrap();
        let blob = pack(&trained, &training, &Origin::of_data("row 4", 0, 1, &training)).unwrap();
        let with = fitted(&world, &training, &blob);
        (world, training, blob, with)
    })
}

#[test]
fn intervals_cover_the_errors_of_frames_not_used_for_fitting() {
    let (world, _, _, blob) = row_4();
    let test = synthesise(world, Stream::Test, 4000);
    let model = blob.prepare();
    let decoded = model.decode_table(&test.inputs).values;
    let (deviations, novelty) = model.assess(&test.inputs.values).unwrap();
    let ratios = blob.parse().reading_model().unwrap().ratios_95();
    for (output, ratio) in ratios.iter().enumerate() {
        let share = |ratio: f64| {
            let within = (output..decoded.len()).step_by(18).filter(|at| {
                (decoded[*at] - test.outputs.values[*at]).abs() <= ratio * deviations[*at]
            });
            within.count() as f64 / 4000.0
        };
        let (one, most) = (share(1.0), share(f64::from(*ratio)));
        // Four standard errors of a share of so many frames.
        assert!((one - 0.6827).abs() < 0.03 && (most - 0.95).abs() < 0.014, "{one} {most}");
    }
    let alarms = novelty.iter().filter(|novelty| **novelty > 0.0).count() as f64 / 4000.0;
    assert!(alarms < 0.01, "{alarms}");
    // Errors grow with the dent, and deviations tell so: those of the first electrode's z differ by far.
    let mut of_first: Vec<f64> = deviations.iter().copied().skip(2).step_by(18).collect();
    of_first.sort_by(f64::total_cmp);
    assert!(of_first[3600] > 3.0 * of_first[400], "{} {}", of_first[400], of_first[3600]);
}

#[test]
fn frames_that_the_sensor_cannot_give_are_novel() {
    let (world, _, _, blob) = row_4();
    let mut frames = synthesise(world, Stream::Test, 500).inputs.values;
    for frame in frames.chunks_exact_mut(18) {
        // Two neighbouring column-wires are one.
        let both = 1.0 / (1.0 / frame[7] + 1.0 / frame[8]);
        frame[7..9].fill(both);
    }
    let (_, novelty) = blob.prepare().assess(&frames).unwrap();
    assert!(novelty.iter().all(|novelty| *novelty > 10.0));
}

#[test]
fn a_reading_model_changes_no_estimate_and_devices_agree() {
    let (world, training, without, with) = row_4();
    let test = synthesise(world, Stream::Test, 50);
    let prepared = with.prepare();
    let decoded = |blob: &ModelBlob| blob.prepare().decode_table(&test.inputs).values;
    assert_eq!(decoded(with), decoded(without));
    let (deviations, novelty) = prepared.assess(&test.inputs.values).unwrap();
    let decoder = Decoder::<1>::load(with.bytes()).unwrap();
    let mut scratch = vec![0.0; decoder.scratch_floats()];
    for (frame, line) in test.inputs.lines().enumerate() {
        let readings: Vec<f32> = line.iter().map(|reading| *reading as f32).collect();
        let mut deviation = [0.0; 18];
        let found = decoder.assess_into((&readings[..]).into(), &mut scratch, &mut deviation);
        assert_eq!(found.unwrap().map(f64::from), Some(novelty[frame]));
        assert_eq!(deviation.map(f64::from), deviations[frame * 18..][..18]);
    }
    // Fitting again gives the same bytes.
    assert_eq!(fitted(world, training, without).bytes(), with.bytes());
}

/// A model of measured data without noise on its one output, with a reading model calibrated on the second half of the
/// lines; tells the share of these that it finds novel.
fn share_novel(readings: usize, reading: impl Fn(usize, usize) -> f64) -> f64 {
    let names = |kind: &str, count: usize| (0..count).map(|i| format!("{kind}{i}")).collect();
    let half = |first: usize| {
        let mut dataset = Dataset::empty(names("in", readings), names("out", 2), 1, 2000);
        for (frame, line) in dataset.inputs.values.chunks_exact_mut(readings).enumerate() {
            line.iter_mut().enumerate().for_each(|(i, place)| *place = reading(first + frame, i));
        }
        let first_readings = dataset.inputs.values.iter().step_by(readings);
        for (line, r) in dataset.outputs.values.chunks_exact_mut(2).zip(first_readings) {
            line[0] = (0.1 * r).sin();
        }
        dataset
    };
    let (seen, others) = (half(0), half(2000));
    let options = Options { centres: 4, ..Options::of_rows() };
    let trained = train(&seen, &options, &Silent).unwrap();
    let blob = pack(&trained, &seen, &Origin::of_data("data", 0, 1, &seen)).unwrap();
    let statistics = Statistics::fit(&seen.inputs, Extent::Full, 1).unwrap();
    let mut held_out = HeldOut::default();
    held_out.add(&blob, &statistics, &others);
    let blob = add(&blob, &statistics, &held_out).unwrap();
    let model = blob.prepare();
    let (deviations, novelty) = model.assess(&others.inputs.values).unwrap();
    assert!(deviations.iter().all(|d| d.is_finite()) && novelty.iter().all(|n| n.is_finite()));
    novelty.iter().filter(|novelty| **novelty > 0.0).count() as f64 / 2000.0
}

#[test]
fn novelty_holds_where_factors_leave_nothing_but_rounding() {
    let normal = |frame: usize, i: usize| {
        Random::new(5, Stream::Training, Purpose::Noise, frame as u64, i as u64).normal()
    };
    let check = |readings: usize, reading: &dyn Fn(usize, usize) -> f64| {
        let share = share_novel(readings, reading);
        assert!(share < 0.01, "{readings} readings: {share}");
    };
    check(1, &|frame, i| 60.0 + normal(frame, i));
    check(3, &|frame, i| [1e4 + normal(frame, 0), 1e4 + normal(frame, 1), 7.0][i]);
    check(8, &|frame, i| 60.0 + normal(frame, i));
    check(12, &|frame, i| 60.0 + normal(frame, i));
    // Four sums, without noise, in all readings.
    check(12, &|frame, i| 1e4 + normal(frame, i % 4) + 0.5 * normal(frame, (i + 1) % 4));
}

#[test]
fn a_quantile_of_few_values_covers_its_share() {
    let of = |share| quantile(&mut [3.0, 1.0, 2.0], share);
    assert_eq!([of(0.1), of(0.34), of(0.5), of(0.67), of(1.0)], [1.0, 2.0, 2.0, 3.0, 3.0]);
    assert_eq!(quantile(&mut [], 0.5), 0.0);
}

#[test]
fn deviations_of_an_output_are_those_of_the_frames_that_have_it() {
    let (world, training, blob, _) = row_4();
    let statistics = Statistics::fit(&training.inputs, Extent::Full, 1).unwrap();
    let calibration = synthesise(world, Stream::Calibration, 4000);
    let mut partly = calibration.clone();
    partly.outputs.values.iter_mut().step_by(36).for_each(|value| *value = f64::NAN);
    let deviations = |calibration: &Dataset| {
        let mut held_out = HeldOut::default();
        held_out.add(blob, &statistics, calibration);
        let with = add(blob, &statistics, &held_out).unwrap();
        with.prepare().assess(&training.inputs.values).unwrap().0
    };
    let (all, partly) = (deviations(&calibration), deviations(&partly));
    for (place, (all, partly)) in all.iter().zip(&partly).enumerate() {
        // Half of the frames have the first output.
        let most = if place % 18 == 0 { 0.25 } else { 0.0 };
        assert!((partly / all - 1.0).abs() <= most, "{place}: {partly} {all}");
    }
}

/// Model of two rows that fills missing readings, and frames that it was not trained on.
fn model() -> &'static (ModelBlob, Table) {
    static MODEL: OnceLock<(ModelBlob, Table)> = OnceLock::new();
    MODEL.get_or_init(|| {
        let world = World { read_rows: vec![3, 4], ..World::press() };
        let frames = synthesise(&world, Stream::Training, 1500);
        let options = Options { centres: 8, ..Options::of_rows() };
        let trained = train(&frames, &options, &Silent).unwrap();
        let blob = pack(&trained, &frames, &Origin::of_data("rows", 0, 1, &frames)).unwrap();
        let statistics = Statistics::fit(&frames.inputs, Extent::Fill, 1).unwrap();
        let blob = add(&blob, &statistics, &HeldOut::default()).unwrap();
        (blob, synthesise(&world, Stream::Test, 400).inputs)
    })
}

#[test]
fn filled_readings_are_as_near_as_noise_lets_them_be() {
    let (blob, fresh) = model();
    let model = blob.prepare();
    let deviations = fresh.deviations();
    for missing in [vec![4], (0..36).step_by(18).map(|row| row + 9).collect::<Vec<_>>()] {
        let mut faulty = fresh.clone();
        for line in faulty.values.chunks_exact_mut(36) {
            missing.iter().for_each(|at| line[*at] = f64::NAN);
        }
        let (filled, counts) = model.filled(&faulty.values, None).unwrap();
        assert!(counts.iter().all(|count| *count == missing.len()));
        let errors = filled.iter().zip(fresh.values.iter()).enumerate();
        for at in &missing {
            let of = errors.clone().skip(*at).step_by(36).map(|(_, (a, b))| (a - b).powi(2));
            let error = (of.sum::<f64>() / fresh.len() as f64).sqrt();
            // The noise alone is 0.5 % of 57 Ω, which is 0.29 Ω; the mean would be off by the deviation.
            assert!((0.2..0.4).contains(&error), "{at}: {error} Ω");
            assert!(error < 0.7 * deviations[*at], "{at}: {error} Ω of {}", deviations[*at]);
        }
        let untouched = filled.iter().zip(faulty.values.iter()).filter(|(_, b)| !b.is_nan());
        untouched.for_each(|(a, b)| assert_eq!(a.to_bits(), b.to_bits()));
    }
    // A row is half of the readings: too much.
    let mut faulty = fresh.clone();
    faulty.values.chunks_exact_mut(36).for_each(|line| line[..18].fill(f64::NAN));
    let (_, counts) = model.filled(&faulty.values, None).unwrap();
    assert!(counts.iter().all(|count| *count == 0));
}

#[test]
fn readings_that_are_too_few_or_no_numbers_are_refused_by_name() {
    let says = |refused: Result<()>| refused.unwrap_err().to_string();
    assert!(says(check(359, 36)).contains("frames = 359: a reading model needs at least 360"));
    assert!(check(360, 36).is_ok() && check(20, 1).is_ok() && check(19, 1).is_err());
    let mut bad = model().1.clone();
    bad.values[0] = f64::INFINITY;
    assert!(says(Statistics::fit(&bad, Extent::Fill, 1).map(drop)).contains("are not numbers"));
}

#[test]
fn each_frame_is_filled_relative_to_its_own_baseline() {
    let world = World { read_rows: vec![3, 4], ..World::press() };
    let names = world.reading_names();
    let rest = |values: Vec<f64>| Table { names: names.clone(), values: values.into() };
    let frames = synthesise(&world, Stream::Training, 1500);
    let frames = relative::dataset(frames, &rest(vec![50.0; 36]));
    let options = Options { centres: 8, ..Options::of_rows() };
    let trained = train(&frames, &options, &Silent).unwrap();
    let blob = pack(&trained, &frames, &Origin::of_data("rows", 0, 1, &frames)).unwrap();
    let statistics = Statistics::fit(&frames.inputs, Extent::Fill, 1).unwrap();
    let blob = add(&blob, &statistics, &HeldOut::default()).unwrap();
    // The baseline of one reading drifts, which is missing in every frame.
    let fresh = synthesise(&world, Stream::Test, 150).inputs;
    let gain = |at: usize| if at % 36 == 4 { 1.0 + 0.01 * (at / 36) as f64 } else { 1.0 };
    let mut readings: Vec<f64> = (0..150 * 36).map(|it| gain(it) * fresh.values[it]).collect();
    readings.iter_mut().skip(4).step_by(36).for_each(|reading| *reading = f64::NAN);
    let baselines = rest((0..150 * 36).map(|it| gain(it) * 50.0).collect());
    let (filled, _) = blob.prepare().filled(&readings, Some(&baselines)).unwrap();
    for at in (4..150 * 36).step_by(36) {
        let error = filled[at] / gain(at) - fresh.values[at];
        assert!(error.abs() < 2.0, "{at}: {error}");
    }
}
