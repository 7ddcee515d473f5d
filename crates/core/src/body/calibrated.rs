//! Which parts of what a tracker is given it may correct by what it sees.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

/// What a tracker calibrates before tracking. In files `false`, `true` for both, `"body"` or `"cameras"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub enum Calibrated {
    /// Nothing.
    #[default]
    Nothing,
    /// Its body.
    Body,
    /// The poses of the cameras.
    Cameras,
    /// Its body and the poses of the cameras.
    Both,
}

/// The form in files.
#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "expected true, false, \"body\", \"cameras\" or \"both\"")]
enum Written {
    Switch(bool),
    Word(String),
}

impl Calibrated {
    /// Whether it is nothing.
    pub fn is_nothing(&self) -> bool {
        *self == Self::Nothing
    }

    /// Whether the body is calibrated.
    pub fn has_body(self) -> bool {
        matches!(self, Self::Body | Self::Both)
    }

    /// Whether the cameras are calibrated.
    pub fn has_cameras(self) -> bool {
        matches!(self, Self::Cameras | Self::Both)
    }
}

impl JsonSchema for Calibrated {
    fn schema_name() -> Cow<'static, str> {
        "Calibrated".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "enum": [true, false, "body", "cameras", "both"] })
    }
}

impl From<bool> for Calibrated {
    fn from(both: bool) -> Self {
        if both { Self::Both } else { Self::Nothing }
    }
}

impl fmt::Display for Calibrated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Nothing => "false",
            Self::Body => "body",
            Self::Cameras => "cameras",
            Self::Both => "true",
        })
    }
}

impl FromStr for Calibrated {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        match word {
            "false" => Ok(Self::Nothing),
            "body" => Ok(Self::Body),
            "cameras" => Ok(Self::Cameras),
            "true" | "both" => Ok(Self::Both),
            _ => Err("expected true, false, \"body\", \"cameras\" or \"both\"".to_owned()),
        }
    }
}

impl TryFrom<Written> for Calibrated {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        match written {
            Written::Switch(both) => Ok(both.into()),
            Written::Word(word) => word.parse(),
        }
    }
}

impl From<Calibrated> for Written {
    fn from(calibrated: Calibrated) -> Self {
        match calibrated {
            Calibrated::Nothing | Calibrated::Both => Self::Switch(calibrated == Calibrated::Both),
            Calibrated::Body | Calibrated::Cameras => Self::Word(calibrated.to_string()),
        }
    }
}
