//! Findings: what counts as good.

use super::*;

fn good() -> Findings {
    let device = DeviceIdentity {
        board: "b".into(),
        firmware: "0".into(),
        rows: 1,
        columns: 1,
        outputs: 1,
        kernel: "libm".into(),
        model: None,
        slot_bytes: 0,
        chunk_bytes: 0,
        memory: firmware::link::message::Memory::default(),
    };
    let uploads = UploadFindings {
        blob_bytes: 1,
        good_came_into_force: true,
        damaged: 7,
        damaged_refused: 7,
        interrupted: 3,
        old_stayed: 3,
    };
    let garbage = GarbageFindings { bytes: 9, requests_until_answer: 2, decodes_as_before: true };
    Findings {
        device,
        statistics: Statistics::default(),
        frames: FrameFindings { frames: 5, bit_identical: 5, frames_per_s: 1.0 },
        scans: None,
        uploads: Some(uploads),
        garbage: Some(garbage),
        repeated: 0,
        damaged: 0,
    }
}

#[test]
fn any_one_thing_wrong_is_not_all_good() {
    assert!(good().all_good());
    let spoilers: [fn(&mut Findings); 8] = [
        |f| f.frames.bit_identical = 4,
        |f| f.uploads.as_mut().unwrap().good_came_into_force = false,
        |f| f.uploads.as_mut().unwrap().damaged_refused = 6,
        |f| f.uploads.as_mut().unwrap().old_stayed = 2,
        |f| f.garbage.as_mut().unwrap().decodes_as_before = false,
        |f| f.garbage.as_mut().unwrap().requests_until_answer = 3,
        |f| f.repeated = 1,
        |f| f.damaged = 1,
    ];
    for (index, spoil) in spoilers.iter().enumerate() {
        let mut findings = good();
        spoil(&mut findings);
        assert!(!findings.all_good(), "{index}");
    }
}

#[test]
fn one_bit_of_one_output_makes_a_frame_another() {
    let expected = Expected {
        readings_ohm: vec![60.0; 4],
        outputs: vec![0.5, -0.25, 0.0, 1.0],
        per_frame: [2, 2],
    };
    assert!(expected.is_same(1, [0.0, 1.0].into_iter()));
    let next = f32::from_bits(1.0_f32.to_bits() + 1);
    for wrong in [&[0.0, next][..], &[-0.0, 1.0], &[0.0], &[0.0, 1.0, 2.0], &[0.5, -0.25]] {
        assert!(!expected.is_same(1, wrong.iter().copied()), "{wrong:?}");
    }
    assert!(!expected.is_same(2, std::iter::empty()));
}
