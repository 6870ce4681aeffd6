//! Effects of axes on results: how much of the variation is theirs, and the means by level.

use std::collections::BTreeMap;

use serde_json::Value;

/// Most levels of an axis; neighbouring values are put together where there are more.
const MOST_LEVELS: usize = 8;
/// What an axis does to a result, whatever the other axes are.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    pub field: String,
    pub result: String,
    /// Share of the result's variance that the levels of this axis explain, of its logarithm where all are positive: the
    /// correlation ratio η² of crossed axes, and ε² (Kelley 1935) of drawn ones.
    pub share: f64,
    pub levels: Vec<Level>,
}

/// Values of an axis that are looked at together.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Value, or the first and the last one.
    pub name: String,
    pub points: usize,
    /// Mean of the result; the geometric one where all are positive.
    pub mean: f64,
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
    fn shares_and_means_are_those_of_a_power_law() {
        let (settings, fields) = (settings(), ["a", "b", "c"].map(String::from));
        let of_error = of(&fields, &settings);
        let all = Settings { fields: &fields, is_drawn: false, values: settings.iter().collect() };
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
    fn chance_is_taken_off_the_share_of_drawn_levels() {
        // Squares within are 4 of 10 and those between 6; those within have four degrees of freedom.
        let (values, groups) = ([0.0, 2.0, 1.0, 4.0, 2.0, 3.0], [vec![0, 1, 2], vec![3, 4, 5]]);
        let of = |is_drawn| share(is_drawn, &values, &groups).unwrap().0;
        assert_eq!([true, false].map(of), [0.5, 0.6]);
    }

    #[test]
    fn many_values_are_put_together_in_about_equal_numbers() {
        let settings: Vec<BTreeMap<String, Value>> = (0..80)
            .map(|i| BTreeMap::from([("a".to_owned(), Value::from(f64::from((i * 37) % 80)))]))
            .collect();
        let fields = ["a".to_owned()];
        let all = Settings { fields: &fields, is_drawn: false, values: settings.iter().collect() };
        let effects = all.effects("x", &[Some(1.0); 80]);
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
