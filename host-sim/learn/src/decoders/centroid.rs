//! Baseline: the centroid of what exceeds the readings at rest, which a network must beat on a mat.

use nalgebra::{Cholesky, Matrix3, Vector3};
use taxel_data::dataset::AtRest;
use taxel_data::{Dataset, columns, rest};

use crate::decoder::{Estimates, FrameDecoder, Frames};

/// Name of the decoder in tables and results.
pub const NAME: &str = "centroid";

/// Standard deviations at rest by which a reading must change to count as touched.
const THRESHOLD: f64 = 3.0;

/// Penalty on squared weights as a share of their regressors' mean square: it matters only where cells lie in one line.
const PENALTY: f64 = 1e-9;

/// Decoder of places from the centroid of a touch, and of loads from its strength.
///
/// A cell's weight w is what its reading changes beyond three standard deviations at rest, S is the sum of all. A place is
/// affine in the centroid Σ w·(row, column)/S, a load is affine in S and √S.
#[derive(Debug, Clone, PartialEq)]
pub struct Centroid {
    /// Row-wire and column-wire of each reading, from 1.
    cells: Vec<[f64; 2]>,
    at_rest: AtRest,
    /// Direction in which most readings change when touched: 1 or −1.
    sign: f64,
    outputs: Vec<Output>,
}

/// Output's quantity, and what it is fitted by.
#[derive(Debug, Clone, PartialEq)]
struct Output {
    quantity: Quantity,
    mean: f64,
    weights: Vector3<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Quantity {
    /// Coordinate of the touch along the sensor.
    Place,
    /// Force, weight, pressure or depth of the whole touch.
    Load,
    Other,
}

/// Strength S of a touch, and row and column of its centroid, which are NaN without strength.
type Touch = [f64; 3];

impl Centroid {
    /// Fits the decoder to `training`. `None` if readings are not named after the wires of cells, if they are not known
    /// at rest, or if no output is a place or a load.
    pub fn fit(training: &Dataset) -> Option<Self> {
        let at_rest = training.at_rest.clone()?;
        let (inputs, outputs) = (&training.inputs, &training.outputs);
        let cell = |name: &String| Some(columns::cell_of(name)?.0.map(|wire| wire as f64));
        let cells = inputs.names.iter().map(cell).collect::<Option<_>>()?;
        let quantities: Vec<Quantity> = outputs.names.iter().map(|it| Quantity::of(it)).collect();
        if quantities.iter().all(|it| *it == Quantity::Other) {
            return None;
        }
        let changes = inputs.means().into_iter().zip(&at_rest.level);
        let sign = changes.map(|(mean, level)| mean - level).sum::<f64>().signum();
        let mut this = Self { cells, at_rest, sign, outputs: vec![] };
        let touches = this.touches(&inputs.values);
        let output = |(column, (quantity, mean)): (usize, (Quantity, f64))| {
            let truth = outputs.lines().map(|line| line[column]);
            Output::fit(quantity, mean, touches.iter().zip(truth))
        };
        this.outputs =
            quantities.into_iter().zip(outputs.means()).enumerate().map(output).collect();
        Some(this)
    }

    /// Touch of each frame of `readings`. A missing reading has no weight.
    fn touches(&self, readings: &[f64]) -> Vec<Touch> {
        let AtRest { level, deviation } = &self.at_rest;
        let of_frame = |frame: &[f64]| {
            let rest = level.iter().zip(deviation);
            let cells = frame.iter().zip(rest).zip(&self.cells);
            let [strength, rows, columns] =
                cells.fold([0.0; 3], |sums, ((reading, rest), cell)| {
                    let weight = (self.sign * (reading - rest.0) - THRESHOLD * rest.1).max(0.0);
                    [sums[0] + weight, sums[1] + weight * cell[0], sums[2] + weight * cell[1]]
                });
            [strength, rows / strength, columns / strength]
        };
        readings.chunks_exact(self.cells.len().max(1)).map(of_frame).collect()
    }
}

impl Quantity {
    /// Quantity of the output called `name`.
    fn of(name: &str) -> Self {
        match (columns::is_place(name), rest::is_zero_at_rest(name)) {
            (true, false) => Self::Place,
            (_, true) if columns::row_of(name).is_none() => Self::Load,
            _ => Self::Other,
        }
    }

    /// Regressors of a touch, if it tells the quantity.
    fn regressors(self, &[strength, row, column]: &Touch) -> Option<Vector3<f64>> {
        match self {
            Self::Place => (strength > 0.0).then(|| Vector3::new(row, column, 1.0)),
            Self::Load => Some(Vector3::new(strength, strength.sqrt(), 1.0)),
            Self::Other => None,
        }
    }
}

impl Output {
    /// Fits weights by least squares, places' errors weighed by the touch's strength.
    fn fit<'t>(
        quantity: Quantity,
        mean: f64,
        frames: impl Iterator<Item = (&'t Touch, f64)>,
    ) -> Self {
        let (mut squares, mut products) = (Matrix3::zeros(), Vector3::zeros());
        for (touch, truth) in frames.filter(|(_, truth)| !truth.is_nan()) {
            let Some(x) = quantity.regressors(touch) else { continue };
            let weight = if quantity == Quantity::Place { touch[0] } else { 1.0 };
            squares += weight * x * x.transpose();
            products += weight * truth * x;
        }
        squares += Matrix3::from_diagonal(&(PENALTY * squares.diagonal()));
        let solved = Cholesky::new(squares).map(|it| it.solve(&products));
        Self { quantity, mean, weights: solved.unwrap_or_else(|| Vector3::new(0.0, 0.0, mean)) }
    }
}

impl FrameDecoder for Centroid {
    type State = ();

    fn name(&self) -> &str {
        NAME
    }

    fn inputs(&self) -> usize {
        self.cells.len()
    }

    fn decode(&self, (): &mut (), frames: Frames<'_>) -> Estimates {
        let predict = |touch: &Touch, output: &Output| {
            output.quantity.regressors(touch).map_or(output.mean, |x| x.dot(&output.weights))
        };
        let touches = self.touches(frames.readings);
        let of_touch = |touch| self.outputs.iter().map(move |output| predict(touch, output));
        Estimates::of_values(touches.iter().flat_map(of_touch).collect())
    }
}
