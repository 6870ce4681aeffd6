//! Picture of the error against the rate of frames.

use crate::question::rate::{Line, RateStudy};
use taxel_evaluate::evaluate::trade::Readout;

use host_sim::report::axes::Axis;
use host_sim::report::chart::{Chart, Mark, Series};
use host_sim::report::format::{grouped, significant};
use host_sim::report::svg::{Shape, standalone};
use host_sim::report::ticks;

const SIZE: [f64; 2] = [920.0, 460.0];

/// Errors that are drawn: their name, their colour, the noise's time constant, and where they stand in a line.
type Drawn = (&'static str, &'static str, f64, fn(&Line) -> f64);

const DRAWN: [Drawn; 4] = [
    ("still", "c3", 0.0, |line| line.still),
    ("moving", "c2", 0.0, |line| line.moving),
    ("moving, filtered", "c1", 0.0, |line| line.filtered),
    ("noise of 20 ms", "muted", 20.0, |line| line.filtered),
];

/// Picture of a study: a line for each readout and kind of contact.
pub fn svg(study: &RateStudy) -> String {
    let mut series = Vec::new();
    for (readout, name, shape) in [
        (Readout::Spi, "SPI converters", Shape::Circle),
        (Readout::OnChip, "on-chip", Shape::Square),
    ] {
        for (contact, class, time_constant_ms, of) in DRAWN {
            let lines = study.lines.iter().filter(|line| {
                line.readout == readout && line.time_constant_ms == time_constant_ms
            });
            let points = lines.map(|line| [line.frames_per_s, of(line)]).collect();
            let name = format!("{name}: {contact}");
            series.push(Series::new(&name, class, Mark::LineAnd(shape), points));
        }
    }
    let all = |axis: usize| {
        series.iter().flat_map(|series: &Series| &series.points).map(move |point| point[axis])
    };
    let x = ticks::logarithmic(all(0), |rate| grouped(rate.round() as usize));
    let y = ticks::logarithmic(all(1), |value| significant(value, 2));
    let chart = Chart {
        title: "Error against the rate of frames".into(),
        x: Axis::logarithmic("frames a second", x),
        y: Axis::logarithmic(format!("RMSE of {} ({})", study.group, study.unit), y),
        series,
        end_labels: false,
    };
    standalone(&chart.draw(SIZE), SIZE)
}
