//! Figures of how errors are distributed: over their size, over true values, and over the face.

use super::colour::ColourScale;
use super::face::Face;
use super::face_map::{Map, Values};
use super::figures::{Figure, Panel};
use super::format::{grouped, percent, symbol, with_unit};
use super::plot;
use taxel_evaluate::evaluate::distribution::Distribution;
use taxel_evaluate::run::SensorSketch;

/// What pictures of errors show.
#[derive(Debug, Clone, Copy)]
pub struct Pictures<'a> {
    pub distribution: &'a Distribution,
    /// Number of frames that were decoded.
    pub frames: usize,
    pub sensor: Option<&'a SensorSketch>,
}

/// Figure of decoded against true outputs, one panel a group.
pub fn density(view: &Pictures<'_>) -> Figure {
    let groups = &view.distribution.groups;
    let panels: Vec<Panel> = groups.iter().map(plot::density).collect();
    let outside: usize = groups.iter().map(|group| group.density.outside).sum();
    let outside = match outside {
        0 => String::new(),
        count => format!(" {} estimates lie beyond the plots.", grouped(count)),
    };
    Figure::of_panels(
        "decoded-against-true",
        format!(
            "Decoded against true outputs of all {} frames. On the line both are equal; a model that has learnt \
             nothing gives a horizontal band. A fuller square holds more pairs, on a logarithmic scale.{outside}",
            grouped(view.frames)
        ),
        &panels,
    )
}

/// Figure of the sizes of errors, one panel a group.
pub fn histogram(view: &Pictures<'_>) -> Figure {
    let groups = &view.distribution.groups;
    let panels: Vec<Panel> = groups.iter().map(plot::histogram).collect();
    let (beyond, count) = groups.iter().fold((0, 0), |(beyond, count), group| {
        (beyond + group.histogram.beyond, count + group.count)
    });
    let share = beyond as f64 / count.max(1) as f64;
    let beyond = if beyond == 0 {
        String::new()
    } else {
        format!(" {} of all errors lie beyond the plots.", percent((share * 1e5).ceil() / 1e5))
    };
    Figure::of_panels(
        "sizes-of-errors",
        format!(
            "Sizes of errors: share of |decoded − true| in bins of equal width, on a logarithmic scale, over all \
             outputs and frames. Dashed: the median, and the value that 95 % of the errors do not exceed.{beyond}"
        ),
        &panels,
    )
}

/// Figure of RMSE by electrode, one map a group.
pub fn by_electrode(view: &Pictures<'_>, face: &Face) -> Figure {
    let rmse: Vec<f64> = view.distribution.outputs.iter().map(|output| output.rmse).collect();
    let map = |group: &taxel_evaluate::evaluate::distribution::GroupDistribution| {
        let values = face.values(view.distribution, &group.group, &rmse);
        let scale = ColourScale::sequential(values.iter().copied());
        let name = format!("RMSE of {}", symbol(&group.group));
        let label = with_unit(&name, &group.unit);
        let (scale, label, unit) = (&scale, &label, &group.unit);
        let values = Values { of_cells: &values, scale, label, unit, shown: 3 };
        Map::new(face, &format!("{name} by electrode"), &name, BAR_PX).values(&values)
    };
    let panels: Vec<Panel> = view.distribution.groups.iter().map(map).collect();
    let unread = view.sensor.is_some_and(|sensor| sensor.row_wires.iter().any(|row| !row.read));
    let cells = match (face.outline, unread) {
        (Some(_), true) => {
            "A cell is the area nearer to its electrode than to any other. Blank parts belong to row-wires that are \
             not read."
        }
        (Some(_), false) => "A cell is the area nearer to its electrode than to any other.",
        (None, _) => "Electrodes are drawn in a grid, because their positions are not known.",
    };
    Figure::of_panels(
        "errors-by-electrode",
        format!(
            "RMSE by electrode, over all frames. Each map has a scale of its own, from the least to the largest \
             value. {cells}"
        ),
        &panels,
    )
}

/// Height of a map's bar in px.
pub const BAR_PX: f64 = 56.0;
