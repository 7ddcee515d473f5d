//! Ladders: trackers over rising strengths of corruptions. A ladder is a sweep whose settings are the levels.

use std::str::FromStr;

use serde::Serialize;
use serde_json::{Map, Value};

use super::definition::{Expansion, Sweep};
use super::plan::PlannedSweep;
use super::summary::{SettingSummary, SweepSummary};
use crate::common::ExperimentError;
use crate::evaluation::{Interval, mean};
use crate::observation::{AXES, CorruptionAxis, KEYPOINT_AXES, KeypointAxis};
use crate::scenario::did_you_mean;

/// Table whose corruptions and keypoint errors are axes.
const TABLE: &str = "observation.";
/// Table of the corruptions in it.
const CORRUPTION: &str = "corruption.";
/// Keys of keypoints that are no strengths: 0 is not clean.
const NO_STRENGTHS: [&str; 3] = ["slow_s", "gross_percent", "stretch_s"];
/// The override that errors of masks need.
pub(super) const SILHOUETTES: &str = "observation.silhouette=\"corrupted\"";
/// Most levels of an axis.
const MOST_LEVELS: usize = 100;

/// A corruption, or an error of keypoints, with its levels.
#[derive(Clone, Debug)]
pub struct LadderAxis {
    axis: LadderKey,
    /// Strengths above 0, rising.
    levels: Vec<f64>,
}

/// A key of `[observation]` of which 0 is clean.
#[derive(Clone, Copy, Debug)]
struct LadderKey {
    /// As on the command line: `boundary_px`, `keypoints.slow_percent`.
    name: &'static str,
    unit: &'static str,
    levels: [f64; 5],
    greatest: f64,
    of_masks: bool,
}

impl LadderKey {
    fn all() -> impl Iterator<Item = Self> {
        let corruptions = AXES.iter().map(|axis| {
            let CorruptionAxis { name, unit, levels, greatest, of_masks, .. } = *axis;
            Self { name, unit, levels, greatest, of_masks }
        });
        let strengths = KEYPOINT_AXES.iter().filter(|axis| !NO_STRENGTHS.contains(&axis.name));
        corruptions.chain(strengths.map(|axis| {
            let KeypointAxis { ladder_name: name, unit, levels, greatest, .. } = *axis;
            Self { name, unit, levels, greatest, of_masks: false }
        }))
    }

    /// The key in a scenario.
    fn key(&self) -> String {
        let is_nested = self.name.contains('.');
        format!("{TABLE}{}{}", if is_nested { "" } else { CORRUPTION }, self.name)
    }
}

impl FromStr for LadderAxis {
    type Err = String;

    /// Reads `AXIS` (with its default levels) or `AXIS=LEVEL,LEVEL,...`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, levels) = text.split_once('=').map_or((text, None), |(name, levels)| (name, Some(levels)));
        let axis = LadderKey::all().find(|axis| axis.name == name.trim()).ok_or_else(|| {
            let known: Vec<&str> = LadderKey::all().map(|axis| axis.name).collect();
            let guess = did_you_mean(name, known.iter().copied());
            let guess = guess.map(|guess| format!(", did you mean `{guess}`?")).unwrap_or_default();
            format!("there is no such axis{guess} (known: {})", known.join(", "))
        })?;
        let Some(levels) = levels else { return Ok(Self { axis, levels: axis.levels.to_vec() }) };
        let level = |text: &str| {
            let found = text.trim().parse().ok().filter(|level| (0.0..=axis.greatest).contains(level));
            let greatest = axis.greatest;
            found
                .ok_or_else(|| format!("expected levels from 0 to {greatest} such as 0.5,1,2, found `{}`", text.trim()))
        };
        let mut levels = levels.split(',').map(level).collect::<Result<Vec<f64>, String>>()?;
        // the clean level is always there
        levels.retain(|level| *level > 0.0);
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        match levels.len() {
            1..=MOST_LEVELS => Ok(Self { axis, levels }),
            0 => Err("expected a level above 0".to_owned()),
            more => Err(format!("expected at most {MOST_LEVELS} levels, found {more}")),
        }
    }
}

impl Sweep {
    /// The same sweep with the levels of these axes as its settings, and the clean level once; every seed draws its own
    /// noise.
    ///
    /// # Errors
    /// A message if an axis is named twice, or the sweep has axes of its own.
    pub fn with_ladder(mut self, axes: &[LadderAxis]) -> Result<Self, String> {
        if let Some(other) = self.axes.keys().next() {
            return Err(format!("a ladder varies only --axis: give one value for {other}, or use skiagraph sweep"));
        }
        let twice =
            axes.iter().enumerate().find(|(at, one)| axes[..*at].iter().any(|two| two.axis.name == one.axis.name));
        if let Some((_, LadderAxis { axis, .. })) = twice {
            return Err(format!("expected every axis once, found {} twice", axis.name));
        }
        if axes.iter().any(|ladder| ladder.axis.of_masks) {
            self.set.push(SILHOUETTES.to_owned());
        }
        // level 0 is stated, because the scenario may have another
        let keys: Vec<String> = axes.iter().map(|ladder| ladder.axis.key()).collect();
        let clean: Map<String, Value> = keys.iter().map(|key| (key.clone(), Value::from(0.0))).collect();
        self.points = vec![clean.clone()];
        for (ladder, key) in axes.iter().zip(&keys) {
            for level in &ladder.levels {
                let mut point = clean.clone();
                point.insert(key.clone(), Value::from(*level));
                self.points.push(point);
            }
        }
        (self.method, self.draws) = (Expansion::List, true);
        Ok(self)
    }
}

impl Sweep {
    /// The axes of a ladder with their levels, as on the command line; `None` for any other sweep.
    pub(super) fn ladder_axes(&self) -> Option<Vec<String>> {
        let (clean, levels) = self.points.split_first().filter(|_| self.method == Expansion::List && self.draws)?;
        let mut axes: Vec<(&str, Vec<String>)> = Vec::new();
        for point in levels {
            let (key, level) = point.iter().find(|(key, level)| clean.get(*key) != Some(*level))?;
            let name = key.strip_prefix(TABLE)?;
            let name = name.strip_prefix(CORRUPTION).unwrap_or(name);
            match axes.last_mut().filter(|(last, _)| *last == name) {
                Some((_, levels)) => levels.push(level.to_string()),
                None => axes.push((name, vec![level.to_string()])),
            }
        }
        Some(axes.into_iter().map(|(name, levels)| format!("{name}={}", levels.join(","))).collect())
    }
}

/// The curves of a ladder.
#[derive(Clone, Debug, Serialize)]
pub struct Ladder {
    /// `skiagraph.ladder_curves/1`.
    pub schema: &'static str,
    /// Its name.
    pub name: String,
    /// The metric.
    pub objective: String,
    /// Number of draws of the noise per level.
    pub draws: usize,
    /// Cells that cannot be run, or have no result.
    pub incomplete: usize,
    /// Remarks on programs that ignore their settings.
    pub remarks: Vec<String>,
    /// One per axis and tracker.
    pub curves: Vec<LadderCurve>,
}

/// One tracker over the levels of one axis.
#[derive(Clone, Debug, Serialize)]
pub struct LadderCurve {
    /// The axis.
    pub axis: String,
    /// Unit of its levels; empty for a share.
    pub unit: String,
    /// The tracker.
    pub tracker: String,
    /// The levels, rising, of which the first is 0: clean.
    pub levels: Vec<LadderLevel>,
    /// Level at which the mean is twice that of the clean level, interpolated linearly; absent if no level reaches it.
    pub doubles_at: Option<f64>,
}

/// One level of a curve.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LadderLevel {
    /// The strength.
    pub level: f64,
    /// Mean of the metric over the draws.
    pub mean: Option<f64>,
    /// Its 95 % interval.
    pub ci95: Option<Interval>,
    /// Number of draws that are graded lost.
    pub lost: usize,
    /// Mean share of the markers that have an estimate.
    pub coverage: Option<f64>,
    /// Mean of a tracker that never moves.
    pub frozen: Option<f64>,
}

impl Ladder {
    /// Reads the results of a ladder.
    ///
    /// # Errors
    /// [`ExperimentError`] if the plan cannot be read.
    pub fn new(sweep: &PlannedSweep) -> Result<Self, ExperimentError> {
        let summary = SweepSummary::new(sweep)?;
        let trackers = sweep.tracker_names();
        let axes = LadderKey::all().filter(|axis| summary.axes.contains(&axis.key()));
        let own = |axis: LadderKey| trackers.iter().map(move |tracker| (axis, tracker));
        let curves = axes.flat_map(own).map(|(axis, tracker)| LadderCurve::new(&summary, &axis, tracker));
        let failed = summary.all_cells().filter(|(_, cell)| cell.has_no_value()).count();
        Ok(Self {
            schema: "skiagraph.ladder_curves/1",
            curves: curves.collect(),
            name: summary.name,
            objective: summary.objective,
            draws: summary.seeds.len(),
            incomplete: failed,
            remarks: summary.remarks,
        })
    }
}

impl LadderCurve {
    fn new(summary: &SweepSummary, axis: &LadderKey, tracker: &str) -> Self {
        let key = axis.key();
        let level = |setting: &SettingSummary| {
            // settings of other axes are no level of this one
            let is_other = |(other, level): (&String, &Value)| {
                other.starts_with(TABLE) && *other != key && level.as_f64() != Some(0.0)
            };
            let level =
                setting.axes.get(&key).and_then(Value::as_f64).filter(|_| !setting.axes.iter().any(is_other))?;
            let (mean, ci95, lost, frozen) = (setting.mean, setting.ci95, setting.diverged, setting.frozen);
            Some(LadderLevel { level, mean, ci95, lost, coverage: setting.coverage(), frozen })
        };
        let own = summary.settings.iter().filter(|setting| setting.is_of(tracker));
        let mut levels: Vec<LadderLevel> = own.filter_map(level).collect();
        levels.sort_by(|a, b| a.level.total_cmp(&b.level));
        let (axis, unit, tracker) = (axis.name.to_owned(), axis.unit.to_owned(), tracker.to_owned());
        Self { axis, unit, tracker, doubles_at: doubling(&levels), levels }
    }

    /// The mean of the clean level.
    pub fn clean(&self) -> Option<f64> {
        self.levels.first()?.mean
    }

    /// The mean of a tracker that never moves, over all levels.
    pub fn frozen(&self) -> Option<f64> {
        mean(&self.levels.iter().filter_map(|level| level.frozen).collect::<Vec<f64>>())
    }
}

/// The level at which the mean is twice the first one, interpolated linearly.
fn doubling(levels: &[LadderLevel]) -> Option<f64> {
    let present: Vec<(f64, f64)> = levels.iter().filter_map(|level| Some((level.level, level.mean?))).collect();
    let twice = 2.0 * present.first().filter(|(level, mean)| *level == 0.0 && *mean > 0.0)?.1;
    let (before, after) = present.iter().zip(present.iter().skip(1)).find(|(_, after)| after.1 >= twice)?;
    Some(before.0 + (after.0 - before.0) * (twice - before.1) / (after.1 - before.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_has_its_own_levels_or_the_given_ones_without_the_clean_one() {
        let axis: LadderAxis = "boundary_px=4,0,1,1".parse().unwrap();
        assert_eq!((axis.axis.name, axis.levels), ("boundary_px", vec![1.0, 4.0]));
        assert_eq!("holes".parse::<LadderAxis>().unwrap().levels.len(), 5);
        for (text, words) in [
            ("boundry_px", "did you mean `boundary_px`?"),
            ("boundary_px=", "expected levels from 0 to"),
            ("boundary_px=0", "expected a level above 0"),
            ("holes=2", "expected levels from 0 to 1 such as"),
            ("holes=nan", "found `nan`"),
            ("keypoints.slow_percnt", "did you mean `keypoints.slow_percent`?"),
            ("keypoints.stretch_s", "there is no such axis"),
        ] {
            let error = text.parse::<LadderAxis>().unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    #[test]
    fn errors_of_keypoints_are_axes_beside_corruptions() {
        let axes = ["keypoints.slow_percent=1,2", "start_mm=10"].map(|text| text.parse().unwrap());
        let sweep = Sweep::named("a").with_ladder(&axes).unwrap();
        assert_eq!(sweep.points[1]["observation.corruption.start_mm"], 0.0);
        assert_eq!(sweep.points[1]["observation.keypoints.slow_percent"], 1.0);
    }

    #[test]
    fn the_clean_level_is_run_once_for_all_axes() {
        let axes = ["boundary_px=1,2", "start_mm=10"].map(|text| text.parse().unwrap());
        let sweep = Sweep::named("a").with_ladder(&axes).unwrap();
        assert_eq!(sweep.points.len(), 1 + 2 + 1);
        assert!(sweep.points[0].values().all(|level| level == &Value::from(0.0)), "level 0 is clean in any scenario");
        assert!(sweep.points.iter().all(|point| point.len() == 2));
        assert!(sweep.draws && sweep.set == ["observation.silhouette=\"corrupted\""]);
        assert_eq!(sweep.ladder_axes().unwrap(), ["boundary_px=1.0,2.0", "start_mm=10.0"]);
        assert_eq!(Sweep::named("a").ladder_axes(), None);
        assert!(Sweep::named("a").with_ladder(&[axes[1].clone()]).unwrap().set.is_empty());
        assert!(Sweep::named("a").with_ladder(&[axes[0].clone(), axes[0].clone()]).unwrap_err().contains("twice"));
        let mut swept = Sweep::named("a");
        swept.assign("particles=1,2", &[]).unwrap();
        assert!(swept.with_ladder(&axes).unwrap_err().contains("one value for particles"));
    }

    #[test]
    fn the_doubling_level_is_interpolated() {
        let of = |means: &[(f64, f64)]| {
            let level = |&(level, mean): &(f64, f64)| LadderLevel { level, mean: Some(mean), ..LadderLevel::default() };
            doubling(&means.iter().map(level).collect::<Vec<_>>())
        };
        assert_eq!(of(&[(0.0, 10.0), (1.0, 15.0), (2.0, 25.0), (4.0, 90.0)]), Some(1.5));
        assert_eq!(of(&[(0.0, 10.0), (1.0, 20.0)]), Some(1.0));
        assert_eq!(of(&[(0.0, 10.0), (1.0, 19.0)]), None);
        assert_eq!(of(&[(0.0, 0.0), (1.0, 19.0)]), None, "an exact tracker has no doubling");
        assert_eq!(of(&[(1.0, 10.0), (2.0, 29.0)]), None, "without the clean level");
    }
}
