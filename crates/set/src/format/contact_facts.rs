//! Treatment of ground contact in the truth, and its outcome: `[truth.contact]` of `set.toml`.

use serde::{Deserialize, Serialize};

use skiagraph_core::contact::GroundQuality;

/// Treatment of ground contact in the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactFacts {
    /// `measure`: unchanged. `fix`: feet planted. `simulate`: motion of a simulated body.
    pub mode: String,
    /// Description of the outcome.
    pub outcome: String,
    /// Mean speed of standing feet along the ground, mm/s.
    pub skate_mm_per_s: f64,
    /// Greatest depth of any link under the ground, mm.
    pub penetration_mm: f64,
    /// Greatest height of a standing foot above the ground, mm.
    pub float_mm: f64,
    /// Mean and greatest distance by which joints were moved from the recording, mm; absent if nothing was moved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints_moved_mm: Option<[f64; 2]>,
    /// By how much the whole motion was raised in addition, mm; absent if it was not below the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub raised_mm: Option<f64>,
    /// Settings and results of a simulation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulation: Option<SimulationFacts>,
}

/// Settings and results of a simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulationFacts {
    /// Coefficient of friction.
    pub friction: f64,
    /// Greatest residual wrench at the root that was allowed, body weights.
    pub root_wrench: f64,
    /// Mean and greatest residual wrench at the root that was used, body weights.
    pub root_wrench_used: [f64; 2],
    /// Duration, seconds.
    pub duration_s: f64,
    /// When the body fell, seconds; absent if it stayed up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fell_at_s: Option<f64>,
    /// The frame of the set at that instant, from 0: from this frame on the truth is a fall; absent if it stayed up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fell_at_frame: Option<usize>,
    /// Pushes on the body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pushes: Vec<PushFacts>,
}

/// A push.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PushFacts {
    /// When it began, seconds from the first frame.
    pub at_s: f64,
    /// The actor's link.
    pub link: String,
    /// Force times time, N s.
    pub impulse_ns: f64,
    /// Direction, world, unit vector.
    pub direction: [f64; 3],
}

impl ContactFacts {
    /// For a motion that was measured and left unchanged.
    pub fn measured(quality: &GroundQuality) -> Self {
        Self::new("measure", quality.to_string(), quality)
    }

    /// Without distances by which joints were moved, and without a simulation.
    pub fn new(mode: &str, outcome: String, quality: &GroundQuality) -> Self {
        Self {
            mode: mode.to_owned(),
            outcome,
            skate_mm_per_s: quality.skate_mm_per_s,
            penetration_mm: quality.penetration_mm,
            float_mm: quality.float_mm,
            joints_moved_mm: None,
            raised_mm: None,
            simulation: None,
        }
    }

    /// Names and values for display.
    pub fn describe(&self) -> Vec<(&'static str, String)> {
        let mut facts = vec![("mode", self.mode.clone())];
        if let Some(simulation) = &self.simulation {
            facts.push(("friction", simulation.friction.to_string()));
            let bound = format!("at most {} % of body weight", 100.0 * simulation.root_wrench);
            facts.push(("root wrench", if simulation.root_wrench > 0.0 { bound } else { "none".to_owned() }));
            facts.extend(simulation.pushes.iter().map(|push| ("push", push.describe())));
        }
        facts.push(("outcome", self.outcome.clone()));
        facts
    }
}

impl PushFacts {
    fn describe(&self) -> String {
        let [x, y, z] = self.direction;
        format!("{} N s on {} at {} s, towards ({x:.2}, {y:.2}, {z:.2})", self.impulse_ns, self.link, self.at_s)
    }
}
