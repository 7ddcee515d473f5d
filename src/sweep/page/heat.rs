//! The colours of heat maps.

/// Background of the best and of the worst value, behind dark text.
const ON_LIGHT: [[f64; 3]; 2] = [[190.0, 230.0, 212.0], [255.0, 178.0, 126.0]];
/// The same behind light text.
const ON_DARK: [[f64; 3]; 2] = [[16.0, 80.0, 62.0], [140.0, 56.0, 8.0]];

/// The background of a cell on a light page; `place` is 0 for the best and 1 for the worst value.
pub(super) fn on_light(place: f64) -> [u8; 3] {
    mixed(ON_LIGHT, place)
}

/// The same on a dark page or picture.
pub(super) fn on_dark(place: f64) -> [u8; 3] {
    mixed(ON_DARK, place)
}

/// A colour in CSS notation.
pub(super) fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn mixed([best, worst]: [[f64; 3]; 2], place: f64) -> [u8; 3] {
    let place = place.clamp(0.0, 1.0);
    [0, 1, 2].map(|channel| (best[channel] + place * (worst[channel] - best[channel])).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::drawing::INK;

    /// Relative luminance and contrast ratio of WCAG 2.1.
    fn contrast(one: [u8; 3], other: [u8; 3]) -> f64 {
        let linear = |channel: u8| {
            let value = f64::from(channel) / 255.0;
            if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        };
        let luminance = |[r, g, b]: [u8; 3]| 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
        let (a, b) = (luminance(one) + 0.05, luminance(other) + 0.05);
        a.max(b) / a.min(b)
    }

    /// The colour of text in a page, light or dark.
    fn ink(light: bool) -> [u8; 3] {
        let style = include_str!("../../report/page.css");
        let declared = style.split("--ink: #").skip(1).map(|rest| u32::from_str_radix(&rest[..6], 16).unwrap());
        let of = declared.collect::<Vec<_>>()[usize::from(!light)];
        [of >> 16, of >> 8, of].map(|channel| channel as u8)
    }

    #[test]
    fn text_on_every_shade_has_a_contrast_of_four_and_a_half_or_more() {
        assert!((contrast([0; 3], [255; 3]) - 21.0).abs() < 1e-9);
        for place in (0..=100).map(|percent| f64::from(percent) / 100.0) {
            let found = [contrast(on_light(place), ink(true)), contrast(on_dark(place), ink(false))];
            assert!(found.iter().all(|ratio| *ratio >= 4.5), "{place}: {found:?}");
            assert!(contrast(on_dark(place), INK) >= 4.5, "{place}: in pictures");
        }
        assert!(contrast(on_light(0.0), on_light(1.0)) > 1.1 && contrast(on_dark(0.0), on_dark(1.0)) > 1.1);
    }

    #[test]
    fn the_ends_are_the_colours_of_the_best_and_the_worst() {
        assert_eq!([hex(on_light(0.0)), hex(on_dark(1.0))], ["#bee6d4", "#8c3808"]);
        assert_eq!(on_light(-1.0), on_light(0.0));
    }
}
