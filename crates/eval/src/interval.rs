//! 95 % intervals of a mean over runs, and the cases without an interval.
//!
//! The unit is the run (one clip, one seed), never the frame: frames of one run are correlated, and an interval over
//! them would be several times too narrow. Seeds vary within their clip; the clips are fixed, so the interval covers
//! these clips only.
//!
//! The choice of rules is based on a simulation of coverage (`results/intervals.md`).

use std::fmt;

use serde::{Deserialize, Serialize};

use super::student::{student, student_on_logs};

/// Least number of runs for an interval.
pub const FEWEST_RUNS: usize = 3;

/// A two-sided 95 % interval, written `[low, high]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl From<[f64; 2]> for Interval {
    fn from([low, high]: [f64; 2]) -> Self {
        Self { low, high }
    }
}

impl From<Interval> for [f64; 2] {
    fn from(interval: Interval) -> Self {
        [interval.low, interval.high]
    }
}

/// The values that a quantity can take. An interval never extends beyond them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueRange {
    /// Any number.
    Any,
    /// An error: 0 or more.
    NonNegative,
    /// A share: 0 to 1.
    Share,
}

/// How an interval was computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntervalRule {
    /// Student's t interval; over several clips with the degrees of freedom of `[Welch 1938]` and `[Satterthwaite
    /// 1946]`.
    Student,
    /// Student's t interval on a logarithmic scale, about the arithmetic mean, with the greater of two standard errors:
    /// that of Student's interval, and that of the modified Cox interval (`[Olsson 2005]`) of the mean of log-normal
    /// values. It is an interval of the mean; exponentials of a t interval of the logarithms would be one of the
    /// median.
    StudentOnLogs,
}

impl fmt::Display for IntervalRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Student => "Student's t",
            Self::StudentOnLogs => "Student's t on log errors",
        })
    }
}

/// 95 % interval of the mean over clips of each clip's mean over seeds, and its rule; `clips[c]` holds the values of
/// the runs of clip `c`. `None` for fewer than [`FEWEST_RUNS`] runs, if a clip has a single run, and if the runs of
/// every clip are equal: an interval of zero width would claim more than, for example, three seeds without a lost frame
/// show.
///
/// The interval is Student's t, on a logarithmic scale for errors that are all above 0.
pub fn mean_interval(clips: &[Vec<f64>], range: ValueRange) -> Option<(Interval, IntervalRule)> {
    let fewest = clips.iter().map(Vec::len).min()?;
    let runs: usize = clips.iter().map(Vec::len).sum();
    if fewest < 2 || runs < FEWEST_RUNS || are_equal(clips) {
        return None;
    }
    let is_error = range == ValueRange::NonNegative && clips.iter().flatten().all(|value| *value > 0.0);
    let (ends, rule) = if is_error {
        (student_on_logs(clips)?, IntervalRule::StudentOnLogs)
    } else {
        (student(clips)?, IntervalRule::Student)
    };
    Some((range.hold(ends.into()), rule))
}

impl ValueRange {
    fn hold(self, Interval { low, high }: Interval) -> Interval {
        let (least, greatest) = match self {
            Self::Any => return Interval { low, high },
            Self::NonNegative => (0.0, f64::INFINITY),
            Self::Share => (0.0, 1.0),
        };
        Interval { low: low.max(least), high: high.min(greatest) }
    }
}

/// Whether the runs of every clip have equal values.
pub(super) fn are_equal(clips: &[Vec<f64>]) -> bool {
    clips.iter().all(|runs| runs.windows(2).all(|pair| pair[0] == pair[1]))
}

#[cfg(test)]
mod tests {
    use super::super::student::student_quantile;
    use super::*;
    use skiagraph_core::rng::{Purpose, normal, stream};

    fn ends(clips: &[Vec<f64>], range: ValueRange) -> [f64; 2] {
        mean_interval(clips, range).unwrap().0.into()
    }

    #[test]
    fn quantiles_of_students_t_agree_with_tables() {
        for (freedom, t) in
            [(1.0, 12.706_205), (2.0, 4.302_653), (4.0, 2.776_445), (9.0, 2.262_157), (1000.0, 1.962_339)]
        {
            assert!((student_quantile(freedom).unwrap() - t).abs() < 1e-6, "{freedom}");
        }
        assert!(student_quantile(1.5).unwrap() > 4.302_653 && student_quantile(1.5).unwrap() < 12.706_205);
    }

    #[test]
    fn fewer_than_three_runs_have_no_interval_nor_has_a_clip_of_one_run() {
        assert_eq!(mean_interval(&[], ValueRange::Any), None);
        assert_eq!(mean_interval(&[vec![1.0, 2.0]], ValueRange::Any), None);
        assert_eq!(mean_interval(&[vec![1.0, 2.0, 2.5], vec![3.0]], ValueRange::Any), None);
        assert!(mean_interval(&[vec![1.0, 2.0, 2.5]], ValueRange::Any).is_some());
        assert!(mean_interval(&[vec![1.0, 2.0], vec![3.0, 4.0]], ValueRange::Any).is_some());
    }

    #[test]
    fn three_runs_have_the_interval_of_the_textbook() {
        // mean 2, standard deviation 1, t = 4.302653: 2 +- 4.302653 / sqrt(3)
        let [low, high] = ends(&[vec![1.0, 2.0, 3.0]], ValueRange::Any);
        assert!((low - (2.0 - 2.484_138)).abs() < 1e-5 && (high - (2.0 + 2.484_138)).abs() < 1e-5, "{low} {high}");
    }

    #[test]
    fn an_interval_stays_within_the_range_of_the_quantity() {
        assert_eq!(ends(&[vec![0.0, 0.5, 1.0]], ValueRange::Share), [0.0, 1.0]);
        let [low, _] = ends(&[vec![0.0, 2.0, 30.0]], ValueRange::NonNegative);
        assert_eq!(low, 0.0);
        let [low, _] = ends(&[vec![1.0, 2.0, 30.0]], ValueRange::NonNegative);
        assert!(low > 0.0, "a logarithmic scale excludes zero");
    }

    #[test]
    fn the_interval_of_errors_is_the_one_computed_by_hand_and_a_run_near_zero_does_not_widen_it_without_bound() {
        // logarithms 0, 1, 2: v = 1, n = 3, (se / m)^2 = 1/3 + 1/4
        let e = std::f64::consts::E;
        let (runs, m) = (vec![1.0, e, e * e], (1.0 + e + e * e) / 3.0);
        let factor = (4.302_652_73_f64 * (7.0_f64 / 12.0).sqrt()).exp();
        let [low, high] = ends(&[runs], ValueRange::NonNegative);
        assert!((low - m / factor).abs() < 1e-6 && (high / (m * factor) - 1.0).abs() < 1e-6, "{low} {high}");
        let [low, high] = ends(&[vec![1e-200, 1.0, 1.2]], ValueRange::NonNegative);
        assert!(low > 0.02 && high < 30.0, "{low} {high}");
    }

    #[test]
    fn runs_that_are_equal_in_every_clip_have_no_interval() {
        // five seeds without a lost frame do not prove that there is none
        assert_eq!(mean_interval(&[vec![0.0; 5]], ValueRange::Share), None);
        assert_eq!(mean_interval(&[vec![10.0; 13], vec![20.0; 12]], ValueRange::NonNegative), None);
        assert!(mean_interval(&[vec![10.0; 3], vec![20.0, 21.0]], ValueRange::NonNegative).is_some());
    }

    #[test]
    fn clips_have_equal_weight_whatever_their_number_of_seeds() {
        for few in [2, 10] {
            let mut clips = [vec![10.0; 13], vec![20.0; few]];
            clips[1][0] += 1e-6;
            let [low, high] = ends(&clips, ValueRange::NonNegative);
            assert!((low - 15.0).abs() < 1e-4 && (high - 15.0).abs() < 1e-4, "{low} {high}");
        }
    }

    #[test]
    fn a_clip_that_never_varies_adds_no_degrees_of_freedom() {
        let [low, high] = ends(&[vec![1.0, 2.0, 3.0], vec![5.0; 9]], ValueRange::Any);
        assert!((high - low - 2.484_138).abs() < 1e-5, "half the width of the varying clip alone: {low} {high}");
    }

    #[test]
    fn intervals_of_three_and_ten_normal_runs_have_about_the_nominal_coverage() {
        for n in [3, 10] {
            let covered = (0..400).filter(|trial| {
                let mut rng = stream(*trial, Purpose::Oracle, 0, 0, n);
                let drawn = || 40.0 + 4.0 * normal(&mut rng);
                let runs: Vec<f64> = std::iter::repeat_with(drawn).take(n as usize).collect();
                let [low, high] = ends(&[runs], ValueRange::NonNegative);
                low <= 40.0 && 40.0 <= high
            });
            let share = covered.count() as f64 / 400.0;
            assert!((0.91..=0.98).contains(&share), "{n} runs: covered {share}");
        }
    }
}
