//! Tests of scans by passes: rows, settings and readings with a sequencer that reads a table.

use std::cell::RefCell;
use std::rc::Rc;

use super::*;

/// A sequencer that reads what its table shows, for each row and, last, with all rows idle.
#[derive(Debug, Default)]
struct Table {
    counts: Vec<Vec<u32>>,
    /// Passes so far: their lines, their waits and samples.
    passes: Vec<(Vec<Option<usize>>, u32, u16)>,
    /// Polls until a pass ends, and whether it fails then.
    polls: u32,
    left: u32,
    fails: bool,
    stops: u32,
}

impl Sequencer<3> for Rc<RefCell<Table>> {
    const FULL_SCALE_COUNTS: u16 = 4095;
    const MOST_SAMPLES: u16 = 4;

    fn start(&mut self, rows: &[Option<RowWire>], settling_us: u32, samples: u16) {
        let mut this = self.borrow_mut();
        assert!((1..=4).contains(&samples));
        let lines = rows.iter().map(|row| row.map(|row| row.0)).collect();
        this.passes.push((lines, settling_us, samples));
        this.left = this.polls;
    }

    fn poll(&mut self, sums: &mut [[u32; 3]]) -> Option<Result<(), SequencerFault>> {
        let mut this = self.borrow_mut();
        if this.left > 0 {
            this.left -= 1;
            return None;
        }
        if this.fails {
            return Some(Err(SequencerFault));
        }
        let (lines, _, samples) = this.passes.last().unwrap();
        assert_eq!(lines.len(), sums.len());
        for (line, sums) in lines.iter().zip(sums) {
            let counts = &this.counts[line.unwrap_or(this.counts.len() - 1)];
            for (sum, counts) in sums.iter_mut().zip(counts) {
                *sum += counts * u32::from(*samples);
            }
        }
        Some(Ok(()))
    }

    fn stop(&mut self) {
        self.borrow_mut().stops += 1;
    }

    fn line_times(&self, lines: usize, settings: ScanSettings) -> RowTimes {
        let step_us = f32::from(settings.oversampling);
        RowTimes { first_us: lines as f32, step_us }
    }

    fn diagnose(&mut self) -> Option<Diagnosis> {
        Some(Diagnosis { items_left: [0, 0, 5, 1], ..Diagnosis::default() })
    }
}

type Passes = PassScanner<'static, Rc<RefCell<Table>>, 2, 3, 3>;

fn passes(polls: u32) -> (Rc<RefCell<Table>>, Passes) {
    let counts = vec![vec![1000, 1100, 4095], vec![2000, 2100, 2200], vec![248, 249, 250]];
    let table = Rc::new(RefCell::new(Table { counts, polls, ..Table::default() }));
    (table.clone(), PassScanner::new(table, CIRCUIT, Box::leak(Box::default())))
}

/// A circuit with leads, which are taken out of whole frames.
const CIRCUIT: ZeroPotential<2, 3> =
    ZeroPotential { series_ohm: [0.5, 0.0, 1.0], ..ZeroPotential::TYPICAL };
const BOTH: [RowWire; 2] = [RowWire(1), RowWire(0)];
const ALL: Selection<'static> = Selection { rows: &BOTH, columns: ColumnWires(0b111) };
fn scan(
    scanner: &mut Passes,
    settings: ScanSettings,
    wires: Selection<'_>,
    frame: &mut [f32],
) -> ScanReport {
    scanner.start(settings, wires);
    assert!((0..100).any(|_| scanner.poll()), "the scan has no end");
    scanner.take(frame)
}

const ONCE: ScanSettings = ScanSettings { settling_us: 20, oversampling: 1 };

#[test]
fn a_scan_by_passes_computes_what_the_circuit_does() {
    for columns in [0b111, 0b101, 0b010] {
        let (table, mut scanner) = passes(2);
        let wires = Selection { rows: &BOTH, columns: ColumnWires(columns) };
        let mut frame = vec![0.0; 2 * wires.columns.count()];
        scanner.start(ScanSettings { settling_us: 20, oversampling: 10 }, wires);
        let polls = (1..100).find(|_| scanner.poll()).unwrap();
        // The next one may begin before the frame is taken.
        scanner.start(ScanSettings { settling_us: 30, oversampling: 1 }, wires);
        assert_eq!(table.borrow_mut().passes.pop(), Some((vec![None, Some(1), Some(0)], 30, 1)));
        // Of three lines, the first one idle.
        let row_times = RowTimes { first_us: 3.0 + 10.0, step_us: 10.0 };
        assert_eq!(scanner.take(&mut frame), ScanReport { row_times, failed_samples: 0 });
        // Ten samples, four a pass, idle first.
        let lines = vec![None, Some(1), Some(0)];
        let expected: Vec<_> = [4, 4, 2].map(|samples| (lines.clone(), 20, samples)).into();
        assert_eq!((polls, &table.borrow().passes), (9, &expected));
        let mut expected = Vec::new();
        for row in BOTH {
            let mut ohm = [0, 1, 2].map(|column| table.borrow().counts[row.0][column] as f32);
            let scanned = ScannedRow { row, columns: ColumnWires::first(3), load: 1.0 };
            CIRCUIT.row_ohm(scanned, &[248.0, 249.0, 250.0], &CIRCUIT.scale(4095), &mut ohm);
            expected.extend(wires.columns.pick(ohm));
        }
        CIRCUIT.correct(wires.columns, &mut expected);
        let bits = |ohm: &[f32]| ohm.iter().map(|ohm| ohm.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&frame), bits(&expected));
        assert_eq!(frame.iter().filter(|ohm| **ohm == 0.0).count(), usize::from(columns & 4 != 0));
    }
}

#[test]
fn rows_idle_in_the_first_of_sixteen_scans_and_after_changes() {
    let (table, mut scanner) = passes(0);
    let scan = |scanner: &mut Passes, settings| {
        let mut frame = [0.0; 6];
        let report = scan(scanner, settings, ALL, &mut frame);
        let idles = table.borrow().passes.last().unwrap().0[0].is_none();
        // Every scan has the samples of its own alone.
        assert!(report.failed_samples > 0 || (74.3..74.4).contains(&frame[1]), "{frame:?}");
        (idles, report.failed_samples, frame[0].is_nan())
    };
    let idle: Vec<_> = (0..34).map(|_| scan(&mut scanner, ONCE).0).collect();
    let expected: Vec<_> = (0..34).map(|scan| scan % 16 == 0).collect();
    assert_eq!(idle, expected);
    let slower = ScanSettings { settling_us: 30, ..ONCE };
    assert_eq!(scan(&mut scanner, slower), (true, 0, false));
    assert_eq!(scan(&mut scanner, slower), (false, 0, false));
    assert_eq!(scanner.constants(), Some(CIRCUIT.constants()));
    scanner.set_constants(CIRCUIT.constants()).unwrap();
    assert!(scan(&mut scanner, slower).0);
    table.borrow_mut().fails = true;
    assert_eq!(scan(&mut scanner, slower), (false, 6, true));
    table.borrow_mut().fails = false;
    assert_eq!(scan(&mut scanner, slower), (true, 0, false));
    scanner.start(slower, ALL);
    scanner.stop();
    assert_eq!(table.borrow().stops, 1);
    assert!(scan(&mut scanner, slower).0);
    assert_eq!(scanner.diagnose().unwrap().stalled_part(), Some("numbers"));
    assert_eq!(table.borrow().stops, 2);
}

#[test]
fn wires_that_are_not_there_have_no_reading() {
    let (table, mut scanner) = passes(0);
    table.borrow_mut().counts[0][2] = 1200;
    let wires = Selection { rows: &BOTH, columns: ColumnWires(0b1011) };
    let mut frame = [0.0; 6];
    assert_eq!(scan(&mut scanner, ONCE, wires, &mut frame).failed_samples, 2);
    assert_eq!(frame.map(f32::is_nan), [false, false, true, false, false, true]);
}

#[test]
fn samples_that_converters_deliver_are_added_up_by_column() {
    // As the hardware does it: each half of each line, at each trigger, each turn, each converter.
    let (lines, samples) = (3, 5);
    let value =
        |line: usize, column: usize, sample: u16| 100 * line as u16 + 5 * column as u16 + sample;
    let mut delivered = Vec::new();
    for line in 0..lines {
        for half in 0..2 {
            for sample in 0..samples {
                for turn in 0..3 {
                    for converter in 0..3 {
                        let multiplexer = 3 * converter + turn;
                        delivered.push(value(line, 2 * multiplexer + half, sample));
                    }
                }
            }
        }
    }
    let mut sums = [[7; 18]; 3];
    add_samples(&delivered, samples, &mut sums);
    for (line, sums) in sums.iter().enumerate() {
        for (column, sum) in sums.iter().enumerate() {
            let expected: u16 = (0..samples).map(|sample| value(line, column, sample)).sum();
            assert_eq!(*sum, 7 + u32::from(expected), "{line} {column}");
        }
    }
}
