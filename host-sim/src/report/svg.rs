//! SVG elements. Colours are left to CSS classes, so that a drawing follows the page's theme.

use std::fmt::{self, Display, Write as _};

/// Text escaped for HTML and SVG.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            _ => safe.push(c),
        }
    }
    safe
}

/// Coordinate in px: one decimal is finer than any screen.
#[derive(Debug, Clone, Copy)]
pub struct Px(pub f64);

impl Display for Px {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tenths = (self.0 * 10.0).round();
        // Plus zero, so that −0 is written 0.
        write!(f, "{}", tenths / 10.0 + 0.0)
    }
}

/// Position of text relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Text to the right of its point.
    Start,
    /// Text around its point.
    Middle,
    /// Text to the left of its point.
    End,
}

/// Height of text, as in the page's style.
pub const TEXT_PX: f64 = 13.0;

/// Generous estimate of the width of text in px: fonts differ, and nothing may overlap.
pub fn text_width(text: &str) -> f64 {
    text.chars().count() as f64 * TEXT_PX * 0.62
}

/// Drawing as a file of its own, in this size: light or dark like the viewer.
pub fn standalone(drawing: &str, [width, height]: [f64; 2]) -> String {
    let open = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" role=\"img\""
    );
    let css = format!(
        "<style>\n{}svg {{ background: var(--paper); font-family: system-ui, \"Segoe UI\", Arial, sans-serif; }}\n</style>\n",
        include_str!("drawing.css")
    );
    let drawing = drawing.replacen("<svg role=\"img\"", &open, 1);
    drawing.replacen("<title>", &format!("{css}<title>"), 1)
}

/// Width and height of a finished drawing.
pub fn size(drawing: &str) -> [f64; 2] {
    let numbers = drawing.split_once("viewBox=\"0 0 ").and_then(|(_, rest)| rest.split_once('"'));
    let numbers = numbers.and_then(|(numbers, _)| numbers.split_once(' '));
    numbers.map_or([0.0; 2], |(width, height)| {
        [width, height].map(|number| number.parse().unwrap_or(0.0))
    })
}

/// Drawing under construction.
#[derive(Debug, Clone)]
pub struct Svg {
    width: f64,
    height: f64,
    title: String,
    body: String,
}

impl Svg {
    /// Empty drawing; screen readers read out `title`.
    pub fn new(width: f64, height: f64, title: &str) -> Self {
        Self { width, height, title: title.into(), body: String::new() }
    }

    /// Adds text whose baseline is at y.
    pub fn text(&mut self, x: f64, y: f64, anchor: Anchor, class: &str, text: &str) {
        self.text_with([x, y], anchor, class, text, "");
    }

    fn text_with(
        &mut self,
        [x, y]: [f64; 2],
        anchor: Anchor,
        class: &str,
        text: &str,
        attributes: &str,
    ) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let (x, y, text) = (Px(x), Px(y), escape(text));
        self.add(format_args!(
            r#"<text x="{x}" y="{y}" text-anchor="{anchor}" class="{class}"{attributes}>{text}</text>"#
        ));
    }

    /// Adds text as [`text`](Self::text) does, squeezed where it would reach beyond the drawing.
    pub fn label(&mut self, x: f64, y: f64, anchor: Anchor, class: &str, text: &str) {
        /// Share of the estimated width that text has in usual fonts.
        const USUAL: f64 = 0.92;
        let room = match anchor {
            Anchor::Start => self.width - x,
            Anchor::Middle => 2.0 * x.min(self.width - x),
            Anchor::End => x,
        };
        let squeezed = if USUAL * text_width(text) > room {
            format!(r#" textLength="{}" lengthAdjust="spacingAndGlyphs""#, Px(room))
        } else {
            String::new()
        };
        self.text_with([x, y], anchor, class, text, &squeezed);
    }

    /// Adds a line.
    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], class: &str) {
        let (x1, y1, x2, y2) = (Px(x1), Px(y1), Px(x2), Px(y2));
        self.add(format_args!(
            r#"<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" class="{class}"/>"#
        ));
    }

    /// Adds a rectangle; `attributes` may add to it.
    pub fn rect(
        &mut self,
        [x, y]: [f64; 2],
        [width, height]: [f64; 2],
        class: &str,
        attributes: &str,
    ) {
        let (x, y, width, height) = (Px(x), Px(y), Px(width), Px(height));
        self.add(format_args!(
            r#"<rect x="{x}" y="{y}" width="{width}" height="{height}" class="{class}"{attributes}/>"#
        ));
    }

    /// Adds a rectangle with a text that is shown while the pointer is over it.
    pub fn hovered_rect(
        &mut self,
        [x, y]: [f64; 2],
        [width, height]: [f64; 2],
        class: &str,
        hover: &str,
    ) {
        let (x, y, width, height) = (Px(x), Px(y), Px(width), Px(height));
        let hover = escape(hover);
        self.add(format_args!(
            r#"<rect x="{x}" y="{y}" width="{width}" height="{height}" class="{class}"><title>{hover}</title></rect>"#
        ));
    }

    /// Adds a circle; `inside` is its content.
    pub fn circle(&mut self, [x, y]: [f64; 2], radius: f64, class: &str, inside: &str) {
        let (x, y) = (Px(x), Px(y));
        let end = if inside.is_empty() { "/>".into() } else { format!(">{inside}</circle>") };
        self.add(format_args!(r#"<circle cx="{x}" cy="{y}" r="{radius}" class="{class}"{end}"#));
    }

    /// Adds a path.
    pub fn path(&mut self, d: &str, class: &str) {
        self.add(format_args!(r#"<path d="{d}" class="{class}"/>"#));
    }

    /// Opens a group; `attributes` begin with a space.
    pub fn open(&mut self, attributes: &str) {
        self.add(format_args!("<g{attributes}>"));
    }

    /// Closes the group.
    pub fn close(&mut self) {
        self.add("</g>");
    }

    /// Adds an element of SVG text, unchanged.
    pub fn add(&mut self, element: impl Display) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.body, "{element}");
    }

    /// Adds a finished `drawing` without its frame, its upper left corner at a place.
    pub fn place(&mut self, [x, y]: [f64; 2], drawing: &str) {
        let inside = drawing.split_once('>').and_then(|(_, rest)| rest.rsplit_once("</svg>"));
        let inside = inside.map_or("", |(inside, _)| inside);
        self.add(format_args!("<g transform=\"translate({} {})\">{inside}</g>", Px(x), Px(y)));
    }

    /// Finished SVG element.
    pub fn finish(self) -> String {
        format!(
            "<svg role=\"img\" viewBox=\"0 0 {} {}\"><title>{}</title>\n{}</svg>\n",
            Px(self.width),
            Px(self.height),
            escape(&self.title),
            self.body
        )
    }
}

/// Path along these points.
pub fn polyline(points: &[[f64; 2]]) -> String {
    let step = |(i, [x, y]): (usize, &[f64; 2])| {
        format!("{}{} {}", if i == 0 { 'M' } else { 'L' }, Px(*x), Px(*y))
    };
    points.iter().enumerate().map(step).collect()
}

/// Shapes that distinguish series without colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Circle,
    Square,
    /// Triangle that points up.
    Triangle,
    /// Square on its corner.
    Diamond,
    /// Circle around another mark.
    Ring,
}

impl Shape {
    /// Path of the shape around a point; `size` is 1 unless marks are crowded.
    pub fn path(self, [x, y]: [f64; 2], size: f64) -> String {
        let px = |value: f64| Px(value * size);
        let start = |dx: f64, dy: f64| format!("M{} {}", Px(x + dx * size), Px(y + dy * size));
        match self {
            Self::Circle => {
                let (r, d) = (px(3.6), px(7.2));
                format!("{}a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0Z", start(-3.6, 0.0))
            }
            Self::Ring => {
                let (r, d) = (px(7.5), px(15.0));
                format!("{}a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0Z", start(-7.5, 0.0))
            }
            Self::Square => {
                let side = px(6.4);
                format!("{}h{side}v{side}h-{side}Z", start(-3.2, -3.2))
            }
            Self::Triangle => {
                format!("{}l{} {}h-{}Z", start(0.0, -5.0), px(4.4), px(7.8), px(8.8))
            }
            Self::Diamond => {
                let r = px(4.6);
                format!("{}l{r} {r}l-{r} {r}l-{r} -{r}Z", start(0.0, -4.6))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_and_coordinates_are_short() {
        let mut svg = Svg::new(100.0, 50.0, "a < b & \"c\"");
        svg.text(1.234, -0.01, Anchor::End, "tick", "<script>");
        assert_eq!(
            svg.finish(),
            "<svg role=\"img\" viewBox=\"0 0 100 50\">\
             <title>a &lt; b &amp; &quot;c&quot;</title>\n\
             <text x=\"1.2\" y=\"0\" text-anchor=\"end\" class=\"tick\">&lt;script&gt;</text>\n\
             </svg>\n"
        );
    }

    #[test]
    fn labels_stay_within_the_drawing() {
        let mut svg = Svg::new(100.0, 50.0, "labels");
        svg.label(20.0, 10.0, Anchor::Start, "tick", "short");
        svg.label(40.0, 20.0, Anchor::Middle, "tick", "time of a frame (ms)");
        let svg = svg.finish();
        assert!(svg.contains("class=\"tick\">short<"), "{svg}");
        assert!(
            svg.contains(" textLength=\"80\" lengthAdjust=\"spacingAndGlyphs\">time of"),
            "{svg}"
        );
    }

    #[test]
    fn a_drawing_is_placed_without_its_frame() {
        let mut inner = Svg::new(10.0, 10.0, "inner");
        inner.path("M0 0", "axis");
        let mut svg = Svg::new(100.0, 50.0, "outer");
        svg.place([20.0, 0.0], &inner.finish());
        assert_eq!(
            svg.finish(),
            "<svg role=\"img\" viewBox=\"0 0 100 50\"><title>outer</title>\n\
             <g transform=\"translate(20 0)\"><title>inner</title>\n\
             <path d=\"M0 0\" class=\"axis\"/>\n</g>\n</svg>\n"
        );
    }
}
