//! The command that made a sweep, for its page.

use std::path::Path;

use super::gather::plain;
use super::plan::PlannedSweep;
use super::plan_file::PlanRecord;
use super::script;
use crate::scenario::{Expansion, Sweep, SweepAxis};

/// How the source of a sweep of the built-in scenario ends.
const BUILT_IN: &str = "(built in)";

impl PlannedSweep {
    /// A command that runs the same sweep: that of its file, or the axes of a sweep from the command line.
    pub fn command(&self) -> String {
        let PlanRecord { source, name, .. } = &self.plan;
        let file = if source.ends_with(BUILT_IN) { String::new() } else { format!(" {}", quoted(source)) };
        let words = self.axes_in_words().map_or_else(String::new, |words| format!(" {}", words.join(" ")));
        format!("skiagraph sweep{file}{words} --out sweeps/{name}")
    }

    /// Axes and options of a sweep from the command line; `None` for a sweep file.
    fn axes_in_words(&self) -> Option<Vec<String>> {
        let of_scenario = match &self.plan.base.file {
            Some(file) => Path::new(&self.plan.source).file_name() == file.file_name(),
            None => self.plan.source.ends_with(BUILT_IN),
        };
        let definition = self.definition().ok().filter(|_| of_scenario)?;
        let mut words = Vec::new();
        for (key, axis) in definition.axes().ok()? {
            let SweepAxis::Values(values) = axis else { return None };
            let values: Vec<String> = values.iter().map(|value| plain(&value.label)).collect();
            words.push(quoted(&format!("{key}={}", values.join(","))));
        }
        let sweep = &definition.sweep;
        words.extend(sweep.set.iter().map(|assignment| quoted(assignment)));
        words.extend(sweep.keep.iter().map(|condition| format!("--keep {}", quoted(condition))));
        words.extend((sweep.method == Expansion::Zip).then(|| "--zip".to_owned()));
        words.extend(sweep.seed.map(|seed| format!("--seed {seed}")));
        words.extend(sweep.seeds.map(|seeds| format!("--seeds {seeds}")));
        words.extend(
            (sweep.objective != Sweep::named("").objective).then(|| format!("--objective {}", sweep.objective)),
        );
        Some(words)
    }
}

/// A word for a shell.
fn quoted(word: &str) -> String {
    script::quoted(Path::new(word))
}
