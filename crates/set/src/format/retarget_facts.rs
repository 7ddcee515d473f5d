//! How the recording was retargeted to the actor.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use skiagraph_truth::retarget::RetargetReport;

/// How well a recording fits the actor, in `truth/facts.toml`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RetargetFacts {
    /// Mean distance of the actor's landmarks from the recorded ones, over frames and landmarks of the first take.
    pub mean_residual_mm: f64,
    /// The same for every landmark.
    pub landmarks_mm: BTreeMap<String, f64>,
    /// Joint angles that reached a limit, with the number of frames.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub limits_hit: BTreeMap<String, usize>,
    /// Guesses and repairs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl RetargetFacts {
    /// From the report of a retargeting.
    pub fn new(report: &RetargetReport) -> Self {
        let rounded = |mm: f64| libm::round(1000.0 * mm) / 1000.0;
        let landmarks = report.landmarks.iter();
        let hits = report.limit_hits.iter();
        Self {
            mean_residual_mm: rounded(report.mean_residual_mm),
            landmarks_mm: landmarks.map(|own| (own.landmark.to_owned(), rounded(own.mean_mm))).collect(),
            limits_hit: hits.map(|own| (own.degree_of_freedom.clone(), own.lower_frames + own.upper_frames)).collect(),
            notes: report.notes.clone(),
        }
    }

    /// Describes the fit and the limits that were reached.
    pub fn describe(&self) -> String {
        let worst = self.landmarks_mm.iter().max_by(|a, b| a.1.total_cmp(b.1));
        let worst = worst.map_or(String::new(), |(name, mm)| format!(", at worst {name} {mm:.1} mm"));
        let limits = match self.limits_hit.len() {
            0 => "no limit reached".to_owned(),
            1 => "1 joint angle at a limit".to_owned(),
            count => format!("{count} joint angles at a limit"),
        };
        format!("{:.1} mm from the recorded landmarks on average{worst}; {limits}", self.mean_residual_mm)
    }
}
