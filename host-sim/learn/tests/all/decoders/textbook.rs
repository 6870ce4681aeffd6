//! The paper's network in f64.

use std::sync::Arc;

use taxel_data::{Dataset, Purpose, Random, Stream, Table};
use taxel_learn::decoders::RowDecoder;
use taxel_learn::decoders::textbook::Textbook;

fn table() -> Dataset {
    let values = |of: fn(f64) -> [f64; 2]| (0..40).flat_map(|i| of(f64::from(i) / 40.0)).collect();
    let named =
        |names: [&str; 2], values| Table { names: names.map(String::from).to_vec(), values };
    Dataset {
        inputs: named(["a", "b"], values(|t| [50.0 + 10.0 * t, 80.0 - 20.0 * t * t])),
        outputs: named(["y", "z"], values(|t| [t.sin(), 1.0 - t])),
        ..Dataset::empty(vec![], vec![], 1, 0)
    }
}

#[test]
fn each_output_has_the_weights_of_a_network_for_it_alone() {
    let both = table();
    let random = Random::new(1, Stream::Training, Purpose::Centres, 0, 0);
    let fit = |table: &Dataset| {
        let hidden = Arc::new(Textbook::new(table, 7, &mut random.clone()));
        let network = hidden.fit(table, 0.1, 1e6);
        (hidden, network)
    };
    let (hidden, network) = fit(&both);
    for output in 0..2 {
        let alone = fit(&Dataset { outputs: both.outputs.columns(output, 1), ..both.clone() });
        assert_eq!(alone.0, hidden, "outputs take no part");
        let of_both = network.weights.iter().skip(output).step_by(2);
        for (a, b) in alone.1.weights.iter().zip(of_both) {
            assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{a} {b}");
        }
    }
}

#[test]
fn centres_at_all_lines_interpolate_without_a_penalty() {
    let table = table();
    let mut random = Random::new(1, Stream::Training, Purpose::Centres, 0, 0);
    let hidden = Arc::new(Textbook::new(&table, 40, &mut random));
    let highest = hidden.centres.iter().copied().fold(0.0, f64::max);
    assert!((highest - 1.0).abs() < 1e-12, "{highest}");
    let fit = |covariance| hidden.fit(&table, 0.005, covariance);
    let [exact, nothing] = [1e12, 1e-12].map(|it| fit(it).predict(&table.inputs.values));
    let far = |predicted: &[f64]| {
        let pairs = predicted.iter().zip(table.outputs.values.iter());
        pairs.map(|(p, y)| (p - y).abs()).fold(0.0, f64::max)
    };
    assert!(far(&exact) < 1e-6, "{}", far(&exact));
    assert!(nothing.iter().all(|p| p.abs() < 1e-9));
}
