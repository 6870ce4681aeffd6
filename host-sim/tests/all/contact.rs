//! Scenes that ask for the contact alone: one small network for the whole array.

use host_sim::by_depth::by_depth;
use host_sim::experiment::Experiment;
use host_sim::metrics;
use model_core::rbf::Format;
use serde_json::Value;
use taxel_data::progress::Silent;
use taxel_data::random::Stream;
use taxel_data::simd::LANES;
use taxel_learn::Exponential;
use taxel_simulate::contact::Contact;
use taxel_simulate::sensor::Sensor;
use taxel_simulate::{World, synthesise};

use crate::common::Folder;

/// The scene `contact` with few frames, which is quick to train.
fn small_contact() -> String {
    include_str!("../../../scenes/contact.toml")
        .replace("frames = 20000", "frames = 3000")
        .replace("test_frames = 8000", "test_frames = 500")
        .replace("centres = 64", "centres = 24\nrefine = false")
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn rmse(errors: &Value, group: &str) -> f64 {
    let of_group = errors.as_array().unwrap().iter().find(|errors| errors["group"] == group);
    of_group.unwrap()["rmse"].as_f64().unwrap()
}

#[test]
fn the_contact_is_trained_evaluated_inspected_and_run() {
    let folder = Folder::new("contact");
    folder.write("scene.toml", small_contact());
    folder.succeed(&["synth", "scene.toml", "-n", "500", "--seed", "9", "-o", "test.csv"]);
    let header = std::fs::read_to_string(folder.path("test.csv")).unwrap();
    let header = header.lines().next().unwrap();
    let columns = "r8c18_ohm,contact_x_mm,contact_y_mm,contact_depth_mm,contact_force_n";
    assert!(header.ends_with(columns), "{header}");

    let train = ["train", "scene.toml", "--format", "fixed16", "-o", "m.bin"];
    folder.succeed(&train);
    let evaluated = json(&folder.succeed(&["eval", "m.bin", "test.csv", "--json"]));
    for (group, most) in [
        ("contact_x_mm", 3.5),
        ("contact_y_mm", 3.0),
        ("contact_depth_mm", 0.16),
        ("contact_force_n", 1.2),
    ] {
        let found = rmse(&evaluated["decoders"][0]["errors"], group);
        assert!(
            found < most && found < 0.7 * rmse(&evaluated["decoders"][1]["errors"], group),
            "{group}: {found}"
        );
    }
    let ranges = evaluated["by_depth"].as_array().unwrap();
    let x = |range: &Value| rmse(&range["errors"], "contact_x_mm");
    let (shallow, deep) = (&ranges[0], &ranges[ranges.len() - 2]);
    assert!(x(shallow) > 2.0 * x(deep), "where a shallow contact is can hardly be known");

    let model = json(&folder.succeed(&["inspect", "m.bin", "--json"]));
    let shape = ["rows", "inputs_per_row", "outputs_per_row", "projected_features"];
    assert_eq!(shape.map(|field| model[field].as_u64().unwrap()), [1, 144, 4, 10]);
    assert!(model["blob_bytes"].as_u64().unwrap() < 10_000);
    assert_eq!(model["needs"].as_array().unwrap().len(), 0, "the images take it");

    let printed = folder.succeed(&["run", "scene.toml"]);
    assert!(printed.contains("RMSE by depth of the contact") && !printed.contains("row-wire"));
    assert!(printed.contains("144 readings -> 10 features -> K = 24 -> 4 outputs"), "{printed}");
    let page = std::fs::read_to_string(folder.path("out/contact/report.html")).unwrap();
    assert!(page.contains("by the true depth of the contact") && !page.contains("NaN"));
}

#[test]
fn a_file_of_contacts_trains_the_same_kind_of_model() {
    let folder = Folder::new("contact-csv");
    folder.write("scene.toml", small_contact());
    folder.succeed(&["synth", "scene.toml", "-n", "600", "-o", "data.csv"]);
    let train =
        ["train", "data.csv", "--whole-array", "--features", "6", "--no-refine", "-o", "m.bin"];
    let printed = json(&folder.succeed(&[&train[..], &["--centres", "12", "--json"]].concat()));
    assert_eq!(printed["outputs"][3]["name"], "contact_force_n");
    let model = json(&folder.succeed(&["inspect", "m.bin", "--json"]));
    assert_eq!((model["rows"].as_u64(), model["projected_features"].as_u64()), (Some(1), Some(6)));
}

#[test]
fn the_limit_of_a_contact_is_below_any_decoders_error() {
    let folder = Folder::new("contact-limit");
    folder.write("scene.toml", small_contact());
    let limit = json(&folder.succeed(&["limit", "scene.toml", "-n", "20", "--json"]));
    let groups = &limit["levels"][0]["limits"][0]["groups"];
    assert_eq!(groups.as_array().unwrap().len(), 4);
    for group in groups.as_array().unwrap() {
        let [limit, prior] = ["limit", "prior_rmse"].map(|field| group[field].as_f64().unwrap());
        assert!(limit > 0.0 && limit < 0.6 * prior, "{group}");
    }
}

/// Ranges of a press in the reference scenes: extent of the face, radius and depth, in mm.
const FACE_MM: [f64; 2] = [20.0, 18.0];
const RADIUS_MM: [f64; 2] = [2.0, 5.0];
const DEPTH_MM: [f64; 2] = [0.0, 1.0];

/// Compression of each electrode in a frame, with the electrode's place.
type Dent = [([f64; 2], f64)];

/// Centre, depth and force as anyone would compute them from decoded compressions: centre of gravity, largest
/// compression, and the sum of all electrodes' forces.
fn by_moments(dent: &Dent) -> [f64; 4] {
    let weight = |z: f64| z.max(0.0);
    let sum: f64 = dent.iter().map(|(_, z)| weight(*z)).sum::<f64>().max(1e-9);
    let centre =
        |axis: usize| dent.iter().map(|(place, z)| place[axis] * weight(*z)).sum::<f64>() / sum;
    let deepest = dent.iter().map(|(_, z)| *z).fold(0.0, f64::max);
    [centre(0), centre(1), deepest, 2.0 * dent.iter().map(|(_, z)| z).sum::<f64>()]
}

/// The same from the dent of the scene that fits best, found by a search in its place and radius.
fn by_fit(dent: &Dent, sensor: &Sensor) -> [f64; 4] {
    let shape = |[x, y, radius]: [f64; 3], place: &[f64; 2]| {
        let square = (place[0] - x).powi(2) + (place[1] - y).powi(2);
        (-square / (2.0 * radius * radius)).exp()
    };
    // Least squares: the depth is linear.
    let fitted = |at: [f64; 3]| {
        let (mut product, mut square) = (0.0, 1e-12);
        for (place, z) in dent {
            let g = shape(at, place);
            (product, square) = (product + g * z, square + g * g);
        }
        let depth = (product / square).clamp(DEPTH_MM[0], DEPTH_MM[1]);
        let error: f64 = dent.iter().map(|(place, z)| (z - depth * shape(at, place)).powi(2)).sum();
        (error, depth)
    };
    let deepest = dent.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
    let mut at = [deepest[0], deepest[1], 3.0];
    let (mut error, mut depth) = fitted(at);
    let ranges = [[0.0, FACE_MM[0]], [0.0, FACE_MM[1]], RADIUS_MM];
    let mut step = 2.0;
    while step > 0.005 {
        let mut better = false;
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
            let mut tried = at;
            tried[axis] = (at[axis] + side * step).clamp(ranges[axis][0], ranges[axis][1]);
            let found = fitted(tried);
            if found.0 < error {
                (at, error, depth, better) = (tried, found.0, found.1, true);
            }
        }
        if !better {
            step *= 0.5;
        }
    }
    let contact = Contact {
        centre_mm: [[at[0]; LANES], [at[1]; LANES]],
        dent_radius_mm: [at[2]; LANES],
        dent_depth_mm: [depth; LANES],
        shear: [[0.0; LANES]; 2],
    };
    [at[0], at[1], depth, contact.force_n(sensor)[0]]
}

#[test]
fn the_dent_that_fits_best_is_the_one_that_was_pressed() {
    let sensor = Sensor::paper();
    let truth = Contact {
        centre_mm: [[7.3; LANES], [12.1; LANES]],
        dent_radius_mm: [3.2; LANES],
        dent_depth_mm: [0.6; LANES],
        shear: [[0.0; LANES]; 2],
    };
    let places = sensor.upper_electrodes_mm.iter().map(|[x, y, _]| [*x, *y]);
    let compression = |[x, y]: [f64; 2]| {
        0.6 * (-((x - 7.3_f64).powi(2) + (y - 12.1_f64).powi(2)) / (2.0 * 3.2 * 3.2)).exp()
    };
    let dent: Vec<([f64; 2], f64)> = places.map(|place| (place, compression(place))).collect();
    let expected = [7.3, 12.1, 0.6, truth.force_n(&sensor)[0]];
    let fitted = by_fit(&dent, &sensor);
    assert!(fitted.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.05), "{fitted:?}");
    let moments = by_moments(&dent);
    let near = [1.0, 1.0, 0.1, 1.0];
    assert!((0..4).all(|i| (moments[i] - expected[i]).abs() < near[i]), "{moments:?}");
}

/// What the contact is known to be from the deformation of all electrodes: the comparison in docs/contact.md.
#[test]
#[ignore = "trains networks for all outputs, which takes minutes"]
fn contacts_from_all_outputs() {
    let contact = World { seed: 99, ..World::contact() };
    let press = World { seed: 99, ..World::press() };
    let [truth, test] = [&contact, &press].map(|world| synthesise(world, Stream::Training, 8000));
    assert_eq!(truth.inputs, test.inputs);
    let measure = Experiment::load("contact").unwrap().measure();
    let places: Vec<[f64; 2]> =
        press.sensor.upper_electrodes_mm.iter().map(|[x, y, _]| [*x, *y]).collect();
    for centres in [16, 64, 256] {
        let mut scene = Experiment::load("press").unwrap();
        (scene.training.centres, scene.training.spread) = (centres, 0.4);
        (scene.training.whole_array, scene.training.format) = (true, Format::Fixed16);
        let blob = scene.train(&Silent).unwrap();
        let decoded = blob.prepare(Exponential::default()).decode_table(&test.inputs);
        for (name, fit) in [("moments", false), ("fit", true)] {
            let of_frame = |outputs: &[f64]| {
                let z = outputs.iter().skip(2).step_by(3);
                let dent: Vec<_> = places.iter().copied().zip(z.copied()).collect();
                if fit { by_fit(&dent, &press.sensor) } else { by_moments(&dent) }
            };
            let estimate: Vec<f64> = decoded.lines().flat_map(of_frame).collect();
            let ranges = by_depth(&truth.outputs, &estimate, &measure);
            let all = metrics::by_group(&truth.outputs, &estimate, &measure);
            for (frames, errors) in [("all", &all), ("from 0.1 mm", &ranges.last().unwrap().errors)]
            {
                let rmse: Vec<String> = errors.iter().map(|e| format!("{:.4}", e.rmse)).collect();
                println!("K = {centres}, {name}, {frames}: {}", rmse.join(" "));
            }
        }
    }
}
