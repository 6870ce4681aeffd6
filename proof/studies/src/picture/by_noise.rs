//! Pictures of studies: the error of decoders against the noise.

use crate::equations::{DAMPED, EXACT};
use crate::level::AtNoise;
use crate::question::directions::{DirectionsResult, INVERTED, INVERTED_DAMPED};
use crate::question::equations::EquationsResult;
use taxel_evaluate::metrics::{NETWORK, of_decoder};
use taxel_learn::decoders::{linear, mean};

use host_sim::report::axes::Axis;
use host_sim::report::chart::{Chart, Mark, Series};
use host_sim::report::format::significant;
use host_sim::report::svg::{Shape, standalone};
use host_sim::report::ticks;

/// Group of outputs that is drawn.
const GROUP: &str = "dz_mm";
/// Size of a picture.
const SIZE: [f64; 2] = [920.0, 420.0];

/// Decoder that is drawn: its name in results and in the picture, and how its line looks.
type Line = (&'static str, &'static str, &'static str, Mark);

/// Picture of the RMSE of z against the noise. A level without noise has no place on its axis.
fn by_noise<L: AtNoise>(title: &str, levels: &[L], lines: &[Line]) -> String {
    let points = |of: &dyn Fn(&L) -> Option<f64>| -> Vec<[f64; 2]> {
        let noisy = levels.iter().filter(|level| level.noise_level() > 0.0);
        noisy.map(|level| [level.noise_level(), of(level).unwrap_or(f64::NAN)]).collect()
    };
    let rmse = |level: &L, decoder: &str| {
        let errors = of_decoder(level.decoders(), decoder);
        errors.iter().find(|errors| errors.group == GROUP).map(|errors| errors.rmse)
    };
    let mut series: Vec<Series> = Vec::new();
    for (decoder, name, class, mark) in lines {
        let points = points(&|level| rmse(level, decoder));
        series.push(Series::new(name, class, mark.clone(), points));
    }
    let limit = |level: &L| {
        level.limit().groups.iter().find(|it| it.group == GROUP).map(|group| group.limit)
    };
    series.push(Series::new("limit", "c3", Mark::LineAnd(Shape::Triangle), points(&limit)));
    let all = |axis: usize| {
        let points = series.iter().flat_map(|series| &series.points);
        points.filter(|point| point[1].is_finite()).map(move |point| point[axis])
    };
    let (x, y) = (
        ticks::logarithmic_percent(all(0)),
        ticks::logarithmic(all(1), |value| significant(value, 2)),
    );
    let chart = Chart {
        title: title.into(),
        x: Axis::logarithmic("noise", x),
        y: Axis::logarithmic("RMSE of Δz (mm)", y),
        series,
        end_labels: true,
    };
    standalone(&chart.draw(SIZE), SIZE)
}

/// Picture of the sensor's equations as a decoder.
pub fn equations_svg(result: &EquationsResult) -> String {
    by_noise(
        "Error of the sensor's equations as a decoder, against the noise",
        &result.levels,
        &[
            (EXACT, "equations, exact", "c2", Mark::LineAnd(Shape::Square)),
            (DAMPED, "equations, damped", "c2", Mark::Dashed),
            (NETWORK, "network", "c1", Mark::LineAnd(Shape::Circle)),
            (linear::NAME, "linear", "muted", Mark::Dotted),
            (mean::NAME, "mean", "muted", Mark::Dashed),
        ],
    )
}

/// Picture of decoding in both directions.
pub fn decoding_svg(result: &DirectionsResult) -> String {
    by_noise(
        "Error of decoding in both directions, against the noise",
        &result.levels,
        &[
            (INVERTED, "inverted", "c2", Mark::LineAnd(Shape::Square)),
            (INVERTED_DAMPED, "inverted, damped", "c2", Mark::Dashed),
            (NETWORK, "direct network", "c1", Mark::LineAnd(Shape::Circle)),
            (linear::NAME, "linear", "muted", Mark::Dotted),
            (mean::NAME, "mean", "muted", Mark::Dashed),
        ],
    )
}
