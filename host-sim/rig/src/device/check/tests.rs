//! Findings, and which of them count as good.

use super::*;

fn good() -> Findings {
    let device = DeviceIdentity {
        board: "b".into(),
        firmware: "0".into(),
        rows: 1,
        columns: 1,
        outputs: 1,
        exponential: "libm".into(),
        model: None,
        model_name: String::new(),
        slot_bytes: 0,
        chunk_bytes: 0,
        memory: taxel_firmware::link::message::Memory::default(),
        key: taxel_firmware::link::message::KeyState::None,
        unique_id: [0; 12],
        counter: 0,
        wires_crc_32: 0,
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
