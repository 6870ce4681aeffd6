//! Values that figures show, as tables of CSV files.

/// Values that a figure shows, as the table of its CSV file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Data {
    /// Names of the columns, with their units.
    pub heads: Vec<String>,
    pub lines: Vec<Vec<String>>,
}

impl Data {
    /// Table without lines.
    pub fn new(heads: &[&str]) -> Self {
        Self { heads: heads.iter().map(|head| (*head).to_owned()).collect(), lines: vec![] }
    }

    /// Text of the CSV file.
    pub fn csv(&self) -> String {
        let field = |text: &String| {
            if text.contains([',', '"', '\n', '\r']) {
                format!("\"{}\"", text.replace('"', "\"\""))
            } else {
                text.clone()
            }
        };
        let line = |fields: &Vec<String>| fields.iter().map(field).collect::<Vec<_>>().join(",");
        let lines = [&self.heads].into_iter().chain(&self.lines);
        lines.map(|fields| line(fields) + "\n").collect()
    }
}

/// Field of a number; empty for one that is missing.
pub fn number(value: f64) -> String {
    match value {
        _ if !value.is_finite() => String::new(),
        tiny if tiny != 0.0 && tiny.abs() < 1e-4 => format!("{tiny:e}"),
        value => value.to_string(),
    }
}
