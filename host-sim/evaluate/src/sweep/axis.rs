//! Axes of a plan: a field, and the values that it takes.

use serde::Deserialize;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_data::{BadValue, require};
use toml::Value;

/// Most values of an axis.
const MOST_VALUES: usize = 10_000;

/// Field and what it may be.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Path of the field.
    pub field: String,
    pub values: Values,
}

/// Values of an axis.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    List(Vec<Value>),
    Range(Range),
}

/// Range of numbers: whole ones if both ends are.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    from: Value,
    to: Value,
    /// Number of values, both ends among them; not for an axis that is drawn.
    count: Option<usize>,
    /// Whether steps are equal ratios instead of equal differences.
    #[serde(default)]
    log: bool,
}

impl Axis {
    /// Axis of the field at this path, from its value in a plan: a list, or a table with `from` and `to`.
    ///
    /// # Errors
    /// [`BadValue`] for an empty list, and a range without numbers.
    pub fn new(field: &str, value: Value) -> Result<Self, BadValue> {
        let shown = value.to_string();
        let values = match value {
            Value::Array(list) => Values::List(list),
            Value::Table(_) => {
                let range: Range = value.try_into().map_err(|cause: toml::de::Error| {
                    BadValue::new(field, &shown, super::fields::with_nearest(cause.message()))
                })?;
                range.check(field)?;
                Values::Range(range)
            }
            _ => Values::List(vec![value]),
        };
        if let Values::List(list) = &values {
            let allowed = (1..=MOST_VALUES).contains(&list.len());
            let rule = || format!("give 1 to {MOST_VALUES} values");
            require(allowed, field, format!("{} values", list.len()), rule)?;
            let twice = list.iter().enumerate().find(|(at, value)| list[..*at].contains(value));
            require(twice.is_none(), field, shown, || "it has a value twice; give it once".into())?;
        }
        Ok(Self { field: field.into(), values })
    }

    /// All values, for an axis that is crossed with others.
    ///
    /// # Errors
    /// [`BadValue`] for a range without a count.
    pub fn all(&self) -> Result<Vec<Value>, BadValue> {
        match &self.values {
            Values::List(values) => Ok(values.clone()),
            Values::Range(range) => {
                let count = range.count.filter(|count| (2..=MOST_VALUES).contains(count));
                let count = count.ok_or_else(|| {
                    let rule = format!(
                        "a range that is crossed with others needs a count, 2 to {MOST_VALUES}"
                    );
                    let given = range.count.map_or("nothing".into(), |count| count.to_string());
                    BadValue::new(format!("{}.count", self.field), given, rule)
                })?;
                let steps = (count - 1) as f64;
                let mut values: Vec<Value> =
                    (0..count).map(|step| range.at(step as f64 / steps)).collect();
                values.dedup();
                let rule = || {
                    let (kind, advice) = if range.is_whole() {
                        ("whole", format!("fewer, or {}.0 for fractions", range.from))
                    } else {
                        ("different (of five digits)", "fewer, or a list".into())
                    };
                    format!("these are {} {kind} numbers; give {advice}", values.len())
                };
                require(values.len() == count, format!("{}.count", self.field), count, rule)?;
                Ok(values)
            }
        }
    }

    /// Value at `place` of the axis, 0 to 1.
    fn drawn(&self, place: f64) -> Value {
        match &self.values {
            Values::List(values) => {
                let at = (place * values.len() as f64) as usize;
                values[at.min(values.len() - 1)].clone()
            }
            Values::Range(range) => range.drawn(place),
        }
    }
}

impl Range {
    fn check(&self, field: &str) -> Result<(), BadValue> {
        let ends = [("from", &self.from), ("to", &self.to)];
        for (end, value) in ends {
            let number = number(value).filter(|number| number.is_finite());
            let name = || format!("{field}.{end}");
            require(number.is_some(), name(), value, || "give a number".into())?;
            let allowed = !self.log || number > Some(0.0);
            require(allowed, name(), value, || "a logarithmic range has positive ends".into())?;
        }
        let [from, to] = self.ends();
        require(from < to, format!("{field}.to"), &self.to, || "it must be above from".into())
    }

    fn ends(&self) -> [f64; 2] {
        [&self.from, &self.to].map(|end| number(end).unwrap_or(f64::NAN))
    }

    fn is_whole(&self) -> bool {
        self.from.is_integer() && self.to.is_integer()
    }

    /// Value at `place` from 0 (`from`) to 1 (`to`), rounded to five digits, so that scenes can be read.
    fn at(&self, place: f64) -> Value {
        let [from, to] = self.ends();
        let value = self.between([from, to], place);
        if self.is_whole() {
            return Value::Integer(value.round() as i64);
        }
        let exact = [(0.0, from), (1.0, to)].into_iter().find(|(end, _)| *end == place);
        Value::Float(exact.map_or_else(|| rounded(value), |(_, end)| end))
    }

    /// Value at `place` for a draw: every whole number has an equal part of the axis.
    fn drawn(&self, place: f64) -> Value {
        if !self.is_whole() {
            return self.at(place);
        }
        let [from, to] = self.ends();
        let value = self.between([from, to + 1.0], place).floor();
        Value::Integer(value.clamp(from, to) as i64)
    }

    fn between(&self, [from, to]: [f64; 2], place: f64) -> f64 {
        if self.log { from * libm::pow(to / from, place) } else { from + (to - from) * place }
    }
}

/// Value with five digits.
pub fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// Number that a value is.
pub fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(number) => Some(*number as f64),
        Value::Float(number) => Some(*number),
        _ => None,
    }
}

/// Latin hypercube (McKay, Beckman and Conover, 1979): so many `points`, each with a value of every axis. Each axis is cut
/// into as many equal parts, and every part is met once.
pub fn latin_hypercube(axes: &[Axis], points: usize, seed: u64) -> Vec<Vec<Value>> {
    let columns = axes.iter().enumerate().map(|(part, axis)| {
        let mut random = Random::new(seed, Stream::Training, Purpose::Setup, 0, part as u64);
        let mut order: Vec<usize> = (0..points).collect();
        (1..points).rev().for_each(|last| order.swap(last, random.below(last + 1)));
        let places = order.iter().map(|cell| (*cell as f64 + random.unit()) / points as f64);
        places.map(|place| axis.drawn(place)).collect::<Vec<Value>>()
    });
    let columns: Vec<Vec<Value>> = columns.collect();
    (0..points).map(|point| columns.iter().map(|column| column[point].clone()).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(value: &str) -> Result<Axis, BadValue> {
        let table: toml::Table = toml::from_str(&format!("x = {value}")).unwrap();
        Axis::new("x", table["x"].clone())
    }

    fn all(value: &str) -> Vec<f64> {
        axis(value).unwrap().all().unwrap().iter().filter_map(number).collect()
    }

    #[test]
    fn ranges_have_equal_steps_or_ratios_and_both_ends() {
        assert_eq!(all("[3, 5]"), [3.0, 5.0]);
        assert_eq!(all("7"), [7.0]);
        assert_eq!(all("{from = 0.0, to = 1.0, count = 5}"), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(all("{from = 0.005, to = 0.08, count = 3, log = true}"), [0.005, 0.02, 0.08]);
        assert_eq!(all("{from = 4, to = 32, count = 4, log = true}"), [4.0, 8.0, 16.0, 32.0]);
    }

    #[test]
    fn axes_that_say_nothing_are_refused() {
        for (value, said) in [
            ("[]", "1 to"),
            ("[1, 2, 1]", "twice"),
            ("{from = 1, to = 1}", "above from"),
            ("{from = 0.0, to = 1.0, log = true}", "positive"),
            ("{from = \"a\", to = 1.0}", "number"),
            ("{from = nan, to = 1.0}", "number"),
            ("{from = 1.0, too = 2.0}", "`to`"),
        ] {
            let message = axis(value).unwrap_err().to_string();
            assert!(message.contains(said) && message.contains('x'), "{value}: {message}");
        }
        for (value, said) in [
            ("{from = 1, to = 9}", "needs a count"),
            ("{from = 1, to = 3, count = 9}", "3 whole numbers; give fewer, or 1.0"),
            ("{from = 1.0, to = 1.0001, count = 9}", "2 different"),
        ] {
            let message = axis(value).unwrap().all().unwrap_err().to_string();
            assert!(message.contains("x.count") && message.contains(said), "{message}");
        }
    }

    #[test]
    fn a_latin_hypercube_meets_every_part_of_every_axis_once() {
        let axes = ["{from = 0.0, to = 40.0}", "{from = 1, to = 8}", "[\"a\", \"b\"]"];
        let axes = axes.map(|value| axis(value).unwrap());
        let points = latin_hypercube(&axes, 40, 5);
        assert_eq!(points, latin_hypercube(&axes, 40, 5));
        assert_ne!(points, latin_hypercube(&axes, 40, 6));
        let mut cells: Vec<i64> =
            points.iter().filter_map(|point| Some(number(&point[0])?.floor() as i64)).collect();
        cells.sort_unstable();
        assert_eq!(cells, (0..40).collect::<Vec<i64>>());
        for whole in 1..=8 {
            assert_eq!(points.iter().filter(|point| point[1] == Value::Integer(whole)).count(), 5);
        }
        assert_eq!(points.iter().filter(|point| point[2] == Value::from("a")).count(), 20);
    }
}
