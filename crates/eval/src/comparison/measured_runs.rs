//! The measured runs of one tracker: values per clip, draw of the observation's noise and seed, with the facts that
//! decide whether they are comparable.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::changed_settings::changed_settings;
use crate::{Summary, Unit, mean};
use skiagraph_core::input::hex_sha256;

/// The runs of one side, by clip.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeasuredRuns {
    /// The clips by name, which is the set's name.
    pub clips: BTreeMap<String, MeasuredClip>,
    /// Other draws of the observation's noise: the same clips on sets that differ only in the noise.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub draws: BTreeMap<String, Vec<MeasuredClip>>,
}

/// All seeds of one set, which is one draw of the noise of one clip.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeasuredClip {
    /// Hash of the set's files.
    pub set_hash: String,
    /// Hash of everything that a set shares with other draws of its noise; absent in runs of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_hash: Option<String>,
    /// Frames of the set.
    pub frames: usize,
    /// Frames per second.
    pub frames_per_second: f64,
    /// The tracker's name.
    pub tracker: String,
    /// All settings of the tracker, if known.
    pub settings: Option<Value>,
    /// Version of the program that measured the runs.
    pub version: String,
    /// The seeds, in the order of every `per_seed`.
    pub seeds: Vec<u64>,
    /// The metrics by [`crate::Metric::name`].
    pub metrics: BTreeMap<String, MeasuredMetric>,
    /// Mean error of every marker and seed, millimetres.
    pub joints: BTreeMap<String, Vec<Option<f64>>>,
}

/// One metric of all seeds of a clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredMetric {
    /// Unit of all values.
    pub unit: Unit,
    /// Joint set, alignment, mask rule, frames and rate, without facts about single runs.
    pub protocol: String,
    /// Mean of every seed; `None` if it could not be measured.
    pub per_seed: Vec<Option<f64>>,
}

/// Why the runs of two folders cannot be combined to one side.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct MergeError(String);

impl MeasuredClip {
    /// The clip with the seeds, metrics and joints of a summary.
    pub fn with_values(mut self, summary: &Summary) -> Self {
        self.seeds = summary.runs.iter().map(|run| run.seed).collect();
        let metric = |metric: &crate::MetricSummary| MeasuredMetric {
            unit: metric.unit,
            protocol: metric.protocol.clone(),
            per_seed: metric.per_run.clone(),
        };
        self.metrics = summary.metrics.iter().map(|(name, found)| (name.clone(), metric(found))).collect();
        self.joints = summary.per_joint.iter().map(|joint| (joint.joint.clone(), joint.per_run.clone())).collect();
        self
    }

    /// Seeds and values of a metric, for seeds with a value.
    pub fn values(&self, metric: &str) -> Vec<(u64, f64)> {
        self.metrics.get(metric).map(|metric| present(&self.seeds, &metric.per_seed)).unwrap_or_default()
    }

    /// Seeds and mean errors of a marker.
    pub fn joint(&self, joint: &str) -> Vec<(u64, f64)> {
        self.joints.get(joint).map(|values| present(&self.seeds, values)).unwrap_or_default()
    }

    /// The markers that a run of this clip estimates and no run of `other` does: their errors are over other markers.
    /// Empty if the markers of `other` were not recorded.
    pub(crate) fn markers_beyond(&self, other: &Self) -> Vec<&str> {
        if other.joints.is_empty() {
            return Vec::new();
        }
        let names = self.joints.keys().map(String::as_str);
        names.filter(|name| !self.joint(name).is_empty() && other.joint(name).is_empty()).collect()
    }

    /// Whether all of at least two runs have bit-identical values, as for a tracker that draws no random numbers. They
    /// count as one observation.
    pub fn are_copies(&self) -> bool {
        let mut lists = self.metrics.values().map(|metric| &metric.per_seed).chain(self.joints.values());
        self.seeds.len() > 1 && lists.all(|values| values.windows(2).all(|pair| pair[0] == pair[1]))
    }

    /// Seeds whose runs are bit-identical to that of an earlier seed; empty if all are.
    pub(crate) fn repeated_seeds(&self) -> Vec<u64> {
        if self.are_copies() {
            return Vec::new();
        }
        let lists = || self.metrics.values().map(|metric| &metric.per_seed).chain(self.joints.values());
        let same = |one: usize, other: usize| lists().all(|values| values.get(one) == values.get(other));
        let repeats = |at: &usize| (0..*at).any(|earlier| same(earlier, *at));
        (0..self.seeds.len()).filter(repeats).map(|at| self.seeds[at]).collect()
    }

    /// The mean over conditions of the means over their sets and seeds, as a single seed.
    fn averaged(&self, conditions: &[Vec<&Self>]) -> Self {
        let over = |values: &dyn Fn(&Self) -> Vec<(u64, f64)>| {
            let condition = |sets: &Vec<&Self>| {
                mean(&sets.iter().flat_map(|set| values(set)).map(|(_, value)| value).collect::<Vec<_>>())
            };
            // a mean over some of the conditions would be biased
            vec![conditions.iter().map(condition).collect::<Option<Vec<f64>>>().and_then(|means| mean(&means))]
        };
        let metric = |(name, metric): (&String, &MeasuredMetric)| {
            (name.clone(), MeasuredMetric { per_seed: over(&|set| set.values(name)), ..metric.clone() })
        };
        let joint = |name: &String| (name.clone(), over(&|set| set.joint(name)));
        let hashes: Vec<&str> = conditions.iter().flatten().map(|set| set.set_hash.as_str()).collect();
        Self {
            set_hash: hex_sha256(hashes.concat().as_bytes()),
            scene_hash: None,
            seeds: self.seeds.iter().take(1).copied().collect(),
            metrics: self.metrics.iter().map(metric).collect(),
            joints: self.joints.keys().map(joint).collect(),
            ..self.clone()
        }
    }

    /// Whether two sets differ only in the draw of their noise.
    pub(crate) fn is_draw_of(&self, other: &Self) -> bool {
        self.scene_hash.is_some() && self.scene_hash == other.scene_hash
    }

    fn check_tracker(&self, clip: &str, other: &Self) -> Result<(), MergeError> {
        let differ = |what: &str, one: &dyn Display, other: &dyn Display| {
            Err(MergeError(format!(
                "two runs of `{clip}` differ in their {what} ({one} and {other}); give them as two sides"
            )))
        };
        if self.tracker != other.tracker {
            return differ("tracker", &self.tracker, &other.tracker);
        }
        if self.settings != other.settings {
            let changed = changed_settings(self.settings.as_ref(), other.settings.as_ref());
            return Err(MergeError(format!(
                "two runs of `{clip}` differ in their tracker's settings ({changed}); give them as two sides"
            )));
        }
        if self.version != other.version {
            return differ("version of skiagraph", &self.version, &other.version);
        }
        Ok(())
    }

    /// Adds the seeds of another run on the same set.
    fn append(&mut self, clip: &str, other: Self) -> Result<(), MergeError> {
        self.check_tracker(clip, &other)?;
        if let Some(seed) = other.seeds.iter().find(|seed| self.seeds.contains(seed)) {
            return Err(MergeError(format!("seed {seed} of `{clip}` occurs twice; give only one of the two folders")));
        }
        let (mine, theirs) = (self.seeds.len(), other.seeds.len());
        self.seeds.extend(&other.seeds);
        for (name, metric) in other.metrics {
            let MeasuredMetric { unit, protocol, .. } = &metric;
            let empty = || MeasuredMetric { unit: *unit, protocol: protocol.clone(), per_seed: vec![None; mine] };
            self.metrics.entry(name).or_insert_with(empty).per_seed.extend(metric.per_seed);
        }
        for (name, values) in other.joints {
            self.joints.entry(name).or_insert_with(|| vec![None; mine]).extend(values);
        }
        let all = mine + theirs;
        self.metrics.values_mut().for_each(|metric| metric.per_seed.resize(all, None));
        self.joints.values_mut().for_each(|values| values.resize(all, None));
        Ok(())
    }
}

fn present(seeds: &[u64], values: &[Option<f64>]) -> Vec<(u64, f64)> {
    seeds.iter().zip(values).filter_map(|(seed, value)| Some((*seed, (*value)?))).collect()
}

impl MeasuredRuns {
    /// Adds a run: of a new clip, of another draw of the noise of a clip, or of more seeds of a set.
    ///
    /// # Errors
    /// [`MergeError`] if a seed occurs twice or the runs differ in more than the seed and the draw.
    pub fn add(&mut self, name: &str, clip: MeasuredClip) -> Result<(), MergeError> {
        let Some(first) = self.clips.get_mut(name) else {
            self.clips.insert(name.to_owned(), clip);
            return Ok(());
        };
        if first.set_hash == clip.set_hash {
            return first.append(name, clip);
        }
        if !clip.is_draw_of(first) {
            return Err(MergeError(format!(
                "two runs of `{name}` are on sets that differ in more than the observation's noise (hashes {} and {}), \
                 or were measured by a version that did not record this; measure both again with skiagraph evaluate, \
                 or give them as two sides",
                first.set_hash, clip.set_hash
            )));
        }
        first.check_tracker(name, &clip)?;
        let draws = self.draws.entry(name.to_owned()).or_default();
        match draws.iter_mut().find(|draw| draw.set_hash == clip.set_hash) {
            Some(draw) => draw.append(name, clip),
            None => {
                draws.push(clip);
                Ok(())
            }
        }
    }

    /// Mean of a metric over clips of each clip's mean over draws of their means over seeds; `None` without any value.
    pub fn mean_of(&self, metric: &str) -> Option<f64> {
        let of_set =
            |set: &MeasuredClip| mean(&set.values(metric).into_iter().map(|(_, value)| value).collect::<Vec<_>>());
        let of_clip = |name: &String| mean(&self.sets_of(name).into_iter().filter_map(of_set).collect::<Vec<_>>());
        mean(&self.clips.keys().filter_map(of_clip).collect::<Vec<_>>())
    }

    /// One observation per clip, for a suite that has every clip under several conditions: the means over all sets and
    /// seeds of the clip's names. `clips` has the names by clip. Without that, conditions would count as clips.
    ///
    /// # Errors
    /// [`MergeError`] if a name has no run, or the trackers of two runs differ.
    pub fn averaged_over_conditions(&self, clips: &BTreeMap<String, BTreeSet<String>>) -> Result<Self, MergeError> {
        let mut averaged = Self::default();
        for (clip, names) in clips {
            let mut of_names = Vec::with_capacity(names.len());
            for name in names {
                let sets = self.sets_of(name);
                let Some(first) = sets.first() else {
                    return Err(MergeError(format!(
                        "`{name}` has no run, so the mean of `{clip}` over its conditions is not known; complete the \
                         suite first"
                    )));
                };
                sets.iter().try_for_each(|set| first.check_tracker(name, set))?;
                of_names.push(sets);
            }
            if let Some(first) = of_names.first().and_then(|sets| sets.first()) {
                of_names.iter().flatten().try_for_each(|set| first.check_tracker(clip, set))?;
                averaged.clips.insert(clip.clone(), first.averaged(&of_names));
            }
        }
        Ok(averaged)
    }

    /// All sets of a clip, which are draws of its noise; empty if there is no such clip.
    pub fn sets_of(&self, name: &str) -> Vec<&MeasuredClip> {
        self.clips.get(name).into_iter().chain(self.draws.get(name).into_iter().flatten()).collect()
    }

    /// All sets with the names of their clips.
    pub fn sets(&self) -> impl Iterator<Item = (&String, &MeasuredClip)> {
        self.clips.keys().flat_map(|name| self.sets_of(name).into_iter().map(move |set| (name, set)))
    }

    /// Number of runs, clip x draw x seed.
    pub fn runs(&self) -> usize {
        self.sets().map(|(_, set)| set.seeds.len()).sum()
    }
}

/// `0 to 9` for consecutive seeds, otherwise a list.
pub fn describe_seeds(seeds: &[u64]) -> String {
    let mut sorted = seeds.to_vec();
    sorted.sort_unstable();
    match sorted.as_slice() {
        [] => "none".to_owned(),
        [one] => one.to_string(),
        [first, .., last] if last - first + 1 == sorted.len() as u64 => format!("{first} to {last}"),
        several => {
            let shown: Vec<String> = several.iter().take(20).map(u64::to_string).collect();
            format!("{}{}", shown.join(", "), if several.len() > 20 { ", ..." } else { "" })
        }
    }
}

#[cfg(test)]
pub(crate) mod fixture {
    use super::*;

    /// One clip with values of HumanEva's error and of lost tracks, seeds from `first` on.
    pub(crate) fn clip(set_hash: &str, first: u64, errors: &[f64]) -> MeasuredClip {
        let metric = |unit, per_seed| MeasuredMetric { unit, protocol: "as ever".to_owned(), per_seed };
        let all = |value| errors.iter().map(|_| Some(value)).collect();
        MeasuredClip {
            set_hash: set_hash.to_owned(),
            scene_hash: None,
            frames: 100,
            frames_per_second: 60.0,
            tracker: "annealed_particle_filter".to_owned(),
            settings: None,
            version: "0.1.0".to_owned(),
            seeds: (first..first + errors.len() as u64).collect(),
            metrics: BTreeMap::from([
                (
                    "humaneva_mm".to_owned(),
                    metric(Unit::Millimetre, errors.iter().map(|e| Some(*e).filter(|e| e.is_finite())).collect()),
                ),
                ("track_loss".to_owned(), metric(Unit::Fraction, all(0.0))),
                ("coverage".to_owned(), metric(Unit::Fraction, all(1.0))),
            ]),
            joints: BTreeMap::from([("pelvis".to_owned(), errors.iter().map(|e| Some(0.5 * e)).collect())]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_of_a_clip_from_two_folders_are_combined() {
        let mut runs = MeasuredRuns::default();
        runs.add("walk", fixture::clip("a", 0, &[1.0, 2.0])).unwrap();
        let mut more = fixture::clip("a", 5, &[3.0]);
        more.metrics.remove("track_loss");
        runs.add("walk", more).unwrap();
        let walk = &runs.clips["walk"];
        assert_eq!(walk.values("humaneva_mm"), [(0, 1.0), (1, 2.0), (5, 3.0)]);
        assert_eq!(walk.metrics["track_loss"].per_seed, [Some(0.0), Some(0.0), None]);
        assert_eq!((walk.joint("pelvis").len(), runs.runs()), (3, 3));
        let twice = runs.add("walk", fixture::clip("a", 5, &[3.0])).unwrap_err();
        assert_eq!(twice.to_string(), "seed 5 of `walk` occurs twice; give only one of the two folders");
        let other = runs.add("walk", fixture::clip("b", 9, &[3.0])).unwrap_err();
        assert!(other.to_string().contains("differ in more than the observation's noise (hashes a and b)"), "{other}");
        let with = |particles: u32| {
            let settings = serde_json::json!({"particles": particles, "layers": 5});
            MeasuredClip { settings: Some(settings), ..fixture::clip("a", u64::from(particles), &[1.0]) }
        };
        let mut runs = MeasuredRuns::default();
        runs.add("walk", with(12)).unwrap();
        let other = runs.add("walk", with(20)).unwrap_err().to_string();
        assert!(other.contains("settings (particles 12 → 20);"), "{other}");
    }

    #[test]
    fn conditions_of_a_clip_are_one_observation_and_none_may_be_missing() {
        let mut runs = MeasuredRuns::default();
        for (name, values) in
            [("two-walk", &[1.0, 3.0][..]), ("one-walk", &[6.0]), ("two-run", &[7.0]), ("one-run", &[9.0])]
        {
            runs.add(name, fixture::clip(name, 0, values)).unwrap();
        }
        let names = |clip: &str| ["one", "two"].map(|rig| format!("{rig}-{clip}")).into();
        let mut clips: BTreeMap<String, BTreeSet<String>> =
            ["walk", "run"].map(|clip| (clip.to_owned(), names(clip))).into();
        let averaged = runs.averaged_over_conditions(&clips).unwrap();
        assert_eq!(averaged.clips["walk"].values("humaneva_mm"), [(0, 4.0)], "the mean of 2 and 6");
        assert_eq!(averaged.clips["run"].values("humaneva_mm"), [(0, 8.0)]);
        assert_ne!(averaged.clips["run"].set_hash, averaged.clips["walk"].set_hash);
        clips.insert("jump".to_owned(), names("jump"));
        let missing = runs.averaged_over_conditions(&clips).unwrap_err().to_string();
        assert!(missing.contains("`one-jump` has no run"), "{missing}");
    }

    #[test]
    fn sets_of_one_scene_are_draws_of_its_noise_with_their_own_seeds() {
        let draw = |hash: &str, first, scene: &str| MeasuredClip {
            scene_hash: Some(scene.to_owned()),
            ..fixture::clip(hash, first, &[1.0, 2.0])
        };
        let mut runs = MeasuredRuns::default();
        for clip in [draw("a", 0, "s"), draw("b", 0, "s"), draw("b", 2, "s")] {
            runs.add("walk", clip).unwrap();
        }
        assert_eq!((runs.sets_of("walk").len(), runs.sets().count(), runs.runs()), (2, 2, 6));
        assert_eq!(runs.draws["walk"][0].seeds, [0, 1, 2, 3]);
        let twice = runs.add("walk", draw("b", 3, "s")).unwrap_err();
        assert!(twice.to_string().contains("seed 3 of `walk` occurs twice"), "{twice}");
        let other = runs.add("walk", draw("c", 0, "another")).unwrap_err();
        assert!(other.to_string().contains("more than the observation's noise"), "{other}");
        let text = serde_json::to_string(&runs).unwrap();
        assert_eq!(serde_json::from_str::<MeasuredRuns>(&text).unwrap(), runs);
        let mut faster = draw("d", 0, "s");
        faster.tracker = "frozen".to_owned();
        assert!(runs.add("walk", faster).unwrap_err().to_string().contains("differ in their tracker"));
    }

    #[test]
    fn bit_identical_runs_are_copies_and_a_single_run_is_not() {
        let copies = |errors: &[f64]| fixture::clip("a", 0, errors).are_copies();
        assert!(copies(&[3.0; 5]) && !copies(&[3.0]) && !copies(&[3.0, 3.0, 3.000_000_000_000_001]));
        assert_eq!(fixture::clip("a", 0, &[3.0, 4.0, 3.0, 5.0]).repeated_seeds(), [2]);
        assert!(fixture::clip("a", 0, &[3.0; 3]).repeated_seeds().is_empty(), "copies are reported differently");
    }

    #[test]
    fn consecutive_seeds_are_described_as_a_range() {
        let described = [&[2, 0, 1][..], &[4], &[0, 5]].map(describe_seeds);
        assert_eq!(described, ["0 to 2", "4", "0, 5"]);
    }
}
