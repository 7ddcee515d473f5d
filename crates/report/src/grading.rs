//! The grade of a run: a table of metrics with their limits, in which the worst row decides.

use serde::{Deserialize, Serialize};

use super::ReportInput;
use super::displayed::{number, symbol};
use skiagraph_eval::{Direction, METRICS, Metric, Summary, Unit, find_metric};

/// The grade of a run, from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Grade {
    /// Every row is within the limit of good.
    Good,
    /// Every row is within the limit of fair.
    #[serde(alias = "usable")]
    Fair,
    /// A row is beyond its limits.
    #[serde(alias = "lost")]
    Poor,
}

impl Grade {
    /// The grade in lower case, as in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Fair => "fair",
            Self::Poor => "poor",
        }
    }
}

/// The grade of a run and what it follows from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// The worst grade of all rows; none for a recording, of which no truth is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grade: Option<Grade>,
    /// The grade and the first row that has it, in one sentence of fixed form.
    pub line: String,
    /// The graded metrics; empty in records of versions that graded otherwise.
    #[serde(default)]
    pub rows: Vec<GradeRow>,
    /// Names of the metrics that are worse than those of a tracker that never moves, in table order; without metrics of
    /// the estimate's own motion ([`Metric::has_frozen_floor`]).
    pub worse_than_frozen: Vec<String>,
    /// In how many frames the likelihood prefers which pose; absent without energies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preferred: Option<PreferredPose>,
}

/// One metric of a run with its limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GradeRow {
    /// [`Metric::name`].
    pub metric: String,
    /// The unit of the value and the limits.
    pub unit: Unit,
    /// The run's value; absent if it could not be measured.
    pub value: Option<f64>,
    /// The resulting grade; absent without a value.
    pub grade: Option<Grade>,
    /// The limit of good, inclusive; for a row against a tracker that never moves, that tracker's value, exclusive.
    pub good: Option<f64>,
    /// The limit of fair, inclusive; `None` if any value is fair.
    pub fair: Option<f64>,
    /// Whether the limit is the value of a tracker that never moves.
    pub against_frozen: bool,
}

/// Shares of the frames, 0 to 1, in which the energy at the estimate is below, above or equal to that at the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PreferredPose {
    /// The images fit the estimate better: a wrong pose wins by the likelihood, the body or the images.
    pub estimate: f64,
    /// The images fit the truth better: the search missed a better pose.
    pub truth: f64,
    /// Both fit alike, as with empty images.
    pub neither: f64,
    /// Number of frames with both energies, of all seeds.
    pub frames: usize,
}

impl PreferredPose {
    /// One sentence of fixed form.
    pub fn describe(&self) -> String {
        let [estimate, truth, neither] =
            [self.estimate, self.truth, self.neither].map(|share| number(share, Unit::Fraction));
        let frames = self.frames;
        format!(
            "Better fit to the images: estimate {estimate} %, truth {truth} %, neither {neither} % of {frames} frames."
        )
    }
}

/// Limits of a metric. [`Metric::needs`] says what it needs.
struct Limits {
    metric: &'static str,
    good: f64,
    fair: f64,
}

/// `docs/metrics.md` gives the reasons.
const LIMITS: [Limits; 9] = [
    Limits { metric: "humaneva_mm", good: 50.0, fair: 100.0 },
    // 12 of the 15 markers: what a detector of shoulders, elbows, wrists, hips, knees and ankles has
    Limits { metric: "coverage", good: 0.8, fair: 0.5 },
    Limits { metric: "lost_frames", good: 0.0, fair: 0.05 },
    Limits { metric: WITHIN, good: 0.95, fair: 0.85 },
    Limits { metric: "lost_limb", good: 0.05, fair: 0.5 },
    Limits { metric: "track_loss", good: 0.0, fair: 0.05 },
    Limits { metric: "limbs_exchanged", good: 0.05, fair: 0.2 },
    Limits { metric: "body_orientation_deg", good: 15.0, fair: 30.0 },
    Limits { metric: OVERLAP, good: 0.8, fair: 0.65 },
];

/// Metrics in which a tracker that never moves should not win: the first decides between fair and poor.
const FLOORS: [&str; 7] =
    ["humaneva_mm", "humaneva_relative_mm", "pa_mpjpe_mm", "body_orientation_deg", "heading_deg", OVERLAP, WITHIN];

/// Trunks of two bodies in the same pose differ in orientation by up to about this, degrees: a smaller error is not
/// compared with that of a tracker that never moves.
const ORIENTATION_BETWEEN_BODIES_DEG: f64 = 10.0;

/// The share of markers near the truth.
const WITHIN: &str = "pck150";

/// The overlap with the observed silhouettes. The exact one replaces it if anything that the tracker is given is
/// corrupted: an estimate should not be penalised for not following the corruption.
const OVERLAP: &str = "silhouette_iou";
const EXACT_OVERLAP: &str = "silhouette_iou_exact";

/// Grades a run.
pub fn verdict(input: &ReportInput<'_>) -> Verdict {
    let limits = LIMITS.iter().filter_map(|limits| graded(input, limits));
    let floors = FLOORS.iter().filter_map(|name| against_frozen(input, name));
    let rows: Vec<GradeRow> = limits.chain(floors).collect();
    let grade = rows.iter().filter_map(|row| row.grade).max().unwrap_or(Grade::Poor);
    let line = match rows.iter().find(|row| row.grade == Some(grade)) {
        Some(row) => format!("Grade {}: {}.", grade.name(), row.describe()),
        None => format!("Grade {}: no metric could be measured.", grade.name()),
    };
    Verdict { grade: Some(grade), line, rows, worse_than_frozen: worse_than_frozen(input), preferred: preferred(input) }
}

impl GradeRow {
    /// `HumanEva 3-D error 62.1 mm (good: at most 50.0 mm; fair: at most 100.0 mm)`
    pub fn describe(&self) -> String {
        let value = self.value.map_or_else(|| "-".to_owned(), |value| with_unit(value, self.unit));
        format!("{} {value} (good: {}; fair: {})", self.title(), self.good_limit(), self.fair_limit())
    }

    /// The metric's title.
    pub fn title(&self) -> &str {
        find_metric(&self.metric).map_or(self.metric.as_str(), |metric| metric.title)
    }

    /// The limit of good in words.
    pub fn good_limit(&self) -> String {
        match self.good {
            Some(value) if self.against_frozen => format!("better than never moving, {}", with_unit(value, self.unit)),
            limit => self.limit(limit),
        }
    }

    /// The limit of fair in words.
    pub fn fair_limit(&self) -> String {
        match (self.against_frozen, self.metric == FLOORS[0]) {
            (true, true) => self.good_limit(),
            _ => self.limit(self.fair),
        }
    }

    fn limit(&self, limit: Option<f64>) -> String {
        let is_score = find_metric(&self.metric).is_some_and(|m| m.direction == Direction::HigherIsBetter);
        match limit {
            Some(limit) => format!("at {} {}", if is_score { "least" } else { "most" }, with_unit(limit, self.unit)),
            None => "any".to_owned(),
        }
    }
}

pub(super) fn with_unit(value: f64, unit: Unit) -> String {
    format!("{} {}", number(value, unit), symbol(unit))
}

/// The metric that replaces the metric of a limit in this run: the exact overlap, if it was measured.
fn measured_metric(input: &ReportInput<'_>, name: &'static str) -> Option<&'static Metric> {
    let has_exact = input.summary.metrics.contains_key(EXACT_OVERLAP);
    find_metric(if name == OVERLAP && has_exact { EXACT_OVERLAP } else { name })
}

/// The value of a metric in this run. Markers that the estimate never has count as wrong in the share of near markers,
/// but are left out here: coverage has a row of its own.
fn value_of(input: &ReportInput<'_>, metric: &str) -> Option<f64> {
    let value = input.summary.metrics.get(metric)?.mean;
    let evaluation = input.runs.first()?.run.evaluation;
    let (given, never) = (evaluation.per_joint.len(), evaluation.never_estimated.len());
    if metric != WITHIN || given == 0 {
        return Some(value);
    }
    // rounded, so that all of the estimated markers are 1
    Some((1e9 * value * (given + never) as f64 / given as f64).round() / 1e9)
}

/// The row of a metric with fixed limits; without a grade if the run lacks what it needs.
fn graded(input: &ReportInput<'_>, limits: &Limits) -> Option<GradeRow> {
    let metric = measured_metric(input, limits.metric)?;
    let value = value_of(input, metric.name);
    let grade = value.map(|value| {
        if !metric.is_worse(value, limits.good) {
            Grade::Good
        } else if !metric.is_worse(value, limits.fair) {
            Grade::Fair
        } else {
            Grade::Poor
        }
    });
    Some(GradeRow {
        metric: metric.name.to_owned(),
        unit: metric.unit,
        value,
        grade,
        good: Some(limits.good),
        fair: Some(limits.fair),
        against_frozen: false,
    })
}

/// The row of a metric against a tracker that never moves; `None` if they cannot be compared.
fn against_frozen(input: &ReportInput<'_>, name: &'static str) -> Option<GradeRow> {
    let metric = measured_metric(input, name)?;
    let value = value_of(input, metric.name)?;
    let floor = input.frozen?.metrics.get(metric.name)?.mean;
    // two perfect shares tell nothing
    if metric.direction == Direction::HigherIsBetter && value >= 1.0 && floor >= 1.0 {
        return None;
    }
    if metric.unit == Unit::Degree && value <= ORIENTATION_BETWEEN_BODIES_DEG {
        return None;
    }
    let grade = match metric.is_worse(floor, value) {
        true => Grade::Good,
        false if name == FLOORS[0] => Grade::Poor,
        false => Grade::Fair,
    };
    Some(GradeRow {
        metric: metric.name.to_owned(),
        unit: metric.unit,
        value: Some(value),
        grade: Some(grade),
        good: Some(floor),
        fair: None,
        against_frozen: true,
    })
}

fn worse_than_frozen(input: &ReportInput<'_>) -> Vec<String> {
    let Some(frozen) = input.frozen else { return vec![] };
    let mut worse = Vec::new();
    for metric in METRICS.iter().filter(|metric| metric.has_frozen_floor()) {
        let (value, floor) = (input.summary.metrics.get(metric.name), frozen.metrics.get(metric.name));
        if let (Some(value), Some(floor)) = (value, floor)
            && metric.is_worse(value.mean, floor.mean)
        {
            worse.push(metric.name.to_owned());
        }
    }
    worse
}

/// Counts the signs of the energy gap over all frames and seeds.
fn preferred(input: &ReportInput<'_>) -> Option<PreferredPose> {
    let (mut estimate, mut truth, mut frames) = (0_usize, 0_usize, 0_usize);
    for run in input.runs {
        let Some(gap) = run.run.evaluation.metrics.get("energy_gap") else { continue };
        for gap in gap.per_frame.iter().flatten() {
            frames += 1;
            estimate += usize::from(*gap > 0.0);
            truth += usize::from(*gap < 0.0);
        }
    }
    let share = |count: usize| count as f64 / frames as f64;
    (frames > 0).then(|| PreferredPose {
        estimate: share(estimate),
        truth: share(truth),
        neither: share(frames - estimate - truth),
        frames,
    })
}

/// Whether a run lost the body: a mean error above 150 mm or none, or the body lost or without an estimate in more than
/// half of the frames.
pub fn is_lost(summary: &Summary) -> bool {
    let mean = |name: &str| summary.metrics.get(name).map(|metric| metric.mean);
    let above = |name: &str| mean(name).is_some_and(|share| share > 0.5);
    mean("humaneva_mm").is_none_or(|error| error > 150.0) || above("track_loss") || above("lost_frames")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Story, with_input};

    fn graded_story(story: &Story) -> Verdict {
        with_input(story, verdict)
    }

    /// The verdict if the run, unless `None`, and the tracker that never moves have these values of a metric.
    fn with_values(metric: &str, value: Option<f64>, floor: f64) -> Verdict {
        with_input(&Story::default(), |input| {
            let (mut frozen, mut summary) = (input.frozen.unwrap().clone(), input.summary.clone());
            let mut of_frozen = frozen.metrics["pa_mpjpe_mm"].clone();
            of_frozen.mean = floor;
            frozen.metrics.insert(metric.to_owned(), of_frozen);
            if let Some(value) = value {
                let mut changed = summary.metrics["humaneva_mm"].clone();
                changed.mean = value;
                summary.metrics.insert(metric.to_owned(), changed);
            }
            verdict(&ReportInput { frozen: Some(&frozen), summary: &summary, ..*input })
        })
    }

    #[test]
    fn limits_name_metrics_and_widen() {
        for limits in &LIMITS {
            let metric = find_metric(limits.metric).unwrap();
            assert!(metric.is_worse(limits.fair, limits.good), "{}", limits.metric);
        }
        assert!(FLOORS.iter().all(|name| find_metric(name).is_some()));
    }

    #[test]
    fn documented_limits_are_the_limits() {
        let documented = include_str!("../../../docs/metrics.md");
        for Limits { metric, good, fair } in LIMITS {
            let unit = find_metric(metric).unwrap().unit;
            let scale = if unit == Unit::Fraction { 100.0 } else { 1.0 };
            let [good, fair] = [good, fair].map(|limit| format!("{:.0} {}", scale * limit, symbol(unit)));
            assert!(documented.contains(&format!("| `{metric}` | {good} | {fair} |")), "{metric}: {good}, {fair}");
        }
    }

    #[test]
    fn value_on_a_limit_has_the_better_grade() {
        // 0.1 mm to either side, without the fixture's varying error
        let at = |beside_m: f64| graded_story(&Story { wander: 0.0, beside_m, ..Story::default() }).rows[0].grade;
        let grades = [0.0499, 0.0501, 0.0999, 0.1001].map(|metres| at(metres).unwrap());
        assert_eq!(grades, [Grade::Good, Grade::Fair, Grade::Fair, Grade::Poor]);
    }

    #[test]
    fn line_names_the_deciding_row() {
        let good = graded_story(&Story { wander: 0.0, beside_m: 0.01, ..Story::default() });
        let line = "Grade good: HumanEva 3-D error 10.0 mm (good: at most 50.0 mm; fair: at most 100.0 mm).";
        assert_eq!(good.line, line);
        let lost = graded_story(&Story { wrist_lost_from: Some(20), ..Story::default() });
        assert!(lost.line.starts_with("Grade poor: Frames with a marker over 150 mm off 8"), "{}", lost.line);
    }

    // An estimate of the pelvis alone was good: no row looked at markers that it never has.
    #[test]
    fn pelvis_alone_is_not_good() {
        let pelvis = with_values("coverage", Some(1.0 / 15.0), 1.0);
        assert_eq!(pelvis.grade, Some(Grade::Poor));
        assert!(pelvis.line.contains("(coverage) 6.7 % (good: at least 80.0 %; fair: at least 50.0 %)"), "{pelvis:?}");
        assert_eq!(with_values("coverage", Some(0.8), 1.0).grade, Some(Grade::Good));
    }

    // A trunk 18.5 degrees off, with a heading worse than that of a tracker that never moves, was good.
    #[test]
    fn turned_trunk_is_not_good() {
        let turned = with_values("body_orientation_deg", Some(18.5), 25.0);
        assert_eq!(turned.grade, Some(Grade::Fair));
        assert!(turned.line.contains("Body orientation error 18.5 °"), "{}", turned.line);
        let heading = with_values("heading_deg", Some(14.0), 12.0);
        assert_eq!(heading.grade, Some(Grade::Fair));
        let words = "14.0 ° (good: better than never moving, 12.0 °; fair: any)";
        assert!(heading.line.contains(words), "{}", heading.line);
        // bodies in the same pose differ by this much
        assert_eq!(with_values("heading_deg", Some(5.0), 4.7).grade, Some(Grade::Good));
    }

    #[test]
    fn frozen_error_decides_between_fair_and_poor() {
        assert_eq!(with_values("humaneva_mm", None, 1.0).grade, Some(Grade::Poor));
        assert_eq!(with_values("pa_mpjpe_mm", None, 0.0).grade, Some(Grade::Fair));
        // a gesture, in which the markers of a still body stay near as well
        assert_eq!(with_values(WITHIN, Some(1.0), 1.0).grade, Some(Grade::Good));
        assert_eq!(with_values(WITHIN, Some(0.99), 1.0).grade, Some(Grade::Fair));
    }

    #[test]
    fn never_estimated_marker_leaves_the_share() {
        let near = |from: usize| {
            let verdict = graded_story(&Story { wrist_missing_from: Some(from), ..Story::default() });
            verdict.rows.into_iter().find(|row| row.metric == WITHIN).unwrap().value.unwrap()
        };
        assert_eq!(near(0), 1.0);
        // a marker that is missing for half of the frames is wrong in the share, but no limb is 150 mm off
        let dropped = graded_story(&Story { wrist_missing_from: Some(60), ..Story::default() });
        assert!(dropped.rows.iter().any(|row| row.metric == "lost_limb" && row.value == Some(0.0)), "{dropped:?}");
        assert!((near(60) - (1.0 - 61.0 / 121.0 / 15.0)).abs() < 1e-3);
    }

    #[test]
    fn exact_overlap_replaces_the_observed() {
        let rows = graded_story(&Story { exact_overlap: Some(0.9), ..Story::default() }).rows;
        assert!(rows.iter().any(|row| row.metric == EXACT_OVERLAP && row.grade == Some(Grade::Good)));
        assert!(rows.iter().all(|row| row.metric != OVERLAP));
    }

    #[test]
    fn preferred_pose_counts_signs() {
        let of = |gap| graded_story(&Story { gap, empty_from: Some(61), ..Story::default() }).preferred.unwrap();
        let (searched, misled) = (of(-0.02), of(0.02));
        // 120 scored frames, of which the last 60 have empty images
        assert_eq!([searched.estimate, searched.truth, searched.neither], [0.0, 0.5, 0.5]);
        assert_eq!([misled.estimate, misled.truth, misled.frames as f64], [0.5, 0.0, 120.0]);
        assert_eq!(graded_story(&Story { energies: false, ..Story::default() }).preferred, None);
    }

    #[test]
    fn body_half_a_metre_away_is_lost() {
        let lost = |beside_m| with_input(&Story { beside_m, ..Story::default() }, |input| is_lost(input.summary));
        assert_eq!([0.05, 0.5].map(lost), [false, true]);
    }

    #[test]
    fn record_of_an_older_version_is_read() {
        let old = r#"{"grade": "usable", "line": "Usable: ...", "criteria": [{"metric": "floors"}], "worse_than_frozen": []}"#;
        let read: Verdict = serde_json::from_str(old).unwrap();
        assert_eq!((read.grade, read.rows.len()), (Some(Grade::Fair), 0));
    }
}
