//! The list of corruption axes. The doc comments of [`Corruption`] have their formulas.

use super::Corruption;

/// One way to corrupt observations.
#[derive(Clone, Copy, Debug)]
pub struct CorruptionAxis {
    /// Key in `[observation.corruption]`.
    pub name: &'static str,
    /// Unit of the strength; empty for a share.
    pub unit: &'static str,
    /// Largest accepted strength.
    pub greatest: f64,
    /// Whether the axis changes masks; the others change the tracker's cameras, body or start.
    pub of_masks: bool,
    /// Gets the strength of this axis.
    pub strength: fn(&Corruption) -> f64,
}

/// All axes, in the order of application.
pub const AXES: [CorruptionAxis; 18] = [
    CorruptionAxis {
        name: "desynchronisation_ms",
        unit: "ms",
        greatest: 10_000.0,
        of_masks: true,
        strength: |c| c.desynchronisation_ms,
    },
    CorruptionAxis {
        name: "clock_drift_ms_per_min",
        unit: "ms/min",
        greatest: 10_000.0,
        of_masks: true,
        strength: |c| c.clock_drift_ms_per_min,
    },
    CorruptionAxis {
        name: "line_delay_us",
        unit: "us",
        greatest: 10_000.0,
        of_masks: true,
        strength: |c| c.line_delay_us,
    },
    CorruptionAxis { name: "dropped_frames", unit: "", greatest: 1.0, of_masks: true, strength: |c| c.dropped_frames },
    CorruptionAxis { name: "missing_limb", unit: "", greatest: 1.0, of_masks: true, strength: |c| c.missing_limb },
    CorruptionAxis { name: "shadow_m", unit: "m", greatest: 100.0, of_masks: true, strength: |c| c.shadow_m },
    CorruptionAxis { name: "boundary_px", unit: "px", greatest: 1000.0, of_masks: true, strength: |c| c.boundary_px },
    CorruptionAxis { name: "boundary_s", unit: "s", greatest: 3600.0, of_masks: true, strength: |c| c.boundary_s },
    CorruptionAxis { name: "holes", unit: "", greatest: 1.0, of_masks: true, strength: |c| c.holes },
    CorruptionAxis { name: "blobs", unit: "", greatest: 10.0, of_masks: true, strength: |c| c.blobs },
    CorruptionAxis {
        name: "salt_and_pepper",
        unit: "",
        greatest: 1.0,
        of_masks: true,
        strength: |c| c.salt_and_pepper,
    },
    CorruptionAxis {
        name: "calibration_mm",
        unit: "mm",
        greatest: 100_000.0,
        of_masks: false,
        strength: |c| c.calibration_mm,
    },
    CorruptionAxis {
        name: "calibration_deg",
        unit: "deg",
        greatest: 180.0,
        of_masks: false,
        strength: |c| c.calibration_deg,
    },
    CorruptionAxis {
        name: "calibration_px",
        unit: "px",
        greatest: 10_000.0,
        of_masks: false,
        strength: |c| c.calibration_px,
    },
    CorruptionAxis { name: "lens_ignored", unit: "", greatest: 1.0, of_masks: false, strength: |c| c.lens_ignored },
    CorruptionAxis {
        name: "wrong_body_percent",
        unit: "%",
        greatest: 50.0,
        of_masks: false,
        strength: |c| c.wrong_body_percent,
    },
    CorruptionAxis { name: "start_mm", unit: "mm", greatest: 100_000.0, of_masks: false, strength: |c| c.start_mm },
    CorruptionAxis { name: "start_deg", unit: "deg", greatest: 180.0, of_masks: false, strength: |c| c.start_deg },
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_axis_is_a_key() {
        let mut keys = BTreeSet::new();
        for axis in &AXES {
            let text = format!("{} = 0.5", axis.name);
            let corruption: Corruption = toml::from_str(&text).unwrap();
            assert_eq!((axis.strength)(&corruption), 0.5, "{}", axis.name);
            keys.insert(axis.name);
        }
        let schema = schemars::schema_for!(Corruption).to_value();
        let known: BTreeSet<&str> = schema["properties"].as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(keys, known);
    }
}
