//! What a metric is, and the list of all of them.

use serde::{Deserialize, Serialize};

use super::{
    Sequence, ValueRange, balance, contact_f1, derivatives, energy_gap, foot_skate, ground_gap, humaneva, lag,
    limb_swaps, mpjpe, orientation, pck, procrustes, prop_penetration, self_penetration, silhouette, track_loss,
};

/// One way to compare an estimate with the truth.
#[derive(Clone, Copy, Debug)]
pub struct Metric {
    /// Name in files, with its unit where it has one: `humaneva_mm`.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// Unit of every value.
    pub unit: Unit,
    /// Which values are good.
    pub direction: Direction,
    /// Joint set, alignment and mask rule. `{contact_rule}`, `{gravity}` and `{friction}` stand for numbers that other rooms
    /// decide; they are filled in where a value gets its protocol.
    pub protocol: &'static str,
    /// The measurement; `None` where the sequence lacks what it needs.
    pub measure: fn(&Sequence<'_>) -> Option<Measurement>,
}

impl Metric {
    /// Which values it can take.
    pub fn value_range(&self) -> ValueRange {
        match (self.unit, self.direction) {
            (Unit::Fraction, _) => ValueRange::Share,
            (_, Direction::Neither) => ValueRange::Any,
            _ => ValueRange::NonNegative,
        }
    }

    /// Whether `value` is worse than `other`; never for a diagnosis.
    pub fn is_worse(&self, value: f64, other: f64) -> bool {
        match self.direction {
            Direction::LowerIsBetter => value > other,
            Direction::HigherIsBetter => value < other,
            Direction::Neither => false,
        }
    }
}

/// What a metric found in one sequence.
#[derive(Clone, Debug, PartialEq)]
pub enum Measurement {
    /// One value a frame (`None`: left out or not measurable); its mean is the mean of the frames.
    PerFrame(Vec<Option<f64>>),
    /// One value a frame, and a mean that weighs every joint of every frame alike.
    Pooled {
        /// One value a frame.
        per_frame: Vec<Option<f64>>,
        /// Mean over all joints of all frames.
        mean: f64,
    },
    /// One value for the whole sequence.
    Whole(f64),
}

/// Which way a metric is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// An error.
    LowerIsBetter,
    /// A score.
    HigherIsBetter,
    /// Neither: a diagnosis.
    Neither,
}

/// Unit of a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetre,
    /// Degrees.
    #[serde(rename = "deg")]
    Degree,
    /// A share between 0 and 1.
    #[serde(rename = "fraction")]
    Fraction,
    /// Millimetres a second.
    #[serde(rename = "mm/s")]
    MillimetrePerSecond,
    /// Metres a second squared.
    #[serde(rename = "m/s^2")]
    MetrePerSecondSquared,
    /// Metres a second cubed.
    #[serde(rename = "m/s^3")]
    MetrePerSecondCubed,
    /// Seconds.
    #[serde(rename = "s")]
    Second,
    /// Weights of the body.
    #[serde(rename = "body weights")]
    BodyWeight,
    /// Milliseconds.
    #[serde(rename = "ms")]
    Millisecond,
    /// The likelihood's energy, without unit.
    #[serde(rename = "energy")]
    Energy,
}

impl Unit {
    /// Symbol for people.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Degree => "°",
            Self::Fraction | Self::Energy => "",
            Self::MillimetrePerSecond => "mm/s",
            Self::MetrePerSecondSquared => "m/s²",
            Self::MetrePerSecondCubed => "m/s³",
            Self::Second => "s",
            Self::Millisecond => "ms",
            Self::BodyWeight => "body weights",
        }
    }
}

/// Every metric, in the order in which tables show them. A new metric is a file, a line here, a test and a row in the docs.
pub const METRICS: &[Metric] = &[
    humaneva::ABSOLUTE,
    humaneva::RELATIVE,
    mpjpe::ABSOLUTE,
    mpjpe::ROOT_RELATIVE,
    procrustes::ALIGNED,
    orientation::BODY,
    orientation::HEADING,
    silhouette::ALL_VIEWS,
    silhouette::WORST_VIEW,
    pck::PCK,
    pck::AUC,
    track_loss::FRACTION,
    track_loss::TIME_TO_LOSS,
    track_loss::RECOVERY,
    energy_gap::GAP,
    derivatives::VELOCITY,
    derivatives::ACCELERATION,
    derivatives::JITTER,
    lag::LAG,
    lag::LAG_CORRECTED,
    limb_swaps::SHARE,
    contact_f1::F1,
    foot_skate::SKATE,
    foot_skate::TRUE_SKATE,
    foot_skate::SLIP,
    foot_skate::TRUE_SLIP,
    foot_skate::PER_FRAME,
    foot_skate::RATIO,
    ground_gap::PENETRATION,
    ground_gap::TRUE_PENETRATION,
    ground_gap::FLOAT,
    ground_gap::TRUE_FLOAT,
    prop_penetration::DEPTH,
    prop_penetration::TRUE_DEPTH,
    self_penetration::DEPTH,
    self_penetration::TRUE_DEPTH,
    balance::UNBALANCED,
    balance::TRUE_UNBALANCED,
    balance::RESIDUAL,
    balance::TRUE_RESIDUAL,
    balance::VIOLATIONS,
    balance::TRUE_VIOLATIONS,
];

/// The metric of that name.
pub fn find_metric(name: &str) -> Option<&'static Metric> {
    METRICS.iter().find(|metric| metric.name == name)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_readme_has_every_metric() {
        let readme = include_str!("../../README.md");
        for name in super::METRICS.iter().map(|metric| metric.name) {
            // what is said of the actor is said once for all
            let told = name.strip_prefix("truth_").unwrap_or(name);
            assert!(readme.contains(&format!("`{told}`")), "README.md has no row for {name}");
        }
    }

    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn worse_is_higher_for_an_error_lower_for_a_score_and_never_for_a_diagnosis() {
        let is_worse = |name: &str, value: f64, other: f64| find_metric(name).unwrap().is_worse(value, other);
        assert!(is_worse("humaneva_mm", 2.0, 1.0) && !is_worse("humaneva_mm", 1.0, 1.0));
        assert!(is_worse("pck150", 0.5, 0.6) && !is_worse("pck150", 0.6, 0.5));
        assert!(!is_worse("lag_ms", 9.0, 0.0) && !is_worse("lag_ms", -9.0, 0.0));
    }

    #[test]
    fn names_are_unique_and_carry_their_unit() {
        let names: BTreeSet<&str> = METRICS.iter().map(|m| m.name).collect();
        assert_eq!(names.len(), METRICS.len());
        for metric in METRICS {
            let suffix = match metric.unit {
                Unit::Millimetre => "_mm",
                Unit::Degree => "_deg",
                Unit::MillimetrePerSecond => "_mm_per_s",
                Unit::MetrePerSecondSquared => "_m_per_s2",
                Unit::MetrePerSecondCubed => "_m_per_s3",
                Unit::Second => "_s",
                Unit::Millisecond => "_ms",
                Unit::BodyWeight => "_body_weights",
                Unit::Fraction | Unit::Energy => "",
            };
            assert!(metric.name.ends_with(suffix), "{} should end in {suffix}", metric.name);
        }
    }
}
