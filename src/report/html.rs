//! Renders pages from templates: the shared shell and style, and the content of a page.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior, Value};
use serde::Serialize;

use super::ReportError;
use super::plots::{css_rules, css_variables};

const SHELL: &str = include_str!("shell.html");
const FACTS: &str = include_str!("facts.html");
/// Script of every page: table of contents and sortable tables.
const SCRIPT: &str = include_str!("shell.js");
const TRANSPORT: &str = include_str!("transport.html");
const STYLE: &str = include_str!("page.css");

/// Renders a self-contained page: `template` extends `shell.html`, `page` has the values.
pub(crate) fn render_page(template: &str, page: &impl Serialize) -> Result<String, ReportError> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_template("shell.html", SHELL)?;
    environment.add_template("facts.html", FACTS)?;
    environment.add_template("transport.html", TRANSPORT)?;
    environment.add_template("page.html", template)?;
    environment.add_global("style", style());
    environment.add_global("shell_script", SCRIPT);
    environment.add_global("generator", super::GENERATOR);
    Ok(environment.get_template("page.html")?.render(Value::from(Serde(page)))?)
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
