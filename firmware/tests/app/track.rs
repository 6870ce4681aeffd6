//! The tracker of a contact: what it sees of a frame, and when.

use taxel_core::relative::reciprocal;
use taxel_core::track::{Frame, State};
use taxel_core::{Decoder, Estimate, RowStatus};
use taxel_firmware::link::message::{Configuration, EstimateReport, Report, Request};

use crate::mock::*;

/// A configuration with a lead, which scans only on request.
fn leading() -> Configuration {
    Configuration { filter_lead_us: 1500, ..quiet() }
}

/// What taxel-core itself makes of frames one after the other.
struct Own<'b> {
    decoder: Decoder<'b, ROWS>,
    state: State,
    /// One over each reading of the baseline.
    reciprocals: Option<[f32; ROWS * COLS]>,
    /// Frames that needed no network, and that the network's estimate is left of.
    followed: u32,
    decoded: u32,
}

impl<'b> Own<'b> {
    fn new(blob: &'b [u8], baseline_ohm: Option<&TestFrame>) -> Self {
        let reciprocals =
            baseline_ohm.map(|ohm| std::array::from_fn(|at| reciprocal(ohm.as_flattened()[at])));
        let decoder = Decoder::load(blob).unwrap();
        Self { decoder, state: State::new(), reciprocals, followed: 0, decoded: 0 }
    }

    /// Bits of the outputs 1.5 ms behind the middle of a frame whose rows were read at these times.
    fn track(&mut self, start_us: u64, row_us: [f32; ROWS], frame: &TestFrame) -> Vec<u32> {
        let Self { decoder, state, .. } = self;
        let tracker = decoder.model().tracker().unwrap();
        let read = Frame {
            readings_ohm: frame.as_flattened(),
            reciprocals: self.reciprocals.as_ref().map(|all| &all[..]),
            start_us,
            row_us: &row_us,
        };
        let (mut outputs, mut status) = ([0.0; ROWS * OUTPUTS], [RowStatus::Decoded; ROWS]);
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
        if tracker.follow(state, &read) {
            self.followed += 1;
            tracker.write(state, 1500.0, &mut estimate);
            return bits(outputs);
        }
        let (mut filled, mut scratch) = (*frame, vec![0.0; decoder.scratch_floats()]);
        let reciprocals = self.reciprocals.unwrap_or([f32::NAN; ROWS * COLS]);
        decoder.fill(filled.as_flattened_mut(), &reciprocals, &mut scratch);
        let frame =
            taxel_core::Frame { readings_ohm: filled.as_flattened(), reciprocals: &reciprocals };
        decoder.decode_into(frame, &mut scratch, &mut estimate).unwrap();
        if tracker.start(state, &read, &estimate) {
            tracker.write(state, 1500.0, &mut estimate);
        } else {
            self.decoded += 1;
        }
        bits(outputs)
    }
}

/// Frames of a contact that deepens, lacks a reading now and then, and of which some are nothing that a contact does.
fn touch(frame: u32) -> TestFrame {
    let mut touch = frame_at_rest().map(|row| row.map(|ohm| ohm / (1.0 + 0.004 * frame as f32)));
    match frame % 10 {
        6 => touch[0][2] = f32::NAN,
        8 => touch = [[55.0, 70.0, 51.0], [69.0, 52.0, 68.0]],
        _ => {}
    }
    touch
}

#[test]
fn frames_are_tracked_as_in_model_core_without_filled_readings() {
    for (is_relative, gain) in [(false, None), (false, Some(1.02)), (true, Some(1.0))] {
        // A baseline tells gains from contacts, for a model that takes readings as they are, too.
        let rest = frame_at_rest().map(|row| row.map(|ohm| gain.unwrap_or(1.0) * ohm));
        let (blob, baseline) = (blob_with_tracker(is_relative), gain.map(|_| &rest));
        let mut host = started(leading(), &blob);
        if is_relative {
            let (flags, ..) = host.decode(&rest);
            assert_eq!(flags & EstimateReport::NO_BASELINE, EstimateReport::NO_BASELINE);
        }
        if let Some(baseline) = baseline {
            host.set_baseline(baseline.as_flattened());
        }
        let mut own = Own::new(&blob, baseline);
        for frame in 0..40 {
            let start_us = 2000 * u64::from(frame);
            let decoded = own.decoded;
            let expected = own.track(start_us, [0.0; ROWS], &touch(frame));
            let found = host.estimate(start_us, touch(frame).as_flattened(), |it| {
                // The network clamps every ratio, which is of no account where the tracker has written the outputs.
                let is_clamped = it.flags & EstimateReport::CLAMPED != 0;
                assert_eq!(is_clamped, is_relative && own.decoded > decoded, "{frame}");
                bits(it.outputs.iter())
            });
            assert_eq!(found, expected, "{frame}");
        }
        assert!(own.followed > 20 && own.decoded > 2, "{} {}", own.followed, own.decoded);
        // Another configuration starts the tracker anew, or turns it off.
        host.tell(&Request::Configure(Configuration { report_every: 2, ..leading() }));
        let first = Own::new(&blob, baseline).track(0, [0.0; 2], &touch(5));
        assert_eq!(host.decode(&touch(5)).2, first);
        host.tell(&Request::Configure(Configuration { track: false, ..leading() }));
        let raw = host.decode(&touch(5)).2;
        assert_eq!(host.decode(&touch(5)).2, raw);
        assert_ne!(raw, first);
    }
}

#[test]
fn rows_of_a_scan_were_read_one_after_the_other() {
    let blob = blob_with_tracker(false);
    let scanning = Configuration { frame_period_us: 2000, send_readings: true, ..leading() };
    for scans_alone in [false, true] {
        let mut host = started(scanning, &blob);
        host.pins_mut().scans_alone = scans_alone;
        let (mut own, mut compared) = (Own::new(&blob, None), 0);
        for frame in 1..=20 {
            *host.frame() = touch(frame);
            host.pins_mut().scan_us = 190;
            host.run_until(2000 * frame + 1000);
            let mut expected = Vec::new();
            host.find(|_, report| {
                match report {
                    Report::Readings { start_us, .. } => {
                        // Half of the scan each, a look at the clock included, or what the source says.
                        let row_us = if scans_alone { [40.0, 110.0] } else { [50.25, 150.75] };
                        expected = own.track(start_us, row_us, &touch(frame));
                    }
                    Report::Estimate(it) => {
                        assert_eq!(bits(it.outputs.iter()), expected, "{frame}");
                        compared += 1;
                    }
                    _ => {}
                }
                None::<()>
            });
            host.pins_mut().to_host.clear();
        }
        assert!(compared == 20 && own.followed > 8, "{compared} {}", own.followed);
    }
}
