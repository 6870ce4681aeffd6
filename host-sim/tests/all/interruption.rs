//! The host is killed or interrupted while a device works for it.

use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::common::{Folder, program, shell_status};
use crate::device::serial_port::terminal;
use crate::device::{SOUND, frames, model};
use crate::virtual_device;
use taxel_core::blob::Floats;
use taxel_core::checksum::CRC_32;
use taxel_firmware::link::message::{Configuration, Identity, Memory, Report, Request};
use taxel_firmware::link::receive::{Received, Receiver};
use taxel_firmware::link::{cobs, packet};
use taxel_rig::device::{Device, serial};

/// Time by which a busy computer may be late.
const LATE: Duration = Duration::from_millis(1500);

/// How the host ends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    Kill,
    Interrupt,
    Terminate,
}

/// Host to be ended, and the number of requests until then.
#[derive(Default)]
struct Trap {
    host: Option<Child>,
    requests_left: usize,
    end: Option<End>,
}

impl Trap {
    /// Counts a request, and ends the host at the last one, before the device carries it out.
    fn count(&mut self) {
        self.requests_left = self.requests_left.saturating_sub(1);
        if self.requests_left > 0 {
            return;
        }
        let (Some(host), Some(end)) = (&mut self.host, self.end.take()) else { return };
        match end {
            End::Kill => {
                host.kill().unwrap();
                host.wait().unwrap();
            }
            End::Interrupt => signal(host, "-INT"),
            End::Terminate => signal(host, "-TERM"),
        }
    }
}

fn signal(host: &Child, name: &str) {
    let status = Command::new("kill").args([name, &host.id().to_string()]).status();
    assert!(status.unwrap().success());
}

/// Device on a pseudo-terminal that scans all the time.
struct Rig {
    port: String,
    trap: Arc<Mutex<Trap>>,
    folder: Folder,
}

const OWN: Configuration = Configuration { frame_period_us: 5000, ..Configuration::DEFAULT };

impl Rig {
    fn new(name: &str, model: &[u8]) -> Self {
        let (port, _, far) = terminal();
        let trap = Arc::new(Mutex::new(Trap::default()));
        let counter = trap.clone();
        let sensor = virtual_device::Source { frames: frames(), next: 0 };
        virtual_device::run_scanning(far, SOUND, model, sensor, OWN, move || {
            counter.lock().unwrap().count();
        });
        Self { port, trap, folder: Folder::new(name) }
    }

    /// Runs a command of `link`, and ends it at request number `requests`. Returns its status, and whether it was
    /// ended.
    fn end_at(&self, arguments: &[&str], requests: usize, end: End) -> (ExitStatus, bool) {
        {
            let mut trap = self.trap.lock().unwrap();
            let host = program()
                .args(["link", &self.port])
                .args(arguments)
                .current_dir(self.folder.path("."))
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            *trap = Trap { host: Some(host), requests_left: requests, end: Some(end) };
        }
        loop {
            let mut trap = self.trap.lock().unwrap();
            if let Some(status) = trap.host.as_mut().unwrap().try_wait().unwrap() {
                return (status, trap.end.take().is_none());
            }
            drop(trap);
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Checks that the device scans by its own configuration.
    fn expect_own_scans(&self) {
        let start = Instant::now();
        let mut device = self.device();
        assert_eq!(device.configuration().unwrap(), OWN);
        let before = device.statistics().unwrap().frames_scanned;
        while device.statistics().unwrap().frames_scanned == before {
            assert!(start.elapsed() < LATE, "the device does not scan");
        }
    }

    /// Host of the device's own.
    fn device(&self) -> Device {
        let deadline = Instant::now() + Duration::from_secs(5);
        loop {
            // The port may still be held by a host that was just killed.
            match serial::open(&self.port, 921_600) {
                Ok(port) => return Device::new(port).unwrap(),
                Err(cause) => assert!(Instant::now() < deadline, "{cause}"),
            }
        }
    }

    /// CRC-32 of the active model.
    fn model(&self) -> u32 {
        self.device().identify().unwrap().model.unwrap().crc_32
    }
}

#[test]
fn a_device_keeps_a_whole_model_when_the_uploading_host_dies() {
    let models = [model(3), model(4)];
    let rig = Rig::new("killed", models[0].bytes());
    let files = models.each_ref().map(|model| model.parse().crc());
    for (name, model) in ["0.bin", "1.bin"].iter().zip(&models) {
        rig.folder.write(name, model.bytes());
    }
    let mut old = 0;
    for is_killed in [true, false] {
        for requests in (1..).step_by(3) {
            let new = 1 - old;
            let end = match requests % 4 {
                _ if is_killed => End::Kill,
                1 => End::Interrupt,
                _ => End::Terminate,
            };
            let (status, ended) = rig.end_at(&["upload", ["0.bin", "1.bin"][new]], requests, end);
            if !ended {
                assert!(status.success(), "{end:?} {requests}: {status}");
                assert!(requests > 15, "only {requests} requests");
                assert_eq!(rig.model(), files[new]);
                old = new;
                break;
            }
            if end == End::Kill {
                assert_eq!(shell_status(status), Some(137), "{requests}");
            } else {
                // The answer to the very last request may come before the host looks at the signal.
                let ended = Some(if end == End::Interrupt { 130 } else { 143 });
                let found = shell_status(status);
                assert!([ended, Some(0)].contains(&found), "{requests}: {status}");
            }
            rig.expect_own_scans();
            let found = rig.model();
            assert!(files.contains(&found), "{end:?} {requests}: model {found:08x}");
            old = usize::from(found == files[1]);
        }
    }
}

#[test]
fn a_model_on_trial_is_left_by_a_restart_unless_it_is_confirmed() {
    let (old, new) = (model(3), model(4));
    let [old_crc, new_crc] = [&old, &new].map(|model| model.parse().crc());
    let rig = Rig::new("trial", old.bytes());
    rig.folder.write("new.bin", new.bytes());
    let link =
        |arguments: &[&str]| rig.folder.succeed(&[&["link", &rig.port][..], arguments].concat());
    for ends in [true, false] {
        let page = link(&["upload", "new.bin", "--trial"]);
        let is_new = format!("CRC-32 {new_crc:08x}");
        assert!(page.contains(&is_new) && page.contains("until `confirm`"), "{page}");
        if ends {
            // A restart, and then an undo.
            assert_eq!(rig.device().restart().unwrap().model.unwrap().crc_32, old_crc);
            link(&["upload", "new.bin", "--trial"]);
            let page = link(&["undo"]);
            assert!(page.contains(&format!("CRC-32 {old_crc:08x}")), "{page}");
        }
    }
    let page = link(&["confirm"]);
    assert!(!page.contains("until `confirm`"), "{page}");
    assert_eq!(rig.device().restart().unwrap().model.unwrap().crc_32, new_crc);
    // Nothing is on trial.
    let output = rig.folder.run(&["link", &rig.port, "confirm"]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("no model is on trial"), "{message}");
}

#[test]
fn an_interrupted_recording_leaves_no_file_and_the_device_scans() {
    let rig = Rig::new("interrupted", model(3).bytes());
    // The last request lets the device scan for the host: it identifies, pauses, configures, and captures. A recording asks
    // for the device's own configuration as well.
    for (command, requests) in [("record", 4), ("baseline", 4)] {
        let arguments = [command, "-n", "50000", "-o", "x.csv", "--period-us", "1000"];
        let (status, ended) = rig.end_at(&arguments, requests, End::Interrupt);
        assert!(ended, "{command}");
        assert_eq!(shell_status(status), Some(130), "{command}");
        rig.expect_own_scans();
        assert!(rig.folder.names().is_empty(), "{:?}", rig.folder.names());
    }
}

#[test]
fn a_paused_device_is_reported_and_the_next_command_resumes_it() {
    let rig = Rig::new("dead", model(3).bytes());
    let recording = ["record", "-n", "50000", "-o", "x.csv", "--period-us", "1000"];
    assert!(rig.end_at(&recording, 3, End::Kill).1);
    let page = rig.folder.succeed(&["link", &rig.port, "identify"]);
    assert!(page.contains("scanning: paused"), "{page}");
    rig.folder.succeed(&["link", &rig.port, "record", "-n", "3", "-o", "x.csv"]);
    let page = rig.folder.succeed(&["link", &rig.port, "identify"]);
    assert!(page.contains("scanning: a frame every 5 ms\n"), "{page}");
}

/// Device that answers as little as a recording needs, and then sends `frames`: each its number, the time of its
/// scan, and its number of readings.
fn liar(frames: &'static [(u32, u64, usize)]) -> String {
    use std::io::{Read, Write};
    let (port, _, mut far) = terminal();
    let mut receiver = Receiver::new([0; 1024]);
    std::thread::spawn(move || {
        loop {
            let mut byte = [0];
            if far.read(&mut byte).is_err() {
                std::thread::sleep(Duration::from_millis(1));
                continue;
            }
            let Some(Received::Frame(bytes)) = receiver.push(byte[0]) else { continue };
            let Ok(request) = packet::decode::<Request<'_>>(bytes) else { continue };
            let mut send = |number, report: &Report<'_>| {
                let mut buffer = [0; 1024];
                let mut bytes = Vec::new();
                cobs::encode(packet::encode(number, report, &mut buffer).unwrap(), |piece| {
                    bytes.extend_from_slice(piece);
                    true
                });
                far.write_all(&bytes).unwrap();
            };
            let all_wires: Vec<u8> = (0..144).flat_map(|i| [i / 18, i % 18]).collect();
            let identity = Identity {
                board: "liar",
                firmware: "0",
                rows: 8,
                columns: 18,
                outputs: 18,
                model: None,
                model_name: "",
                slot_bytes: 1000,
                chunk_bytes: 0,
                memory: Memory::default(),
                unique_id: [0; 12],
                wires_crc_32: CRC_32.checksum(&all_wires),
            };
            let (scans, configuration) = match request.body {
                Request::Identify => {
                    send(request.number, &Report::Identity(identity));
                    continue;
                }
                Request::Configure(configuration) => {
                    (configuration.frame_period_us > 0, configuration)
                }
                _ => (false, Configuration::DEFAULT),
            };
            send(request.number, &Report::Configuration(configuration));
            for (frame, start_us, readings) in frames.iter().take(if scans { 9 } else { 0 }) {
                let readings = vec![60.0; *readings];
                let readings_ohm = Floats::new(&readings);
                let (frame, start_us) = (*frame, *start_us);
                send(packet::UNASKED, &Report::Readings { frame, start_us, readings_ohm });
            }
        }
    });
    port
}

#[test]
fn a_frame_of_wrong_length_is_refused_and_a_number_may_wrap() {
    let folder = Folder::new("liar");
    let port = liar(&[(1, 10, 144), (2, 20, 3), (3, 30, 144)]);
    let output = folder.run(&["link", &port, "record", "-n", "3", "-o", "x.csv"]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("frame 2 has 3 values instead of 144"), "{message}");

    // A device that has restarted begins anew with its numbers, or at least with its time.
    for restarted in [
        &[(7_u32, 70_u64, 144_usize), (1, 10, 144), (2, 20, 144)],
        &[(7, 70, 144), (8, 10, 144), (9, 20, 144)],
    ] {
        let output = folder.run(&["link", &liar(restarted), "record", "-n", "3", "-o", "x.csv"]);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.contains("restarted"), "{message}");
    }
    assert!(folder.names().is_empty());

    let port = liar(&[(u32::MAX - 1, 10, 144), (u32::MAX, 20, 144), (1, 40, 144)]);
    let page = folder.succeed(&["link", &port, "record", "-n", "3", "-o", "x.csv"]);
    assert!(page.contains("frames: 3\n") && page.contains("lost on the line: 1\n"), "{page}");
}
