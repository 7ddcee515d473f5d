//! The list of axes of keypoint errors: name, unit, formula and the levels of a ladder.

use super::KeypointSettings;

/// One number of `[observation.keypoints]`.
#[derive(Clone, Copy, Debug)]
pub struct KeypointAxis {
    /// Key in `[observation.keypoints]`.
    pub name: &'static str,
    /// Its name for `render --ladder`: the key with its table.
    pub ladder_name: &'static str,
    /// Unit of the strength; empty for a share or a factor.
    pub unit: &'static str,
    /// Meaning of a strength `s`. `h` is the height in the image, pixels, of a person who stands upright where the
    /// point is (focal length x stature / depth); `w` is the deviation of COCO's annotations of the point divided by
    /// its mean over COCO's 17 points.
    pub formula: &'static str,
    /// Five strengths from mild to severe, the default levels of `render --ladder`.
    pub levels: [f64; 5],
    /// Largest accepted strength.
    pub greatest: f64,
    /// Gets the strength of this axis.
    pub strength: fn(&KeypointSettings) -> f64,
}

/// All axes, in the order of application.
pub const KEYPOINT_AXES: [KeypointAxis; 13] = [
    KeypointAxis {
        name: "bias_mm",
        ladder_name: "keypoints.bias_mm",
        unit: "mm",
        formula: "every point is moved on its link by a vector that is drawn once per set, the same for all cameras, \
                  with normal coordinates of standard deviation s w forward, left and up at the standing pose; left \
                  and right mirror each other, points in the middle stay in the middle",
        levels: [5.0, 10.0, 15.0, 20.0, 30.0],
        greatest: 1000.0,
        strength: |k| k.bias_mm,
    },
    KeypointAxis {
        name: "slow_percent",
        ladder_name: "keypoints.slow_percent",
        unit: "%",
        formula: "both image coordinates are off by a stationary normal process with standard deviation s w h / 100 \
                  and correlation exp(-dt / slow_s)",
        levels: [0.25, 0.5, 1.0, 2.0, 4.0],
        greatest: 100.0,
        strength: |k| k.slow_percent,
    },
    KeypointAxis {
        name: "slow_s",
        ladder_name: "keypoints.slow_s",
        unit: "s",
        formula: "correlation time of the slow error",
        levels: [0.05, 0.15, 0.5, 1.5, 5.0],
        greatest: 3600.0,
        strength: |k| k.slow_s,
    },
    KeypointAxis {
        name: "white_percent",
        ladder_name: "keypoints.white_percent",
        unit: "%",
        formula: "both image coordinates are off by a normal deviate with standard deviation s w h / 100, new in \
                  every frame",
        levels: [0.1, 0.2, 0.5, 1.0, 2.0],
        greatest: 100.0,
        strength: |k| k.white_percent,
    },
    KeypointAxis {
        name: "gross",
        ladder_name: "keypoints.gross",
        unit: "",
        formula: "in a share s of the time, in stretches, the point is off by an offset drawn at the start of the \
                  stretch from a round Student t distribution with 3 degrees of freedom and the scale gross_percent",
        levels: [0.01, 0.02, 0.05, 0.1, 0.2],
        greatest: 1.0,
        strength: |k| k.gross,
    },
    KeypointAxis {
        name: "gross_percent",
        ladder_name: "keypoints.gross_percent",
        unit: "%",
        formula: "the scale of gross errors in each image coordinate is s h / 100",
        levels: [2.0, 5.0, 10.0, 15.0, 25.0],
        greatest: 1000.0,
        strength: |k| k.gross_percent,
    },
    KeypointAxis {
        name: "missing",
        ladder_name: "keypoints.missing",
        unit: "",
        formula: "in a share s of the time, in stretches, the point is missed",
        levels: [0.02, 0.05, 0.1, 0.2, 0.4],
        greatest: 1.0,
        strength: |k| k.missing,
    },
    KeypointAxis {
        name: "inversion",
        ladder_name: "keypoints.inversion",
        unit: "",
        formula: "in a share 2 s a^2 of the time, in stretches, left and right of the arms, of the legs, and of the \
                  face (independently) are exchanged; a is the cosine of the angle between the line of the hips and \
                  the line of sight: 0 from in front, 1 in profile, a share s in the mean of a turning body",
        levels: [0.005, 0.01, 0.02, 0.05, 0.1],
        greatest: 1.0,
        strength: |k| k.inversion,
    },
    KeypointAxis {
        name: "other_person",
        ladder_name: "keypoints.other_person",
        unit: "",
        formula: "in a share s of the time, in stretches, all points found in an image are those of the distractor \
                  nearest to the actor there; they are missing if none is in the image",
        levels: [0.01, 0.02, 0.05, 0.1, 0.2],
        greatest: 1.0,
        strength: |k| k.other_person,
    },
    KeypointAxis {
        name: "stretch_s",
        ladder_name: "keypoints.stretch_s",
        unit: "s",
        formula: "gross errors, misses, exchanges and points of another person begin and end at random (Markov chains \
                  in continuous time, seen at the frames) and last s seconds in the mean; 0 draws every frame anew",
        levels: [0.05, 0.1, 0.2, 0.5, 1.0],
        greatest: 3600.0,
        strength: |k| k.stretch_s,
    },
    KeypointAxis {
        name: "occluded_error",
        ladder_name: "keypoints.occluded_error",
        unit: "",
        formula: "slow, white and gross errors of a hidden point are multiplied by 1 + s",
        levels: [0.25, 0.5, 1.0, 2.0, 4.0],
        greatest: 100.0,
        strength: |k| k.occluded_error,
    },
    KeypointAxis {
        name: "occluded_rate",
        ladder_name: "keypoints.occluded_rate",
        unit: "",
        formula: "the shares gross and missing of a hidden point, and inversion of parts with a hidden point, are \
                  multiplied by 1 + s, up to 1",
        levels: [1.0, 2.0, 5.0, 10.0, 20.0],
        greatest: 1000.0,
        strength: |k| k.occluded_rate,
    },
    KeypointAxis {
        name: "confidence_noise",
        ladder_name: "keypoints.confidence_noise",
        unit: "",
        formula: "the confidence is drawn from a beta distribution with mean k and standard deviation \
                  s sqrt(k (1 - k)), where k = exp(-e^2 / (2 (2 d)^2 0.2 h^2)) is COCO's similarity of the point, e \
                  its slow, white and gross error, and d the deviation of COCO's annotations",
        levels: [0.1, 0.2, 0.3, 0.5, 0.8],
        greatest: 1.0,
        strength: |k| k.confidence_noise,
    },
];

impl KeypointAxis {
    /// The axis with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        KEYPOINT_AXES.iter().find(|axis| axis.name == name)
    }
}

impl KeypointSettings {
    /// Description for reports: `keypoints coco17: slow_percent 1 %`.
    pub fn describe(&self) -> String {
        let named = format!("keypoints {}", self.layout.name());
        if !self.is_drawn() {
            return named;
        }
        let exact = Self::exact(self.layout);
        let differing = KEYPOINT_AXES.iter().filter(|axis| (axis.strength)(self) != (axis.strength)(&exact));
        let words = differing.map(|axis| format!("{} {} {}", axis.name, (axis.strength)(self), axis.unit));
        format!("{named}: {}", words.map(|words| words.trim_end().to_owned()).collect::<Vec<_>>().join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::KeypointLayout;
    use std::collections::BTreeSet;

    #[test]
    fn every_axis_is_a_key_and_has_increasing_levels_within_its_range() {
        let mut keys = BTreeSet::from(["layout"]);
        for axis in &KEYPOINT_AXES {
            let text = format!("layout = \"body25\"\n{} = 0.75", axis.name);
            let settings: KeypointSettings = toml::from_str(&text).unwrap();
            assert_eq!(((axis.strength)(&settings), settings.layout), (0.75, KeypointLayout::Body25), "{}", axis.name);
            assert!(axis.levels.windows(2).all(|pair| pair[0] < pair[1]) && axis.levels[0] > 0.0, "{}", axis.name);
            assert!(axis.levels[4] <= axis.greatest);
            assert_eq!(axis.ladder_name, format!("keypoints.{}", axis.name));
            keys.insert(axis.name);
        }
        let schema = schemars::schema_for!(KeypointSettings).to_value();
        let known: BTreeSet<&str> = schema["properties"].as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(keys, known);
        let read: KeypointSettings = toml::from_str("layout = \"coco17\"").unwrap();
        assert_eq!(read, KeypointSettings::exact(KeypointLayout::Coco17));
        assert_eq!((read.describe().as_str(), read.is_drawn()), ("keypoints coco17", false));
        assert!(toml::from_str::<KeypointSettings>("slow_percent = 1.0").is_err(), "a layout is needed");
    }
}
