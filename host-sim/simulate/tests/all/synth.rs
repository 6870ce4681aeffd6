//! Still frames: seeds, noise, drift, baselines and contacts.

use taxel_data::digest::digest;
use taxel_data::{Stream, Table};
use taxel_simulate::drift::Drift;
use taxel_simulate::motion::{Dent, Mix, Part};
use taxel_simulate::noise::{Noise, NoiseKind};
use taxel_simulate::outputs::{ContactOutput, Outputs};
use taxel_simulate::profile::Profile;
use taxel_simulate::synth::SPAN_FRAMES;
use taxel_simulate::{Synthesis, World, synthesise};

#[test]
fn a_frame_does_not_depend_on_the_number_of_frames_or_rows_read() {
    for world in [World::paper(), World::press(), world_of_contact()] {
        let whole = synthesise(&world, Stream::Training, 200);
        let few = synthesise(&world, Stream::Training, 70);
        assert_eq!(few.inputs.values, whole.inputs.values[..70 * 144]);
        let last = Synthesis::new(&world).readings_of(Stream::Training, 69);
        assert_eq!(last, few.inputs.values[69 * 144..]);
        let later = Synthesis::new(&world).frames_from(Stream::Training, 64, 20);
        assert_eq!(later.inputs.values, whole.inputs.values[64 * 144..84 * 144]);
        let two_rows = World { read_rows: vec![2, 6], ..world };
        let two_rows = synthesise(&two_rows, Stream::Training, 200);
        if whole.rows == 1 {
            assert_eq!(two_rows.outputs, whole.outputs);
            continue;
        }
        assert_eq!(two_rows.row_table(0), whole.row_table(2));
        assert_eq!(two_rows.row_table(1), whole.row_table(6));
    }
}

#[test]
fn streams_seeds_and_frames_differ() {
    let first = synthesise(&World::press(), Stream::Training, 2);
    let test = synthesise(&World::press(), Stream::Test, 2);
    let other = synthesise(&World { seed: 2, ..World::press() }, Stream::Training, 2);
    assert_ne!(first.outputs, test.outputs);
    assert_ne!(first.outputs, other.outputs);
    assert_ne!(first.outputs.values[..144], first.outputs.values[144..]);
}

/// Mean and variance of the difference of two tables of rows, each divided by the `unit` of its reading and column.
pub fn moments(noisy: &Table, ideal: &Table, unit: impl Fn(f64, usize) -> f64) -> [f64; 2] {
    let (mut sum, mut squares) = (0.0, 0.0);
    for (noisy, ideal) in noisy.lines().zip(ideal.lines().cycle()) {
        for (column, (noisy, ideal)) in noisy.iter().zip(ideal).enumerate() {
            let n = (noisy - ideal) / unit(*ideal, column);
            sum += n;
            squares += n * n;
        }
    }
    let count = noisy.values.len() as f64;
    [sum / count, squares / count]
}

/// Checks a standard normal's `moments` over so many `numbers` within five standard errors.
pub fn check_standard_normal([mean, variance]: [f64; 2], numbers: usize, of: &str) {
    let count = numbers as f64;
    assert!(mean.abs() < 5.0 / count.sqrt(), "{of}: mean {mean}");
    assert!((variance - 1.0).abs() < 5.0 * (2.0 / count).sqrt(), "{of}: variance {variance}");
}

#[test]
fn noise_of_each_kind_has_its_level_in_frames_and_baselines() {
    for (kind, level) in
        [(NoiseKind::Relative, 0.02), (NoiseKind::Span, 0.02), (NoiseKind::Absolute, 0.7)]
    {
        let mut world = World { read_rows: vec![3], ..World::press() };
        world.noise = Noise::white(kind, level);
        world.check().unwrap();
        let synthesis = Synthesis::new(&world);
        let spans = synthesis.clone().ideal().frames(Stream::Span, SPAN_FRAMES).inputs.ranges();
        let sigma_ohm = |ideal_ohm: f64, column: usize| match kind {
            NoiseKind::Relative => level * ideal_ohm,
            NoiseKind::Span => level * (spans[column][1] - spans[column][0]),
            NoiseKind::Absolute => level,
        };
        let noisy = synthesis.frames(Stream::Training, 20_000);
        let ideal = synthesis.clone().ideal().frames(Stream::Training, 20_000);
        assert_eq!(noisy.outputs, ideal.outputs);
        let found = moments(&noisy.inputs, &ideal.inputs, sigma_ohm);
        check_standard_normal(found, noisy.inputs.values.len(), kind.name());
        // White: neither neighbours in a frame nor those from frame to frame go together.
        let differences: Vec<f64> = noisy
            .inputs
            .values
            .iter()
            .zip(ideal.inputs.values.iter())
            .map(|(a, b)| a - b)
            .collect();
        let variance = differences.iter().map(|n| n * n).sum::<f64>();
        for apart in [1, 18] {
            let products: f64 = differences.windows(apart + 1).map(|n| n[0] * n[apart]).sum();
            let correlation = products / variance;
            assert!(correlation.abs() < 5.0 / (differences.len() as f64).sqrt(), "{correlation}");
        }
        // A baseline is the untouched sensor with what averaging leaves of the noise, and with draws of its own.
        let untouched = synthesis.clone().ideal().untouched().frames(Stream::Test, 1).inputs;
        let of_rest = world.sensor.linearise(3, &[[0.0; 3]; 6]);
        assert!((untouched.values[0] / of_rest[0].resistance_ohm - 1.0).abs() < 1e-12);
        let baselines = synthesis.baselines(Stream::Test, 4000, 25);
        assert_eq!((baselines.len(), &baselines.names), (4000, &untouched.names));
        let of_mean = |ideal_ohm: f64, column: usize| sigma_ohm(ideal_ohm, column) / 5.0;
        let found = moments(&baselines, &untouched, of_mean);
        check_standard_normal(found, baselines.values.len(), kind.name());
        let noisy = synthesis.clone().untouched().frames(Stream::Test, 1).inputs;
        let [of_frame, of_baseline] =
            [noisy.values[0], baselines.values[0]].map(|ohm| ohm - untouched.values[0]);
        assert!((of_frame / of_baseline / 5.0 - 1.0).abs() > 1e-3);
    }
}

/// Ratio of two tables, line after line.
pub fn ratios<'t>(a: &'t Table, b: &'t Table) -> impl Iterator<Item = Vec<f64>> + 't {
    a.lines().zip(b.lines()).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a / b).collect())
}

#[test]
fn a_drifting_gain_multiplies_a_sessions_readings_and_baseline() {
    let (still, gain, frames) = (World::press(), 0.02, 5000);
    let drifting = World { drift: Some(Drift { gain }), ..still.clone() };
    let [drifted, undrifted] = [&drifting, &still].map(|it| synthesise(it, Stream::Test, frames));
    assert_eq!(drifted.outputs, undrifted.outputs);
    let baselines =
        [&drifting, &still].map(|it| Synthesis::new(it).baselines(Stream::Test, frames, 100));
    let mut factors = Vec::new();
    for (readings, baseline) in
        ratios(&drifted.inputs, &undrifted.inputs).zip(ratios(&baselines[0], &baselines[1]))
    {
        let factor = readings[0];
        let mut ratios = readings.iter().chain(&baseline);
        assert!(ratios.all(|ratio| (ratio / factor - 1.0).abs() < 1e-14));
        factors.push((factor - 1.0) / gain);
    }
    // Uniform on [−1, 1]: its range, its mean and its variance, within five standard errors.
    let n = frames as f64;
    let ends = factors.iter().fold([0.0_f64; 2], |[a, b], it| [a.min(*it), b.max(*it)]);
    assert!(ends[0] >= -1.0 && ends[0] < -0.95 && ends[1] < 1.0 && ends[1] > 0.95, "{ends:?}");
    let mean = factors.iter().sum::<f64>() / n;
    let variance = factors.iter().map(|it| it * it).sum::<f64>() / n;
    assert!(mean.abs() < 5.0 / (3.0 * n).sqrt(), "{mean}");
    assert!((3.0 * variance - 1.0).abs() < 5.0 * (0.8 / n).sqrt(), "{variance}");
    let few = synthesise(&drifting, Stream::Test, 7);
    assert_eq!(few.inputs.values, drifted.inputs.values[..7 * 144]);
}

#[test]
fn a_press_has_the_spread_that_the_design_states() {
    // RMSE of the prior mean over all electrodes: 0.158 mm, computed independently to 3.5 %.
    let press = synthesise(&World::press(), Stream::Training, 20_000).outputs;
    let means = press.means();
    let squares = press.lines().flat_map(|line| {
        let along_z = line.iter().zip(&means).skip(2).step_by(3);
        along_z.map(|(value, mean)| (value - mean).powi(2))
    });
    let rmse_mm = (squares.sum::<f64>() / (20_000.0 * 48.0)).sqrt();
    assert!((rmse_mm / 0.158 - 1.0).abs() < 0.05, "{rmse_mm} mm");
}

/// World of one press whose outputs are all quantities of the contact.
fn world_of_contact() -> World {
    World { outputs: Outputs::Contact(ContactOutput::ALL.to_vec()), ..World::press() }
}

#[test]
fn the_contact_is_the_one_that_moves_the_electrodes() {
    let (of_contact, press) = (world_of_contact(), World::press());
    let [contact, press] = [&of_contact, &press].map(|it| synthesise(it, Stream::Training, 300));
    assert_eq!(contact.inputs, press.inputs, "the same readings, to the bit");
    assert_eq!((contact.rows, contact.frames()), (1, 300));
    let electrodes = &of_contact.sensor.upper_electrodes_mm;
    for (contact, deformation) in contact.outputs.lines().zip(press.outputs.lines()) {
        let [x, y, depth, shear_x, shear_y, force] = contact[..] else { panic!("six outputs") };
        assert!((0.0..=20.0).contains(&x) && (0.0..=18.0).contains(&y));
        let delta = |electrode: usize| &deformation[3 * electrode..][..3];
        // ln Δz falls with the squared distance: the radius from one electrode, and then all others.
        let square = |e: usize| (electrodes[e][0] - x).powi(2) + (electrodes[e][1] - y).powi(2);
        let decay = libm::log(depth / delta(20)[2]) / square(20);
        for electrode in 0..48 {
            let expected = depth * libm::exp(-decay * square(electrode));
            let found = delta(electrode);
            assert!((found[2] - expected).abs() < 1e-9, "{} {expected}", found[2]);
            assert!((found[0] * depth - shear_x * found[2]).abs() < 1e-12);
            assert!((found[1] * depth - shear_y * found[2]).abs() < 1e-12);
        }
        // The force on the face is about that of all electrodes, each on its cell.
        let of_electrodes: f64 = (0..48).map(|e| 2.0 * delta(e)[2]).sum();
        assert!((force / of_electrodes - 1.0).abs() < 0.2, "{force} {of_electrodes}");
    }
}

#[test]
fn nothing_touches_an_untouched_sensor() {
    let world = world_of_contact();
    let untouched = Synthesis::new(&world).untouched().frames(Stream::Training, 3);
    for line in untouched.outputs.lines() {
        assert!(line[..2].iter().all(|centre| centre.is_nan()));
        assert_eq!(line[2..], [0.0; 4]);
    }
}

/// Synthesised bytes are the same on every platform and in every release, until the changelog says
/// otherwise.
#[test]
fn synthesised_numbers_are_fixed_for_all_time() {
    // The force is an integral, which may get better.
    let without_force = vec![ContactOutput::Centre, ContactOutput::Depth, ContactOutput::Shear];
    let of_contact = World { outputs: Outputs::Contact(without_force), ..World::press() };
    let depth_and_shear = [[0.0, 1.0], [0.0, 0.5]];
    let of = |profile, ranges: &[[f64; 2]]| Dent::new(profile, ranges, depth_and_shear);
    let parts = [
        of(Profile::Press, &[[2.0, 5.0]]),
        of(Profile::Punch, &[[2.0, 5.0], [0.4, 1.0]]),
        of(Profile::Edge, &[[7.5, 15.0], [1.0, 2.0], [0.0, 180.0]]),
        of(Profile::Ellipse, &[[2.0, 5.0], [1.5, 3.0], [0.0, 180.0]]),
        of(Profile::Tail, &[[4.2, 10.4]]),
        Dent {
            dent_depth_mm: [0.0, 0.5],
            ..of(Profile::Pair, &[[2.0, 5.0], [7.2, 9.0], [0.0, 360.0], [0.5, 1.0]])
        },
    ];
    let parts = parts.map(|dent| Part { weight: 1.0, deformation: dent.into() });
    let mix = Mix { parts: parts.to_vec() };
    for (name, world, pinned) in [
        ("paper", World::paper(), 0xa286_1098_286b_610f_u64),
        ("press", World::press(), 0xd4e0_e1f1_2618_58b2),
        ("contact", of_contact, 0x7676_98ce_f9c8_aa29),
        ("mix", World::of_motion(mix), 0x108d_4c69_134e_e9ab),
    ] {
        let dataset = synthesise(&world, Stream::Training, 10);
        let values = dataset.inputs.values.iter().chain(dataset.outputs.values.iter());
        let bytes: Vec<u8> = values.flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(digest(&bytes), pinned, "{name}");
    }
}
