//! The tracker of a scene: how its contacts move, and what they do to its readings.

use taxel_core::track::{LATENTS, MOST_ELECTRODES, Settings, Sizes, Tracker};
use taxel_data::BadValue;
use taxel_learn::ModelBlob;
use taxel_learn::tracked::Shares;
use taxel_simulate::World;
use taxel_simulate::motion::Dent;
use taxel_simulate::outputs::{ElectrodeOutputs, Outputs, Quantity};
use taxel_simulate::path::Path;
use taxel_simulate::sensor::{Axis, Sensor, Vector3, node};

use crate::error::{Error, Result};

/// Depths, directions and ratios of shear at which a reading's change is fitted.
const DEPTHS: usize = 12;
const DIRECTIONS: usize = 8;
const RATIOS: usize = 3;

/// Most that a group of columns is wide, over the sensor's thickness. On the scene `moving`, four columns for three cost 3 to 5 %
/// of accuracy, and five 12 %.
const GROUP: f64 = 0.7;

/// Rate in 1/s at which contacts slide and are pressed whose motion a scene does not tell.
const USUAL_SLIDE_PER_S: f64 = 8.0;
const USUAL_PRESS_PER_S: f64 = 20.0;

/// Variance that a quantity of a contact gains in a second, as a share of the square of its range, and that of its form.
const DRIFT: f64 = 0.005_5;
const FORM_DRIFT: f64 = 0.01;

/// Standard deviation of a contact's form at the start (ln a/2, b, ln p), and the largest of each.
const FORM: [[f64; 2]; 3] = [[0.25, 0.6], [0.2, 0.6], [0.2, 0.9]];

/// Checks that contacts of this world can be tracked.
///
/// # Errors
/// [`Error`] for a motion without a single contact, and outputs that are not the deformation along z or along
/// x, y and z of each electrode.
pub fn check(world: &World) -> Result<()> {
    tracked_press(world).map(|_| ())
}

/// The contact of this world, if it can be tracked.
fn tracked_press(world: &World) -> Result<Dent> {
    let press = world.motion.as_press().ok_or_else(|| {
        refused(
            "a tracker follows one contact, and this scene's deformation has none: leave track out",
        )
    })?;
    let is_tracked = match &world.outputs {
        Outputs::Electrodes(ElectrodeOutputs { quantity, axes }) => {
            *quantity == Quantity::Deformation && (axes.as_slice() == [Axis::Z] || axes.len() == 3)
        }
        Outputs::Contact(_) => false,
    };
    if !is_tracked {
        return Err(refused(
            "a tracker predicts deformations along z, or along x, y and z: choose these outputs, or leave track out",
        ));
    }
    if world.sensor.electrodes_per_row_wire > MOST_ELECTRODES {
        return Err(refused(format!("a tracker has at most {MOST_ELECTRODES} electrodes a row")));
    }
    Ok(press)
}

fn refused(rule: impl Into<String>) -> Error {
    BadValue::new("training.track", true, rule).into()
}

/// The model in `blob` with the tracker of this world.
///
/// # Errors
/// As those of [`check`].
pub fn add(blob: &ModelBlob, world: &World) -> Result<ModelBlob> {
    let press = tracked_press(world)?;
    let sensor = &world.sensor;
    let sizes = Sizes {
        rows: world.read_rows.len(),
        electrodes: sensor.electrodes_per_row_wire,
        columns: sensor.column_wires,
        span: span(sensor),
    };
    let block = block(world, &press, sizes);
    let tracker = Tracker::new(sizes, &block)
        .map_err(|cause| refused(format!("the scene gives no tracker: {cause}")))?;
    Ok(blob.with_tracker(tracker)?)
}

/// Number of columns of a group.
fn span(sensor: &Sensor) -> usize {
    let [x_mm, _, z_mm] = sensor.size_mm;
    let pitch_mm = x_mm / sensor.column_wires as f64;
    ((GROUP * z_mm / pitch_mm) as usize).clamp(1, sensor.column_wires)
}

/// The tracker's floats.
fn block(world: &World, press: &Dent, sizes: Sizes) -> Vec<f32> {
    let sensor = &world.sensor;
    let settings = settings(world, press);
    let deformations = deformations(press.dent_depth_mm[1], press.shear_ratio[1]);
    let shares = Shares::new(&deformations);
    let (mut rest_ohm, mut places, mut terms) = (vec![], vec![], vec![]);
    for row in &world.read_rows {
        let upper = sensor.row_electrodes_mm(*row);
        let columns = sensor.lower_electrodes_mm.chunks_exact(sensor.electrodes_per_column_wire);
        let at_rest: Vec<f64> = columns
            .clone()
            .map(|column| upper.iter().map(|at| conductance(at, &[0.0; 3], column)).sum())
            .collect();
        rest_ohm.extend(at_rest.iter().map(|sum| (sensor.resistance_ohm_per_mm / sum) as f32));
        let columns: Vec<_> = columns.zip(&at_rest).collect();
        for at in upper {
            places.extend([at[0] as f32, at[1] as f32]);
            for group in columns.chunks(sizes.span) {
                let rest = group.iter().map(|(column, _)| conductance(at, &[0.0; 3], column));
                let rest: Vec<f64> = rest.collect();
                let mean = |moved: &Vector3| {
                    let changes = group.iter().zip(&rest).map(|((column, of_cell), rest)| {
                        (conductance(at, moved, column) - rest) / *of_cell
                    });
                    changes.sum::<f64>() / group.len() as f64
                };
                terms.extend(shares.fit(deformations.iter().map(mean).collect()));
            }
        }
    }
    let block = [settings.floats().to_vec(), rest_ohm, places, terms].concat();
    debug_assert_eq!(block.len(), sizes.block_floats());
    block
}

/// Conductance times g of an electrode at `at` that moved, to the electrodes of a column.
fn conductance(at: &Vector3, moved: &Vector3, column: &[Vector3]) -> f64 {
    column.iter().map(|lower| node(at, moved, lower).1).sum()
}

/// Deformations of an electrode, down to `deepest_mm`, with shear up to this ratio.
fn deformations(deepest_mm: f64, most_shear: f64) -> Vec<Vector3> {
    let of = |place: usize, count: usize| (place as f64 + 0.5) / count as f64;
    let mut all = vec![];
    for depth in 0..DEPTHS {
        for direction in 0..DIRECTIONS {
            for ratio in 0..RATIOS {
                let mm = deepest_mm * of(depth, DEPTHS);
                let angle = std::f64::consts::TAU * of(direction, DIRECTIONS);
                let along = mm * most_shear * of(ratio, RATIOS);
                all.push([along * angle.cos(), along * angle.sin(), mm]);
            }
        }
    }
    all
}

/// Most that a depth may be, over the deepest of the scene; and a radius and a shear over theirs, since contacts that nobody
/// thought of are wider or sheared more.
const MOST_DEPTH: f64 = 1.2;
const MOST: f64 = 1.6;

/// How contacts of this world move, which are as wide, deep and sheared as `press`.
fn settings(world: &World, press: &Dent) -> Settings {
    let ([[low, high], ..], [_, deepest], [_, shear]) =
        (press.quantities, press.dent_depth_mm, press.shear_ratio);
    let (slides, presses) = smooth(&world.sensor, world.path.as_ref(), deepest);
    let width = high - low;
    let [x_mm, y_mm, _] = world.sensor.size_mm;
    let pitch_mm = x_mm / world.sensor.electrodes_per_row_wire as f64;
    let shear_drift = DRIFT * (2.0 * shear).powi(2);
    let walks =
        [DRIFT * width * width, shear_drift, shear_drift, FORM_DRIFT, FORM_DRIFT, FORM_DRIFT];
    let place = 0.5 * pitch_mm;
    // Standard deviation at a start, where it starts, and the range.
    let latents: [[f64; 4]; LATENTS] = [
        [place, 0.5 * x_mm, 0.0, x_mm],
        [place, 0.5 * y_mm, 0.0, y_mm],
        [0.15 * deepest, 0.0, -0.1 * deepest, MOST_DEPTH * deepest],
        [(width / 12.0_f64.sqrt()).max(0.05 * high), 0.5 * (low + high), low / MOST, MOST * high],
        [(0.4 * shear).max(1e-3), 0.0, -MOST * shear, MOST * shear],
        [(0.4 * shear).max(1e-3), 0.0, -MOST * shear, MOST * shear],
        [FORM[0][0], 0.0, -FORM[0][1], FORM[0][1]],
        [FORM[1][0], 0.0, -FORM[1][1], FORM[1][1]],
        [FORM[2][0], 0.0, -0.5, FORM[2][1]],
    ];
    let noise = world.noise.total_level().max(1e-4);
    let narrow = |numbers: [f64; 3]| numbers.map(|number| number as f32);
    Settings {
        noise: noise as f32,
        smooth: [narrow(slides[0]), narrow(slides[1]), narrow(presses)],
        walks: walks.map(|walk| walk as f32),
        start: latents.map(|[deviation, usual, ..]| [deviation as f32, usual as f32]),
        range: latents.map(|[.., least, most]| [least as f32, most as f32]),
    }
}

/// Rate, standard deviation and mean of x, y and depth.
fn smooth(sensor: &Sensor, path: Option<&Path>, deepest: f64) -> ([[f64; 3]; 2], [f64; 3]) {
    let [x_mm, y_mm, _] = sensor.size_mm;
    let (slide, press) = path.map_or((USUAL_SLIDE_PER_S, USUAL_PRESS_PER_S), |path| {
        let middle = |[low, high]: [f64; 2]| 0.5 * (low + high);
        let length = 0.25 * x_mm.hypot(y_mm);
        let press = std::f64::consts::TAU * middle(path.press_rate_hz);
        ((middle(path.speed_mm_per_s) / length).max(1.0), press.max(1.0))
    });
    let of_axis = |mm: f64| [slide, 0.2 * mm, 0.5 * mm];
    ([of_axis(x_mm), of_axis(y_mm)], [press, 0.35 * deepest, 0.25 * deepest])
}

#[cfg(test)]
mod tests {
    use taxel_core::filter::Settings as Filter;
    use taxel_data::{Silent, Table};
    use taxel_learn::tracked::{Series, decode_series};
    use taxel_simulate::Synthesis;

    use super::*;
    use crate::evaluate::moving_contacts::MovingContacts;
    use crate::experiment::Experiment;
    use crate::moving::Moving;

    /// A model of the scene `moving` with a tracker, in the time that a test has.
    fn trained() -> (Experiment, ModelBlob) {
        let mut scene = Experiment::load("moving").unwrap();
        let path = scene.world.path.as_mut().unwrap();
        (path.trajectories, path.duration_s) = (8, 0.2);
        (scene.frames, scene.training.refine, scene.training.track) = (2000, false, true);
        let blob = scene.train(&Silent).unwrap();
        (scene, blob)
    }

    /// RMSE in mm of the model alone, behind a filter, and tracked, on contacts of the scene that move.
    fn errors(scene: &Experiment, blob: &ModelBlob) -> [f64; 3] {
        let moving = MovingContacts::new(scene, blob, &[], None).unwrap().unwrap();
        let [plain, filtered, tracked] = &moving.ways[..] else { panic!("three ways") };
        assert!(tracked.is_tracked && !filtered.is_tracked);
        [plain, filtered, tracked].map(|way| way.errors[0].rmse)
    }

    #[test]
    fn a_tracker_has_two_thirds_of_the_error_of_a_filter() {
        let (mut scene, blob) = trained();
        let [_, filtered, tracked] = errors(&scene, &blob);
        assert!(tracked < 0.66 * filtered && tracked < 0.018, "{tracked} {filtered}");
        // A contact of another form, which neither has met; the example `tracking` has all forms, and the limit.
        let punch = scene.others.iter().find(|it| it.name.contains("punch")).unwrap();
        scene.world.motion = punch.deformation.clone();
        let [_, filtered, tracked] = errors(&scene, &blob);
        assert!(tracked < filtered, "{tracked} {filtered}");
    }

    #[test]
    fn a_tracker_of_forces_or_of_two_axes_is_refused() {
        let press = World::press();
        assert!(check(&press).is_ok());
        let outputs = |quantity, axes: &[Axis]| {
            let outputs = ElectrodeOutputs { quantity, axes: axes.to_vec() };
            check(&World { outputs: Outputs::Electrodes(outputs), ..press.clone() })
        };
        assert!(outputs(Quantity::Deformation, &[Axis::Z]).is_ok());
        for refused in [
            outputs(Quantity::Force, &[Axis::X, Axis::Y, Axis::Z]),
            outputs(Quantity::Deformation, &[Axis::X, Axis::Z]),
        ] {
            let message = refused.unwrap_err().to_string();
            assert!(message.contains("deformations along z"), "{message}");
        }
    }

    #[test]
    fn a_reading_that_is_filled_says_nothing_of_a_contact() {
        let (scene, blob) = trained();
        let (path, synthesis) = (scene.world.path.unwrap(), Synthesis::new(&scene.world));
        let moving = Moving::new(&scene, &synthesis, path, ([0.01, 1.0], 1)).unwrap();
        let readings = &moving.frames.inputs;
        let (width, start_us): (_, Vec<u64>) =
            (readings.names.len(), (0..40).map(|frame| 1000 * frame).collect());
        let faulty: Vec<usize> = (20..40).map(|frame| frame * width + 70).collect();
        let model = blob.prepare();
        let track = |with: f64, faulty: &[usize]| {
            let mut values = readings.values[..40 * width].to_vec();
            (20..40).for_each(|frame| values[frame * width + 70] *= with);
            let readings = Table { names: readings.names.clone(), values: values.into() };
            let series = Series { start_us: &start_us, faulty, baseline: None };
            decode_series(&model, &readings, series, Filter::default()).values.to_vec()
        };
        let missing = track(f64::NAN, &[]);
        assert!(missing.iter().all(|value| value.is_finite()));
        assert_eq!(track(1.02, &faulty), missing);
        assert_ne!(track(1.02, &[]), missing);
    }

    #[test]
    fn shares_tell_readings_to_a_fifth_of_a_per_mille() {
        let sensor = Sensor::paper();
        let column = &sensor.lower_electrodes_mm[27..30];
        let deformations = deformations(1.0, 0.5);
        let shares = Shares::new(&deformations);
        for at in sensor.row_electrodes_mm(3) {
            let rest = conductance(at, &[0.0; 3], column);
            let all = 6.0 * rest;
            let change = |moved: &Vector3| (conductance(at, moved, column) - rest) / all;
            let fitted = shares.fit(deformations.iter().map(change).collect()).map(f64::from);
            for [x, y, z] in [[0.1, 0.05, 0.7], [-0.2, 0.1, 0.5], [0.0, 0.0, 0.02]] {
                let terms = [x, y, z, x * x, x * y, x * z, y * y, y * z, z * z];
                let found: f64 = fitted.iter().zip(terms).map(|(share, term)| share * term).sum();
                let expected = change(&[x, y, z]);
                assert!((found - expected).abs() < 2e-4, "{x} {y} {z}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_tracker_needs_a_single_contact_and_deformations() {
        for (name, words) in [("paper", "follows one contact"), ("contact", "deformations along z")]
        {
            let mut scene = Experiment::load(name).unwrap();
            (scene.frames, scene.training.refine, scene.training.track) = (500, false, true);
            scene.training.options.centres = 4;
            let refused = scene.train(&Silent).unwrap_err().to_string();
            assert!(refused.contains(words), "{refused}");
        }
    }
}
