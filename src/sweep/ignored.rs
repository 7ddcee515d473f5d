//! Programs that ignore their settings or their seed: estimates that are the same to the bit.

use std::collections::BTreeMap;

use serde_json::Value;

use super::plan_file::describe_axes;
use super::summary::{CellSummary, METHOD, SettingSummary, SweepSummary};
use skiagraph_eval::FEWEST_RUNS;

/// Remarks on axes and seeds that change no estimate of any program; `is_setting` tells whether an axis is a setting of
/// a program.
pub(super) fn remarks(summary: &SweepSummary, is_setting: impl Fn(&str) -> bool) -> Vec<String> {
    let mut remarks: Vec<String> = Vec::new();
    for axis in summary.axes.iter().filter(|axis| is_setting(axis)) {
        let without = |setting: &SettingSummary, cell: &CellSummary| {
            let mut others = setting.axes.clone();
            others.remove(axis);
            format!("{} {} {}", describe_axes(&others), cell.set, cell.seed)
        };
        for program in programs(summary) {
            let of_it = |setting: &SettingSummary| setting.axes.get(METHOD) == program.as_ref();
            if all_alike(summary, of_it, without) {
                let name = program.as_ref().and_then(Value::as_str).map_or("The program".to_owned(), str::to_owned);
                remarks.push(format!(
                    "{name} ignores its setting {axis}: it gives the same estimates, to the bit, for all its values."
                ));
            }
        }
    }
    if all_alike(summary, |_| true, |setting, cell| format!("{} {}", setting.setting, cell.set)) {
        remarks.push(
            "The program gives the same estimates for every seed, so seeds count as one run: intervals need --draws, which \
             draws new noise for every seed."
                .to_owned(),
        );
    } else {
        remarks.extend(without_intervals(summary));
    }
    remarks
}

/// Why no setting has an interval, if all have enough runs for one.
fn without_intervals(summary: &SweepSummary) -> Option<String> {
    let enough = |setting: &&SettingSummary| setting.present().len() >= FEWEST_RUNS;
    let mut settings = summary.settings.iter().filter(enough).peekable();
    settings.peek()?;
    settings.all(|setting| setting.ci95.is_none()).then(|| {
        "All runs of every setting have the same value: nothing that is random changes it, so seeds and draws give no \
         interval. That needs a scenario with noise, and --draws."
            .to_owned()
    })
}

/// The methods of a scenario with several, or nothing once.
fn programs(summary: &SweepSummary) -> Vec<Option<Value>> {
    let mut found: Vec<Option<Value>> = Vec::new();
    for setting in &summary.settings {
        let method = setting.axes.get(METHOD).cloned();
        if !found.contains(&method) {
            found.push(method);
        }
    }
    found
}

/// Whether the estimates of programs are equal in every group of cells with the same key, and a group has several; of
/// the chosen settings.
fn all_alike(
    summary: &SweepSummary,
    is_chosen: impl Fn(&SettingSummary) -> bool,
    key: impl Fn(&SettingSummary, &CellSummary) -> String,
) -> bool {
    let mut groups: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for (setting, cell) in summary.all_cells().filter(|(setting, _)| is_chosen(setting)) {
        if let Some(estimates) = &cell.estimates {
            groups.entry(key(setting, cell)).or_default().push(estimates);
        }
    }
    let mut several = groups.values().filter(|group| group.len() > 1).peekable();
    several.peek().is_some() && several.all(|group| group.windows(2).all(|pair| pair[0] == pair[1]))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn summary(estimates: impl Fn(u64, u64) -> String) -> SweepSummary {
        let setting = |(number, alpha): (usize, u64)| SettingSummary {
            setting: number,
            axes: [("alpha".to_owned(), json!(alpha))].into_iter().collect(),
            cells: [0, 1].map(|seed| cell(seed, estimates(alpha, seed))).to_vec(),
            ..SettingSummary::default()
        };
        SweepSummary {
            axes: vec!["alpha".to_owned()],
            seeds: vec![0, 1],
            settings: [3, 5].into_iter().enumerate().map(setting).collect(),
            ..SweepSummary::default()
        }
    }

    fn cell(seed: u64, estimates: String) -> CellSummary {
        CellSummary { seed, estimates: Some(estimates), set: "a".to_owned(), ..CellSummary::default() }
    }

    #[test]
    fn an_ignored_setting_and_ignored_seeds_are_remarked() {
        let found = |of: fn(u64, u64) -> String| remarks(&summary(of), |_| true);
        assert!(found(|alpha, seed| format!("{alpha} {seed}")).is_empty());
        let [setting] = &found(|_, seed| seed.to_string())[..] else { panic!() };
        assert!(setting.contains("ignores its setting alpha"), "{setting}");
        let [seeds] = &found(|alpha, _| alpha.to_string())[..] else { panic!() };
        assert!(seeds.contains("the same estimates for every seed"), "{seeds}");
        assert_eq!(found(|_, _| String::new()).len(), 2);
        assert_eq!(remarks(&summary(|_, seed| seed.to_string()), |_| false), Vec::<String>::new());
    }

    #[test]
    fn equal_values_of_all_runs_are_the_reason_for_no_interval() {
        let mut equal = summary(|alpha, seed| format!("{alpha} {seed}"));
        let found = |summary: &SweepSummary| remarks(summary, |_| true);
        equal.settings.iter_mut().for_each(|setting| setting.values = vec![Some(7.0); 2]);
        assert!(found(&equal).is_empty(), "two runs have no interval anyway");
        equal.settings.iter_mut().for_each(|setting| setting.values = vec![Some(7.0); 3]);
        assert!(found(&equal).len() == 1 && found(&equal)[0].contains("have the same value"), "{:?}", found(&equal));
        equal.settings[0].ci95 = Some(skiagraph_eval::Interval { low: 6.0, high: 8.0 });
        assert!(found(&equal).is_empty());
    }

    #[test]
    fn of_several_programs_that_share_a_setting_the_one_that_ignores_it_is_named() {
        let mut both = summary(|_, seed| seed.to_string());
        let mut other = summary(|alpha, seed| format!("{alpha} {seed}"));
        let named = |settings: &mut [SettingSummary], name: &str| {
            settings.iter_mut().for_each(|setting| _ = setting.axes.insert(METHOD.to_owned(), json!(name)));
        };
        named(&mut both.settings, "deaf");
        named(&mut other.settings, "listening");
        both.settings.append(&mut other.settings);
        let found = remarks(&both, |_| true);
        assert!(found.len() == 1 && found[0].starts_with("deaf ignores its setting alpha"), "{found:?}");
    }
}
