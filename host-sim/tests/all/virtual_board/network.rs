//! Nodal analysis of the wires: Kirchhoff's current law at every wire whose potential is not held.

use nalgebra::{DMatrix, DVector};

/// Connection of a wire, besides the rubber.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Tie {
    /// No connection.
    Floating,
    /// Connection to a voltage, through a resistance that may be zero.
    Held { volt: f64, through_ohm: f64 },
}

/// Leakage to ground of every wire, in S: a wire without any connection is at 0 V.
const LEAKAGE_S: f64 = 1e-15;

/// Potentials in V of all row-wires, then all column-wires.
///
/// `conductance_s` has the conductances in S between them, row after row; `rows` and `columns` the
/// connections of every wire.
pub(super) fn potentials_v(conductance_s: &[f64], rows: &[Tie], columns: &[Tie]) -> Vec<f64> {
    let ties = || rows.iter().chain(columns);
    let mut potentials: Vec<f64> = ties()
        .map(|tie| match tie {
            Tie::Held { volt, through_ohm: 0.0 } => *volt,
            _ => f64::NAN,
        })
        .collect();
    let unknown: Vec<usize> = (0..potentials.len()).filter(|i| potentials[*i].is_nan()).collect();
    let mut place_of = vec![usize::MAX; potentials.len()];
    unknown.iter().enumerate().for_each(|(place, wire)| place_of[*wire] = place);

    // G·V = I: currents that leave each unknown wire, and currents that held potentials drive into it.
    let mut matrix = DMatrix::from_diagonal_element(unknown.len(), unknown.len(), LEAKAGE_S);
    let mut current = DVector::zeros(unknown.len());
    for (wire, tie) in ties().enumerate() {
        if let (Tie::Held { volt, through_ohm }, Some(_)) = (tie, unknown.get(place_of[wire])) {
            matrix[(place_of[wire], place_of[wire])] += 1.0 / through_ohm;
            current[place_of[wire]] += volt / through_ohm;
        }
    }
    let nodes = conductance_s.iter().enumerate();
    let nodes = nodes
        .map(|(at, siemens)| ([at / columns.len(), rows.len() + at % columns.len()], *siemens));
    for (ends, siemens) in nodes {
        for (near, far) in [(ends[0], ends[1]), (ends[1], ends[0])] {
            let (near_place, far_place) = (place_of[near], place_of[far]);
            if near_place == usize::MAX {
                continue;
            }
            matrix[(near_place, near_place)] += siemens;
            if far_place == usize::MAX {
                current[near_place] += siemens * potentials[far];
            } else {
                matrix[(near_place, far_place)] -= siemens;
            }
        }
    }
    // Diagonally dominant, hence positive definite.
    let solution = matrix.cholesky().expect("a network of positive conductances").solve(&current);
    unknown.iter().zip(&solution).for_each(|(wire, volt)| potentials[*wire] = *volt);
    potentials
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUND: Tie = Tie::Held { volt: 0.0, through_ohm: 0.0 };

    #[test]
    fn a_divider_divides() {
        let rows = [Tie::Held { volt: 3.0, through_ohm: 10.0 }];
        let columns = [Tie::Held { volt: 0.0, through_ohm: 30.0 }];
        let [row, column] = potentials_v(&[1.0 / 20.0], &rows, &columns)[..] else { panic!() };
        assert!((row - 2.5).abs() < 1e-12 && (column - 1.5).abs() < 1e-12, "{row} {column}");
    }

    #[test]
    fn a_bridge_is_balanced_or_not_as_by_hand() {
        // Row 0 at 1 V, row 1 floating, two columns to ground through 100 Ω: row 1 joins them.
        let rows = [Tie::Held { volt: 1.0, through_ohm: 0.0 }, Tie::Floating];
        let columns = [Tie::Held { volt: 0.0, through_ohm: 100.0 }; 2];
        let ohm = [50.0, 200.0, 40.0, 60.0];
        let v = potentials_v(&ohm.map(|r: f64| 1.0 / r), &rows, &columns);
        // By hand: 100 Ω lie between the columns over row 1.
        //   (1 − a)/50 = a/100 + (a − b)/100,  (1 − b)/200 = b/100 + (b − a)/100
        //   2 − 2a = 2a − b,  1 − b = 4b − 2a  →  4a − b = 2,  −2a + 5b = 1  →  a = 11/18, b = 4/9
        assert!((v[2] - 11.0 / 18.0).abs() < 1e-12 && (v[3] - 4.0 / 9.0).abs() < 1e-12, "{v:?}");
        assert!((v[1] - (60.0 * v[2] + 40.0 * v[3]) / 100.0).abs() < 1e-12);
    }

    #[test]
    fn currents_balance_at_every_floating_wire() {
        let conductance: Vec<f64> =
            (0..144).map(|i| 1.0 / (45.0 + f64::from(i * 37 % 23))).collect();
        let mut rows = [Tie::Floating; 8];
        rows[3] = Tie::Held { volt: 3.3, through_ohm: 0.3 };
        let columns = [Tie::Held { volt: 0.0, through_ohm: 470.0 }; 18];
        let v = potentials_v(&conductance, &rows, &columns);
        for m in (0..8).filter(|m| *m != 3) {
            let sum: f64 = (0..18).map(|k| (v[m] - v[8 + k]) * conductance[m * 18 + k]).sum();
            assert!(sum.abs() < 1e-12, "row {m}: {sum} A");
        }
        for k in 0..18 {
            let sum: f64 = (0..8).map(|m| (v[8 + k] - v[m]) * conductance[m * 18 + k]).sum();
            assert!((sum + v[8 + k] / 470.0).abs() < 1e-12, "column {k}: {sum} A");
        }
    }

    #[test]
    fn a_wire_without_connection_is_at_no_voltage() {
        let v = potentials_v(&[0.0, 0.0], &[Tie::Floating], &[Tie::Floating, GROUND]);
        assert_eq!(v, [0.0; 3]);
    }
}
