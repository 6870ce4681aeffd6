//! Events of a touch: what is reported, and what the board's pins show.

use taxel_firmware::link::message::{Configuration, EventReport, Report, Request};

use crate::mock::*;

/// Scans the frames, one a ms. Returns the events, each with what the pins showed as the first byte of its scan was sent.
fn events(
    configuration: Configuration,
    blob: &[u8],
    frames: &[TestFrame],
) -> Vec<(EventReport, [bool; 3])> {
    let mut host = started(Configuration { frame_period_us: 1000, ..configuration }, blob);
    host.set_baseline(frame_at_rest().as_flattened());
    host.pins_mut().scan_us = 300;
    let (mut events, mut time) = (Vec::new(), host.pins().now_us);
    for frame in frames {
        *host.frame() = *frame;
        host.pins_mut().to_host.clear();
        time += 1000;
        host.run_until(time);
        let signal = host.pins().signal_at_first_byte;
        let mut order = Vec::new();
        host.find(|_, report| {
            match report {
                Report::Event(event) => {
                    events.push((event, signal));
                    order.push(event.frame);
                }
                Report::Estimate(estimate) => order.push(estimate.frame),
                _ => {}
            }
            None::<()>
        });
        assert!(order.len() <= 2 && order.first() == order.last(), "{order:?}");
    }
    events
}

/// What changed, and what goes on behind it.
fn bits(events: &[(EventReport, [bool; 3])]) -> Vec<[u8; 2]> {
    events.iter().map(|(event, _)| [event.changed, event.going_on]).collect()
}

#[test]
fn touch_and_load_are_shown_and_reported_before_the_estimate() {
    let (blob, rest, pressed) = (blob(3, 4), frame_at_rest(), frame_with(0, 0, 57.0));
    let frames = [rest, pressed, pressed, rest, rest];
    let found = events(Configuration::DEFAULT, &blob, &frames);
    assert_eq!(bits(&found), [[1, 1], [1, 0]]);
    let [(begin, shown), (end, shown_then)] = found[..] else { unreachable!() };
    assert_eq!((end.frame - begin.frame, shown), (2, [true, false, false]));
    assert_eq!((end.start_us / 1000 - begin.start_us / 1000, shown_then), (2, [false; 3]));
    // A scan of 310 µs, and looks at the clock.
    assert!((311..340).contains(&begin.after_us), "{}", begin.after_us);
    // The load is the force, or else the largest output.
    let loaded = |blob: &[u8]| {
        let configuration = Configuration { load_threshold: 1.05, ..Configuration::DEFAULT };
        bits(&events(configuration, blob, &frames))
    };
    assert_eq!(loaded(&blob), [[3, 3], [1, 2]]); // up to 1.06, and then 1.005
    assert_eq!(loaded(&blob_of_units("mm\nmm\nmm\nN")), [[1, 1], [1, 0]]); // 1.005
    assert_eq!(loaded(&blob_of_units("mm\nN\nmm\nN")), [[1, 1], [1, 0]]); // the last force is that along z
}

#[test]
fn pins_show_nothing_while_nothing_is_scanned() {
    let scanning = Configuration { frame_period_us: 1000, ..Configuration::DEFAULT };
    let mut host = started(scanning, &blob(3, 4));
    host.set_baseline(frame_at_rest().as_flattened());
    *host.frame() = frame_with(0, 0, 57.0);
    let now_us = host.pins().now_us;
    host.run_until(now_us + 5000);
    assert_eq!(host.pins().signal, [true, false, false]);
    host.tell(&Request::Configure(Configuration { frame_period_us: 0, ..scanning }));
    assert_eq!(host.pins().signal, [false; 3]);
    host.decode(&frame_with(0, 0, 57.0));
    assert_eq!(host.pins().signal, [false; 3]);
}

#[test]
fn a_tracked_contact_that_moves_slips() {
    let blob = blob_with_tracker(false);
    // It rests above the first row for 80 ms, and moves to the second in 40 ms.
    let frame = |ms: u16| {
        let moved = f32::from(ms.clamp(80, 120) - 80) / 40.0;
        let [first, second] = frame_at_rest();
        [first.map(|ohm| ohm * (0.9 + 0.1 * moved)), second.map(|ohm| ohm * (1.0 - 0.1 * moved))]
    };
    let frames: Vec<TestFrame> = (0..150).map(frame).collect();
    let found = events(Configuration::DEFAULT, &blob, &frames);
    assert_eq!(bits(&found), [[1, 1], [4, 5]]);
    let (slip, shown) = found[1];
    let after = slip.frame - found[0].0.frame;
    assert!((80..120).contains(&after) && shown == [true, false, true], "{after} {shown:?}");
    for configuration in [
        Configuration { slip_mm_per_s: 0.0, ..Configuration::DEFAULT },
        Configuration { track: false, ..Configuration::DEFAULT },
    ] {
        assert_eq!(bits(&events(configuration, &blob, &frames)), [[1, 1]]);
    }
}
