//! How many more seeds would decide an inconclusive gate.

use serde::Serialize;

use crate::comparison::{ClipValues, IntervalUnit};
use crate::mean;
use crate::statistics::variance;
use crate::student::student_quantile;

/// Greatest number of additional seeds that is computed.
const MOST: usize = 1000;

/// Additional seeds per clip that would exclude the margin from the interval, if difference and spread do not change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MoreSeeds {
    /// That many seeds of the run.
    OfRun(usize),
    /// That many seeds of both run and baseline.
    OfBoth(usize),
    /// More than a thousand: the difference is close to the margin.
    TooMany,
}

/// The least number of additional seeds for which half the 95 % interval of the difference would be shorter than
/// `distance`, the distance from the difference to the margin: of the run alone if that suffices, else of both sides.
/// Additional draws and clips are sets, so both sides need them.
pub(super) fn seeds_to_decide(
    clips: &[ClipValues],
    paired: bool,
    unit: IntervalUnit,
    distance: f64,
) -> Option<MoreSeeds> {
    let sides: Vec<[ClipVariance; 2]> = clips
        .iter()
        .map(|clip| Some([ClipVariance::from_values(&clip.base)?, ClipVariance::from_values(&clip.other)?]))
        .collect::<Option<_>>()?;
    let decided = |parts: &[ClipVariance]| half_width(parts, clips.len()).is_some_and(|half| half < distance);
    let more = |grown: &dyn Fn(&[ClipVariance; 2], usize) -> Vec<ClipVariance>| {
        (1..=MOST).find(|more| decided(&sides.iter().flat_map(|side| grown(side, *more)).collect::<Vec<_>>()))
    };
    let of_run = match unit {
        IntervalUnit::Seeds => more(&|[base, run], more| vec![*base, run.with(more)]),
        IntervalUnit::Draws | IntervalUnit::Clips => None,
    };
    let of_both = if paired {
        let pairs: Vec<ClipVariance> = clips.iter().map(ClipVariance::from_pairs).collect::<Option<_>>()?;
        (1..=MOST).find(|more| decided(&pairs.iter().map(|part| part.with(*more)).collect::<Vec<_>>()))
    } else {
        more(&|[base, run], more| vec![base.with(more), run.with(more)])
    };
    Some(match (of_run, of_both) {
        (Some(run), both) if both.is_none_or(|both| run <= 3 * both) => MoreSeeds::OfRun(run),
        (_, Some(both)) => MoreSeeds::OfBoth(both),
        _ => MoreSeeds::TooMany,
    })
}

/// Variance and number of the values of one side of one clip.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClipVariance {
    pub(super) variance: f64,
    pub(super) seeds: usize,
}

impl ClipVariance {
    pub(super) fn from_values(values: &[(u64, f64)]) -> Option<Self> {
        let values: Vec<f64> = values.iter().map(|(_, value)| *value).collect();
        Some(Self { variance: variance(&values)?, seeds: values.len() })
    }

    fn from_pairs(clip: &ClipValues) -> Option<Self> {
        let base = |seed: u64| clip.base.iter().find(|(s, _)| *s == seed).map(|(_, value)| *value);
        let pairs: Vec<f64> = clip.other.iter().filter_map(|(seed, value)| Some(value - base(*seed)?)).collect();
        mean(&pairs)?;
        Some(Self { variance: variance(&pairs)?, seeds: pairs.len() })
    }

    fn with(self, more: usize) -> Self {
        Self { seeds: self.seeds + more, ..self }
    }
}

/// `t se` of the mean over clips, with Welch-Satterthwaite degrees of freedom.
fn half_width(parts: &[ClipVariance], clips: usize) -> Option<f64> {
    let squares = || parts.iter().map(|part| part.variance / part.seeds as f64);
    let sum: f64 = squares().sum();
    let freedom = sum * sum / squares().zip(parts).map(|(e, part)| e * e / (part.seeds - 1) as f64).sum::<f64>();
    Some(student_quantile(freedom)? * sum.sqrt() / clips as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::difference;

    fn clip(seeds: usize, shift: f64, first: u64) -> ClipValues {
        let spread = |i: usize| [-3.0, 1.0, 3.0, -1.0, 0.0][i % 5];
        let base = (0..seeds).map(|i| (i as u64, 30.0 + spread(i)));
        let other = (0..seeds).map(|i| (first + i as u64, 30.0 + shift + spread(i * 2 + 1)));
        ClipValues { base: base.collect(), other: other.collect() }
    }

    fn decide(clip: &ClipValues, paired: bool, distance: f64) -> Option<MoreSeeds> {
        seeds_to_decide(std::slice::from_ref(clip), paired, IntervalUnit::Seeds, distance)
    }

    /// With that many more seeds of the same spread the interval is short enough, with one fewer it is not.
    #[test]
    fn the_number_of_additional_seeds_is_the_least_that_decides() {
        let few = clip(5, 0.0, 100);
        let Some(MoreSeeds::OfRun(more)) = decide(&few, false, 3.0) else { panic!("the run alone suffices") };
        let [base, run] =
            [ClipVariance::from_values(&few.base).unwrap(), ClipVariance::from_values(&few.other).unwrap()];
        let half = |more| half_width(&[base, run.with(more)], 1).unwrap();
        assert!(half(more) < 3.0 && half(more - 1) >= 3.0, "{more}: {}", half(more));
        let now = difference(&[few], false, IntervalUnit::Seeds).unwrap();
        let ends = now.ci95.unwrap();
        assert!((half(0) - 0.5 * (ends.high - ends.low)).abs() < 1e-9, "the same width as the interval itself");
    }

    #[test]
    fn both_sides_need_more_if_the_baseline_is_too_short_and_too_many_at_the_margin() {
        assert!(matches!(decide(&clip(5, 0.0, 100), false, 1.0), Some(MoreSeeds::OfBoth(_))));
        assert_eq!(decide(&clip(5, 0.0, 100), false, 0.01), Some(MoreSeeds::TooMany));
        assert!(matches!(decide(&clip(5, 0.0, 0), true, 1.0), Some(MoreSeeds::OfBoth(_))));
    }
}
