//! Devices at the far end of a pseudo-terminal, from the command line.

use std::os::fd::AsRawFd;

use serial2::SerialPort;
use taxel_data::Table;
use taxel_learn::{Decoder, Filtered, Timing};

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
    // Row 2 misses a reading of two presses, and row 3 of another one: as many as any row has are used.
    let text = folder.read("presses.csv");
    let blank = |(line, text): (usize, &str)| -> String {
        let mut fields: Vec<&str> = text.split(',').collect();
        match line {
            7 | 9 => fields[20] = "",
            30 => fields[40] = "",
            _ => {}
        }
        fields.join(",") + "\n"
    };
    folder.write("presses.csv", text.lines().enumerate().map(blank).collect::<String>());
    let recalibrate = ["link", &port, "recalibrate", "old.bin", "presses.csv", "-o", "new.bin"];
    let page = folder.succeed(&recalibrate);
    assert!(page.contains("presses that were used: 58\n"), "{page}");
    assert!(page.contains("presses with a missing reading: 2\n"), "{page}");
    let said = folder.fail(&recalibrate, 2);
    assert!(said.contains("the device has another model"), "{said}");
    let is_old = format!("CRC-32 {:08x}", old.parse().crc());
    let page = folder.succeed(&["link", &port, "identify"]);
    assert!(page.contains("slot 1") && !page.contains(&is_old), "{page}");
    let told = &folder.json(&["link", &port, "identify"])["device"];
    let [crc, id] = [&told["model"]["model_crc"], &told["unique_id"]].map(|it| it.as_str());
    assert_eq!((crc.unwrap().len(), id.unwrap().len()), (8, 24), "{told}");
    // The old blob names the new model's outputs, if that is said.
    let record = ["link", &port, "record", "old.bin", "-n", "2", "-o", "estimate.csv"];
    assert_eq!(folder.run(&record).status.code(), Some(2));
    folder.succeed(&[&record[..], &["--recalibrated"]].concat());
    folder.succeed(&["link", &port, "record", "new.bin", "-n", "2", "-o", "estimate.csv"]);

    let page = folder.succeed(&["link", &port, "undo"]);
    assert!(page.contains(&is_old) && page.contains("slot 0"), "{page}");
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
    let text = folder.read("all.csv");
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
    assert_eq!([number("presses"), number("presses_unusable")], [30.0, 0.0]);
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
    let json = folder.succeed(&[&record[..], &["--report-every", "2", "--json"]].concat());
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    let seconds = |line: &str| line.split_once(',').unwrap().0.parse::<f64>().unwrap();
    let last_s = folder.read("log.csv").lines().last().map(seconds).unwrap();
    let frames_per_s = 2.0 * 7.0 / last_s;
    assert!((found["frames_per_s"].as_f64().unwrap() / frames_per_s - 1.0).abs() < 1e-3, "{json}");
    let counted = ["frames", "frames_lost", "values_missing", "frames_novel"];
    assert_eq!(counted.map(|key| found[key].as_u64()), [8, 0, 0, 0].map(Some), "{json}");
    folder.succeed(&[&record[..], &["--readings"]].concat());
    // Without a period of its own, a recording has the one that the device keeps.
    folder.succeed(&["link", &port, "configure", "--period-us", "20000"]);
    folder.succeed(&["link", &port, "record", "model.bin", "-n", "16", "--time", "-o", "slow.csv"]);
    let slow = folder.read("slow.csv");
    let times_s: Vec<f64> = slow.lines().skip(1).map(seconds).collect();
    // The median: where the host is busy, a frame may be late.
    let mut periods_s: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    periods_s.sort_by(f64::total_cmp);
    assert!((0.019..0.021).contains(&periods_s[periods_s.len() / 2]), "{periods_s:?}");
    let decode = ["decode", "model.bin", "log.csv", "-o", "estimate.csv"];
    folder.succeed(&[&decode[..], &["--filter-ms", "30", "--lead-ms", "4"]].concat());
    let read = |name: &str| {
        let text = folder.read(name);
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
}

#[test]
fn a_device_is_used_from_the_command_line() {
    let folder = Folder::new("link");
    let (old, new) = (model(3), model(4));
    folder.write("old.bin", old.bytes());
    let new_file = folder.write("new.bin", new.bytes());
    let new_file = new_file.to_str().unwrap();
    let (port, near) = port(&old);
    drop(near); // the program opens it itself

    let page = folder.succeed(&["link", &port, "identify"]);
    assert!(page.contains("virtual, firmware"), "{page}");
    assert!(page.contains(&format!("CRC-32 {:08x}, slot 0", old.parse().crc())), "{page}");
    assert!(page.contains("model: \"press\", "), "{page}");
    assert!(page.contains("scanning: paused"), "{page}");

    // Recording under another model's names is refused, before anything is written.
    let wrong = folder.run(&["link", &port, "record", new_file, "-o", "estimate.csv"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert_eq!(folder.names(), ["new.bin", "old.bin"]);

    let page = folder.succeed(&["link", &port, "upload", new_file]);
    assert!(page.contains(&format!("CRC-32 {:08x}, slot 1", new.parse().crc())), "{page}");

    folder.succeed(&["link", &port, "record", new_file, "-n", "10", "-o", "estimate.csv"]);
    let text = folder.read("estimate.csv");
    assert_eq!(text.lines().count(), 11);
    assert!(text.starts_with("r1e1_dx_mm,r1e1_dy_mm,r1e1_dz_mm,"), "{text}");

    // The device's own limits of readings hold: by these, none is sound.
    let limits = |ohm| folder.succeed(&["link", &port, "configure", "--open-above-ohm", ohm]);
    limits("6");
    let record = ["link", &port, "record", new_file, "-n", "2", "-o", "none.csv"];
    assert!(folder.fail(&record, 1).contains("sent no estimate"));
    limits("1000");

    // Without a model, readings are recorded, which can be trained on. Here they are ideal, five in
    // turn.
    folder.succeed(&["link", &port, "record", "-n", "6", "-o", "readings.csv"]);
    let text = folder.read("readings.csv");
    assert!(text.starts_with("r1c1_ohm,r1c2_ohm,"), "{text}");
    let lines: Vec<&str> = text.lines().skip(1).collect();
    assert!(lines.len() == 6 && lines[0] == lines[5] && lines[0] != lines[1]);
    let ohm: Vec<f32> = lines[0].split(',').map(|v| v.parse().unwrap()).collect();
    assert!(frames().iter().any(|frame| frame.as_flattened() == ohm), "{ohm:?}");

    folder.succeed(&["link", &port, "baseline", "-n", "5", "-o", "rest.csv"]);
    let text = folder.read("rest.csv");
    let (header, line) = text.trim_end().split_once('\n').unwrap();
    assert!(header.ends_with("r8c18_ohm"));
    let frames = frames();
    let mean = frames.iter().map(|f| f64::from(f[0][0])).sum::<f64>() / frames.len() as f64;
    let found: f64 = line.split(',').next().unwrap().parse().unwrap();
    assert!((found / mean - 1.0).abs() < 1e-5, "{found} instead of {mean}");

    // What is told of the device, which does nothing meanwhile.
    let page = folder.succeed(&["link", &port, "identify"]);
    let told = folder.json(&["link", &port, "identify"]);
    let of = |key: &str| told["statistics"][key].as_u64().unwrap();
    assert!(of("frames_scanned") > 0 && of("frames_scanned") != of("frames_decoded"), "{told}");
    for line in [
        format!(
            "frames: {} scanned, {} decoded, {} missed, {} samples failed\n",
            of("frames_scanned"),
            of("frames_decoded"),
            of("frames_missed"),
            of("failed_samples")
        ),
        format!(
            "longest: scan {} µs, decoding {} µs\n",
            of("longest_scan_us"),
            of("longest_decode_us")
        ),
        "shape: 8 × 18 readings to 8 × 18 outputs\n".into(),
        "flash: 25460 bytes without the model: vector table 400, code 20000, constants 5000, \
         start values 60\n"
            .into(),
        "RAM: 4760 bytes: variables 3760, stack 1000 at its deepest (of 4096 reserved)\n".into(),
    ] {
        let page = page.replace("\n  ", " ");
        assert!(page.contains(&line), "{line} {page}");
    }

    // Another model on the device is replaced by the one that it is checked with.
    let check = ["link", &port, "check", "press", "--model", "old.bin", "-n", "50"];
    let page = folder.succeed(&check);
    assert!(page.contains("50 of 50 bit-identical"), "{page}");
    let page = folder.succeed(&["link", &port, "identify"]);
    assert!(page.contains(&format!("CRC-32 {:08x}", old.parse().crc())), "{page}");

    for (arguments, text) in [
        (&["upload", "none.bin"][..], "none.bin"),
        (
            &["record", "old.bin", "-o", "x.csv", "--confidence", "novelty"],
            "--confidence: MODEL has none",
        ),
    ] {
        let output = folder.run(&[&["link", &port][..], arguments].concat());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(text), "{message}");
    }
    let names = ["estimate.csv", "new.bin", "old.bin", "readings.csv", "rest.csv"];
    assert_eq!(folder.names(), names);
}

#[test]
fn a_devices_confidence_is_recorded_as_the_host_computes_it() {
    let folder = Folder::new("recorded_confidence");
    let train = ["train", "contact", "-n", "1500", "--no-refine", "--centres", "6"];
    folder.succeed(&[&train[..], &["--reading-model", "full", "-o", "c.bin"]].concat());
    // Of five frames, two are like none of training.
    let mut frames = super::frames();
    frames[1..3].iter_mut().flatten().flatten().for_each(|ohm| *ohm *= 1.3);
    let blob = ModelBlob::of_bytes(&std::fs::read(folder.path("c.bin")).unwrap()).unwrap();
    let (port, near) = port_with(&blob, frames);
    drop(near);
    let record = ["link", &port, "record", "c.bin", "-n", "10", "-o", "log.csv"];
    folder.succeed(&[&record[..], &["--readings"]].concat());
    folder.succeed(&["decode", "c.bin", "log.csv", "--confidence", "-o", "host.csv"]);
    let host = folder.read("host.csv");
    let numbers = |line: &str| -> Vec<f32> {
        line.split(',').map(|it| it.parse().unwrap_or(f32::NAN)).collect()
    };
    let known: Vec<Vec<f32>> = host.lines().skip(1).map(numbers).collect();
    let outputs = 4;
    for (what, columns) in [("deviations", 2 * outputs + 1), ("novelty", outputs + 1)] {
        let found = folder.json(&[&record[..], &["--confidence", what]].concat());
        assert_eq!((found["frames_novel"].as_u64(), found["frames"].as_u64()), (Some(4), Some(10)));
        let text = folder.read("log.csv");
        let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let all = host.lines().next().unwrap().split(',');
        let named = |name: &&str| *name != "status" && names.contains(name);
        assert_eq!((names.len(), all.filter(named).collect::<Vec<_>>()), (columns, names.clone()));
        for line in text.lines().skip(1).map(numbers) {
            // The host's columns that the device sends, outputs, deviations and novelty.
            let same = |host: &Vec<f32>| {
                let deviations = &host[outputs..2 * outputs];
                let deviations = if what == "novelty" { &[] } else { deviations };
                let host = host[..outputs].iter().chain(deviations).chain([&host[2 * outputs]]);
                host.zip(&line).all(|(a, b)| a == b || a.is_nan() && b.is_nan())
            };
            assert!(known.iter().any(same), "{line:?} {known:?}");
        }
    }
}

#[test]
fn an_open_reading_is_an_empty_field() {
    let folder = Folder::new("open");
    let model = model(3);
    let mut frames = super::frames();
    frames[0][5][7] = f32::INFINITY;
    let (port, near) = port_with(&model, frames);
    drop(near);
    for command in ["record", "baseline"] {
        let found = folder.json(&["link", &port, command, "-n", "5", "-o", "log.csv"]);
        assert_eq!(found["values_missing"], 1, "{found}");
        let text = folder.read("log.csv");
        let fields = text.lines().skip(1).flat_map(|line| line.split(','));
        assert_eq!(fields.clone().filter(|field| field.is_empty()).count(), 1, "{text}");
        assert!(
            fields
                .filter(|field| !field.is_empty())
                .all(|it| it.parse::<f64>().unwrap().is_finite())
        );
    }
    folder.write("model.bin", model.bytes());
    folder.succeed(&["decode", "model.bin", "log.csv", "-o", "estimate.csv"]);
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
        assert!(message.contains("the device sent no reading"), "{message}");
    }
    assert!(folder.names().is_empty());
    // One of 144 readings is missing in two of five frames, and with it the 18 outputs of its row.
    folder.write("model.bin", model.bytes());
    let mut frames = super::frames();
    frames[1..3].iter_mut().for_each(|frame| frame[5][7] = f32::NAN);
    let (port, near) = port_with(&model, frames);
    drop(near);
    for (of, missing) in [(&["model.bin"][..], 4 * 18), (&[], 4)] {
        let record = [&["link", &port, "record"], of, &["-n", "10", "-o", "x.csv"]].concat();
        let found = folder.json(&record);
        assert_eq!(found["values_missing"], missing, "{found}");
        let text = folder.read("x.csv");
        let empty = text.lines().flat_map(|line| line.split(',')).filter(|it| it.is_empty());
        assert_eq!(empty.count(), missing);
    }
}
