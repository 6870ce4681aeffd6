//! The paper's claims on spread, neurons and noise, each judged by figures of the maps.

use serde::Serialize;

use super::{Cell, Map, Plan};

/// Relative difference of two errors that counts as none.
const ALIKE: f64 = 0.01;
/// Largest factor between the errors at the ends of the spreads that still is slow growth.
const SLOW: f64 = 1.25;
/// Largest share of the mean's error that a decoder of determined unknowns may have.
const DETERMINED: f64 = 0.1;

/// Whether a claim is borne out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    Holds,
    /// Half of what it says is.
    InPart,
    Fails,
}

impl Verdict {
    pub fn words(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::InPart => "in part",
            Self::Fails => "fails",
        }
    }

    fn new(holds: bool) -> Self {
        if holds { Self::Holds } else { Self::Fails }
    }
}

/// Figure that a claim rests on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Where in the maps it stands.
    pub at: String,
    pub value: f64,
}

/// Claim of the paper, judged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    pub claim: &'static str,
    /// Noise level that it is judged at, as a fraction; `None` for a claim on noise.
    pub noise_level: Option<f64>,
    pub samples: usize,
    pub quantity: &'static str,
    pub compared: Vec<Compared>,
    pub verdict: Verdict,
}

pub(super) fn judge(plan: &Plan, maps: &[Map]) -> Vec<Claim> {
    let (Some(&narrow), Some(&wide)) = (plan.spreads.first(), plan.spreads.last()) else {
        return Vec::new();
    };
    let ends = Ends { narrow, wide };
    let at_level = |level: &f64| {
        let of_level: Vec<&Map> = maps.iter().filter(|map| map.noise_level == *level).collect();
        let most = of_level.last().copied();
        // Interpolation of the most samples.
        let whole = of_level.iter().rev().find(|map| map.interpolates()).copied();
        let on_most = most
            .into_iter()
            .flat_map(|map| [more_neurons, under_fit, slow].map(|it| it(map, ends)));
        let on_whole =
            whole.into_iter().flat_map(|map| [over_fit, determined].map(|it| it(map, ends)));
        on_most.chain(on_whole).flatten().collect::<Vec<_>>()
    };
    let by_level = plan.noise_levels.iter().flat_map(at_level);
    by_level.chain(with_noise(maps)).collect()
}

/// Narrowest and widest spread.
#[derive(Clone, Copy)]
struct Ends {
    narrow: f64,
    wide: f64,
}

impl Ends {
    /// The figures at both ends.
    fn compared(self, value: impl Fn(f64) -> Option<f64>) -> Option<Vec<Compared>> {
        let at =
            |spread: f64| Some(Compared { at: format!("spread {spread}"), value: value(spread)? });
        Some(vec![at(self.narrow)?, at(self.wide)?])
    }
}

impl Map {
    /// Whether K = N was tried.
    fn interpolates(&self) -> bool {
        self.cells.iter().any(|cell| cell.centres == self.samples)
    }

    fn with_spread(&self, spread: f64) -> impl Iterator<Item = &Cell> {
        self.cells.iter().filter(move |cell| cell.spread == spread)
    }

    /// Least test error at a spread.
    fn least(&self, spread: f64) -> Option<f64> {
        self.best(|cell| cell.spread == spread).map(|cell| cell.test_rmse)
    }

    fn claim(
        &self,
        claim: &'static str,
        quantity: &'static str,
        compared: Vec<Compared>,
        verdict: Verdict,
    ) -> Claim {
        let (noise_level, samples) = (Some(self.noise_level), self.samples);
        Claim { claim, noise_level, samples, quantity, compared, verdict }
    }
}

fn more_neurons(map: &Map, ends: Ends) -> Option<Claim> {
    let needed = |spread: f64| {
        let enough = map.least(spread)? * (1.0 + ALIKE);
        let mut cells = map.with_spread(spread).filter(|cell| cell.test_rmse <= enough);
        cells.next().map(|cell| cell.centres as f64)
    };
    let compared = ends.compared(needed)?;
    let verdict = Verdict::new(compared[1].value > compared[0].value);
    let quantity = "fewest K within 1 % of the least test error";
    Some(map.claim("wide Gaussians need more neurons", quantity, compared, verdict))
}

fn under_fit(map: &Map, ends: Ends) -> Option<Claim> {
    let training = |spread: f64| {
        let few = map.with_spread(spread).next()?;
        Some(few.training_rmse / map.mean_training_rmse)
    };
    let compared = ends.compared(training)?;
    let verdict = Verdict::new(compared[1].value > compared[0].value * (1.0 + ALIKE));
    let quantity = "training error with the fewest K, over the mean's";
    Some(map.claim("wide Gaussians under-fit", quantity, compared, verdict))
}

/// The gap between test and training error tells over-fitting, and the growth of the test error what it costs.
fn over_fit(map: &Map, ends: Ends) -> Option<Claim> {
    let whole = |spread: f64| map.with_spread(spread).find(|cell| cell.centres == map.samples);
    let gap = |spread: f64| {
        let cell = whole(spread)?;
        Some((cell.test_rmse - cell.training_rmse) / map.mean_rmse)
    };
    let growth = |spread: f64| Some(whole(spread)?.test_rmse / map.least(spread)?);
    let (mut gaps, mut growths) = (ends.compared(gap)?, ends.compared(growth)?);
    let is_wider = gaps[0].value > gaps[1].value;
    let verdict = match (is_wider, growths[0].value > 1.0 + ALIKE) {
        (true, true) => Verdict::Holds,
        (false, false) => Verdict::Fails,
        _ => Verdict::InPart,
    };
    gaps.iter_mut().for_each(|it| it.at = format!("{} (gap)", it.at));
    growths.iter_mut().for_each(|it| it.at = format!("{} (growth)", it.at));
    let quantity = "K = N: gap between test and training error, over the mean's; growth of the test error from the best K";
    let compared = [gaps, growths].concat();
    Some(map.claim("narrow Gaussians with too many neurons over-fit", quantity, compared, verdict))
}

fn slow(map: &Map, ends: Ends) -> Option<Claim> {
    let compared = ends.compared(|spread| map.least(spread))?;
    let growth = compared[1].value / compared[0].value;
    let verdict = Verdict::new((1.0 - ALIKE..SLOW).contains(&growth));
    let quantity = "least test error of any K";
    Some(map.claim("the error grows slowly with the spread", quantity, compared, verdict))
}

fn determined(map: &Map, _: Ends) -> Option<Claim> {
    let best = map.best(|cell| cell.centres == map.samples)?;
    let at = |kind: &str| format!("{kind}, spread {}", best.spread);
    let compared = vec![
        Compared { at: at("training"), value: best.training_rmse / map.mean_training_rmse },
        Compared { at: at("test"), value: best.test_rmse / map.mean_rmse },
    ];
    let verdict = match [0, 1].map(|place: usize| compared[place].value <= DETERMINED) {
        [true, true] => Verdict::Holds,
        [true, false] => Verdict::InPart,
        _ => Verdict::Fails,
    };
    let quantity = "error with K = N at its best spread, over the mean's";
    Some(map.claim("as many equations as unknowns determine them", quantity, compared, verdict))
}

/// Growth of the error with the noise, with the most samples.
fn with_noise(maps: &[Map]) -> Option<Claim> {
    let (quiet, loud) = (maps.first()?.noise_level, maps.last()?);
    let quiet = maps.iter().rev().find(|map| map.noise_level == quiet)?;
    if quiet.noise_level == loud.noise_level {
        return None;
    }
    let of = |map: &Map| {
        let best = map.best(|_| true)?;
        Some(Compared { at: format!("noise {}", map.noise_level), value: best.test_rmse })
    };
    let compared = vec![of(quiet)?, of(loud)?];
    let verdict = Verdict::new(compared[1].value > compared[0].value);
    let quantity = "least test error of any K and spread";
    let claim = loud.claim("the error grows with noise", quantity, compared, verdict);
    Some(Claim { noise_level: None, ..claim })
}
