//! Turns axes into settings: combinations of axis values, and their overrides.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use rand::RngExt;
use serde_json::{Map, Number, Value};

use super::definition::Expansion;
use super::file::{AxisValue, SweepAxis, SweepFile};
use super::plan_file::{describe_axes, table_text};
use crate::common::ExperimentError;
use crate::scenario::{ScenarioError, ScenarioFile, ScenarioTemplate, TrackerSettings};
use skiagraph_core::input::excerpt;
use skiagraph_core::parallel;
use skiagraph_core::rng::{Purpose, stream};

pub(super) const MOST_SETTINGS: usize = 1_000_000;
/// Maximum number of draws per random setting.
const DRAWS: usize = 20;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Setting {
    /// Axes and values, in alphabetical order of the axes; for a scenario with methods, the method last.
    pub(super) axes: Map<String, Value>,
    pub(super) set: Vec<String>,
    /// Method of the scenario; `None` for a scenario with one tracker.
    pub(super) method: Option<String>,
}

type Combination = BTreeMap<String, AxisValue>;

/// The output of `of` for all settings of a sweep and their scenarios, in the order of the grid (the last axis
/// varies fastest).
pub(super) fn settings<T: Send + Sync>(
    file: &SweepFile,
    template: &ScenarioTemplate,
    of: impl Fn(Setting, &ScenarioFile) -> Result<T, ExperimentError> + Sync,
) -> Result<Vec<T>, ExperimentError> {
    let combinations = combinations(file)?;
    let of_methods = axes_of_methods(&combinations, template);
    let made = parallel::map(combinations.len(), |index| -> Result<Vec<(Option<String>, T)>, ExperimentError> {
        let combination = &combinations[index];
        let mut set = overrides(combination);
        set.extend(file.sweep.named.then(|| format!("name={}", name_of(combination))));
        let scenario = template.with(&set).map_err(|error| at_its_axis(file, combination, error.into()))?;
        let axes: Map<String, Value> = combination.iter().map(|(k, v)| (k.clone(), v.label.clone())).collect();
        let all = axes.len() + 1;
        let methods = methods(axes, set, scenario, &of_methods);
        let one = |(setting, scenario): (Setting, ScenarioFile)| {
            // a method without one of the axes has the same setting for all its values
            let repeated = (setting.method.is_some() && setting.axes.len() < all).then(|| describe_axes(&setting.axes));
            Ok((repeated, of(setting, &scenario)?))
        };
        methods.into_iter().map(one).collect()
    });
    let (mut settings, mut known) = (Vec::new(), HashSet::new());
    for made in made {
        let new = made?.into_iter().filter(|(repeated, _)| repeated.clone().is_none_or(|axes| known.insert(axes)));
        settings.extend(new.map(|(_, one)| one));
    }
    Ok(settings)
}

/// An error in an override, with the line of its axis if the axis is in a sweep file.
fn at_its_axis(file: &SweepFile, combination: &Combination, error: ExperimentError) -> ExperimentError {
    let ExperimentError::Scenario(ScenarioError::Unsound(problem)) = &error else { return error };
    let Some(assignment) = &problem.assignment else { return error };
    // the error has the full key, the override may have only its last parts
    let is_named = |set: &String| assignment == set || assignment.ends_with(&format!(".{set}"));
    let Some((key, _)) = combination.iter().find(|(_, value)| value.set.iter().any(is_named)) else { return error };
    let own_key = if problem.key.is_empty() { String::new() } else { format!("{}: ", excerpt(&problem.key)) };
    let complaint = file.complaint(&format!("axes.{key}"), format!("{own_key}{}", problem.message));
    if complaint.place.is_some() { ScenarioError::from(complaint).into() } else { error }
}

/// The name of a cell's scenario: the values of its axes.
fn name_of(combination: &Combination) -> String {
    let words: Vec<String> = combination.values().map(|value| table_text(&value.label)).collect();
    words.join("-")
}

/// The methods of the axes that set only keys of methods; the settings of other methods do not have these axes.
fn axes_of_methods(combinations: &[Combination], template: &ScenarioTemplate) -> BTreeMap<String, BTreeSet<String>> {
    let mut keys: BTreeMap<&String, BTreeSet<&str>> = BTreeMap::new();
    for (axis, value) in combinations.iter().flatten() {
        let own = value.set.iter().filter_map(|assignment| assignment.split('=').next());
        keys.entry(axis).or_default().extend(own.map(str::trim));
    }
    let method_of = |key: &&str| Some(template.full_key(key).strip_prefix("methods.")?.split('.').next()?.to_owned());
    let methods_of = |(axis, keys): (&String, BTreeSet<&str>)| {
        Some((axis.clone(), keys.iter().map(method_of).collect::<Option<BTreeSet<String>>>()?))
    };
    keys.into_iter().filter_map(methods_of).collect()
}

/// One setting per method of a scenario, without the axes that belong to another method.
fn methods(
    axes: Map<String, Value>,
    set: Vec<String>,
    scenario: ScenarioFile,
    of_methods: &BTreeMap<String, BTreeSet<String>>,
) -> Vec<(Setting, ScenarioFile)> {
    if scenario.scenario.methods.is_empty() {
        return vec![(Setting { axes, set, method: None }, scenario)];
    }
    let names: Vec<String> = scenario.scenario.methods.keys().cloned().collect();
    let alone = |name: String| {
        let mut axes = axes.clone();
        axes.retain(|axis, _| of_methods.get(axis).is_none_or(|methods| methods.contains(&name)));
        axes.insert("method".to_owned(), name.clone().into());
        let file = with_method(scenario.clone(), &name);
        (Setting { axes, set: set.clone(), method: Some(name) }, file)
    };
    names.into_iter().map(alone).collect()
}

/// The scenario with one of its methods as its tracker; unchanged if it does not have the method.
pub(super) fn with_method(mut file: ScenarioFile, name: &str) -> ScenarioFile {
    let tracker: Option<TrackerSettings> = file.scenario.methods.remove(name);
    if tracker.is_some() {
        file.scenario.tracker = tracker;
        file.scenario.methods.clear();
    }
    file
}

/// Overrides of a combination. Values that are tables or set several keys come first, so that choosing a tracker does
/// not undo other axes that set its keys.
fn overrides(combination: &Combination) -> Vec<String> {
    let is_broad = |value: &&AxisValue| value.is_name || value.label.is_object();
    let (broad, narrow): (Vec<&AxisValue>, Vec<&AxisValue>) = combination.values().partition(is_broad);
    broad.into_iter().chain(narrow).flat_map(|value| value.set.iter().cloned()).collect()
}

fn combinations(file: &SweepFile) -> Result<Vec<Combination>, ExperimentError> {
    let complain =
        |key: &str, message: String| -> ExperimentError { ScenarioError::from(file.complaint(key, message)).into() };
    let sweep = &file.sweep;
    let axes = file.axes().map_err(ScenarioError::from)?;
    match sweep.method {
        Expansion::List => Ok(file.points().map_err(ScenarioError::from)?),
        Expansion::Random => {
            let samples = sweep.samples.unwrap_or_default() as usize;
            let most = combinations_at_most(&axes).min(MOST_SETTINGS);
            if samples > most {
                let why = if most < MOST_SETTINGS { ", all combinations of the axes" } else { "" };
                return Err(complain("samples", format!("expected at most {most}{why}, found {samples}")));
            }
            let drawn = drawn_different(&axes, u64::from(sweep.random_seed), samples);
            if drawn.len() < samples {
                let message =
                    format!("expected fewer: {} draws gave only {} different settings", DRAWS * samples, drawn.len());
                return Err(complain("samples", message));
            }
            Ok(drawn)
        }
        Expansion::Grid => {
            let sizes = axes.values().map(|axis| values(axis).len());
            let size = sizes.clone().try_fold(1_usize, usize::checked_mul).filter(|size| *size <= MOST_SETTINGS);
            let size = size.ok_or_else(|| {
                let sizes: Vec<String> = sizes.map(|size| size.to_string()).collect();
                complain("axes", format!("expected at most {MOST_SETTINGS} settings, found {}", sizes.join(" x ")))
            })?;
            Ok((0..size).map(|index| of_grid(&axes, index)).collect())
        }
        Expansion::OneAtATime => {
            let first: Combination = axes.iter().map(|(key, axis)| (key.clone(), values(axis)[0].clone())).collect();
            let mut combinations = vec![first.clone()];
            for (key, axis) in &axes {
                for value in &values(axis)[1..] {
                    let mut one = first.clone();
                    one.insert(key.clone(), value.clone());
                    combinations.push(one);
                }
            }
            Ok(combinations)
        }
        Expansion::Zip => {
            let lengths: Vec<(&String, usize)> = axes.iter().map(|(key, axis)| (key, values(axis).len())).collect();
            let first = lengths.first().map_or(1, |(_, length)| *length);
            if let Some((key, length)) = lengths.iter().find(|(_, length)| *length != first) {
                let message = format!(
                    "with method = \"zip\", expected as many values as `{}` has, {first}, found {length}",
                    lengths[0].0
                );
                return Err(complain(&format!("axes.{key}"), message));
            }
            let of = |index: usize| axes.iter().map(|(key, axis)| (key.clone(), values(axis)[index].clone())).collect();
            Ok((0..first).map(of).collect())
        }
    }
}

fn values(axis: &SweepAxis) -> &[AxisValue] {
    match axis {
        SweepAxis::Values(values) => values,
        SweepAxis::Range { .. } => &[],
    }
}

fn of_grid(axes: &BTreeMap<String, SweepAxis>, index: usize) -> Combination {
    let mut left = index;
    let mut combination = Combination::new();
    for (key, axis) in axes.iter().rev() {
        let values = values(axis);
        combination.insert(key.clone(), values[left % values.len()].clone());
        left /= values.len();
    }
    combination
}

/// An upper bound on the number of different random settings.
fn combinations_at_most(axes: &BTreeMap<String, SweepAxis>) -> usize {
    let sizes = axes.values().map(|axis| match axis {
        SweepAxis::Values(values) => values.len(),
        SweepAxis::Range { ends: [low, high], integer: true, .. } => (high.round() - low.round()) as usize + 1,
        SweepAxis::Range { .. } => MOST_SETTINGS,
    });
    sizes.fold(1, usize::saturating_mul)
}

/// The first draws that differ from all previous ones; fewer than `count` if draws repeat too often.
fn drawn_different(axes: &BTreeMap<String, SweepAxis>, seed: u64, count: usize) -> Vec<Combination> {
    let (mut known, mut different) = (HashSet::new(), Vec::new());
    for sample in 0..count.saturating_mul(DRAWS) {
        if different.len() == count {
            break;
        }
        let combination = drawn(axes, seed, sample as u64);
        let labels: Vec<String> = combination.values().map(|value| value.label.to_string()).collect();
        if known.insert(labels.join("\n")) {
            different.push(combination);
        }
    }
    different
}

/// One draw of every axis, each from a separate random stream.
fn drawn(axes: &BTreeMap<String, SweepAxis>, seed: u64, sample: u64) -> Combination {
    let draw = |(number, (key, axis)): (usize, (&String, &SweepAxis))| {
        let share: f64 = stream(seed, Purpose::Sweep, sample, number as u64, 0).random();
        let value = match axis {
            SweepAxis::Values(values) => values[((share * values.len() as f64) as usize).min(values.len() - 1)].clone(),
            SweepAxis::Range { ends: [low, high], logarithmic, integer } => {
                let value = if *logarithmic {
                    libm::exp(libm::log(*low) + share * (libm::log(*high) - libm::log(*low)))
                } else {
                    low + share * (high - low)
                };
                let number = if *integer {
                    Number::from(value.round() as i64)
                } else {
                    Number::from_f64(six_digits(value)).unwrap_or_else(|| 0.into())
                };
                AxisValue { label: number.clone().into(), is_name: false, set: vec![format!("{key}={number}")] }
            }
        };
        (key.clone(), value)
    };
    axes.iter().enumerate().map(draw).collect()
}

/// Rounds to a readable number of digits; the rounded value is the one that is planned and run.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn made(text: &str) -> Result<Vec<Setting>, String> {
        let text = format!("schema = \"skiagraph.sweep/1\"\nname = \"a\"\n{text}");
        let file = SweepFile::parse(&text, "a.toml", PathBuf::new()).map_err(|e| e.to_string())?;
        let template = ScenarioTemplate::new(ScenarioFile::built_in(&file.sweep.set).unwrap()).unwrap();
        settings(&file, &template, |setting, _| Ok(setting)).map_err(|e| e.to_string())
    }

    fn values_of(text: &str) -> Vec<String> {
        let of = |setting: Setting| setting.axes.values().map(ToString::to_string).collect::<Vec<_>>().join(" ");
        made(text).unwrap().into_iter().map(of).collect()
    }

    #[test]
    fn a_grid_has_every_combination_and_the_last_axis_varies_fastest() {
        let grid = values_of("[axes]\nparticles = [50, 100]\nrig.ring.count = [2, 3, 4]\n");
        assert_eq!(grid, ["50 2", "50 3", "50 4", "100 2", "100 3", "100 4"]);
        assert_eq!(made("").unwrap().len(), 1, "without axes there is one setting");
    }

    #[test]
    fn one_axis_at_a_time_varies_from_the_first_values() {
        let text = "method = \"one_at_a_time\"\n[axes]\nlayers = [3, 1, 2]\nparticles = [50, 100]\n";
        assert_eq!(values_of(text), ["3 50", "1 50", "2 50", "3 100"]);
    }

    #[test]
    fn a_zip_pairs_values_and_refuses_axes_of_unequal_length() {
        assert_eq!(values_of("method = \"zip\"\n[axes]\nlayers = [1, 2]\nparticles = [100, 50]\n").len(), 2);
        let error = made("method = \"zip\"\n[axes]\nlayers = [1, 2]\nparticles = [100]\n").unwrap_err();
        assert!(
            error.contains("axes.particles: with method = \"zip\", expected as many values as `layers` has, 2"),
            "{error}"
        );
    }

    #[test]
    fn a_list_has_its_points_each_with_its_own_keys() {
        let text = "method = \"list\"\n[[points]]\nparticles = 20\nrig.ring.count = 2\n[[points]]\nlayers = 3\n";
        assert_eq!(values_of(text), ["20 2", "3"]);
    }

    #[test]
    fn random_settings_lie_in_their_ranges_and_are_the_same_each_time() {
        let text = "method = \"random\"\nsamples = 200\n[axes]\nparticles = { log_uniform = [10, 1000], integer = true }\n\
                    survival_rate = { uniform = [0.2, 0.8] }\nlayers = [1, 2]\n";
        let settings = made(text).unwrap();
        assert_eq!(settings, made(text).unwrap());
        assert_ne!(settings, made(&text.replace("samples = 200", "samples = 200\nrandom_seed = 1")).unwrap());
        let number = |name: &str| settings.iter().map(|s| s.axes[name].as_f64().unwrap()).collect::<Vec<_>>();
        let (particles, rates) = (number("particles"), number("survival_rate"));
        assert!(particles.iter().all(|p| (10.0..=1000.0).contains(p) && p.fract() == 0.0));
        assert!(rates.iter().all(|p| (0.2..=0.8).contains(p)));
        // on a logarithmic scale half of the draws lie below the geometric mean, 100: of 200 draws 100 +- 4 sigma
        let below = particles.iter().filter(|p| **p < 100.0).count();
        assert!((72..=128).contains(&below), "{below}");
        let twos = number("layers").iter().filter(|layers| **layers == 2.0).count();
        assert!((72..=128).contains(&twos), "{twos}");
    }

    #[test]
    fn more_random_settings_than_there_are_combinations_are_refused_before_any_is_drawn() {
        let text = "method = \"random\"\nsamples = 1000000\n[axes]\nlayers = [1, 2]\n\
                    particles = { uniform = [10, 12], integer = true }\n";
        let error = made(text).unwrap_err();
        let expected = "a.toml:4: samples: expected at most 6, all combinations of the axes, found 1000000";
        assert!(error.starts_with(expected), "{error}");
    }

    #[test]
    fn random_settings_are_all_different_and_may_exhaust_the_combinations() {
        let text = "method = \"random\"\nsamples = 6\n[axes]\nlayers = [1, 2]\nparticles = [10, 11, 12]\n";
        let mut values = values_of(text);
        values.sort();
        assert_eq!(values, ["1 10", "1 11", "1 12", "2 10", "2 11", "2 12"]);
        // 1 in 10^12 draws is the least: the rest is the greatest
        let rare = "method = \"random\"\nsamples = 2\n[axes]\nrig.ring.count = { uniform = [3.4999999999, 4], integer = true }\n";
        let error = made(rare).unwrap_err();
        assert!(error.contains("samples: expected fewer: 40 draws gave only 1 different settings"), "{error}");
    }

    #[test]
    fn a_tracker_is_chosen_before_its_keys_are_set_regardless_of_alphabetical_order() {
        let text = "[axes]\nlayers = [2]\ntracker = [{ annealed_particle_filter = { paper = true } }]\n";
        let settings = made(text).unwrap();
        assert_eq!(settings[0].set, ["tracker={ annealed_particle_filter = { paper = true } }", "layers=2"]);
    }

    #[test]
    fn too_many_settings_and_values_out_of_range_are_refused() {
        let many: Vec<String> = (1..=1001).map(|n| n.to_string()).collect();
        let axis = |key: &str| format!("{key} = [{}]\n", many.join(", "));
        let error = made(&format!("[axes]\n{}{}", axis("particles"), axis("layers"))).unwrap_err();
        assert!(error.contains("expected at most 1000000 settings, found 1001 x 1001"), "{error}");
        let error = made("[axes]\nlayers = [2]\nparticles = [5, 0]\n").unwrap_err();
        assert!(error.starts_with("a.toml:5: axes.particles: ") && error.contains("found 0"), "{error}");
    }
}
