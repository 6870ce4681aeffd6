//! Tests of a tracker on a small sensor, whose readings are what its shares say.

use super::dent::{Form, OF_DEPTH};
use super::*;

const SIZES: Sizes = Sizes { rows: 4, electrodes: 4, columns: 5, span: 1 };

/// A tracker's floats: electrodes 3 mm apart, and shares that tell columns and axes apart.
fn block() -> Vec<f32> {
    let smooth = [[8.0, 3.0, 6.0], [8.0, 3.0, 6.0], [20.0, 0.3, 0.25]];
    let start = [[1.0, 6.0], [1.0, 6.0], [0.2, 0.0], [0.8, 3.0], [0.2, 0.0], [0.2, 0.0]];
    let form = [[0.2, 0.0]; 3];
    let settings = Settings {
        noise: 2e-4,
        smooth,
        walks: [0.05, 0.005, 0.005, 0.01, 0.01, 0.01],
        start: core::array::from_fn(|it| if it < 6 { start[it] } else { form[it - 6] }),
        range: [
            [0.0, 12.0],
            [0.0, 12.0],
            [-0.1, 1.2],
            [1.5, 5.0],
            [-0.5, 0.5],
            [-0.5, 0.5],
            [-0.6, 0.6],
            [-0.6, 0.6],
            [-0.5, 0.9],
        ],
    };
    let mut block = settings.floats().to_vec();
    block.extend(vec![50.0; SIZES.cells()]);
    let mut shares = vec![];
    for row in 0..4 {
        for electrode in 0..4 {
            let place = [1.5 + 3.0 * electrode as f32, 1.5 + 3.0 * row as f32];
            block.extend(place);
            for column in 0..5 {
                let away = 1.2 + 2.4 * column as f32 - place[0];
                let near = 0.2 / (1.0 + 0.1 * away * away);
                let along = 0.05 * away * near;
                let across = 0.02 * (row as f32 - 1.5) * near;
                shares.extend([along, across, near, 0.01, 0.0, 0.3 * along, 0.01, 0.0, 0.5 * near]);
            }
        }
    }
    [block, shares].concat()
}

fn tracker(block: &[f32]) -> Tracker<'_> {
    Tracker::new(SIZES, block).unwrap()
}

/// A contact that slides, is pressed and sheared, at a time.
fn contact(time_s: f32) -> Latents {
    let depth = 0.4 + 0.3 * (12.0 * time_s).sin();
    let [x, y] = [6.0 + 2.5 * (6.0 * time_s).sin(), 6.0 + 2.0 * (6.0 * time_s).cos()];
    [x, y, depth, 2.8, 0.2, -0.1, 0.1, 0.0, 0.1]
}

fn depth(latents: Latents, place_mm: [f32; 2]) -> f32 {
    Form::new(latents).at(&latents, place_mm).mm
}

/// Readings of a contact in Ω, without noise.
fn readings(tracker: &Tracker<'_>, at: impl Fn(usize) -> Latents) -> Vec<f32> {
    let mut all = vec![];
    for row in 0..SIZES.rows {
        let latents = at(row);
        let form = Form::new(latents);
        for column in 0..SIZES.columns {
            let mut ratio = 1.0;
            for electrode in 4 * row..4 * row + 4 {
                let dz = form.at(&latents, tracker.places_mm[electrode]).mm;
                let [dx, dy] = [latents[4] * dz, latents[5] * dz];
                let s = tracker.shares[electrode * SIZES.columns + column];
                let terms = [dx, dy, dz, dx * dx, dx * dy, dx * dz, dy * dy, dy * dz, dz * dz];
                ratio += s.iter().zip(terms).map(|(share, term)| share * term).sum::<f32>();
            }
            all.push(50.0 / ratio);
        }
    }
    all
}

/// Tracks so many frames of `contact`, one each 2 ms, whose readings pass `change`. Returns the largest error in mm of the last
/// half, and how many frames were explained.
fn track(frames: u32, change: impl Fn(u32, &mut [f32])) -> (f32, u32) {
    let block = block();
    let (tracker, mut state) = (tracker(&block), State::new());
    let row_us = [200.0, 600.0, 1000.0, 1400.0];
    let (mut largest, mut explained, mut seed) = (0.0_f32, 0, 1_u32);
    // Evenly between ±√3 deviations.
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        2e-4 * 3.0_f32.sqrt() * ((seed >> 8) as f32 / 8_388_608.0 - 1.0)
    };
    for frame in 0..frames {
        let start_s = 0.002 * frame as f32;
        let mut ohm = readings(&tracker, |row| contact(start_s + row_us[row] * 1e-6));
        ohm.iter_mut().for_each(|ohm| *ohm *= 1.0 + noise());
        change(frame, &mut ohm);
        let truth = contact(start_s + 0.003);
        // A network that is 50 µm off, and a frame behind.
        let before = contact(start_s);
        let mut outputs: Vec<f32> =
            tracker.places_mm.iter().map(|place| depth(before, *place) + 0.05).collect();
        let mut status = [RowStatus::Decoded; 4];
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
        let start_us = 2000 * u64::from(frame);
        let frame_read = Frame { readings_ohm: &ohm, reciprocals: None, start_us, row_us: &row_us };
        let ahead_us = 3000.0 - frame_read.middle().0;
        let is_explained = tracker.track(&mut state, &frame_read, ahead_us, &mut estimate);
        explained += u32::from(is_explained);
        if frame >= frames / 2 && is_explained {
            let errors = tracker.places_mm.iter().zip(&outputs);
            let errors = errors.map(|(place, mm)| (mm - depth(truth, *place)).abs());
            largest = largest.max(errors.fold(0.0, f32::max));
        }
    }
    (largest, explained)
}

#[test]
fn a_contact_that_moves_is_followed_ahead_of_its_readings() {
    let (largest, explained) = track(200, |_, _| ());
    assert!(largest < 0.006 && explained == 200, "{largest} mm, {explained} frames");
}

#[test]
fn readings_that_are_missing_do_not_count() {
    let (largest, explained) = track(200, |frame, ohm| {
        ohm[5..10].fill(f32::NAN); // a torn row-wire
        ohm[(frame % 20) as usize] = f32::INFINITY;
    });
    assert!(largest < 0.015 && explained >= 198, "{largest} mm, {explained} frames");
    // Without any, the network's estimate stays.
    assert_eq!(track(10, |_, ohm| ohm.fill(f32::NAN)).1, 0);
}

#[test]
fn a_frame_that_no_contact_explains_is_decoded_by_the_network() {
    let (largest, explained) = track(300, |frame, ohm| {
        if (100..105).contains(&frame) {
            ohm.iter_mut().step_by(2).for_each(|ohm| *ohm *= 1.2);
        }
    });
    assert!((290..298).contains(&explained), "{explained}");
    assert!(largest < 0.01, "{largest} mm");
}

#[test]
fn gaps_and_times_that_go_back_start_anew() {
    let block = block();
    let tracker = tracker(&block);
    let ohm = readings(&tracker, |_| contact(0.0));
    let at = |state: &mut State, start_us| {
        let (mut outputs, mut status) = ([0.1; 16], [RowStatus::Decoded; 4]);
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
        let (row_us, reciprocals) = (&[0.0; 4], None);
        let frame = Frame { readings_ohm: &ohm, reciprocals, start_us, row_us };
        tracker.track(state, &frame, 0.0, &mut estimate);
        (state.is_known, state.now.mean)
    };
    let first = at(&mut State::new(), 0);
    let mut state = State::new();
    at(&mut state, 2_000_000);
    assert_eq!(at(&mut state, 0), first);
    // No contact explains the frame: those of the next 5 ms are left to the network.
    assert_eq!(at(&mut state, 4000), first);
    assert_ne!(at(&mut state, 6000), first);
    assert_eq!(at(&mut state, 700_000), first);
    state.restart();
    assert_eq!(at(&mut state, 701_000), first);
}

#[test]
fn slopes_are_those_of_depths_and_readings() {
    let block = block();
    let tracker = tracker(&block);
    let latents = contact(0.3);
    let step = 1e-3;
    for (place, latent) in OF_DEPTH.into_iter().enumerate() {
        let moved = |by: f32| {
            let mut moved = latents;
            moved[latent] += by;
            depth(moved, [4.5, 7.5])
        };
        let slope = (moved(step) - moved(-step)) / (2.0 * step);
        let found = Form::new(latents).at(&latents, [4.5, 7.5]).slopes[place];
        assert!((found - slope).abs() < 1e-3, "latent {latent}: {found} {slope}");
    }
    // A state that is off is told the way: the gradient is that of the squares.
    let ohm = readings(&tracker, |_| latents);
    let row_us = [0.0; 4];
    let frame = Frame { readings_ohm: &ohm, reciprocals: None, start_us: 0, row_us: &row_us };
    let mut mean = [0.0; NUMBERS];
    mean.iter_mut().zip(latents).for_each(|(number, latent)| *number = latent + 0.01);
    let (mut information, mut gradient) = ([[0.0; LATENTS]; LATENTS], [0.0; LATENTS]);
    tracker.inform(1e-3, &mean, &frame, &mut information, &mut gradient);
    for place in 0..LATENTS {
        let squares = |by: f32| {
            let mut moved = mean;
            moved[place] += by;
            let mean_square =
                tracker.inform(1e-3, &moved, &frame, &mut { information }, &mut [0.0; LATENTS]);
            mean_square * ohm.len() as f32
        };
        let slope = (squares(step) - squares(-step)) / (2.0 * step);
        // Squares are over 2, and noise depends on the ratio.
        let expected = -0.5 * slope;
        let scale = gradient.iter().fold(0.0_f32, |most, it| most.max(it.abs()));
        assert!((gradient[place] - expected).abs() < 0.03 * scale, "{place}");
    }
}

#[test]
fn a_walk_spreads_as_its_covariance_says() {
    let block = block();
    let settings = tracker(&block).settings();
    let State { now: mut tracked, .. } = State::new();
    let mut work = tracked.root;
    // From nothing known, after a long time: the stationary variances; in many steps as in one.
    let variances = |tracked: &Contact| tracked.root.map(|row| dot(&row, &row));
    settings.predict(&mut tracked, 5.0, &mut work);
    let at_once = variances(&tracked);
    for (axis, [rate, deviation, _]) in settings.smooth.into_iter().enumerate() {
        let expected = [deviation * deviation, (deviation * rate).powi(2)];
        for (found, expected) in [at_once[axis], at_once[LATENTS + axis]].iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
        }
    }
    let mut steps = Contact { root: [[0.0; NUMBERS]; NUMBERS], ..tracked };
    let mut long = steps.clone();
    (0..40).for_each(|_| settings.predict(&mut steps, 0.001, &mut work));
    settings.predict(&mut long, 0.04, &mut work);
    for (found, expected) in variances(&steps).into_iter().zip(variances(&long)) {
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    }
}

#[test]
fn bad_tracker_parameters_are_refused_and_no_number_panics() {
    let good = block();
    let found = good.len() - 1;
    let wrong = NetworkError::Length { what: "tracker", expected: good.len(), found };
    assert_eq!(Tracker::new(SIZES, &good[1..]), Err(wrong));
    let mut bad = good.clone();
    bad[9] = f32::NAN;
    assert_eq!(Tracker::new(SIZES, &bad), Err(NetworkError::NotFinite { what: "tracker" }));
    for number in [0.0, -1.0, 1e-30, 1e30, f32::MAX, f32::MIN] {
        for place in 0..good.len().min(200) {
            let mut block = good.clone();
            block[place] = number;
            let tracker = tracker(&block);
            let mut state = State::new();
            for frame in 0..2 {
                let (mut outputs, mut status) = ([number; 48], [RowStatus::Decoded; 4]);
                let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
                let ohm = [number, 50.0, -number, f32::NAN, f32::INFINITY];
                let frame = Frame {
                    readings_ohm: &ohm,
                    reciprocals: Some(&ohm),
                    start_us: 1000 * frame,
                    row_us: &[number; 3],
                };
                tracker.track(&mut state, &frame, number, &mut estimate);
            }
        }
    }
}
