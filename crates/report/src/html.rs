//! Renders pages from templates: the shared shell and style, and the content of a page.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{Environment, Error, ErrorKind, UndefinedBehavior, Value};
use serde::Serialize;

use super::ReportError;
use super::difference_text::cell;
use super::displayed::{between, number, symbol};
use super::plots::{css_rules, css_variables};
use skiagraph_eval::{Unit, find_metric};

const SHELL: &str = include_str!("shell.html");
const FACTS: &str = include_str!("facts.html");
/// Script of every page: table of contents and sortable tables.
const SCRIPT: &str = include_str!("shell.js");
const TRANSPORT: &str = include_str!("transport.html");
const STYLE: &str = include_str!("page.css");

/// Renders a self-contained page: `template` extends `shell.html`, `page` has the values.
pub fn render_page(template: &str, page: &impl Serialize) -> Result<String, ReportError> {
    let mut environment = environment()?;
    environment.add_template("shell.html", SHELL)?;
    environment.add_template("facts.html", FACTS)?;
    environment.add_template("transport.html", TRANSPORT)?;
    environment.add_template("page.html", template)?;
    environment.add_global("style", style());
    environment.add_global("shell_script", SCRIPT);
    Ok(environment.get_template("page.html")?.render(Value::from(Serde(page)))?)
}

/// Renders a text, such as Markdown.
pub fn render_text(template: &str, page: &impl Serialize) -> Result<String, ReportError> {
    let mut environment = environment()?;
    environment.add_template("text.md", template)?;
    Ok(environment.get_template("text.md")?.render(Value::from(Serde(page)))?)
}

/// The filters of all templates; units are named as in files.
fn environment<'a>() -> Result<Environment<'a>, Error> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_global("generator", super::GENERATOR);
    environment.add_filter("shown", shown);
    environment.add_filter("interval", interval);
    environment.add_filter("symbol", |unit: &str| unit_of(unit).map(symbol));
    environment.add_filter("cell", cell);
    environment.add_filter("metric_title", |name: &str| find_metric(name).map(|metric| metric.title));
    Ok(environment)
}

/// `value|shown("mm")`: a value with the decimals of its unit; a dash without a value.
fn shown(value: Option<f64>, unit: &str) -> Result<String, Error> {
    let unit = unit_of(unit)?;
    Ok(value.map_or_else(|| "–".to_owned(), |value| number(value, unit)))
}

/// `ci95|interval("mm")`: an interval in words; a dash without one.
fn interval(ends: Option<Vec<f64>>, unit: &str) -> Result<String, Error> {
    let unit = unit_of(unit)?;
    Ok(match ends.as_deref() {
        Some([low, high]) => between(*low, *high, unit),
        _ => "–".to_owned(),
    })
}

fn unit_of(name: &str) -> Result<Unit, Error> {
    let unknown = |_| Error::new(ErrorKind::InvalidOperation, format!("unknown unit {name}"));
    serde_json::from_value(name.into()).map_err(unknown)
}

fn style() -> String {
    let (light, dark, rules) = (css_variables(false), css_variables(true), css_rules());
    format!(":root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n{rules}\n{STYLE}")
}

/// JSON for a page, escaped so that it cannot end a script element.
pub(super) fn in_page(data: &impl Serialize) -> Result<String, ReportError> {
    let text = serde_json::to_string(data).map_err(|error| ReportError::Plot(error.to_string()))?;
    Ok(text.replace('<', "\\u003c"))
}
