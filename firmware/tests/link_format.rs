//! The link's bytes, compared with those in `testdata/link-examples.txt` and in `docs/link.md`.

use crate::mock::{framed, request_bytes};
use taxel_core::blob::Floats;
use taxel_firmware::circuit::{ConstantsFault, ZeroPotential};
use taxel_firmware::link::message::{
    Configuration, ConfigurationField, EstimateReport, EventReport, HealthReport, Identity,
    KeepFault, Kept, KeptBaseline, Memory, ModelFault, ModelIdentity, Refusal, Report, Request,
    Setting, Statistics, UploadState, UploadStep,
};
use taxel_firmware::link::packet::{self, PROTOCOL_VERSION};
use taxel_firmware::readout::Diagnosis;

const START_US: u64 = 3_000_000;

const EXAMPLES: &str = include_str!("../../testdata/link-examples.txt");
const SPECIFICATION: &str = include_str!("../../docs/link.md");

/// Names of messages and their frames: lines `NAME = 03 0a …`.
fn specified() -> Vec<(&'static str, String)> {
    let lines = EXAMPLES.lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| line.split_once(" = ").expect(line)).map(|(n, hex)| (n, hex.into())).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

fn report_bytes(number: u16, report: &Report<'_>) -> Vec<u8> {
    framed(packet::encode(number, report, &mut [0; 256]).unwrap())
}

fn refused(number: u16, refusal: Refusal) -> Vec<u8> {
    report_bytes(number, &Report::Refused(refusal))
}

type Example = (&'static str, Vec<u8>);

/// Numbers of the examples: a reading, and a missing one.
const OHM: [f32; 2] = [60.0, f32::NAN];

fn requests() -> Vec<Example> {
    let readings_ohm = Floats::new(&OHM);
    // A blob of 1000 bytes for the paper's sensor, with one network for all rows.
    let head = *b"TAXL\x03\xe8\x03\0\0\x08\x12\x12\x01\x08\0\0";
    let default = Configuration::DEFAULT;
    let filtering = Configuration {
        filter_time_constant_us: 5000,
        filter_lead_us: 2000,
        report_every: 10,
        ..default
    };
    let decode = Request::Decode { frame: 300, start_us: START_US, readings_ohm };
    let capture = Request::CaptureBaseline { frames: 20 };
    let configure = |configuration| request_bytes(300, &Request::Configure(configuration));
    let upload = |step| request_bytes(6, &Request::Upload(step));
    vec![
        ("identify", request_bytes(1, &Request::Identify)),
        ("statistics?", request_bytes(2, &Request::Statistics)),
        ("configuration?", request_bytes(3, &Request::Configuration)),
        ("configure", configure(default)),
        (
            "configure: contact threshold 0.0175",
            configure(Configuration { contact_threshold: 0.0175, ..default }),
        ),
        ("configure: filter of 5 ms, lead 2 ms, a report every 10 scans", configure(filtering)),
        ("capture baseline of 20 frames", request_bytes(4, &capture)),
        ("decode frame 300: 60 Ω, missing", request_bytes(5, &decode)),
        ("begin: 8 × 18 → 18, 1000 bytes", upload(UploadStep::Begin { head: &head })),
        ("chunk at 512", upload(UploadStep::Chunk { offset: 512, bytes: &[0, 1, 0, 2] })),
        ("try", upload(UploadStep::Try { trial_ms: 60_000 })),
        ("abort", upload(UploadStep::Abort)),
        ("confirm", upload(UploadStep::Confirm)),
        ("restart", request_bytes(7, &Request::Restart)),
        ("undo", request_bytes(7, &Request::Undo { crc_32: 0x1234_5678 })),
        ("set baseline: 60 Ω, unknown", request_bytes(8, &Request::SetBaseline { readings_ohm })),
        ("resume", request_bytes(8, &Request::Resume)),
    ]
}

fn identity() -> Report<'static> {
    Report::Identity(Identity {
        board: "b",
        firmware: "0.1.0",
        rows: 8,
        columns: 18,
        outputs: 18,
        model: Some(ModelIdentity {
            crc_32: 0x1234_5678,
            slot: 1,
            generation: 3,
            rows: 1,
            inputs: 12,
            outputs: 5,
            in_ram: true,
            scene_digest: 300,
            inputs_crc_32: 0x1234_5678,
            outputs_crc_32: 2,
            on_trial: true,
        }),
        model_name: "press",
        slot_bytes: 131_056,
        chunk_bytes: 512,
        memory: Memory { vector_table: 1024, stack_reserved: 300, ..Memory::default() },
        unique_id: *b"an STM32F446",
        wires_crc_32: 3,
    })
}

/// Messages about constants of the circuit and settings that are kept.
fn about_settings() -> [(&'static str, Vec<u8>); 12] {
    let circuit = ZeroPotential::<1, 2>::TYPICAL;
    let constants = circuit.constants();
    let kept = Kept {
        configuration: None,
        constants: true,
        baseline: Some(KeptBaseline { rows: 8, columns: 18, frames: 20 }),
        writes_left: 99,
    };
    let diagnosis = Diagnosis {
        reference: 1501,
        temperature: 959,
        factory: [1501, 959, 1207],
        items: [9, 9, 162, 1],
        has_stopped: true,
        pass_cycles: 300,
        ..Diagnosis::default()
    };
    [
        ("constants?", request_bytes(8, &Request::Constants)),
        ("set constants", request_bytes(8, &Request::SetConstants(constants))),
        ("kept?", request_bytes(9, &Request::Kept)),
        ("keep the baseline", request_bytes(9, &Request::Keep(Setting::Baseline))),
        ("forget the constants", request_bytes(9, &Request::Forget(Setting::Constants))),
        ("set the brown-out level", request_bytes(9, &Request::SetBrownOut)),
        ("diagnose", request_bytes(10, &Request::Diagnose)),
        ("constants", report_bytes(8, &Report::Constants(constants))),
        ("kept", report_bytes(9, &Report::Kept(kept))),
        ("diagnosis", report_bytes(10, &Report::Diagnosis(diagnosis))),
        ("refused: feedback", refused(9, Refusal::Constants(ConstantsFault::Feedback))),
        ("refused: nothing to keep", refused(9, Refusal::Keep(KeepFault::Nothing))),
    ]
}

fn reports() -> Vec<Example> {
    let readings_ohm = Floats::new(&OHM);
    let estimate = EstimateReport {
        frame: 300,
        start_us: START_US,
        flags: 2,
        row_status: &[0, 1],
        outputs: readings_ohm,
        ..Default::default()
    };
    let novel = EstimateReport {
        flags: 128,
        outputs: Floats::new(&[0.25, -1.0]),
        novelty: Some(2.5),
        deviation: Floats::new(&[0.03125, 0.5]),
        ..estimate
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
        longest_decode_us: 2,
        slot_erases: 1,
        longest_latency_us: 2,
        ..Statistics::default()
    };
    let configuration = Report::Configuration(Configuration::DEFAULT);
    let event =
        EventReport { frame: 300, start_us: START_US, after_us: 2000, changed: 4, going_on: 5 };
    let readings = Report::Readings { frame: 300, start_us: START_US, readings_ohm };
    let (crc_32, threshold) = (0x1234_5678, ConfigurationField::ContactThreshold);
    vec![
        ("identity", report_bytes(1, &identity())),
        ("statistics", report_bytes(2, &Report::Statistics(statistics))),
        ("configuration", report_bytes(3, &configuration)),
        ("baseline", report_bytes(4, &Report::Baseline { readings_ohm })),
        ("readings", report_bytes(0, &readings)),
        ("estimate", report_bytes(5, &Report::Estimate(estimate))),
        ("estimate with confidence", report_bytes(5, &Report::Estimate(novel))),
        ("event", report_bytes(0, &Report::Event(event))),
        ("health", report_bytes(0, &Report::Health(health))),
        ("idle", report_bytes(6, &Report::Upload(UploadState::Idle))),
        ("receiving", report_bytes(6, &Report::Upload(UploadState::Receiving { received: 512 }))),
        ("on trial", report_bytes(6, &Report::Upload(UploadState::OnTrial { crc_32 }))),
        ("confirmed", report_bytes(6, &Report::Upload(UploadState::Confirmed { crc_32 }))),
        ("trial over", report_bytes(0, &Report::Upload(UploadState::TrialOver { crc_32 }))),
        ("refused: nothing to undo", refused(6, Refusal::NothingToUndo)),
        ("restarting", report_bytes(7, &Report::Restarting)),
        ("refused: version", refused(6, Refusal::Version(PROTOCOL_VERSION))),
        ("refused: unknown", refused(6, Refusal::Unknown)),
        ("refused: 2 readings expected", refused(6, Refusal::FrameLength { expected: 2 })),
        ("refused: baseline", refused(6, Refusal::Baseline)),
        ("refused: no upload", refused(6, Refusal::NoUpload)),
        ("refused: 512 bytes received", refused(6, Refusal::OutOfPlace { received: 512 })),
        ("refused: on trial", refused(6, Refusal::OnTrial)),
        ("refused: trial over", refused(6, Refusal::TrialOver)),
        ("refused: contact threshold", refused(6, Refusal::Configuration(threshold))),
        ("refused: too large", refused(6, Refusal::TooLarge { slot_bytes: 131_056 })),
        ("refused: another shape", refused(6, Refusal::BadModel(ModelFault::Shape))),
        ("refused: flash", refused(6, Refusal::Flash)),
        ("refused: erased too often", refused(6, Refusal::TooSoon { wait_us: 600_000_000 })),
    ]
}

#[test]
fn messages_give_the_specifications_worked_bytes() {
    let found = [requests(), reports(), about_settings().to_vec()].concat();
    let found: Vec<_> = found.iter().map(|(name, bytes)| (*name, hex(bytes))).collect();
    let lines: Vec<_> = found.iter().map(|(name, hex)| format!("{name} = {hex}")).collect();
    assert!(found == specified(), "testdata/link-examples.txt should say\n{}", lines.join("\n"));
}

#[test]
fn the_example_of_the_page_is_one_of_those() {
    let table = SPECIFICATION.split("<!-- worked example -->").nth(1).expect("the marked table");
    let lines = table.lines().filter(|line| line.starts_with('|')).skip(2);
    let cells = lines.map(|line| line.trim_matches('|').split('|').map(str::trim));
    let page: Vec<(_, String)> = cells
        .map(|mut c| (c.next().unwrap(), c.next().unwrap().trim_matches('`').into()))
        .collect();
    let specified = specified();
    assert!(!page.is_empty() && page.iter().all(|it| specified.contains(it)), "{page:?}");
}
