//! Options that were given, and errors that name them.

use std::path::{Path, PathBuf};

use crate::{Error, Result};
use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Args, Command};
use serde::Serialize;
use taxel_data::{BadValue, output};

use super::print;

/// File that a command writes.
#[derive(Args)]
pub struct OutputFile {
    /// File to write; - is stdout.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// File that a command writes if it is wanted.
#[derive(Args)]
pub struct WantedFile {
    /// File to write; - is stdout.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

impl WantedFile {
    /// Checks before long work that it can be written, and would replace none of the `inputs`.
    pub fn check(&self, inputs: &[&Path]) -> Result<()> {
        self.output.as_ref().map_or(Ok(()), |path| print::check_output(path, inputs))
    }

    /// Writes these `bytes`, if it is wanted.
    pub fn write(&self, bytes: &[u8]) -> Result<()> {
        Ok(self.output.as_ref().map_or(Ok(()), |path| output::write_bytes(path, bytes))?)
    }
}

/// Folder that a command writes to.
#[derive(Args, Default)]
pub struct OutputFolder {
    /// Folder to write to.
    #[arg(short, long, value_name = "DIR", value_parser = folder())]
    pub output: Option<PathBuf>,
}

impl OutputFolder {
    /// The folder, or `out`.
    pub fn in_out(&self) -> &Path {
        self.output.as_deref().unwrap_or(Path::new("out"))
    }
}

/// Parser for the path of a folder that receives several files: not `-`, which stands for stdout elsewhere.
pub fn folder() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        let is_stdout = path.as_os_str() == "-";
        if is_stdout { Err("a folder is needed; a folder called - is ./-") } else { Ok(path) }
    })
}

/// Options that were given: the field that each sets, and its name on the command line.
pub fn given<A: Args + Serialize>(options: &A) -> Vec<(String, String)> {
    let command = A::augment_args(Command::new("taxel"));
    let fields = toml::Table::try_from(options).unwrap_or_default();
    let option_of = |field: String| {
        let option = command.get_arguments().find(|it| it.get_id().as_str() == field)?;
        let short = option.get_short().map(|letter| format!("-{letter}"));
        let name = short.or_else(|| option.get_long().map(|name| format!("--{name}")))?;
        Some((field, name))
    };
    fields.into_iter().filter_map(|(field, _)| option_of(field)).collect()
}

/// Refuses the first of the `options` that was given and sets a field which `is_refused`, with a `message` that takes its
/// name.
pub fn refuse<A: Args + Serialize>(
    options: &A,
    is_refused: impl Fn(&str) -> bool,
    message: impl Fn(&str) -> String,
) -> Result<()> {
    let refused = given(options).into_iter().find(|(field, _)| is_refused(field));
    refused.map_or(Ok(()), |(_, option)| Err(Error::Usage(message(&option))))
}

/// A `bad` value, named by the option that gave it, if one of `options` did.
pub fn named<A: Args + Serialize>(mut bad: BadValue, options: &A) -> BadValue {
    for (field, option) in given(options) {
        let path = format!("training.{field}");
        bad.rule = bad.rule.replace(&path, &option);
        if bad.field == path || bad.field == field {
            bad = bad.named(&option);
        }
    }
    bad
}

/// Error for a `bad` value, written as on the command line if its field is an option.
pub fn of_option(bad: BadValue) -> Error {
    if bad.field.starts_with('-') {
        return Error::Usage(format!("{} {}: {}", bad.field, bad.value, bad.rule));
    }
    bad.into()
}

/// An `error`, in which a bad value is named by the option that gave it, if one of `options` did.
pub fn blamed<A: Args + Serialize>(error: Error, options: &A) -> Error {
    match error {
        Error::Data(taxel_data::Error::Setting(bad)) => of_option(named(bad, options)),
        error => error,
    }
}

/// Values as files have them: by the names that options have.
pub mod as_text {
    use std::fmt::Display;
    use std::str::FromStr;

    use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

    pub fn serialize<T: Display, S: Serializer>(
        value: &Option<T>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.as_ref().map(ToString::to_string).serialize(serializer)
    }

    pub fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<T>, D::Error> {
        String::deserialize(deserializer)?.parse().map(Some).map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Arg;

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
