//! The options of `cargo xtask cycles`.

/// Table of what is measured beside the kernels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// One inference of networks of other shapes.
    Shapes,
    /// A frame of networks that compute few components.
    Ranks,
    /// Deviations and novelty of a frame.
    Confidence,
}

/// Options from the command line.
#[derive(Debug, PartialEq, Eq, Default)]
pub struct Options<'a> {
    /// Whether to print JSON, and nothing else, to stdout.
    pub json: bool,
    /// Whether to write the accepted figures instead of comparing with them.
    pub accept: bool,
    /// Table to print instead, of what it measures.
    pub table: Option<Table>,
    /// Blob to measure, and to compare with what is predicted of it.
    pub model: Option<&'a str>,
    /// The only kernel to show; without a blob, it is compared with its budget only.
    pub kernel: Option<&'a str>,
}

impl<'a> Options<'a> {
    /// Parses the options of the command line.
    pub fn parse(arguments: &[&'a str]) -> Result<Self, String> {
        let mut options = Self::default();
        let mut arguments = arguments.iter().copied();
        while let Some(argument) = arguments.next() {
            let mut value = |what: &str| {
                arguments.next().ok_or_else(|| format!("`{argument}` needs {what} behind it"))
            };
            match argument {
                "--json" => options.json = true,
                "--accept" => options.accept = true,
                "--shapes" => options.table = Some(Table::Shapes),
                "--ranks" => options.table = Some(Table::Ranks),
                "--confidence" => options.table = Some(Table::Confidence),
                "--model" => options.model = Some(value("a file")?),
                "--kernel" => options.kernel = Some(value("a name")?),
                _ => return Err(format!("unknown option `{argument}`")),
            }
        }
        // Only all figures together can be accepted.
        let part = options.model.map(|_| "--model").or(options.kernel.map(|_| "--kernel"));
        if let (true, Some(part)) = (options.accept, part) {
            return Err(format!("`--accept` needs all figures: leave out `{part}`"));
        }
        let alone = Self { table: options.table, ..Self::default() };
        if let (Some(table), true) = (options.table, options != alone) {
            let name = match table {
                Table::Shapes => "--shapes",
                Table::Ranks => "--ranks",
                Table::Confidence => "--confidence",
            };
            return Err(format!("`{name}` goes with no other option"));
        }
        Ok(options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_come_in_any_order() {
        let model = Options { json: true, model: Some("a.bin"), ..Options::default() };
        assert_eq!(Options::parse(&["--model", "a.bin", "--json"]), Ok(model));
        assert_eq!(Options::parse(&[]), Ok(Options::default()));
    }

    #[test]
    fn options_that_make_no_sense_are_named() {
        for (arguments, named) in [
            (&["--json", "--jsn"][..], "`--jsn`"),
            (&["a.bin"], "`a.bin`"),
            (&["--model"], "`--model`"),
            (&["--accept", "--kernel", "f32"], "`--kernel`"),
            (&["--shapes", "--json"], "`--shapes`"),
            (&["--ranks", "--accept"], "`--ranks`"),
            (&["--confidence", "--json"], "`--confidence`"),
        ] {
            let message = Options::parse(arguments).unwrap_err();
            assert!(message.contains(named), "{message}");
        }
    }
}
