//! The run in one sentence, and where its error comes from in another.

use serde::Serialize;

use super::ReportInput;

/// How the run went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// `good`, `fair` or `bad`: chooses the colour of the heading's bar.
    pub level: &'static str,
    /// One sentence.
    pub line: String,
    /// Search or model? `None` where energies are unknown.
    pub cause: Option<String>,
}

/// Puts a run into words.
pub fn verdict(input: &ReportInput<'_>) -> Verdict {
    let mean = |name: &str| input.summary.metrics.get(name).map(|metric| metric.mean);
    let error = mean("humaneva_mm").unwrap_or(f64::NAN);
    let lost = mean("track_loss").unwrap_or(0.0);
    let still = input.frozen.and_then(|frozen| frozen.metrics.get("humaneva_mm")).map(|metric| metric.mean);
    let useless = still.is_some_and(|still| error >= still);
    let without = mean("lost_frames").unwrap_or(0.0);
    let level = match lost {
        _ if useless => "bad",
        0.0 if without > 0.0 => "fair",
        share if share > 0.05 => "bad",
        share if share > 0.0 => "fair",
        _ => "good",
    };
    let what = if useless {
        "The tracker is no better than one that never moves".to_owned()
    } else if lost > 0.0 {
        format!("The tracker loses the body in {} of the frames", percent(lost))
    } else if without > 0.0 {
        "The tracker follows the body where it has an estimate".to_owned()
    } else {
        "The tracker follows the body through the whole clip".to_owned()
    };
    let gaps =
        if without > 0.0 { format!("; {} of the frames have no estimate", percent(without)) } else { String::new() };
    let line = format!("{what}; its markers are {error:.0} mm off on average{}{gaps}.", certainty(input));
    Verdict { level, line, cause: cause(input) }
}

fn certainty(input: &ReportInput<'_>) -> String {
    let interval = input.summary.metrics.get("humaneva_mm").and_then(|metric| metric.ci95);
    match (interval, input.runs.len()) {
        (Some(interval), seeds) => {
            format!(" (95 % interval {:.0} to {:.0} mm over {seeds} seeds)", interval.low, interval.high)
        }
        (None, _) => " (one seed, so no interval)".to_owned(),
    }
}

/// Whether the likelihood or the search is at fault, from the sign of the energy gap frame by frame.
fn cause(input: &ReportInput<'_>) -> Option<String> {
    let of_runs = input.runs.iter().filter_map(|run| run.run.evaluation.metrics.get("energy_gap"));
    let gaps = of_runs.flat_map(|metric| metric.per_frame.iter().flatten().copied());
    // images that show nothing fit everything alike
    let gaps: Vec<f64> = gaps.filter(|gap| *gap != 0.0).collect();
    let preferred = gaps.iter().filter(|gap| **gap > 0.0).count();
    let share = (!gaps.is_empty()).then(|| preferred as f64 / gaps.len() as f64)?;
    Some(if share >= 0.5 {
        format!(
            "In {} of the frames the images fit the estimate better than they fit the true pose: what error remains is \
             mostly the likelihood's and the body model's, and a longer search would not remove it.",
            percent(share)
        )
    } else {
        format!(
            "In {} of the frames the images fit the true pose better than the estimate: the search stopped short of it, \
             and more particles or layers may help.",
            percent(1.0 - share)
        )
    })
}

/// A share as a whole percentage; never 0 % for something nor 100 % for less than everything.
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
    use crate::report::fixture::{Story, told};

    #[test]
    fn a_run_that_follows_is_good_and_says_how_sure_it_is() {
        let verdict = told(&Story { seeds: 3, ..Story::default() }, verdict);
        assert_eq!(verdict.level, "good");
        assert!(verdict.line.starts_with("The tracker follows the body through the whole clip; its markers are "));
        assert!(verdict.line.contains("95 % interval") && verdict.line.ends_with("over 3 seeds)."), "{}", verdict.line);
    }

    #[test]
    fn one_seed_has_no_interval_and_a_lost_body_is_bad() {
        let verdict = told(&Story { seeds: 1, lost_from: Some(60), ..Story::default() }, verdict);
        assert_eq!(verdict.level, "bad");
        assert!(verdict.line.contains("loses the body in 5") && verdict.line.contains("one seed, so no interval"));
    }

    #[test]
    fn the_sign_of_the_gap_says_who_is_at_fault() {
        for (gap, words) in [(0.1, "In 100 % of the frames the images fit the estimate"), (-0.1, "the search stopped")]
        {
            let verdict = told(&Story { gap, ..Story::default() }, verdict);
            assert!(verdict.cause.is_some_and(|cause| cause.contains(words)));
        }
    }

    #[test]
    fn images_that_show_nothing_accuse_nobody() {
        assert_eq!(told(&Story { gap: 0.0, ..Story::default() }, verdict).cause, None);
    }

    #[test]
    fn small_shares_are_not_rounded_away() {
        assert_eq!([0.0, 0.001, 0.5, 0.999, 1.0].map(percent), ["0 %", "under 1 %", "50 %", "over 99 %", "100 %"]);
    }
}
