//! The unit of intervals.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The unit that an interval treats as random. Everything else is fixed, and the interval does not cover it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IntervalUnit {
    /// Seeds of the tracker on fixed sets; does not cover other motions or other noise.
    #[default]
    Seeds,
    /// Draws of the observation's noise for fixed clips, each the mean of its seeds; does not cover other motions.
    Draws,
    /// Clips, each the mean of its draws and seeds (cluster means); one degree of freedom less than the number of
    /// clips.
    Clips,
}

impl IntervalUnit {
    /// All units, the one with the narrowest scope first.
    pub const ALL: [Self; 3] = [Self::Seeds, Self::Draws, Self::Clips];

    /// The singular of its name.
    pub fn singular(self) -> &'static str {
        match self {
            Self::Seeds => "seed",
            Self::Draws => "draw of the noise",
            Self::Clips => "clip",
        }
    }
}

impl fmt::Display for IntervalUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Seeds => "seeds",
            Self::Draws => "draws",
            Self::Clips => "clips",
        })
    }
}

impl FromStr for IntervalUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|unit| unit.to_string() == text);
        found.ok_or_else(|| "expected seeds, draws or clips".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_by_the_names_that_are_printed() {
        for unit in IntervalUnit::ALL {
            assert_eq!(unit.to_string().parse(), Ok(unit));
            assert_eq!(serde_json::to_string(&unit).unwrap(), format!("\"{unit}\""));
        }
        assert!("frames".parse::<IntervalUnit>().is_err());
    }
}
