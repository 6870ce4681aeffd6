//! Condition of the least-squares problem against the width of the Gaussians.

use nalgebra::DMatrix;
use taxel_data::random::{Purpose, Random, Stream};

use super::chart::{Chart, Line};

const SAMPLES: usize = 500;

/// Picture of the condition of the regressors of 16 and of 64 Gaussians, without tail, on two inputs.
pub fn draw() -> String {
    let widths: Vec<f64> =
        (0..=60).map(|step| 10_f64.powf(-2.0 + f64::from(step) / 15.0)).collect();
    let of =
        |centres: usize| widths.iter().map(|width| [*width, condition(centres, *width)]).collect();
    let level = |value: f64| widths.iter().map(|width| [*width, value]).collect();
    let line =
        |name, colour, dashed, points| Line { name, colour, dashed, points, crosses: vec![] };
    let chart = Chart {
        title: "Condition of the regressors against the width of the Gaussians",
        x_label: "width σ of the Gaussians, on scaled inputs",
        y_label: "condition of the matrix that weights are fitted through",
        x: [0.01, 100.0],
        y: [1.0, 1e17],
        steps: [1, 4],
        lines: vec![
            line("64 centres", 1, false, of(64)),
            line("16 centres", 2, false, of(16)),
            line("f64 has no digit left", 0, true, level(1.0 / f64::EPSILON)),
            line("f32 has no digit left", 0, true, level(1.0 / f64::from(f32::EPSILON))),
        ],
    };
    chart.draw()
}

/// Ratio of the largest singular value to the smallest.
fn condition(centres: usize, width: f64) -> f64 {
    let mut random = Random::new(1, Stream::Training, Purpose::Centres, 0, 0);
    let mut places = |count: usize| -> Vec<[f64; 2]> {
        (0..count).map(|_| [random.unit(), random.unit()]).collect()
    };
    let (centres, samples) = (places(centres), places(SAMPLES));
    let activation = |row: usize, column: usize| {
        let Some(centre) = centres.get(column) else { return 1.0 };
        let [x, y] = [0, 1].map(|axis| samples[row][axis] - centre[axis]);
        (-(x * x + y * y) / (2.0 * width * width)).exp()
    };
    let matrix = DMatrix::from_fn(SAMPLES, centres.len() + 1, activation);
    let values = matrix.singular_values();
    // Where the smallest is lost in rounding, the condition is only known to be beyond f64.
    (values.max() / values.min()).min(10.0 / f64::EPSILON)
}
