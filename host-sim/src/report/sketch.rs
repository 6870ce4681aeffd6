//! Sketch of a sensor in plan view: wires and electrodes.

use super::axes::{BELOW_PX, Panel, Upright};
use super::data::{Data, number};
use super::face;
use super::figures::Figure;
use super::svg::{Anchor, Svg, TEXT_PX, polyline, text_width};
use super::ticks;
use taxel_evaluate::run::SensorSketch;

/// Draws the sensor in this width, in px.
fn draw(sensor: &SensorSketch, width: f64) -> String {
    let (low, high) = face::extent(sensor);
    let (left, right, top) = (44.0, width - 34.0, 74.0);
    let px_per_mm = ((right - left) / (high[0] - low[0])).min(460.0 / (high[1] - low[1]));
    let right = left + px_per_mm * (high[0] - low[0]);
    let bottom = top + px_per_mm * (high[1] - low[1]);
    let [x, y] = face::axes_mm(low, high);
    let panel = Panel { x, y, left, right, top, bottom };
    let place = |point: [f64; 2]| panel.at(point);
    let mut svg = Svg::new(width, bottom + BELOW_PX, "Row-wires, column-wires and electrodes");
    let [x_mm, y_mm] = sensor.face_mm;
    let corner = place([0.0, y_mm]);
    svg.rect(corner, [px_per_mm * x_mm, px_per_mm * y_mm], "face", "");
    let unread = sensor.row_wires.iter().any(|row| !row.read);
    legend(&mut svg, unread);

    let dense = sensor.column_wires_mm.iter().map(Vec::len).sum::<usize>() > 300;
    let size = if dense { 2.0 } else { 3.0 };
    for (k, column) in sensor.column_numbers.iter().zip(&sensor.column_wires_mm) {
        let points: Vec<[f64; 2]> = column.iter().map(|p| place(*p)).collect();
        let across = |[x, _]: [f64; 2]| [[x, top], [x, bottom]];
        wire(&mut svg, &points, across, "c2 wire");
        for [x, y] in points {
            let text = format!("column-wire {k}");
            svg.hovered_rect([x - size, y - size], [2.0 * size, 2.0 * size], "c2 mark", &text);
        }
    }
    for (m, row) in sensor.row_wires.iter().enumerate() {
        let class = if row.read { "c1" } else { "muted" };
        let points: Vec<[f64; 2]> = row.electrodes_mm.iter().map(|p| place(*p)).collect();
        let across = |[_, y]: [f64; 2]| [[left, y], [right, y]];
        wire(&mut svg, &points, across, if row.read { "c1 wire" } else { "muted wire broken" });
        let read = if row.read { "" } else { ", not read" };
        for (i, place) in points.iter().enumerate() {
            let title = format!("<title>row-wire {}, electrode {}{read}</title>", m + 1, i + 1);
            svg.circle(*place, 1.5 * size, &format!("{class} mark"), &title);
        }
    }
    // Numbers stand at the ends of wires, as far as they do not overlap.
    let mut rows: Vec<(f64, usize)> = Vec::new();
    for (m, row) in sensor.row_wires.iter().enumerate() {
        let last = row.electrodes_mm.iter().max_by(|a, b| a[0].total_cmp(&b[0]));
        rows.extend(last.map(|last| (place(*last)[1], m + 1)));
    }
    let numbers = ticks::spread_out(rows, TEXT_PX);
    for (y, m) in numbers {
        svg.text(right + 8.0, y + TEXT_PX * 0.35, Anchor::Start, "c1 name", &m.to_string());
    }
    let mut columns: Vec<(f64, usize)> = Vec::new();
    for (k, column) in sensor.column_numbers.iter().zip(&sensor.column_wires_mm) {
        let last = column.iter().max_by(|a, b| a[1].total_cmp(&b[1]));
        columns.extend(last.map(|last| (place(*last)[0], *k)));
    }
    for (x, k) in ticks::spread_out(columns, text_width("00") + 3.0) {
        svg.text(x, top - 7.0, Anchor::Middle, "c2 name", &k.to_string());
    }
    svg.rect(corner, [px_per_mm * x_mm, px_per_mm * y_mm], "outline", "");
    panel.draw_axes(&mut svg, Upright::Marks);
    svg.text(0.0, top - 22.0, Anchor::Start, "tick", &panel.y.label);
    svg.finish()
}

/// Draws a wire through its electrodes, or `across` the face if it has only one.
fn wire(
    svg: &mut Svg,
    points: &[[f64; 2]],
    across: impl Fn([f64; 2]) -> [[f64; 2]; 2],
    class: &str,
) {
    match points {
        [only] => svg.path(&polyline(&across(*only)), class),
        _ => svg.path(&polyline(points), class),
    }
}

fn legend(svg: &mut Svg, unread: bool) {
    let (mut x, mut y) = (0.0, TEXT_PX);
    let entries = [("row-wire, upper layer", "c1"), ("column-wire, lower layer", "c2")];
    let unread = unread.then_some(("row-wire that is not read", "muted"));
    for (words, class) in entries.into_iter().chain(unread) {
        let width = 26.0 + 0.85 * text_width(words) + 16.0;
        if x > 0.0 && x + width > 410.0 {
            (x, y) = (0.0, y + TEXT_PX + 6.0);
        }
        let at = y - TEXT_PX * 0.35;
        let broken = if class == "muted" { " broken" } else { "" };
        svg.line([x, at], [x + 20.0, at], &format!("{class} wire{broken}"));
        if class == "c2" {
            svg.rect([x + 7.0, at - 3.0], [6.0, 6.0], "c2 mark", "");
        } else {
            let class = format!("{class} mark");
            svg.add(format_args!(
                r#"<circle cx="{}" cy="{at}" r="4.5" class="{class}"/>"#,
                x + 10.0
            ));
        }
        svg.text(x + 26.0, y, Anchor::Start, "tick", words);
        x += width;
    }
}

/// Figure of the sensor.
pub fn figure(sensor: &SensorSketch) -> Figure {
    let read = sensor.row_wires.iter().filter(|row| row.read).count();
    let all = sensor.row_wires.len();
    let rows = match all - read {
        0 => format!("{all} row-wires"),
        _ => format!("{read} of {all} row-wires, which are read"),
    };
    let drawing = draw(sensor, 480.0);
    Figure {
        name: "sensor".into(),
        caption: format!(
            "The sensor from above, at rest: {rows}, and {} column-wires below them. Dots are the upper electrodes, \
             which move; squares the lower ones. A reading is the resistance between a row-wire and a column-wire.",
            sensor.column_wires_mm.len()
        ),
        html: format!("<div class=\"sketch\">\n{drawing}</div>\n"),
        picture: drawing,
        data: data(sensor),
    }
}

/// Places of all electrodes.
fn data(sensor: &SensorSketch) -> Data {
    let mut data = Data::new(&["wire", "number", "read", "electrode", "x (mm)", "y (mm)"]);
    let rows = sensor.row_wires.iter().enumerate();
    let rows = rows.map(|(m, row)| ("row-wire", m + 1, row.read, &row.electrodes_mm));
    let columns = sensor.column_numbers.iter().zip(&sensor.column_wires_mm);
    let columns = columns.map(|(k, electrodes)| ("column-wire", *k, true, electrodes));
    for (wire, number_of_it, is_read, electrodes) in rows.chain(columns) {
        for (i, [x, y]) in electrodes.iter().enumerate() {
            let first = [wire.to_owned(), number_of_it.to_string(), is_read.to_string()];
            let place = [(i + 1).to_string(), number(*x), number(*y)];
            data.lines.push(first.into_iter().chain(place).collect());
        }
    }
    data
}
