//! `cargo test -p taxel-learn recalibration -- --include-ignored --nocapture` prints the figures of docs/drift.md.

use taxel_core::blob::{Floats, Metadata, ModelParts, encode_to_vec};
use taxel_core::rbf::{Format, Shape};
use taxel_data::{Dataset, Purpose, Random, Silent, Stream};
use taxel_simulate::{Synthesis, World, synthesise};

use super::*;
use crate::train::train;
use crate::{Options, Origin, confidence, fill, pack, relative};

/// How much is trained and decoded.
#[derive(Clone, Copy)]
struct Size {
    /// Rows of the sensor, from its first.
    rows: usize,
    /// Frames of training and of tests.
    frames: [usize; 2],
}

/// As docs/drift.md says, and enough to see a fault.
const ALL: Size = Size { rows: 8, frames: [10_000, 3000] };
const SOME: Size = Size { rows: 4, frames: [4000, 1000] };

/// What happens to readings: factors, and then offsets relative to the channel's mean.
#[derive(Clone, Copy)]
enum Drift {
    /// Factors 1 ± so much, uniform.
    Gains(f64),
    /// Factors with this standard deviation.
    NormalGains(f64),
    /// One factor for all channels.
    Common(f64),
    /// Offsets of ± so much of the channel's mean, uniform.
    Offsets(f64),
}

impl Drift {
    /// Factor and offset of each channel.
    fn draw(self, seed: u64, means: &[f64]) -> Vec<[f64; 2]> {
        let mut random = Random::new(seed, Stream::Test, Purpose::Drift, 0, 0);
        let mut of = |mean: f64| match self {
            Self::Gains(by) => [random.between([1.0 - by, 1.0 + by]), 0.0],
            Self::NormalGains(sigma) => [1.0 + sigma * random.normal(), 0.0],
            Self::Common(factor) => [factor, 0.0],
            Self::Offsets(by) => [1.0, random.between([-by, by]) * mean],
        };
        means.iter().map(|mean| of(*mean)).collect()
    }
}

/// `readings` after a drift.
fn drifted(readings: &Table, drift: &[[f64; 2]]) -> Table {
    let mut readings = readings.clone();
    for line in readings.values.chunks_exact_mut(drift.len()) {
        for (reading, [factor, offset]) in line.iter_mut().zip(drift) {
            *reading = *reading * factor + offset;
        }
    }
    readings
}

/// The scene `press` with so many rows.
fn world(size: Size) -> World {
    World { read_rows: (0..size.rows).collect(), ..World::press() }
}

/// The scene `press`, seen by a model of these options.
struct Bench {
    options: Options,
    relative_inputs: bool,
    training: Dataset,
    presses: Dataset,
    test: Dataset,
    /// Baseline of before any drift: nobody could leave the sensor untouched since.
    rest: Table,
}

impl Bench {
    fn new(options: Options, relative_inputs: bool, size: Size) -> Self {
        let world = world(size);
        let rest = Synthesis::new(&world).untouched().frames(Stream::Calibration, 100).inputs;
        let all = synthesise(&world, Stream::Test, 1000 + size.frames[1]);
        Self {
            options,
            relative_inputs,
            training: synthesise(&world, Stream::Training, size.frames[0]),
            presses: all.subset(&(0..1000).collect::<Vec<_>>()),
            test: all.subset(&(1000..all.frames()).collect::<Vec<_>>()),
            rest: rest.mean_line(),
        }
    }

    fn train(&self, drift: &[[f64; 2]]) -> ModelBlob {
        let inputs = drifted(&self.training.inputs, drift);
        let mut seen = Dataset { inputs, ..self.training.clone() };
        if self.relative_inputs {
            seen = relative::dataset(seen, &self.rest);
        }
        let trained = train(&seen, &self.options, &Silent).unwrap();
        pack(&trained, &seen, &Origin::of_data("press", 0, 1, &seen)).unwrap()
    }

    fn prepare<'b>(&self, blob: &'b ModelBlob) -> PreparedModel<'b> {
        blob.prepare().with_baseline(&self.rest.values)
    }

    /// Root mean square error in z of the model after a drift.
    fn z_error(&self, blob: &ModelBlob, drift: &[[f64; 2]]) -> f64 {
        let decoded = self.prepare(blob).decode_table(&drifted(&self.test.inputs, drift));
        let squares = self.test.outputs.squared_errors(&decoded.values);
        let z = decoded.names.iter().zip(squares).filter(|(name, _)| name.ends_with("_dz_mm"));
        let z: Vec<f64> = z.map(|(_, square)| square / self.test.frames() as f64).collect();
        (z.iter().sum::<f64>() / z.len() as f64).sqrt()
    }
}

/// No drift.
const STILL: [f64; 2] = [1.0, 0.0];

/// Recalibrates by these presses after a drift: errors in z before, after, and of training on the drifted sensor.
struct Outcome {
    before: f64,
    after: f64,
    found: Recalibrated,
}

impl Bench {
    fn recalibrate(&self, model: &ModelBlob, drift: &[[f64; 2]], presses: &Dataset) -> Outcome {
        let readings = drifted(&presses.inputs, drift);
        let found = recalibrate(&self.prepare(model), &readings, &presses.outputs).unwrap();
        let before = self.z_error(model, drift);
        Outcome { before, after: self.z_error(&found.blob, drift), found }
    }
}

fn first(presses: &Dataset, count: usize) -> Dataset {
    presses.subset(&(0..count).collect::<Vec<_>>())
}

#[test]
fn two_hundred_presses_bring_every_format_within_3_percent_of_fresh_training() {
    every_format(SOME);
}

#[test]
#[ignore = "prints the figures of the page, in a minute"]
fn two_hundred_presses_bring_every_format_within_3_percent_of_fresh_training_of_all_rows() {
    every_format(ALL);
}

fn every_format(size: Size) {
    for (format, whole_array, relative_inputs) in [
        (Format::F32, false, false),
        (Format::Fixed16, false, false),
        (Format::Fixed16, true, false),
        (Format::F32, false, true),
    ] {
        let bench = Bench::new(
            Options { format, each_row: !whole_array, ..Options::of_rows() },
            relative_inputs,
            size,
        );
        let means = bench.training.inputs.means();
        let drift = Drift::Gains(0.1).draw(1, &means);
        let model = bench.train(&vec![STILL; means.len()]);
        let Outcome { before, after, found } =
            bench.recalibrate(&model, &drift, &first(&bench.presses, 200));
        let fresh = bench.z_error(&bench.train(&drift), &drift);
        println!(
            "{}, {} networks, relative {relative_inputs}: {before:.4} mm, {after:.4} mm, afresh {fresh:.4} mm: {:.3}",
            format.name(),
            found.networks,
            after / fresh
        );
        assert_eq!((found.presses, found.networks), (200, if whole_array { 1 } else { size.rows }));
        assert!(before > 3.0 * fresh, "the drift must hurt");
        assert!(after <= 1.03 * fresh, "{after} for {fresh}");
        assert!(found.error_before > 3.0 && (0.9..1.1).contains(&found.error_after), "{found:?}");
    }
}

#[test]
fn few_presses_other_drifts_and_wrong_outputs_cost_a_tenth_at_most() {
    other_presses(SOME);
}

#[test]
#[ignore = "prints the figures of the page, in a minute"]
fn few_presses_other_drifts_and_wrong_outputs_cost_a_tenth_at_most_of_all_rows() {
    other_presses(ALL);
}

fn other_presses(size: Size) {
    let bench = Bench::new(Options::of_rows(), false, size);
    let means = bench.training.inputs.means();
    let model = bench.train(&vec![STILL; means.len()]);
    // Training sees inputs scaled to their range, so neither gains nor offsets change what it reaches.
    let fresh = bench.z_error(&model, &vec![STILL; means.len()]);
    let ten_percent = Drift::Gains(0.1);
    let many = synthesise(&world(size), Stream::Calibration, 6000);
    let most_pressed = |frame: usize| {
        let z = many.outputs.line(frame).iter().skip(2).step_by(3);
        z.enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map(|(electrode, _)| electrode)
    };
    let at_one_place = |frame: &usize| most_pressed(*frame) == Some(size.rows * 5 / 2);
    let mut vague = first(&bench.presses, 200);
    let mut random = Random::new(1, Stream::Test, Purpose::Noise, 0, 0);
    vague.outputs.values.iter_mut().for_each(|output| *output += 0.05 * random.normal());
    let mut wrong = first(&bench.presses, 200);
    let width = wrong.outputs.names.len();
    wrong.outputs.values[..10 * width].reverse();
    let count = |count| first(&bench.presses, count);
    let one_place = many.subset(&(0..many.frames()).filter(at_one_place).collect::<Vec<_>>());
    for (what, drift, draws, presses, most) in [
        ("25 presses", ten_percent, 1, count(25), 1.08),
        ("200 presses", ten_percent, 3, count(200), 1.03),
        ("±20 %", Drift::Gains(0.2), 1, count(200), 1.06),
        ("normal, σ = 10 %", Drift::NormalGains(0.1), 1, count(200), 1.05),
        ("offsets of ±10 % of the mean", Drift::Offsets(0.1), 1, count(200), 1.02),
        ("all channels +10 %", Drift::Common(1.1), 1, count(200), 1.05),
        ("outputs off by 0.05 mm", ten_percent, 1, vague, 1.06),
        ("outputs of 10 presses stated wrongly", ten_percent, 1, wrong, 1.04),
        ("presses at one place", ten_percent, 1, one_place, 1.4),
    ] {
        let count = presses.frames();
        for seed in 1..=draws {
            let drift = drift.draw(seed, &means);
            let Outcome { before, after, .. } = bench.recalibrate(&model, &drift, &presses);
            let ratio = after / fresh;
            println!("{what} ({count} presses): {before:.3} mm, {after:.4} mm: {ratio:.3}");
            assert!(before > 2.0 * after && ratio <= most, "{what}: {after} for {fresh}");
        }
    }
    // Without a drift no row is better by a tenth.
    let presses = count(200);
    let same = recalibrate(&bench.prepare(&model), &presses.inputs, &presses.outputs);
    let refused = same.unwrap_err().to_string();
    assert!(refused.contains("no better model"), "{refused}");
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
fn a_smooth_network_has_the_outputs_of_decoding_and_the_slopes_of_its_outputs() {
    for (format, affine_tail, tolerance) in [
        (Format::F32, true, 1e-4),
        (Format::F32, false, 1e-4),
        (Format::Fixed16, true, 4e-3), // inputs, activations and weights have 16 bits
        (Format::Fixed16, false, 4e-3),
    ] {
        let (blob, frames) = small(Options { affine_tail, format, ..Options::of_rows() });
        let model = blob.prepare();
        let decoded = model.decode_table(&frames.inputs);
        let size = decoded.values.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        for (row, network) in model.networks().iter().enumerate() {
            let smooth = Smooth::new(network);
            let Shape { inputs, outputs, .. } = smooth.shape;
            for frame in 0..20 {
                let readings = &frames.inputs.line(frame)[row * inputs..][..inputs];
                let scale = smooth.zeros.iter().zip(&smooth.per_unit);
                let mut x: Vec<f64> =
                    readings.iter().zip(scale).map(|(r, (z, p))| (r - z) * p).collect();
                let expected = &decoded.line(frame)[row * outputs..][..outputs];
                for (value, decoded) in smooth.infer(&x, &mut []).iter().zip(expected) {
                    assert!(
                        (value - decoded).abs() <= tolerance * size,
                        "{format:?}: {value} for {decoded}"
                    );
                }
                // Slopes are differences of values, far outside as well.
                x[frame % inputs] += if frame % 2 == 0 { 2.0 } else { 0.0 };
                let (i, step) = (frame * 5 % inputs, 1e-4);
                let mut slopes = vec![0.0; inputs * outputs];
                smooth.infer(&x, &mut slopes);
                let [below, above] = [-step, step].map(|step| {
                    let mut x = x.clone();
                    x[i] += step;
                    smooth.infer(&x, &mut [])
                });
                for (o, (below, above)) in below.iter().zip(above).enumerate() {
                    let (found, expected) =
                        (slopes[o * inputs + i], (above - below) / (2.0 * step));
                    assert!((found - expected).abs() <= 1e-6 * size, "{found} for {expected}");
                }
            }
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
        let readings = drifted(&frames.inputs, &[[1.3, 0.0]; 36]);
        let inputs = model.inputs_of_networks(&readings.values);
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
        let parsed = model.model();
        let rmse = [rmse; 36].iter().flat_map(|rmse| rmse.to_le_bytes()).collect::<Vec<u8>>();
        let parts = ModelParts {
            linear_rmse: Floats(&[]),
            projection: None,
            confidence: None,
            fill: None,
            networks,
            row_network,
            metadata: Metadata {
                training_rmse: Floats(&rmse),
                full_scale: Floats(&vec![0; rmse.len()]),
                ..*parsed.metadata()
            },
        };
        ModelBlob::of_bytes(&encode_to_vec(&parts).unwrap()).unwrap()
    };
    let density = confidence::Density::fit(
        &frames,
        &confidence::Settings { components: 2, ..Default::default() },
    );
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
