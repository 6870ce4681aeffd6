//! The host's end of the link against the firmware's application, which runs here in a thread.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::common::{Folder, unrefined};
use crate::virtual_device::Line;
use taxel_core::blob::{Floats, ModelParts, encode_to_vec};
use taxel_core::confidence::{Confidence, Sizes};
use taxel_core::filter::Settings;
use taxel_data::{Silent, Stream, Table};
use taxel_firmware::link::message::{
    Configuration, EstimateReport, Refusal, Report, Request, UploadStep,
};
use taxel_learn::{Decoder, Filtered, ModelBlob, Timing};
use taxel_rig::Error;
use taxel_rig::device::check::{Frames, Plan, check};
use taxel_rig::device::{Device, Wire, request_bytes, upload};
use taxel_rig::emulator::{self, Emulator};
use taxel_simulate::{Synthesis, World, synthesise};

pub const SOUND: Line = Line { one_in: None };

pub fn press() -> World {
    World::press()
}

/// Model of `press` with so many centres, trained once for all tests.
pub fn model(centres: usize) -> ModelBlob {
    static TRAINED: Mutex<BTreeMap<usize, Vec<u8>>> = Mutex::new(BTreeMap::new());
    let mut trained = TRAINED.lock().unwrap();
    let bytes = trained.entry(centres).or_insert_with(|| {
        let mut scene = unrefined("press");
        (scene.training.frames, scene.training.centres) = (500, centres);
        scene.train(&Silent).unwrap().bytes().to_vec()
    });
    ModelBlob::of_bytes(bytes).unwrap()
}

/// The model with a confidence: of the mean reading and what that leaves out, with two components.
fn with_confidence(model: &ModelBlob) -> ModelBlob {
    let model = model.parse();
    let sizes = Sizes { readings: 144, directions: 1, components: 2, outputs: 144 };
    let component = |offset: f32| vec![-1.0, offset, 0.5, 1.0, 0.25, 0.5];
    let variances = (0..2 * 144).map(|i| 0.01 + i as f32 / 1000.0).collect();
    let block = [
        vec![60.0; 144],       // mean
        vec![0.5; 144],        // scale
        vec![0.0],             // start
        vec![1.0 / 12.0; 144], // direction
        component(0.0),
        component(1.0),
        variances,
        vec![2.0; 144], // ratios
        vec![20.0],     // threshold
    ]
    .concat();
    let networks: Vec<_> = model.networks().collect();
    let row_network: Vec<u8> = (0..8).map(|row| model.network_of_row(row).unwrap() as u8).collect();
    let parts = ModelParts {
        projection: model.projection(),
        confidence: Some(Confidence::new(sizes, &block).unwrap()),
        ..ModelParts::new(&networks, &row_network, *model.metadata())
    };
    ModelBlob::of_bytes(&encode_to_vec(&parts).unwrap()).unwrap()
}

/// So many test frames, for a model that needs no baseline.
pub fn frames_of(frames: usize) -> Frames {
    let readings = synthesise(&press(), Stream::Test, frames).inputs;
    Frames { start_us: (0..frames as u64).collect(), readings, baseline_ohm: None }
}

/// Ideal readings of a few frames, for a device that scans.
pub fn frames() -> Vec<[[f32; 18]; 8]> {
    let readings = synthesise(&press(), Stream::Test, 5).inputs;
    let frame = |line: &[f64]| {
        let mut frame = [[0.0; 18]; 8];
        let places = frame.as_flattened_mut().iter_mut();
        places.zip(line).for_each(|(place, reading)| *place = *reading as f32);
        frame
    };
    readings.lines().map(frame).collect()
}

/// Device with `model`, at the other end of a socket.
pub fn device(line: Line, model: &ModelBlob) -> Device {
    Device::new(socket(line, model)).unwrap()
}

/// Line to a device with `model`.
fn socket(line: Line, model: &ModelBlob) -> TcpStream {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let near = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    let (far, _) = listener.accept().unwrap();
    far.set_nonblocking(true).unwrap();
    near.set_nodelay(true).unwrap();
    crate::virtual_device::run(Patient(far), line, model.bytes(), frames());
    near
}

/// Socket whose reads do not block and whose writes do.
struct Patient(TcpStream);

impl std::io::Read for Patient {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        self.0.read(bytes)
    }
}

impl std::io::Write for Patient {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        loop {
            match self.0.write(bytes) {
                Err(cause) if cause.kind() == std::io::ErrorKind::WouldBlock => {
                    std::thread::yield_now();
                }
                other => return other,
            }
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

#[test]
fn a_sound_device_decodes_as_the_host_does() {
    let model = model(16);
    let mut device = device(SOUND, &model);
    let plan = Plan { window: 4, filter: Settings::default() };
    let findings = check(&mut device, &frames_of(500), &model, &plan, &Silent).unwrap();
    assert!(findings.all_good(), "{findings:#?}");
    assert_eq!(findings.frames.bit_identical, 500);
}

/// Requests of every kind, refused ones and garbage included, each with the number of its answers.
fn requests(new: &ModelBlob) -> Vec<(Vec<u8>, usize)> {
    let mut requests = Vec::new();
    let mut add = |request: &Request<'_>| {
        requests.push((request_bytes(requests.len() as u16 + 1, request).unwrap(), 1));
    };
    add(&Request::Identify);
    add(&Request::Configuration);
    let readings = frames();
    for (frame, readings_ohm) in (0..).zip(readings.iter().cycle().take(40)) {
        let readings_ohm = Floats::new(readings_ohm.as_flattened());
        add(&Request::Decode { frame, start_us: 0, readings_ohm });
    }
    add(&Request::Decode { frame: 40, start_us: 0, readings_ohm: Floats::new(&[60.0; 7]) });
    add(&Request::Upload(UploadStep::Chunk { offset: 0, bytes: &[1; 8] }));
    add(&Request::Upload(upload::begin(new.bytes())));
    for (index, bytes) in new.bytes().chunks(512).enumerate() {
        add(&Request::Upload(UploadStep::Chunk { offset: 512 * index as u32, bytes }));
    }
    add(&Request::Upload(UploadStep::Try { trial_ms: 60_000 }));
    add(&Request::Identify);
    let again = Floats::new(readings[0].as_flattened());
    add(&Request::Decode { frame: 41, start_us: 0, readings_ohm: again });
    // Garbage, with zeros within it and at its end.
    let garbage: Vec<u8> = (0..40_000_u32).map(|n| (n * n / 7) as u8).chain([0]).collect();
    requests.push((garbage, 0));
    let identify = request_bytes(1000, &Request::Identify).unwrap();
    requests.push((identify, 1));
    requests
}

/// Bytes of all answers of the device.
fn answers(mut wire: impl Wire, requests: &[(Vec<u8>, usize)]) -> Vec<u8> {
    wire.set_read_timeout(Duration::from_secs(20)).unwrap();
    let (mut answers, mut expected) = (Vec::new(), 0);
    for (request, answered) in requests {
        wire.write_all(request).unwrap();
        expected += answered;
        // Every answer ends with a zero.
        while answers.split(|byte| *byte == 0).count() <= expected {
            let mut bytes = [0; 4096];
            let count = wire.read(&mut bytes).unwrap();
            answers.extend_from_slice(&bytes[..count]);
        }
    }
    answers
}

#[test]
fn a_mailbox_carries_the_bytes_that_a_serial_line_carries() {
    let (old, new) = (model(3), model(4));
    let requests = requests(&new);
    let serial = answers(socket(SOUND, &old), &requests);
    let (host, end) = crate::virtual_device::mailbox::pair();
    crate::virtual_device::run(end, SOUND, old.bytes(), frames());
    assert!(answers(host, &requests) == serial, "other bytes through the mailbox");
    // More bytes than a ring holds, so that they wrap around its end.
    assert!(serial.len() > 16_384, "{} bytes", serial.len());
}

/// The image's file comes from the environment, since this needs QEMU and a toolchain for the target.
#[test]
#[ignore = "needs QEMU and the image: `cargo xtask emulate application` runs it"]
fn the_image_answers_alike_on_both_lines() {
    let image = std::env::var_os("TAXEL_IMAGE").expect("TAXEL_IMAGE is the path of qemu-app");
    let folder = Folder::new("both_lines");
    let (old, new) = (model(3), model(4));
    let blob = folder.write("old.bin", old.bytes());
    let requests = requests(&new);
    let answers = [None, Some(folder.path("mailbox.ram"))].map(|mailbox| {
        let options = emulator::Options {
            qemu: "qemu-system-arm".into(),
            image: image.clone().into(),
            model: Some(blob.clone()),
            log: None,
            mailbox,
        };
        let (_emulator, link) = Emulator::start(&options).unwrap();
        answers(link, &requests)
    });
    assert!(answers[0] == answers[1], "other bytes through the mailbox");
    assert_eq!(folder.names(), ["old.bin"], "the mailbox goes with the emulator");
}

#[test]
fn another_model_on_the_device_is_replaced_by_the_one_checked_with() {
    let mut device = device(SOUND, &model(3));
    let wanted = model(5);
    let plan = Plan { window: 1, filter: Settings::default() };
    let findings = check(&mut device, &frames_of(20), &wanted, &plan, &Silent).unwrap();
    assert!(findings.all_good(), "{findings:#?}");
    assert_eq!(findings.device.model.unwrap().crc_32, wanted.parse().crc());
}

#[test]
fn a_device_divides_by_its_baseline_as_the_host_does() {
    for each_row in [true, false] {
        let mut scene = unrefined("press");
        (scene.training.frames, scene.training.centres) = (500, 5);
        (scene.training.relative_inputs, scene.training.each_row) = (true, each_row);
        let model = scene.train(&Silent).unwrap();
        let mut device = device(SOUND, &model);
        // A device without a baseline decodes nothing, and says why.
        let unknown = synthesise(&press(), Stream::Test, 1).inputs;
        let readings: Vec<f32> = unknown.values.iter().map(|ohm| *ohm as f32).collect();
        taxel_rig::device::stream::decode_frames(&mut device, &readings, &[0], 1, |_, estimate| {
            assert_eq!(estimate.flags, EstimateReport::NO_BASELINE);
            assert!(estimate.outputs.iter().all(f32::is_nan));
        })
        .unwrap();
        // The gain drifts by 2 %, and the baseline with it.
        let drifted = |mut table: Table| {
            table.values.iter_mut().for_each(|ohm| *ohm *= 1.02);
            table
        };
        let session = Synthesis::new(&scene.world);
        let baseline_ohm = Some(drifted(session.baselines(Stream::Test, 1, 100)).values);
        let Frames { readings, start_us, .. } = frames_of(50);
        let frames = Frames { readings: drifted(readings), baseline_ohm, start_us };
        let plan = Plan { window: 1, filter: Settings::default() };
        let findings = check(&mut device, &frames, &model, &plan, &Silent).unwrap();
        assert!(findings.all_good(), "{findings:#?}");
    }
}

#[test]
fn a_device_tells_novelty_and_deviations_as_the_host_does() {
    let model = with_confidence(&model(3));
    let mut device = device(SOUND, &model);
    let plan = Plan { window: 1, filter: Settings::default() };
    let mut frames = frames_of(30);
    // One is far from all others, and one lacks a reading.
    frames.readings.values[..144].fill(900.0);
    frames.readings.values[144] = f64::NAN;
    let findings = check(&mut device, &frames, &model, &plan, &Silent).unwrap();
    assert!(findings.all_good(), "{findings:#?}");
    let novel = findings.statistics.frames_novel;
    assert!(novel > 0 && novel < 30, "{novel}");
}

#[test]
fn over_a_line_that_spoils_bytes_everything_still_arrives() {
    let old = model(3);
    // One byte in some 3000 is lost, changed or turned into the end of a frame: this spoils a fifth of
    // the frames.
    let mut device = device(Line { one_in: Some(3000) }, &old);
    device.patience = Duration::from_millis(100);
    let new = model(16);
    let identity = upload::replace(&mut device, new.bytes(), &Silent).unwrap();
    assert_eq!(identity.model.unwrap().crc_32, new.parse().crc());
    let plan = Plan { window: 1, filter: Settings::default() };
    let findings = check(&mut device, &frames_of(30), &new, &plan, &Silent).unwrap();
    assert_eq!(findings.frames.bit_identical, 30);
    assert!(findings.repeated > 0 && !findings.all_good(), "the line was sound");
}

#[test]
fn refusals_and_silence_are_told_apart() {
    let model = model(3);
    let mut device = device(SOUND, &model);
    let mut large = model.bytes().to_vec();
    large[5..9].fill(0xFF);
    let refusal = upload::step(&mut device, upload::begin(&large)).unwrap();
    assert_eq!(refusal, Err(Refusal::TooLarge { slot_bytes: 128 * 1024 }));
    // A report that does not belong to the request is no answer.
    let strange = device.ask_plainly(&Request::Statistics, |report| match report {
        Report::Identity(_) => Some(()),
        _ => None,
    });
    assert!(
        matches!(strange, Err(Error::Unexpected { request, .. }) if request.contains("Statistics"))
    );
}

#[test]
fn a_device_that_never_pauses_does_not_hold_the_host() {
    // The device scans as fast as it can, and its reports alone keep the line busy.
    let mut device = device(SOUND, &model(3));
    let busy = Configuration {
        frame_period_us: 100,
        send_readings: true,
        send_estimates: true,
        ..Configuration::DEFAULT
    };
    device.configure(busy).unwrap();
    let mut reports = 0_u32;
    let busy_line = device.hear(Instant::now() + Duration::from_secs(20), |_, _| {
        reports += 1;
        (reports > 100).then_some(())
    });
    assert_eq!(busy_line.unwrap(), Some(()), "{reports} reports");
    let start = Instant::now();
    let heard = device.hear(start + Duration::from_millis(300), |_, _| None::<()>);
    assert_eq!(heard.unwrap(), None);
    assert!(start.elapsed() < Duration::from_secs(5));
    // Afterwards the default is active, which has no scans here.
    device.while_paused(Device::identify).unwrap();
    assert_eq!(device.configuration().unwrap().frame_period_us, 0);
}

#[test]
fn a_model_without_room_is_not_begun() {
    let frames = synthesise(&press(), Stream::Training, 100);
    let options = taxel_learn::Options { centres: 2, ..taxel_learn::Options::of_rows() };
    let trained = taxel_learn::train::train(&frames, &options, &Silent).unwrap();
    let origin = taxel_learn::Origin::of_data("row", 0, 1, &frames);
    let mut blob = taxel_learn::pack(&trained, &frames, &origin).unwrap().bytes().to_vec();
    blob[9] = 9; // rows
    let mut device = device(SOUND, &model(3));
    let outcome = upload::replace(&mut device, &blob, &Silent);
    let refused = outcome.unwrap_err().to_string();
    assert!(refused.contains("the device has room for 8 rows"), "{refused}");
    assert_eq!(device.statistics().unwrap().slot_erases, 0);
}

#[test]
fn chunks_of_no_bytes_and_a_line_that_takes_none_are_told() {
    let model = model(3);
    let mut device = device(SOUND, &model);
    for bytes in [0, 6] {
        let outcome = upload::send(&mut device, model.bytes(), bytes, &Silent);
        let refused = outcome.unwrap_err().to_string();
        assert!(refused.contains(&format!("chunks of {bytes} bytes")), "{refused}");
    }
    let mut full = Device::new(Full).unwrap();
    assert!(
        matches!(full.identify(), Err(Error::Line(cause)) if cause.kind() == ErrorKind::WriteZero)
    );
}

/// Line that takes no bytes and says so.
struct Full;

impl std::io::Read for Full {
    fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
        Err(ErrorKind::WouldBlock.into())
    }
}

impl std::io::Write for Full {
    fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
        Ok(0)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Wire for Full {
    fn set_read_timeout(&mut self, _: Duration) -> std::io::Result<()> {
        Ok(())
    }
}

#[cfg(target_os = "linux")]
pub mod serial_port {
    use std::os::fd::AsRawFd;

    use serial2::SerialPort;

    use super::*;

    /// Name of a pseudo-terminal with a device at its far end.
    fn port(model: &ModelBlob) -> (String, SerialPort) {
        port_with(model, frames())
    }

    /// Name of a pseudo-terminal with a device at its far end, whose sensor shows `frames`.
    fn port_with(model: &ModelBlob, frames: Vec<[[f32; 18]; 8]>) -> (String, SerialPort) {
        let (name, near, far) = terminal();
        crate::virtual_device::run(far, SOUND, model.bytes(), frames);
        (name, near)
    }

    /// Name of a pseudo-terminal, and both its ends; the far one is for a device.
    pub fn terminal() -> (String, SerialPort, Quick) {
        let (mut far, near) = SerialPort::pair().unwrap();
        far.set_read_timeout(std::time::Duration::from_millis(1)).unwrap();
        let name = std::fs::read_link(format!("/proc/self/fd/{}", near.as_raw_fd())).unwrap();
        (name.to_string_lossy().into_owned(), near, Quick(far))
    }

    /// Port that answers a read without bytes like a socket does. Bytes that nobody reads are lost, as on a serial line.
    pub struct Quick(SerialPort);

    impl std::io::Read for Quick {
        fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
            match self.0.read(bytes) {
                // No program has the near end open at the moment.
                Ok(0) => Err(std::io::ErrorKind::NotConnected.into()),
                other => other,
            }
        }
    }

    impl std::io::Write for Quick {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            Ok(self.0.write(bytes).unwrap_or(bytes.len()))
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_device_is_recalibrated_from_the_command_line() {
        let folder = Folder::new("recalibrated");
        let old = model(16);
        folder.write("old.bin", old.bytes());
        let (port, near) = port(&old);
        drop(near);
        // 5 % more of every reading, and other columns besides.
        let synth = ["synth", "press", "--seed", "5", "-n", "60", "--scale", "1.05"];
        folder.succeed(&[&synth[..], &["-o", "presses.csv"]].concat());
        let recalibrate = ["link", &port, "recalibrate", "old.bin", "presses.csv", "-o", "new.bin"];
        let page = folder.succeed(&recalibrate);
        assert!(page.contains("60 used, 0 unusable"), "{page}");
        let said = folder.fail(&recalibrate, 2);
        assert!(said.contains("the device has another model"), "{said}");
        let is_old = format!("CRC-32 {:08x}", old.parse().crc());
        let page = folder.succeed(&["link", &port, "identify"]);
        assert!(page.contains("slot 1") && !page.contains(&is_old), "{page}");
        // The old blob names the new model's outputs, if that is said.
        let record = ["link", &port, "record", "old.bin", "-n", "2", "-o", "estimate.csv"];
        assert_eq!(folder.run(&record).status.code(), Some(2));
        folder.succeed(&[&record[..], &["--recalibrated"]].concat());
        folder.succeed(&["link", &port, "record", "new.bin", "-n", "2", "-o", "estimate.csv"]);

        let page = folder.succeed(&["link", &port, "undo"]);
        assert!(page.contains(&is_old) && page.contains("slot 0"), "{page}");

        // A file without outputs, and presses that are all alike.
        let text = std::fs::read_to_string(folder.path("presses.csv")).unwrap();
        let mut lines = text.lines();
        let (header, first) = (lines.next().unwrap(), lines.next().unwrap());
        let alike = std::iter::once(header).chain(std::iter::repeat_n(first, 30));
        folder.write("alike.csv", alike.collect::<Vec<_>>().join("\n").as_bytes());
        let alike = folder.run(&["link", &port, "recalibrate", "old.bin", "alike.csv"]);
        let said = String::from_utf8_lossy(&alike.stderr).into_owned();
        assert!(alike.status.code() == Some(1) && said.contains("too alike"), "{said}");
        folder.write("missing.csv", b"r1e1_dx_mm\n0\n");
        let missing = folder.run(&["link", &port, "recalibrate", "old.bin", "missing.csv"]);
        assert_eq!(missing.status.code(), Some(2));
    }

    #[test]
    fn a_device_scans_the_presses_that_it_is_recalibrated_by() {
        let folder = Folder::new("recalibrated_by_scans");
        let old = model(16);
        folder.write("old.bin", old.bytes());
        let drifted = |frame: [[f32; 18]; 8]| frame.map(|row| row.map(|ohm| 1.1 * ohm));
        let frames: Vec<_> = frames().into_iter().map(drifted).collect();
        // Whichever frames are scanned, so many have the same mean.
        let count = frames.len().to_string();
        let (port, near) = port_with(&old, frames);
        drop(near);
        folder.succeed(&["synth", "press", "--seed", "5", "-n", "30", "-o", "all.csv"]);
        let text = std::fs::read_to_string(folder.path("all.csv")).unwrap();
        let outputs = |line: &str| line.split(',').skip(144).collect::<Vec<_>>().join(",");
        assert!(text.lines().next().unwrap().split(',').nth(144) == Some("r1e1_dx_mm"));
        folder.write("outputs.csv", text.lines().map(outputs).collect::<Vec<_>>().join("\n"));
        let mut command = crate::common::program();
        let command = command.current_dir(folder.path("."));
        let arguments =
            ["link", &port, "recalibrate", "old.bin", "outputs.csv", "-n", &count, "--json"];
        let mut program = command
            .args(arguments)
            .stdin(std::process::Stdio::piped())
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        std::io::Write::write_all(&mut program.stdin.take().unwrap(), &[b'\n'; 30]).unwrap();
        let output = program.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && said.contains("press 30 of 30"), "{said}");
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let number = |key: &str| found[key].as_f64().unwrap();
        assert_eq!(
            [number("presses"), number("presses_unusable"), number("networks")],
            [30.0, 0.0, 8.0]
        );
        assert!(number("error_after") < 0.5 * number("error_before"), "{found}");
        let page = folder.succeed(&["link", &port, "identify"]);
        assert!(page.contains(found["model_crc"].as_str().unwrap()), "{page}");
    }

    #[test]
    fn a_recording_has_times_by_which_a_log_can_be_filtered() {
        let folder = Folder::new("recorded_times");
        let model = model(3);
        folder.write("model.bin", model.bytes());
        let (port, near) = port_with(&model, frames());
        drop(near);
        let record = ["link", &port, "record", "model.bin", "-n", "8", "--time", "-o", "log.csv"];
        folder.succeed(&[&record[..], &["--readings"]].concat());
        let decode = ["decode", "model.bin", "log.csv", "-o", "estimate.csv"];
        folder.succeed(&[&decode[..], &["--filter-ms", "30", "--lead-ms", "4"]].concat());
        let read = |name: &str| {
            let text = std::fs::read_to_string(folder.path(name)).unwrap();
            let (header, lines) = text.split_once('\n').unwrap();
            let values = lines.lines().flat_map(|line| line.split(','));
            let values = values.map(|value| value.parse().unwrap()).collect();
            Table { names: header.split(',').map(String::from).collect(), values }
        };
        let (log, found) = (read("log.csv"), read("estimate.csv"));
        assert_eq!((log.names[0].as_str(), log.values[0]), ("time_s", 0.0));
        let start_us: Vec<u64> = log.lines().map(|line| (line[0] * 1e6).round() as u64).collect();
        let readings = log.columns(1, 144);
        let filter = Settings { time_constant_us: 30_000, lead_us: 4000 };
        let filtered = Filtered::new(model.prepare(), filter);
        let timing = Some(Timing { start_us: &start_us, reading_offset_us: &[] });
        let frames = taxel_learn::Frames { readings: &readings.values, timing };
        let expected = filtered.decode_frames(frames, 8).values;
        let outputs = found.columns(0, 144).values;
        let is_same = |(a, b): (&f64, &f64)| (*a as f32).to_bits() == (*b as f32).to_bits();
        assert!(outputs.iter().zip(&expected).all(is_same));
        assert_ne!(outputs, model.prepare().decode_table(&readings).values);

        // What the device filters is saved, too, or one of some.
        let options = ["--filter-ms", "30", "--report-every", "3", "--json"];
        let saved = folder.succeed(&[&record[..], &options].concat());
        let saved: serde_json::Value = serde_json::from_str(&saved).unwrap();
        assert_eq!((saved["frames"].as_u64(), saved["frames_lost"].as_u64()), (Some(8), Some(0)));
        let said = folder.fail(&[&record[..], &["--readings", "--filter-ms", "30"]].concat(), 2);
        assert!(said.contains("--filter-ms filters estimates"), "{said}");
        // The device filters from now on, if it is told to.
        let configure = ["link", &port, "configure", "--filter-ms", "5", "--lead-ms", "1.5"];
        let page = folder.succeed(&[&configure[..], &["--report-every", "7"]].concat());
        for said in ["a time constant of 5 ms, a lead of 1.5 ms", "estimates yes (one of 7)"] {
            assert!(page.contains(said), "{page}");
        }
        let page = folder.succeed(&["link", &port, "identify"]);
        assert!(page.contains("until the line took its estimate"), "{page}");
    }

    #[test]
    fn novelty_and_deviations_are_recorded_from_the_command_line() {
        let folder = Folder::new("confidence");
        let model = with_confidence(&model(3));
        folder.write("model.bin", model.bytes());
        let (port, near) = port(&model);
        drop(near);
        let record = ["link", &port, "record", "model.bin", "-n", "3", "-o", "estimate.csv"];
        let header = |folder: &Folder| {
            let text = std::fs::read_to_string(folder.path("estimate.csv")).unwrap();
            let lines: Vec<&str> = text.lines().collect();
            assert_eq!(lines.len(), 4);
            let last: f64 = lines[1].rsplit(',').next().unwrap().parse().unwrap();
            assert!(last.is_finite());
            lines[0].to_owned()
        };
        folder.succeed(&record);
        let outputs = header(&folder);
        folder.succeed(&[&record[..], &["--confidence", "novelty"]].concat());
        assert_eq!(header(&folder), format!("{outputs},novelty_nats"));
        folder.succeed(&[&record[..], &["--confidence", "deviations"]].concat());
        let deviations: Vec<String> =
            outputs.split(',').map(|name| format!("{name}_deviation")).collect();
        assert_eq!(header(&folder), format!("{outputs},{},novelty_nats", deviations.join(",")));
        for (option, value, says) in [
            ("--period-us", "10", "(--period-us: 0, or 100 to 1000000000) is out of range"),
            ("--contact-threshold", "-1", "(--contact-threshold: above 0) is out of range"),
        ] {
            let output = folder.run(&["link", &port, "configure", option, value]);
            let said = String::from_utf8(output.stderr).unwrap();
            assert!(output.status.code() == Some(2) && said.contains(says), "{said}");
        }
        let page = folder.succeed(&["link", &port, "configure", "--confidence", "novelty"]);
        assert!(page.contains("estimates yes, of confidence novelty\n"), "{page}");
    }

    #[test]
    fn a_device_is_used_from_the_command_line() {
        let folder = Folder::new("link");
        let (old, new) = (model(3), model(4));
        let new_file = folder.write("new.bin", new.bytes());
        let new_file = new_file.to_str().unwrap();
        let (port, near) = port(&old);
        drop(near); // the program opens it itself

        let page = folder.succeed(&["link", &port, "identify"]);
        assert!(page.contains("virtual, firmware"), "{page}");
        assert!(page.contains(&format!("CRC-32 {:08x}, slot 0", old.parse().crc())), "{page}");
        assert!(page.contains("model             \"press\", "), "{page}");
        assert!(page.contains("scanning          paused"), "{page}");

        // Recording under another model's names is refused, before anything is written.
        let wrong = folder.run(&["link", &port, "record", new_file, "-o", "estimate.csv"]);
        assert_eq!(wrong.status.code(), Some(2));
        assert_eq!(folder.names(), ["new.bin"]);

        let page = folder.succeed(&["link", &port, "upload", new_file]);
        assert!(page.contains(&format!("CRC-32 {:08x}, slot 1", new.parse().crc())), "{page}");

        folder.succeed(&["link", &port, "record", new_file, "-n", "10", "-o", "estimate.csv"]);
        let text = std::fs::read_to_string(folder.path("estimate.csv")).unwrap();
        assert_eq!(text.lines().count(), 11);
        assert!(text.starts_with("r1e1_dx_mm,r1e1_dy_mm,r1e1_dz_mm,"), "{text}");

        // Without a model, readings are recorded, which can be trained on. Here they are ideal, five in
        // turn.
        folder.succeed(&["link", &port, "record", "-n", "6", "-o", "readings.csv"]);
        let text = std::fs::read_to_string(folder.path("readings.csv")).unwrap();
        assert!(text.starts_with("r1c1_ohm,r1c2_ohm,"), "{text}");
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert!(lines.len() == 6 && lines[0] == lines[5] && lines[0] != lines[1]);
        let ohm: Vec<f32> = lines[0].split(',').map(|v| v.parse().unwrap()).collect();
        assert!(frames().iter().any(|frame| frame.as_flattened() == ohm), "{ohm:?}");

        folder.succeed(&["link", &port, "baseline", "-n", "5", "-o", "rest.csv"]);
        let text = std::fs::read_to_string(folder.path("rest.csv")).unwrap();
        let (header, line) = text.trim_end().split_once('\n').unwrap();
        assert!(header.ends_with("r8c18_ohm"));
        let frames = frames();
        let mean = frames.iter().map(|f| f64::from(f[0][0])).sum::<f64>() / frames.len() as f64;
        let found: f64 = line.split(',').next().unwrap().parse().unwrap();
        assert!((found / mean - 1.0).abs() < 1e-5, "{found} instead of {mean}");

        let page =
            folder.succeed(&["link", &port, "check", "press", "--model", new_file, "-n", "50"]);
        assert!(page.contains("50 of 50 bit-identical"), "{page}");

        // The virtual device reports 20 000 bytes of code and 4000 of RAM.
        for (limit, enough) in [
            ("--flash-limit=19999", false),
            ("--ram-limit=3999", false),
            ("--ram-limit=4000", true),
        ] {
            let arguments =
                ["link", &port, "check", "press", "--model", new_file, "-n", "1", limit];
            assert_eq!(folder.run(&arguments).status.code(), Some(i32::from(!enough)), "{limit}");
        }

        for (arguments, text) in [
            (&["record", new_file, "-o", "x.csv", "--period-us", "7"][..], "7 is not in 100..="),
            (&["baseline", "-o", "x.csv", "--oversampling", "0"], "--oversampling <N>': 0"),
            (&["baseline", "-o", "x.csv", "-n", "0"], "0 is not in 1..="),
            (&["baseline", "-o", "x.csv", "-n", "-3"], "'-3' for '--frames <N>'"),
            (&["upload", "none.bin"], "none.bin"),
            (
                &["record", new_file, "-o", "x.csv", "--confidence", "novelty"],
                "--confidence: MODEL has none",
            ),
        ] {
            let output = folder.run(&[&["link", &port][..], arguments].concat());
            let message = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
            assert!(message.contains(text), "{message}");
        }
        assert_eq!(folder.names(), ["estimate.csv", "new.bin", "readings.csv", "rest.csv"]);
    }

    #[test]
    fn a_sensor_that_says_nothing_is_no_recording() {
        let folder = Folder::new("silent");
        let model = model(3);
        let (port, near) = port_with(&model, vec![[[f32::NAN; 18]; 8]]);
        drop(near);
        for command in ["record", "baseline"] {
            let output = folder.run(&["link", &port, command, "-n", "3", "-o", "x.csv"]);
            let message = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{command}: {message}");
            assert!(message.contains("not a single reading"), "{message}");
        }
        assert!(folder.names().is_empty());
    }

    #[test]
    fn a_port_that_is_not_there_is_named() {
        let folder = Folder::new("no_port");
        let output = folder.run(&["link", "/dev/no-such-port", "identify"]);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2));
        assert!(message.contains("/dev/no-such-port"), "{message}");
    }
}

#[test]
fn a_device_filters_in_time_as_the_host_does() {
    let model = model(3);
    let filter = Settings { time_constant_us: 5000, lead_us: 2000 };
    let plan = Plan { window: 4, filter };
    let mut frames = frames_of(160);
    frames.start_us.iter_mut().for_each(|us| *us *= 1000);
    frames.start_us[140..].iter_mut().for_each(|us| *us += 60_000); // a gap
    frames.readings.values[144 * 20] = f64::NAN; // a row starts anew
    let mut device = device(SOUND, &model);
    // The second time the filter starts anew.
    for _ in 0..2 {
        let findings = check(&mut device, &frames, &model, &plan, &Silent).unwrap();
        assert!(findings.all_good(), "{findings:#?}");
    }
}
