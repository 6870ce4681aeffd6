//! Parsers of options: names of formats and exponentials, and errors that name an option.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use host_sim::Error;
use model_core::rbf::Format;
use taxel_data::BadValue;
use taxel_learn::Exponential;
use taxel_simulate::sensor::Precision;

/// Parser for the name of a number format.
pub fn format() -> impl TypedValueParser<Value = Format> {
    let named = |format: Format| PossibleValue::new(format.name()).help(format.description());
    one_of(Format::ALL.map(|format| (named(format), format)))
}

/// Parser for the name of an exponential.
pub fn exponential() -> impl TypedValueParser<Value = Exponential> {
    let named = |e: Exponential| PossibleValue::new(e.name()).help(e.description());
    one_of(Exponential::ALL.map(|exponential| (named(exponential), exponential)))
}

/// Parser for the name of a precision.
pub fn precision() -> impl TypedValueParser<Value = Precision> {
    let named = |name, help| PossibleValue::new(name).help(help);
    one_of([
        (named("f64", "Within 2e-13 of the sensor's equations"), Precision::F64),
        (named("f32", "Within 1e-6, a third faster; random draws stay the same"), Precision::F32),
    ])
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

/// Error that names the option which sets `bad`'s field, if one of `options` (field, option) does.
pub fn of_option(bad: BadValue, options: &[(&str, &str)]) -> Error {
    match options.iter().find(|(field, _)| *field == bad.field) {
        Some((_, option)) => Error::Usage(format!("{option} {}: {}", bad.value, bad.rule)),
        None => bad.into(),
    }
}
