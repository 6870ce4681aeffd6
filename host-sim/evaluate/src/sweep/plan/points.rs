//! Points of a plan: their fields, and the digests of what they share.

use std::collections::HashSet;

use taxel_data::digest::digest;
use taxel_data::{BadValue, require};
use taxel_learn::Options;
use toml::{Table, Value};

use super::{Base, Checked, FOLD, Plan, Point, SCENE, in_words};
use crate::experiment::Experiment;
use crate::sweep::fields;
use crate::sweep::file::Also;
use crate::sweep::on_device::OnDevice;
use crate::sweep::point::options;
use crate::training_options::{Training, TrainingOptions};

/// Fields of training that frames depend on, and what is held out of them.
const FIELDS_OF_FRAMES: [&str; 6] =
    ["frames", "test_frames", "relative_inputs", "method", "refine", "reading_model"];

impl Plan {
    /// All points, each once.
    ///
    /// # Errors
    /// [`BadValue`] for a field that a scene of the plan cannot have.
    pub fn points(&self) -> Checked<Vec<Point>> {
        // Scenes with different names may be the same, and are then shown as two.
        let mut seen = HashSet::new();
        let mut points = Vec::new();
        let mut places = vec![0; self.axes.len()];
        loop {
            let point = self.point(self.values_at(&places))?;
            if seen.insert((point.id.clone(), in_words(&point.values))) {
                points.push(point);
            }
            // The last axis is the fastest.
            let Some(axis) =
                (0..places.len()).rev().find(|axis| places[*axis] + 1 < self.axes[*axis].1.len())
            else {
                self.check_any(&points)?;
                return self.check_devices(&points).map(|()| points);
            };
            places[axis] += 1;
            places[axis + 1..].fill(0);
        }
    }

    /// Point with these values of fields.
    ///
    /// # Errors
    /// [`BadValue`] for a field that the plan's scene cannot have.
    pub fn point(&self, values: Vec<(String, Value)>) -> Checked<Point> {
        let document = self.changed(self.base_of(&values), values)?;
        let scene = text(&document.scene)?;
        let base = self.base_of(&document.values);
        let of_scene = base.map_or(0, |base| base.digest);
        let usual = match base.and_then(|base| self.usual.get(&base.label)) {
            Some(usual) => *usual,
            None => self.usual_in(&scene).unwrap_or_default(),
        };
        let mut shared = document.scene;
        let training = match shared.remove("training") {
            Some(Value::Table(training)) => training,
            _ => Table::new(),
        };
        if !self.has(Also::Table1) {
            shared.remove("table1");
        }
        let (on_device, fold) = (OnDevice::new(document.device)?, self.fold(document.data)?);
        let OnDevice { device, samples, column_step, filter } = on_device;
        let (limit_frames, train, also) = (self.limit_frames, self.train, &self.also);
        let how = format!(
            "{device:?} {samples} {column_step} {fold:?} {limit_frames:?} {train} {also:?}"
        );
        let filtered = self.group().filter(|_| filter);
        let decides = format!(
            "{}\n{how} {filtered:?} {usual:?} {of_scene:x}\n{:016x}\n{scene}",
            self.build, self.data_digest
        );
        let shares = digest(format!("{how}\n{}", text(&shared)?).as_bytes());
        let key = |is_shared: &dyn Fn(&str) -> bool| -> Checked<u64> {
            let mut training = training.clone();
            training.retain(|field, _| is_shared(field));
            Ok(digest(format!("{shares:x} {usual:?}\n{}", text(&training)?).as_bytes()))
        };
        let of_frames = |field: &str| FIELDS_OF_FRAMES.contains(&field);
        // Where centres move to depends on the penalty.
        let of_layers: &[&str] =
            if self.refines(&training) { &["format"] } else { &["format", "penalty"] };
        let keys = [
            key(&of_frames)?,
            key(&|field| !["centres", "spread", "penalty", "format"].contains(&field))?,
            key(&|field| !["spread", "penalty", "format"].contains(&field))?,
            key(&|field| !of_layers.contains(&field))?,
            key(&|field| field != "penalty")?,
            key(&|_| true)?,
        ];
        let id = format!("{:016x}", digest(decides.as_bytes()));
        let (values, digest) = (document.values, of_scene);
        Ok(Point { id, values, scene, on_device, fold, usual, digest, shares, keys })
    }

    /// Fold that is held out, as the `data` of a point say.
    pub(super) fn fold(&self, mut data: Table) -> Checked<Option<usize>> {
        let fold = data.remove("fold");
        if let Some((field, value)) = data.iter().next() {
            let rule =
                "points of the same data may differ only in data.fold; give other fields in [data]";
            return Err(BadValue::new(format!("data.{field}"), value, rule));
        }
        let Some(value) = fold else { return Ok(None) };
        let refused = |rule: String| BadValue::new(FOLD, &value, rule);
        let Some(data) = &self.data else {
            return Err(refused("a scene is evaluated on new frames: leave it out".into()));
        };
        let fold = value.as_integer().and_then(|fold| usize::try_from(fold).ok());
        let fold = fold.filter(|fold| *fold < data.folds());
        fold.map(Some).ok_or_else(|| {
            refused(match data.folds() {
                0 | 1 => {
                    "the frames are in no folds: give folds, fold_blocks or fold_column in [data]"
                        .into()
                }
                folds => format!("give a fold, 0 to {}", folds - 1),
            })
        })
    }

    /// Checks that some of all `points` can be; of the others, each has its reason as a result.
    fn check_any(&self, points: &[Point]) -> Checked<()> {
        let check = |scene: &str| self.check_values(scene);
        let mut refusals = points.iter().map(|point| check(&point.scene).err());
        match refusals.next() {
            Some(Some(first)) if refusals.all(|refusal| refusal.is_some()) => {
                let document = self.document_at(&vec![0; self.axes.len()])?;
                Err(self.blamed(&document, &first, &check))
            }
            _ => Ok(()),
        }
    }

    /// Checks that each device is one that some of the `points` can have.
    fn check_devices(&self, points: &[Point]) -> Checked<()> {
        let (mut possible, mut refused) = (vec![], vec![]);
        for point in points {
            match self.check_readings(point) {
                Err(bad) => refused.push((&point.on_device, bad)),
                Ok(()) if possible.contains(&&point.on_device) => (),
                Ok(()) => possible.push(&point.on_device),
            }
        }
        let refused = refused.into_iter().find(|(device, _)| !possible.contains(device));
        refused.map_or(Ok(()), |(_, bad)| Err(bad))
    }

    /// Checks that measurements, or a point's scene, have what its device asks of them.
    pub(in crate::sweep) fn check_readings(&self, point: &Point) -> Checked<()> {
        let OnDevice { samples, column_step, filter, .. } = point.on_device;
        let scene = match &self.data {
            Some(_) => {
                require(samples == 1, "device.samples", samples, || {
                    "measured readings are averaged already: give 1, or a scene".into()
                })?;
                None
            }
            None if column_step == 1 && !filter => return Ok(()),
            // A scene that cannot be is a failure of its point.
            None => match Experiment::parse(&self.name, &point.scene) {
                Ok(scene) => Some(scene.world),
                Err(_) => return Ok(()),
            },
        };
        let columns = scene.as_ref().map_or(1, |scene| scene.sensor.column_wires);
        require(column_step <= columns, "device.column_step", column_step, || match &self.data {
            Some(_) => {
                "only a scene has columns to leave out; for a data file, choose inputs".into()
            }
            None => format!("give steps from 1 to {columns}, the columns of the scene"),
        })?;
        let moves = scene.is_some_and(|scene| scene.path.is_some());
        require(moves || !filter, "device.filter", filter, || {
            "a filter is evaluated on contacts that move: leave it out, or give a scene with a [motion]".into()
        })
    }

    /// Whether models with these fields of `training` may be refined.
    fn refines(&self, training: &Table) -> bool {
        let is_usual = self.data.as_deref().is_none_or(|data| data.how.refine);
        !is_paper(training) && training.get("refine").and_then(Value::as_bool).unwrap_or(is_usual)
    }

    pub(super) fn usual_of(&self, base: &Base) -> Option<Options> {
        self.usual_in(&text(&self.changed(Some(base), vec![]).ok()?.scene).ok()?)
    }

    fn usual_in(&self, scene: &str) -> Option<Options> {
        options(self.data.as_deref(), scene).ok()
    }

    /// Fields of the point at these places of the axes.
    pub(super) fn document_at(&self, places: &[usize]) -> Checked<Document> {
        let values = self.values_at(places);
        self.changed(self.base_of(&values), values)
    }

    fn values_at(&self, places: &[usize]) -> Vec<(String, Value)> {
        let chosen = self.axes.iter().zip(places);
        let values = chosen.flat_map(|((fields, lines), place)| {
            fields.iter().cloned().zip(lines[*place].iter().cloned())
        });
        values.collect()
    }

    /// Trains as the scene, [set] and `values` say one after another, where the later ones choose the kind of networks: fields
    /// that the earlier ones give follow it, as with options of a command.
    fn follow_kind(
        &self,
        document: &mut Table,
        base: Option<&Base>,
        values: &[(String, Value)],
    ) -> Checked<()> {
        const OF_KIND: [&str; 3] = ["training.method", "training.each_row", "training.features"];
        let mut given = self.set.iter().chain(values);
        if !given.any(|(field, _)| OF_KIND.contains(&field.as_str())) {
            return Ok(());
        }
        let mut layers = vec![base.map(|base| base.document.clone()).unwrap_or_default()];
        for given in [&self.set, values] {
            let mut layer = Table::new();
            for (field, value) in given.iter().filter(|(field, _)| field.starts_with("training.")) {
                fields::set(&mut layer, field, value.clone())?;
            }
            layers.push(layer);
        }
        let training = document.get("training").and_then(Value::as_table);
        let is_paper = training.is_some_and(is_paper);
        let mut training = self.data.as_ref().map_or(Training::default(), |data| data.how);
        for given in layers.iter().filter_map(|layer| layer.get("training")) {
            // What is wrong with a value is told elsewhere.
            let Ok(mut given) = given.clone().try_into::<TrainingOptions>() else {
                return Ok(());
            };
            // The last method holds.
            given.method = given.method.filter(|_| is_paper);
            training = given.over(&training)?;
        }
        let Options { spread, each_row, features, solver, format, .. } = training.options;
        fields::set(document, "training.spread", spread.into())?;
        let Some(Value::Table(of)) = document.get_mut("training") else { return Ok(()) };
        if features.is_none() {
            of.remove("features");
        }
        if is_paper {
            of.remove("features_kind");
        }
        let followed: [(&str, Value); 4] = [
            ("each_row", each_row.into()),
            ("refine", training.refine.into()),
            ("solver", solver.name().into()),
            ("format", format.name().into()),
        ];
        for (field, value) in followed {
            if let Some(given) = of.get_mut(field) {
                *given = value;
            }
        }
        Ok(())
    }

    /// Scene that a point with these values changes.
    pub(super) fn base_of(&self, values: &[(String, Value)]) -> Option<&Base> {
        let label = values.iter().find(|(field, _)| field == SCENE);
        let label = label.and_then(|(_, label)| label.as_str());
        let is_it = |base: &&Base| label == Some(&base.label);
        self.bases.iter().find(is_it).or(self.bases.first())
    }

    /// Fields of a scene with those in [set], and then these `values`.
    pub(super) fn changed(
        &self,
        base: Option<&Base>,
        values: Vec<(String, Value)>,
    ) -> Checked<Document> {
        let mut document = base.map(|base| base.document.clone()).unwrap_or_default();
        document.insert("device".into(), self.device.clone().into());
        let changed = self.set.iter().chain(&values).filter(|(field, _)| field != SCENE);
        for (field, value) in changed {
            fields::set(&mut document, field, value.clone())?;
        }
        self.follow_kind(&mut document, base, &values)?;
        let mut table = |name: &str| match document.remove(name) {
            Some(Value::Table(table)) => table,
            _ => Table::new(),
        };
        let (device, data) = (table("device"), table("data"));
        Ok(Document { scene: document, device, data, values })
    }
}

/// Whether models with these fields of `training` are trained as the paper does.
fn is_paper(training: &Table) -> bool {
    training.get("method").and_then(Value::as_str) == Some("paper")
}

/// Fields of a point.
pub(super) struct Document {
    pub scene: Table,
    pub device: Table,
    pub data: Table,
    pub values: Vec<(String, Value)>,
}

pub(super) fn text(table: &Table) -> Checked<String> {
    toml::to_string(table).map_err(|cause| BadValue::new("axes", "values", cause.to_string()))
}
