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
    of_masks("desynchronisation_ms", "ms", 10_000.0, |c| c.desynchronisation_ms),
    of_masks("clock_drift_ms_per_min", "ms/min", 10_000.0, |c| c.clock_drift_ms_per_min),
    of_masks("line_delay_us", "us", 10_000.0, |c| c.line_delay_us),
    of_masks("dropped_frames", "", 1.0, |c| c.dropped_frames),
    of_masks("missing_limb", "", 1.0, |c| c.missing_limb),
    of_masks("shadow_m", "m", 100.0, |c| c.shadow_m),
    of_masks("boundary_px", "px", 1000.0, |c| c.boundary_px),
    of_masks("boundary_s", "s", 3600.0, |c| c.boundary_s),
    of_masks("holes", "", 1.0, |c| c.holes),
    of_masks("blobs", "", 10.0, |c| c.blobs),
    of_masks("salt_and_pepper", "", 1.0, |c| c.salt_and_pepper),
    of_input("calibration_mm", "mm", 100_000.0, |c| c.calibration_mm),
    of_input("calibration_deg", "deg", 180.0, |c| c.calibration_deg),
    of_input("calibration_px", "px", 10_000.0, |c| c.calibration_px),
    of_input("lens_ignored", "", 1.0, |c| c.lens_ignored),
    of_input("wrong_body_percent", "%", 50.0, |c| c.wrong_body_percent),
    of_input("start_mm", "mm", 100_000.0, |c| c.start_mm),
    of_input("start_deg", "deg", 180.0, |c| c.start_deg),
];

const fn of_masks(
    name: &'static str,
    unit: &'static str,
    greatest: f64,
    strength: fn(&Corruption) -> f64,
) -> CorruptionAxis {
    CorruptionAxis { name, unit, greatest, of_masks: true, strength }
}

const fn of_input(
    name: &'static str,
    unit: &'static str,
    greatest: f64,
    strength: fn(&Corruption) -> f64,
) -> CorruptionAxis {
    CorruptionAxis { of_masks: false, ..of_masks(name, unit, greatest, strength) }
}

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
