//! The options of `cargo xtask cycles`.

/// Options from the command line.
#[derive(Debug, PartialEq, Eq, Default)]
pub struct Options<'a> {
    /// Whether to print JSON, and nothing else, to stdout.
    pub json: bool,
    /// Whether to write the accepted figures instead of comparing with them.
    pub accept: bool,
    /// Whether to measure one inference of some other shapes instead.
    pub shapes: bool,
    /// Blob to measure, and to compare with what is predicted of it.
    pub model: Option<&'a str>,
    /// The only kernel to show; without a blob, it is compared with its budget only.
    pub kernel: Option<&'a str>,
}

impl<'a> Options<'a> {
    /// Parses the options of the command line.
    ///
    /// # Errors
    /// The option that is unknown or lacks its value, or options that exclude each other.
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
                "--shapes" => options.shapes = true,
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
        let alone = Self { shapes: true, ..Self::default() };
        if options.shapes && options != alone {
            return Err("`--shapes` goes with no other option".to_owned());
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
        ] {
            let message = Options::parse(arguments).unwrap_err();
            assert!(message.contains(named), "{message}");
        }
    }
}
