//! The options of `cargo xtask board`.

/// Options from the command line.
#[derive(Debug, PartialEq, Eq, Default)]
pub struct Options<'a> {
    /// Whether to run mutants instead of scenarios.
    pub mutants: bool,
    /// Frames that `check` decodes.
    pub frames: Option<u32>,
    /// Blob to upload, of the scene `press`.
    pub model: Option<&'a str>,
    /// Scenarios or mutants to run; all if there are none.
    pub names: Vec<&'a str>,
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
                "--mutants" => options.mutants = true,
                "--model" => options.model = Some(value("a file")?),
                "--frames" => {
                    let number = value("a number")?;
                    let frames = number.parse().ok().filter(|frames| *frames > 0);
                    options.frames =
                        Some(frames.ok_or(format!("`--frames {number}` is no number of frames"))?);
                }
                _ if argument.starts_with('-') => {
                    return Err(format!("unknown option `{argument}`"));
                }
                name => options.names.push(name),
            }
        }
        Ok(options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_and_names_come_in_any_order() {
        let arguments = ["session", "--frames", "1000", "--model", "a.bin", "restart"];
        let options = Options {
            frames: Some(1000),
            model: Some("a.bin"),
            names: vec!["session", "restart"],
            ..Options::default()
        };
        assert_eq!(Options::parse(&arguments), Ok(options));
        assert!(Options::parse(&["--mutants"]).unwrap().mutants);
    }

    #[test]
    fn options_that_make_no_sense_are_named() {
        let named = [
            (&["--mutant"][..], "--mutant"),
            (&["--frames", "none"], "none"),
            (&["--model"], "a file"),
        ];
        for (arguments, named) in named {
            let error = Options::parse(arguments).unwrap_err();
            assert!(error.contains(named), "{error}");
        }
    }
}
