//! Parsers of options: names of formats, and errors that name an option.

use std::path::PathBuf;

use crate::{Error, Result};
use clap::builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};
use taxel_core::rbf::Format;
use taxel_data::BadValue;
use taxel_learn::train::Solver;

/// Parser for the name of a number format.
pub fn format() -> impl TypedValueParser<Value = Format> {
    let named = |format: Format| PossibleValue::new(format.name()).help(format.description());
    one_of(Format::ALL.map(|format| (named(format), format)))
}

/// Parser for the name of a solver.
pub fn solver() -> impl TypedValueParser<Value = Solver> {
    let named = |solver: Solver| PossibleValue::new(solver.name()).help(solver.description());
    one_of(Solver::ALL.map(|solver| (named(solver), solver)))
}

/// Parser for the path of a folder that receives several files: not `-`, which stands for stdout elsewhere.
pub fn folder() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        let is_stdout = path.as_os_str() == "-";
        if is_stdout { Err("a folder is needed; a folder called - is ./-") } else { Ok(path) }
    })
}

/// Refuses the first of these options that was given, with a `message` that takes its name.
pub fn refuse_given(
    options: impl IntoIterator<Item = (&'static str, bool)>,
    message: impl Fn(&str) -> String,
) -> Result<()> {
    let given = options.into_iter().find(|(_, given)| *given);
    given.map_or(Ok(()), |(option, _)| Err(Error::Usage(message(option))))
}

fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    values: [(PossibleValue, T); N],
) -> impl TypedValueParser<Value = T> {
    let names: Vec<PossibleValue> = values.iter().map(|(name, _)| name.clone()).collect();
    PossibleValuesParser::new(names).map(move |found| {
        let mut values = values.iter();
        let value = values.find(|(name, _)| name.get_name() == found);
        value.expect("one of the possible values").1
    })
}

/// Error for a `bad` value, written as on the command line if its field is an option.
pub fn of_option(bad: BadValue) -> Error {
    if bad.field.starts_with('-') {
        return Error::Usage(format!("{} {}: {}", bad.field, bad.value, bad.rule));
    }
    bad.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Arg, Command};

    #[test]
    fn stdout_is_no_folder() {
        let parse = |path| {
            let argument = Arg::new("folder").value_parser(folder());
            Command::new("run").arg(argument).try_get_matches_from(["run", path])
        };
        assert!(parse("-").unwrap_err().to_string().contains("./-"));
        let given = parse("./-").unwrap().get_one::<PathBuf>("folder").cloned();
        assert_eq!(given, Some("./-".into()));
    }
}
