//! Calibration of a device that scans a virtual board whose parts are not those that the firmware assumes.

use std::io::{Read, Write};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use taxel_core::Wires;
use taxel_data::{Silent, Stream};
use taxel_firmware::circuit::{Circuit, Constants, ConstantsFault, ZeroPotential};
use taxel_firmware::link::message::{Configuration, Setting};
use taxel_firmware::readout::{
    FrameSource, Mcp3208s, ScanReport, ScanSettings, Scanner, Selection, ShiftRegister595,
};
use taxel_rig::Error;
use taxel_rig::calibration::{CircuitConstants, Fit};
use taxel_rig::device::Device;
use taxel_rig::device::calibrate::{Reading, calibrate};
use taxel_rig::emulator::{self, Emulator};
use taxel_simulate::readout::{Drive, Readout};
use taxel_simulate::{World, synthesise};
use taxel_virtual_board::{Parts, Pin, VirtualBoard, op_amp_time_constant_us};

use crate::common::Folder;
use crate::virtual_device::mailbox::pair;
use crate::virtual_device::{Line, run_with};

const WIRES: Wires = Wires { rows: 8, columns: 18 };

/// Parts of the board: V_b is 3 % high, a feedback resistor is up to 1 % off, and each row's source is another one.
fn parts() -> Parts {
    Parts {
        drive_v: 0.206,
        row_source_ohm: std::array::from_fn(|m| 0.15 + 0.05 * ((5 * m) % 8) as f64),
        feedback_ohm: std::array::from_fn(|k| 560.0 * (0.99 + 0.02 * ((7 * k) % 18) as f64 / 17.0)),
    }
}

fn world() -> World {
    let readout = Readout {
        row_drive: Some(Drive::ShiftRegister),
        cross_talk: Some(true),
        op_amp_offset_v: Some(5e-4),
        adc_noise_counts: Some(0.5),
        time_constant_us: Some(op_amp_time_constant_us()),
        ..Readout::default()
    };
    World { readout, ..World::press() }
}

/// The board's readout on a virtual board, in whatever thread scans it, with constants that can be set.
#[derive(Clone)]
struct Bench {
    circuit: ZeroPotential<8, 18>,
    /// Resistors that are connected, in Ω.
    connected: Arc<Mutex<Vec<f64>>>,
}

impl FrameSource for Bench {
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport {
        thread_local! {
            static BOARD: VirtualBoard = {
                let board = VirtualBoard::new(&world()).unwrap();
                board.set_parts(parts());
                board
            };
        }
        BOARD.with(|board| {
            board.set_readings(&self.connected.lock().unwrap());
            let drive = ShiftRegister595::<_, 8> {
                data: board.pin(Pin::RowData),
                clock: board.pin(Pin::RowClock),
                latch: board.pin(Pin::RowLatch),
            };
            let sampler = Mcp3208s { chips: [0, 1, 2].map(|chip| board.spi(chip)) };
            let mut scanner =
                Scanner::<_, _, _, _, 8, 18>::new(drive, sampler, board.delay(), &self.circuit);
            let report = scanner.scan(settings, wires, frame);
            board.check().unwrap();
            report
        })
    }

    fn constants(&self) -> Option<Constants<'_>> {
        self.circuit.constants()
    }

    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        self.circuit.set_constants(constants)
    }
}

/// Runs a device without a model at the far end of a line; returns what is connected to it.
fn run_device(far: impl Read + Write + Send + 'static) -> Arc<Mutex<Vec<f64>>> {
    let connected = Arc::new(Mutex::new(vec![f64::INFINITY; 144]));
    let bench = Bench { circuit: ZeroPotential::TYPICAL, connected: connected.clone() };
    run_with(far, Line { one_in: None }, &[], bench);
    connected
}

/// Device without a model, and what is connected to it.
fn device() -> (Device, Arc<Mutex<Vec<f64>>>) {
    let (near, far) = pair();
    let connected = run_device(far);
    let mut device = Device::new(near).unwrap();
    device.patience = Duration::from_secs(2);
    (device, connected)
}

fn reading(frames: u16) -> Reading {
    let scan = ScanSettings { settling_us: 20, oversampling: 1 };
    Reading { frames, period_us: 1000, scan, patience: Duration::from_secs(20) }
}

/// An array of resistors of the series E96, 47.5 to 64.9 Ω.
fn array() -> Vec<f64> {
    let series =
        [47.5, 48.7, 49.9, 51.1, 52.3, 53.6, 54.9, 56.2, 57.6, 59.0, 60.4, 61.9, 63.4, 64.9];
    (0..144).map(|i| series[i * 5 % series.len()]).collect()
}

/// One resistor alone.
fn single(place: usize) -> Vec<f64> {
    (0..144).map(|i| if i == place { 49.9 } else { f64::NAN }).collect()
}

/// Calibrates while `connect` makes of the known resistors what is really connected.
fn run(
    device: &mut Device,
    connected: &Mutex<Vec<f64>>,
    known: &[Vec<f64>],
    connect: impl Fn(&[f64]) -> Vec<f64>,
) -> Result<Fit, Error> {
    let connect = |number: usize| {
        *connected.lock().unwrap() = connect(&known[number]);
        Ok(())
    };
    calibrate(device, WIRES, known, reading(40), connect, &Silent)
}

fn as_known(known: &[f64]) -> Vec<f64> {
    known.iter().map(|ohm| if ohm.is_nan() { f64::INFINITY } else { *ohm }).collect()
}

/// Largest error of a row's source in Ω, and largest relative error of a column's factor V_d·R_f/V_ref.
fn errors(found: &CircuitConstants) -> (f64, f64) {
    let parts = parts();
    let sources = found.row_source_ohm.iter().zip(parts.row_source_ohm);
    let factor = f64::from(found.drive_v) / f64::from(found.reference_v) / (parts.drive_v / 3.3);
    let columns = found.feedback_ohm.iter().zip(parts.feedback_ohm);
    (
        sources.map(|(found, actual)| (f64::from(*found) - actual).abs()).fold(0.0, f64::max),
        columns
            .map(|(found, actual)| (f64::from(*found) / actual * factor - 1.0).abs())
            .fold(0.0, f64::max),
    )
}

#[test]
fn known_resistors_tell_the_parts_of_a_board_and_are_kept() {
    let (mut device, connected) = device();
    let assumed = device.constants().unwrap();
    assert!(errors(&assumed).0 > 0.1 && errors(&assumed).1 > 0.03);
    let known = [array(), single(0)];
    let fit = run(&mut device, &connected, &known, as_known).unwrap();
    let (source_ohm, factor) = errors(&fit.constants);
    println!("source within {source_ohm:.4} Ω, factors within {:.4} %: {fit:?}", 100.0 * factor);
    // Half a count of noise in 40 frames of 2500 counts, twice, and what of it a single resistor tells.
    assert!(source_ohm < 0.003, "{source_ohm} Ω");
    assert!(factor < 5e-4, "{factor}");
    assert!(fit.before.largest > 0.05, "{}", fit.before);
    assert!(fit.after.largest < 5e-4, "{}", fit.after);
    assert!(source_ohm < 5.0 * fit.row_source_error_ohm && factor < 5.0 * fit.feedback_error);
    // The common factor is the drive voltage's.
    assert!((f64::from(fit.constants.drive_v) / 0.206 - 1.0).abs() < 2e-3);

    // The constants are active, and stay so over a restart once they are kept.
    assert_eq!(device.constants().unwrap(), fit.constants);
    device.restart().unwrap();
    assert_eq!(device.constants().unwrap(), assumed);
    device.set_constants(&fit.constants).unwrap();
    assert!(device.keep(Setting::Constants).unwrap().constants);
    device.restart().unwrap();
    assert_eq!(device.constants().unwrap(), fit.constants);

    // Other resistances are read rightly: frames of a press.
    let press = synthesise(&world(), Stream::Test, 3).inputs;
    for frame in press.lines() {
        let fit = run(&mut device, &connected, &[frame.to_vec(), single(7)], as_known).unwrap();
        assert!(fit.before.largest < 1e-3, "{}", fit.before);
    }
    assert!(!device.forget(Setting::Constants).unwrap().constants);
}

#[test]
fn what_is_connected_wrongly_leaves_the_constants_as_they_were() {
    let (mut device, connected) = device();
    let assumed = device.constants().unwrap();
    let mut refused = |known: &[Vec<f64>], connect: &dyn Fn(&[f64]) -> Vec<f64>| {
        let refused = run(&mut device, &connected, known, connect).unwrap_err().to_string();
        assert_eq!(device.constants().unwrap(), assumed, "{refused}");
        refused
    };
    // The sensor was left connected.
    let with_sensor =
        |known: &[f64]| known.iter().map(|ohm| if ohm.is_nan() { 58.0 } else { *ohm }).collect();
    let says = refused(&[array(), single(0)], &with_sensor);
    assert!(says.starts_with("arrangement 2: r1c2 reads") && says.contains("remove"), "{says}");
    // The resistor is at another row.
    let elsewhere = |known: &[f64]| {
        let mut connected = as_known(known);
        connected.rotate_right(18);
        connected
    };
    let says = refused(&[single(0), array()], &elsewhere);
    assert!(says.starts_with("arrangement 1: r1c1 reads as open"), "{says}");
    // One resistor is 5 % off.
    let off = |known: &[f64]| {
        let mut connected = as_known(known);
        connected[40] *= 1.05;
        connected
    };
    let says = refused(&[array(), single(0)], &off);
    assert!(says.contains("no constants explain"), "{says}");
    // One arrangement does not tell.
    let says = refused(&[array()], &as_known);
    assert!(says.contains("such as a single resistor"), "{says}");
}

/// The image's file comes from the environment, since this needs QEMU and a toolchain for the target.
#[test]
#[ignore = "needs QEMU and the image: `cargo xtask emulate application` runs it"]
fn the_image_keeps_settings_over_restarts() {
    let image = std::env::var_os("TAXEL_IMAGE").expect("TAXEL_IMAGE is the path of qemu-app");
    let folder = Folder::new("kept_in_qemu");
    let options = emulator::Options {
        qemu: "qemu-system-arm".into(),
        image: image.into(),
        model: None,
        log: None,
        mailbox: Some(folder.path("mailbox.ram")),
    };
    let (_emulator, link) = Emulator::start(&options).unwrap();
    let mut device = Device::new(link).unwrap();
    device.patience = Duration::from_mins(1);
    assert_eq!(device.kept().unwrap().configuration, None);
    let quiet = device.configuration().unwrap().configuration;
    let mut constants = device.constants().unwrap();
    // Enough writes for two exchanges of the pages.
    for life in 0..2 {
        for write in 0..48 {
            constants.row_source_ohm[write % 8] = 0.25 + write as f32 / 1000.0;
            device.set_constants(&constants).unwrap();
            assert!(device.keep(Setting::Constants).unwrap().constants);
        }
        let configuration = Configuration { contact_threshold: 0.1 + life as f32, ..quiet };
        device.configure_until_restart(configuration).unwrap();
        device.keep(Setting::Configuration).unwrap();
        device.restart().unwrap();
        assert_eq!(device.constants().unwrap(), constants);
        assert_eq!(device.configuration().unwrap().configuration, configuration);
        let kept = device.kept().unwrap();
        assert_eq!((kept.configuration, kept.constants), (Some(configuration), true));
        constants.drive_v += 0.01;
    }
    let memory = device.identify().unwrap().memory;
    println!("{memory:?}");
    assert!(memory.stack_high_water < memory.stack_reserved);
}

/// Runs `calibrate known.csv` and connects the resistors that it asks for; returns stdout.
#[cfg(target_os = "linux")]
fn calibrate_by_hand(
    folder: &Folder,
    port: &str,
    connected: &Mutex<Vec<f64>>,
    known: &[Vec<f64>],
) -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_host-sim"))
        .args([
            "link",
            port,
            "calibrate",
            "known.csv",
            "-n",
            "20",
            "--period-us",
            "1000",
            "--store",
        ])
        .current_dir(folder.path(""))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut stdin, mut stderr) = (program.stdin.take().unwrap(), program.stderr.take().unwrap());
    let (mut said, mut bytes) = (String::new(), [0; 256]);
    for (number, ohm) in (1..).zip(known) {
        let asked = format!("{number} of {}: connect", known.len());
        while !said.contains(&asked) || !said.ends_with("Enter: ") {
            let count = stderr.read(&mut bytes).unwrap();
            assert!(count > 0, "{said}");
            said.push_str(&String::from_utf8_lossy(&bytes[..count]));
        }
        *connected.lock().unwrap() = as_known(ohm);
        stdin.write_all(b"\n").unwrap();
    }
    let output = program.wait_with_output().unwrap();
    stderr.read_to_string(&mut said).unwrap();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("144 resistors, from r1c1 to r8c18"), "{said}");
    assert!(said.contains("49.9 Ω at r3c3 alone"), "{said}");
    String::from_utf8(output.stdout).unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn a_board_is_set_up_from_the_command_line_and_stays_so() {
    let folder = Folder::new("calibrate");
    let (port, near, far) = crate::device::serial_port::terminal();
    let connected = run_device(far);
    drop(near); // the program opens it itself
    let link = |arguments: &[&str]| folder.succeed(&[&["link", &port][..], arguments].concat());

    let known = [array(), single(2 * 18 + 2)];
    let names: Vec<String> =
        (1..=8).flat_map(|m| (1..=18).map(move |k| format!("r{m}c{k}_ohm"))).collect();
    let line = |ohm: &Vec<f64>| {
        let fields =
            ohm.iter().map(|ohm| if ohm.is_nan() { String::new() } else { ohm.to_string() });
        fields.collect::<Vec<_>>().join(",")
    };
    let lines: Vec<String> = known.iter().map(line).collect();
    folder.write("known.csv", format!("{}\n{}\n", names.join(","), lines.join("\n")));
    let page = calibrate_by_hand(&folder, &port, &connected, &known);
    assert!(
        page.contains("145 readings of known resistors tell the constants of 8 rows"),
        "{page}"
    );
    let drive = page.split("drive ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    assert!((drive.parse::<f64>().unwrap() / 0.206 - 1.0).abs() < 1e-3, "{page}");
    assert!(page.contains("kept over restarts"), "{page}");

    let page = link(&[
        "configure",
        "--period-us",
        "20000",
        "--send",
        "both",
        "--contact-threshold",
        "0.05",
    ]);
    assert!(page.contains("configuration     kept"), "{page}");
    *connected.lock().unwrap() = array();
    link(&["baseline", "-n", "5", "--period-us", "1000", "-o", "rest.csv", "--store"]);
    let kept = |page: &str| {
        assert!(page.contains("a scan every 20000 µs"), "{page}");
        assert!(page.contains("readings yes, estimates yes"), "{page}");
        assert!(page.contains("contact from 0.05"), "{page}");
        assert!(page.contains("constants         kept"), "{page}");
        assert!(page.contains("kept: mean of 5 frames of 8 × 18 readings"), "{page}");
    };
    kept(&link(&["settings"]));

    // Constants measured by hand are active until the restart, unless they are stored.
    folder.write("constants.toml", "drive_v = 0.21\nseries_ohm = 0.05\n");
    let page = link(&["calibrate", "--constants", "constants.toml"]);
    assert!(page.contains("drive 0.21000 V of 3.3000 V") && page.contains("0.050"), "{page}");
    assert!(page.contains("active until the restart"), "{page}");

    let page = link(&["settings", "--forget", "all"]);
    assert!(page.contains("configuration     none is kept"), "{page}");
    assert!(page.contains("baseline          none is kept"), "{page}");

    folder.write("other.csv", "r1c1_ohm,r9c1_ohm\n50,50\n");
    folder.write("negative.csv", "r1c1_ohm\n-50\n");
    folder.write("other.toml", "feedback_ohm = [1.0, 2.0]\n");
    for (arguments, text) in [
        (&["configure"][..], "required arguments"),
        (&["calibrate"], "required arguments"),
        (&["calibrate", "other.csv"], "r9c1_ohm is no reading"),
        (&["calibrate", "negative.csv"], "line 2, r1c1_ohm: -50"),
        (&["calibrate", "--constants", "other.toml"], "feedback_ohm has 2 numbers"),
    ] {
        let output = folder.run(&[&["link", &port][..], arguments].concat());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(text), "{message}");
    }
}
