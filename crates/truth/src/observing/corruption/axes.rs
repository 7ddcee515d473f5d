//! The list of axes: name, unit, formula and the levels of a ladder.

use super::Corruption;

/// One way to corrupt observations.
#[derive(Clone, Copy, Debug)]
pub struct CorruptionAxis {
    /// Its key in `[observation.corruption]`.
    pub name: &'static str,
    /// Unit of its strength; empty for a share.
    pub unit: &'static str,
    /// What a strength `s` means.
    pub formula: &'static str,
    /// Five strengths from mild to severe: the levels of `render --ladder` unless others are given.
    pub levels: [f64; 5],
    /// Greatest strength that is accepted.
    pub greatest: f64,
    /// Whether it changes masks; the others change what a tracker is given.
    pub of_masks: bool,
    /// Its strength.
    pub strength: fn(&Corruption) -> f64,
}

/// Every axis, in the order in which they are applied.
pub const AXES: [CorruptionAxis; 16] = [
    CorruptionAxis {
        name: "desynchronisation_ms",
        unit: "ms",
        formula: "camera c shows the scene at t + o_c, o_c normal with standard deviation s, constant over the sequence; \
                  between poses angles are interpolated linearly and rotations by slerp, at the ends the motion stands",
        levels: [2.0, 5.0, 10.0, 20.0, 50.0],
        greatest: 10_000.0,
        of_masks: true,
        strength: |c| c.desynchronisation_ms,
    },
    CorruptionAxis {
        name: "line_delay_us",
        unit: "us",
        formula: "rolling shutter: row y of every image, from 0 at the top, shows the scene at t + s y (and o_c); between \
                  poses as above",
        levels: [5.0, 10.0, 20.0, 50.0, 100.0],
        greatest: 10_000.0,
        of_masks: true,
        strength: |c| c.line_delay_us,
    },
    CorruptionAxis {
        name: "dropped_frames",
        unit: "",
        formula: "each frame of each camera but the first is lost with probability s; the camera's last image is shown \
                  again",
        levels: [0.05, 0.1, 0.2, 0.4, 0.8],
        greatest: 1.0,
        of_masks: true,
        strength: |c| c.dropped_frames,
    },
    CorruptionAxis {
        name: "missing_limb",
        unit: "",
        formula: "in each half second of each camera, with probability s, one arm or leg (drawn evenly) is not seen from \
                  the link of the elbow or knee marker on; what it hid of the body is seen",
        levels: [0.05, 0.1, 0.2, 0.4, 0.8],
        greatest: 1.0,
        of_masks: true,
        strength: |c| c.missing_limb,
    },
    CorruptionAxis {
        name: "shadow_m",
        unit: "m",
        formula: "pixels of the ground z = 0 in the shadow that the body casts under a sun 45 degrees high, of an azimuth \
                  drawn for the sequence, are set where the lowest part of the body between them and the sun is at most \
                  s metres high: the shadow is s metres long",
        levels: [0.1, 0.2, 0.4, 0.8, 1.6],
        greatest: 100.0,
        of_masks: true,
        strength: |c| c.shadow_m,
    },
    CorruptionAxis {
        name: "boundary_px",
        unit: "px",
        formula: "a pixel at signed distance d from the outline (positive outside) is set where d < s n; n is a field \
                  of normal deviates on a grid of 8 px, interpolated bilinearly and scaled to variance 1 everywhere, new \
                  in every frame",
        levels: [0.5, 1.0, 2.0, 4.0, 8.0],
        greatest: 1000.0,
        of_masks: true,
        strength: |c| c.boundary_px,
    },
    CorruptionAxis {
        name: "holes",
        unit: "",
        formula: "discs about evenly drawn pixels of the silhouette are cleared until s of its pixels are; radii even \
                  between 1/480 and 6/480 of the image's height",
        levels: [0.02, 0.05, 0.1, 0.2, 0.4],
        greatest: 1.0,
        of_masks: true,
        strength: |c| c.holes,
    },
    CorruptionAxis {
        name: "blobs",
        unit: "",
        formula: "discs about evenly drawn pixels of the image are set until as many pixels are added as s times the \
                  silhouette has; radii even between 1/480 and 12/480 of the image's height",
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
        formula: "the tracker is given camera centres that are off by a normal deviate of standard deviation s in each \
                  coordinate",
        levels: [5.0, 10.0, 20.0, 50.0, 100.0],
        greatest: 100_000.0,
        of_masks: false,
        strength: |c| c.calibration_mm,
    },
    CorruptionAxis {
        name: "calibration_deg",
        unit: "deg",
        formula: "the tracker is given orientations turned by a rotation vector in the camera's axes, each coordinate a \
                  normal deviate of standard deviation s",
        levels: [0.1, 0.2, 0.5, 1.0, 2.0],
        greatest: 180.0,
        of_masks: false,
        strength: |c| c.calibration_deg,
    },
    CorruptionAxis {
        name: "calibration_px",
        unit: "px",
        formula: "the tracker is given focal lengths that are off by a normal deviate of standard deviation s, the same \
                  along x and y, never below a tenth of the true one",
        levels: [2.0, 5.0, 10.0, 20.0, 50.0],
        greatest: 10_000.0,
        of_masks: false,
        strength: |c| c.calibration_px,
    },
    CorruptionAxis {
        name: "lens_ignored",
        unit: "",
        formula: "the tracker is given the lens's coefficients times 1 - s",
        levels: [0.1, 0.25, 0.5, 0.75, 1.0],
        greatest: 1.0,
        of_masks: false,
        strength: |c| c.lens_ignored,
    },
    CorruptionAxis {
        name: "wrong_body_percent",
        unit: "%",
        formula: "length and girth of every segment of the tracker's body, after its mismatch, times 1 + u, u even \
                  between -s and s; left and right alike",
        levels: [2.0, 5.0, 10.0, 15.0, 20.0],
        greatest: 50.0,
        of_masks: false,
        strength: |c| c.wrong_body_percent,
    },
    CorruptionAxis {
        name: "start_mm",
        unit: "mm",
        formula: "the root of the start pose is off by a normal deviate of standard deviation s in each coordinate",
        levels: [20.0, 50.0, 100.0, 200.0, 400.0],
        greatest: 100_000.0,
        of_masks: false,
        strength: |c| c.start_mm,
    },
    CorruptionAxis {
        name: "start_deg",
        unit: "deg",
        formula: "every joint angle of the start pose is off by a normal deviate of standard deviation s, then clamped \
                  to its limits; the root is turned by a rotation vector of such coordinates",
        levels: [5.0, 10.0, 20.0, 30.0, 45.0],
        greatest: 180.0,
        of_masks: false,
        strength: |c| c.start_deg,
    },
];

impl CorruptionAxis {
    /// The axis of that name.
    pub fn named(name: &str) -> Option<&'static Self> {
        AXES.iter().find(|axis| axis.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_axis_is_the_key_of_a_strength_and_has_levels_that_rise_up_to_its_greatest() {
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
