//! The colours of all plots and pictures.

/// A colour with values for light and dark backgrounds. All colours differ in lightness or hue for the common forms of
/// colour blindness (`[Okabe 2008]`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names are self-explanatory")]
pub enum Colour {
    Ink,
    Faint,
    Grid,
    Blue,
    Orange,
    Green,
    Red,
    Purple,
    Amber,
    Grey,
    /// Steps of a ramp from light to dark, for ordered things; `0..6`.
    Ramp(u8),
    /// The same on any background.
    Fixed([u8; 3]),
}

/// All colours that depend on the background.
const ALL: [Colour; 16] = [
    Colour::Ink,
    Colour::Faint,
    Colour::Grid,
    Colour::Blue,
    Colour::Orange,
    Colour::Green,
    Colour::Red,
    Colour::Purple,
    Colour::Amber,
    Colour::Grey,
    Colour::Ramp(0),
    Colour::Ramp(1),
    Colour::Ramp(2),
    Colour::Ramp(3),
    Colour::Ramp(4),
    Colour::Ramp(5),
];

impl Colour {
    /// Name of the CSS variable, value on a light background, value on a dark background.
    const fn entry(self) -> (&'static str, [u8; 3], [u8; 3]) {
        match self {
            Self::Ink => ("plot-ink", [0x1c, 0x27, 0x32], [0xe8, 0xed, 0xf2]),
            Self::Faint => ("plot-faint", [0x5c, 0x6b, 0x7a], [0x9f, 0xad, 0xbb]),
            Self::Grid => ("plot-grid", [0xe0, 0xe5, 0xea], [0x2e, 0x3a, 0x46]),
            Self::Blue => ("plot-blue", [0x00, 0x68, 0xb0], [0x5a, 0xb4, 0xf0]),
            Self::Orange => ("plot-orange", [0xcc, 0x5a, 0x00], [0xff, 0x9d, 0x52]),
            Self::Green => ("plot-green", [0x00, 0x8a, 0x62], [0x2f, 0xd6, 0x9c]),
            Self::Red => ("plot-red", [0xd1, 0x1f, 0x3c], [0xff, 0x6b, 0x7c]),
            Self::Purple => ("plot-purple", [0x95, 0x4a, 0x8c], [0xe0, 0x9a, 0xd4]),
            Self::Amber => ("plot-amber", [0x9a, 0x6c, 0x00], [0xf0, 0xc0, 0x4a]),
            Self::Grey => ("plot-grey", [0x78, 0x86, 0x94], [0x8d, 0x9b, 0xa9]),
            Self::Ramp(0) => ("plot-ramp0", [0x9b, 0xc8, 0xe8], [0x2c, 0x53, 0x75]),
            Self::Ramp(1) => ("plot-ramp1", [0x63, 0xa6, 0xd8], [0x39, 0x71, 0xa0]),
            Self::Ramp(2) => ("plot-ramp2", [0x2f, 0x86, 0xc4], [0x4a, 0x90, 0xc8]),
            Self::Ramp(3) => ("plot-ramp3", [0x14, 0x66, 0xa6], [0x68, 0xae, 0xe2]),
            Self::Ramp(4) => ("plot-ramp4", [0x0d, 0x48, 0x80], [0x9c, 0xcc, 0xf0]),
            Self::Ramp(_) => ("plot-ramp5", [0x0a, 0x2a, 0x54], [0xd4, 0xe9, 0xfb]),
            Self::Fixed(value) => ("", value, value),
        }
    }

    /// Step `index` of `count` on the ramp.
    pub fn from_rank(index: usize, count: usize) -> Self {
        if count > 1 { Self::Ramp((5 * index / (count - 1)).min(5) as u8) } else { Self::Blue }
    }

    /// The colour in a page's style, which follows its theme.
    pub fn variable(self) -> String {
        format!("var(--{})", self.entry().0)
    }

    /// Red, green and blue on a light background.
    pub(super) const fn on_light(self) -> [u8; 3] {
        self.entry().1
    }

    /// Red, green and blue on a dark background.
    pub(crate) const fn on_dark(self) -> [u8; 3] {
        self.entry().2
    }
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stroke {
    pub colour: Colour,
    pub dashed: bool,
}

impl Stroke {
    pub fn solid(colour: Colour) -> Self {
        Self { colour, dashed: false }
    }

    pub fn dashed(colour: Colour) -> Self {
        Self { colour, dashed: true }
    }
}

/// `:root` declarations of every plot colour for a light or a dark background.
pub fn css_variables(dark: bool) -> String {
    let declare = |colour: Colour| {
        let (name, on_light, on_dark) = colour.entry();
        format!("--{name}:{};", hex(if dark { on_dark } else { on_light }))
    };
    ALL.into_iter().map(declare).collect()
}

/// Rules that replace each plot colour by its variable.
pub fn css_rules() -> String {
    let rule = |colour: Colour| {
        let (name, on_light, _) = colour.entry();
        let value = hex(on_light);
        format!("svg [stroke=\"{value}\"]{{stroke:var(--{name})}}svg [fill=\"{value}\"]{{fill:var(--{name})}}")
    };
    ALL.into_iter().map(rule).collect()
}

/// A colour in CSS notation.
pub(crate) fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rules of a page distinguish colours by their values.
    #[test]
    fn no_two_colours_have_the_same_value() {
        let mut values: Vec<[u8; 3]> = ALL.iter().map(|colour| colour.on_light()).collect();
        values.sort();
        assert!(values.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
