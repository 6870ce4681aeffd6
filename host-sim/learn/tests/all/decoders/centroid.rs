//! The centroid of a touch on a mat.

use taxel_data::{AtRest, Dataset};
use taxel_learn::decoders::centroid::Centroid;
use taxel_learn::{FrameDecoder, Frames};

/// Touches of a mat of 8 × 8 cells 4 mm apart, whose resistances fall by what is pressed on them; a cell is dead.
fn touched(frames: u32) -> Dataset {
    let names = (0..64).map(|cell| format!("r{}c{}_ohm", cell / 8 + 1, cell % 8 + 1));
    let outputs = ["x_mm", "y_mm", "force_n", "age_s"].map(String::from).to_vec();
    let mut mat = Dataset::empty(names.collect(), outputs, 1, 0);
    let noise = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 16) / 32_768.0 - 1.0;
    for frame in 0..frames {
        let [x, y] = [13, 17].map(|step| 6.0 + f64::from(frame * step % 97) / 6.0);
        let force = f64::from(frame % 5);
        for cell in 0..64 {
            let [row, column] = [cell / 8, cell % 8].map(|it| 4.0 * f64::from(it));
            let distance = (column - x).powi(2) + (row - y).powi(2);
            let dent = if cell == 9 { 0.0 } else { 50.0 * force * (-distance / 32.0).exp() };
            mat.inputs.values.push(1000.0 + noise(64 * frame + cell) - dent);
        }
        let place = [x, y].map(|at| if force > 0.0 { at } else { f64::NAN });
        mat.outputs.values.extend(place.into_iter().chain([force, f64::from(frame)]));
    }
    let untouched = mat.subset(&(0..mat.frames()).step_by(5).collect::<Vec<_>>());
    mat.at_rest = Some(AtRest::of(&untouched.inputs));
    mat
}

#[test]
fn a_touch_is_found_within_a_tenth_of_a_cell() {
    let (training, test) = (touched(400), touched(97));
    let centroid = Centroid::fit(&training).unwrap();
    let decoded = centroid.decode(&mut (), Frames::untimed(&test.inputs.values));
    let squares = test.outputs.squared_errors(&decoded.values);
    let rmse = squares.iter().zip(test.outputs.counts());
    let rmse: Vec<f64> = rmse.map(|(squares, count)| (squares / count as f64).sqrt()).collect();
    assert!(rmse[..2].iter().all(|place_mm| *place_mm < 0.4), "{rmse:?}");
    assert!(rmse[2] < 0.1 && rmse[3] > 100.0, "{rmse:?}");
    // What is not touched has the mean place.
    let untouched =
        centroid.decode(&mut (), Frames::untimed(&training.at_rest.as_ref().unwrap().level));
    assert_eq!(untouched.values[..2], training.outputs.means()[..2]);
}

#[test]
fn without_cells_rest_or_a_place_there_is_no_centroid() {
    let mat = touched(40);
    assert!(Centroid::fit(&Dataset { at_rest: None, ..mat.clone() }).is_none());
    let mut channels = mat.clone();
    channels.inputs.names[3] = "ch3".into();
    assert!(Centroid::fit(&channels).is_none());
    let mut others = mat;
    others.outputs.names =
        ["r1e1_dx_mm", "shear_x_mm", "yaw_deg", "age_s"].map(String::from).to_vec();
    assert!(Centroid::fit(&others).is_none());
}
