//! Tests of every part of the readout, against a record of its actions on pins and bus, in order.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{self, ErrorKind, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};

use taxel_core::ColumnWires;

use super::*;
use crate::circuit::{ScannedRow, ZeroPotential};

#[derive(Debug, Clone, PartialEq)]
enum Event {
    Pin(&'static str, bool),
    Transfer(usize, Vec<u8>),
    WaitNs(u32),
}

/// The record that all fakes of one test share.
#[derive(Debug, Clone, Default)]
struct Record(Rc<RefCell<State>>);

#[derive(Debug, Default)]
struct State {
    events: Vec<Event>,
    /// Replies of SPI devices, one after the other; the last one is repeated.
    answers: Vec<[u8; 3]>,
    /// Number of the pin change that fails; below it, that of the transfer.
    failing_pin_change: Option<usize>,
    failing_transfer: Option<usize>,
}

impl Record {
    fn pin(&self, name: &'static str) -> Pin {
        Pin { record: self.clone(), name }
    }

    fn chips<const N: usize>(&self) -> [Spi; N] {
        core::array::from_fn(|chip| Spi { record: self.clone(), chip })
    }

    fn take(&self) -> Vec<Event> {
        std::mem::take(&mut self.0.borrow_mut().events)
    }

    fn count(&self, counts: impl Fn(&Event) -> bool) -> usize {
        self.0.borrow().events.iter().filter(|event| counts(event)).count()
    }

    fn transfers(&self) -> usize {
        self.count(|event| matches!(event, Event::Transfer(..)))
    }

    fn pin_changes(&self) -> usize {
        self.count(|event| matches!(event, Event::Pin(..)))
    }

    /// Lets converters answer with these counts.
    fn answer(&self, counts: &[u16]) {
        let bytes = counts.iter().map(|counts| counts.to_be_bytes());
        self.0.borrow_mut().answers = bytes.map(|[high, low]| [0, high, low]).collect();
    }

    fn fail_transfer(&self, number: Option<usize>) {
        self.0.borrow_mut().failing_transfer = number;
    }

    fn fail_pin_change(&self, number: usize) {
        self.0.borrow_mut().failing_pin_change = Some(number);
    }

    /// Levels of the pins after all events.
    fn levels(&self) -> HashMap<&'static str, bool> {
        let state = self.0.borrow();
        let changes = state.events.iter().filter_map(|event| match event {
            Event::Pin(name, high) => Some((*name, *high)),
            _ => None,
        });
        changes.collect()
    }
}

#[derive(Debug)]
struct Pin {
    record: Record,
    name: &'static str,
}

impl Pin {
    fn set(&self, high: bool) -> Result<(), ErrorKind> {
        let fails = self.record.0.borrow().failing_pin_change == Some(self.record.pin_changes());
        self.record.0.borrow_mut().events.push(Event::Pin(self.name, high));
        if fails { Err(ErrorKind::Other) } else { Ok(()) }
    }
}

impl digital::ErrorType for Pin {
    type Error = ErrorKind;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), ErrorKind> {
        self.set(false)
    }

    fn set_high(&mut self) -> Result<(), ErrorKind> {
        self.set(true)
    }
}

#[derive(Debug)]
struct Spi {
    record: Record,
    chip: usize,
}

impl spi::ErrorType for Spi {
    type Error = spi::ErrorKind;
}

impl SpiDevice for Spi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::ErrorKind> {
        let [Operation::TransferInPlace(bytes)] = operations else { panic!("one exchange") };
        let transfers = self.record.transfers();
        let mut state = self.record.0.borrow_mut();
        state.events.push(Event::Transfer(self.chip, bytes.to_vec()));
        let last = state.answers.len() - 1;
        bytes.copy_from_slice(&state.answers[transfers.min(last)]);
        if state.failing_transfer == Some(transfers) { Err(spi::ErrorKind::Other) } else { Ok(()) }
    }
}

impl DelayNs for Record {
    fn delay_ns(&mut self, ns: u32) {
        self.0.borrow_mut().events.push(Event::WaitNs(ns));
    }
}

/// Levels of a scanner's row pins while it does not scan.
const ROWS_LOW: [(&str, bool); 2] = [("r0", false), ("r1", false)];

#[test]
fn mcp3208_is_asked_in_the_datasheets_bytes() {
    let record = Record::default();
    // Bits before the null bit are undefined: they must not count.
    record.0.borrow_mut().answers = vec![[0xFF, 0b1110_1010, 0xBC]];
    let mut sampler = Mcp3208s { chips: record.chips::<3>() };
    for column in 0..24_u8 {
        assert_eq!(sampler.sample(ColumnWire(column.into())), Ok(0xABC));
        // A start bit, a bit for single-ended, and the channel in three bits across two bytes.
        let channel = column % 8;
        let asked = vec![0x06 | channel >> 2, channel << 6, 0];
        assert_eq!(record.take(), [Event::Transfer(usize::from(column / 8), asked)]);
    }
    assert_eq!(sampler.sample(ColumnWire(24)), Err(SampleError::NotWired(ColumnWire(24))));
    assert!(record.take().is_empty());
    // A chip that is not there.
    record.0.borrow_mut().answers = vec![[0xFF; 3]];
    assert_eq!(sampler.sample(ColumnWire(0)), Err(SampleError::NoAnswer));
}

/// Levels of the shift registers' outputs after `events`, QA of the first chip first.
fn latched(events: &[Event]) -> Vec<bool> {
    let (mut stages, mut shown) = (Vec::new(), Vec::new());
    let mut level = HashMap::from([("data", false), ("clock", true), ("latch", true)]);
    for event in events {
        let Event::Pin(name, high) = event else { panic!("only pins") };
        let rises = *high && level.insert(*name, *high) == Some(false);
        match *name {
            "clock" if rises => stages.insert(0, level["data"]),
            "latch" if rises => shown.clone_from(&stages),
            _ => _ = level.insert(*name, *high),
        }
    }
    shown
}

#[test]
fn shift_register_shows_one_row_and_whole_bytes() {
    fn check<const ROWS: usize>(outputs: usize) {
        let record = Record::default();
        let (data, clock, latch) = (record.pin("data"), record.pin("clock"), record.pin("latch"));
        let mut drive = ShiftRegister595::<_, ROWS> { data, clock, latch };
        for row in 0..ROWS {
            drive.drive(RowWire(row)).unwrap();
            let mut expected = vec![false; outputs];
            expected[row] = true;
            assert_eq!(latched(&record.take()), expected, "row {row} of {ROWS}");
        }
        drive.release().unwrap();
        assert_eq!(latched(&record.take()), vec![false; outputs]);
        assert_eq!(drive.drive(RowWire(ROWS)), Err(DriveError::NotWired(RowWire(ROWS))));
        assert!(record.take().is_empty());
    }
    check::<8>(8);
    check::<10>(16);
}

/// A pin for each row. All are released before one is driven.
struct RowPins([Pin; 2]);

impl RowDrive for RowPins {
    type Error = ErrorKind;

    fn drive(&mut self, row: RowWire) -> Result<(), ErrorKind> {
        self.release()?;
        self.0.get_mut(row.0).ok_or(ErrorKind::Other)?.set_high()
    }

    fn release(&mut self) -> Result<(), ErrorKind> {
        let [first, second] = &mut self.0;
        let outcome = first.set_low();
        outcome.and(second.set_low())
    }
}

type TestScanner = Scanner<RowPins, Mcp3208s<Spi, 1>, Record, 2, 3>;

/// A scanner of 2 × 3 wires over one converter chip and row pins, and the record of what it does.
fn scanner() -> (Record, TestScanner) {
    let record = Record::default();
    record.answer(&[2000]);
    let drive = RowPins(["r0", "r1"].map(|name| record.pin(name)));
    let sampler = Mcp3208s { chips: record.chips() };
    let scanner = Scanner::new(drive, sampler, record.clone(), CIRCUIT);
    (record, scanner)
}

/// A frame of both rows, and the number of samples that failed.
fn scan(scanner: &mut TestScanner) -> ([[f32; 3]; 2], u16) {
    let mut frame = [[7.0; 3]; 2];
    let report = scanner.scan(SETTINGS, WIRES, frame.as_flattened_mut());
    (frame, report.failed_samples)
}

fn are_missing(frame: [[f32; 3]; 2]) -> [[bool; 3]; 2] {
    frame.map(|row| row.map(f32::is_nan))
}

/// A circuit with leads, which are taken out of whole frames.
const CIRCUIT: ZeroPotential<2, 3> =
    ZeroPotential { series_ohm: [0.5, 0.0, 1.0], ..ZeroPotential::TYPICAL };
const WIRES: Selection<'static> =
    Selection { rows: &[RowWire(0), RowWire(1)], columns: ColumnWires::first(3) };
const SETTINGS: ScanSettings = ScanSettings { settling_us: 46, oversampling: 4 };

#[test]
fn a_scan_does_what_it_must_and_no_more() {
    let wild = ScanSettings { settling_us: u32::MAX, oversampling: 0 };
    // Settings out of range are taken for the nearest.
    for (settings, samples, wait_ns) in [(SETTINGS, 4, 46_000), (wild, 1, 5_000_000)] {
        let (record, mut scanner) = scanner();
        let mut frame = [f32::NAN; 6];
        assert_eq!(scanner.scan(settings, WIRES, &mut frame).failed_samples, 0);
        // Each row, and the idle samples, take one wait and so many samples a column.
        assert_eq!(record.count(|event| *event == Event::WaitNs(wait_ns)), 3);
        assert_eq!(record.transfers(), 3 * 3 * samples);
        // A release changes two pins, a drive three.
        assert_eq!(record.pin_changes(), 2 + 2 * 3 + 2);
        assert_eq!(record.levels(), ROWS_LOW.into());
        // Each row settles before it is sampled.
        let events = record.take();
        let high = events.iter().position(|event| *event == Event::Pin("r1", true)).unwrap();
        let then = [Event::WaitNs(wait_ns), Event::Transfer(0, vec![0x06, 0x00, 0])];
        assert!(events[high + 1..].starts_with(&then), "{events:?}");
    }
}

#[test]
fn readings_are_those_of_the_mean_counts() {
    let (record, mut scanner) = scanner();
    record.answer(&[&[250; 12][..], &[2600, 2601, 2603, 2604, 2000]].concat());
    let (frame, _) = scan(&mut scanner);
    let mut expected = [[2602.0, 2000.0, 2000.0], [2000.0; 3]];
    for (row, counts) in expected.iter_mut().enumerate() {
        let row = ScannedRow { row: RowWire(row), columns: WIRES.columns, load: 1.0 };
        CIRCUIT.row_ohm(row, &[250.0; 3], &CIRCUIT.scale(4095), counts);
    }
    CIRCUIT.correct(WIRES.columns, expected.as_flattened_mut());
    assert_eq!(frame, expected);
}

#[test]
fn a_failed_sample_loses_one_reading_or_one_column() {
    // The third sample of the second row's second column, and an idle one of the second column.
    for (failing, first_row) in [(2 * 3 * 4 + 4 + 2, [false; 3]), (4, [false, true, false])] {
        let (record, mut scanner) = scanner();
        record.fail_transfer(Some(failing));
        let (frame, failed) = scan(&mut scanner);
        assert_eq!((are_missing(frame), failed), ([first_row, [false, true, false]], 1));
        // The next scan takes another; where rows are not released for it, the one before does not stand in.
        record.fail_transfer(None);
        assert_eq!(are_missing(scan(&mut scanner).0), [[false; 3]; 2]);
        scanner.restart();
        record.fail_pin_change(record.pin_changes());
        assert_eq!(are_missing(scan(&mut scanner).0), [[true; 3]; 2]);
    }
}

#[test]
fn idle_columns_are_sampled_once_a_round_and_after_each_change() {
    let (record, mut scanner) = scanner();
    let mut frame = [f32::NAN; 6];
    let mut samples = |scanner: &mut TestScanner, settings, wires: Selection<'_>| {
        let before = record.transfers();
        let frame = &mut frame[..wires.rows.len() * wires.columns.count()];
        scanner.scan(settings, wires, frame);
        assert!(
            frame.iter().all(|ohm| !ohm.is_nan()) || record.0.borrow().failing_transfer.is_some()
        );
        (record.transfers() - before) / usize::from(settings.oversampling)
    };
    for scan in 0..40 {
        let expected = if scan % 16 == 0 { 9 } else { 6 };
        assert_eq!(samples(&mut scanner, SETTINGS, WIRES), expected, "scan {scan}");
    }
    // Other settings, constants or columns, and a sample that fails, begin another round; other rows do not.
    let once = ScanSettings { oversampling: 1, ..SETTINGS };
    assert_eq!([once, once].map(|settings| samples(&mut scanner, settings, WIRES)), [9, 6]);
    assert_eq!(scanner.constants(), Some(CIRCUIT.constants()));
    scanner.set_constants(CIRCUIT.constants()).unwrap();
    assert_eq!([once, once].map(|settings| samples(&mut scanner, settings, WIRES)), [9, 6]);
    record.fail_transfer(Some(record.transfers() + 4));
    assert_eq!([once, once, once].map(|it| samples(&mut scanner, it, WIRES)), [6, 9, 6]);
    let second = Selection { rows: &[RowWire(1)], ..WIRES };
    assert_eq!(samples(&mut scanner, once, second), 3);
    // Where a part of the columns is scanned, all of them are sampled idle, and for every row at first; for one row in
    // every round from there on.
    let part = Selection { columns: ColumnWires(0b101), ..WIRES };
    for scan in 0..48 {
        let (expected, turn) = match scan {
            0 => (3 + 2 * 3, Some("r1")),
            16 => (3 + 3 + 2, Some("r1")),
            32 => (3 + 3 + 2, Some("r0")),
            _ => (2 * 2, None),
        };
        record.take();
        assert_eq!(samples(&mut scanner, once, part), expected, "scan {scan} of a part");
        // The row that was driven when the column between them was sampled last.
        let (events, between) = (record.take(), Event::Transfer(0, vec![0x06, 1 << 6, 0]));
        let sampled = events.iter().rposition(|event| *event == between).unwrap_or(0);
        let driven = events[..sampled].iter().rev().find_map(|event| match event {
            Event::Pin(row, true) => Some(*row),
            _ => None,
        });
        assert_eq!(driven, turn, "scan {scan} of a part");
    }
}

#[test]
fn a_failed_pin_change_releases_all_rows_and_loses_readings() {
    for failing in 0..10 {
        let (record, mut scanner) = scanner();
        record.fail_pin_change(failing);
        let (frame, failed) = scan(&mut scanner);
        let rows_missing = frame.map(|row| row.iter().all(|r| r.is_nan()));
        // Without a first release there are no idle samples. Changes 2 to 4 drive row 0; if the releasing half fails, the
        // driving half is left out.
        let expected = match failing {
            0 | 1 => ([true, true], 1),
            2..=4 => ([true, false], 3),
            5..=7 => ([false, true], 3),
            _ => ([false, false], 1),
        };
        assert_eq!((rows_missing, failed), expected, "change {failing}");
        assert_eq!(record.levels(), ROWS_LOW.into());
    }
}

#[test]
fn a_scan_drives_and_reads_only_the_selected_wires() {
    let (record, mut scanner) = scanner();
    let once = ScanSettings { oversampling: 1, ..SETTINGS };
    let wires = Selection { rows: &[RowWire(1)], columns: ColumnWires(0b110) };
    // Idle in all columns, the asked ones first; then the second row's.
    record.answer(&[251, 252, 250, 2001, 2002, 2000]);
    let mut frame = [7.0; 3];
    assert_eq!(scanner.scan(once, wires, &mut frame[..2]).failed_samples, 0);
    let driven = |row| record.0.borrow().events.contains(&Event::Pin(row, true));
    assert_eq!([driven("r0"), driven("r1")], [false, true]);
    let mut events = record.take();
    events.retain(|event| matches!(event, Event::Transfer(..)));
    let asked = [1, 2, 0, 1, 2, 0].map(|column| Event::Transfer(0, vec![0x06, column << 6, 0]));
    assert_eq!(events, asked);
    // Wires that a scanner does not have are missing.
    let beyond = Selection { rows: &[RowWire(0)], columns: ColumnWires::first(4) };
    let mut all = [7.0; 4];
    assert_eq!(scanner.scan(once, beyond, &mut all).failed_samples, 4);
    assert!(all.iter().all(|ohm| ohm.is_nan()), "{all:?}");
    let (idle, counts) = ([250.0, 251.0, 252.0], [2000.0, 2001.0, 2002.0]);
    let load = CIRCUIT.load(wires.columns, &idle, &CIRCUIT.scale(4095), &counts);
    let mut expected = counts;
    let row = ScannedRow { row: RowWire(1), columns: wires.columns, load };
    CIRCUIT.row_ohm(row, &idle, &CIRCUIT.scale(4095), &mut expected);
    CIRCUIT.correct(wires.columns, &mut expected[1..]);
    assert_eq!(frame, [expected[1], expected[2], 7.0]);
}

#[test]
fn the_load_of_a_row_is_measured_again_whatever_its_number() {
    let (record, mut scanner) = scanner();
    let once = ScanSettings { oversampling: 1, ..SETTINGS };
    let wires = Selection { rows: &[RowWire(1)], columns: ColumnWires(0b110) };
    let mut samples = || {
        record.take();
        scanner.scan(once, wires, &mut [0.0; 2]);
        record.transfers()
    };
    let counts: Vec<usize> = (0..=SCANS_A_ROUND).map(|_| samples()).collect();
    assert_eq!((counts[0], counts[1], counts[usize::from(SCANS_A_ROUND)]), (6, 2, 6));
}
