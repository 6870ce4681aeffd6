//! Maps of coloured squares, in rows, with a key.

use host_sim::report::svg::{Anchor, Svg, TEXT_PX, standalone, text_width};

/// Space left of all maps, and between them.
const LEFT: f64 = 112.0;
const BETWEEN: f64 = 18.0;
/// Space above the squares of a row of maps, for headings, and below it, for the columns.
const ABOVE: f64 = 52.0;
const BELOW: f64 = 30.0;
/// Space for a line of text.
const LINE: f64 = 26.0;

/// A square: `above` is good, `below` is bad.
#[derive(Clone)]
pub struct Square {
    pub class: &'static str,
    pub opacity: f64,
    /// Text in it.
    pub text: String,
    pub hover: String,
    /// Whether it has a frame.
    pub is_framed: bool,
}

/// Squares in lines, from the top. The lines of all maps of a row have the same labels.
pub struct Map {
    pub heading: String,
    pub lines: Vec<(String, Vec<Option<Square>>)>,
}

/// Rows of maps, all of which have the same columns.
pub struct Picture {
    pub title: String,
    pub key: Vec<(Square, String)>,
    pub cell: [f64; 2],
    /// Labels of the columns, and what they are.
    pub columns: Vec<String>,
    pub across: &'static str,
    /// Maps with a heading.
    pub rows: Vec<(String, Vec<Map>)>,
}

impl Picture {
    /// The picture as a file of its own.
    pub fn svg(&self) -> String {
        let [cell_width, cell_height] = self.cell;
        let width = cell_width * self.columns.len() as f64;
        let maps = self.rows.iter().map(|(_, maps)| maps.len()).max().unwrap_or_default();
        let total = LEFT + maps as f64 * (width + BETWEEN);
        let lines = |maps: &[Map]| maps.first().map_or(0, |map| map.lines.len()) as f64;
        let heights = self.rows.iter().map(|(_, maps)| ABOVE + cell_height * lines(maps) + BELOW);
        let (places, key) = self.key_places(total);
        let size = [total, key + heights.sum::<f64>() + LINE];
        let mut svg = Svg::new(size[0], size[1], &self.title);
        svg.text(0.0, TEXT_PX + 4.0, Anchor::Start, "label strong", &self.title);
        for ((square, words), [x, y]) in self.key.iter().zip(places) {
            self.draw(&mut svg, [x, y], square);
            let middle = y + cell_height / 2.0 + TEXT_PX * 0.35;
            svg.text(x + cell_width + 6.0, middle, Anchor::Start, "tick", words);
        }
        let mut top = key;
        for (heading, maps) in &self.rows {
            svg.text(0.0, top + TEXT_PX + 6.0, Anchor::Start, "label strong", heading);
            top += ABOVE;
            for (place, map) in maps.iter().enumerate() {
                let left = LEFT + place as f64 * (width + BETWEEN);
                svg.text(left, top - 8.0, Anchor::Start, "label", &map.heading);
                for (line, (label, squares)) in map.lines.iter().enumerate() {
                    let y = top + line as f64 * cell_height;
                    if place == 0 {
                        let middle = y + cell_height / 2.0 + TEXT_PX * 0.35;
                        svg.text(LEFT - 8.0, middle, Anchor::End, "tick", label);
                    }
                    for (column, square) in squares.iter().enumerate() {
                        let Some(square) = square else { continue };
                        self.draw(&mut svg, [left + column as f64 * cell_width, y], square);
                    }
                }
                for (column, label) in self.columns.iter().enumerate() {
                    let x = left + (column as f64 + 0.5) * cell_width;
                    let y = top + lines(maps) * cell_height + 16.0;
                    svg.text(x, y, Anchor::Middle, "tick", label);
                }
            }
            top += lines(maps) * cell_height + BELOW;
        }
        svg.text(LEFT, top + TEXT_PX, Anchor::Start, "tick", self.across);
        standalone(&svg.finish(), size)
    }

    /// Places of the key's squares, in lines below the title, and where the maps begin.
    fn key_places(&self, total: f64) -> (Vec<[f64; 2]>, f64) {
        let (mut x, mut y) = (0.0, LINE);
        let places = self.key.iter().map(|(_, words)| {
            let width = self.cell[0] + 24.0 + text_width(words);
            if x > 0.0 && x + width > total {
                (x, y) = (0.0, y + LINE);
            }
            x += width;
            [x - width, y]
        });
        let places: Vec<[f64; 2]> = places.collect();
        (places, y + LINE + 8.0)
    }

    fn draw(&self, svg: &mut Svg, at: [f64; 2], square: &Square) {
        svg.open(&format!(" fill-opacity=\"{:.3}\"", square.opacity));
        svg.hovered_rect(at, self.cell, square.class, &square.hover);
        svg.close();
        if square.is_framed {
            svg.rect(at, self.cell, "best", "");
        }
        if !square.text.is_empty() {
            let style = if square.opacity > 0.9 { "cell full" } else { "cell" };
            let middle = [at[0] + self.cell[0] / 2.0, at[1] + self.cell[1] / 2.0 + 4.0];
            svg.text(middle[0], middle[1], Anchor::Middle, style, &square.text);
        }
    }
}
