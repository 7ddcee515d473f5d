//! Limits that grade a run as good, usable, poor or lost.

use serde::{Deserialize, Serialize};

use super::ReportInput;
use crate::evaluation::{Direction, Unit, find_metric};
use crate::observation::{Corruption, ObservationFacts, SilhouetteSource};

/// The grade of a run, from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Grade {
    /// The body is followed, including all limbs.
    Good,
    /// The body is followed, but single limbs or stretches are off.
    Usable,
    /// The body is found, but its pose is unreliable.
    Poor,
    /// The estimate is not where the body is.
    Lost,
}

impl Grade {
    /// The grade, capitalised.
    pub fn title(self) -> &'static str {
        match self {
            Self::Good => "Good",
            Self::Usable => "Usable",
            Self::Poor => "Poor",
            Self::Lost => "Lost",
        }
    }
}

/// One metric of a run with its limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Criterion {
    /// [`crate::evaluation::Metric::name`], `floors` for the comparison with a tracker that never moves.
    pub metric: String,
    /// Display name.
    pub title: String,
    /// The run's value; for `floors`, the number of metrics that are worse.
    pub value: f64,
    /// The resulting grade.
    pub grade: Grade,
    /// The limits of good, usable and poor, inclusive; `None` if any value has that grade.
    pub limits: [Option<f64>; 3],
    /// The value as text.
    pub finding: String,
    /// The limits as text.
    pub limits_in_words: [String; 3],
    /// The reason for these limits.
    pub why: String,
}

/// A metric and the limits of good, usable and poor.
struct Limits {
    metric: &'static str,
    title: &'static str,
    limits: [Option<f64>; 3],
    /// Text with `{}` for the value.
    finding: &'static str,
    why: &'static str,
}

const LIMITS: [Limits; 7] = [
    Limits {
        metric: "humaneva_mm",
        title: "Mean error of the markers",
        limits: [Some(50.0), Some(100.0), Some(150.0)],
        finding: "a mean error of {}",
        why: "50 mm is the radius of an adult's upper arm or lower leg, 100 mm its diameter, so the estimated bone lies \
            inside the true limb or directly beside it; with more than 150 mm in 15 frames in a row the body is lost",
    },
    Limits {
        metric: WITHIN,
        title: "Markers within 150 mm",
        limits: [Some(0.95), Some(0.85), Some(0.5)],
        finding: "{} of the markers within 150 mm",
        why: "one of fifteen markers is 7 %: a hand or foot that is often wrong is still usable, a whole arm or leg with its \
            three markers is not",
    },
    Limits {
        metric: "lost_limb",
        title: "Frames with a marker over 150 mm off",
        limits: [Some(0.05), Some(0.5), None],
        finding: "a marker more than 150 mm off in {} of the frames",
        why: "a mean over the body hides a limb: an arm that is lost throughout adds some 30 mm to it. A limb that slips for \
            a few frames at a turn stays below 5 %; with one that is off in more than half of the frames the pose cannot \
            be relied on, though the body is found",
    },
    Limits {
        metric: "track_loss",
        title: "Frames in stretches over 150 mm",
        limits: [Some(0.0), Some(0.05), Some(0.5)],
        finding: "the body lost in {} of the frames",
        why: "a stretch is 15 or more frames in a row whose mean errors are above 150 mm: the body is lost",
    },
    Limits {
        metric: "lost_frames",
        title: "Frames without an estimate",
        limits: [Some(0.0), Some(0.05), Some(0.5)],
        finding: "no estimate in {} of the frames",
        why: "the mean error leaves out frames without an estimate, so a tracker could improve it by skipping difficult \
            frames",
    },
    Limits {
        metric: "limbs_exchanged",
        title: "Frames with left and right exchanged",
        limits: [Some(0.05), Some(0.2), None],
        finding: "left and right exchanged in {} of the frames",
        why: "these are stretches of half a second or more in which legs or arms would be within 100 mm of the truth if left \
            and right were exchanged, and are twice as far off without the exchange: there the tracker follows the wrong \
            limb. Limbs that fit only a little better when exchanged are not counted",
    },
    Limits {
        metric: "silhouette_iou",
        title: "Overlap of the silhouettes",
        limits: [Some(0.8), Some(0.65), Some(0.45)],
        finding: "a silhouette overlap of {}",
        why: "with bodies of capsules, that of the tracker mismatched, four cameras and a walk, the overlap is 88 % in the \
            pose that fits the truth best, 67 % when that pose is moved by 50 mm and 46 % when it is moved by 100 mm",
    },
];

/// Metrics of position and pose in which a tracker that never moves should not win. The heading is part of the
/// orientation.
const FLOORS: [&str; 6] =
    ["humaneva_mm", "humaneva_relative_mm", "pa_mpjpe_mm", "body_orientation_deg", OVERLAP, WITHIN];

/// Trunks of two bodies in the same pose differ in orientation by up to about this, degrees: a smaller error is not
/// compared with that of a tracker that never moves.
const ORIENTATION_BETWEEN_BODIES_DEG: f64 = 10.0;

/// The share of markers near the truth.
const WITHIN: &str = "pck150";

/// The overlap with the observed silhouettes, and with the exact ones in the true cameras, which is measured if
/// anything that the tracker is given is corrupted: an estimate should not be penalised for not following the
/// corruption.
const OVERLAP: &str = "silhouette_iou";
const EXACT_OVERLAP: &str = "silhouette_iou_exact";

/// The metric that replaces the metric of a limit in this run: the exact overlap, if it was measured.
fn effective_metric(input: &ReportInput<'_>, metric: &'static str) -> &'static str {
    let has_exact = input.summary.metrics.contains_key(EXACT_OVERLAP);
    if metric == OVERLAP && has_exact { EXACT_OVERLAP } else { metric }
}

/// The value of a metric in this run. Markers that the estimate never has count as wrong in the metric, but are left
/// out here: most detectors have no top of the head.
fn effective_value(input: &ReportInput<'_>, metric: &str) -> Option<f64> {
    let value = input.summary.metrics.get(metric)?.mean;
    let never = never_estimated(input).len();
    let given = input.runs.first().map_or(0, |run| run.run.evaluation.per_joint.len());
    let is_share_of_markers = metric == WITHIN && never > 0 && given > 0;
    // rounded, so that all of the estimated markers are 1
    let of_given = (1e9 * value * (given + never) as f64 / given as f64).round() / 1e9;
    Some(if is_share_of_markers { of_given } else { value })
}

/// Names of the markers that the estimate never has; none if runs differ in them.
pub(super) fn never_estimated<'a>(input: &ReportInput<'a>) -> &'a [String] {
    let mut of_runs = input.runs.iter().map(|run| run.run.evaluation.never_estimated.as_slice());
    let first = of_runs.next().unwrap_or_default();
    if of_runs.all(|own| own == first) { first } else { &[] }
}

/// Something wrong with what the tracker is given, apart from its body and start pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WrongInput {
    CorruptedSilhouettes,
    SegmentedSilhouettes,
    OtherPeople,
    WrongCameras,
    WrongStart,
}

impl WrongInput {
    /// All that is wrong.
    pub(super) fn all(facts: &ObservationFacts) -> Vec<Self> {
        // the corruption without that of the tracker's cameras, body and start pose
        let of_silhouettes = Corruption {
            calibration_mm: 0.0,
            calibration_deg: 0.0,
            calibration_px: 0.0,
            lens_ignored: 0.0,
            wrong_body_percent: 0.0,
            start_mm: 0.0,
            start_deg: 0.0,
            ..facts.corruption
        };
        let wrong = [
            (Self::CorruptedSilhouettes, !of_silhouettes.is_none()),
            (Self::SegmentedSilhouettes, facts.silhouette == SilhouetteSource::Segmented),
            (Self::OtherPeople, facts.distractors > 0),
            (Self::WrongCameras, facts.corruption.changes_cameras()),
            (Self::WrongStart, facts.corruption.start_mm != 0.0 || facts.corruption.start_deg != 0.0),
        ];
        wrong.into_iter().filter(|(_, is_wrong)| *is_wrong).map(|(input, _)| input).collect()
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::CorruptedSilhouettes => "corrupted silhouettes",
            Self::SegmentedSilhouettes => "segmented silhouettes",
            Self::OtherPeople => "silhouettes with other people",
            Self::WrongCameras => "wrong cameras",
            Self::WrongStart => "a wrong start pose",
        }
    }

    /// Says that the overlap is that with the exact silhouettes, and why.
    fn why_exact(self) -> &'static str {
        match self {
            Self::CorruptedSilhouettes => ", measured on the exact silhouettes, because those observed are corrupted",
            Self::SegmentedSilhouettes => {
                ", measured on the exact silhouettes, because those observed are segmented from images"
            }
            Self::OtherPeople => {
                ", measured on the exact silhouettes of the actor, because those observed show other people too"
            }
            Self::WrongCameras => ", measured in the true cameras, because those that the tracker is given are wrong",
            Self::WrongStart => ", measured on the exact silhouettes",
        }
    }
}

/// Says that the overlap is that with the exact silhouettes, and why, if this is known.
fn why_exact(observation: Option<&ObservationFacts>) -> &'static str {
    let first = observation.and_then(|facts| WrongInput::all(facts).first().copied());
    first.map_or(", measured on the exact silhouettes", WrongInput::why_exact)
}

/// All criteria that were measured.
pub(super) fn criteria(input: &ReportInput<'_>) -> Vec<Criterion> {
    LIMITS.iter().filter_map(|limits| graded(input, limits)).chain(floors(input)).collect()
}

fn graded(input: &ReportInput<'_>, limits: &Limits) -> Option<Criterion> {
    let name = effective_metric(input, limits.metric);
    let value = effective_value(input, name)?;
    let metric = find_metric(name)?;
    let holds = |limit: &Option<f64>| limit.is_none_or(|limit| !metric.is_worse(value, limit));
    let grades = [Grade::Good, Grade::Usable, Grade::Poor];
    let grade = grades.into_iter().zip(&limits.limits).find(|(_, limit)| holds(limit)).map_or(Grade::Lost, |(g, _)| g);
    let words = |value: f64| if metric.unit == Unit::Fraction { percent(value) } else { format!("{value:.0} mm") };
    let bound = if metric.direction == Direction::HigherIsBetter { "at least" } else { "at most" };
    let limit = |limit: Option<f64>| match limit {
        Some(0.0) => "none".to_owned(),
        Some(limit) => format!("{bound} {}", words(limit)),
        None => "any".to_owned(),
    };
    let (title, which) = match name {
        EXACT_OVERLAP => (metric.title, why_exact(input.observation)),
        WITHIN if !never_estimated(input).is_empty() => (limits.title, ", of those that are estimated"),
        _ => (limits.title, ""),
    };
    Some(Criterion {
        metric: name.to_owned(),
        title: title.to_owned(),
        value,
        grade,
        limits: limits.limits,
        finding: format!("{}{which}", limits.finding.replace("{}", &words(value))),
        limits_in_words: limits.limits.map(limit),
        why: limits.why.to_owned(),
    })
}

/// The number of metrics in which a tracker that never moves is better: 0 is good; poor if the HumanEva error is among
/// them, else usable.
fn floors(input: &ReportInput<'_>) -> Option<Criterion> {
    let frozen = input.frozen?;
    let is_worse = |name: &&str| {
        let metric = find_metric(name)?;
        let [value, floor] = [effective_value(input, name)?, frozen.metrics.get(*name)?.mean];
        // two perfect shares tell nothing
        if metric.direction == Direction::HigherIsBetter && value >= 1.0 && floor >= 1.0 {
            return None;
        }
        if *name == "body_orientation_deg" && value <= ORIENTATION_BETWEEN_BODIES_DEG && metric.is_worse(value, floor) {
            return None;
        }
        let is_equal = (value - floor).abs() <= 1e-9 * floor.abs();
        Some(metric.is_worse(value, floor) || is_equal)
    };
    let compared = FLOORS.iter().map(|name| effective_metric(input, name)).filter(|name| is_worse(name).is_some());
    let (worse, better): (Vec<&str>, Vec<&str>) = compared.partition(|name| is_worse(name) == Some(true));
    let grade = match worse.first() {
        None => Grade::Good,
        Some(&"humaneva_mm") => Grade::Poor,
        Some(_) => Grade::Usable,
    };
    let titles = |names: &[&str]| {
        let known = names.iter().filter_map(|name| find_metric(name));
        known.map(|metric| metric.title).collect::<Vec<_>>().join(", ")
    };
    Some(Criterion {
        metric: "floors".to_owned(),
        title: "Position and pose metrics no better than never moving".to_owned(),
        value: worse.len() as f64,
        grade,
        limits: [Some(0.0), Some((FLOORS.len() - 1) as f64), None],
        finding: if worse.is_empty() {
            format!("better than a tracker that never moves in: {}", titles(&better))
        } else {
            format!("no better than a tracker that never moves in: {}", titles(&worse))
        },
        limits_in_words: ["none".to_owned(), "any but the HumanEva 3-D error".to_owned(), "any".to_owned()],
        why:
            "a tracker that ignores all images and keeps its start pose reaches these values; errors of position, pose \
            and body orientation (above 10 degrees), the overlap, and the share of the markers within 150 mm (below 100 %) \
            are compared"
                .to_owned(),
    })
}

/// A share as a whole percentage; 0 % and 100 % only if exact.
pub(super) fn percent(share: f64) -> String {
    let value = 100.0 * share;
    if value > 0.0 && value < 1.0 {
        "under 1 %".into()
    } else if value > 99.0 && value < 100.0 {
        "over 99 %".into()
    } else {
        format!("{value:.0} %")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, with_input};

    fn criterion(story: &Story, metric: &str) -> Criterion {
        with_input(story, |input| criteria(input).into_iter().find(|criterion| criterion.metric == metric).unwrap())
    }

    #[test]
    fn every_limit_belongs_to_a_metric_and_gets_worse_from_grade_to_grade() {
        for limits in &LIMITS {
            let metric = find_metric(limits.metric).unwrap();
            let [good, usable, poor] = limits.limits;
            assert!(metric.is_worse(usable.unwrap(), good.unwrap()), "{}", limits.metric);
            assert!(poor.is_none_or(|poor| metric.is_worse(poor, usable.unwrap())), "{}", limits.metric);
        }
        assert!(FLOORS.iter().all(|name| find_metric(name).is_some()));
    }

    #[test]
    fn a_value_on_a_limit_still_has_the_better_grade() {
        // 0.1 mm to either side, without the fixture's varying error
        let base = criterion(&Story { wander: 0.0, beside_m: 0.1, ..Story::default() }, "humaneva_mm");
        assert!((base.value - 100.0).abs() < 1e-6, "{}", base.value);
        let at =
            |metres: f64| criterion(&Story { wander: 0.0, beside_m: metres, ..Story::default() }, "humaneva_mm").grade;
        assert_eq!(
            [0.0499, 0.0501, 0.0999, 0.1001, 0.1499, 0.1501].map(at),
            [Grade::Good, Grade::Usable, Grade::Usable, Grade::Poor, Grade::Poor, Grade::Lost]
        );
    }

    #[test]
    fn markers_that_are_never_estimated_are_left_out_of_the_share_and_others_are_not() {
        let pck = |from: usize| criterion(&Story { wrist_missing_from: Some(from), ..Story::default() }, WITHIN);
        let (never, half) = (pck(0), pck(60));
        assert_eq!((never.grade, never.value), (Grade::Good, 1.0));
        assert_eq!(never.finding, "100 % of the markers within 150 mm, of those that are estimated");
        let missing = 1.0 - 61.0 / 121.0 / 15.0;
        assert!((half.value - missing).abs() < 1e-3 && !half.finding.contains("estimated"), "{half:?}");
    }

    #[test]
    fn an_error_above_the_floor_is_poor_and_another_metric_below_its_floor_usable() {
        assert_eq!(criterion(&Story::default(), "floors").grade, Grade::Good);
        assert_eq!(criterion(&Story { beside_m: 9.0, ..Story::default() }, "floors").grade, Grade::Poor);
        let posed = with_values("pa_mpjpe_mm", None, 0.0);
        assert_eq!((posed.grade, posed.value), (Grade::Usable, 1.0));
        assert!(posed.finding.ends_with("in: MPJPE, Procrustes-aligned"), "{}", posed.finding);
    }

    /// The criterion if the run, unless `None`, and the tracker that never moves have these values of a metric.
    fn with_values(metric: &str, value: Option<f64>, floor: f64) -> Criterion {
        with_input(&Story::default(), |input| {
            let (mut frozen, mut summary) = (input.frozen.unwrap().clone(), input.summary.clone());
            let mut of_frozen = frozen.metrics["pa_mpjpe_mm"].clone();
            of_frozen.mean = floor;
            frozen.metrics.insert(metric.to_owned(), of_frozen);
            if let Some(value) = value {
                summary.metrics.get_mut(metric).unwrap().mean = value;
            }
            floors(&ReportInput { frozen: Some(&frozen), summary: &summary, ..*input }).unwrap()
        })
    }

    #[test]
    fn a_run_whose_trunk_is_turned_more_than_if_it_never_moved_is_not_good_and_not_said_to_be_better_in_all() {
        let turned = with_values("body_orientation_deg", Some(12.0), 11.0);
        assert_eq!(turned.grade, Grade::Usable);
        assert!(turned.finding.ends_with("no better than a tracker that never moves in: Body orientation error"));
        let between_bodies = with_values("body_orientation_deg", Some(5.0), 4.7);
        assert_eq!(between_bodies.grade, Grade::Good);
        assert!(!between_bodies.finding.contains("orientation"), "{}", between_bodies.finding);
        let better = with_values("heading_deg", None, 0.0);
        assert_eq!(better.grade, Grade::Good);
        assert!(better.finding.starts_with("better than a tracker that never moves in: HumanEva 3-D error, "));
        assert!(!better.finding.contains("all") && !better.finding.contains("Heading"), "{}", better.finding);
    }

    #[test]
    fn a_gesture_whose_markers_are_all_within_150_mm_is_not_graded_down_because_those_of_a_still_body_are_too() {
        let (both, worse) = (with_values(WITHIN, Some(1.0), 1.0), with_values(WITHIN, Some(0.99), 1.0));
        assert_eq!((both.grade, worse.grade), (Grade::Good, Grade::Usable));
        assert!(!both.finding.contains("150"), "{}", both.finding);
    }

    #[test]
    fn the_reason_for_the_exact_overlap_names_what_is_wrong() {
        let facts = |corruption| ObservationFacts { corruption, ..ObservationFacts::default() };
        let cameras = Corruption { calibration_deg: 1.0, ..Corruption::default() };
        assert!(why_exact(Some(&facts(cameras))).contains("those that the tracker is given are wrong"));
        let both = Corruption { boundary_px: 2.0, ..cameras };
        assert!(why_exact(Some(&facts(both))).ends_with("those observed are corrupted"));
        let start = Corruption { start_mm: 20.0, ..Corruption::default() };
        assert_eq!(why_exact(Some(&facts(start))), ", measured on the exact silhouettes");
        let others = ObservationFacts { distractors: 1, ..ObservationFacts::default() };
        assert!(why_exact(Some(&others)).ends_with("show other people too"));
    }
}
