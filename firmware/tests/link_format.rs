//! The link's bytes, compared with those in `docs/link.md`.

mod common;

use common::request_bytes;
use firmware::circuit::{Circuit, ConstantsFault, ZeroPotential};
use firmware::link::cobs;
use firmware::link::message::{
    Configuration, ConfigurationField, EstimateReport, HealthReport, Identity, KeepFault, Kept,
    KeptBaseline, Memory, ModelFault, ModelIdentity, Refusal, Report, Request, Setting, Statistics,
    UploadState, UploadStep,
};
use firmware::link::packet::{self, PROTOCOL_VERSION};
use model_core::blob::Floats;

const START_US: u64 = 3_000_000;

const SPECIFICATION: &str = include_str!("../../docs/link.md");

/// Frames of the marked table, with the names of their messages.
fn specified() -> Vec<(&'static str, String)> {
    let table = SPECIFICATION.split("<!-- worked examples -->").nth(1).expect("the marked table");
    let lines = table.lines().filter(|line| line.starts_with('|')).skip(2);
    let cells = lines.map(|line| line.trim_matches('|').split('|').map(str::trim));
    cells.map(|mut c| (c.next().unwrap(), c.next().unwrap().trim_matches('`').into())).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

fn report_bytes(number: u16, report: &Report<'_>) -> Vec<u8> {
    let mut buffer = [0; 256];
    let mut bytes = Vec::new();
    assert!(cobs::encode(packet::encode(number, report, &mut buffer).unwrap(), |byte| {
        bytes.push(byte);
        true
    }));
    bytes
}

fn identity() -> Report<'static> {
    Report::Identity(Identity {
        board: "b",
        firmware: "0.1.0",
        rows: 8,
        columns: 18,
        outputs: 18,
        kernel: "polynomial",
        model: Some(ModelIdentity {
            crc_32: 0x1234_5678,
            slot: 1,
            generation: 3,
            rows: 1,
            inputs: 12,
            outputs: 5,
            in_ram: true,
        }),
        slot_bytes: 131_056,
        chunk_bytes: 512,
        memory: Memory { vector_table: 1024, stack_reserved: 300, ..Memory::default() },
    })
}

/// Messages about constants of the circuit and settings that are kept.
fn about_settings() -> [(&'static str, Vec<u8>); 9] {
    let circuit = ZeroPotential::<1, 2>::TYPICAL;
    let constants = circuit.constants().unwrap();
    let kept = Kept {
        configuration: None,
        constants: true,
        baseline: Some(KeptBaseline { rows: 8, columns: 18, frames: 20 }),
        writes_left: 99,
    };
    let refused = |refusal| report_bytes(9, &Report::Refused(refusal));
    [
        ("constants?", request_bytes(8, &Request::Constants)),
        ("set constants", request_bytes(8, &Request::SetConstants(constants))),
        ("kept?", request_bytes(9, &Request::Kept)),
        ("keep the baseline", request_bytes(9, &Request::Keep(Setting::Baseline))),
        ("forget the constants", request_bytes(9, &Request::Forget(Setting::Constants))),
        ("constants", report_bytes(8, &Report::Constants(constants))),
        ("kept", report_bytes(9, &Report::Kept(kept))),
        ("refused: feedback", refused(Refusal::Constants(ConstantsFault::Feedback))),
        ("refused: nothing to keep", refused(Refusal::Keep(KeepFault::Nothing))),
    ]
}

#[test]
fn messages_give_the_specifications_worked_bytes() {
    let identity = identity();
    let floats = [60.0, f32::NAN];
    let readings_ohm = Floats::of(&floats);
    let estimate = EstimateReport {
        frame: 300,
        start_us: START_US,
        flags: 2,
        row_status: &[3, 1],
        outputs: readings_ohm,
    };
    let health = HealthReport {
        frame: 300,
        start_us: START_US,
        missing: 1,
        shorted: 0,
        open: 0,
        faulty_columns: &[2, 0, 0, 0],
    };
    let statistics = Statistics {
        frames_scanned: 1,
        rows_at_rest: 8,
        longest_decode_us: 2,
        ..Statistics::default()
    };
    let upload = |step| request_bytes(6, &Request::Upload(step));
    let refused = |refusal| report_bytes(6, &Report::Refused(refusal));
    let found = [
        ("identify", request_bytes(1, &Request::Identify)),
        ("statistics?", request_bytes(2, &Request::Statistics)),
        ("configuration?", request_bytes(3, &Request::Configuration)),
        ("configure", request_bytes(300, &Request::Configure(Configuration::DEFAULT))),
        (
            "configure: rest tolerance 0.0175",
            request_bytes(
                300,
                &Request::Configure(Configuration {
                    rest_tolerance: 0.0175,
                    ..Configuration::DEFAULT
                }),
            ),
        ),
        (
            "capture baseline of 20 frames",
            request_bytes(4, &Request::CaptureBaseline { frames: 20 }),
        ),
        (
            "decode frame 300: 60 Ω, missing",
            request_bytes(5, &Request::Decode { frame: 300, readings_ohm }),
        ),
        ("begin, 1000 bytes", upload(UploadStep::Begin { length: 1000 })),
        ("chunk at 512", upload(UploadStep::Chunk { offset: 512, bytes: &[0, 1, 0, 2] })),
        ("commit", upload(UploadStep::Commit)),
        ("abort", upload(UploadStep::Abort)),
        ("restart", request_bytes(7, &Request::Restart)),
        ("set baseline: 60 Ω, unknown", request_bytes(8, &Request::SetBaseline { readings_ohm })),
        ("identity", report_bytes(1, &identity)),
        ("statistics", report_bytes(2, &Report::Statistics(statistics))),
        ("configuration", report_bytes(3, &Report::Configuration(Configuration::DEFAULT))),
        ("baseline", report_bytes(4, &Report::Baseline { readings_ohm })),
        (
            "readings",
            report_bytes(0, &Report::Readings { frame: 300, start_us: START_US, readings_ohm }),
        ),
        ("estimate", report_bytes(5, &Report::Estimate(estimate))),
        ("health", report_bytes(0, &Report::Health(health))),
        ("idle", report_bytes(6, &Report::Upload(UploadState::Idle))),
        ("receiving", report_bytes(6, &Report::Upload(UploadState::Receiving { received: 512 }))),
        (
            "committed",
            report_bytes(6, &Report::Upload(UploadState::Committed { crc_32: 0x1234_5678 })),
        ),
        ("restarting", report_bytes(7, &Report::Restarting)),
        ("refused: version", refused(Refusal::Version(PROTOCOL_VERSION))),
        (
            "refused: rest tolerance",
            refused(Refusal::Configuration(ConfigurationField::RestTolerance)),
        ),
        ("refused: too large", refused(Refusal::TooLarge { slot_bytes: 131_056 })),
        ("refused: another shape", refused(Refusal::BadModel(ModelFault::Shape))),
        ("refused: flash", refused(Refusal::Flash)),
    ];
    let all = found.into_iter().chain(about_settings());
    let found: Vec<_> = all.map(|(name, bytes)| (name, hex(&bytes))).collect();
    let table: Vec<_> = found.iter().map(|(name, hex)| format!("| {name} | `{hex}` |")).collect();
    assert!(found == specified(), "docs/link.md should say\n{}", table.join("\n"));
}

#[test]
fn every_refusal_has_the_specified_number() {
    let refusals = [
        (Refusal::Version(1), 0),
        (Refusal::Unknown, 1),
        (Refusal::FrameLength { expected: 1 }, 2),
        (Refusal::Configuration(ConfigurationField::FramePeriod), 3),
        (Refusal::Baseline, 4),
        (Refusal::TooLarge { slot_bytes: 1 }, 5),
        (Refusal::NoUpload, 6),
        (Refusal::OutOfPlace { received: 1 }, 7),
        (Refusal::BadModel(ModelFault::NotABlob), 8),
        (Refusal::Flash, 9),
        (Refusal::Constants(ConstantsFault::Fixed), 10),
        (Refusal::Keep(KeepFault::Nothing), 11),
    ];
    for (refusal, number) in refusals {
        let mut buffer = [0; 8];
        assert_eq!(postcard::to_slice(&refusal, &mut buffer).unwrap()[0], number, "{refusal:?}");
    }
}
