//! Recalibration of models whose readings have drifted, by presses.

use taxel_core::rbf::Format;
use taxel_data::{AtRest, Dataset, Purpose, Random, Silent, Stream, Table};
use taxel_learn::reading_model::{self, Extent, HeldOut, Statistics};
use taxel_learn::recalibration::{is_untouched, recalibrate, training_errors};
use taxel_learn::train::{Features, Kinds, train};
use taxel_learn::{ModelBlob, Options, Origin, PreparedModel, pack, relative};
use taxel_simulate::outputs::{ContactOutput, Outputs};
use taxel_simulate::{Synthesis, World, synthesise};

/// `readings` times a factor of each channel.
fn drifted(readings: &Table, gains: &[f64]) -> Table {
    let mut readings = readings.clone();
    let values = readings.values.iter_mut().zip(gains.iter().cycle());
    values.for_each(|(reading, gain)| *reading *= gain);
    readings
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// A world's frames, and gains from ±10 % that its readings drift to.
struct Sensor {
    training: Dataset,
    presses: Dataset,
    test: Dataset,
    untouched: Dataset,
    gains: Vec<f64>,
}

impl Sensor {
    fn new(world: &World) -> Self {
        let [training, presses, test] =
            [(Stream::Training, 2000), (Stream::Calibration, 200), (Stream::Test, 1000)]
                .map(|(stream, frames)| synthesise(world, stream, frames));
        let untouched = Synthesis::new(world).untouched().frames(Stream::Training, 100);
        let mut random = Random::new(1, Stream::Test, Purpose::Drift, 0, 0);
        let readings = training.inputs.names.len();
        let gains = (0..readings).map(|_| random.between([0.9, 1.1])).collect();
        Self { training, presses, test, untouched, gains }
    }

    fn model(&self, options: &Options, gains: &[f64], is_relative: bool) -> ModelBlob {
        let rest = AtRest::of(&drifted(&self.untouched.inputs, gains));
        let inputs = drifted(&self.training.inputs, gains);
        let mut seen = Dataset { inputs, at_rest: Some(rest), ..self.training.clone() };
        if is_relative {
            seen = relative::dataset(seen, &self.untouched.inputs.mean_line());
        }
        let trained = train(&seen, options, &Silent).unwrap();
        let blob = pack(&trained, &seen, &Origin::of_data("press", 0, 1, &seen)).unwrap();
        let statistics = Statistics::fit(&seen.inputs, Extent::Full, 1).unwrap();
        let mut held_out = HeldOut::default();
        // Frames that it has seen: thresholds are a little too low, of every model alike.
        held_out.add(&blob, &statistics, &seen);
        reading_model::add(&blob, &statistics, &held_out).unwrap()
    }

    /// Share of frames after the drift that are novel, share of errors within a deviation, and RMSE of readings of a wire
    /// that is missing, in ohm.
    fn statistics(&self, model: &PreparedModel<'_>) -> [f64; 3] {
        let readings = drifted(&self.test.inputs, &self.gains);
        let (deviations, novelty) = model.assess(&readings.values).unwrap();
        let novel = novelty.iter().filter(|it| **it > 0.0).count() as f64 / novelty.len() as f64;
        let decoded = model.decode_table(&readings).values;
        let errors =
            decoded.iter().zip(self.test.outputs.values.iter()).map(|(a, b)| (a - b).abs());
        let within = errors.zip(&deviations).filter(|(error, of)| error <= of).count();
        let mut missing = readings.values.clone();
        missing.iter_mut().skip(4).step_by(18).for_each(|it| *it = f64::NAN);
        let (filled, _) = model.filled(&missing, None).unwrap();
        let of_wire = filled.iter().zip(readings.values.iter()).skip(4).step_by(18);
        let squares: Vec<f64> = of_wire.map(|(a, b)| (a - b) * (a - b)).collect();
        [novel, within as f64 / decoded.len() as f64, mean(&squares).sqrt()]
    }

    /// So many presses after the drift, the last `untouched` of them without a touch.
    fn presses(&self, count: usize, untouched: usize) -> [Table; 2] {
        let lines: Vec<usize> = (0..count - untouched).collect();
        let (pressed, rest) = (self.presses.subset(&lines), &self.untouched);
        let with = |pressed: Table, rest: &Table| {
            let values = [&pressed.values[..], &rest.values[..untouched * rest.names.len()]];
            Table { values: values.concat().into(), ..pressed }
        };
        let inputs = with(pressed.inputs, &rest.inputs);
        [drifted(&inputs, &self.gains), with(pressed.outputs, &rest.outputs)]
    }

    /// RMSE of some outputs after the drift, relative to a `fresh` model's, in frames of which both tell them.
    fn ratio(&self, models: [&PreparedModel<'_>; 2], output: impl Fn(usize) -> bool) -> f64 {
        let readings = drifted(&self.test.inputs, &self.gains);
        let [decoded, fresh] = models.map(|model| model.decode_table(&readings));
        let (columns, truth) = (fresh.names.len(), &self.test.outputs.values);
        let squares = |values: &[f64]| {
            let told = (0..truth.len()).filter(|it| output(it % columns));
            let told =
                told.filter(|it| decoded.values[*it] * fresh.values[*it] * truth[*it] <= f64::MAX);
            told.map(|it| (values[it] - truth[it]).powi(2)).sum::<f64>()
        };
        (squares(&decoded.values) / squares(&fresh.values)).sqrt()
    }
}

/// Root mean square of the errors of presses, in training errors.
fn error(model: &PreparedModel<'_>, [readings, outputs]: &[Table; 2]) -> f64 {
    let (decoded, training_errors) = (model.decode_table(readings), training_errors(model.model()));
    let pairs = decoded.values.iter().zip(&*outputs.values).zip(training_errors.iter().cycle());
    let squares = pairs.map(|((a, b), error)| ((a - b) / error).powi(2));
    mean(&squares.collect::<Vec<_>>()).sqrt()
}

const NORMALISED: Kinds = Kinds::all(Features::Normalised { threshold: 3.0 });

#[test]
fn presses_bring_every_model_near_fresh_training() {
    let sensor = Sensor::new(&World { read_rows: vec![2, 3], ..World::press() });
    // Baseline of before any drift: nobody could leave the sensor untouched since.
    let baseline = sensor.untouched.inputs.mean_line().values;
    for (format, each_row, kinds, is_relative) in [
        (Format::F32, true, None, false),
        (Format::Fixed16, false, None, false),
        (Format::F32, false, None, true),
        (Format::Fixed16, false, Some(NORMALISED), false),
    ] {
        let options = Options { format, each_row, kinds, centres: 32, ..Options::of_rows() };
        let [old, fresh] =
            [&[1.0], &sensor.gains[..]].map(|gains| sensor.model(&options, gains, is_relative));
        let z_ratio = |blob: &ModelBlob| {
            let models = [blob, &fresh].map(|it| it.prepare().with_baseline(&baseline));
            sensor.ratio(models.each_ref(), |output| output % 3 == 2)
        };
        assert!(z_ratio(&old) > 3.0, "the drift must hurt");
        for (count, untouched, most) in [(200, 0, 1.03), (25, 0, 1.06)] {
            let presses = sensor.presses(count, untouched);
            let model = old.prepare().with_baseline(&baseline);
            let found = recalibrate(&model, &presses[0], &presses[1]).unwrap();
            let ratio = z_ratio(&found.blob);
            let [before, after, afresh] = [&old, &found.blob, &fresh]
                .map(|blob| sensor.statistics(&blob.prepare().with_baseline(&baseline)));
            println!(
                "{format:?}, each row {each_row}, {kinds:?}, {count} presses: {ratio:.3}, {before:.3?} {after:.3?} \
                 {afresh:.3?}"
            );
            assert!(ratio <= most, "{options:?} {count}: {ratio}");
            let [novel, within, filled] = after;
            assert!(before[0] == 1.0 && before[2] > 5.0 * filled, "the drift must hurt");
            assert!(novel < 0.1 && (within - afresh[1]).abs() < 0.05, "{after:?} {afresh:?}");
            assert!(filled < 1.05 * afresh[2], "{after:?} {afresh:?}");
            assert_eq!(found.presses, count);
            // The error after is of presses that the fit has not seen; of many, that is nearly the same.
            let seen = error(&found.blob.prepare().with_baseline(&baseline), &presses);
            assert!(count > 25 || found.error_after > 1.01 * seen, "{} {seen}", found.error_after);
            assert!(
                found.error_before > 3.0 && (0.7..1.2).contains(&found.error_after),
                "{found:?}"
            );
        }
    }
}

#[test]
fn places_and_forces_of_a_touch_are_recalibrated_too() {
    let contact = Outputs::Contact(vec![ContactOutput::Centre, ContactOutput::Force]);
    let sensor = Sensor::new(&World { outputs: contact, ..World::press() });
    let options = Options { kinds: Some(NORMALISED), each_row: false, ..Options::of_rows() };
    let options = Options { format: Format::Fixed16, centres: 32, ..options };
    let [old, fresh] =
        [&[1.0], &sensor.gains[..]].map(|gains| sensor.model(&options, gains, false));
    for (count, untouched, most) in [(200, 10, 1.06), (25, 3, 1.12)] {
        let [readings, outputs] = sensor.presses(count, untouched);
        let found = recalibrate(&old.prepare(), &readings, &outputs).unwrap();
        for output in 0..3 {
            let ratio = |blob: &ModelBlob| {
                sensor.ratio([&blob.prepare(), &fresh.prepare()], |it| it == output)
            };
            let (before, after) = (ratio(&old), ratio(&found.blob));
            println!("{count} presses, {untouched} untouched, output {output}: {after:.3}");
            assert!(before > 3.0 && after <= most, "{count} {output}: {before} {after}");
        }
    }
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
fn zeros_of_inputs_that_have_drifted_change_and_nothing_else() {
    for format in Format::ALL {
        let (blob, frames) = small(Options { format, ..Options::of_rows() });
        let (frames, model) = (frames.subset(&(0..80).collect::<Vec<_>>()), blob.prepare());
        // Row 5 has drifted; in row 4, a press misses a reading and another has a wild one.
        let mut readings = frames.inputs.clone();
        for line in readings.values.chunks_exact_mut(36) {
            line[18..].iter_mut().for_each(|reading| *reading *= 1.1);
        }
        readings.values[3] = f64::NAN;
        readings.values[36 + 3] = 1e5;
        let found = recalibrate(&model, &readings, &frames.outputs).unwrap();
        assert_eq!(found.presses, 79);
        let (old, new) = (blob.bytes(), found.blob.bytes());
        let words = |bytes: &[u8]| bytes.as_chunks::<4>().0.to_vec();
        let pairs = words(old).into_iter().zip(words(new)).enumerate();
        let differs: Vec<usize> =
            pairs.filter(|(_, (old, new))| old != new).map(|(place, _)| place).collect();
        assert_eq!((old.len(), differs.len()), (new.len(), 18 + 1), "{format:?}: {differs:?}");
        let zeros = differs[..18].windows(2);
        assert!(zeros.into_iter().all(|pair| pair[1] == pair[0] + 1), "one array, and the CRC");
        // Errors of the presses that have all readings, in training errors.
        let complete: Vec<usize> = (1..80).collect();
        let before = error(&model, &[&readings, &frames.outputs].map(|it| it.pick(&complete)));
        assert!((found.error_before / before - 1.0).abs() < 0.05, "{found:?} {before}");
        let again = recalibrate(&model, &readings, &frames.outputs).unwrap();
        assert_eq!(again.blob.bytes(), new, "the same presses, the same bytes");
    }
}

#[test]
fn what_cannot_be_recalibrated_is_refused_by_name() {
    let (blob, frames) = small(Options::of_rows());
    let model = blob.prepare();
    let with = |lines: &[usize], factor: f64| {
        let mut presses = frames.subset(lines);
        presses.outputs.values.iter_mut().for_each(|output| *output *= factor);
        recalibrate(&model, &presses.inputs, &presses.outputs).unwrap_err().to_string()
    };
    let all: Vec<usize> = (0..80).collect();
    for (lines, factor, says) in [
        (&all[..9], 1.0, "network 1 of 2 has fewer than 10 presses"),
        (&[1; 80], 1.0, "too similar"),
        // Nothing has drifted, or outputs are in another unit.
        (&all, 1.0, "no better model"),
        (&all, 1e6, "no better model"),
    ] {
        let said = with(lines, factor);
        assert!(said.contains(says), "{said}");
    }
}

#[test]
fn a_press_with_one_amount_of_0_is_none_at_rest() {
    let names = ["fx_n", "fz_n", "contact_x_mm"].map(String::from);
    assert!(!is_untouched(&names, &[0.0, 1.0, 5.0]));
    assert!(is_untouched(&names, &[0.0, 0.0, 5.0]));
}
