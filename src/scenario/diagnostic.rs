//! Errors of a scenario: position, problem, and what to do.

use std::fmt;
use std::ops::Range;

use strsim::levenshtein;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use skiagraph_core::input::{excerpt, harmless, is_own_output, plain};

const SHOWN_OF_LINE: usize = 160;
/// Number of displayed characters of a long line before the mark.
const SHOWN_BEFORE: usize = 100;

/// One error of a scenario, printed as `file:line: key: message` with the line and a caret below.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostic {
    /// The file as named by the user, or what is wrong on the command line.
    pub origin: String,
    /// The override with the error; `None` for an error in a file.
    pub assignment: Option<String>,
    /// Its position in the file; `None` for an override and for a missing key.
    pub place: Option<Box<LineSpan>>,
    /// Dotted key; empty if the file is not TOML.
    pub key: String,
    /// What was expected, what was found, and what to do.
    pub message: String,
}

/// A part of one line of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LineSpan {
    /// Line number, from 1.
    pub line: usize,
    /// Column of the first character, from 1.
    pub column: usize,
    /// Number of characters marked, at least 1.
    pub width: usize,
    /// The line itself; empty if it must not be shown.
    pub text: String,
}

impl LineSpan {
    pub(super) fn from_span(text: &str, span: &Range<usize>) -> Self {
        let start = floor_char_boundary(text, span.start);
        let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line = text[line_start..].lines().next().unwrap_or_default();
        let end = floor_char_boundary(text, span.end).clamp(start, (line_start + line.len()).max(start));
        Self {
            line: text[..start].matches('\n').count() + 1,
            column: text[line_start..start].chars().count() + 1,
            width: text[start..end].chars().count().max(1),
            text: line.to_owned(),
        }
    }

    /// As [`Self::from_span`], but the line is only shown if the file declares a format of this program. Boxed, so that
    /// errors stay small.
    pub(crate) fn of_file(text: &str, span: &Range<usize>) -> Box<Self> {
        let place = Self::from_span(text, span);
        Box::new(if is_own_output(text.as_bytes()) { place } else { Self { text: String::new(), ..place } })
    }
}

impl LineSpan {
    /// The displayed part of the line (for long lines the part around the mark), the number of characters before the
    /// mark, and the mark's width.
    fn window(&self) -> (String, usize, usize) {
        let is_long = self.text.chars().nth(SHOWN_OF_LINE).is_some();
        let first = if is_long { self.column.saturating_sub(SHOWN_BEFORE) } else { 0 };
        let text: String = self.text.chars().skip(first).take(SHOWN_OF_LINE).map(harmless).collect();
        let skip = self.column - 1 - first;
        let width = self.width.min(text.chars().count().saturating_sub(skip)).max(1);
        (text, skip, width)
    }
}

fn floor_char_boundary(text: &str, index: usize) -> usize {
    (0..=index.min(text.len())).rev().find(|i| text.is_char_boundary(*i)).unwrap_or(0)
}

impl Diagnostic {
    pub(crate) fn of_override(assignment: &str, message: String) -> Self {
        let origin = format!("override {assignment}");
        Self { origin, assignment: Some(assignment.to_owned()), message, ..Self::default() }
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", excerpt(&self.origin))?;
        if let Some(place) = &self.place {
            write!(f, ":{}", place.line)?;
        }
        if !self.key.is_empty() {
            write!(f, ": {}", excerpt(&self.key))?;
        }
        write!(f, ": {}", plain(&self.message))?;
        if let Some(place) = self.place.as_ref().filter(|place| !place.text.is_empty()) {
            let (text, skip, width) = place.window();
            let (line, gutter) = (place.line, place.line.to_string().len());
            write!(f, "\n  {line} | {text}\n  {:gutter$} | {:skip$}{}", "", "", "^".repeat(width))?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostic {}

/// Position of a dotted key in a TOML text, and its value.
pub(crate) struct KeySpan {
    pub(crate) key: Range<usize>,
    pub(crate) value: Range<usize>,
}

/// Position of a dotted key; `None` if the text does not contain it.
pub(crate) fn locate(text: &str, key: &str) -> Option<KeySpan> {
    let document = DeTable::parse(text).ok()?;
    let mut segments = key.split(['.', '[', ']']).filter(|s| !s.is_empty());
    let (mut key, mut value) = find(document.get_ref(), segments.next()?)?;
    for segment in segments {
        (key, value) = match value.get_ref() {
            DeValue::Table(table) => find(table, segment)?,
            DeValue::Array(array) => (key, array.get(segment.parse::<usize>().ok()?)?),
            _ => return None,
        };
    }
    Some(KeySpan { key: key.span(), value: value.span() })
}

type TomlEntry<'a, 'i> = (&'a Spanned<DeString<'i>>, &'a Spanned<DeValue<'i>>);

fn find<'a, 'i>(table: &'a DeTable<'i>, key: &str) -> Option<TomlEntry<'a, 'i>> {
    table.iter().find(|(k, _)| k.get_ref() == key)
}

/// The candidate most similar to a misspelt word, if at most two letters, or a third of them, differ.
pub(crate) fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // misspelt words are not that long, and the cost of the comparison grows with the length
    if word.len() > 256 {
        return None;
    }
    let (distance, best) = candidates.into_iter().map(|c| (levenshtein(word, c), c)).min_by_key(|(d, _)| *d)?;
    let letters = word.chars().count();
    (distance < letters && distance <= (letters / 3).max(2)).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bad(origin: &str, place: LineSpan, key: &str) -> Diagnostic {
        let [origin, key, message] = [origin, key, "bad"].map(str::to_owned);
        Diagnostic { origin, place: Some(Box::new(place)), key, message, ..Diagnostic::default() }
    }

    #[test]
    fn a_near_miss_is_suggested_and_a_far_one_is_not() {
        let known = ["particles", "layers", "survival_rate"];
        assert_eq!(did_you_mean("partciles", known), Some("particles"));
        assert_eq!(did_you_mean("wlak", ["run", "walk", "jump"]), Some("walk"));
        assert_eq!(did_you_mean("colour", known), None);
        assert_eq!(did_you_mean("x", ["up"]), None);
    }

    #[test]
    fn the_caret_is_below_the_value_even_after_wide_characters() {
        let text = "a = 1\nname = \"é\"\n[t]\nkey = -4 # x\n";
        let place = LineSpan::from_span(text, &locate(text, "t.key").unwrap().value);
        assert_eq!((place.line, place.column, place.width), (4, 7, 2));
        let diagnostic = bad("f.toml", place, "t.key");
        assert_eq!(diagnostic.to_string(), "f.toml:4: t.key: bad\n  4 | key = -4 # x\n    |       ^^");
    }

    #[test]
    fn only_the_part_around_the_mark_of_a_very_long_line_is_shown() {
        let text = format!("a = [{}]\nb = \"\u{1b}[2J{}\"\n", "1, ".repeat(300_000), "x".repeat(1_000_000));
        let span = text.rfind("1, ]").unwrap();
        let place = LineSpan::from_span(&text, &(span..span + 1));
        let shown = bad("f", place, "a").to_string();
        assert!(shown.len() < 400, "{}", shown.len());
        let lines: Vec<&str> = shown.lines().collect();
        let caret = lines[2].find('^').unwrap();
        assert_eq!(&lines[1][caret..caret + 2], "1,");
        let start = text.find("b = ").unwrap() + 4;
        let place = LineSpan::from_span(&text, &(start..text.len() - 1));
        let shown = bad("f", place, "b").to_string();
        assert!(shown.chars().count() < 500 && !shown.contains('\u{1b}'), "{shown}");
    }

    #[test]
    fn a_key_is_found_inside_arrays_of_tables() {
        let text = "[[c]]\nx = 1\n[[c]]\nx = 22\n";
        let spot = locate(text, "c[1].x").unwrap();
        assert_eq!((&text[spot.key], &text[spot.value]), ("x", "22"));
        assert!(locate(text, "c[2].x").is_none());
    }
}
