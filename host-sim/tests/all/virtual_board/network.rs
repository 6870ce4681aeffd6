//! Nodal analysis of the wires: Kirchhoff's current law at every wire whose potential is not held.

use nalgebra::{DMatrix, DVector};

/// Connection of a wire to a voltage through a resistance, besides the rubber.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tie {
    pub(super) volt: f64,
    /// May be zero, or infinite: then the wire floats.
    pub(super) through_ohm: f64,
}

/// Leakage to ground of every wire, in S: a wire without any connection is at 0 V.
const LEAKAGE_S: f64 = 1e-15;

/// Potentials in V of all row-wires, then all column-wires.
///
/// `conductance_s` has the conductances in S between them, row after row; `rows` and `columns` the
/// connections of every wire.
pub(super) fn potentials_v(conductance_s: &[f64], rows: &[Tie], columns: &[Tie]) -> Vec<f64> {
    let ties = || rows.iter().chain(columns);
    let mut potentials: Vec<f64> =
        ties().map(|tie| if tie.through_ohm == 0.0 { tie.volt } else { f64::NAN }).collect();
    let unknown: Vec<usize> = (0..potentials.len()).filter(|i| potentials[*i].is_nan()).collect();
    let mut place_of = vec![usize::MAX; potentials.len()];
    unknown.iter().enumerate().for_each(|(place, wire)| place_of[*wire] = place);

    // G·V = I: currents that leave each unknown wire, and currents that held potentials drive into it.
    let mut matrix = DMatrix::from_diagonal_element(unknown.len(), unknown.len(), LEAKAGE_S);
    let mut current = DVector::zeros(unknown.len());
    for (wire, tie) in ties().enumerate() {
        if unknown.contains(&wire) {
            matrix[(place_of[wire], place_of[wire])] += 1.0 / tie.through_ohm;
            current[place_of[wire]] += tie.volt / tie.through_ohm;
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

    #[test]
    fn a_divider_divides() {
        let rows = [Tie { volt: 3.0, through_ohm: 10.0 }];
        let columns = [Tie { volt: 0.0, through_ohm: 30.0 }];
        let [row, column] = potentials_v(&[1.0 / 20.0], &rows, &columns)[..] else { panic!() };
        assert!((row - 2.5).abs() < 1e-12 && (column - 1.5).abs() < 1e-12, "{row} {column}");
    }

    #[test]
    fn a_bridge_is_balanced_or_not_as_by_hand() {
        // Row 0 at 1 V, row 1 floating, two columns to ground through 100 Ω: row 1 joins them.
        let rows =
            [Tie { volt: 1.0, through_ohm: 0.0 }, Tie { volt: 0.0, through_ohm: f64::INFINITY }];
        let columns = [Tie { volt: 0.0, through_ohm: 100.0 }; 2];
        let ohm = [50.0, 200.0, 40.0, 60.0];
        let v = potentials_v(&ohm.map(|r: f64| 1.0 / r), &rows, &columns);
        // By hand: 100 Ω lie between the columns over row 1.
        //   (1 − a)/50 = a/100 + (a − b)/100,  (1 − b)/200 = b/100 + (b − a)/100
        //   2 − 2a = 2a − b,  1 − b = 4b − 2a  →  4a − b = 2,  −2a + 5b = 1  →  a = 11/18, b = 4/9
        assert!((v[2] - 11.0 / 18.0).abs() < 1e-12 && (v[3] - 4.0 / 9.0).abs() < 1e-12, "{v:?}");
        assert!((v[1] - (60.0 * v[2] + 40.0 * v[3]) / 100.0).abs() < 1e-12);
    }
}
