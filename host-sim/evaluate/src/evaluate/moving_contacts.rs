//! What a model is worth on contacts that move, read by a board at its own pace.

use taxel_data::columns;
use taxel_learn::cost::{Cost, Design};
use taxel_learn::{Decoder, ModelBlob};
use taxel_simulate::Synthesis;
use taxel_simulate::path::Path;

use crate::device::{Device, Times, Wires};
use crate::error::Result;
use crate::experiment::Experiment;
use crate::metrics::{DecoderErrors, Errors, LimitSummary, Measure};
use crate::touches::{Touched, Touches, Way};
use crate::trade::FilterSettings;

/// Errors on contacts that move: of the newest finished estimate against the truth at that moment.
#[derive(Debug, Clone, PartialEq)]
pub struct MovingContacts {
    pub path: Path,
    /// Group of outputs for whose errors filters are set.
    pub group: String,
    /// Errors of the model without a filter, and behind one.
    pub ways: Vec<MovingWay>,
    /// Errors of the baselines, whose decoding takes no time.
    pub decoders: Vec<DecoderErrors>,
    /// Limit of contacts that move, if it is asked for.
    pub limit: LimitSummary,
    /// Trajectory to look at.
    pub shown: ShownTrajectory,
}

/// Errors of one way to read and decode.
#[derive(Debug, Clone, PartialEq)]
pub struct MovingWay {
    /// Filter in time behind the model; `None` without one.
    pub filter: Option<FilterSettings>,
    /// Whether the model's tracker stands behind it, in place of a filter.
    pub is_tracked: bool,
    pub times: Times,
    pub errors: Vec<Errors>,
}

/// One output over a trajectory, every ms: the truth, and the newest finished estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct ShownTrajectory {
    pub output: String,
    pub unit: String,
    pub time_s: Vec<f64>,
    pub truth: Vec<f64>,
    pub estimate: Vec<f64>,
    pub filtered: Vec<f64>,
}

impl MovingContacts {
    /// Errors of the model in `blob` on the moving contacts of `scene`, beside those of the `baselines`, and the limit on so many
    /// trajectories if it is asked for; `None` if its contacts do not move.
    pub fn new(
        scene: &Experiment,
        blob: &ModelBlob,
        baselines: &[Box<dyn Decoder>],
        limit_frames: Option<usize>,
    ) -> Result<Option<Self>> {
        let Some(path) = scene.world.path else { return Ok(None) };
        let device = Device::default();
        let scan_ms = device.scan_ms(Some(Wires::of(&scene.world)), 1);
        let names = scene.world.output_names();
        let group = columns::groups(&names).last().map_or("", |(group, _)| *group);
        let synthesis = Synthesis::new(&scene.world);
        let touches = Touches::new(scene, synthesis, (path, device.passes(1)), group);
        let model = blob.prepare().of_inputs();
        let cost = Cost::of_frame(&Design::new(blob));
        let limit = touches.limit(scan_ms, limit_frames);
        let summary = LimitSummary::new(&limit);
        let measure = Measure { limit: limit.ok(), ..scene.measure() };
        let touched = touches.judge((blob, &model), cost, (&device, scan_ms), &measure)?;
        let decoders =
            baselines.iter().map(|it| touches.judge_at_once(it.as_ref(), scan_ms, &measure));
        let way = |way: &Way| MovingWay {
            filter: way.filter.is_on().then(|| way.filter.into()),
            is_tracked: way.is_tracked,
            times: way.times,
            errors: way.errors.clone(),
        };
        Ok(Some(Self {
            path,
            group: group.into(),
            ways: touched.ways.iter().map(way).collect(),
            decoders: decoders.collect::<Result<_>>()?,
            limit: summary,
            shown: ShownTrajectory::new(&touched, group),
        }))
    }
}

impl ShownTrajectory {
    /// First trajectory, and the output of `group` that changes most in it.
    fn new(touched: &Touched, group: &str) -> Self {
        let moving = &touched.of_period.moving;
        let [plain, behind, ..] = &touched.ways[..] else { unreachable!("two ways at least") };
        let names = &moving.truth.names;
        let of_output = |values: &[f64], output: usize| -> Vec<f64> {
            let moments = values.chunks_exact(names.len()).take(moving.moments_s.len());
            moments.map(|line| line[output]).collect()
        };
        let range = |output: usize| {
            let values = of_output(&moving.truth.values, output);
            let of = |pick: fn(f64, f64) -> f64| values.iter().copied().reduce(pick);
            of(f64::max).zip(of(f64::min)).map_or(0.0, |(most, least)| most - least)
        };
        let outputs = (0..names.len()).filter(|output| columns::group_of(&names[*output]) == group);
        let ranges = outputs.map(|output| (output, range(output)));
        let (output, _) = ranges.max_by(|(_, a), (_, b)| a.total_cmp(b)).unwrap_or_default();
        let held = |estimates: &[f64], way: &Way| {
            of_output(&moving.held(estimates, way.times.frame_ms), output)
        };
        Self {
            output: names[output].clone(),
            unit: columns::unit_of(&names[output]).into(),
            time_s: moving.moments_s.clone(),
            truth: of_output(&moving.truth.values, output),
            estimate: held(&touched.estimates, plain),
            filtered: held(&touched.filtered, behind),
        }
    }
}
