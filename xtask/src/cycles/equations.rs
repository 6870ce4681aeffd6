//! Linear equations for the prices of pieces of code: for each frame, how often it executes each.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use taxel_learn::cost::Pieces;

use crate::process::Outcome;

/// Ratio of the least to the largest singular value from which on prices can be told apart.
const LEAST_SINGULAR: f64 = 1e-9;

/// Rounds over all prices after which those between bounds have settled.
const ROUNDS: usize = 3000;

/// Equations whose unknowns are prices by the names of pieces.
pub struct Equations<'f> {
    names: Vec<&'f str>,
    /// A line for each frame and a column for each piece, of length 1, so that pieces that are executed seldom count
    /// as well.
    matrix: DMatrix<f64>,
    lengths: DVector<f64>,
    units: DVector<f64>,
}

impl<'f> Equations<'f> {
    /// Makes equations from the pieces of each frame. Its error counts in parts of its unit.
    pub fn new(frames: impl IntoIterator<Item = (Vec<&'f Pieces>, f64)>) -> Self {
        let frames: Vec<_> = frames.into_iter().collect();
        let pieces = |frame: &(Vec<&'f Pieces>, f64)| -> Vec<(&'f str, u64)> {
            frame.0.iter().flat_map(|pieces| pieces.iter()).collect()
        };
        let mut places: BTreeMap<&str, usize> = BTreeMap::new();
        for (name, _) in frames.iter().flat_map(pieces) {
            places.insert(name, 0);
        }
        places.values_mut().enumerate().for_each(|(index, place)| *place = index);
        let mut matrix = DMatrix::zeros(frames.len(), places.len());
        for (line, frame) in frames.iter().enumerate() {
            for (name, times) in pieces(frame) {
                matrix[(line, places[name])] += times as f64 / frame.1;
            }
        }
        let lengths = DVector::from_fn(places.len(), |column, _| matrix.column(column).norm());
        for (column, length) in lengths.iter().enumerate() {
            matrix.column_mut(column).unscale_mut(*length);
        }
        let units = DVector::from_iterator(frames.len(), frames.iter().map(|frame| frame.1));
        Self { names: places.into_keys().collect(), matrix, lengths, units }
    }

    /// The prices with the least squares of errors, for each kind of `costs`.
    pub fn least_squares<const N: usize>(
        &self,
        costs: &[[f64; N]],
    ) -> Outcome<Vec<(&'f str, [f64; N])>> {
        let decomposed = self.matrix.clone().svd(true, true);
        let values = &decomposed.singular_values;
        if values.min() < LEAST_SINGULAR * values.max() {
            let direction = decomposed.v_t.as_ref().map(|v_t| v_t.row(values.imin()).into_owned());
            let direction = direction.ok_or("the decomposition has no directions")?;
            let parts = self.names.iter().zip(&direction).filter(|(_, part)| part.abs() > 1e-6);
            let mixed: Vec<&str> = parts.map(|(name, _)| *name).collect();
            return Err(format!(
                "the designs do not tell the prices of these apart: {}",
                mixed.join("; ")
            ));
        }
        let right =
            DMatrix::from_fn(costs.len(), N, |line, cost| costs[line][cost] / self.units[line]);
        let solved = decomposed.solve(&right, 0.0)?;
        let price = |column: usize| {
            std::array::from_fn(|cost| solved[(column, cost)] / self.lengths[column])
        };
        Ok(self.names.iter().enumerate().map(|(column, name)| (*name, price(column))).collect())
    }

    /// The prices with the least squares of errors among those from 0 to the `most` of each piece, by coordinate descent
    /// on the normal equations.
    pub fn bounded(&self, costs: &[f64], most: impl Fn(&str) -> f64) -> BTreeMap<&'f str, f64> {
        let right = DVector::from_iterator(costs.len(), costs.iter().copied());
        let normal = self.matrix.tr_mul(&self.matrix);
        let wanted = self.matrix.tr_mul(&right.component_div(&self.units));
        let most = DVector::from_fn(self.names.len(), |column, _| {
            most(self.names[column]) * self.lengths[column]
        });
        let mut prices: DVector<f64> = DVector::zeros(self.names.len());
        for _ in 0..ROUNDS {
            for column in 0..prices.len() {
                let error = normal.column(column).dot(&prices) - wanted[column];
                let free = prices[column] - error / normal[(column, column)];
                prices[column] = free.min(most[column]).max(0.0);
            }
        }
        prices.component_div_assign(&self.lengths);
        self.names.iter().copied().zip(prices.iter().copied()).collect()
    }
}

#[cfg(test)]
mod tests {
    use model_core::blob::ModelShape;
    use model_core::rbf::Format;
    use taxel_learn::Exponential;
    use taxel_learn::cost::{Design, FramePieces, Gating};

    use super::*;

    /// Pieces of one row of 18 inputs in `fixed16`: a start, and sixteen centres with as many outputs.
    fn pieces(sixteens: usize, outputs: usize) -> Pieces {
        let shape = ModelShape { rows: 1, inputs: 18, outputs };
        let design = Design::of_rows(shape, Format::Fixed16, 16 * sixteens, false);
        FramePieces::of(&design, Exponential::default(), Gating::Ungated).assembly
    }

    /// Pieces with several numbers of centres and outputs, and what they cost by these prices of each piece.
    fn frames(price: impl Fn(&str) -> f64) -> (Vec<Pieces>, Vec<f64>) {
        let sizes = (1..6).flat_map(|sixteens| [2, 5, 18].map(|outputs| (sixteens, outputs)));
        let pieces: Vec<Pieces> =
            sizes.map(|(sixteens, outputs)| pieces(sixteens, outputs)).collect();
        let cost =
            |pieces: &Pieces| pieces.iter().map(|(name, times)| price(name) * times as f64).sum();
        let costs = pieces.iter().map(cost).collect();
        (pieces, costs)
    }

    #[test]
    fn prices_are_found_again() {
        let price = |name: &str| name.len() as f64 - 20.0;
        let (pieces, costs) = frames(price);
        let equations = Equations::new(pieces.iter().map(|pieces| (vec![pieces], 7.0)));
        let costs: Vec<[f64; 1]> = costs.into_iter().map(|cost| [cost]).collect();
        let found = equations.least_squares(&costs).unwrap();
        assert!(found.len() > 4, "{found:?}");
        for (name, [found]) in found {
            assert!((found - price(name)).abs() < 1e-6, "{name}: {found}");
        }
    }

    #[test]
    fn prices_between_bounds_are_found_again_or_end_there() {
        let price = |name: &str| if name.ends_with("an output") { 0.0 } else { 3.0 };
        let (pieces, mut costs) = frames(price);
        let equations = Equations::new(pieces.iter().map(|pieces| (vec![pieces], 1.0)));
        for (name, found) in equations.bounded(&costs, |_| 4.0) {
            assert!((found - price(name)).abs() < 1e-3, "{name}: {found}");
        }
        costs.iter_mut().for_each(|cost| *cost = -1.0);
        assert!(equations.bounded(&costs, |_| 4.0).values().all(|price| *price == 0.0));
        costs.iter_mut().for_each(|cost| *cost = 1e6);
        assert!(
            equations.bounded(&costs, |_| 4.0).values().all(|price| (*price - 4.0).abs() < 1e-9)
        );
    }

    #[test]
    fn pieces_that_always_come_together_are_named() {
        // With 18 outputs alone, centres cannot be told from their outputs.
        let pieces: Vec<Pieces> = (1..6).map(|sixteens| pieces(sixteens, 18)).collect();
        let equations = Equations::new(pieces.iter().map(|pieces| (vec![pieces], 1.0)));
        let error = equations.least_squares(&[[1.0]; 5]).unwrap_err();
        assert!(error.contains("fixed16: sixteen centres, an output"), "{error}");
        assert!(!error.contains("18 inputs, 18 outputs"), "{error}");
    }
}
