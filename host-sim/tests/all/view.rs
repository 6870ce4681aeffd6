//! `view`: what the page is sent of a device, a simulation, a recording and other people's sensors, and what its buttons do.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::common::{Folder, program};
use crate::device::serial_port::terminal;
use crate::device::{SOUND, frames, model};

/// Longest time that a test waits.
const PATIENCE: Duration = Duration::from_mins(1);

/// A view that runs, and its page's address.
struct Page {
    program: Child,
    _out: BufReader<ChildStdout>,
    host: String,
    token: String,
}

impl Page {
    fn of(folder: &Folder, arguments: &[&str]) -> Self {
        let mut command = program();
        command.current_dir(folder.path("")).arg("view").args(arguments).arg("--no-browser");
        let mut program = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut out = BufReader::new(program.stdout.take().unwrap());
        let mut line = String::new();
        out.read_line(&mut line).unwrap();
        // The address stands alone on its line.
        let (host, token) =
            line.trim_end().strip_prefix("http://").unwrap().split_once("/?token=").unwrap();
        let (host, token) = (host.to_owned(), token.to_owned());
        Self { program, _out: out, host, token }
    }

    fn send(&self, head: &str, body: &str) -> TcpStream {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (host, length) = (&self.host, body.len());
        write!(
            stream,
            "{head}?token={} HTTP/1.1\r\nHost: {host}\r\nContent-Length: {length}\r\n\r\n{body}",
            self.token
        )
        .unwrap();
        stream
    }

    fn events(&self) -> Events {
        Events(BufReader::new(self.send("GET /events", "")))
    }

    /// The answer to what a button asks for: status, and what is said.
    fn ask(&self, action: &str) -> (u16, String) {
        let mut stream = self.send("POST /command", action);
        let mut answer = String::new();
        // The server may leave the connection open.
        let mut bytes = [0; 4096];
        while !answer.contains('}') {
            let count = stream.read(&mut bytes).unwrap();
            assert!(count > 0, "{answer}");
            answer += str::from_utf8(&bytes[..count]).unwrap();
        }
        let status = answer.split(' ').nth(1).unwrap().parse().unwrap();
        let json: Value = serde_json::from_str(answer.split("\r\n\r\n").nth(1).unwrap()).unwrap();
        let said = json.get("message").or(json.get("error")).unwrap().as_str().unwrap();
        (status, said.to_owned())
    }

    /// Ends the program as Ctrl-C does.
    fn end(mut self) {
        let id = self.program.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        assert!(self.program.wait().unwrap().success());
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

struct Events(BufReader<TcpStream>);

impl Events {
    /// Data of the next event of this name that is `wanted`.
    fn next(&mut self, name: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let (mut event, end) = (String::new(), Instant::now() + PATIENCE);
        while Instant::now() < end {
            let mut line = String::new();
            assert!(self.0.read_line(&mut line).unwrap() > 0, "the server has ended");
            if let Some(found) = line.trim_end().strip_prefix("event: ") {
                found.clone_into(&mut event);
            }
            if let Some(data) = line.strip_prefix("data: ").filter(|_| event == name) {
                let data: Value = serde_json::from_str(data).unwrap();
                if wanted(&data) {
                    return data;
                }
            }
        }
        panic!("no such {name}");
    }

    fn any(&mut self, name: &str) -> Value {
        self.next(name, |_| true)
    }
}

fn names(layout: &Value, of: &str) -> Vec<String> {
    let columns = layout[of].as_array().unwrap().iter();
    columns.map(|column| column["name"].as_str().unwrap().to_owned()).collect()
}

fn numbers(values: &Value) -> Vec<f64> {
    values.as_array().unwrap().iter().map(|it| it.as_f64().unwrap_or(f64::NAN)).collect()
}

#[test]
fn a_device_is_shown_with_names_by_checksum_recorded_and_zeroed() {
    let folder = Folder::new("view_device");
    let blob = model(8);
    folder.write("press.bin", blob.bytes());
    let (name, near, far) = terminal();
    // All frames are alike, so that the sensor is at rest.
    let rest = vec![frames()[0]];
    crate::virtual_device::run(far, SOUND, blob.bytes(), rest);
    drop(near);
    // Its own limits tell which readings are open: by the first ones all are.
    for (ohm, open) in [("40", 1), ("1000", 0)] {
        folder.succeed(&["link", &name, "configure", "--open-above-ohm", ohm]);
        let page = Page::of(&folder, &[&name]);
        let is_judged = |it: &Value| it["scan_rate"].as_f64().is_some_and(|rate| rate > 5.0);
        let status = page.events().next("status", is_judged);
        assert_eq!(status["wires"].as_array().unwrap().len(), open, "{status}");
        page.end();
        let record = ["link", &name, "record", "-n", "10", "-o", "readings.csv"];
        let said = String::from_utf8(folder.run(&record).stderr).unwrap();
        assert_eq!(said.contains("all readings open"), open == 1, "{said}");
    }
    let page = Page::of(&folder, &[&name]);
    let mut events = page.events();
    let layout = events.any("layout");
    assert_eq!((layout["kind"].as_str(), layout["rows"].as_u64()), (Some("device"), Some(8)));
    assert_eq!(layout["electrodes"].as_array().unwrap().len(), 48);
    assert_eq!(names(&layout, "readings")[143], "r8c18_ohm");
    assert_eq!(names(&layout, "outputs")[2], "r1e1_dz_mm");
    let frame = events.any("frame");
    let readings = numbers(&frame["readings"]);
    assert!((readings[0] - f64::from(frames()[0][0][0])).abs() < 0.5, "{}", readings[0]);
    assert_eq!(numbers(&frame["outputs"]).len(), 144);
    events.next("status", |status| status["scan_rate"].as_f64().is_some_and(|rate| rate > 5.0));
    let (status, said) = page.ask(r#"{"action":"record"}"#);
    assert_eq!((status, said.as_str()), (200, "recording recording-1.mcap"));
    events.next("status", |it| it["recording"]["seconds"].as_f64().is_some_and(|it| it > 0.3));
    let (status, said) = page.ask(r#"{"action":"stop_recording"}"#);
    assert!(status == 200 && said.starts_with("recording-1.mcap, "), "{said}");
    let first = frame["number"].as_u64();
    events.next("frame", |later| later["number"].as_u64() > first.map(|number| number + 40));
    let (status, said) = page.ask(r#"{"action":"zero"}"#);
    assert_eq!((status, said.as_str()), (200, "zeroed by the mean of 24 frames"));
    page.end();
    let said = folder.succeed(&["decode", "press.bin", "recording-1.mcap", "-o", "estimate.csv"]);
    assert!(said.contains("Decoded frames"), "{said}");
    // The device's own estimates are in the recording, to the bit.
    let reader = taxel_recording::Reader::open(&folder.path("recording-1.mcap")).unwrap();
    let text = folder.read("estimate.csv");
    let mut lines = text.lines().skip(1);
    for frame in reader {
        let decoded = lines.next().unwrap().split(',').map(|field| field.parse::<f32>().unwrap());
        let outputs = frame.unwrap().outputs.unwrap();
        assert!(outputs.iter().map(|it| it.to_bits()).eq(decoded.take(144).map(f32::to_bits)));
    }
    assert!(lines.next().is_none());
}

#[test]
fn a_simulation_shows_the_truth_beside_what_is_decoded() {
    let folder = Folder::new("view_scene");
    let scene = crate::common::small_scene().replace("frames = 3000", "frames = 400");
    folder.write("small.toml", scene);
    let page = Page::of(&folder, &["small.toml", "--frame-rate", "50"]);
    let mut events = page.events();
    let layout = events.any("layout");
    assert_eq!(layout["kind"].as_str(), Some("simulation"));
    let baseline = numbers(&events.any("baseline"));
    assert!(baseline.iter().all(|reading| (20.0..200.0).contains(reading)), "{baseline:?}");
    let frame = events.next("frame", |frame| !frame["contact"].is_null());
    let (outputs, truth) = (numbers(&frame["outputs"]), numbers(&frame["truth"]));
    assert_eq!(outputs.len(), truth.len());
    assert!(truth.iter().any(|value| value.abs() > 0.01));
    let later = events.next("frame", |later| later["time_us"].as_u64() > frame["time_us"].as_u64());
    assert_ne!(later["truth"], frame["truth"], "nothing moves");
    let status = events.next("status", |status| status["times_limit"].as_f64().is_some());
    assert!(status["rmse_mm"].as_f64().unwrap() < 0.3, "{status}");
    assert!(status["times_limit"].as_f64().unwrap() > 0.8, "{status}");
    page.end();
}

#[test]
fn a_recording_is_paused_sought_and_stepped_through() {
    let folder = Folder::new("view_recording");
    folder.succeed(&["synth", "press", "-n", "300", "-o", "press.mcap"]);
    // Its second half second is damaged.
    let mut bytes = std::fs::read(folder.path("press.mcap")).unwrap();
    let quarter = bytes.len() / 4;
    bytes[quarter] ^= 1;
    folder.write("press.mcap", &bytes);
    let page = Page::of(&folder, &["press.mcap"]);
    let mut events = page.events();
    let layout = events.any("layout");
    assert_eq!(
        (layout["kind"].as_str(), layout["duration_s"].as_f64()),
        (Some("recording"), Some(2.99))
    );
    assert_eq!(page.ask(r#"{"action":"pause"}"#).0, 200);
    assert_eq!(page.ask(r#"{"action":"seek","to_s":1.5}"#).0, 200);
    events.next("frame", |frame| frame["time_us"].as_u64() == Some(1_500_000));
    assert_eq!(page.ask(r#"{"action":"step","frames":3}"#).0, 200);
    events.next("frame", |frame| frame["time_us"].as_u64() == Some(1_530_000));
    assert_eq!(page.ask(r#"{"action":"step","frames":-2}"#).0, 200);
    events.next("frame", |frame| frame["time_us"].as_u64() == Some(1_510_000));
    // Also behind a place that was sought, before which no frame was shown.
    assert_eq!(page.ask(r#"{"action":"seek","to_s":2.5}"#).0, 200);
    events.next("frame", |frame| frame["time_us"].as_u64() == Some(2_500_000));
    assert_eq!(page.ask(r#"{"action":"step","frames":-1}"#).0, 200);
    events.next("frame", |frame| frame["time_us"].as_u64() == Some(2_490_000));
    assert_eq!(page.ask(r#"{"action":"seek","to_s":0.7}"#).0, 200);
    events.next("frame", |frame| frame["time_us"].as_u64() > Some(900_000));
    assert_eq!(page.ask(r#"{"action":"speed","factor":10.0}"#).0, 200);
    assert_eq!(page.ask(r#"{"action":"resume"}"#).0, 200);
    let status = events.next("status", |status| status["state"].as_str() == Some("ended"));
    let said = status["message"].as_str().unwrap();
    assert!(said.contains("damaged parts of the recording are left out, 1 so far"), "{said}");
    let (status, said) = page.ask(r#"{"action":"record"}"#);
    assert_eq!(status, 409, "{said}");
    page.end();
}

#[test]
fn data_files_and_lines_of_numbers_are_decoded_by_their_model() {
    use std::fmt::Write as _;
    let folder = Folder::new("view_mat");
    let mut text = String::from("a,b,c,force_n\n");
    for i in 0..400 {
        let x = f64::from(i % 20) / 20.0;
        let y = f64::from(i / 20) / 20.0;
        writeln!(text, "{},{},{},{}", 10.0 + x, 20.0 + y, 15.0 + x * y, x + y).unwrap();
    }
    folder.write("mat.csv", &text);
    let train = ["train", "mat.csv", "--inputs", "a,b,c", "--outputs", "force_n", "--centres", "8"];
    folder.succeed(&[&train[..], &["--no-refine", "-o", "mat.bin"]].concat());
    let page = Page::of(&folder, &["mat.csv", "--model", "mat.bin", "--frame-rate", "20"]);
    let layout = page.events().any("layout");
    assert_eq!(names(&layout, "outputs"), ["force_n"]);
    assert!(layout["electrodes"].as_array().unwrap().is_empty());
    let frame = page.events().any("frame");
    let [decoded, truth] = ["outputs", "truth"].map(|of| numbers(&frame[of])[0]);
    assert!((decoded - truth).abs() < 0.1, "{decoded} N, {truth} N");
    let near_20 = |status: &Value, rate: &str| {
        status[rate].as_f64().is_some_and(|rate| (17.0..23.0).contains(&rate))
    };
    page.events().next("status", |it| near_20(it, "scan_rate") && near_20(it, "decode_rate"));
    page.end();

    let (name, near, mut far) = terminal();
    drop(near);
    let sender = std::thread::spawn(move || {
        for _ in 0..4000 {
            std::thread::sleep(Duration::from_millis(5));
            let _ = far.write_all(b"10.5,20.5,15.25\n");
        }
    });
    let page = Page::of(&folder, &[&name, "--protocol", "csv", "--model", "mat.bin"]);
    let frame = page.events().any("frame");
    assert_eq!(numbers(&frame["readings"]), [10.5, 20.5, 15.25]);
    assert!((numbers(&frame["outputs"])[0] - 1.0).abs() < 0.1, "{frame}");
    page.end();
    // The same line without a page: what is decoded, and a recording of both.
    let record = ["link", &name, "record", "mat.bin", "--protocol", "csv", "-n", "20", "-o"];
    folder.succeed(&[&record[..], &["force.csv", "--time"]].concat());
    let forces = folder.read("force.csv");
    let (header, lines) = forces.split_once('\n').unwrap();
    assert_eq!((header, lines.lines().count()), ("time_s,force_n", 20));
    folder.succeed(&[&record[..], &["force.mcap"]].concat());
    folder.succeed(&["decode", "mat.bin", "force.mcap", "-o", "again.csv"]);
    let again = folder.read("again.csv");
    let fields = |text: &str| -> Vec<f64> {
        text.lines().last().unwrap().split(',').map(|it| it.parse().unwrap()).collect()
    };
    let (recorded, decoded) = (fields(lines)[1], fields(&again)[0]);
    assert!((recorded - decoded).abs() < 1e-6 && (recorded - 1.0).abs() < 0.1, "{recorded} N");
    drop(sender);
}

#[test]
fn frames_of_other_firmware_are_shown_in_the_given_shape() {
    let folder = Folder::new("view_flexitac");
    let (name, near, mut far) = terminal();
    drop(near);
    std::thread::spawn(move || {
        for _ in 0..2000 {
            std::thread::sleep(Duration::from_millis(5));
            let _ = far.write_all(&[0xAA, 0x55, 1, 2, 3, 4, 5, 250]);
        }
    });
    let page = Page::of(&folder, &[&name, "--protocol", "flexitac", "--shape", "2x3"]);
    let mut events = page.events();
    let layout = events.any("layout");
    assert_eq!([&layout["rows"], &layout["columns"]], [2, 3]);
    assert_eq!(
        (names(&layout, "readings")[3].as_str(), &layout["readings"][3]["unit"]),
        ("r2c1_reading", &"counts".into())
    );
    assert_eq!(numbers(&events.any("frame")["readings"]), [1.0, 2.0, 3.0, 4.0, 5.0, 250.0]);
    assert_eq!(numbers(&events.any("baseline")), [1.0, 2.0, 3.0, 4.0, 5.0, 250.0]);
    events.next("status", |it| it["rest"] == "first steady frames");
    page.end();
}

#[test]
fn a_lost_port_is_reopened_and_the_page_says_what_is_wrong() {
    let folder = Folder::new("view_reconnects");
    let port = folder.path("port");
    // A port that is unplugged and plugged in again: a link to one terminal after another.
    let plug = |lines: [&'static [u8]; 2]| {
        let (name, near, mut far) = terminal();
        drop(near);
        let _ = std::fs::remove_file(&port);
        std::os::unix::fs::symlink(name, &port).unwrap();
        let (stop, stopped) = std::sync::mpsc::channel::<()>();
        std::thread::spawn(move || {
            let wait = Duration::from_millis(5);
            let mut lines = lines.iter().cycle();
            while stopped.recv_timeout(wait) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
                let _ = far.write_all(lines.next().unwrap());
            }
        });
        stop
    };
    let plugged = plug([b"1,2,3\n", b"1,2\n"]);
    let shape = ["--protocol", "csv", "--shape", "1x3"];
    let page = Page::of(&folder, &[&[port.to_str().unwrap()][..], &shape].concat());
    let mut events = page.events();
    events.next("status", |status| status["lost"].as_f64() > Some(0.0)); // lines that are cut
    drop(plugged);
    let status = events.next("status", |status| status["state"].as_str() == Some("no data"));
    let said = status["message"].as_str().unwrap();
    assert!(said.contains("no data from ") && said.contains("is the cable plugged in"), "{said}");
    let plugged = plug([b"of another speed"; 2]);
    let is_noise = |status: &Value| status["message"].as_str().unwrap().contains(" bytes came");
    events.next("status", is_noise);
    drop(plugged);
    events.next("status", |status| status["message"].as_str().unwrap().contains("no data from "));
    let _plugged = plug([b"1,2,3\n"; 2]);
    let status = events.next("status", |status| status["state"].as_str() == Some("live"));
    assert!(status["lost"].as_f64() >= Some(1.0), "lines that were cut at first: {status:?}");
    let frame = events.any("frame");
    assert_eq!(numbers(&frame["readings"]), [1.0, 2.0, 3.0]);
    page.end();
}
