//! The limit against figures that were computed independently, and against what must not change it.

use nalgebra::DMatrix;
use taxel_data::{LANES, Lanes, Purpose, Random, Silent, Stream};
use taxel_learn::{Decoder, FrameDecoder};
use taxel_limit::frame::{Frame, Rows};
use taxel_limit::limit::PriorSamples;
use taxel_limit::target::Target;
use taxel_limit::{Limit, Reference, Refusal};
use taxel_simulate::drift::Drift;
use taxel_simulate::motion::{Dent, Kind, Mix, Part};
use taxel_simulate::noise::{Noise, NoiseKind};
use taxel_simulate::outputs::{ContactOutput, Outputs};
use taxel_simulate::path::Path;
use taxel_simulate::profile::Profile;
use taxel_simulate::rubber::StandardLinearSolid;
use taxel_simulate::sensor::LaneModel;
use taxel_simulate::timetable::Timetable;
use taxel_simulate::{Synthesis, World, synthesise};

/// Limits of z on scene `press` in mm, by an independent program: noise level, RMSE, and its standard error. The first two
/// of each list are tried, or as many as `TAXEL_CASES` says.
const ARRAY: [(f64, f64, f64); 4] = [
    (0.005, 0.0314, 0.0011),
    (0.1, 0.1339, 0.0031),
    (0.01, 0.0415, 0.0013),
    (0.05, 0.1056, 0.0024),
];
const ROW_4: [(f64, f64, f64); 4] = [
    (0.005, 0.0456, 0.0016),
    (0.05, 0.1314, 0.0046),
    (0.01, 0.0639, 0.0022),
    (0.1, 0.1536, 0.0054),
];

#[test]
fn limits_agree_with_independent_figures() {
    let cases = std::env::var("TAXEL_CASES").map_or(2, |cases| cases.parse().unwrap());
    for (read_rows, figures) in [((0..8).collect::<Vec<_>>(), ARRAY), (vec![3], ROW_4)] {
        for (level, expected, standard_error) in figures.into_iter().take(cases) {
            let mut world = World { read_rows: read_rows.clone(), ..World::press() };
            world.noise.level = level;
            let z = &Reference::new(&world, 150, &Silent).unwrap().limits()[2];
            let allowed = 2.0 * standard_error.hypot(z.limit_standard_error);
            let off = z.limit - expected;
            assert!(off.abs() < allowed, "noise {level}, {} rows: {z:?}", read_rows.len());
            assert!(z.limit_standard_error < 0.06 * z.limit, "{z:?}");
        }
    }
}

/// These rows of a world.
fn rows<'w>(world: &'w World, wires: &'w [usize]) -> Rows<'w> {
    let model = LaneModel::new(&world.sensor);
    Rows { world, motion: &*world.motion, model, wires, deviation_ohm: &[] }
}

/// Rows and columns all over the sensor of [`World::press`], few enough for a quick test.
fn thinned_press() -> World {
    let mut world = World { read_rows: vec![1, 4, 6], ..World::press() };
    world.sensor = world.sensor.with_columns(&[0, 3, 6, 9, 12, 15]);
    world
}

/// Where noise is low, the posterior is normal, and its covariance that of Cramér and Rao with the prior (van Trees):
/// G·(I + JᵀJ)⁻¹·Gᵀ, with the slopes J of readings over their noise, and G of outputs, over the latents.
/// The median of frames does not depend on the few whose readings hardly tell two places apart.
#[test]
fn low_noise_comes_to_the_cramer_rao_bound() {
    let depth_mm = [0.2, 1.0];
    let dent = Dent::new(Profile::Press, &[[2.0, 5.0]], [depth_mm, [0.1, 0.5]]);
    for level in [0.0001, 0.0005] {
        let mut world = World { motion: dent.into(), ..World::press() };
        world.outputs = Outputs::Contact(vec![ContactOutput::Centre, ContactOutput::Depth]);
        world.noise.level = level;
        world.sensor = world.sensor.with_columns(&[0, 2, 4, 6, 8, 10, 12, 14, 16]);
        let limit = Limit::new(&world).unwrap();
        let rows = rows(&world, &world.read_rows);
        let (n, mut memory) = (rows.latents(), rows.memory());
        // A frame a lane: at least a radius from the edges. Differences of each latent stand in lanes of their own.
        let mut random = Random::new(7, Stream::Test, Purpose::Contact, 0, 0);
        let mut ratios = [const { Vec::new() }; 3];
        for _ in 0..31 {
            let near_the_middle = |i: usize| if i < 2 { 0.5 } else { 1.0 };
            let truth: Vec<f64> = (0..n).map(|i| near_the_middle(i) * random.normal()).collect();
            let mut latents: Vec<Lanes> = truth.iter().map(|x| [*x; LANES]).collect();
            for i in 0..n {
                latents[i][1 + 2 * i] += 1e-2;
                latents[i][2 + 2 * i] -= 1e-2;
            }
            let ideal_ohm = rows.ideal_ohm(&latents, &mut memory).to_vec();
            let slope = |of: &Lanes, i: usize| (of[1 + 2 * i] - of[2 + 2 * i]) / 2e-2;
            let slopes = DMatrix::from_fn(ideal_ohm.len(), n, |k, i| {
                slope(&ideal_ohm[k], i) / (level * ideal_ohm[k][0])
            });
            let covariance =
                (DMatrix::identity(n, n) + slopes.tr_mul(&slopes)).try_inverse().unwrap();
            let mut outputs = vec![[0.0; LANES]; 3];
            let frame = Frame { rows: &rows, readings_ohm: &[] };
            frame.outputs(&latents, &mut memory, &mut outputs);
            let of_outputs = DMatrix::from_fn(3, n, |output, i| slope(&outputs[output], i));
            let variances = (&of_outputs * covariance * of_outputs.transpose()).diagonal();
            let noisy = ideal_ohm.iter().map(|ideal| ideal[0] * (1.0 + level * random.normal()));
            let noisy: Vec<f64> = noisy.collect();
            let posterior = &limit.posteriors(&noisy, &Silent)[0];
            assert!(posterior.effective.iter().all(|size| *size >= 100.0), "{posterior:?}");
            let bounded = posterior.variance.iter().zip(&variances);
            for (ratios, (variance, bound)) in ratios.iter_mut().zip(bounded) {
                ratios.push(variance / bound);
            }
        }
        for (output, mut ratios) in ratios.into_iter().enumerate() {
            ratios.sort_by(f64::total_cmp);
            let ratio = f64::sqrt(ratios[ratios.len() / 2]);
            assert!((ratio - 1.0).abs() < 0.05, "noise {level}, output {output}: {ratio}");
        }
    }
}

#[test]
fn a_frame_is_decoded_alike_wherever_it_stands() {
    let world = World { read_rows: vec![2, 3], ..World::press() };
    let frames = synthesise(&world, Stream::Test, 6);
    let limit = Limit::new(&world).unwrap();
    let all = limit.decode_all(&frames.inputs.values, 1);
    let width = FrameDecoder::inputs(&limit);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let later = one_thread.install(|| limit.decode_all(&frames.inputs.values[4 * width..], 1));
    let outputs = all.values.len() / 6;
    assert_eq!(later.values, all.values[4 * outputs..]);
    assert_eq!(later.deviation.unwrap(), all.deviation.unwrap()[4 * outputs..]);
}

#[test]
fn what_is_not_modelled_is_refused() {
    let refusal = |world: &World| Limit::new(world).unwrap_err();
    let drift = Some(Drift { gain: 0.02 });
    assert_eq!(refusal(&World { drift, ..World::press() }), Refusal::Drift);
    let mut quiet = World::press();
    quiet.noise.level = 0.0;
    assert_eq!(refusal(&quiet), Refusal::NoNoise);
    let mut long = World::paper();
    long.sensor.electrodes_per_row_wire = 11;
    assert!(matches!(refusal(&long), Refusal::TooManyLatents { latents: 33, .. }));
}

#[test]
fn the_limit_of_still_frames_does_not_depend_on_the_rubber() {
    let elastic = World { read_rows: vec![3], path: Some(Path::at(50.0, 3.0)), ..World::press() };
    let solid = StandardLinearSolid { instant_share: 0.5, time_constant_ms: 100.0 };
    let creeping = World { rubber: solid.into(), ..elastic.clone() };
    creeping.check().unwrap();
    let readings_ohm = Synthesis::new(&creeping).readings_of(Stream::Test, 4);
    let [with, without] = [&creeping, &elastic]
        .map(|world| Limit::new(world).unwrap().posteriors(&readings_ohm, &Silent));
    assert_eq!(with, without);
}

#[test]
fn latents_have_the_distribution_that_frames_are_drawn_from() {
    let of = |profile, ranges: &[[f64; 2]]| Dent::new(profile, ranges, [[0.2, 1.0], [0.1, 0.5]]);
    let turn = [0.0, 360.0];
    let dents = [
        of(Profile::Press, &[[2.0, 5.0]]),
        of(Profile::Punch, &[[1.0, 3.0], [0.5, 1.0]]),
        of(Profile::Edge, &[[5.0, 12.0], [1.0, 2.0], turn]),
        of(Profile::Ellipse, &[[2.0, 5.0], [1.0, 3.0], turn]),
        of(Profile::Tail, &[[3.0, 9.0]]),
        Dent {
            dent_depth_mm: [0.2, 0.5],
            ..of(Profile::Pair, &[[2.0, 5.0], [4.0, 9.0], turn, [0.2, 1.0]])
        },
    ];
    let mut world = World { read_rows: vec![1], ..World::press() };
    for motion in dents.map(Kind::from).into_iter().chain([World::paper().motion]) {
        world.motion = motion;
        let drawn = Synthesis::new(&world).frames(Stream::Test, 20_000).outputs;
        let prior = PriorSamples::new(&world, 1.0, &[1]);
        let rows = rows(&world, &[1]);
        let (frame, mut memory) = (Frame { rows: &rows, readings_ohm: &[] }, rows.memory());
        let mut sums = vec![[0.0; 2]; drawn.names.len()];
        let mut values = vec![[0.0; LANES]; sums.len()];
        for places in prior.samples.places.chunks_exact(LANES * rows.latents()) {
            let mut latents = vec![[0.0; LANES]; rows.latents()];
            for (lane, place) in places.chunks_exact(rows.latents()).enumerate() {
                latents.iter_mut().zip(place).for_each(|(latent, x)| latent[lane] = *x);
            }
            frame.outputs(&latents, &mut memory, &mut values);
            for ([sum, squares], value) in sums.iter_mut().zip(values.as_flattened().chunks(LANES))
            {
                *sum += value.iter().sum::<f64>();
                *squares += value.iter().map(|v| v * v).sum::<f64>();
            }
        }
        let count = prior.samples.len() as f64;
        for (i, [sum, squares]) in sums.into_iter().enumerate() {
            let values: Vec<f64> = drawn.lines().map(|line| line[i]).collect();
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            let square = values.iter().map(|v| v * v).sum::<f64>() / n;
            let fourth = values.iter().map(|v| v.powi(4)).sum::<f64>() / n;
            let both = (1.0 / n + 1.0 / count).sqrt();
            let off = (sum / count - mean) / (both * (square - mean * mean).sqrt());
            assert!(off.abs() < 4.0, "{}: mean off by {off}", drawn.names[i]);
            let off = (squares / count - square) / (both * (fourth - square * square).sqrt());
            assert!(off.abs() < 4.0, "{}: square off by {off}", drawn.names[i]);
        }
    }
}

/// Where noise is low, readings tell the kinds of a mix apart: no sample of one leads to another.
#[test]
fn a_mix_has_posteriors_of_each_kind() {
    let of = |profile, ranges: &[[f64; 2]]| Dent::new(profile, ranges, [[0.2, 1.0], [0.1, 0.5]]);
    let dents = [of(Profile::Punch, &[[1.0, 3.0], [0.5, 1.0]]), of(Profile::Press, &[[2.0, 5.0]])];
    let part = |dent: Dent| Part { weight: 1.0, deformation: dent.into() };
    let mut world =
        World { motion: Mix { parts: dents.map(part).to_vec() }.into(), ..thinned_press() };
    world.noise.level = 0.001;
    Reference::new(&world, 40, &Silent).unwrap();
}

#[test]
fn noise_of_a_span_is_that_of_each_row() {
    let mut world = World::paper();
    world.noise.kind = NoiseKind::Span;
    let limit = Limit::new(&world).unwrap();
    let spans_ohm = Synthesis::new(&world).noise_unit_ohm();
    let expected: Vec<f64> = spans_ohm.iter().map(|span| world.noise.level * span).collect();
    assert!(world.motion.has_independent_rows() && world.read_rows.len() > 1);
    assert_eq!(limit.deviation_ohm(), expected);
}

/// A contact that is held where it is tells as much in n frames of the noise √n·p as in one of the noise p.
#[test]
fn a_contact_that_moves_by_nothing_has_the_limit_of_a_still_one() {
    let mut world = thinned_press();
    let still = Reference::new(&world, 200, &Silent).unwrap().limits();
    world.path = Some(Path {
        peak_depth_mm: Some([0.0, 1.0]),
        centre_mm: Some([[0.0, 20.0], [0.0, 18.0]]),
        half_length_mm: Some([[0.0; 2]; 2]),
        ..Path::at(0.0, 0.0)
    });
    world.noise.level *= 2.0_f64.sqrt();
    // Scans are finished at 10, 20 and 30 ms; two of them at each moment.
    let timetable = Timetable::every(0.01, 0.01, 0.03).unwrap();
    let moments_s: Vec<f64> = (0..16).map(|it| 0.02 + 5e-4 * f64::from(it)).collect();
    let moving = Reference::moving(&world, (&timetable, 0.01), &moments_s).unwrap();
    for (still, moving) in still.iter().zip(moving.limits()) {
        let error = still.limit_standard_error.hypot(moving.limit_standard_error);
        assert!((still.limit - moving.limit).abs() < 2.5 * error, "{still:?} {moving:?}");
        assert!(moving.limit_standard_error < 0.2 * moving.limit, "{moving:?}");
    }
}

#[test]
fn what_is_not_modelled_of_contacts_that_move_is_refused() {
    let world = World { path: Some(Path::at(50.0, 3.0)), ..World::press() };
    let refused = |world: World| {
        let timetable = Timetable::instants(vec![0.0]);
        let refused = Reference::moving(&world, (&timetable, 0.0), &[0.1; 2]);
        refused.unwrap_err().to_string()
    };
    let memory = Noise { correlated_level: 0.01, time_constant_ms: 20.0, ..world.noise };
    let solid = StandardLinearSolid { instant_share: 0.5, time_constant_ms: 100.0 };
    for (world, what) in [
        (World { noise: memory, ..world.clone() }, "noise with a memory"),
        (World { rubber: solid.into(), ..world.clone() }, "rubber with a memory"),
        (World { noise: Noise::white(NoiseKind::Relative, 0.0), ..world.clone() }, "without noise"),
        (
            World { outputs: Outputs::Contact(vec![ContactOutput::Depth]), ..world.clone() },
            "output",
        ),
        (World { motion: Mix { parts: vec![] }.into(), ..world.clone() }, "a mix"),
        (World { drift: Some(Drift { gain: 0.1 }), ..world }, "a drift"),
    ] {
        assert!(refused(world).contains(what), "{what}");
    }
}
