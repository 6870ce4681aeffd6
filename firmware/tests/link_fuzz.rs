//! Ten million random and mutated bytes, sent to the running application.

use firmware::app::Session;
use firmware::link::message::{ConfidenceSent, Configuration, Request, UploadStep};
use mock_board::*;
use model_core::blob::Floats;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Number of bytes sent to the device in all.
const BYTES: usize = 10_000_000;

/// Requests whose bytes are damaged: one of each kind that does no harm when it is repeated. (A restart and a
/// commit would end the session.)
fn requests(readings: &[f32]) -> Vec<Vec<u8>> {
    let all = [
        Request::Identify,
        Request::Statistics,
        Request::Configuration,
        configure(quiet()),
        Request::Configure { configuration: quiet(), lease_ms: 20 },
        Request::Resume,
        Request::CaptureBaseline { frames: 1 },
        Request::Decode { frame: 1, readings_ohm: Floats::of(readings) },
        Request::Upload(UploadStep::Begin { head: b"TAXL\x01\x64\0\0\0\x02\x03\x02\x01\x02\0\0" }),
        Request::Upload(UploadStep::Chunk { offset: 0, bytes: &[0; 60] }),
        Request::Upload(UploadStep::Abort),
    ];
    all.iter().zip(1..).map(|(request, number)| request_bytes(number, request)).collect()
}

/// Bytes as a bad line may deliver them, spoilt in one of several ways.
fn spoil(random: &mut Xoshiro256PlusPlus, requests: &[Vec<u8>]) -> Vec<u8> {
    let mut below = |end: usize| random.next_u32() as usize % end.max(1);
    let mut bytes = requests[below(requests.len())].clone();
    let place = below(bytes.len());
    match below(8) {
        0 => bytes[place] ^= 1 << below(8),
        1 => drop(bytes.remove(place)),
        2 => bytes.insert(place, below(256) as u8),
        3 => bytes.truncate(place),
        4 => bytes.extend(requests[below(requests.len())].clone()), // doubled, reordered
        5 => bytes.rotate_left(place),
        6 => {
            let length = below(400);
            bytes = (0..length).map(|_| below(256) as u8).collect();
        }
        _ => {
            let length = below(400);
            bytes = (0..length).map(|_| 1 + below(255) as u8).collect(); // no end in sight
        }
    }
    bytes
}

#[test]
fn no_bytes_stop_the_device_and_the_second_request_after_them_is_answered() {
    let model = blob_with_confidence(false);
    let mut slots = MockSlot::pair_with(&model);
    let confidence = ConfidenceSent::Deviations;
    let mut bench = Bench::new(Configuration { frame_period_us: 50_000, confidence, ..quiet() });
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let requests = requests(&[60.0; ROWS * COLS]);

    let (mut given, mut answered_at_once, mut bursts) = (0, 0_u32, 0_u32);
    while given < BYTES {
        // A burst of damage, and then two good requests. The first may be lost in a frame that has not
        // ended; the second must be answered.
        let mut burst = Vec::new();
        for _ in 0..=random.next_u32() % 8 {
            burst.extend(spoil(&mut random, &requests));
        }
        given += burst.len();
        board.pins.borrow_mut().to_device.extend(burst);
        assert_eq!(settle(&mut session, &board), None);
        board.pins.borrow_mut().to_host.clear();
        for number in [60_001, 60_002] {
            let request = request_bytes(number, &Request::Identify);
            board.pins.borrow_mut().to_device.extend(request);
        }
        assert_eq!(settle(&mut session, &board), None);
        let reports = reports(&board.pins.borrow().to_host);
        let answered = |n: u16| {
            let identity =
                |(number, text): &&(u16, String)| *number == n && text.starts_with("Identity");
            reports.iter().find(identity).is_some()
        };
        assert!(answered(60_002), "after {given} bytes: {reports:?}");
        answered_at_once += u32::from(answered(60_001));
        bursts += 1;
    }
    assert_eq!(model_crc(&mut session, &board), Some(crc_of(&model)));
    println!(
        "{given} bytes in {bursts} bursts; the first request after {answered_at_once} of them \
              was answered, the second after all"
    );
    // Both kinds of bursts occurred: those that end a frame, and those that leave one open.
    assert!(answered_at_once > bursts / 10 && answered_at_once < bursts - bursts / 10);
}
