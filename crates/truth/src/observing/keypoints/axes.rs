//! The list of axes of keypoint errors. The doc comments of [`KeypointSettings`] have their formulas.

use super::KeypointSettings;

/// One number of `[observation.keypoints]`.
#[derive(Clone, Copy, Debug)]
pub struct KeypointAxis {
    /// Key in `[observation.keypoints]`.
    pub name: &'static str,
    /// Unit of the strength; empty for a share or a factor.
    pub unit: &'static str,
    /// Largest accepted strength.
    pub greatest: f64,
    /// Gets the strength of this axis.
    pub strength: fn(&KeypointSettings) -> f64,
}

/// All axes, in the order of application.
pub const KEYPOINT_AXES: [KeypointAxis; 13] = [
    KeypointAxis { name: "bias_mm", unit: "mm", greatest: 1000.0, strength: |k| k.bias_mm },
    KeypointAxis { name: "slow_percent", unit: "%", greatest: 100.0, strength: |k| k.slow_percent },
    KeypointAxis { name: "slow_s", unit: "s", greatest: 3600.0, strength: |k| k.slow_s },
    KeypointAxis { name: "white_percent", unit: "%", greatest: 100.0, strength: |k| k.white_percent },
    KeypointAxis { name: "gross", unit: "", greatest: 1.0, strength: |k| k.gross },
    KeypointAxis { name: "gross_percent", unit: "%", greatest: 1000.0, strength: |k| k.gross_percent },
    KeypointAxis { name: "missing", unit: "", greatest: 1.0, strength: |k| k.missing },
    KeypointAxis { name: "inversion", unit: "", greatest: 1.0, strength: |k| k.inversion },
    KeypointAxis { name: "other_person", unit: "", greatest: 1.0, strength: |k| k.other_person },
    KeypointAxis { name: "stretch_s", unit: "s", greatest: 3600.0, strength: |k| k.stretch_s },
    KeypointAxis { name: "occluded_error", unit: "", greatest: 100.0, strength: |k| k.occluded_error },
    KeypointAxis { name: "occluded_rate", unit: "", greatest: 1000.0, strength: |k| k.occluded_rate },
    KeypointAxis { name: "confidence_noise", unit: "", greatest: 1.0, strength: |k| k.confidence_noise },
];

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
    use skiagraph_core::body::KeypointLayout;
    use std::collections::BTreeSet;

    #[test]
    fn every_axis_is_a_key() {
        let mut keys = BTreeSet::from(["layout"]);
        for axis in &KEYPOINT_AXES {
            let text = format!("layout = \"body25\"\n{} = 0.75", axis.name);
            let settings: KeypointSettings = toml::from_str(&text).unwrap();
            assert_eq!(((axis.strength)(&settings), settings.layout), (0.75, KeypointLayout::Body25), "{}", axis.name);
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
