use taxel_data::{Purpose, Random, Stream};

use super::*;

const WIRES: Wires = Wires { rows: 3, columns: 4 };

fn typical() -> CircuitConstants {
    CircuitConstants {
        reference_v: 3.3,
        drive_v: 0.2,
        row_source_ohm: vec![0.26; 3],
        feedback_ohm: vec![560.0; 4],
        series_ohm: vec![0.1; 4],
    }
}

/// What a device with typical constants reads on a board that has these.
fn read(actual: &CircuitConstants, known_s: &[f64]) -> Arrangement {
    Arrangement { known_s: known_s.to_vec(), read_s: convert(actual, &typical(), WIRES, known_s) }
}

fn actual() -> CircuitConstants {
    CircuitConstants {
        drive_v: 0.207,
        row_source_ohm: vec![0.1, 0.3, 0.6],
        feedback_ohm: vec![555.0, 561.0, 563.0, 570.0],
        ..typical()
    }
}

/// All places connected, 50 to 61 Ω.
fn full() -> Vec<f64> {
    (0..12).map(|i| 1.0 / f64::from(50 + i * 7 % 12)).collect()
}

/// Only the given places of `full`.
fn only(places: &[usize]) -> Vec<f64> {
    full().iter().enumerate().map(|(i, g)| if places.contains(&i) { *g } else { 0.0 }).collect()
}

fn factor(c: &CircuitConstants, k: usize) -> f64 {
    f64::from(c.drive_v) * f64::from(c.feedback_ohm[k]) / f64::from(c.reference_v)
}

#[test]
fn a_conversion_and_its_inverse_cancel() {
    let there = convert(&typical(), &actual(), WIRES, &full());
    assert!(there.iter().zip(full()).all(|(there, g)| (there / g - 1.0).abs() > 1e-3));
    let back = convert(&actual(), &typical(), WIRES, &there);
    assert!(back.iter().zip(full()).all(|(back, g)| (back / g - 1.0).abs() < 1e-12));
}

#[test]
fn a_full_array_and_one_resistor_tell_all_constants() {
    let arrangements = [full(), only(&[5])].map(|known| read(&actual(), &known));
    let fit = fit(&typical(), WIRES, &arrangements).unwrap();
    for (m, ohm) in fit.constants.row_source_ohm.iter().enumerate() {
        assert!((ohm - actual().row_source_ohm[m]).abs() < 1e-5, "{fit:?}");
    }
    for k in 0..4 {
        assert!((factor(&fit.constants, k) / factor(&actual(), k) - 1.0).abs() < 1e-6, "{fit:?}");
    }
    // What all columns have in common is the drive voltage's.
    let mean = fit.constants.feedback_ohm.iter().map(|r| f64::from(*r).ln()).sum::<f64>() / 4.0;
    assert!((mean.exp() / 560.0 - 1.0).abs() < 1e-6);
    assert!(fit.before.largest > 0.02 && fit.after.largest < 1e-6, "{fit:?}");
    assert_eq!((fit.readings, fit.rows, fit.columns), (13, 3, 4));
    assert_eq!(fit.constants.series_ohm, typical().series_ohm);
}

#[test]
fn wires_without_a_resistor_keep_their_constants() {
    let arrangements = [only(&[4, 5]), only(&[4])].map(|known| read(&actual(), &known));
    let fit = fit(&typical(), WIRES, &arrangements).unwrap();
    assert_eq!((fit.readings, fit.rows, fit.columns), (3, 1, 2));
    assert_eq!(fit.constants.row_source_ohm[0], 0.26);
    assert_eq!(fit.constants.row_source_ohm[2], 0.26);
    assert_eq!(fit.constants.feedback_ohm[2..], [560.0, 560.0]);
    assert!((fit.constants.row_source_ohm[1] - 0.3).abs() < 1e-5, "{fit:?}");
}

#[test]
fn standard_errors_are_as_large_as_the_errors_of_many_calibrations() {
    // Eight readings of two rows and three columns leave three degrees of freedom.
    let known = [only(&[0, 1, 2, 4, 5, 6]), only(&[0]), only(&[5])];
    let mut random = Random::new(1, Stream::Training, Purpose::Noise, 0, 0);
    let (mut squares, mut told) = ([0.0; 2], 0.0);
    let repeats = 2000;
    for _ in 0..repeats {
        let arrangements = known.each_ref().map(|known| {
            let mut arrangement = read(&actual(), known);
            for read in &mut arrangement.read_s {
                *read *= 1.0 + 1e-4 * random.normal();
            }
            arrangement
        });
        let fit = fit(&typical(), WIRES, &arrangements).unwrap();
        for (m, square) in squares.iter_mut().enumerate() {
            let error = fit.constants.row_source_ohm[m] - actual().row_source_ohm[m];
            *square += f64::from(error).powi(2);
        }
        told += fit.row_source_error_ohm.powi(2);
    }
    // Of the two rows, the error of the less certain one is told.
    let ratio = (told / squares[0].max(squares[1])).sqrt();
    assert!((0.95..1.1).contains(&ratio), "{ratio}");
}

#[test]
fn resistors_that_do_not_tell_the_constants_are_refused_with_what_to_add() {
    let refused = |known: &[Vec<f64>]| {
        let arrangements: Vec<_> = known.iter().map(|known| read(&actual(), known)).collect();
        fit(&typical(), WIRES, &arrangements).unwrap_err().to_string()
    };
    assert!(refused(&[full()]).contains("such as a single resistor at r1c1"));
    assert!(refused(&[full(), full()]).contains("no place is read both with few"));
    assert!(refused(&[full(), only(&[0, 1, 2, 4, 5, 6])]).contains("no place is read both"));
    // Another place on the row does not tell, because its column is not known.
    assert!(refused(&[only(&[0, 1, 2]), only(&[3])]).contains("no place is read both"));
    let apart = [only(&[0, 1, 8 + 2, 8 + 3]), only(&[0])];
    assert!(refused(&apart).contains("row 3 shares no column"));
    assert!(refused(&[vec![0.0; 12]]).contains("there are none"));
}

#[test]
fn readings_of_other_resistors_are_refused_with_their_place() {
    let refused = |change: &dyn Fn(&mut Arrangement)| {
        let mut arrangements = [full(), only(&[5])].map(|known| read(&actual(), &known));
        change(&mut arrangements[1]);
        fit(&typical(), WIRES, &arrangements).unwrap_err().to_string()
    };
    let says = refused(&|a| a.read_s.swap(5, 6));
    assert!(says.contains("arrangement 2: r2c2 reads as open"), "{says}");
    let says = refused(&|a| a.read_s[0] = 0.02);
    assert!(says.contains("r1c1 reads 50.0 Ω, and nothing should be connected"), "{says}");
    let says = refused(&|a| a.read_s[5] = f64::NAN);
    assert!(says.contains("r2c2 could not be read"), "{says}");
    let says = refused(&|a| a.read_s[5] *= 3.0);
    assert!(says.contains("should be connected"), "{says}");
    let says = refused(&|a| a.known_s[5] *= 1.3);
    assert!(says.contains("no constants explain"), "{says}");
}
