//! The run in one sentence, its grade with limits, and the likely cause of its error.

use serde::{Deserialize, Serialize};

use super::ReportInput;
use super::grading::{Criterion, Grade, criteria, percent};
use crate::evaluation::METRICS;

/// The verdict on a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// The worst grade of all criteria.
    pub grade: Grade,
    /// Some sentences: the grade, the error beside the share of frames with a lost limb, the limiting criteria, and the
    /// longest stretch of a lost limb.
    pub line: String,
    /// The criteria with their limits.
    pub criteria: Vec<Criterion>,
    /// Names of the metrics that are worse than those of a tracker that never moves, in table order; none of those that
    /// measure the estimate's own motion ([`crate::evaluation::Metric::has_frozen_floor`]).
    pub worse_than_frozen: Vec<String>,
    /// Whether the images prefer the estimate or the true pose; absent if energies are unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
}

/// Grades a run and describes it.
pub fn verdict(input: &ReportInput<'_>) -> Verdict {
    let criteria = criteria(input);
    let grade = criteria.iter().map(|criterion| criterion.grade).max().unwrap_or(Grade::Lost);
    let worse_than_frozen = worse_than_frozen(input);
    let (error, lost) = (error_in_words(input), lost_limb_in_words(input));
    let line = format!("{}: {error}{lost}.{}{}", grade.title(), held_back_by(grade, &criteria), longest_lost(input));
    Verdict { grade, line, criteria, worse_than_frozen, cause: cause(input) }
}

fn error_in_words(input: &ReportInput<'_>) -> String {
    let Some(error) = input.summary.metrics.get("humaneva_mm") else {
        return "the error could not be measured".to_owned();
    };
    let seeds = input.runs.len();
    let certainty = match error.ci95 {
        Some(ends) => format!("95 % interval {:.0} to {:.0} mm over {seeds} seeds", ends.low, ends.high),
        None => error.interval.clone(),
    };
    format!("the mean marker error is {:.0} mm ({certainty})", error.mean)
}

/// What a mean hides: in how many frames a marker is far off.
fn lost_limb_in_words(input: &ReportInput<'_>) -> String {
    let share = input.summary.metrics.get("lost_limb").map(|lost| lost.mean);
    match (share, lacks_markers(input)) {
        (None, _) => String::new(),
        (Some(0.0), false) => ", no marker is ever more than 150 mm off".to_owned(),
        (Some(0.0), true) => ", no marker that it gives is ever more than 150 mm off".to_owned(),
        (Some(share), false) => format!(", a marker is more than 150 mm off in {} of the frames", percent(share)),
        (Some(share), true) => {
            format!(", a marker is missing or more than 150 mm off in {} of the frames", percent(share))
        }
    }
}

/// Whether markers have no estimate in some frames or in all.
fn lacks_markers(input: &ReportInput<'_>) -> bool {
    input.summary.metrics.get("coverage").is_some_and(|coverage| coverage.mean < 1.0)
}

/// The longest stretch with a lost limb, as a sentence with a space before it; nothing where none is long.
fn longest_lost(input: &ReportInput<'_>) -> String {
    let Some(longest) = &input.summary.longest_lost else { return String::new() };
    let words = longest.stretch.describe(lacks_markers(input));
    let (first, rest) = words.split_at(words.chars().next().map_or(0, char::len_utf8));
    let seed = if input.runs.len() > 1 { format!(" (seed {})", longest.run.seed) } else { String::new() };
    format!(" The longest: {}{rest}{seed}.", first.to_lowercase())
}

/// The criteria that determine the grade, unless it is the best.
fn held_back_by(grade: Grade, criteria: &[Criterion]) -> String {
    let worst: Vec<&str> = criteria.iter().filter(|c| c.grade == grade).map(|c| c.finding.as_str()).collect();
    if grade == Grade::Good { String::new() } else { format!(" Limited by: {}.", worst.join("; ")) }
}

fn worse_than_frozen(input: &ReportInput<'_>) -> Vec<String> {
    let Some(frozen) = input.frozen else { return vec![] };
    let is_worse = |name: &str| Some((input.summary.metrics.get(name)?.mean, frozen.metrics.get(name)?.mean));
    let compared = METRICS.iter().filter(|metric| metric.has_frozen_floor());
    let worse = compared.filter(|m| is_worse(m.name).is_some_and(|(value, floor)| m.is_worse(value, floor)));
    worse.map(|metric| metric.name.to_owned()).collect()
}

/// Whether the images fit truth or estimate better, from the sign of the energy gap in each frame.
fn cause(input: &ReportInput<'_>) -> Option<String> {
    let of_runs = input.runs.iter().filter_map(|run| run.run.evaluation.metrics.get("energy_gap"));
    let gaps = of_runs.flat_map(|metric| metric.per_frame.iter().flatten().copied());
    // empty images fit every pose equally
    let gaps: Vec<f64> = gaps.filter(|gap| *gap != 0.0).collect();
    let preferred = gaps.iter().filter(|gap| **gap > 0.0).count();
    let share = (!gaps.is_empty()).then(|| preferred as f64 / gaps.len() as f64)?;
    Some(match (input.own_likelihood, share >= 0.5) {
        (true, true) => format!(
            "In {} of the frames the images fit the estimate better than the true pose (refitted to the tracker's \
            body): there the likelihood or the body model prefers a wrong pose.",
            percent(share)
        ),
        (true, false) => format!(
            "In {} of the frames the images fit the true pose (refitted to the tracker's body) better than the estimate: there \
             the search missed a better pose.",
            percent(1.0 - share)
        ),
        (false, true) => format!(
            "In {} of the frames the silhouettes fit the estimate better than the true pose, by skiagraph's likelihood on the \
            set's body: there silhouettes and this body do not tell the two poses apart.",
            percent(share)
        ),
        (false, false) => format!(
            "In {} of the frames the silhouettes fit the true pose better than the estimate, by skiagraph's likelihood on the \
            set's body: there the images show a better pose than the program found.",
            percent(1.0 - share)
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, told};

    #[test]
    fn a_run_that_follows_is_good_and_says_how_sure_it_is() {
        let verdict = told(&Story { seeds: 3, ..Story::default() }, verdict);
        assert_eq!(verdict.grade, Grade::Good, "{:?}", verdict.criteria);
        assert!(verdict.line.starts_with("Good: the mean marker error is "), "{}", verdict.line);
        assert!(
            verdict.line.contains("95 % interval")
                && verdict.line.ends_with("over 3 seeds), no marker is ever more than 150 mm off."),
            "{}",
            verdict.line
        );
    }

    #[test]
    fn one_and_two_seeds_have_no_interval_and_a_lost_body_is_not_good() {
        let told = |seeds| told(&Story { seeds, lost_from: Some(60), ..Story::default() }, verdict);
        let of_one = told(1);
        assert!(of_one.grade > Grade::Usable, "{of_one:?}");
        assert!(of_one.line.contains("1 seed: no interval") && of_one.line.contains("Limited by"), "{}", of_one.line);
        assert!(told(2).line.contains("2 seeds: no interval"));
    }

    /// The false verdict of old: an answer 149 mm beside the truth in every frame loses no frame at all.
    #[test]
    fn an_answer_that_is_149_mm_off_in_every_frame_is_poor() {
        let verdict = told(&Story { beside_m: 0.149, ..Story::default() }, verdict);
        assert!(verdict.grade >= Grade::Poor, "{verdict:?}");
        assert!(
            verdict.line.contains("error is 149 mm") || verdict.line.contains("error is 150 mm"),
            "{}",
            verdict.line
        );
    }

    #[test]
    fn limbs_that_are_exchanged_throughout_are_poor_whatever_the_error() {
        let verdict = told(&Story { exchanged: true, ..Story::default() }, verdict);
        assert!(verdict.grade >= Grade::Poor, "{verdict:?}");
        let swaps = verdict.criteria.iter().find(|criterion| criterion.metric == "limbs_exchanged").unwrap();
        assert!(swaps.grade == Grade::Poor && swaps.value > 0.8, "{swaps:?}");
    }

    /// The false verdicts of old: the mean is below 50 mm with a wrist that is half a metre off for 41 frames or more.
    #[test]
    fn a_small_mean_with_a_lost_limb_is_not_good_and_the_stretch_is_named() {
        for (from, grade) in [(80, Grade::Usable), (50, Grade::Poor)] {
            let verdict = told(&Story { wrist_lost_from: Some(from), seeds: 2, ..Story::default() }, verdict);
            let mean = verdict.criteria.iter().find(|criterion| criterion.metric == "humaneva_mm").unwrap();
            assert!(mean.grade == Grade::Good && mean.value < 50.0, "{mean:?}");
            assert_eq!(verdict.grade, grade, "{}", verdict.line);
            let stretch = format!(" The longest: left wrist more than 150 mm off from frame {from} to 120 (seed 0).");
            assert!(verdict.line.ends_with(&stretch), "{}", verdict.line);
            assert!(verdict.line.contains("a marker is more than 150 mm off in "), "{}", verdict.line);
        }
        let short = told(&Story { wrist_lost_from: Some(116), ..Story::default() }, verdict);
        assert_eq!(short.grade, Grade::Good, "5 of 120 frames: {}", short.line);
        assert!(!short.line.contains("The longest"), "{}", short.line);
    }

    /// A marker without an estimate was said to be more than 150 mm off.
    #[test]
    fn a_marker_that_is_missing_is_called_so() {
        let verdict = told(&Story { wrist_missing_from: Some(50), ..Story::default() }, verdict);
        let words = "The longest: left wrist missing or more than 150 mm off from frame 50 to 120.";
        assert!(verdict.line.ends_with(words), "{}", verdict.line);
        assert!(verdict.line.contains("a marker is missing or more than 150 mm off in "), "{}", verdict.line);
    }

    /// A pose that never changes fits better with left and right exchanged in a third of the frames of a walk.
    #[test]
    fn a_rigid_pose_is_not_said_to_be_exchanged() {
        let (verdict, swaps) = told(&Story { rigid: true, ..Story::default() }, |input| {
            (verdict(input), input.summary.metrics["limb_swaps"].mean)
        });
        assert!(swaps > 0.3, "{swaps}");
        let exchanged = verdict.criteria.iter().find(|criterion| criterion.metric == "limbs_exchanged").unwrap();
        assert!(exchanged.grade == Grade::Good && !verdict.line.contains("exchanged"), "{}", verdict.line);
    }

    #[test]
    fn the_overlap_is_graded_on_the_exact_silhouettes_where_the_observed_ones_are_corrupted() {
        let overlap = |verdict: &Verdict| {
            verdict.criteria.iter().find(|criterion| criterion.metric.starts_with("silhouette")).unwrap().clone()
        };
        let observed = overlap(&told(&Story::default(), verdict));
        assert_eq!(
            (observed.metric.as_str(), observed.title.as_str()),
            ("silhouette_iou", "Overlap of the silhouettes")
        );
        let told = told(&Story { exact_overlap: Some(0.5), ..Story::default() }, verdict);
        let exact = overlap(&told);
        assert_eq!((exact.metric.as_str(), exact.value, exact.grade), ("silhouette_iou_exact", 0.5, Grade::Poor));
        assert!(told.line.contains("50 %, measured on the exact silhouettes, because those observed are corrupted"));
    }

    #[test]
    fn of_another_program_it_is_said_whose_likelihood_was_asked() {
        for (gap, words) in
            [(0.1, "do not tell the two poses apart"), (-0.1, "show a better pose than the program found")]
        {
            let story = Story { gap, own_likelihood: false, ..Story::default() };
            let cause = told(&story, verdict).cause.unwrap();
            assert!(cause.contains(words) && cause.contains("by skiagraph's likelihood on the set's body"), "{cause}");
        }
    }

    #[test]
    fn what_is_worse_than_never_moving_is_named_and_the_floor_itself_is_not() {
        let of_good = told(&Story::default(), verdict).worse_than_frozen;
        assert!(!of_good.iter().any(|name| name == "humaneva_mm"), "{of_good:?}");
        assert!(
            !of_good.iter().any(|name| name == "jitter_m_per_s3"),
            "what stands still does not shake: no floor: {of_good:?}"
        );
        let of_bad = told(&Story { beside_m: 9.0, ..Story::default() }, verdict);
        assert!(of_bad.worse_than_frozen.iter().any(|name| name == "humaneva_mm") && of_bad.grade == Grade::Lost);
        assert!(told(&Story { frozen: false, ..Story::default() }, verdict).worse_than_frozen.is_empty());
    }

    #[test]
    fn the_sign_of_the_gap_says_what_the_images_prefer_and_no_more() {
        for (gap, words) in [
            (0.1, "In 100 % of the frames the images fit the estimate better than the true pose"),
            (-0.1, "the search missed a better pose"),
        ] {
            let cause = told(&Story { gap, ..Story::default() }, verdict).cause.unwrap();
            assert!(cause.contains(words), "{cause}");
            assert!(!cause.contains("may help") && !cause.contains("would not"), "{cause}");
        }
    }

    #[test]
    fn images_that_show_nothing_accuse_nobody() {
        let verdict = told(&Story { gap: 0.0, ..Story::default() }, verdict);
        assert_eq!(verdict.cause, None);
        let json = serde_json::to_value(&verdict).unwrap();
        assert!(json.get("cause").is_none(), "absent and not null: {json}");
    }

    #[test]
    fn small_shares_are_not_rounded_away() {
        assert_eq!([0.0, 0.001, 0.5, 0.999, 1.0].map(percent), ["0 %", "under 1 %", "50 %", "over 99 %", "100 %"]);
    }
}
