//! Columns of any scale and offset: a model is as good as with moderate ones, or the column is refused by name.

use taxel_core::rbf::Format;
use taxel_data::{Dataset, Purpose, Random, Silent, Stream};
use taxel_learn::train::format::MOST_LOST;
use taxel_learn::train::train;
use taxel_learn::{Options, Origin, pack};

use crate::table::hold;

/// What becomes of a column: its values times a factor, plus an offset.
#[derive(Debug, Clone, Copy)]
struct Change {
    factor: f64,
    offset: f64,
}

impl Change {
    const NONE: Self = Self { factor: 1.0, offset: 0.0 };

    /// Whether a column whose range is about 1 must be accepted with this change.
    fn is_moderate(self) -> bool {
        (1e-27..=1e29).contains(&self.factor) && self.offset.abs() <= 100.0
    }
}

/// First cases, which are not drawn: outputs of which fixed16 loses more and more.
const DOUBLED: u64 = 14;

#[test]
fn any_scale_and_offset_keeps_accuracy_or_is_refused_by_name() {
    let formats = Format::ALL;
    let base = formats.map(|format| errors([Change::NONE; 2], format).unwrap().r_squared());
    hold("scale", MOST_LOST, 200, |seed| {
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        let mut which = random.below(formats.len());
        let size = 10_f64.powf(random.between([-300.0, 300.0]));
        let mut change = match random.below(4) {
            0 => Change { factor: size, ..Change::NONE },
            1 => Change { factor: size.powf(0.1), ..Change::NONE },
            2 => Change { offset: size, ..Change::NONE },
            _ => Change { offset: 10_f64.powf(random.between([0.0, 18.0])), ..Change::NONE },
        };
        let mut place = random.below(2);
        if seed < DOUBLED {
            let is_fixed = |format: &Format| *format == Format::Fixed16;
            which = formats.iter().position(is_fixed).unwrap();
            (change, place) =
                (Change { offset: 100.0 * 2_f64.powi(seed as i32), ..Change::NONE }, 1);
        }
        let mut changes = [Change::NONE; 2];
        changes[place] = change;
        let found = errors(changes, formats[which]).map(Errors::r_squared);
        assert!(found.is_some() || !change.is_moderate(), "{changes:?}: moderate, and refused");
        found.map(|found| base[which] - found)
    });
}

/// A large offset, as of an absolute pressure, must not cost the network its digits.
#[test]
fn an_offset_of_the_outputs_costs_no_more_than_f32_itself() {
    let rmse = |offset: f64| {
        let change = Change { factor: 10.0, offset };
        errors([Change::NONE, change], Format::F32).unwrap().of_model.sqrt()
    };
    for offset in [1e3, 1e5, 1e6] {
        let half_an_ulp = offset * f64::from(f32::EPSILON) / 2.0;
        assert!(rmse(offset) <= 1.01 * rmse(0.0) + half_an_ulp, "{offset}: {}", rmse(offset));
    }
}

/// Mean squared errors on a model's own frames.
struct Errors {
    of_model: f64,
    of_mean: f64,
}

impl Errors {
    fn r_squared(self) -> f64 {
        1.0 - self.of_model / self.of_mean
    }
}

/// Errors of a model whose first input and whose output are changed. `None` if a column is refused, or does not change any
/// more in f64.
fn errors(changes: [Change; 2], format: Format) -> Option<Errors> {
    let mut data = Dataset::empty(vec!["a".into(), "b".into()], vec!["y".into()], 1, 150);
    let mut random = Random::new(1, Stream::Training, Purpose::Noise, 0, 0);
    let [of_input, of_output] =
        changes.map(|change| move |value: f64| value * change.factor + change.offset);
    for (inputs, y) in data.inputs.values.chunks_exact_mut(2).zip(data.outputs.values.iter_mut()) {
        let [a, b] = [random.unit(), random.unit()];
        inputs.copy_from_slice(&[of_input(a), b]);
        *y = of_output((3.0 * a).sin() * (2.0 * b).cos() + 0.5 * b * b);
    }
    let ranges = [data.inputs.ranges(), data.outputs.ranges()].concat();
    let options = Options { centres: 14, format, ..Options::of_rows() };
    let trained = match train(&data, &options, &Silent) {
        Ok(trained) => trained,
        Err(refusal) => {
            let refusal = refusal.to_string();
            assert!(refusal.contains("\"a\"") || refusal.contains("\"y\""), "{refusal}");
            return None;
        }
    };
    let blob = pack(&trained, &data, &Origin::of_data("scale", 0, 1, &data)).unwrap();
    let decoded = blob.prepare().decode_lines(&data.inputs.values);
    assert!(decoded.iter().all(|y| y.is_finite()), "{changes:?}: {decoded:?}");
    if ranges.iter().any(|[low, high]| high - low <= 1e-15 * low.abs().max(high.abs())) {
        return None;
    }
    let mean = vec![data.outputs.means()[0]; decoded.len()];
    let [of_model, of_mean] =
        [&decoded, &mean].map(|it| data.outputs.squared_errors(it)[0] / decoded.len() as f64);
    Some(Errors { of_model, of_mean })
}
