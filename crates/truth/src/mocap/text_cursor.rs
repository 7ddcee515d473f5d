//! A cursor over a text file that tracks the line number.

use std::fmt::Display;
use std::iter::Enumerate;
use std::str::SplitWhitespace;

use super::MocapError;

/// Upper bound of lengths and angles in real recordings, in any unit.
const MAX_NUMBER: f64 = 1e7;

/// The lines of a text, which end in LF, CR LF, or CR alone as on old Macintoshes.
pub(super) struct Lines<'a>(pub(super) &'a str);

impl<'a> Iterator for Lines<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        if self.0.is_empty() {
            return None;
        }
        let end = self.0.bytes().position(|byte| byte == b'\n' || byte == b'\r').unwrap_or(self.0.len());
        let (line, rest) = self.0.split_at(end);
        self.0 = rest.strip_prefix("\r\n").or_else(|| rest.get(1..)).unwrap_or_default();
        Some(line)
    }
}

/// Reads words, numbers and lines. Skips blank lines and lines that start with `#`.
pub(super) struct TextCursor<'a> {
    file: &'a str,
    lines: Enumerate<Lines<'a>>,
    line: usize,
    rest_of_line: SplitWhitespace<'a>,
    /// The rest of a word of which a part was read.
    rest_of_word: Option<&'a str>,
    /// Whether all lines were read.
    pub(super) ended: bool,
    /// Whether the file starts like its format; messages quote nothing from other files.
    is_recognised: bool,
}

impl<'a> TextCursor<'a> {
    pub(super) fn new(text: &'a str, file: &'a str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let (lines, rest_of_line) = (Lines(text).enumerate(), "".split_whitespace());
        Self { file, lines, line: 1, rest_of_line, rest_of_word: None, ended: false, is_recognised: false }
    }

    /// Marks the file as one of the expected format: from here on messages may quote its words.
    pub(super) fn set_recognised(&mut self) {
        self.is_recognised = true;
    }

    /// The current line, counted from 1.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// Advances to the next line and returns it trimmed; the rest of the current line is skipped.
    pub(super) fn next_line(&mut self) -> Option<&'a str> {
        self.rest_of_word = None;
        for (index, line) in self.lines.by_ref() {
            self.line = index + 1;
            let line = line.trim();
            if !line.is_empty() && !line.starts_with('#') {
                self.rest_of_line = line.split_whitespace();
                return Some(line);
            }
        }
        self.rest_of_line = "".split_whitespace();
        self.ended = true;
        None
    }

    /// The next word of this line.
    pub(super) fn word_in_line(&mut self) -> Option<&'a str> {
        self.rest_of_word.take().or_else(|| self.rest_of_line.next())
    }

    /// The next word, on this line or a later one.
    pub(super) fn word(&mut self, expected: &str) -> Result<&'a str, MocapError> {
        loop {
            if let Some(word) = self.word_in_line() {
                return Ok(word);
            }
            if self.next_line().is_none() {
                return Err(self.unexpected(expected, None));
            }
        }
    }

    /// The next word, which must be `keyword` in upper or lower case.
    pub(super) fn keyword(&mut self, keyword: &str) -> Result<(), MocapError> {
        let expected = format!("`{keyword}`");
        let word = self.word(&expected)?;
        if word.eq_ignore_ascii_case(keyword) { Ok(()) } else { Err(self.unexpected(&expected, Some(word))) }
    }

    /// The next word, which must be `label`, in upper or lower case; its colon may stand apart, and its value touch it.
    pub(super) fn label(&mut self, label: &str) -> Result<(), MocapError> {
        let expected = format!("`{label}:`");
        let word = self.word(&expected)?;
        let is_label = |start: &str| start.eq_ignore_ascii_case(label);
        let Some((_, rest)) = word.split_at_checked(label.len()).filter(|(start, _)| is_label(start)) else {
            return Err(self.unexpected(&expected, Some(word)));
        };
        let rest = if rest.is_empty() { self.word(&expected)? } else { rest };
        let value = rest.strip_prefix(':').ok_or_else(|| self.unexpected(&expected, Some(word)))?;
        self.rest_of_word = Some(value).filter(|value| !value.is_empty());
        Ok(())
    }

    /// The next word of this line as a number; `meaning` describes it in error messages. Some programs leave out the
    /// space before a minus sign: `0.0-7.5` are two numbers.
    pub(super) fn number_in_line(&mut self, meaning: &str) -> Result<f64, MocapError> {
        let mut word = self.word_in_line();
        if let Some((number, rest)) = word.and_then(glued_numbers) {
            (word, self.rest_of_word) = (Some(number), Some(rest));
        }
        word.and_then(finite_number).ok_or_else(|| {
            let mut expected = format!("{meaning} (a number of at most {MAX_NUMBER:e})");
            match word {
                Some(word) => {
                    if word.matches('.').count() > 1 {
                        expected.push_str(" with a space before the next one");
                    } else if word.contains(',') {
                        expected.push_str(" with a decimal point instead of a comma");
                    }
                    self.unexpected(&expected, Some(word))
                }
                None => self.error(expected, "the end of the line"),
            }
        })
    }

    /// Three numbers of this line.
    pub(super) fn vector_in_line(&mut self, meaning: &str) -> Result<nalgebra::Vector3<f64>, MocapError> {
        let mut vector = nalgebra::Vector3::zeros();
        for component in &mut vector {
            *component = self.number_in_line(meaning)?;
        }
        Ok(vector)
    }

    /// An error at the current line about an unexpected or missing word.
    pub(super) fn unexpected(&self, expected: &str, found: Option<&str>) -> MocapError {
        match found {
            Some(word) if self.is_recognised => self.error(expected, quoted(word)),
            Some(_) => self.error(expected, "something else"),
            None if self.ended => self.error(expected, "the end of the file"),
            None => self.error(expected, "the end of the line"),
        }
    }

    /// An error at the current line.
    pub(super) fn error(&self, expected: impl Display, found: impl Display) -> MocapError {
        MocapError::at(format!("{}:{}", self.file, self.line), expected, found)
    }
}

/// A number, and what touches it from its second minus sign on.
fn glued_numbers(word: &str) -> Option<(&str, &str)> {
    let is_begin = |pair: &[u8]| pair[1] == b'-' && (pair[0].is_ascii_digit() || pair[0] == b'.');
    let end = 1 + word.as_bytes().windows(2).position(is_begin)?;
    word.split_at_checked(end)
}

/// Parses a number plausible in a recording: finite and not too large.
pub(super) fn finite_number(word: &str) -> Option<f64> {
    word.parse().ok().filter(|&number| is_plausible(number))
}

/// Whether a recording can contain this number.
pub(super) fn is_plausible(number: f64) -> bool {
    number.abs() <= MAX_NUMBER
}

/// A word of the file, escaped and shortened for messages.
pub(super) fn quoted(word: &str) -> String {
    let shown: String = word.chars().take(40).flat_map(char::escape_debug).collect();
    if word.chars().nth(40).is_some() { format!("`{shown}…`") } else { format!("`{shown}`") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_continue_over_line_ends_and_the_line_number_follows() {
        let mut cursor = TextCursor::new("\u{feff}one two\r\n\n# note\n\tthree", "f");
        assert_eq!(cursor.word("x").unwrap(), "one");
        assert_eq!(cursor.word_in_line(), Some("two"));
        assert_eq!(cursor.word_in_line(), None);
        assert_eq!(cursor.word("x").unwrap(), "three");
        assert_eq!(cursor.line(), 4);
        assert_eq!(cursor.word("a word").unwrap_err().to_string(), "f:4: expected a word, found the end of the file");
    }

    #[test]
    fn nothing_is_quoted_before_the_format_is_recognised() {
        let mut cursor = TextCursor::new("AWS_SECRET=hunter2", "f");
        let error = cursor.keyword("HIERARCHY").unwrap_err();
        assert_eq!(error.to_string(), "f:1: expected `HIERARCHY`, found something else");
        cursor.set_recognised();
        let error = cursor.unexpected("a word", Some("mine"));
        assert_eq!(error.to_string(), "f:1: expected a word, found `mine`");
    }

    // Lines that end in CR alone, and numbers without a space before a minus sign, were refused.
    #[test]
    fn old_line_ends_and_glued_numbers_are_read() {
        let lines: Vec<&str> = Lines("a\rb\r\nc\n\nd").collect();
        assert_eq!(lines, ["a", "b", "c", "", "d"]);
        let mut cursor = TextCursor::new("0.5-7.5-1e-3 2\rFrames:3 Time : 4 1.25.5 1,5", "f");
        cursor.set_recognised();
        cursor.next_line();
        let numbers = [0.5, -7.5, -1e-3, 2.0].map(|_| cursor.number_in_line("x").unwrap());
        assert_eq!(numbers, [0.5, -7.5, -1e-3, 2.0]);
        for (label, number) in [("frames", 3.0), ("TIME", 4.0)] {
            cursor.label(label).unwrap();
            assert_eq!(cursor.number_in_line("x").unwrap(), number);
        }
        let mut message = || cursor.number_in_line("x").unwrap_err().to_string();
        let glued = "f:2: expected x (a number of at most 1e7) with a space before the next one, found `1.25.5`";
        assert_eq!(message(), glued);
        assert!(message().contains("with a decimal point instead of a comma, found `1,5`"));
    }

    #[test]
    fn implausible_numbers_are_refused() {
        for word in ["nan", "inf", "-inf", "1e300", "1e999", "1,5", "0x1", "--1", ""] {
            assert_eq!(finite_number(word), None, "{word}");
        }
        assert_eq!(finite_number("-.5e1"), Some(-5.0));
    }

    #[test]
    fn a_quoted_word_is_short_and_has_no_control_characters() {
        assert_eq!(quoted("a\u{7}b"), "`a\\u{7}b`");
        assert_eq!(quoted(&"x".repeat(1000)).chars().count(), 43);
    }
}
