//! Figures: drawings with captions, and the files that each is written to.

use std::fmt::Write as _;

use super::chart::Chart;
use super::data::Data;
use super::format::unbroken;
use super::svg::{Svg, escape, size, standalone};

/// Folder beside a page that its figures are written to.
pub const FOLDER: &str = "figures";
/// Room between the panels of a picture, in px.
const GAP_PX: f64 = 24.0;
/// Room around a picture that is a file, in px.
const MARGIN_PX: f64 = 12.0;

/// One of several drawings of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What it shows, for the first column of the data.
    pub heading: String,
    pub drawing: String,
    pub data: Data,
}

/// Panels of which a reader chooses by a label.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    pub label: String,
    /// Sentence above the panels.
    pub words: String,
    pub panels: Vec<Panel>,
}

/// Figure without its number.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of its files, such as `errors-by-electrode`.
    pub name: String,
    /// Description of the figure, with units.
    pub caption: String,
    /// Drawings of the figure, as HTML.
    pub html: String,
    /// All drawings as one.
    pub picture: String,
    pub data: Data,
}

impl Figure {
    /// Figure of a chart, drawn for `wide` and for narrow windows.
    pub fn of_chart(name: &str, caption: String, chart: &Chart, sizes: [[f64; 2]; 2]) -> Self {
        let [wide, narrow] = sizes.map(|size| chart.draw(size));
        Self::of_drawings(name, caption, [wide, narrow], chart.data())
    }

    /// Figure of two drawings of the same, for wide and for narrow windows: text keeps its size on both.
    pub fn of_drawings(
        name: &str,
        caption: String,
        [wide, narrow]: [String; 2],
        data: Data,
    ) -> Self {
        let html =
            format!("<div class=\"wide\">{wide}</div><div class=\"narrow\">{narrow}</div>\n");
        Self { name: name.into(), caption, html, picture: wide, data }
    }

    /// Figure of several small drawings, three beside each other where there is room.
    pub fn of_panels(name: &str, caption: String, panels: &[Panel]) -> Self {
        let (picture, data) = (together(panels), data_of(panels));
        Self { name: name.into(), caption, html: beside(panels), picture, data }
    }

    /// Figure that shows the panels of one step at a time, by radio buttons alone; that of the `first` one to begin with.
    pub fn of_steps(
        name: &str,
        caption: String,
        question: &str,
        steps: &[Step],
        first: usize,
    ) -> Self {
        let mut html = format!(
            "<div class=\"steps\" role=\"group\" aria-label=\"{0}\">\n<span class=\"question\">{0}</span>\n",
            escape(question)
        );
        for (i, Step { label, words, panels }) in steps.iter().enumerate() {
            let checked = if i == first { " checked" } else { "" };
            // Writing to a string cannot fail.
            let _ = write!(
                html,
                "<input type=\"radio\" name=\"{name}\" id=\"{name}-{i}\"{checked}><label for=\"{name}-{i}\">{}</label>\n\
                 <div class=\"step\">\n<p class=\"note\">{}</p>\n{}</div>\n",
                escape(label),
                escape(&unbroken(words)),
                beside(panels)
            );
        }
        html += "</div>\n";
        // The file shows what the page begins with, and the data have all steps.
        let picture = together(steps.get(first).map_or(&[][..], |step| &step.panels));
        let panels: Vec<Panel> = steps.iter().flat_map(|step| step.panels.clone()).collect();
        Self { name: name.into(), caption, html, picture, data: data_of(&panels) }
    }

    /// The picture as a file of its own, with a margin; its title is the first sentence of the caption.
    fn file(&self) -> String {
        let all = size(&self.picture).map(|extent| extent + 2.0 * MARGIN_PX);
        let title = self.caption.split_once(". ").map_or(self.caption.as_str(), |(first, _)| first);
        let mut picture = Svg::new(all[0], all[1], title);
        picture.place([MARGIN_PX; 2], &self.picture);
        standalone(&picture.finish(), all)
    }
}

/// Number of panels beside each other: two pairs look better than three and one.
fn columns(panels: &[Panel]) -> usize {
    if panels.len() == 4 { 2 } else { 3 }
}

fn beside(panels: &[Panel]) -> String {
    let class = if columns(panels) == 2 { "panels pairs" } else { "panels" };
    let drawings: String = panels.iter().map(|panel| panel.drawing.as_str()).collect();
    format!("<div class=\"{class}\">\n{drawings}</div>\n")
}

/// All panels in one drawing.
fn together(panels: &[Panel]) -> String {
    let columns = columns(panels).min(panels.len());
    let sizes: Vec<[f64; 2]> = panels.iter().map(|panel| size(&panel.drawing)).collect();
    let most = |axis: usize| sizes.iter().map(|size| size[axis]).fold(0.0, f64::max) + GAP_PX;
    let (width, height) = (most(0), most(1));
    let extent = |count: usize, step: f64| count as f64 * step - GAP_PX;
    let lines = panels.len().div_ceil(columns.max(1));
    let mut picture = Svg::new(extent(columns, width), extent(lines, height), "");
    for (i, panel) in panels.iter().enumerate() {
        let at = [(i % columns) as f64 * width, (i / columns) as f64 * height];
        picture.place(at, &panel.drawing);
    }
    picture.finish()
}

/// Data of all panels, which have the same columns, behind a column with the panels' headings.
fn data_of(panels: &[Panel]) -> Data {
    let behind = |first: &str, fields: &[String]| {
        [first.to_owned()].into_iter().chain(fields.iter().cloned()).collect::<Vec<_>>()
    };
    let heads = panels.first().map_or(&[][..], |panel| &panel.data.heads);
    let lines = panels.iter().flat_map(|panel| {
        panel.data.lines.iter().map(move |fields| behind(&panel.heading, fields))
    });
    Data { heads: behind("panel", heads), lines: lines.collect() }
}

/// Figures of a page as they are numbered, and the files that they are written to.
#[derive(Debug, Default)]
pub struct Figures {
    /// What the paths of files begin with, as the page sees them; none if there are no files beside the page.
    start: Option<String>,
    count: usize,
    /// Files by their paths from the page.
    pub files: Vec<(String, String)>,
}

impl Figures {
    /// No figure yet. Names of files have this `prefix`.
    pub fn in_files(prefix: &str) -> Self {
        Self { start: Some(format!("{FOLDER}/{prefix}")), ..Self::default() }
    }

    /// The next figure, as HTML.
    pub fn html(&mut self, figure: &Figure) -> String {
        self.count += 1;
        let (number, caption) = (self.count, escape(&unbroken(&figure.caption)));
        let links = self.start.as_ref().map_or(String::new(), |start| {
            let files = [("svg", figure.file()), ("csv", figure.data.csv())];
            let links = files.map(|(end, text)| {
                let path = format!("{start}{}.{end}", figure.name);
                let link = link(&path, &end.to_uppercase());
                self.files.push((path, text));
                link
            });
            format!("<p class=\"files\">{}</p>\n", links.join(" "))
        });
        format!(
            "<figure id=\"figure-{number}\">\n{}<figcaption><b>Figure {number}.</b> {caption}</figcaption>\n{links}</figure>\n",
            figure.html
        )
    }
}

/// Link to a file beside the page, as HTML.
pub fn link(path: &str, text: &str) -> String {
    let address = path.replace('%', "%25").replace('#', "%23").replace('?', "%3F");
    format!("<a href=\"{}\">{}</a>", escape(&address), escape(text))
}

/// Page, and the files of its figures by their paths from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    pub html: String,
    pub figures: Vec<(String, String)>,
}

impl Page {
    /// The page as the file `name`, and the files of its figures.
    pub fn files<'p>(&'p self, name: &'p str) -> impl Iterator<Item = (&'p str, &'p [u8])> {
        let figures = self.figures.iter().map(|(path, text)| (path.as_str(), text.as_bytes()));
        [(name, self.html.as_bytes())].into_iter().chain(figures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::data::number;

    #[test]
    fn panels_are_one_picture_and_one_table() {
        let panel = |heading: &str| {
            let mut data = Data::new(&["x (mm)", "a, b"]);
            data.lines.push(vec![number(0.5), number(f64::NAN)]);
            let drawing = Svg::new(100.0, 50.0, heading).finish();
            Panel { heading: heading.into(), drawing, data }
        };
        let panels = ["Δz, true", "b", "c", "d"].map(panel);
        let figure = Figure::of_panels("four", "Four. Panels".into(), &panels);
        assert_eq!(size(&figure.picture), [224.0, 124.0], "two pairs");
        assert!(figure.file().contains("<title>Four</title>"));
        let csv = figure.data.csv();
        assert!(csv.starts_with("panel,x (mm),\"a, b\"\n\"Δz, true\",0.5,\nb,0.5,\n"), "{csv}");
        let mut figures = Figures::in_files("50 %-");
        let html = figures.html(&figure);
        assert!(html.contains("<a href=\"figures/50 %25-four.csv\">CSV</a>"), "{html}");
        assert_eq!(figures.files[0].0, "figures/50 %-four.svg");
        assert_eq!(figures.files[0].1.matches("<svg").count(), 1);
        assert!(!Figures::default().html(&figure).contains("href"), "a page of its own");
    }
}
