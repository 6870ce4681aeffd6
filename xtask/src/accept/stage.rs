//! One thing that a board must do: what was measured, what is allowed, and the probable cause of a difference.

use serde::Serialize;
use serde_json::Value;

/// A stage of the acceptance.
#[derive(Debug, Serialize)]
pub struct Stage {
    pub name: String,
    pub measured: Value,
    /// What is allowed, in words.
    pub allowed: String,
    /// Why it is not as allowed, as it is most likely; none if it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probable_cause: Option<String>,
}

impl Stage {
    /// A stage that is as allowed unless there is a `cause`.
    pub fn new(
        name: impl Into<String>,
        measured: impl Into<Value>,
        allowed: impl Into<String>,
        cause: Option<impl Into<String>>,
    ) -> Self {
        Self {
            name: name.into(),
            measured: measured.into(),
            allowed: allowed.into(),
            probable_cause: cause.map(Into::into),
        }
    }

    /// A stage whose measured number is as allowed if it is within these bounds, else for the given cause.
    pub fn within<T: PartialOrd + Into<Value> + Copy + std::fmt::Display>(
        name: impl Into<String>,
        measured: T,
        [least, most]: [T; 2],
        cause: &str,
    ) -> Self {
        let is_within = least <= measured && measured <= most;
        let allowed = format!("{least} to {most}");
        Self::new(name, measured, allowed, (!is_within).then_some(cause))
    }

    pub fn is_right(&self) -> bool {
        self.probable_cause.is_none()
    }

    /// Prints it as a line.
    pub fn tell(&self) {
        let Self { name, measured, allowed, probable_cause } = self;
        let measured = measured.as_str().map_or_else(|| measured.to_string(), str::to_owned);
        match probable_cause {
            None => println!("ok      {name}: {measured} (allowed: {allowed})"),
            Some(cause) => println!("FAILED  {name}: {measured} (allowed: {allowed}). {cause}"),
        }
    }
}
