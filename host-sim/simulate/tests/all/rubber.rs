//! Rubber with a memory against its closed solutions.

use taxel_data::{LANES, Lanes};
use taxel_simulate::rubber::{Response, Rubber, StandardLinearSolid};

const SOLID: StandardLinearSolid =
    StandardLinearSolid { instant_share: 0.7, time_constant_ms: 80.0 };

/// Deformation of one electrode that this wants along all axes.
fn of(wanted_mm: f64) -> [[Lanes; 3]; 1] {
    [[[wanted_mm; LANES], [-wanted_mm; LANES], [2.0 * wanted_mm; LANES]]]
}

fn reached_mm(response: &dyn Response, after_s: f64, wanted_mm: f64) -> f64 {
    let mut deformation_mm = of(wanted_mm);
    response.reach(after_s, &mut deformation_mm);
    let [[x, y, z]] = deformation_mm.map(|axes| axes.map(|lanes| lanes[LANES - 1]));
    assert!((x + y).abs() < 1e-15 && (z - 2.0 * x).abs() < 1e-15, "{x} {y} {z}");
    x
}

#[test]
fn a_load_step_reaches_its_instant_share_and_creeps_to_the_rest() {
    for (share, constant_ms) in [(0.7, 80.0), (0.0, 5.0), (1.0, 80.0), (0.4, 1e6)] {
        let solid = StandardLinearSolid { instant_share: share, time_constant_ms: constant_ms };
        let mut response = solid.at_rest(1).unwrap();
        response.advance(0.0, &of(0.5));
        let mut time_s = 0.0;
        for step_s in [0.0, 0.003, 1e-9, 0.2, 0.05, 7.0] {
            let closed =
                |time_s: f64| 0.5 * (1.0 - (1.0 - share) * (-time_s / (0.001 * constant_ms)).exp());
            let ahead_mm = reached_mm(&*response, step_s, 0.5);
            response.advance(step_s, &of(0.5));
            time_s += step_s;
            assert!((ahead_mm - closed(time_s)).abs() < 1e-14, "{ahead_mm} at {time_s} s");
            assert!((reached_mm(&*response, 0.0, 0.5) - ahead_mm).abs() < 1e-15);
        }
    }
}

#[test]
fn a_ramp_is_followed_exactly_in_steps_of_any_length() {
    let (rate_mm_per_s, constant_s) = (3.0_f64, 0.08_f64);
    let mut response = SOLID.at_rest(1).unwrap();
    let mut time_s = 0.0_f64;
    for step_s in [0.001, 1e-7, 0.04, 0.3, 0.002] {
        time_s += step_s;
        let wanted_mm = rate_mm_per_s * time_s;
        let lag_mm = rate_mm_per_s * constant_s * (1.0 - (-time_s / constant_s).exp());
        let ahead_mm = reached_mm(&*response, step_s, wanted_mm);
        assert!((ahead_mm - (wanted_mm - 0.3 * lag_mm)).abs() < 1e-9, "{ahead_mm} {time_s}");
        response.advance(step_s, &of(wanted_mm));
        assert!((reached_mm(&*response, 0.0, wanted_mm) - ahead_mm).abs() < 1e-12);
    }
}

#[test]
fn settings_that_cannot_be_used_are_refused_by_name() {
    SOLID.check().unwrap();
    for (solid, field) in [
        (StandardLinearSolid { instant_share: -0.1, ..SOLID }, "rubber.instant_share = -0.1"),
        (StandardLinearSolid { instant_share: f64::NAN, ..SOLID }, "rubber.instant_share"),
        (StandardLinearSolid { time_constant_ms: 0.0, ..SOLID }, "rubber.time_constant_ms = 0"),
        (StandardLinearSolid { time_constant_ms: 1e7, ..SOLID }, "rubber.time_constant_ms"),
    ] {
        let refused = solid.check().unwrap_err().to_string();
        assert!(refused.contains(field), "{refused}");
    }
}
