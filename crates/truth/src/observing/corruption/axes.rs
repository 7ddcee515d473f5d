//! The list of corruption axes: name, unit, formula and the levels of a ladder.

use super::Corruption;

/// One way to corrupt observations.
#[derive(Clone, Copy, Debug)]
pub struct CorruptionAxis {
    /// Key in `[observation.corruption]`.
    pub name: &'static str,
    /// Unit of the strength; empty for a share.
    pub unit: &'static str,
    /// Meaning of a strength `s`.
    pub formula: &'static str,
    /// Five strengths from mild to severe, the default levels of `render --ladder`.
    pub levels: [f64; 5],
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
        formula: "camera c shows the scene at t + o_c, with o_c drawn once per sequence from a normal distribution \
                  with standard deviation s; between frames, angles are interpolated linearly and rotations by slerp; \
                  before the first and after the last frame everything stands still",
        levels: [2.0, 5.0, 10.0, 20.0, 50.0],
        greatest: 10_000.0,
        of_masks: true,
        strength: |c| c.desynchronisation_ms,
    },
    CorruptionAxis {
        name: "clock_drift_ms_per_min",
        unit: "ms/min",
        formula: "o_c grows by r_c per minute, with r_c drawn once per sequence from a normal distribution with \
                  standard deviation s",
        levels: [1.0, 2.0, 5.0, 10.0, 50.0],
        greatest: 10_000.0,
        of_masks: true,
        strength: |c| c.clock_drift_ms_per_min,
    },
    CorruptionAxis {
        name: "line_delay_us",
        unit: "us",
        formula: "rolling shutter: row y of every image, counted from 0 at the top, shows the scene at t + s y (plus \
                  o_c), interpolated as above",
        levels: [5.0, 10.0, 20.0, 50.0, 100.0],
        greatest: 10_000.0,
        of_masks: true,
        strength: |c| c.line_delay_us,
    },
    CorruptionAxis {
        name: "dropped_frames",
        unit: "",
        formula: "each frame of each camera except the first is lost with probability s, and the camera's last image \
                  is shown again",
        levels: [0.05, 0.1, 0.2, 0.4, 0.8],
        greatest: 1.0,
        of_masks: true,
        strength: |c| c.dropped_frames,
    },
    CorruptionAxis {
        name: "missing_limb",
        unit: "",
        formula: "in each half second of each camera, with probability s, one arm or leg (drawn uniformly) is \
                  invisible from the link of the elbow or knee marker to its end, and what it hid of the body is \
                  visible",
        levels: [0.05, 0.1, 0.2, 0.4, 0.8],
        greatest: 1.0,
        of_masks: true,
        strength: |c| c.missing_limb,
    },
    CorruptionAxis {
        name: "shadow_m",
        unit: "m",
        formula: "pixels of the ground z = 0 are set if the ray from there to the sun first meets the body at a \
                  height of at most s metres, which gives a shadow s metres long; the sun is 45 degrees high, its \
                  azimuth is drawn once per sequence",
        levels: [0.1, 0.2, 0.4, 0.8, 1.6],
        greatest: 100.0,
        of_masks: true,
        strength: |c| c.shadow_m,
    },
    CorruptionAxis {
        name: "boundary_px",
        unit: "px",
        formula: "a pixel at signed distance d from the outline (positive outside) is set if d < s n, where n is a \
                  field of normal deviates on a grid of 8 px, interpolated bilinearly and scaled to variance 1 \
                  everywhere, new in every frame",
        levels: [0.5, 1.0, 2.0, 4.0, 8.0],
        greatest: 1000.0,
        of_masks: true,
        strength: |c| c.boundary_px,
    },
    CorruptionAxis {
        name: "boundary_s",
        unit: "s",
        formula: "the field of boundary_px is fixed in the image, drawn anew every s seconds, and between these moments \
                  interpolated linearly and scaled to variance 1; no effect without boundary_px",
        levels: [0.05, 0.1, 0.2, 0.5, 1.0],
        greatest: 3600.0,
        of_masks: true,
        strength: |c| c.boundary_s,
    },
    CorruptionAxis {
        name: "holes",
        unit: "",
        formula: "discs around uniformly drawn pixels of the silhouette are cleared until a share s of its pixels is \
                  cleared; radii are uniform between 1/480 and 6/480 of the image height",
        levels: [0.02, 0.05, 0.1, 0.2, 0.4],
        greatest: 1.0,
        of_masks: true,
        strength: |c| c.holes,
    },
    CorruptionAxis {
        name: "blobs",
        unit: "",
        formula: "discs around uniformly drawn pixels of the image are set until the added pixels number s times \
                  those of the silhouette; radii are uniform between 1/480 and 12/480 of the image height",
        levels: [0.05, 0.1, 0.2, 0.5, 1.0],
        greatest: 10.0,
        of_masks: true,
        strength: |c| c.blobs,
    },
    CorruptionAxis {
        name: "salt_and_pepper",
        unit: "",
        formula: "each pixel is flipped with probability s",
        levels: [0.001, 0.003, 0.01, 0.03, 0.1],
        greatest: 1.0,
        of_masks: true,
        strength: |c| c.salt_and_pepper,
    },
    CorruptionAxis {
        name: "calibration_mm",
        unit: "mm",
        formula: "the camera centres given to the tracker are off by a normal deviate with standard deviation s in \
                  each coordinate",
        levels: [5.0, 10.0, 20.0, 50.0, 100.0],
        greatest: 100_000.0,
        of_masks: false,
        strength: |c| c.calibration_mm,
    },
    CorruptionAxis {
        name: "calibration_deg",
        unit: "deg",
        formula: "the camera orientations given to the tracker are turned by a rotation vector in the camera's axes, \
                  each coordinate a normal deviate with standard deviation s",
        levels: [0.1, 0.2, 0.5, 1.0, 2.0],
        greatest: 180.0,
        of_masks: false,
        strength: |c| c.calibration_deg,
    },
    CorruptionAxis {
        name: "calibration_px",
        unit: "px",
        formula: "the focal lengths given to the tracker are off by a normal deviate with standard deviation s, the \
                  same along x and y, clamped to at least a tenth of the true one",
        levels: [2.0, 5.0, 10.0, 20.0, 50.0],
        greatest: 10_000.0,
        of_masks: false,
        strength: |c| c.calibration_px,
    },
    CorruptionAxis {
        name: "lens_ignored",
        unit: "",
        formula: "the lens coefficients given to the tracker are multiplied by 1 - s",
        levels: [0.1, 0.25, 0.5, 0.75, 1.0],
        greatest: 1.0,
        of_masks: false,
        strength: |c| c.lens_ignored,
    },
    CorruptionAxis {
        name: "wrong_body_percent",
        unit: "%",
        formula: "length and girth of every segment of the tracker's body, after its mismatch, are multiplied by 1 + \
                  u, with u uniform between -s and s and the same for left and right",
        levels: [2.0, 5.0, 10.0, 15.0, 20.0],
        greatest: 50.0,
        of_masks: false,
        strength: |c| c.wrong_body_percent,
    },
    CorruptionAxis {
        name: "start_mm",
        unit: "mm",
        formula: "the root of the start pose is off by a normal deviate with standard deviation s in each coordinate",
        levels: [20.0, 50.0, 100.0, 200.0, 400.0],
        greatest: 100_000.0,
        of_masks: false,
        strength: |c| c.start_mm,
    },
    CorruptionAxis {
        name: "start_deg",
        unit: "deg",
        formula: "every joint angle of the start pose is off by a normal deviate with standard deviation s, then \
                  clamped to its limits; the root is turned by a rotation vector with such coordinates",
        levels: [5.0, 10.0, 20.0, 30.0, 45.0],
        greatest: 180.0,
        of_masks: false,
        strength: |c| c.start_deg,
    },
];

impl CorruptionAxis {
    /// The axis with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        AXES.iter().find(|axis| axis.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_axis_is_a_key_and_has_increasing_levels_within_its_range() {
        let mut keys = BTreeSet::new();
        for axis in &AXES {
            let text = format!("{} = 0.5", axis.name);
            let corruption: Corruption = toml::from_str(&text).unwrap();
            assert_eq!((axis.strength)(&corruption), 0.5, "{}", axis.name);
            assert!(axis.levels.windows(2).all(|pair| pair[0] < pair[1]) && axis.levels[0] > 0.0, "{}", axis.name);
            assert!(axis.levels[4] <= axis.greatest);
            keys.insert(axis.name);
        }
        let schema = schemars::schema_for!(Corruption).to_value();
        let known: BTreeSet<&str> = schema["properties"].as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(keys, known);
    }
}
