//! HumanEva's `.cal`: 22 or 25 numbers, `fc(2) cc(2) alpha(1) kc(5) R(9) T(3)`, then optionally the rotation vector
//! `om(3)`.

use super::storage::SAME;
use super::{PlainCamera, rows, turned};

pub(super) fn read(text: &str) -> Result<PlainCamera, String> {
    let mut numbers = Vec::new();
    for (index, line) in text.lines().enumerate() {
        for word in line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()) {
            let number = word.parse().ok().filter(|number: &f64| number.is_finite());
            // a file of any kind may be given here, so the word is not quoted
            let wrong = || format!("line {}: expected a number, found a word", index + 1);
            numbers.push(number.ok_or_else(wrong)?);
            if numbers.len() > 25 {
                let line = index + 1;
                return Err(format!("line {line}: expected 22 or 25 numbers (fc cc alpha kc R T om), found more"));
            }
        }
    }
    if ![22, 25].contains(&numbers.len()) {
        return Err(format!("expected 22 or 25 numbers (fc cc alpha kc R T om), found {}", numbers.len()));
    }
    let [fx, fy, cx, cy, alpha] = part(&numbers, 0);
    if alpha != 0.0 {
        return Err(format!("number 5, the skew alpha, is {alpha}; only cameras without skew are supported"));
    }
    let k = [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]];
    let written: [f64; 9] = part(&numbers, 10);
    let agree = |(one, other): (&f64, &f64)| (one - other).abs() <= SAME;
    if numbers.len() == 25 && !written.iter().zip(&turned(part(&numbers, 22))).all(agree) {
        return Err("R and om, its rotation vector, are different rotations: correct one, or leave om out".to_owned());
    }
    let (distortion, r, t) = (part(&numbers, 5), rows(&written), part(&numbers, 19));
    Ok(PlainCamera { name: None, size: None, k, distortion, r, t, metres_per_unit: 0.001 })
}

fn part<const N: usize>(numbers: &[f64], start: usize) -> [f64; N] {
    std::array::from_fn(|i| numbers.get(start + i).copied().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLE: &str =
        "584.1\n583.2 320.5 240.25\n0\n-0.317 0.139 0.001 -0.002 0\n1 0 0\n0 0 -1\n0 1 0\n10 20 4500\n";

    #[test]
    fn numbers_are_assigned_in_order() {
        let camera = read(SAMPLE).unwrap();
        assert_eq!(camera.k, [[584.1, 0.0, 320.5], [0.0, 583.2, 240.25], [0.0, 0.0, 1.0]]);
        assert_eq!(camera.distortion, [-0.317, 0.139, 0.001, -0.002, 0.0]);
        assert_eq!(camera.r, [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]);
        assert_eq!(camera.t, [10.0, 20.0, 4500.0]);
        assert_eq!(read(&format!("{SAMPLE}1.57 0 0")).unwrap().t, camera.t);
    }

    #[test]
    fn invalid_calibrations_are_refused_with_their_line() {
        for (text, why) in [
            (SAMPLE.replace("240.25", "x"), "line 2: expected a number, found a word"),
            (SAMPLE.replace("4500", ""), "expected 22 or 25 numbers (fc cc alpha kc R T om), found 21"),
            ("1 ".repeat(26), "line 1: expected 22 or 25 numbers (fc cc alpha kc R T om), found more"),
            (
                SAMPLE.replace("\n0\n", "\n0.1\n"),
                "number 5, the skew alpha, is 0.1; only cameras without skew are supported",
            ),
            (SAMPLE.replace("4500", "nan"), "line 8: expected a number, found a word"),
            (
                format!("{SAMPLE}1.3 0 0"),
                "R and om, its rotation vector, are different rotations: correct one, or leave om out",
            ),
        ] {
            assert_eq!(read(&text).err().as_deref(), Some(why));
        }
    }
}
