//! Truth images as coloured pictures.

use crate::benchmark_set::{Layer, LayerValues};
use crate::report::LayerPicture;

/// Greatest width and height of a picture; larger parts of an image are sampled more coarsely.
const LARGEST: u32 = 240;

/// Ranges of values that the colours cover, the same in all pictures of a page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ColourRanges {
    /// Nearest and farthest depth, metres.
    pub(super) depth: [f32; 2],
    /// Longest flow, pixels.
    pub(super) flow: f32,
}

impl ColourRanges {
    /// Empty ranges.
    pub(super) const NONE: Self = Self { depth: [f32::INFINITY, f32::NEG_INFINITY], flow: 0.0 };

    /// The ranges extended by an image.
    pub(super) fn with(mut self, values: &LayerValues) -> Self {
        match values {
            LayerValues::Depth(depth) => {
                for value in depth.iter().filter(|value| value.is_finite()) {
                    self.depth = [self.depth[0].min(*value), self.depth[1].max(*value)];
                }
            }
            LayerValues::Flow([u, v]) => {
                let lengths = u.iter().zip(v).map(|(u, v)| u.hypot(*v)).filter(|length| length.is_finite());
                self.flow = lengths.fold(self.flow, f32::max);
            }
            _ => {}
        }
        self
    }

    /// An explanation of a layer's colours.
    pub(super) fn meaning(&self, layer: Layer) -> String {
        let [near, far] = self.depth;
        match layer {
            Layer::Depth if near <= far => {
                format!("Depth along the camera's axis: {near:.2} m light, {far:.2} m dark, in the frames shown.")
            }
            Layer::Depth => "Depth along the camera's axis.".to_owned(),
            Layer::Parts => "Parts: one colour per link of the actor.".to_owned(),
            Layer::Normals => {
                "Normals: red, green and blue are X, Y and Z of the world, from -1 dark to 1 light.".to_owned()
            }
            Layer::Flow => format!(
                "Flow to the next frame: colours are directions (red right, green-yellow down, cyan left), full colour is \
                 {:.1} px.",
                self.flow
            ),
            Layer::Coverage => "Coverage: share of the pixel that sees the body, 0 dark to 1 white.".to_owned(),
            Layer::Colour => "Colour before the sensor.".to_owned(),
        }
    }
}

/// The name of a layer in scenarios.
pub(super) fn name(layer: Layer) -> String {
    match layer {
        Layer::Depth => "depth",
        Layer::Parts => "parts",
        Layer::Normals => "normals",
        Layer::Flow => "flow",
        Layer::Coverage => "coverage",
        Layer::Colour => "colour",
    }
    .to_owned()
}

/// The non-empty part of an image, in colour; `None` for an empty image.
pub(super) fn picture(values: &LayerValues, [width, height]: [u32; 2], ranges: &ColourRanges) -> Option<LayerPicture> {
    let at = |x: u32, y: u32| colour(values, (y as usize) * (width as usize) + x as usize, ranges);
    let (mut low, mut high) = ([width, height], [0, 0]);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).filter(|(x, y)| at(*x, *y).is_some()) {
        (low, high) = ([low[0].min(x), low[1].min(y)], [high[0].max(x + 1), high[1].max(y + 1)]);
    }
    if low[0] >= high[0] {
        return None;
    }
    let extent = [high[0] - low[0], high[1] - low[1]];
    let step = extent[0].max(extent[1]).div_ceil(LARGEST).max(1);
    let size = extent.map(|length| length.div_ceil(step));
    let mut rgba = Vec::with_capacity(4 * (size[0] as usize) * (size[1] as usize));
    for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
        let middle = |from: u32, index: u32, end: u32| (from + index * step + step / 2).min(end - 1);
        let shown = at(middle(low[0], x, high[0]), middle(low[1], y, high[1]));
        rgba.extend(shown.map_or([0; 4], |[red, green, blue]| [red, green, blue, 255]));
    }
    Some(LayerPicture { corner: low, extent: size.map(|length| length * step), size, rgba })
}

/// The colour of a pixel; `None` without a body.
fn colour(values: &LayerValues, index: usize, ranges: &ColourRanges) -> Option<[u8; 3]> {
    let byte = |share: f32| (255.0 * share.clamp(0.0, 1.0)).round() as u8;
    match values {
        LayerValues::Depth(depth) => {
            let [near, far] = ranges.depth;
            let value = depth.get(index).copied().filter(|value| value.is_finite())?;
            let share = (value - near) / (far - near).max(1e-6);
            Some([byte(1.0 - 0.85 * share); 3])
        }
        LayerValues::Parts(parts) => {
            let part = parts.get(index).copied().filter(|part| *part > 0)?;
            // hues a golden angle apart, so that consecutive links differ
            Some(hue(137.508 * part as f32, 0.62, if part % 2 == 0 { 0.95 } else { 0.75 }))
        }
        LayerValues::Normals(planes) => {
            let normal = planes.each_ref().map(|plane| plane.get(index).copied().unwrap_or(0.0));
            normal.iter().any(|axis| *axis != 0.0).then(|| normal.map(|axis| byte(0.5 + 0.5 * axis)))
        }
        LayerValues::Flow([u, v]) => {
            let (u, v) = (*u.get(index)?, *v.get(index)?);
            let length = u.hypot(v);
            let share = (length / ranges.flow.max(1e-6)).clamp(0.0, 1.0);
            length.is_finite().then(|| hue(libm::atan2f(v, u).to_degrees(), share, 1.0))
        }
        LayerValues::Coverage(shares) => shares.get(index).filter(|share| **share > 0.0).map(|share| [byte(*share); 3]),
        LayerValues::Colour(planes) => {
            Some(planes.each_ref().map(|plane| byte(plane.get(index).copied().unwrap_or(0.0))))
        }
    }
}

/// Hue in degrees, saturation and value as red, green and blue.
fn hue(degrees: f32, saturation: f32, value: f32) -> [u8; 3] {
    let channel = |offset: f32| {
        let k = (offset + degrees / 60.0).rem_euclid(6.0);
        let share = value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0);
        (255.0 * share).round() as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_the_part_with_the_body_and_near_is_lighter_than_far() {
        let mut depth = vec![f32::INFINITY; 9 * 7];
        (depth[2 * 9 + 3], depth[4 * 9 + 6]) = (2.0, 4.0);
        let values = LayerValues::Depth(depth);
        let ranges = ColourRanges::NONE.with(&values);
        assert_eq!(ranges.depth, [2.0, 4.0]);
        let picture = picture(&values, [9, 7], &ranges).unwrap();
        assert_eq!((picture.corner, picture.extent, picture.size), ([3, 2], [4, 3], [4, 3]));
        let at = |x: usize, y: usize| &picture.rgba[4 * (4 * y + x)..][..4];
        assert_eq!(at(0, 0), [255, 255, 255, 255]);
        assert_eq!(at(3, 2), [38, 38, 38, 255]);
        assert_eq!(at(1, 1), [0, 0, 0, 0], "no body there");
        assert!(ranges.meaning(Layer::Depth).contains("2.00 m light, 4.00 m dark"));
        assert_eq!(super::picture(&LayerValues::Parts(vec![0; 63]), [9, 7], &ranges), None);
    }

    #[test]
    fn a_large_part_is_sampled_more_coarsely_and_covers_the_same_area() {
        let values = LayerValues::Coverage(vec![1.0; 1000 * 500]);
        let picture = picture(&values, [1000, 500], &ColourRanges::NONE).unwrap();
        assert_eq!((picture.size, picture.extent), ([200, 100], [1000, 500]));
    }

    #[test]
    fn colours_match_their_explanation_on_the_page() {
        let of = |values: LayerValues, ranges: ColourRanges| colour(&values, 0, &ranges);
        let normals = LayerValues::Normals([vec![1.0], vec![0.0], vec![-1.0]]);
        assert_eq!(of(normals, ColourRanges::NONE), Some([255, 128, 0]));
        let flow = |u: f32, v: f32| {
            of(LayerValues::Flow([vec![u], vec![v]]), ColourRanges { flow: 4.0, ..ColourRanges::NONE })
        };
        assert_eq!(flow(4.0, 0.0), Some([255, 0, 0]), "to the right: red");
        assert_eq!(flow(-4.0, 0.0), Some([0, 255, 255]), "to the left: cyan");
        assert_eq!(flow(0.0, 0.0), Some([255, 255, 255]));
        assert_eq!(flow(f32::NAN, 0.0), None);
        let colour = LayerValues::Colour([vec![0.0], vec![0.5], vec![1.0]]);
        assert_eq!(of(colour, ColourRanges::NONE), Some([0, 128, 255]));
    }
}
