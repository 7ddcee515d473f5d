//! Selects the settings that a page shows: all of a small sweep; for a large one, the best and the worst in the table,
//! and in plots a selection spaced evenly from the best to the worst. A page with 100,000 settings would be too large
//! to open.

use crate::evaluation::Metric;
use crate::sweep::summary::{SettingSummary, badness, best_first};

/// Maximum number of settings with a row.
const ROWS: usize = 2000;
/// Maximum number of dots in a plot.
const DOTS: usize = 2000;
/// Maximum number of links to cells in all rows.
const CELLS: usize = 20_000;
/// Maximum number of values of an axis with their means.
const MEANS: usize = 100;

/// Settings with a row, in order.
pub(super) struct ShownRows {
    pub(super) settings: Vec<usize>,
    /// The numbers of best settings, which come first, and of worst settings; `None` if all settings have a row, in the
    /// order of the plan.
    pub(super) ends: Option<[usize; 2]>,
}

/// The settings of a table.
pub(super) fn rows(points: &[SettingSummary], metric: &Metric) -> ShownRows {
    if points.len() <= ROWS {
        return ShownRows { settings: (0..points.len()).collect(), ends: None };
    }
    let known = best_first(points, |mean| badness(mean, metric));
    let (best, worst) = (known.len().min(ROWS / 2), known.len().saturating_sub(ROWS / 2).min(ROWS / 2));
    let settings = known[..best].iter().chain(&known[known.len() - worst..]).copied().collect();
    ShownRows { settings, ends: Some([best, worst]) }
}

/// The number of cells that each row links to, for this number of rows.
pub(super) fn cells_per_row(rows: usize) -> usize {
    (CELLS / rows.max(1)).max(1)
}

/// The settings that a plot draws, in the order of the plan.
pub(super) fn dots(
    points: &[SettingSummary],
    metric: &Metric,
    is_drawn: impl Fn(&SettingSummary) -> bool,
) -> Vec<usize> {
    let mut known = best_first(points, |mean| badness(mean, metric));
    known.retain(|at| is_drawn(&points[*at]));
    let mut chosen = evenly(&known, DOTS);
    chosen.sort_unstable();
    chosen
}

/// The settings of a Pareto front that a plot draws.
pub(super) fn front(front: &[usize]) -> Vec<usize> {
    evenly(front, DOTS)
}

/// The number of dots in a plot of this many settings, if it leaves some out.
pub(super) fn thinned(settings: usize) -> Option<usize> {
    (settings > DOTS).then_some(DOTS)
}

/// A list of values and means; the middle of a long list is left out.
pub(super) fn means(words: &[String], between: &str) -> String {
    if words.len() <= MEANS {
        return words.join(between);
    }
    let left_out = format!("… {} more …", words.len() - MEANS);
    let (first, last) = (&words[..MEANS / 2], &words[words.len() - MEANS / 2..]);
    [first, &[left_out], last].concat().join(between)
}

/// At most `most` elements of a list, evenly spaced, including the first and the last.
fn evenly(all: &[usize], most: usize) -> Vec<usize> {
    if all.len() <= most {
        return all.to_vec();
    }
    (0..most).map(|at| all[at * (all.len() - 1) / (most - 1)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::find_metric;

    fn points(count: usize) -> Vec<SettingSummary> {
        let mean = |at: usize| Some(((at * 7919) % count) as f64);
        (0..count).map(|at| SettingSummary { mean: mean(at), ..SettingSummary::default() }).collect()
    }

    #[test]
    fn a_large_sweep_shows_its_best_and_worst_and_a_small_one_all_as_planned() {
        let error = find_metric("humaneva_mm").unwrap();
        let small = rows(&points(ROWS), error);
        assert!(small.ends.is_none() && small.settings == (0..ROWS).collect::<Vec<_>>());
        let many = points(10_007);
        let found = rows(&many, error);
        assert_eq!(found.ends, Some([ROWS / 2; 2]));
        let means: Vec<f64> = found.settings.iter().map(|at| many[*at].mean.unwrap()).collect();
        assert_eq!((means[0], means[ROWS / 2 - 1], means[ROWS / 2]), (0.0, 999.0, 9007.0));
        assert_eq!((means.len(), means[ROWS - 1]), (ROWS, 10_006.0));
        let drawn = dots(&many, error, |_| true);
        assert!(drawn.len() == DOTS && drawn.is_sorted());
        assert!([0.0, 10_006.0].iter().all(|end| drawn.iter().any(|at| many[*at].mean == Some(*end))));
    }

    #[test]
    fn the_ends_of_a_long_list_of_means_are_kept() {
        let words: Vec<String> = (0..500).map(|value| value.to_string()).collect();
        let shown = means(&words, ", ");
        assert!(shown.starts_with("0, 1, ") && shown.contains("49, … 400 more …, 450") && shown.ends_with(", 499"));
        assert_eq!(means(&words[..3], " · "), "0 · 1 · 2");
    }
}
