//! Programs that ignore their settings or their seed: estimates that are the same to the bit.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

use super::plan_file::describe_axes;

/// The estimates of a program in one cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellEstimates<'a> {
    /// The number of its setting.
    pub(super) setting: usize,
    /// Axes and values.
    pub(super) axes: &'a Map<String, Value>,
    /// Its set.
    pub(super) set: &'a str,
    /// Its seed.
    pub(super) seed: u64,
    /// First digits of the SHA-256 of the estimates.
    pub(super) estimates: &'a str,
}

/// Remarks on `settings`, the axes that are settings of a program, and on seeds, that change no estimate.
pub(super) fn remarks<'s>(cells: &[CellEstimates<'_>], settings: impl Iterator<Item = &'s String>) -> Vec<String> {
    let mut remarks: Vec<String> = Vec::new();
    for axis in settings {
        let without = |cell: &CellEstimates<'_>| {
            let mut others = cell.axes.clone();
            others.remove(axis);
            format!("{} {} {}", describe_axes(&others), cell.set, cell.seed)
        };
        if are_alike(cells, without) {
            remarks.push(format!(
                "The program ignores its setting {axis}: it gives the same estimates, to the bit, for all its values."
            ));
        }
    }
    if are_alike(cells, |cell| format!("{} {}", cell.setting, cell.set)) {
        remarks.push(
            "The program gives the same estimates for every seed, so seeds count as one run: intervals need --draws, \
             which draws new noise for every seed."
                .to_owned(),
        );
    }
    remarks
}

/// Whether the estimates are equal in every group of cells with the same key, and a group has several.
fn are_alike(cells: &[CellEstimates<'_>], key: impl Fn(&CellEstimates<'_>) -> String) -> bool {
    let mut groups: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for cell in cells {
        groups.entry(key(cell)).or_default().push(cell.estimates);
    }
    let mut several = groups.values().filter(|group| group.len() > 1).peekable();
    several.peek().is_some() && several.all(|group| group.windows(2).all(|pair| pair[0] == pair[1]))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// The remarks on two values of alpha with two seeds each.
    fn found(of: fn(u64, u64) -> String, settings: &[String]) -> Vec<String> {
        let axes = [3, 5].map(|alpha| [("alpha".to_owned(), json!(alpha))].into_iter().collect::<Map<String, Value>>());
        let made = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(at, seed)| (at, seed, of(at as u64, seed)));
        let cells: Vec<CellEstimates<'_>> = made
            .iter()
            .map(|(at, seed, estimates)| CellEstimates {
                setting: *at,
                axes: &axes[*at],
                set: "a",
                seed: *seed,
                estimates,
            })
            .collect();
        remarks(&cells, settings.iter())
    }

    #[test]
    fn an_ignored_setting_and_ignored_seeds_are_remarked() {
        let alpha = ["alpha".to_owned()];
        assert!(found(|alpha, seed| format!("{alpha} {seed}"), &alpha).is_empty());
        let [setting] = &found(|_, seed| seed.to_string(), &alpha)[..] else { panic!() };
        assert!(setting.contains("ignores its setting alpha"), "{setting}");
        let [seeds] = &found(|alpha, _| alpha.to_string(), &alpha)[..] else { panic!() };
        assert!(seeds.contains("the same estimates for every seed"), "{seeds}");
        assert_eq!(found(|_, _| String::new(), &alpha).len(), 2);
        assert!(found(|_, seed| seed.to_string(), &[]).is_empty(), "the axis is no setting of a program");
    }
}
