//! Templates: texts in which names are replaced, `@KEY@` stands for a value, and parts are for some models only.
//!
//! Lines from `//@if flag` to `//@end` stay if the flag is set; from `//@if !flag`, if it is not.

use std::collections::HashMap;

use super::name::Name;

/// Name that a library has in the templates.
const NAME: &str = "taxel_model";
const UPPER_NAME: &str = "TAXEL_MODEL";

/// What keys stand for.
#[derive(Debug, Default)]
pub struct Values(HashMap<&'static str, String>);

impl Values {
    /// Sets what a `key` stands for.
    #[expect(clippy::needless_pass_by_value, reason = "texts and numbers are given as they are")]
    pub fn set(&mut self, key: &'static str, value: impl ToString) {
        self.0.insert(key, value.to_string());
    }
}

/// The `text` of a template for a library of this `name`, with these `flags` and `values`.
///
/// # Panics
/// If the template has an `//@end` too many: then it is wrong for any model.
pub fn fill(text: &str, name: &Name, flags: &[&str], values: &Values) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut open = Vec::new();
    for line in text.split_inclusive('\n') {
        if let Some(condition) = line.strip_prefix("//@if ") {
            let condition = condition.trim_end();
            open.push(match condition.strip_prefix('!') {
                Some(flag) => !flags.contains(&flag),
                None => flags.contains(&condition),
            });
        } else if line.starts_with("//@end") {
            open.pop().expect("as many ends as beginnings");
        } else if open.iter().all(|is_set| *is_set) {
            kept.push_str(line);
        }
    }
    let named = kept.replace(NAME, name.lower()).replace(UPPER_NAME, &name.upper());
    with_values(&named, &values.0)
}

/// The text with values for keys. What a value holds is not looked at again.
fn with_values(text: &str, values: &HashMap<&str, String>) -> String {
    let mut filled = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('@') {
        filled.push_str(before);
        let value = after.split_once('@').and_then(|(key, rest)| Some((values.get(key)?, rest)));
        rest = if let Some((value, behind)) = value {
            filled.push_str(value);
            behind
        } else {
            filled.push('@');
            after
        };
    }
    filled + rest
}
