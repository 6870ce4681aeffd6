use super::*;

#[test]
fn an_unusable_sample_is_refused_and_changes_nothing() {
    let mut memory = [0.0_f32; Rls::<f32>::values(2, 1)];
    let mut rls = Rls::try_new(&mut memory, [2, 1], 1e3, 0.99).unwrap();
    rls.update(&mut [1.0, 2.0], &mut [3.0]).unwrap();
    let before = (rls.triangle.to_vec(), rls.projection.to_vec(), rls.turn);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e20, -1e20, f32::MAX] {
        for (h, y) in [([bad, 0.0], 0.0), ([0.0, bad], 0.0), ([1.0, 1.0], bad)] {
            assert_eq!(rls.update(&mut h.clone(), &mut [y]), Err(RlsError::UnusableSample));
        }
    }
    assert_eq!(rls.update(&mut [1.0], &mut [1.0]), Err(RlsError::UnusableSample));
    assert_eq!(rls.update(&mut [1.0; 2], &mut [1.0; 2]), Err(RlsError::UnusableSample));
    assert_eq!((rls.triangle.to_vec(), rls.projection.to_vec(), rls.turn), before);
    // The largest usable numbers still give finite weights.
    for _ in 0..1000 {
        rls.update(&mut [1e15, -1e15], &mut [1e15]).unwrap();
    }
    let mut weights = [0.0; 2];
    rls.weights(&mut weights);
    assert!(weights.iter().all(|w| w.is_finite()), "{weights:?}");
}

#[test]
fn unexcited_directions_fade_towards_weight_zero_and_are_told() {
    let mut memory = [0.0_f32; Rls::<f32>::values(2, 1)];
    let mut rls = Rls::try_new(&mut memory, [2, 1], 1e3, 0.9).unwrap();
    let mut weights = [0.0; 2];
    for _ in 0..100 {
        rls.update(&mut [0.0, 1.0], &mut [5.0]).unwrap();
        rls.update(&mut [1.0, 0.0], &mut [2.0]).unwrap();
    }
    rls.weights(&mut weights);
    assert!((weights[1] - 5.0).abs() < 0.01 && rls.is_excited(10.0), "{weights:?}");
    for _ in 0..100_000 {
        rls.update(&mut [1.0, 0.0], &mut [2.0]).unwrap();
    }
    rls.weights(&mut weights);
    assert!((weights[0] - 2.0).abs() < 1e-3 && weights[1].abs() < 1e-6, "{weights:?}");
    assert!(!rls.is_excited(10.0) && rls.is_excited(0.5));
}

#[test]
fn hopeless_settings_are_refused() {
    let mut memory = [0.0_f32; Rls::<f32>::values(2, 1)];
    for delta in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-39] {
        let refused = Rls::try_new(&mut memory, [2, 1], delta, 1.0);
        assert_eq!(refused, Err(RlsError::InitialCovariance), "{delta}");
    }
    for forgetting in [0.0, -0.5, 1.001, f32::NAN] {
        let refused = Rls::try_new(&mut memory, [2, 1], 1.0, forgetting);
        assert_eq!(refused, Err(RlsError::ForgettingFactor));
    }
    let refused = Rls::try_new(&mut memory[1..], [2, 1], 1.0, 1.0);
    assert_eq!(refused, Err(RlsError::Memory { expected: 8, found: 7 }));
}

#[test]
fn knowledge_is_counted_in_squares_and_a_direction_without_any_gets_weight_0() {
    let mut memory = [0.0; Rls::<f64>::values(1, 1)];
    let mut rls = Rls::try_new(&mut memory, [1, 1], 1.0, 1.0).unwrap();
    rls.update(&mut [2.0], &mut [6.0]).unwrap();
    assert!(rls.is_excited(4.9) && !rls.is_excited(5.1)); // 1 + 2·2
    let mut weights = [f64::NAN; 2];
    solve(&[3.0, 1.0, 0.0, 0.0], &[6.0, 0.0], 2, &mut weights);
    assert_eq!(weights, [2.0, 0.0]);
}
