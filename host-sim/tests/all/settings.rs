//! Settings of a device: set from the command line, kept over restarts, and forgotten.

use std::time::Duration;

use taxel_firmware::circuit::{Constants, ConstantsFault, ZeroPotential};
use taxel_firmware::link::message::{Configuration, Setting};
use taxel_firmware::readout::{
    FrameSource, ScanReport, ScanSettings, Scanning, Selection, WaitingSource,
};
use taxel_rig::device::Device;
use taxel_rig::emulator::{self, Emulator};

use crate::common::Folder;

/// The image's file comes from the environment, since this needs QEMU and a toolchain for the target.
#[test]
#[ignore = "needs QEMU and the image: `cargo xtask emulate application` runs it"]
fn the_image_keeps_settings_over_restarts() {
    let image = std::env::var_os("TAXEL_IMAGE").expect("TAXEL_IMAGE is the path of qemu-app");
    let folder = Folder::new("kept_in_qemu");
    let options = emulator::Options {
        image: image.into(),
        model: None,
        log: None,
        mailbox: folder.path("mailbox.ram"),
    };
    let mut device = Device::new(Emulator::start(&options).unwrap()).unwrap();
    device.patience = Duration::from_mins(1);
    assert_eq!(device.kept().unwrap().configuration, None);
    let quiet = device.configuration().unwrap();
    let mut constants = device.constants().unwrap();
    // Enough writes for two exchanges of the pages.
    for life in 0..2 {
        for write in 0..48 {
            constants.row_source_ohm[write % 8] = 0.25 + write as f32 / 1000.0;
            device.set_constants(&constants).unwrap();
            assert!(device.keep(Setting::Constants).unwrap().constants);
        }
        let configuration = Configuration { contact_threshold: 0.1 + life as f32, ..quiet };
        device.configure(configuration).unwrap();
        device.keep(Setting::Configuration).unwrap();
        device.restart().unwrap();
        assert_eq!(device.constants().unwrap(), constants);
        assert_eq!(device.configuration().unwrap(), configuration);
        let kept = device.kept().unwrap();
        assert_eq!((kept.configuration, kept.constants), (Some(configuration), true));
        constants.drive_v += 0.01;
    }
    let memory = device.identify().unwrap().memory;
    println!("{memory:?}");
    assert!(memory.stack_high_water < memory.stack_reserved);
}

/// A sensor at rest, whose circuit's constants can be set.
#[derive(Clone)]
struct AtRest(ZeroPotential<8, 18>);

impl WaitingSource for AtRest {
    fn scan(&mut self, _: ScanSettings, _: Selection<'_>, frame: &mut [f32]) -> ScanReport {
        frame.fill(55.0);
        ScanReport::default()
    }
}

impl FrameSource for AtRest {
    fn scanning(&mut self) -> Scanning<'_> {
        Scanning::Waits(self)
    }

    fn constants(&self) -> Option<Constants<'_>> {
        Some(self.0.constants())
    }

    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        self.0.set_constants(constants)
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_board_is_set_up_from_the_command_line_and_stays_so() {
    use crate::virtual_device::{Line, QUIET, run_scanning};

    let folder = Folder::new("settings");
    let (port, near, far) = crate::device::serial_port::terminal();
    let sensor = AtRest(ZeroPotential::TYPICAL);
    run_scanning(far, Line { one_in: None }, &[], sensor, QUIET, || ());
    drop(near); // the program opens it itself
    let link = |arguments: &[&str]| folder.succeed(&[&["link", &port][..], arguments].concat());

    folder.write("constants.toml", "drive_v = 0.21\nseries_ohm = 0.05\n");
    let page = link(&["constants", "constants.toml"]);
    assert!(page.contains("drive: 0.21000 V of 3.3000 V") && page.contains("0.050"), "{page}");
    let configure = ["configure", "--period-us", "20000", "--send", "both", "--settling-us", "55"];
    let more =
        ["--oversampling=4", "--filter-ms=30", "--lead-ms=4", "--report-every=3", "--track=off"];
    let configure = [&configure[..], &more].concat();
    let page = link(&[&configure[..], &["--contact-threshold", "0.05"]].concat());
    assert!(page.contains("configuration: kept"), "{page}");
    link(&["baseline", "-n", "5", "--period-us", "1000", "-o", "rest.csv"]);
    Device::new(taxel_rig::device::serial::open(&port, 921_600).unwrap())
        .unwrap()
        .restart()
        .unwrap();
    let page = link(&["settings"]);
    for said in [
        "a scan every 20000 µs, 55 µs settling, 4 samples a reading",
        "outputs with a time constant of 30 ms, a lead of 4 ms",
        "tracked if the model has a tracker: no, with a lead of 4 ms",
        "readings yes, estimates yes (one of 3), of confidence nothing",
        "shorted below 5 Ω, open above 1000 Ω, contact from 0.05",
        "constants: kept",
        "drive: 0.21000 V of 3.3000 V",
        "kept: mean of 5 frames of 8 × 18 readings",
    ] {
        assert!(page.contains(said), "{said}: {page}");
    }

    let page = link(&["settings", "--forget", "all"]);
    assert!(page.contains("configuration: none is kept"), "{page}");
    assert!(page.contains("baseline: none is kept"), "{page}");

    folder.write("other.toml", "feedback_ohm = [1.0, 2.0]\n");
    for (arguments, text) in [
        (&["configure"][..], "Usage"),
        (&["constants"], "required arguments"),
        (&["constants", "other.toml"], "feedback_ohm has 2 numbers"),
    ] {
        let output = folder.run(&[&["link", &port][..], arguments].concat());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(text), "{message}");
    }
}
