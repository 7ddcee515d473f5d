//! Selects the settings to keep: an equal budget, and conditions.

use std::collections::BTreeMap;

use minijinja::{Environment, Expression, UndefinedBehavior, Value as Operand};
use serde_json::{Map, Value};

use super::definition::SweepBudget;
use super::file::{AxisValue, SweepFile};
use crate::common::ExperimentError;
use crate::scenario::{Scenario, ScenarioError, ScenarioFile, ScenarioTemplate};

/// Default relative tolerance of a budget whose `solve` key is rounded to a whole number.
const ROUNDING: f64 = 0.05;

/// The budget and the conditions of a sweep.
pub(super) struct Constraints<'a> {
    file: &'a SweepFile,
    template: &'a ScenarioTemplate,
}

impl<'a> Constraints<'a> {
    /// Reads the constraints of a sweep.
    ///
    /// # Errors
    /// [`ExperimentError`] for a condition that is not an expression.
    pub(super) fn new(file: &'a SweepFile, template: &'a ScenarioTemplate) -> Result<Self, ExperimentError> {
        let constraints = Self { file, template };
        let environment = environment();
        (0..file.sweep.keep.len()).try_for_each(|index| constraints.condition(&environment, index).map(drop))?;
        Ok(constraints)
    }

    /// The overrides of a combination, including the key that the budget solves for, and the resulting scenario; `None`
    /// if the combination is not kept.
    ///
    /// # Errors
    /// [`ExperimentError`] if the overrides make the scenario invalid, or a constraint uses an unknown name.
    pub(super) fn complete(
        &self,
        combination: &BTreeMap<String, AxisValue>,
        mut set: Vec<String>,
    ) -> Result<Option<(Vec<String>, ScenarioFile)>, ExperimentError> {
        let mut scenario = self.template.with(&set)?;
        if let Some(budget) = &self.file.sweep.budget {
            if let Some(key) = &budget.solve {
                let others = budget.product.iter().filter(|other| *other != key);
                let left = budget.equals / self.product(others, combination, &scenario.scenario)?;
                if left.round() < 1.0 {
                    return Ok(None);
                }
                set.push(format!("{key}={}", left.round() as u64));
                scenario = self.template.with(&set)?;
            }
            let product = self.product(budget.product.iter(), combination, &scenario.scenario)?;
            if (product / budget.equals - 1.0).abs() > tolerance(budget) + 1e-12 {
                return Ok(None);
            }
        }
        if self.file.sweep.keep.is_empty() {
            return Ok(Some((set, scenario)));
        }
        let environment = environment();
        for index in 0..self.file.sweep.keep.len() {
            if !self.holds(&environment, index, combination, &scenario.scenario)? {
                return Ok(None);
            }
        }
        Ok(Some((set, scenario)))
    }

    /// The error if none of this many combinations is kept.
    pub(super) fn nothing_left(&self, combinations: usize) -> ExperimentError {
        let sweep = &self.file.sweep;
        let (key, message) = match &sweep.budget {
            Some(budget) => (
                "budget",
                format!(
                    "none of {combinations} settings has {} = {} (within {} %){}: the budget contradicts the axes",
                    budget.product.join(" x "),
                    budget.equals,
                    100.0 * tolerance(budget),
                    if sweep.keep.is_empty() { "" } else { " and meets `keep`" },
                ),
            ),
            None => ("keep", format!("none of {combinations} settings meets all conditions: the grid is empty")),
        };
        self.complain(key, message)
    }

    fn product<'k>(
        &self,
        keys: impl Iterator<Item = &'k String>,
        combination: &BTreeMap<String, AxisValue>,
        scenario: &Scenario,
    ) -> Result<f64, ExperimentError> {
        let mut product = 1.0;
        for key in keys {
            let value = self.value(key, combination, scenario);
            product *= value.as_ref().and_then(Value::as_f64).ok_or_else(|| {
                let found = value.map_or("none".to_owned(), |value| value.to_string());
                let message =
                    format!("expected a number at `{key}`, found {found}; make it an axis or add it to `set`");
                self.complain("budget.product", message)
            })?;
        }
        Ok(product)
    }

    /// The value of an axis, or of a key of the scenario.
    fn value(&self, name: &str, combination: &BTreeMap<String, AxisValue>, scenario: &Scenario) -> Option<Value> {
        match combination.get(name) {
            Some(value) => Some(value.label.clone()),
            None => self.template.value(scenario, name),
        }
    }

    fn condition<'e>(
        &self,
        environment: &'e Environment<'_>,
        index: usize,
    ) -> Result<Expression<'e, 'e>, ExperimentError>
    where
        'a: 'e,
    {
        let text: &'a str = &self.file.sweep.keep[index];
        environment.compile_expression(text).map_err(|e| {
            let message = format!("expected a condition such as \"particles * layers <= 2000\", found {text:?}: {e}");
            self.complain(&format!("keep[{index}]"), message)
        })
    }

    fn holds(
        &self,
        environment: &Environment<'_>,
        index: usize,
        combination: &BTreeMap<String, AxisValue>,
        scenario: &Scenario,
    ) -> Result<bool, ExperimentError> {
        let condition = self.condition(environment, index)?;
        let complain = |message: String| self.complain(&format!("keep[{index}]"), message);
        let mut names: Vec<String> = condition.undeclared_variables(true).into_iter().collect();
        names.sort();
        let mut context = Map::new();
        for name in names {
            let value = self.value(&name, combination, scenario).ok_or_else(|| {
                complain(format!("`{name}` is not an axis and has no value in the scenario; add it to `set`"))
            })?;
            insert(&mut context, &name, value);
        }
        let found = condition
            .eval(Operand::from(minijinja::value::Serde(context)))
            .map_err(|e| complain(format!("cannot be evaluated: {e}")))?;
        match found.try_into() {
            Ok(holds) => Ok(holds),
            Err(_) => Err(complain("expected a condition that is true or false".to_owned())),
        }
    }

    fn complain(&self, key: &str, message: String) -> ExperimentError {
        ScenarioError::from(self.file.complaint(key, message)).into()
    }
}

fn tolerance(budget: &SweepBudget) -> f64 {
    budget.tolerance.unwrap_or(if budget.solve.is_some() { ROUNDING } else { 0.0 })
}

fn environment() -> Environment<'static> {
    let mut environment = Environment::empty();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment
}

/// Inserts a value at the path of a dotted name.
fn insert(context: &mut Map<String, Value>, name: &str, value: Value) {
    match name.split_once('.') {
        None => drop(context.insert(name.to_owned(), value)),
        Some((table, rest)) => {
            let slot = context.entry(table.to_owned()).or_insert_with(|| Value::Object(Map::new()));
            if let Value::Object(inner) = slot {
                insert(inner, rest, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::super::settings::settings;
    use super::*;

    fn kept(text: &str) -> Result<Vec<String>, String> {
        let text = format!("schema = \"skiagraph.sweep/1\"\nname = \"a\"\n{text}");
        let file = SweepFile::parse(&text, "a.toml", PathBuf::new()).map_err(|e| e.to_string())?;
        let template = ScenarioTemplate::new(ScenarioFile::built_in(&file.sweep.set).unwrap()).unwrap();
        settings(&file, &template, |setting, _| Ok(setting.set.join(" "))).map_err(|e| e.to_string())
    }

    const AXES: &str = "[axes]\nlayers = [1, 2, 4, 3]\nparticles = [100, 50, 25]\n";

    #[test]
    fn a_budget_keeps_settings_of_equal_cost() {
        let text = format!("[budget]\nproduct = [\"particles\", \"layers\"]\nequals = 100\n{AXES}");
        assert_eq!(kept(&text).unwrap(), ["layers=1 particles=100", "layers=2 particles=50", "layers=4 particles=25"]);
        // 3 x 25 = 75 and 4 x 25 = 100, 3 x 50 = 150
        let loose = text.replace("equals = 100", "equals = 100\ntolerance = 0.25");
        assert_eq!(kept(&loose).unwrap().len(), 4);
    }

    #[test]
    fn a_budget_may_be_solved_for_a_key() {
        let text = "[budget]\nproduct = [\"particles\", \"layers\"]\nequals = 1000\nsolve = \"particles\"\n\
                    [axes]\nlayers = [1, 3, 10]\n";
        assert_eq!(
            kept(text).unwrap(),
            ["layers=1 particles=1000", "layers=3 particles=333", "layers=10 particles=100"]
        );
        // 10 / 3 is 3 particles, 10 % off; 10 / 7 is 1, 30 % off
        assert!(kept(&text.replace("1000", "10").replace("10]", "7]")).unwrap().len() == 1);
    }

    #[test]
    fn a_budget_that_nothing_meets_contradicts_the_axes() {
        let text = format!("[budget]\nproduct = [\"particles\", \"layers\"]\nequals = 7\n{AXES}");
        let error = kept(&text).unwrap_err();
        assert!(error.contains("a.toml:3: budget: none of 12 settings has particles x layers = 7"), "{error}");
        let text = "[budget]\nproduct = [\"particles\", \"layers\"]\nequals = 7\n[axes]\nlayers = [1]\n";
        let error = kept(text).unwrap_err();
        assert!(error.contains("budget.product: expected a number at `particles`, found none"), "{error}");
    }

    #[test]
    fn conditions_may_use_axes_and_any_key_of_the_scenario() {
        let keep = |condition: &str| kept(&format!("keep = [{condition:?}]\n{AXES}"));
        assert_eq!(keep("particles * layers <= 100").unwrap().len(), 7);
        assert_eq!(keep("particles * layers <= 100 and rig.ring.count == 4 and layers > 1").unwrap().len(), 4);
        assert_eq!(keep("survival_rate > 0.4 and particles == 25").unwrap().len(), 4);
    }

    #[test]
    fn conditions_of_ten_thousand_signs_or_nots_are_refused_and_do_not_overflow_the_stack() {
        let keep = |condition: String| kept(&format!("keep = [{condition:?}]\n{AXES}"));
        for (sign, rest) in [("-", "layers < 0"), ("not ", "true"), ("(", "true"), ("1+", "1 == 3"), ("1<", "2")] {
            let error = keep(format!("{}{rest}", sign.repeat(10_000))).unwrap_err();
            assert!(error.contains("keep[0]: expected a condition of at most 1000 characters, found"), "{error}");
        }
        // the longest accepted conditions, on a thread with a small stack
        let deep = |sign: &str, times: usize, rest: &str| format!("{}{rest}", sign.repeat(times));
        let all =
            [deep("-", 990, "1 == 1"), deep("not ", 248, "true"), deep("1+", 490, "1 == 491"), deep("1<", 490, "1")];
        let read = move || all.map(|condition| kept(&format!("keep = [{condition:?}]\n{AXES}")));
        let small = std::thread::Builder::new().stack_size(1 << 20).spawn(read).unwrap();
        let found = small.join().unwrap();
        assert_eq!(found.map(|kept| kept.is_ok_and(|kept| kept.len() == 12)), [true, true, true, false]);
    }

    #[test]
    fn invalid_conditions_are_refused() {
        for (condition, words) in [
            ("particles *", "keep[0]: expected a condition"),
            ("partciles > 3", "keep[0]: `partciles` is not an axis and has no value"),
            ("particles + layers", "keep[0]: expected a condition that is true or false"),
            ("particles < 0", "keep: none of 12 settings meets all conditions: the grid is empty"),
            ("particles < 'many' + 3", "keep[0]: cannot be evaluated"),
        ] {
            let error = kept(&format!("keep = [{condition:?}]\n{AXES}")).unwrap_err();
            assert!(error.contains(words), "{condition}: {error}");
        }
    }
}
