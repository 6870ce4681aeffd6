use embedded_hal::digital::OutputPin;
use embedded_hal::spi::{Operation, SpiDevice};
use taxel_firmware::readout::{ScanReport, ScanSettings};
use taxel_firmware::timing::ScanPlan;

use super::*;
use taxel_simulate::readout::{Circuit, Drive, Readout, Sampler};
use taxel_simulate::sensor::Sensor;
use taxel_simulate::world::World;

fn board(readout: Readout) -> VirtualBoard {
    VirtualBoard::new(&World { readout, ..World::press() }).unwrap()
}

/// 144 different resistances from 45 to 68 Ω.
fn ohm() -> Vec<f64> {
    (0..144).map(|i| 45.0 + f64::from(i * 37 % 144) * 0.16).collect()
}

fn scan(board: &VirtualBoard, ohm: &[f64], settings: ScanSettings) -> (Vec<f64>, ScanReport) {
    board.set_readings(ohm);
    let mut frame = vec![f32::NAN; board.wires().rows.len() * board.wires().columns.count()];
    let mut scanner = board.scanner(board.series_resistance());
    let report = scanner.scan(settings, board.wires(), &mut frame);
    (frame.iter().map(|ohm| f64::from(*ohm)).collect(), report)
}

/// Largest relative error of a scan with the board's own settings, which must succeed.
fn worst_error(readout: Readout) -> f64 {
    worst_error_on(&board(readout))
}

fn worst_error_on(board: &VirtualBoard) -> f64 {
    let (readings, report) = scan(board, &ohm(), board.scan_settings());
    board.check().unwrap();
    assert_eq!(report, ScanReport::default());
    readings.iter().zip(ohm()).map(|(r, ohm)| (r / ohm - 1.0).abs()).fold(0.0, f64::max)
}

fn with(circuit: Circuit) -> Readout {
    Readout { circuit: Some(circuit), ..Readout::default() }
}

#[test]
fn every_drive_sampler_and_circuit_reads_the_resistances_with_no_more_than_it_needs() {
    for circuit in Circuit::ALL {
        // Number of pins set to release all rows and to drive one.
        for (drive, release, select) in [
            (Drive::Pins, 8, 9),
            (Drive::Multiplexer, 1, 5),
            (Drive::ShiftRegister, 26, 26), // the latch twice; eight times clock, data, clock
        ] {
            // Number of pins set for a sample: three multiplexers off, three address lines, one on.
            for (sampler, of_sample) in [(Sampler::Mcp3208, 0), (Sampler::OnChip, 7)] {
                let (row_drive, sampler) = (Some(drive), Some(sampler));
                let board = board(Readout { row_drive, sampler, ..with(circuit) });
                let worst = worst_error_on(&board);
                // Half a count is up to 0.15 % of a reading by the divider, 0.06 % by the other.
                let (most, steps) =
                    if circuit == Circuit::Divider { (1.5e-3, 8) } else { (6e-4, 9) };
                assert!((1e-5..most).contains(&worst), "{drive:?} {sampler:?}: {worst}");

                let used = board.transactions();
                let samples = steps * 18;
                assert_eq!(used.pins_set, 2 * release + 8 * select + samples * of_sample);
                assert_eq!(used.transfers + used.conversions, samples);
                assert_eq!(used.conversions == 0, of_sample == 0);
                assert_eq!((used.waits, board.active_row()), (steps, None));
            }
        }
    }
}

#[test]
fn a_scan_takes_the_transactions_and_the_time_that_are_planned() {
    let readout = Readout {
        time_constant_us: Some(op_amp_time_constant_us()),
        oversampling: Some(2),
        ..Readout::default()
    };
    let board = board(readout);
    let settings = board.scan_settings();
    assert_eq!(settings, ScanSettings { settling_us: 12, oversampling: 2 });
    scan(&board, &ohm(), settings);
    board.check().unwrap();
    let used = board.transactions();
    // All pins low at the start and at the end; for each row all low and one high.
    assert_eq!(used.pins_set, 8 + 8 * 9 + 8);
    assert_eq!((used.transfers, used.conversions), (9 * 18 * 2, 0));
    assert_eq!(used.waits, 9);
    let plan = ScanPlan {
        rows: 8,
        columns: 18,
        board_columns: 18,
        idle_samples: true,
        settling_us: 12,
        oversampling: 2,
        pass_samples: u16::MAX,
        sample_ns: 24_000,
        reading_ns: 0,
        row_ns: 0,
        between_passes_ns: 0,
    };
    assert_eq!(board.elapsed_ns(), u64::from(plan.longest_us()) * 1000);
    assert_eq!(board.active_row(), None);
}

#[test]
fn sampling_before_voltages_have_settled_is_refused() {
    let hasty = Readout {
        time_constant_us: Some(op_amp_time_constant_us()),
        settling_us: Some(3), // a converter samples 8 µs later
        ..Readout::default()
    };
    let board = board(hasty);
    let (readings, report) = scan(&board, &ohm(), board.scan_settings());
    // Nothing has changed yet when the idle samples are taken, so only the first of a row are early.
    assert!(report.failed_samples >= 8, "{report:?}");
    assert!(readings.iter().filter(|r| r.is_nan()).count() >= 8);
    let refused = board.check().unwrap_err().to_string();
    assert!(refused.contains("settling takes 12 µs"), "{refused}");
    assert_eq!(board.active_row(), None);
}

#[test]
fn what_is_left_of_settling_is_below_half_a_count() {
    let settled =
        Readout { time_constant_us: Some(op_amp_time_constant_us()), ..Readout::default() };
    let worst = worst_error(settled);
    assert!((1e-5..9e-4).contains(&worst), "{worst}");
}

#[test]
fn offsets_drop_out_and_series_resistance_is_corrected() {
    let offset = Readout { op_amp_offset_v: Some(5e-4), ..Readout::default() };
    assert!(worst_error(offset) < 6e-4);
    let source =
        Readout { cross_talk: Some(true), row_switch_ohm: Some(0.3), ..Readout::default() };
    assert!(worst_error(source.clone()) < 6e-4);
    let both = Readout { op_amp_offset_v: Some(5e-4), ..source };
    assert!(worst_error(both) < 6e-4);
}

#[test]
fn rows_disturb_each_other_only_if_the_scene_asks_for_it() {
    let mut other = ohm();
    other[..18].fill(30.0);
    for circuit in Circuit::ALL {
        for cross_talk in [false, true] {
            let readout = Readout { cross_talk: Some(cross_talk), ..with(circuit) };
            let board = board(readout);
            let (before, _) = scan(&board, &ohm(), board.scan_settings());
            let (after, _) = scan(&board, &other, board.scan_settings());
            let disturbed = before[18..] != after[18..];
            assert_eq!(disturbed, cross_talk && circuit == Circuit::Divider, "{circuit:?}");
        }
    }
}

#[test]
fn open_and_short_nodes_are_read_as_such() {
    for circuit in Circuit::ALL {
        let board = board(with(circuit));
        let mut faulty = ohm();
        (faulty[20], faulty[40]) = (f64::INFINITY, 0.0);
        let (readings, report) = scan(&board, &faulty, board.scan_settings());
        board.check().unwrap();
        assert_eq!(report.failed_samples, 0);
        assert_eq!((readings[20], readings[40]), (f64::INFINITY, 0.0), "{circuit:?}");
        assert!((readings[21] / faulty[21] - 1.0).abs() < 1.5e-3);
    }
}

#[test]
fn noise_is_seeded_and_averaging_lessens_it() {
    let noisy = |oversampling| Readout {
        adc_noise_counts: Some(4.0),
        oversampling: Some(oversampling),
        ..Readout::default()
    };
    let deviation = |oversampling| {
        let board = board(noisy(oversampling));
        let (readings, _) = scan(&board, &ohm(), board.scan_settings());
        let square = |(r, ohm): (&f64, f64)| (r / ohm - 1.0).powi(2);
        (readings.iter().zip(ohm()).map(square).sum::<f64>() / 144.0).sqrt()
    };
    assert_eq!(deviation(1).to_bits(), deviation(1).to_bits());
    let ratio = deviation(1) / deviation(64);
    assert!((5.0..11.0).contains(&ratio), "{ratio} instead of 8");
}

#[test]
fn fewer_bits_make_larger_steps() {
    let coarse = |bits| worst_error(Readout { adc_bits: Some(bits), ..Readout::default() });
    let ratio = coarse(8) / coarse(12);
    assert!((8.0..32.0).contains(&ratio), "{ratio} instead of 16");
}

/// Runs `misuse` on a board of the given parts; exactly one violation must contain `says`.
fn refused(readout: Readout, says: &str, misuse: impl FnOnce(&VirtualBoard)) {
    let board = board(readout);
    board.set_readings(&ohm());
    misuse(&board);
    let violations = board.violations();
    assert_eq!(violations.len(), 1, "{violations:?}");
    assert!(violations[0].to_string().contains(says), "{says:?} is not in {violations:?}");
    assert!(board.check().is_err());
}

fn high(board: &VirtualBoard, pins: &[Pin]) {
    pins.iter().for_each(|pin| _ = board.pin(*pin).set_high());
}

fn low(board: &VirtualBoard, pins: &[Pin]) {
    pins.iter().for_each(|pin| _ = board.pin(*pin).set_low());
}

#[test]
fn misused_row_drives_are_refused() {
    let drive = |drive| Readout { row_drive: Some(drive), ..Readout::default() };
    refused(drive(Drive::Pins), "rows [2, 5] (from 0) were driven at once", |board| {
        high(board, &[Pin::Row(5), Pin::Row(2)]);
    });
    refused(drive(Drive::Pins), "RowLatch was set; this board has no such pin", |board| {
        high(board, &[Pin::RowLatch]);
    });
    refused(drive(Drive::Multiplexer), "row multiplexer's address changed while", |board| {
        low(board, &[Pin::RowEnable]);
        assert_eq!(board.active_row(), Some(0));
        high(board, &[Pin::RowAddress(1)]);
        assert_eq!(board.active_row(), Some(2));
    });
    refused(drive(Drive::ShiftRegister), "latched after 7 clocks", |board| {
        for _ in 0..7 {
            low(board, &[Pin::RowClock]);
            high(board, &[Pin::RowClock]);
        }
        high(board, &[Pin::RowLatch]);
    });
    refused(drive(Drive::ShiftRegister), "rows [3, 4] (from 0)", |board| {
        for output in (0..8).rev() {
            board.set_pin(Pin::RowData, output == 3 || output == 4).unwrap();
            low(board, &[Pin::RowClock]);
            high(board, &[Pin::RowClock]);
        }
        high(board, &[Pin::RowLatch]);
    });
}

#[test]
fn misused_converters_are_refused() {
    let transfer = |says: &str, chip: usize, bytes: &[u8]| {
        refused(Readout::default(), says, |board| {
            let mut bytes = bytes.to_vec();
            assert!(board.spi(chip).transfer_in_place(&mut bytes).is_err());
        });
    };
    transfer("sent 2 bytes", 0, &[0x06, 0]);
    transfer("sent 4 bytes", 0, &[0x06, 0, 0, 0]);
    transfer("no start bit", 0, &[0x02, 0, 0]);
    transfer("no start bit", 0, &[0x0E, 0, 0]);
    transfer("differential", 0, &[0x04, 0, 0]);
    transfer("column 18 (from 0)", 2, &[0x06, 0x80, 0]);
    transfer("column 24 (from 0)", 3, &[0x06, 0, 0]);

    let on_chip = || Readout { sampler: Some(Sampler::OnChip), ..Readout::default() };
    refused(on_chip(), "no column selected", |board| _ = board.start_conversion());
    refused(on_chip(), "nobody had started", |board| _ = board.poll_conversion());
    refused(on_chip(), "this board has none", |board| _ = board.transfer(0, &mut [6, 0, 0]));
    refused(on_chip(), "two column multiplexers", |board| {
        low(board, &[Pin::ColumnEnable(0), Pin::ColumnEnable(2)]);
    });
    refused(on_chip(), "column multiplexer's address changed", |board| {
        low(board, &[Pin::ColumnEnable(0)]);
        high(board, &[Pin::ColumnAddress(0)]);
    });
    refused(on_chip(), "column 18 (from 0)", |board| {
        high(board, &[Pin::ColumnAddress(1)]);
        low(board, &[Pin::ColumnEnable(2)]);
        assert!(board.start_conversion().is_err());
    });
    refused(Readout::default(), "none is wired", |board| _ = board.start_conversion());
}

#[test]
fn a_conversion_is_the_same_however_its_bytes_are_clocked() {
    let board = board(Readout::default());
    board.set_readings(&ohm());
    board.set_pin(Pin::Row(1), true).unwrap();
    let mut whole = [0x07, 0x40, 0];
    board.spi(1).transfer_in_place(&mut whole).unwrap();
    let (mut first, mut rest) = ([0; 1], [0x40, 0]);
    let mut pieces =
        [Operation::Transfer(&mut first, &[0x07]), Operation::TransferInPlace(&mut rest)];
    board.spi(1).transaction(&mut pieces).unwrap();
    assert_eq!((first[0], rest), (whole[0], [whole[1], whole[2]]));
    let mut read = [0; 1];
    let mut pieces = [Operation::Write(&[0x07, 0x40]), Operation::Read(&mut read)];
    board.spi(1).transaction(&mut pieces).unwrap();
    assert_eq!(read[0], whole[2]);
    board.check().unwrap();
}

#[test]
fn a_smaller_sensor_and_some_of_its_rows_are_read_alone() {
    let world = World {
        sensor: Sensor { row_wires: 4, column_wires: 5, ..World::press().sensor },
        ..World::press()
    };
    let ohm: Vec<f64> = (0..20).map(|i| 45.0 + f64::from(i)).collect();
    for (read_rows, first) in [(vec![0, 1, 2, 3], 0), (vec![2], 10), (vec![1, 3], 5)] {
        let steps = read_rows.len() + 1;
        let leads = Readout { line_ohm: Some(0.1), cross_talk: Some(true), ..Readout::default() };
        let world = World { read_rows, readout: leads, ..world.clone() };
        let board = VirtualBoard::new(&world).unwrap();
        let (readings, report) = scan(&board, &ohm, board.scan_settings());
        board.check().unwrap();
        // The first scan reads all columns of the board: it does not know how many of them load a row.
        let transfers = board.transactions().transfers;
        assert_eq!((report.failed_samples, transfers), (0, steps * COLUMNS));
        assert_eq!(readings.len(), (steps - 1) * 5);
        assert!((readings[0] / ohm[first] - 1.0).abs() < 1e-3, "{readings:?}");
    }
    let wide = Sensor { row_wires: 9, ..World::press().sensor };
    let refused = VirtualBoard::new(&World { sensor: wide, ..World::press() }).unwrap_err();
    assert!(refused.to_string().contains("parts for 8 and 18"), "{refused}");
    let part = World::press().sensor.with_columns(&[2, 8, 14]);
    let refused = VirtualBoard::new(&World { sensor: part, ..World::press() }).unwrap_err();
    assert!(refused.to_string().contains("readout.column_wires"), "{refused}");
}

#[test]
fn faults_of_wires_and_converters_show_as_their_circuit_says() {
    let leads = Readout {
        row_switch_ohm: Some(0.26),
        line_ohm: Some(0.1),
        cross_talk: Some(true),
        ..Readout::default()
    };
    let read = |fault: BoardFault| {
        let board = board(leads.clone());
        board.set_faults(&[fault]);
        let (readings, _) = scan(&board, &ohm(), board.scan_settings());
        board.check().unwrap();
        readings
    };
    let of_row = |readings: &[f64], row: usize| readings[row * 18..][..18].to_vec();
    let of_column =
        |readings: &[f64], k: usize| readings.iter().skip(k).step_by(18).copied().collect();
    let near = |readings: &[f64], but: &dyn Fn(usize) -> bool| {
        let others = (0..144).filter(|at| !but(*at));
        others.map(|at| (readings[at] / ohm()[at] - 1.0).abs()).fold(0.0, f64::max)
    };
    let all = |values: Vec<f64>, value: f64| values.iter().all(|one| *one == value);

    let open = read(BoardFault::RowOpen(3));
    assert!(all(of_row(&open, 3), f64::INFINITY) && near(&open, &|at| at / 18 == 3) < 1e-3);
    for (fault, value) in [
        (BoardFault::ColumnOpen(4), f64::INFINITY),
        (BoardFault::ColumnAtSupply(4), f64::INFINITY),
        (BoardFault::ColumnAtGround(4), 0.0),
        (BoardFault::Stuck { first: 4, last: 4, is_high: true }, 0.0),
        (BoardFault::Stuck { first: 4, last: 4, is_high: false }, f64::INFINITY),
    ] {
        let readings = read(fault);
        assert!(all(of_column(&readings, 4), value), "{fault:?}");
        // 3 V drive so much current through the leads of all rows that other columns saturate too.
        let is_near = near(&readings, &|at| at % 18 == 4) < 1e-2;
        assert_eq!(is_near, fault != BoardFault::ColumnAtSupply(4), "{fault:?}");
    }
    // A row at ground is always driven; the others come on top, and saturate.
    let ground = read(BoardFault::RowAtGround(3));
    assert!(all(of_row(&ground, 3), f64::INFINITY));
    assert!(ground.iter().filter(|ohm| **ohm == 0.0).count() > 60);
    // A row at the supply saturates all columns.
    assert!(all(read(BoardFault::RowAtSupply(3)), f64::INFINITY));
    // Neighbours that touch read alike, and the others as ever.
    let rows = read(BoardFault::RowsTouch(3));
    let (a, b) = (of_row(&rows, 3), of_row(&rows, 4));
    assert!(a.iter().zip(&b).all(|(a, b)| (a / b - 1.0).abs() < 2e-3), "{a:?} {b:?}");
    assert!(near(&rows, &|at| [3, 4].contains(&(at / 18))) < 1e-2);
    let columns = read(BoardFault::ColumnsTouch(8));
    let (a, b): (Vec<f64>, Vec<f64>) = (of_column(&columns, 8), of_column(&columns, 9));
    assert!(a.iter().zip(&b).all(|(a, b)| (a / b - 1.0).abs() < 2e-2), "{a:?} {b:?}");
    assert!(near(&columns, &|at| [8, 9].contains(&(at % 18))) < 1e-2);
}
