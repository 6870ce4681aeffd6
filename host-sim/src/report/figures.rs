//! Figures: drawings with captions.

/// Figure without its number.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Description of the figure, with units.
    pub caption: String,
    /// Drawings of the figure, as SVG.
    pub drawing: String,
}

impl Figure {
    /// Figure of several small drawings, three beside each other where there is room.
    pub fn of_panels(caption: String, panels: &[String]) -> Self {
        // Two pairs look better than three and one.
        let class = if panels.len() == 4 { "panels pairs" } else { "panels" };
        Self { caption, drawing: format!("<div class=\"{class}\">\n{}</div>\n", panels.concat()) }
    }
}
