//! How the visible body moves with its shape parameters.

use nalgebra::{Point3, Vector3};

use super::shape::{ShapeModel, ShapeNumber};
use crate::tracker::descent::{BodyOutline, OutlineSample, SolidPlace};
use skiagraph_core::body::{Humanoid, LinkFrames, Pose, Solid};
use skiagraph_core::camera::Camera;

/// Step of the finite differences with respect to the shape, in standard deviations of its parameters.
const DIFFERENCE: f64 = 0.01;

fn difference(number: &ShapeNumber) -> f64 {
    DIFFERENCE * number.deviation()
}

pub(super) struct ShapeVariant {
    pub(super) body: Humanoid,
    pub(super) outline: BodyOutline,
}

impl ShapeVariant {
    pub(super) fn new(body: Humanoid) -> Self {
        Self { outline: BodyOutline::new(&body), body }
    }

    /// The body with shape `values`, of which one of the first `count` is changed a little in each variant.
    pub(super) fn of_numbers(model: &ShapeModel, values: &[f64], count: usize) -> Vec<Self> {
        let varied = |(index, number): (usize, &ShapeNumber)| {
            let mut values = values.to_vec();
            values[index] += difference(number);
            Self::new(model.shaped(&values))
        };
        model.numbers.iter().enumerate().take(count).map(varied).collect()
    }
}

/// World positions of a skin's vertices, for the body and for each variant.
type VariedSkin = (Vec<Point3<f64>>, Vec<Vec<Point3<f64>>>);

/// Derivatives of the visible body with respect to the shape parameters, in one pose.
pub(super) struct ShapeDerivatives<'a> {
    base: &'a ShapeVariant,
    frames: &'a LinkFrames,
    variants: &'a [ShapeVariant],
    varied_frames: Vec<LinkFrames>,
    differences: Vec<f64>,
    /// `[link][solid]`: the parameters that move it; empty for a body with a skin.
    moving: Vec<Vec<Vec<usize>>>,
    /// For a body with a skin.
    skins: Option<VariedSkin>,
}

impl<'a> ShapeDerivatives<'a> {
    pub(super) fn new(
        model: &ShapeModel,
        base: &'a ShapeVariant,
        frames: &'a LinkFrames,
        variants: &'a [ShapeVariant],
        pose: &Pose,
    ) -> Self {
        let varied_frames: Vec<LinkFrames> = variants.iter().map(|variant| variant.body.link_frames(pose)).collect();
        let is_moved = |number: usize, link: usize, solid: usize| {
            varied_frames[number][link] != frames[link]
                || variants[number].body.links[link].solids[solid] != base.body.links[link].solids[solid]
        };
        let of_solid = |link: usize, solid: usize| -> Vec<usize> {
            (0..variants.len()).filter(|number| is_moved(*number, link, solid)).collect()
        };
        let of_link = |(link, solids): (usize, usize)| (0..solids).map(|solid| of_solid(link, solid)).collect();
        let drawn = if base.body.skin.is_some() { &[] } else { base.body.links.as_slice() };
        let moving = drawn.iter().map(|link| link.solids.len()).enumerate().map(of_link).collect();
        let differences = model.numbers.iter().map(difference).take(variants.len()).collect();
        let skins = deformed(&base.body, frames).map(|skin| {
            let of =
                |(variant, frames): (&ShapeVariant, &LinkFrames)| deformed(&variant.body, frames).unwrap_or_default();
            (skin, variants.iter().zip(&varied_frames).map(of).collect())
        });
        Self { base, frames, variants, differences, moving, varied_frames, skins }
    }

    /// The derivatives of the residual at `sample` with respect to the shape parameters: parameter index and value.
    /// `slide` is the residual's derivative with respect to the sample's world position.
    pub(super) fn derivatives(
        &self,
        sample: &OutlineSample,
        camera: &Camera,
        slide: &Vector3<f64>,
        found: &mut Vec<(usize, f64)>,
    ) {
        found.clear();
        if let Some((base, varied)) = &self.skins {
            let moved = |number: usize| {
                let by =
                    (on_skin(&varied[number], &sample.spot)? - on_skin(base, &sample.spot)?) / self.differences[number];
                (by != Vector3::zeros()).then(|| (number, slide.dot(&by)))
            };
            return found.extend((0..varied.len()).filter_map(moved));
        }
        let Some((place, radius)) = spot(self.base, self.frames, sample.link, &sample.spot) else { return };
        let normal = camera.camera_from_world.inverse_transform_vector(&sample.surface_normal(&camera.pinhole));
        for &number in &self.moving[sample.link][sample.spot.solid as usize] {
            let moved = spot(&self.variants[number], &self.varied_frames[number], sample.link, &sample.spot);
            let Some((moved, thicker)) = moved else { continue };
            let by = (moved - place + normal * (thicker - radius)) / self.differences[number];
            found.push((number, slide.dot(&by)));
        }
    }
}

/// World positions of a skin's vertices; `None` for a body without a skin.
fn deformed(body: &Humanoid, frames: &LinkFrames) -> Option<Vec<Point3<f64>>> {
    let mut vertices = Vec::new();
    body.skin.as_ref()?.deform_into(frames, &mut vertices);
    Some(vertices)
}

fn on_skin(vertices: &[Point3<f64>], spot: &SolidPlace) -> Option<Point3<f64>> {
    let [from, to] = spot.ends.map(|end| vertices.get(end as usize));
    from.zip(to).map(|(from, to)| from + spot.share * (to - from))
}

/// World position of a spot on a capsule's axis or on another solid's surface, and the distance of the surface from it.
fn spot(variant: &ShapeVariant, frames: &LinkFrames, link: usize, spot: &SolidPlace) -> Option<(Point3<f64>, f64)> {
    let ends = match variant.body.links[link].solids.get(spot.solid as usize)? {
        Solid::TaperedCapsule(c) => spot.ends.map(|end| if end == 0 { (c.a, c.radius_a) } else { (c.b, c.radius_b) }),
        _ => {
            let vertex = |end| Some((variant.outline.vertex(link, spot.solid, end)?, 0.0));
            [vertex(spot.ends[0])?, vertex(spot.ends[1])?]
        }
    };
    let [(from, thin), (to, thick)] = ends;
    Some((frames[link] * (from + spot.share * (to - from)), thin + spot.share * (thick - thin)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::descent::slide;
    use crate::tracker::fixture;
    use skiagraph_core::body::shipped;

    #[test]
    fn shape_derivatives_agree_with_finite_differences_of_the_outline_with_and_without_a_skin() {
        check_derivatives(&shipped("tracker25").unwrap());
        check_derivatives(&fixture::skinned());
    }

    /// Tolerance: 2 %, plus 1.5 pixels per unit of the parameter.
    fn check_derivatives(body: &Humanoid) {
        let model = ShapeModel::new(body);
        let camera = fixture::ring(1, 3.5, [640, 480]).cameras.remove(0);
        let pose = fixture::March::standing(body);
        let variant = |values: &[f64]| ShapeVariant::new(model.shaped(values));
        let zero = vec![0.0; model.numbers.len()];
        let varied = |number: usize, by: f64| {
            let mut values = zero.clone();
            values[number] = by;
            variant(&values)
        };
        let (base, frames) = (variant(&zero), body.link_frames(&pose));
        let variants = ShapeVariant::of_numbers(&model, &zero, zero.len());
        let shape = ShapeDerivatives::new(&model, &base, &frames, &variants, &pose);
        let outline = |variant: &ShapeVariant| {
            let mut samples = Vec::new();
            let frames = variant.body.link_frames(&pose);
            variant.outline.sample(&variant.body, &frames, &camera, 5.0, None, &mut samples);
            samples
        };
        let samples = outline(&base);
        let mut found = Vec::new();
        let mut checked = 0;
        for (number, name) in model.numbers.iter().map(|number| number.name.as_str()).enumerate() {
            let h = 2e-5;
            let (more, less) = (outline(&varied(number, h)), outline(&varied(number, -h)));
            for sample in samples.iter().step_by(7) {
                // The sample of the changed body at the same spot, if one with the same normal remains.
                let same = |all: &[OutlineSample]| {
                    let near = |s: &&OutlineSample| {
                        s.link == sample.link
                            && (s.spot.solid, s.spot.ends) == (sample.spot.solid, sample.spot.ends)
                            && (s.spot.share - sample.spot.share).abs() < 0.003
                            && s.normal[0] * sample.normal[0] + s.normal[1] * sample.normal[1] > 0.9999
                    };
                    all.iter().find(near).map(|s| s.pixel)
                };
                let (Some(more), Some(less)) = (same(&more), same(&less)) else { continue };
                // Compares across the outline, because position along it is arbitrary.
                let across: f64 = (0..2).map(|i| (more[i] - less[i]) / (2.0 * h) * sample.normal[i]).sum();
                shape.derivatives(sample, &camera, &slide(&camera, &sample.point, sample.normal, 1.0), &mut found);
                let along = found.iter().find(|(of, _)| *of == number).map_or(0.0, |(_, along)| *along);
                assert!((along - across).abs() < 0.02 * across.abs() + 1.5, "{name}: {along} is not {across}");
                checked += 1;
            }
        }
        assert!(checked > 200, "{checked}");
    }
}
