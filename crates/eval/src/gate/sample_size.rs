//! How many seeds a comparison needs, planned from a pilot before the seeds are run.

use serde::Serialize;
use statrs::distribution::{ChiSquared, Continuous, ContinuousCDF, Normal};

use super::more_seeds::ClipVariance;
use super::{FEWEST_SEEDS, Margin, MarginError};
use crate::comparison::MeasuredRuns;
use crate::student::student_quantile;
use crate::{FEWEST_RUNS, Unit, find_metric, mean};

const MOST_SEEDS: usize = 1000;
/// Probability that the true spread lies below the upper limit of the pilot's.
const SPREAD_CONFIDENCE: f64 = 0.8;
/// Intervals of Simpson's rule over the distribution of the spread.
const STEPS: u32 = 400;

/// The statement that the runs are to support.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PlannedTest {
    /// The gate's: not worse by the margin or more.
    NotWorse,
    /// Neither better nor worse by the margin or more (`[Schuirmann 1987]`).
    Equivalent,
}

/// Why no number of seeds can be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanRefusal {
    /// No such metric.
    #[error("there is no metric `{0}`; skiagraph baseline show lists those of a baseline")]
    Metric(String),
    /// The pilot has no values of the metric.
    #[error("the pilot has no value of {0}")]
    NoValues(String),
    /// Too few seeds to know the spread.
    #[error(
        "`{clip}` has {found} seed(s) with a value; a pilot needs at least {FEWEST_RUNS}, and {FEWEST_SEEDS} are usual"
    )]
    Seeds {
        /// The clip.
        clip: String,
        /// Its number of seeds.
        found: usize,
    },
    /// The tracker draws no random numbers.
    #[error(
        "all seeds of the pilot have the same value, so more seeds tell nothing: the tracker draws no random numbers. \
         Compare over draws of the noise (observation.seed) or over clips; see skiagraph gate --help"
    )]
    Copies,
    /// The margin does not fit the metric.
    #[error(transparent)]
    Margin(#[from] MarginError),
    /// The margin is zero.
    #[error("margin 0: expected more than 0; no number of seeds shows that two trackers differ by nothing")]
    ZeroMargin,
}

/// The spread of a pilot's runs, and a margin for their mean.
#[derive(Clone, Debug)]
pub struct SamplePlan {
    clips: Vec<ClipVariance>,
    /// Mean of the metric over clips of their means over seeds.
    pub mean: f64,
    /// Unit of all values.
    pub unit: Unit,
    /// The margin in the metric's unit.
    pub margin: f64,
}

impl SamplePlan {
    /// The plan for a metric of a pilot. Draws of a clip's noise are left out: seeds vary within one set.
    ///
    /// # Errors
    /// [`PlanRefusal`] if the metric, the pilot's spread or the margin does not allow a plan.
    pub fn new(pilot: &MeasuredRuns, metric: &str, margin: Margin) -> Result<Self, PlanRefusal> {
        let unit = find_metric(metric).ok_or_else(|| PlanRefusal::Metric(metric.to_owned()))?.unit;
        let (mut clips, mut means, mut all_equal) = (Vec::new(), Vec::new(), true);
        for (name, clip) in &pilot.clips {
            let values = clip.values(metric);
            if values.is_empty() {
                continue;
            }
            all_equal &= values.windows(2).all(|pair| pair[0].1 == pair[1].1);
            let spread = ClipVariance::from_values(&values).filter(|_| values.len() >= FEWEST_RUNS);
            clips.push(spread.ok_or_else(|| PlanRefusal::Seeds { clip: name.clone(), found: values.len() })?);
            means.extend(mean(&values.iter().map(|(_, value)| *value).collect::<Vec<_>>()));
        }
        let mean = mean(&means).ok_or_else(|| PlanRefusal::NoValues(metric.to_owned()))?;
        let margin = margin.resolve(metric, unit, mean)?;
        if all_equal {
            return Err(PlanRefusal::Copies);
        }
        if margin == 0.0 {
            return Err(PlanRefusal::ZeroMargin);
        }
        Ok(Self { clips, mean, unit, margin })
    }

    /// Number of clips.
    pub fn clips(&self) -> usize {
        self.clips.len()
    }

    /// Standard deviation over seeds: root mean square over clips.
    pub fn deviation(&self) -> f64 {
        mean(&self.clips.iter().map(|clip| clip.variance).collect::<Vec<_>>()).unwrap_or_default().sqrt()
    }

    /// Upper 80 % limit of the standard deviation, as a factor of [`Self::deviation`]: the pilot is small.
    pub fn upper_factor(&self) -> Option<f64> {
        let sum: f64 = self.clips.iter().map(|clip| clip.variance).sum();
        let squares = self.clips.iter().map(|clip| clip.variance * clip.variance / (clip.seeds - 1) as f64);
        let freedom = sum * sum / squares.sum::<f64>();
        let low = ChiSquared::new(freedom).ok()?.inverse_cdf(1.0 - SPREAD_CONFIDENCE);
        Some((freedom / low).sqrt())
    }

    /// The probability that `seeds` runs a side of every clip support the statement if the trackers do not differ and
    /// their standard deviation is the pilot's times `factor`. Both sides have the same seeds, so the test is that of
    /// their pairs; the two errors of a pair vary independently.
    pub fn power(&self, test: PlannedTest, seeds: usize, factor: f64) -> Option<f64> {
        let squares = || self.clips.iter().map(|clip| clip.variance * factor * factor / seeds as f64);
        let sum: f64 = squares().sum();
        let error = (2.0 * sum).sqrt() / self.clips.len() as f64;
        let rest = seeds.checked_sub(1).filter(|rest| *rest > 0)? as f64;
        // n - 1 for the pairs of one clip (Satterthwaite for several), as in the gate
        let freedom = rest * sum * sum / squares().map(|square| square * square).sum::<f64>();
        probability(test, self.margin / error, student_quantile(freedom)?, freedom)
    }

    /// The least number of seeds a side with at least this power; `None` if a thousand do not suffice.
    pub fn seeds_for(&self, test: PlannedTest, power: f64, factor: f64) -> Option<usize> {
        let suffices = |seeds: usize| self.power(test, seeds, factor).is_some_and(|found| found >= power);
        if !suffices(MOST_SEEDS) {
            return None;
        }
        let (mut low, mut high) = (1, MOST_SEEDS);
        while high - low > 1 {
            let middle = (low + high) / 2;
            if suffices(middle) { high = middle } else { low = middle }
        }
        Some(high.max(FEWEST_SEEDS))
    }
}

/// The probability that an interval of half width `t r` (in standard errors, `r^2` chi-squared over its `freedom`)
/// around a normal deviate leaves out `distance`, or both `distance` and its negative: the noncentral t distribution
/// and its two-sided form, by Simpson's rule over `r`.
fn probability(test: PlannedTest, distance: f64, t: f64, freedom: f64) -> Option<f64> {
    let (normal, spread) = (Normal::standard(), ChiSquared::new(freedom).ok()?);
    // in r, whose density is smooth also for few degrees of freedom
    let far = 8.0 / (2.0 * freedom).sqrt();
    let (low, high) = ((1.0 - far).max(0.0), 1.0 + far);
    let width = (high - low) / f64::from(STEPS);
    let value = |r: f64| {
        let above = normal.cdf(distance - t * r);
        let chance = match test {
            PlannedTest::NotWorse => above,
            PlannedTest::Equivalent => (2.0 * above - 1.0).max(0.0),
        };
        // the density itself overflows from some 120 degrees of freedom on
        chance * libm::exp(spread.ln_pdf(freedom * r * r)) * 2.0 * freedom * r
    };
    let weight = |step: u32| match step {
        0 | STEPS => 1.0,
        step if step % 2 == 1 => 4.0,
        _ => 2.0,
    };
    // the density at 0 is 0, or infinite times 0
    let first = u32::from(low == 0.0);
    let sum: f64 = (first..=STEPS).map(|step| weight(step) * value(low + width * f64::from(step))).sum();
    Some((sum * width / 3.0).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::super::comparison::fixture::clip;
    use super::super::{GateRules, GateVerdict, gate};
    use super::*;
    use crate::DifferenceRule;
    use crate::comparison::Rate;
    use crate::gate::equivalence;
    use skiagraph_core::rng::{Purpose, normal, stream};

    fn pilot(errors: &[f64]) -> MeasuredRuns {
        MeasuredRuns { clips: [("walk".to_owned(), clip("a", 0, errors))].into(), ..MeasuredRuns::default() }
    }

    fn plan(errors: &[f64], margin: &str) -> Result<SamplePlan, PlanRefusal> {
        SamplePlan::new(&pilot(errors), "humaneva_mm", margin.parse().unwrap())
    }

    const ERRORS: [f64; 5] = [30.0, 33.0, 31.5, 28.5, 32.0];

    /// For many seeds Student's t is normal, and the number is that of the textbook (`[Chow 2008]`, section 3.2):
    /// n = 2 s^2 (z_a + z_b)^2 / d^2, with b / 2 for equivalence.
    #[test]
    fn many_seeds_agree_with_the_normal_formula() {
        let plan = plan(&ERRORS, "0.3mm").unwrap();
        let ratio = plan.deviation() / 0.3;
        for (test, z) in [(PlannedTest::NotWorse, 0.841_621), (PlannedTest::Equivalent, 1.281_552)] {
            let expected = 2.0 * ratio * ratio * f64::powi(1.959_964 + z, 2);
            let found = plan.seeds_for(test, 0.8, 1.0).unwrap() as f64;
            assert!((0.0..3.0).contains(&(found - expected)), "{test:?}: {found} {expected}");
        }
    }

    #[test]
    fn the_power_of_a_hundred_and_of_two_hundred_seeds_is_a_number_between_its_neighbours() {
        let plan = plan(&ERRORS, "0.3mm").unwrap();
        let powers: Vec<f64> = (1..13).map(|tens| plan.power(PlannedTest::NotWorse, 20 * tens, 1.0).unwrap()).collect();
        assert!(powers.windows(2).all(|pair| pair[0] < pair[1]), "{powers:?}");
    }

    /// The gate pairs equal seeds, but the plan had the degrees of freedom of separate ones: 46, 80 and 94 % were
    /// promised for 5, 10 and 15 seeds, and 37, 75 and 92 % of the gates passed.
    #[test]
    fn the_gate_passes_as_often_as_planned() {
        const PAIRS: usize = 500;
        let page = include_str!("../../../../docs/rig.md");
        // a standard deviation of 1.5 mm
        let errors = [28.5, 28.5, 30.0, 31.5, 31.5];
        let rules = GateRules::from_metric("humaneva_mm", "2mm".parse().unwrap());
        let mut rows = String::new();
        for (clips, seeds) in [(1, 5), (1, 10), (1, 15), (1, 20), (3, 5), (3, 10)] {
            let mut runs = MeasuredRuns::default();
            (0..clips).for_each(|number| drop(runs.clips.insert(number.to_string(), clip("a", 0, &errors))));
            let plan = SamplePlan::new(&runs, "humaneva_mm", "2mm".parse().unwrap()).unwrap();
            let mut rng = stream(seeds as u64, Purpose::Oracle, 0, 0, clips);
            let mut passes = [0; 2];
            for _ in 0..PAIRS {
                let mut side = || {
                    let mut runs = MeasuredRuns::default();
                    for number in 0..clips {
                        let errors: Vec<f64> = (0..seeds).map(|_| 30.0 + 1.5 * normal(&mut rng)).collect();
                        runs.clips.insert(number.to_string(), clip(&format!("{number}"), 0, &errors));
                    }
                    runs
                };
                let found = gate(&side(), &side(), &rules).unwrap();
                let paired = found.checks[0].difference.as_ref().unwrap();
                assert_eq!(paired.rule, DifferenceRule::PairedT);
                passes[0] += usize::from(found.verdict == GateVerdict::Pass);
                passes[1] += usize::from(equivalence(paired, 2.0) == GateVerdict::Pass);
            }
            let mut row = format!("| {clips} x {seeds} |");
            for (test, passes) in [PlannedTest::NotWorse, PlannedTest::Equivalent].into_iter().zip(passes) {
                let planned = plan.power(test, seeds, 1.0).unwrap();
                let Rate { share, ci95, .. } = Rate::new(passes, PAIRS).unwrap();
                let measured = [share, ci95.low, ci95.high].map(|share| format!("{:.1}", 100.0 * share));
                let [share, low, high] = measured;
                row += &format!(" {:.1} % | {share} % ({low} to {high}) |", 100.0 * planned);
                assert!((ci95.low..=ci95.high).contains(&planned), "{row}");
            }
            rows += &format!("{row}\n");
        }
        assert!(page.contains(&rows), "docs/rig.md:\n{rows}");
    }

    #[test]
    fn more_seeds_less_spread_and_wider_margins_raise_the_power_and_two_clips_count_together() {
        let one = plan(&ERRORS, "2mm").unwrap();
        let power = |seeds, factor| one.power(PlannedTest::NotWorse, seeds, factor).unwrap();
        assert!(power(6, 1.0) < power(12, 1.0) && power(12, 1.3) < power(12, 1.0));
        assert!(power(12, 1.0) < plan(&ERRORS, "3mm").unwrap().power(PlannedTest::NotWorse, 12, 1.0).unwrap());
        let mut both = pilot(&ERRORS);
        both.clips.insert("run".to_owned(), clip("b", 0, &ERRORS));
        let two = SamplePlan::new(&both, "humaneva_mm", "2mm".parse().unwrap()).unwrap();
        let needed = |plan: &SamplePlan| plan.seeds_for(PlannedTest::NotWorse, 0.9, 1.0).unwrap();
        assert!(needed(&two) < needed(&one) && two.upper_factor() < one.upper_factor());
        assert_eq!(plan(&ERRORS, "0.001mm").unwrap().seeds_for(PlannedTest::NotWorse, 0.8, 1.0), None);
    }

    /// `scipy.stats.chi2.ppf(0.2, 4) = 1.6488`; the square root of 4 / 1.6488 is 1.5576.
    #[test]
    fn the_upper_limit_of_the_spread_of_five_seeds_is_half_again() {
        let factor = plan(&ERRORS, "2mm").unwrap().upper_factor().unwrap();
        assert!((factor - 1.5576).abs() < 1e-3, "{factor}");
    }

    #[test]
    fn a_pilot_that_tells_nothing_is_refused_with_the_reason() {
        let refused = |errors: &[f64], margin| plan(errors, margin).unwrap_err().to_string();
        assert!(refused(&[30.0, 31.0], "2mm").contains("`walk` has 2 seed(s)"));
        assert!(refused(&[30.0; 5], "2mm").contains("draws no random numbers"));
        assert!(refused(&ERRORS, "0mm").starts_with("margin 0: expected more"));
        assert!(refused(&ERRORS, "2deg").contains("expected mm"));
        assert!(refused(&[f64::NAN; 5], "2mm").contains("no value of humaneva_mm"));
        let unknown = SamplePlan::new(&pilot(&ERRORS), "nothing", "2mm".parse().unwrap()).unwrap_err();
        assert!(unknown.to_string().contains("no metric `nothing`"));
    }
}
