//! Trackers that answer only some frames: errors do not count the others.

use super::summary::SweepSummary;
use crate::report::WHOLE_COVERAGE;

/// A remark for every tracker that estimates less than most of the markers in some cell.
pub(super) fn remarks(summary: &SweepSummary, trackers: &[String]) -> Vec<String> {
    let of_tracker = |tracker: &String| {
        let cells = || summary.all_cells().filter(move |(setting, _)| setting.is_of(tracker));
        let covered = cells().filter_map(|(setting, cell)| Some((cell.coverage?, setting)));
        let partial: Vec<_> = covered.filter(|(coverage, _)| *coverage < WHOLE_COVERAGE).collect();
        let (least, worst) = partial.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(format!(
            "{tracker} estimates less than {:.0} % of the markers in {} of {} runs, least {:.1} % ({}). Frames without an \
             estimate count in no error.",
            100.0 * WHOLE_COVERAGE,
            partial.len(),
            cells().count(),
            100.0 * least,
            worst.words
        ))
    };
    trackers.iter().filter_map(of_tracker).collect()
}

/// The coverage in words; empty if it is whole.
pub(super) fn note(coverage: Option<f64>) -> Option<String> {
    coverage.filter(|coverage| *coverage < 0.9995).map(|coverage| format!("{:.1} % estimated", 100.0 * coverage))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::summary::{CellSummary, SettingSummary};

    #[test]
    fn a_tracker_that_skips_frames_is_named_with_its_worst_setting() {
        let setting = |method: &str, words: &str, coverages: &[f64]| SettingSummary {
            axes: [("method".to_owned(), method.into())].into_iter().collect(),
            words: words.to_owned(),
            cells: coverages.iter().map(|own| CellSummary { coverage: Some(*own), ..CellSummary::default() }).collect(),
            ..SettingSummary::default()
        };
        let settings =
            vec![setting("a", "x", &[1.0, 0.99]), setting("b", "y", &[0.5, 1.0]), setting("b", "z", &[0.02])];
        let summary = SweepSummary { settings, ..SweepSummary::default() };
        let found = remarks(&summary, &["a".to_owned(), "b".to_owned()]);
        assert_eq!(found.len(), 1);
        assert!(
            found[0].starts_with("b estimates less than 95 % of the markers in 2 of 3 runs, least 2.0 % (z)"),
            "{found:?}"
        );
        assert_eq!((note(Some(1.0)), note(Some(0.123)).as_deref()), (None, Some("12.3 % estimated")));
    }
}
