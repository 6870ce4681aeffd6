//! What `cargo xtask cycles` is told.

/// The command line's options.
#[derive(Debug, PartialEq, Eq, Default)]
pub struct Options<'a> {
    /// Print JSON, and nothing else, to stdout.
    pub json: bool,
    /// Write the figures that are compared with.
    pub accept: bool,
    /// Measure with this blob, and compare with the accepted figures of such models.
    pub model: Option<&'a str>,
    /// Show this kernel alone; without a blob, compare with the budgets alone.
    pub kernel: Option<&'a str>,
}

impl<'a> Options<'a> {
    /// `None`: they make no sense, alone or together.
    pub fn parse(arguments: &[&'a str]) -> Option<Self> {
        let mut options = Self::default();
        let mut arguments = arguments.iter().copied();
        while let Some(argument) = arguments.next() {
            match argument {
                "--json" => options.json = true,
                "--accept" => options.accept = true,
                "--model" => options.model = Some(arguments.next()?),
                "--kernel" => options.kernel = Some(arguments.next()?),
                _ => return None,
            }
        }
        // Only all figures together can be accepted.
        let partial = options.model.is_some() || options.kernel.is_some();
        (!(options.accept && partial)).then_some(options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_come_in_any_order_and_part_of_the_figures_cannot_be_accepted() {
        let model = Options { json: true, model: Some("a.bin"), ..Options::default() };
        assert_eq!(Options::parse(&["--model", "a.bin", "--json"]), Some(model));
        assert_eq!(Options::parse(&[]), Some(Options::default()));
        for nonsense in [&["--model"][..], &["a.bin"], &["--accept", "--kernel", "f32"]] {
            assert_eq!(Options::parse(nonsense), None, "{nonsense:?}");
        }
    }
}
