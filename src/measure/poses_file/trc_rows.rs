//! The rows of a TRC file: their order and length.

const HEADER: usize = 5;
/// Frame number and time before the coordinates of a row.
const BEFORE: usize = 2;

/// Frame number and time of a row, where they are numbers.
struct RowPlace {
    line: usize,
    number: Option<f64>,
    time: Option<f64>,
}

/// Refuses rows that are not in the order of their frame numbers and times, and rows with more numbers than the file's
/// markers have. Returns the first frame number. The text was parsed before.
pub(super) fn check(text: &str) -> Result<Option<f64>, String> {
    let markers = text.lines().nth(3).map_or(0, |names| fields(names).filter(|name| !name.is_empty()).count());
    let mut before: Option<RowPlace> = None;
    let mut first = None;
    for (index, row) in text.lines().enumerate().skip(HEADER).filter(|(_, row)| !row.trim().is_empty()) {
        let line = index + 1;
        let given = fields(row).zip(1..).filter(|(field, _)| !field.is_empty()).last().map_or(0, |(_, place)| place);
        if given > 3 * markers {
            return Err(format!(
                "line {line}: expected at most 3 x {markers} coordinates, as line 4 has {markers} names, found {given}"
            ));
        }
        let at = RowPlace::new(line, row);
        if let Some(before) = before.as_ref().filter(|before| at.is_behind(before)) {
            return Err(format!(
                "line {line}: expected a later row than in line {}, {}, found {}: sort the rows, or correct Frame# and Time",
                before.line,
                before.describe(),
                at.describe()
            ));
        }
        first = first.or(at.number);
        before = Some(at);
    }
    Ok(first)
}

/// The fields for markers.
fn fields(line: &str) -> impl Iterator<Item = &str> {
    line.split('\t').skip(BEFORE).map(str::trim)
}

impl RowPlace {
    fn new(line: usize, row: &str) -> Self {
        let number = |field: &str| field.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        let mut numbers = row.split('\t').map(number);
        Self { line, number: numbers.next().flatten(), time: numbers.next().flatten() }
    }

    /// Whether frame number or time is less than in another row, or none is greater. Times may be rounded, and one of
    /// the columns may be empty or constant.
    fn is_behind(&self, other: &Self) -> bool {
        let pairs = [self.number.zip(other.number), self.time.zip(other.time)];
        let pairs = || pairs.iter().flatten();
        pairs().any(|(one, other)| one < other) || pairs().count() > 0 && pairs().all(|(one, other)| one <= other)
    }

    fn describe(&self) -> String {
        let number = self.number.map(|number| format!("frame {number}"));
        let time = self.time.map(|time| format!("at {time} s"));
        number.into_iter().chain(time).collect::<Vec<_>>().join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of one marker whose rows begin with these frame numbers and times.
    fn file(rows: &[(&str, &str)]) -> String {
        let head = "PathFileType\t4\nDataRate\tUnits\n60\tm\nFrame#\tTime\tpelvis\t\t\n\t\tX1\tY1\tZ1\n\n";
        rows.iter().fold(head.to_owned(), |text, (number, time)| format!("{text}{number}\t{time}\t1\t2\t3\t\n"))
    }

    #[test]
    fn rows_whose_frame_numbers_or_times_go_backwards_are_refused_with_their_line() {
        let refused = |rows: &[(&str, &str)], words: &str| {
            let message = check(&file(rows)).unwrap_err();
            assert!(message.contains(words), "{message}");
        };
        let words = "line 9: expected a later row than in line 8, frame 3 at 0.2 s, found frame 2 at 0.1 s: sort";
        refused(&[("1", "0"), ("3", "0.2"), ("2", "0.1")], words);
        refused(&[("2", "0.1"), ("1", "0")], "line 8");
        refused(&[("1", "0.1"), ("2", "0.0")], "line 8");
        refused(&[("2", ""), ("1", "")], "frame 2, found frame 1");
        refused(&[("1", "0.1"), ("1", "0.1")], "line 8");
    }

    #[test]
    fn rounded_constant_and_empty_columns_are_accepted() {
        for rows in [
            [("1", "0.00"), ("2", "0.02"), ("3", "0.02")],
            [("1", "0"), ("2", "0"), ("3", "0")],
            [("", "0"), ("", "1"), ("", "2")],
            [("", ""), ("", ""), ("", "")],
            [("1", "0"), ("1", "0.1"), ("1", "0.2")],
        ] {
            assert!(check(&file(&rows)).is_ok(), "{rows:?}");
        }
    }

    #[test]
    fn a_row_with_three_numbers_too_many_is_refused() {
        let text = file(&[("1", "0"), ("2", "0.1")]).replace("2\t0.1\t1\t2\t3", "2\t0.1\t1\t2\t3\t4\t5\t6");
        let message = check(&text).unwrap_err();
        let words = "line 8: expected at most 3 x 1 coordinates, as line 4 has 1 names, found 6";
        assert!(message.starts_with(words), "{message}");
    }
}
