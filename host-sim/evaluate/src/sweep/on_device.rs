//! Device of a point, as a plan gives it.

use taxel_data::BadValue;
use toml::{Table, Value};

use super::fields;
use crate::device::Device;

/// Device of a point, and what it reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnDevice {
    pub device: Device,
    /// Number of samples averaged for each reading.
    pub samples: usize,
    /// Steps from one column-wire that is read to the next.
    pub column_step: usize,
    /// Whether a filter in time stands behind the decoder.
    pub filter: bool,
}

impl OnDevice {
    /// What a plan's `[device]` says.
    ///
    /// # Errors
    /// [`BadValue`] for a field that it has not, or a value that it cannot take.
    pub fn new(mut table: Table) -> Result<Self, BadValue> {
        let mut count = |field: &str, most: usize, rule: &str| {
            let value = table.remove(field).unwrap_or(Value::Integer(1));
            let count = value.as_integer().and_then(|count| usize::try_from(count).ok());
            let count = count.filter(|count| (1..=most).contains(count));
            count.ok_or_else(|| BadValue::new(format!("device.{field}"), value, rule))
        };
        let samples = count("samples", 256, "the firmware averages 1 to 256 samples")?;
        let column_step = count("column_step", usize::MAX, "give a whole number, at least 1")?;
        let filter = table.remove("filter").unwrap_or(Value::Boolean(false));
        let filter = filter
            .as_bool()
            .ok_or_else(|| BadValue::new("device.filter", filter, "give true or false"))?;
        let shown = table.to_string().trim_end().replace('\n', ", ");
        let device: Device = table.try_into().map_err(|cause: toml::de::Error| {
            // These are taken out before, and belong to the names as well.
            let own = "expected one of `samples`, `column_step`, `filter`, ";
            let message = cause.message().replace("expected one of ", own);
            BadValue::new("device", shown, fields::with_nearest(&message))
        })?;
        device.check()?;
        Ok(Self { device, samples, column_step, filter })
    }
}
