//! The host's end of the link against the firmware's application, which runs here in a thread.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::common::{Folder, unrefined};
use crate::virtual_device::Line;
use taxel_core::filter::Settings;
use taxel_data::{Silent, Stream};
use taxel_firmware::link::message::Configuration;
use taxel_learn::ModelBlob;
use taxel_learn::reading_model::Extent;
use taxel_rig::device::check::{Frames, Plan, check};
use taxel_rig::device::{Device, upload};
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
        (scene.frames, scene.training.options.centres) = (500, centres);
        scene.train(&Silent).unwrap().bytes().to_vec()
    });
    ModelBlob::of_bytes(bytes).unwrap()
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
fn a_tracker_is_checked_with_a_baseline_and_without() {
    let mut scene = unrefined("moving");
    (scene.frames, scene.training.options.centres, scene.training.track) = (500, 4, true);
    let model = scene.train(&Silent).unwrap();
    let readings = synthesise(&scene.world, Stream::Test, 40).inputs;
    let rest = Synthesis::new(&scene.world).untouched().frames(Stream::Test, 1).inputs;
    // Gains of 2 %, which the device has to know by the baseline, or not at all.
    let baseline: Vec<f64> = rest.values.iter().map(|ohm| 1.02 * ohm).collect();
    let start_us: Vec<u64> = (0..40).map(|frame| 10_000 * frame).collect();
    let mut device = device(SOUND, &model);
    for baseline_ohm in [Some(baseline), None] {
        let frames =
            Frames { readings: readings.clone(), baseline_ohm, start_us: start_us.clone() };
        let plan = Plan { window: 1, filter: Settings::default() };
        let findings = check(&mut device, &frames, &model, &plan, &Silent).unwrap();
        assert_eq!(findings.frames.bit_identical, 40);
    }
}

#[test]
fn missing_readings_are_filled_alike_on_both_sides() {
    let mut scene = unrefined("press");
    (scene.frames, scene.training.options.centres) = (1500, 3);
    scene.training.reading_model = Some(Extent::Full);
    let model = scene.train(&Silent).unwrap();
    let mut frames = frames_of(30);
    let mut readings_ohm = frames.readings.values.to_vec();
    // A reading of every third frame is missing, and half of the last frame, which is not filled then.
    readings_ohm.iter_mut().step_by(3 * 144 + 1).for_each(|ohm| *ohm = f64::NAN);
    readings_ohm[29 * 144..][..72].fill(f64::NAN);
    frames.readings.values = readings_ohm.into();
    let mut device = device(SOUND, &model);
    let plan = Plan { window: 1, filter: Settings::default() };
    let findings = check(&mut device, &frames, &model, &plan, &Silent).unwrap();
    assert_eq!(findings.frames.bit_identical, 30);
}

#[cfg(target_os = "linux")]
pub mod serial_port;
