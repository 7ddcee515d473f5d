//! The definition of a metric.

use serde::{Deserialize, Serialize};

use super::{Sequence, ValueRange};

/// One way to compare an estimate with the truth.
#[derive(Clone, Copy, Debug)]
pub struct Metric {
    /// Name in files, with its unit if it has one: `humaneva_mm`.
    pub name: &'static str,
    /// Display name.
    pub title: &'static str,
    /// What its value says, in one plain sentence without a full stop. For `truth_...`, it is said of the actor.
    pub meaning: &'static str,
    /// Unit of every value.
    pub unit: Unit,
    /// Which direction is better.
    pub direction: Direction,
    /// The inputs that it needs: a phrase that follows "needs".
    pub needs: &'static str,
    /// Joint set, alignment and mask rule. `{contact_rule}`, `{gravity}`, `{friction}` and `{likelihood}` are
    /// placeholders for constants of other modules, filled in with each value.
    pub protocol: &'static str,
    /// The measurement; `None` if the sequence lacks an input.
    pub measure: fn(&Sequence<'_>) -> Option<Measurement>,
}

impl Metric {
    /// The values that it can take.
    pub fn value_range(&self) -> ValueRange {
        match (self.unit, self.direction) {
            (Unit::Fraction, _) => ValueRange::Share,
            (_, Direction::Neither) => ValueRange::Any,
            _ => ValueRange::NonNegative,
        }
    }

    /// Whether `value` is worse than `other` by more than round-off; never for a diagnosis.
    pub fn is_worse(&self, value: f64, other: f64) -> bool {
        match self.direction {
            Direction::LowerIsBetter => change(other, value) > 0.0,
            Direction::HigherIsBetter => change(other, value) < 0.0,
            Direction::Neither => false,
        }
    }
}

/// Relative difference that another order of summation may cause.
const ROUND_OFF: f64 = 1e-9;

/// `to - from`; 0 if they differ by no more than round-off.
pub(super) fn change(from: f64, to: f64) -> f64 {
    let difference = to - from;
    if difference.abs() <= ROUND_OFF * from.abs().max(to.abs()) { 0.0 } else { difference }
}

/// The result of a metric for one sequence.
#[derive(Clone, Debug, PartialEq)]
pub enum Measurement {
    /// One value per frame (`None`: left out or not measurable); the mean is that of the frames.
    PerFrame(Vec<Option<f64>>),
    /// One value per frame, and a mean with equal weights for all joints of all frames.
    Pooled {
        /// One value per frame.
        per_frame: Vec<Option<f64>>,
        /// Mean over all joints of all frames.
        mean: f64,
    },
    /// One value for the whole sequence.
    Whole(f64),
}

/// Whether lower or higher values are better.
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
    /// Pixels.
    #[serde(rename = "px")]
    Pixel,
    /// Degrees.
    #[serde(rename = "deg")]
    Degree,
    /// A share between 0 and 1.
    #[serde(rename = "fraction")]
    Fraction,
    /// Millimetres per second.
    #[serde(rename = "mm/s")]
    MillimetrePerSecond,
    /// Metres per second squared.
    #[serde(rename = "m/s^2")]
    MetrePerSecondSquared,
    /// Metres per second cubed.
    #[serde(rename = "m/s^3")]
    MetrePerSecondCubed,
    /// Seconds.
    #[serde(rename = "s")]
    Second,
    /// Body weights, of runs of earlier versions.
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
    /// Displayed symbol.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Pixel => "px",
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
