//! Effects of axes on results: how much of the variation is theirs, and the power law that fits.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use serde_json::Value;

/// Most levels of an axis; neighbouring values are put together where there are more.
const MOST_LEVELS: usize = 8;
/// Exponents below this are taken for none, unless they are known much better than that: a law that does not hold exactly
/// makes as much of axes that do nothing.
const LEAST_EXPONENT: f64 = 0.04;

/// What an axis does to a result, whatever the other axes are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effect {
    pub field: String,
    pub result: String,
    /// Share of the result's variance that the levels of this axis explain, of its logarithm where all are positive: the
    /// correlation ratio η² of crossed axes, and ε² (Kelley 1935) of drawn ones.
    pub share: f64,
    pub levels: Vec<Level>,
}

/// Values of an axis that are looked at together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Level {
    /// Value, or the first and the last one.
    pub name: String,
    pub points: usize,
    /// Mean of the result; the geometric one where all are positive.
    pub mean: f64,
}

/// Power law of a result: a constant times a power of every axis, fitted to logarithms by least squares.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Law {
    pub result: String,
    /// Share of the logarithm's variance that the law explains.
    pub r_squared: f64,
    /// Geometric mean of the result.
    pub mean: f64,
    pub exponents: Vec<Exponent>,
}

/// Exponent of an axis in a [`Law`]: the result changes by so many per cent for each per cent of the axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Exponent {
    pub field: String,
    pub exponent: f64,
    pub standard_error: f64,
}

impl Exponent {
    /// Whether it stands out of chance, and of what a law that does not hold exactly makes of axes that do nothing.
    fn is_some_effect(&self) -> bool {
        let least = (20.0 * self.standard_error).clamp(1e-6, LEAST_EXPONENT);
        self.exponent.abs() > least.max(3.0 * self.standard_error)
    }
}

/// What an error gains where an axis is changed until a cost has risen by one unit, at the geometric mean of the cost.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worth {
    pub field: String,
    pub error: String,
    pub cost: String,
    /// Unit that the cost rises by, such as `1 ms`.
    pub unit: String,
    /// Change of the error in per cent, its standard error beside it; `None` for an axis that costs nothing of this kind.
    pub change_percent: Option<[f64; 2]>,
}

/// Values of some axes and a result of each setting.
pub struct Settings<'s> {
    pub fields: &'s [String],
    /// Whether axes were drawn, and not crossed: the others of a level are then other ones by chance.
    pub is_drawn: bool,
    pub values: Vec<&'s BTreeMap<String, Value>>,
}

impl Settings<'_> {
    fn numbers(&self, field: &str) -> Option<Vec<f64>> {
        self.values.iter().map(|values| values.get(field)?.as_f64()).collect()
    }

    /// Effect of every axis on a `result`, which settings without one lack.
    pub fn effects(&self, name: &str, result: &[Option<f64>]) -> Vec<Effect> {
        let known: Vec<usize> = (0..result.len()).filter(|i| result[*i].is_some()).collect();
        let values: Vec<f64> = known.iter().filter_map(|i| result[*i]).collect();
        let is_log = values.iter().all(|value| *value > 0.0);
        let scaled: Vec<f64> = values.iter().map(|v| if is_log { v.ln() } else { *v }).collect();
        let effect = |field: &String| {
            let levels = self.levels(field, &known);
            let (share, means) = share(
                self.is_drawn,
                &scaled,
                &levels.iter().map(|(_, members)| members.clone()).collect::<Vec<_>>(),
            )?;
            let levels = levels.into_iter().zip(means).map(|((name, members), mean)| Level {
                name,
                points: members.len(),
                mean: if is_log { mean.exp() } else { mean },
            });
            Some(Effect {
                field: field.clone(),
                result: name.into(),
                share,
                levels: levels.collect(),
            })
        };
        self.fields.iter().filter_map(effect).collect()
    }

    /// Levels of an axis over the `known` settings: name, and places in `known`.
    fn levels(&self, field: &str, known: &[usize]) -> Vec<(String, Vec<usize>)> {
        let text = |i: usize| match self.values[i].get(field) {
            Some(Value::String(text)) => text.clone(),
            Some(value) => value.to_string(),
            None => String::new(),
        };
        let numbers = self.numbers(field);
        let mut order: Vec<usize> = (0..known.len()).collect();
        if let Some(numbers) = &numbers {
            order.sort_by(|a, b| numbers[known[*a]].total_cmp(&numbers[known[*b]]));
        }
        let mut places: BTreeMap<String, usize> = BTreeMap::new();
        let mut levels: Vec<(String, Vec<usize>)> = Vec::new();
        for place in order {
            let name = text(known[place]);
            let level = *places.entry(name.clone()).or_insert(levels.len());
            if level == levels.len() {
                levels.push((name, vec![]));
            }
            levels[level].1.push(place);
        }
        if levels.len() <= MOST_LEVELS || numbers.is_none() {
            return levels;
        }
        // A level is full with its part of all settings, and equal values are in one level.
        let mut bins: Vec<Vec<(String, Vec<usize>)>> = Vec::new();
        let (mut before, mut last_bin) = (0, None);
        for level in levels {
            let (bin, count) = (before * MOST_LEVELS / known.len(), level.1.len());
            match bins.last_mut() {
                Some(last) if last_bin == Some(bin) => last.push(level),
                _ => bins.push(vec![level]),
            }
            last_bin = Some(bin);
            before += count;
        }
        let joined = |bin: Vec<(String, Vec<usize>)>| {
            let name = match (&bin[0].0, &bin[bin.len() - 1].0) {
                (first, last) if first == last => first.clone(),
                (first, last) => format!("{first} … {last}"),
            };
            (name, bin.into_iter().flat_map(|(_, members)| members).collect())
        };
        bins.into_iter().map(joined).collect()
    }

    /// Power law of a positive result on all axes of positive numbers that vary.
    pub fn law(&self, name: &str, result: &[Option<f64>]) -> Option<Law> {
        let known: Vec<usize> =
            (0..result.len()).filter(|i| result[*i].is_some_and(|it| it > 0.0)).collect();
        if known.len() < result.iter().flatten().count() {
            return None;
        }
        let axes = self.fields.iter().filter_map(|field| {
            let numbers = self.numbers(field)?;
            let logs: Vec<f64> = known.iter().map(|i| numbers[*i].ln()).collect();
            let mean = logs.iter().sum::<f64>() / logs.len() as f64;
            let varies = logs.iter().any(|log| (log - mean).abs() > 1e-9);
            (varies && logs.iter().all(|log| log.is_finite())).then_some((field, logs, mean))
        });
        let axes: Vec<(&String, Vec<f64>, f64)> = axes.collect();
        let (lines, count) = (known.len(), axes.len());
        if count == 0 || lines < count + 2 {
            return None;
        }
        let y = DVector::from_iterator(lines, known.iter().filter_map(|i| result[*i]).map(f64::ln));
        let mean = y.mean();
        let y = y.add_scalar(-mean);
        let x = DMatrix::from_fn(lines, count, |line, axis| axes[axis].1[line] - axes[axis].2);
        let decomposed = (x.transpose() * &x).cholesky()?;
        let exponents = decomposed.solve(&(x.transpose() * &y));
        let left = (&y - &x * &exponents).norm_squared();
        let variance = left / (lines - count - 1) as f64;
        let inverse = decomposed.inverse();
        let all = y.norm_squared();
        let exponents = axes.iter().enumerate().map(|(axis, (field, ..))| Exponent {
            field: (*field).clone(),
            exponent: exponents[axis],
            standard_error: (variance * inverse[(axis, axis)]).sqrt(),
        });
        Some(Law {
            result: name.into(),
            r_squared: if all > 0.0 { 1.0 - left / all } else { 0.0 },
            mean: mean.exp(),
            exponents: exponents.collect(),
        })
    }
}

/// Share of the variance that groups explain, and their means; `None` if nothing varies or there is one group.
fn share(is_drawn: bool, values: &[f64], groups: &[Vec<usize>]) -> Option<(f64, Vec<f64>)> {
    let mean = |of: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = of.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
        sum / f64::from(count)
    };
    let all = mean(&mut values.iter().copied());
    let total: f64 = values.iter().map(|value| (value - all).powi(2)).sum();
    let (points, levels) = (values.len() as f64, groups.len() as f64);
    // Rounding is no variation, and as many levels as points explain everything.
    let least = points * (1e-9 * all).abs().max(1e-12).powi(2);
    if groups.len() < 2 || total <= least || (is_drawn && groups.len() >= values.len()) {
        return None;
    }
    let means: Vec<f64> =
        groups.iter().map(|group| mean(&mut group.iter().map(|i| values[*i]))).collect();
    let between: f64 = groups
        .iter()
        .zip(&means)
        .map(|(group, mean)| group.len() as f64 * (mean - all).powi(2))
        .sum();
    // What levels explain by chance is taken off.
    let within = (total - between).max(0.0);
    let chance = if is_drawn { (levels - 1.0) * within / (points - levels) } else { 0.0 };
    Some((((between - chance) / total).clamp(0.0, 1.0), means))
}

/// What an error gains by each axis, for one unit of a cost.
pub fn worth(error: &Law, cost: &Law) -> Vec<Worth> {
    let (unit, step) = unit_of(&cost.result);
    let pairs = error.exponents.iter().filter_map(|of_error| {
        let of_cost = cost.exponents.iter().find(|exponent| exponent.field == of_error.field)?;
        // The cost rises from its mean by one step, and the error follows the axis that this takes.
        let ratio = of_error.exponent / of_cost.exponent;
        let log_rise = (step / cost.mean).ln_1p();
        let factor = (ratio * log_rise).exp();
        let standard_error = 100.0 * factor * log_rise / of_cost.exponent.abs()
            * of_error.standard_error.hypot(ratio * of_cost.standard_error);
        let change = [100.0 * (factor - 1.0), standard_error];
        Some(Worth {
            field: of_error.field.clone(),
            error: error.result.clone(),
            cost: cost.result.clone(),
            unit: unit.clone(),
            change_percent: of_cost.is_some_effect().then_some(change),
        })
    });
    pairs.collect()
}

/// Unit that a cost rises by in words, and as a number.
fn unit_of(cost: &str) -> (String, f64) {
    let known = [
        ("_eur", "1 €", 1.0),
        ("_ms", "1 ms", 1.0),
        ("_bytes", "1 kB", 1000.0),
        ("cycles", "1000 cycles", 1000.0),
        ("_cm2", "1 cm²", 1.0),
    ];
    let found = known.into_iter().find(|(end, ..)| cost.ends_with(end));
    found.map_or_else(|| ("1".into(), 1.0), |(_, unit, step)| (unit.into(), step))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Settings of a in 1, 2, 4 and b in 1, 2, crossed, and c, which means nothing.
    fn settings() -> Vec<BTreeMap<String, Value>> {
        let crossed =
            (0..24).map(|i| [[1.0, 2.0, 4.0][i % 3], [1.0, 2.0][i / 3 % 2], [5.0, 6.0][i / 6 % 2]]);
        crossed
            .map(|v| {
                ["a", "b", "c"].map(String::from).into_iter().zip(v.map(Value::from)).collect()
            })
            .collect()
    }

    fn of(fields: &[String], settings: &[BTreeMap<String, Value>]) -> Vec<Option<f64>> {
        let value =
            |values: &BTreeMap<String, Value>, field: usize| values[&fields[field]].as_f64();
        settings
            .iter()
            .map(|it| Some(3.0 * value(it, 0)?.powi(-2) * value(it, 1)?.sqrt()))
            .collect()
    }

    #[test]
    fn a_power_law_is_found_with_its_exponents_and_shares() {
        let (settings, fields) = (settings(), ["a", "b", "c"].map(String::from));
        let of_error = of(&fields, &settings);
        let all = Settings { fields: &fields, is_drawn: false, values: settings.iter().collect() };
        let law = all.law("rmse_dz_mm", &of_error).unwrap();
        let exponents: Vec<f64> = law.exponents.iter().map(|it| it.exponent).collect();
        for (found, expected) in exponents.iter().zip([-2.0, 0.5, 0.0]) {
            assert!((found - expected).abs() < 1e-12, "{exponents:?}");
        }
        assert!((law.r_squared - 1.0).abs() < 1e-12);
        assert!((law.mean / (3.0 / 4.0 * 2.0_f64.powf(0.25)) - 1.0).abs() < 1e-12);
        let effects = all.effects("rmse_dz_mm", &of_error);
        // Variances of ln: a has 4·ln²2·2/3, b has ln²2/4·1/4.
        let [a, b] = [8.0 / 3.0, 1.0 / 16.0];
        assert!((effects[0].share - a / (a + b)).abs() < 1e-12, "{effects:?}");
        assert!((effects[1].share - b / (a + b)).abs() < 1e-12 && effects[2].share < 1e-12);
        assert_eq!(
            effects[0].levels.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(),
            ["1.0", "2.0", "4.0"]
        );
        let first = 3.0 * 2.0_f64.powf(0.25);
        assert!((effects[0].levels[0].mean / first - 1.0).abs() < 1e-12, "geometric mean over b");
    }

    #[test]
    fn a_gain_is_told_for_one_unit_of_cost() {
        let exponent =
            |exponent: f64| Exponent { field: "a".into(), exponent, standard_error: 0.1 };
        let law = |result: &str, mean: f64, of: f64| Law {
            result: result.into(),
            r_squared: 1.0,
            mean,
            exponents: vec![exponent(of)],
        };
        // 10 ms become 11 ms, so the axis is 1.1^(1/2) as much, and the error 1.1^(−1/4).
        let found = worth(&law("rmse_dz_mm", 0.1, -0.5), &law("frame_ms", 10.0, 2.0));
        let [change, error] = found[0].change_percent.unwrap();
        let left = 1.1_f64.powf(-0.25);
        assert!((change - 100.0 * (left - 1.0)).abs() < 1e-12 && found[0].unit == "1 ms");
        // Both exponents have an error of 0.1: of their ratio it is 0.1/2 and 0.25·0.1/2.
        let expected = 100.0 * left * 1.1_f64.ln() * 0.05_f64.hypot(0.0125);
        assert!((error - expected).abs() < 1e-12, "{error}");
        let barely = worth(&law("e", 1.0, -0.5), &law("scan_ms", 1.0, 0.29));
        assert_eq!(barely[0].change_percent, None, "less than three standard errors");
        assert_eq!(
            worth(&law("e", 1.0, -0.5), &law("scan_ms", 1.0, 0.001))[0].change_percent,
            None
        );
    }

    #[test]
    fn many_values_are_put_together_in_about_equal_numbers() {
        let settings: Vec<BTreeMap<String, Value>> = (0..80)
            .map(|i| BTreeMap::from([("a".to_owned(), Value::from(f64::from((i * 37) % 80)))]))
            .collect();
        let fields = ["a".to_owned()];
        let all = Settings { fields: &fields, is_drawn: false, values: settings.iter().collect() };
        let effects = all.effects(
            "x",
            &of(&["a".into(), "a".into()], &settings).iter().map(|_| Some(1.0)).collect::<Vec<_>>(),
        );
        assert!(effects.is_empty(), "nothing varies");
        let rising: Vec<Option<f64>> = settings.iter().map(|it| it["a"].as_f64()).collect();
        let effect = &all.effects("x", &rising)[0];
        assert_eq!(effect.levels.iter().map(|it| it.points).collect::<Vec<_>>(), [10; 8]);
        assert_eq!(effect.levels[1].name, "10.0 … 19.0");
        assert!(effect.share > 0.97);
        // Of nine values none is in two levels, however many settings have it.
        let counts = [1, 1, 30, 5, 5, 5, 5, 20, 8];
        let values = counts.iter().zip(1..).flat_map(|(count, value)| vec![value; *count]);
        let settings: Vec<BTreeMap<String, Value>> =
            values.map(|value| BTreeMap::from([("a".to_owned(), Value::from(value))])).collect();
        let all = Settings { fields: &fields, is_drawn: false, values: settings.iter().collect() };
        let rising: Vec<Option<f64>> = settings.iter().map(|it| it["a"].as_f64()).collect();
        let levels = &all.effects("x", &rising)[0].levels;
        let found: Vec<(&str, usize)> =
            levels.iter().map(|it| (it.name.as_str(), it.points)).collect();
        assert_eq!(found, [("1 … 3", 32), ("4 … 5", 10), ("6 … 7", 10), ("8", 20), ("9", 8)]);
    }
}
