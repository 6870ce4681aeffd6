//! What writing and reading cost: `measure FILE [frames]`, each of 144 readings and of 144 outputs of 48 electrodes.

use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

use taxel_recording::{Column, Electrode, Extras, Frame, Layout, Reader, Replace, Writer};

const ELECTRODES: usize = 48;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = PathBuf::from(arguments.next().ok_or("usage: measure FILE [frames]")?);
    let count: u32 = arguments.next().map_or(Ok(100_000), |text| text.parse())?;
    let columns = |unit: &str| {
        (0..3 * ELECTRODES).map(|it| Column { name: format!("c{it}"), unit: unit.into() }).collect()
    };
    let electrode = |it: usize| Electrode {
        name: it.to_string(),
        place_mm: [it as f64, 0.0, 5.0],
        outputs: [3 * it, 3 * it + 1, 3 * it + 2].map(Some),
    };
    let layout = Layout {
        title: "measured".into(),
        rows: 8,
        columns: 18,
        readings: columns("Ω"),
        outputs: columns("mm"),
        electrodes: (0..ELECTRODES).map(electrode).collect(),
    };
    let start = Instant::now();
    let mut writer =
        Writer::create(&path, &layout, &Extras::default(), SystemTime::now(), Replace::Recordings)?;
    let mut frame =
        Frame { readings: vec![60.0; 144], outputs: Some(vec![0.5; 144]), ..Frame::default() };
    for number in 0..count {
        (frame.number, frame.time_us) = (number, u64::from(number) * 2000);
        frame.readings[number as usize % 144] += 0.125;
        writer.write(&frame)?;
    }
    writer.finish()?;
    said("written", count, start, &path);

    let start = Instant::now();
    let mut reader = Reader::open(&path)?;
    let opened = start.elapsed();
    let mut read = 0;
    for frame in reader.by_ref() {
        read += u32::from(frame?.outputs.is_some());
    }
    said("read", read, start, &path);
    let start = Instant::now();
    reader.seek(reader.duration() / 2)?;
    reader.next().ok_or("no frame in the middle")??;
    println!(
        "opened in {} µs; a frame in the middle in {} µs",
        opened.as_micros(),
        start.elapsed().as_micros()
    );
    Ok(())
}

fn said(what: &str, frames: u32, start: Instant, path: &Path) {
    let seconds = start.elapsed().as_secs_f64();
    let megabytes = path.metadata().map_or(0, |found| found.len()) >> 20;
    // Linux tells the most memory that was in use.
    let memory = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let memory =
        memory.lines().find(|line| line.starts_with("VmHWM")).unwrap_or_default().to_string();
    println!("{frames} frames {what} in {seconds:.2} s, {megabytes} MiB; {memory}");
}
