//! Small inputs that ask for much: refused with exit status 2, by name, before memory is taken.

use std::fs;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use taxel_evaluate::experiment::EMBEDDED;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const SIZE_BOMBS: Promise = Promise {
    name: "size-bombs",
    text: "inputs that ask for much are refused in bounded memory",
    share: 0,
    check: bombs,
};

/// Most memory in MB that a refusal may take: what a pipe without end fills, and the program itself.
const MOST_MB: f64 = 512.0;
/// Longest time that a refusal may take.
const MOST_TIME: Duration = Duration::from_secs(20);
/// Longest message of a refusal in bytes.
const MOST_SAID: usize = 700;
/// Memory in kB beyond which the system ends a program, so that a broken promise harms nobody.
const LAST_RESORT_KB: u64 = 6_000_000;

/// An input that asks for much.
struct Bomb {
    arguments: Vec<String>,
    /// What the refusal must name.
    names: &'static str,
}

fn bombs(effort: &Effort, tools: &Tools) -> Result<Found, String> {
    let program = tools.program()?;
    let folder = std::env::temp_dir().join(format!("taxel-bombs-{}", std::process::id()));
    fs::create_dir_all(&folder).map_err(|cause| cause.to_string())?;
    let mut all = all(&folder).map_err(|cause| cause.to_string())?;
    if effort.is_planted() {
        // As if the number of frames were not looked at.
        let arguments = ["synth", "press", "-n", "250000", "-o", "/dev/full"];
        all = vec![bomb(&arguments, "/dev/full")];
    }
    let count = all.len() as u64;
    let found = effort.worst((count, count), (MOST_MB, "MB"), |seed| {
        let bomb = &all[(seed % count) as usize];
        refused_at(program, bomb).map_err(|cause| format!("{}: {cause}", bomb.arguments.join(" ")))
    });
    fs::remove_dir_all(&folder).map_err(|cause| cause.to_string())?;
    Ok(found)
}

fn bomb(arguments: &[&str], names: &'static str) -> Bomb {
    Bomb { arguments: arguments.iter().map(|it| (*it).to_owned()).collect(), names }
}

/// All bombs, with their files in `folder`.
fn all(folder: &Path) -> std::io::Result<Vec<Bomb>> {
    let file = |name: &str, bytes: &[u8]| -> std::io::Result<String> {
        let path: PathBuf = folder.join(name);
        fs::write(&path, bytes)?;
        Ok(path.display().to_string())
    };
    let (press, output) = (EMBEDDED[1].1, folder.join("out.csv").display().to_string());
    let mut bombs = Vec::new();
    for (name, field, value, names) in [
        ("rows", "\nrow_wires = 8", "1000000000", "sensor.row_wires"),
        ("columns", "\ncolumn_wires = 18", "1000000000", "sensor.column_wires"),
        (
            "upper",
            "\nelectrodes_per_row_wire = 6",
            "6666666666666666662",
            "electrodes_per_row_wire",
        ),
        ("lower", "\nelectrodes_per_column_wire = 3", "100000000000", "electrodes_per_column_wire"),
        ("frames", "\nframes = 20000", "1000000000000", "training.frames"),
    ] {
        let key = field.split(" = ").next().unwrap_or_default();
        let text = press.replace(field, &format!("{key} = {value}"));
        let scene = file(&format!("{name}.toml"), text.as_bytes())?;
        bombs.push(if name == "frames" {
            bomb(&["train", &scene, "-o", &output], names)
        } else {
            bomb(&["synth", &scene, "-n", "1", "-o", &output], names)
        });
    }
    let legal = press
        .replace("\ncolumn_wires = 18", "\ncolumn_wires = 10000")
        .replace("\nelectrodes_per_column_wire = 3", "\nelectrodes_per_column_wire = 1000");
    let legal = file("legal.toml", legal.as_bytes())?;
    bombs.push(bomb(&["synth", &legal, "-n", "1", "-o", &output], "48 × 10000000 electrodes"));
    let nested = file("nested.toml", format!("name = {}", "[".repeat(200_000)).as_bytes())?;
    bombs.push(bomb(&["run", &nested], "nested.toml"));
    let names: Vec<String> = (0..20_000).map(|column| format!("c{column}")).collect();
    let line = vec!["1"; 20_001].join(",");
    let wide = format!("{},y\n{}", names.join(","), format!("{line}\n").repeat(12));
    let wide = file("wide.csv", wide.as_bytes())?;
    let train =
        ["train", &wide, "--inputs", "c*", "--outputs", "y", "--centres", "2", "-o", &output];
    bombs.push(bomb(&train, "memory = about"));
    for (name, header, names) in [
        ("claim.npy", &b"\x93NUMPY\x02\x00\xff\xff\xff\xff{"[..], "claims 4294967295 bytes"),
        (
            "deep.npy",
            &[&b"\x93NUMPY\x02\x00\x00\x20\x00\x00"[..], &[b'['; 8192]].concat(),
            "not a .npy file",
        ),
    ] {
        let array = file(name, header)?;
        bombs.push(bomb(&["train", &array, "-o", &output], names));
    }
    let packed = file("packed.npz", &zeros("(50000000, 3)", 150_000_000)?)?;
    let train = ["train", &packed, "--inputs", "nope", "--outputs", "c3", "-o", &output];
    bombs.push(bomb(&train, "150000000 numbers together"));
    // Texts that a message could repeat in full.
    let field = file("field.csv", format!("a,y\n1,{}\n", "9".repeat(5_000_000)).as_bytes())?;
    let train = ["train", &field, "--inputs", "a", "--outputs", "y", "-o", &output];
    bombs.push(bomb(&train, "is not a number"));
    let name = file("name.csv", format!("{},y\n1,2\n", "n".repeat(3_000_000)).as_bytes())?;
    let train = ["train", &name, "--inputs", "nope", "--outputs", "y", "-o", &output];
    bombs.push(bomb(&train, "no column matches"));
    let (first, second) =
        (file("first.csv", b"t\n1e300\n-1e300\n")?, file("second.csv", b"t\n1\n")?);
    let join = ["join", &first, &second, "--on", "t", "--tolerance", "1", "-o", &output];
    bombs.push(bomb(&join, "-1e300 is earlier than 1e300"));
    // Devices and pipes without end.
    bombs.push(bomb(&["inspect", "/dev/zero"], "more than 256 MB"));
    bombs.push(bomb(&["train", "/dev/zero", "-o", &output], "more than 256 MB"));
    bombs.push(bomb(&["run", "/dev/zero"], "more than 256 MB"));
    bombs.push(bomb(&["synth", "/dev/zero", "-n", "1", "-o", &output], "more than 16 MB"));
    Ok(bombs)
}

/// Archive of one array of this `shape`: bytes that are all zero, packed a thousandfold.
fn zeros(shape: &str, count: usize) -> std::io::Result<Vec<u8>> {
    let header = format!("{{'descr': '|i1', 'fortran_order': False, 'shape': {shape}, }}");
    let header = format!("{header:<117}\n");
    let mut archive = ZipWriter::new(Cursor::new(vec![]));
    let packed = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    archive.start_file("c.npy", packed)?;
    archive.write_all(&[b"\x93NUMPY\x01\x00\x76\x00", header.as_bytes()].concat())?;
    let zeros = vec![0; 1_000_000];
    for _ in 0..count / zeros.len() {
        archive.write_all(&zeros)?;
    }
    Ok(archive.finish()?.into_inner())
}

/// Memory in MB that the program takes at its peak to refuse a bomb, or what it does instead.
fn refused_at(program: &Path, bomb: &Bomb) -> Result<f64, String> {
    let limited = format!("ulimit -v {LAST_RESORT_KB}; exec \"$0\" \"$@\"");
    let mut child = Command::new("sh")
        .args(["-c", &limited])
        .arg(program)
        .args(&bomb.arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|cause| cause.to_string())?;
    // A pipe that nobody empties would hold the program up.
    let mut stderr = child.stderr.take().ok_or("no pipe for its messages")?;
    let said = thread::spawn(move || {
        let mut said = Vec::new();
        let whole = stderr.read_to_end(&mut said).is_ok();
        if whole { String::from_utf8_lossy(&said).into_owned() } else { String::new() }
    });
    let (start, mut peak_mb) = (Instant::now(), 0.0_f64);
    let status = loop {
        if let Some(status) = child.try_wait().map_err(|cause| cause.to_string())? {
            break status;
        }
        if start.elapsed() > MOST_TIME {
            // It may have ended just now.
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("it takes more than {} s", MOST_TIME.as_secs()));
        }
        peak_mb = peak_mb.max(peak_of(child.id()));
        thread::sleep(Duration::from_millis(1));
    };
    let said = said.join().map_err(|_| "its messages cannot be read".to_owned())?;
    match status.code() {
        Some(2) if said.len() > MOST_SAID => Err(format!("it says {} bytes", said.len())),
        Some(2) if said.contains(bomb.names) => Ok(peak_mb),
        Some(2) => Err(format!("it does not name {:?}: {said}", bomb.names)),
        _ => Err(format!("{status}: {said}")),
    }
}

/// Peak memory of a process in MB so far; 0 if it has just ended.
fn peak_of(process: u32) -> f64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1000.0
}
