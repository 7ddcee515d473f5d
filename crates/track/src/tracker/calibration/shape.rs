//! The shape parameters that silhouettes determine: lengths, girths, joint positions, and one inflation.

use std::sync::Arc;

use nalgebra::{Point3, UnitQuaternion, Vector3};

use skiagraph_core::body::{BodyShape, Humanoid, JointKind, LinkShape, Solid, without_side};
use skiagraph_core::raster::TaperedCapsule;

/// Standard deviations of the prior: of lengths and girths as shares, of positions and the inflation in metres.
const LENGTH_DEVIATION: f64 = 0.03;
const GIRTH_DEVIATION: f64 = 0.10;
const PLACE_DEVIATION_M: f64 = 0.005;
const INFLATION_DEVIATION_M: f64 = 0.01;
/// A link extends along an axis if it has a point farther than this from its origin, metres.
pub(super) const REACHES_M: f64 = 0.05;
/// Tolerance for two solids of a link to be mirror images and share one girth, metres.
const MIRRORED_M: f64 = 0.001;
/// Minimum factor on a length or girth.
const MIN_FACTOR: f64 = 0.3;

/// A body and its shape parameters. Left and right share them.
#[derive(Debug)]
pub(super) struct ShapeModel {
    pub(super) body: Humanoid,
    pub(super) numbers: Vec<ShapeNumber>,
}

/// One shape parameter; 0 leaves the body unchanged.
#[derive(Debug)]
pub(super) struct ShapeNumber {
    pub(super) name: String,
    kind: ShapeNumberKind,
}

#[derive(Debug)]
enum ShapeNumberKind {
    /// Relative change of positions on these links along one of their axes.
    Length { links: Vec<usize>, axis: usize },
    /// Relative change of the girth of these solids, given by link and index on it.
    Girth { solids: Vec<[usize; 2]> },
    /// Displacement of these joints along a direction in their parent's frame, metres.
    Place { joints: Vec<(usize, Vector3<f64>)> },
    /// Offset of the skin, or of the surfaces of all solids, metres: masks have biased outlines.
    Inflation,
}

impl ShapeNumber {
    pub(super) fn deviation(&self) -> f64 {
        match self.kind {
            ShapeNumberKind::Length { .. } => LENGTH_DEVIATION,
            ShapeNumberKind::Girth { .. } => GIRTH_DEVIATION,
            ShapeNumberKind::Place { .. } => PLACE_DEVIATION_M,
            ShapeNumberKind::Inflation => INFLATION_DEVIATION_M,
        }
    }

    /// Whether it is a relative change instead of metres.
    pub(super) fn is_share(&self) -> bool {
        matches!(self.kind, ShapeNumberKind::Length { .. } | ShapeNumberKind::Girth { .. })
    }
}

impl ShapeModel {
    pub(super) fn new(body: &Humanoid) -> Self {
        let body_from_links = body.body_from_links();
        let mut numbers = lengths(body, &body_from_links);
        numbers.extend(girths(body, &body_from_links));
        numbers.extend(places(body, &body_from_links));
        let inflated = if body.skin.is_some() { "whole skin" } else { "all radii" };
        numbers.push(ShapeNumber { name: inflated.to_owned(), kind: ShapeNumberKind::Inflation });
        Self { body: body.clone(), numbers }
    }

    /// Names and values of all parameters: the relative changes, and those in metres.
    #[expect(clippy::type_complexity, reason = "two lists of the report")]
    pub(super) fn changes(&self, values: &[f64]) -> (Vec<(String, f64)>, Vec<(String, f64)>) {
        let all = || self.numbers.iter().zip(values);
        let of = |is_share: bool| {
            let chosen = all().filter(|(number, _)| number.is_share() == is_share);
            chosen.map(|(number, value)| (number.name.clone(), *value)).collect()
        };
        (of(true), of(false))
    }

    /// The body with shape `values`, one per parameter. A skin follows lengths and girths like the skins of a
    /// population model, and its limbs move with their joints. Masses follow lengths and girths at constant density,
    /// but not the inflation, which corrects the masks, not the body.
    pub(super) fn shaped(&self, values: &[f64]) -> Humanoid {
        let mut shape = BodyShape::identity(&self.body);
        let mut girths: Vec<Vec<f64>> = self.body.links.iter().map(|link| vec![1.0; link.solids.len()]).collect();
        let mut inflation = 0.0;
        for (number, value) in self.numbers.iter().zip(values) {
            let factor = (1.0 + value).max(MIN_FACTOR);
            match &number.kind {
                ShapeNumberKind::Length { links, axis } => {
                    links.iter().for_each(|link| shape.links[*link].length[*axis] *= factor)
                }
                ShapeNumberKind::Girth { solids } => {
                    solids.iter().for_each(|[link, solid]| girths[*link][*solid] *= factor)
                }
                ShapeNumberKind::Inflation => inflation += value,
                ShapeNumberKind::Place { .. } => {}
            }
        }
        for (link, girths) in shape.links.iter_mut().zip(&girths) {
            link.girth = if girths.is_empty() { 1.0 } else { girths.iter().sum::<f64>() / girths.len() as f64 };
        }
        let mut body = self.body.reshaped(&shape);
        for (index, link) in body.links.iter_mut().enumerate() {
            let of_solid = |(number, solid): (usize, &Solid)| {
                LinkShape { girth: girths[index][number], ..shape.links[index] }.solid(solid).inflated(inflation)
            };
            link.solids = self.body.links[index].solids.iter().enumerate().map(of_solid).collect();
        }
        body.skin = body.skin.map(|skin| Arc::new(skin.inflated(inflation)));
        for (number, value) in self.numbers.iter().zip(values) {
            let ShapeNumberKind::Place { joints } = &number.kind else { continue };
            joints.iter().for_each(|(joint, direction)| {
                body.joints[*joint].parent_from_joint.translation.vector += direction * *value;
            });
        }
        body
    }
}

/// Indices of links or joints, grouped with their mirror images by their common name.
fn with_mirror_images<'a>(named: impl Iterator<Item = (usize, &'a str)>) -> Vec<(String, Vec<usize>)> {
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for (index, name) in named {
        let name = without_side(name);
        match groups.iter_mut().find(|(known, _)| *known == name) {
            Some((_, alike)) => alike.push(index),
            None => groups.push((name, vec![index])),
        }
    }
    groups
}

fn segments(body: &Humanoid) -> Vec<(String, Vec<usize>)> {
    with_mirror_images(body.links.iter().map(|link| link.name.as_str()).enumerate())
}

fn lengths(body: &Humanoid, body_from_links: &[UnitQuaternion<f64>]) -> Vec<ShapeNumber> {
    let mut numbers = Vec::new();
    for (name, links) in segments(body) {
        let reach = links.iter().map(|link| reach(body, *link)).fold(Vector3::zeros(), |a, b| a.sup(&b));
        let longest = reach.imax();
        for axis in (0..3).filter(|axis| reach[*axis] > REACHES_M) {
            let kind = ShapeNumberKind::Length { links: links.clone(), axis };
            let way = if axis == longest { "length" } else { body_axis_name(&body_from_links[links[0]], axis) };
            numbers.push(ShapeNumber { name: format!("{} {way}", without_underscores(&name)), kind });
        }
    }
    numbers
}

/// Name of the body axis closest to an axis of a link.
fn body_axis_name(body_from_link: &UnitQuaternion<f64>, axis: usize) -> &'static str {
    let direction = body_from_link * Vector3::ith_axis(axis).into_inner();
    ["depth", "width", "height"][direction.iamax()]
}

/// Maximum distance of the link's points from its origin along each axis.
fn reach(body: &Humanoid, link: usize) -> Vector3<f64> {
    let of_solid = |solid: &Solid| -> Vec<Point3<f64>> {
        match solid {
            Solid::TaperedCapsule(c) => vec![c.a, c.b],
            Solid::Box { link_from_box: frame, .. } | Solid::Cylinder { link_from_cylinder: frame, .. } => {
                vec![frame.translation.vector.into()]
            }
            Solid::Mesh { vertices, .. } => vertices.clone(),
        }
    };
    let solids = body.links[link].solids.iter().flat_map(of_solid);
    let joints = body.joints.iter().filter(|joint| joint.parent == link);
    let joints = joints.map(|joint| Point3::from(joint.parent_from_joint.translation.vector));
    let markers = body.markers.iter().flatten().filter(|marker| marker.link == link).map(|marker| marker.point_in_link);
    solids.chain(joints).chain(markers).fold(Vector3::zeros(), |reach, point| reach.sup(&point.coords.abs()))
}

fn girths(body: &Humanoid, body_from_links: &[UnitQuaternion<f64>]) -> Vec<ShapeNumber> {
    let mut numbers = Vec::new();
    for (name, links) in segments(body) {
        let most = links.iter().map(|link| body.links[*link].solids.len()).max().unwrap_or(0);
        let mut classes: Vec<Vec<[usize; 2]>> = Vec::new();
        for solid in 0..most {
            let alike: Vec<[usize; 2]> = links
                .iter()
                .filter(|link| solid < body.links[**link].solids.len())
                .map(|link| [*link, solid])
                .collect();
            let mirrored = |class: &&mut Vec<[usize; 2]>| {
                // a skin has one girth per segment
                if body.skin.is_some() {
                    return true;
                }
                let ([a, b], [link, other]) = (alike[0], class[0]);
                let solid = &body.links[link].solids;
                a == link && is_mirrored(&solid[b], &solid[other], &body_from_links[link])
            };
            match classes.iter_mut().find(mirrored) {
                Some(class) => class.extend(alike),
                None => classes.push(alike),
            }
        }
        let count = classes.len();
        for (number, solids) in classes.into_iter().enumerate() {
            let which = if count > 1 { format!(" {}", number + 1) } else { String::new() };
            numbers.push(ShapeNumber {
                name: format!("{} girth{which}", without_underscores(&name)),
                kind: ShapeNumberKind::Girth { solids },
            });
        }
    }
    numbers
}

/// Whether two capsules of a link are left-right mirror images of each other.
fn is_mirrored(one: &Solid, other: &Solid, body_from_link: &UnitQuaternion<f64>) -> bool {
    let (Solid::TaperedCapsule(one), Solid::TaperedCapsule(other)) = (one, other) else { return false };
    let mirror = |p: &Point3<f64>| {
        let p = body_from_link * p;
        Point3::new(p.x, -p.y, p.z)
    };
    let TaperedCapsule { a, b, radius_a, radius_b } = one;
    (mirror(a) - body_from_link * other.a).norm() < MIRRORED_M
        && (mirror(b) - body_from_link * other.b).norm() < MIRRORED_M
        && (radius_a - other.radius_a).abs() < MIRRORED_M
        && (radius_b - other.radius_b).abs() < MIRRORED_M
}

/// Positions of the joints where kinematic chains branch: hips, shoulders, neck.
fn places(body: &Humanoid, body_from_links: &[UnitQuaternion<f64>]) -> Vec<ShapeNumber> {
    let moves = |joint: usize| body.joints[joint].kind != JointKind::Fixed;
    let parts = |joint: &usize| {
        let parent = body.joints[*joint].parent;
        let chains = (0..body.joints.len()).filter(|other| moves(*other) && body.joints[*other].parent == parent);
        moves(*joint) && chains.count() > 1
    };
    let joints = (0..body.joints.len()).filter(parts).map(|joint| (joint, body.joints[joint].name.as_str()));
    let mut numbers = Vec::new();
    for (name, joints) in with_mirror_images(joints) {
        for (way, word) in ["forward", "outward", "up"].into_iter().enumerate() {
            let direction = |joint: &usize| {
                let (parent, frame) = (body.joints[*joint].parent, &body.joints[*joint].parent_from_joint);
                let body_from_parent = &body_from_links[parent];
                let side = (body_from_parent * frame.translation.vector).y;
                let mut direction = Vector3::ith_axis(way).into_inner();
                direction.y *= if side.abs() < MIRRORED_M { 0.0 } else { side.signum() };
                (*joint, body_from_parent.inverse() * direction)
            };
            let joints: Vec<(usize, Vector3<f64>)> = joints.iter().map(direction).collect();
            // A single joint on the midline stays there.
            if joints.iter().any(|(_, direction)| direction.norm() > 0.5) && (joints.len() > 1 || way != 1) {
                numbers.push(ShapeNumber {
                    name: format!("{} joint {word}", without_underscores(&name)),
                    kind: ShapeNumberKind::Place { joints },
                });
            }
        }
    }
    numbers
}

fn without_underscores(name: &str) -> String {
    name.trim_matches('_').replace('_', " ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::{Landmark, shipped};

    #[test]
    fn zero_values_give_the_same_body_and_names_are_unique() {
        for name in ["tracker25", "actor"] {
            let body = shipped(name).unwrap();
            let model = ShapeModel::new(&body);
            let same = model.shaped(&vec![0.0; model.numbers.len()]);
            assert_eq!((&same.joints, &same.markers), (&body.joints, &body.markers));
            assert!(same.links.iter().zip(&body.links).all(|(a, b)| a.solids == b.solids));
            let names: std::collections::BTreeSet<&str> = model.numbers.iter().map(|n| n.name.as_str()).collect();
            assert_eq!(names.len(), model.numbers.len(), "{names:?}");
        }
    }

    #[test]
    fn tracker25_has_the_expected_shape_parameters() {
        let model = ShapeModel::new(&shipped("tracker25").unwrap());
        let names: Vec<&str> = model.numbers.iter().map(|number| number.name.as_str()).collect();
        let expected = [
            "pelvis width",
            "pelvis length",
            "head length",
            "upper arm length",
            "forearm length",
            "thigh length",
            "shank depth",
            "shank length",
            "pelvis girth 1",
            "pelvis girth 2",
            "head girth 1",
            "head girth 2",
            "upper arm girth",
            "forearm girth 1",
            "forearm girth 2",
            "thigh girth",
            "shank girth 1",
            "shank girth 2",
            "head flexion joint forward",
            "head flexion joint up",
            "shoulder flexion joint forward",
            "shoulder flexion joint outward",
            "shoulder flexion joint up",
            "hip flexion joint forward",
            "hip flexion joint outward",
            "hip flexion joint up",
            "all radii",
        ];
        assert_eq!(names, expected);
    }

    #[test]
    fn a_longer_shank_lowers_both_ankles_and_wider_hips_separate_the_legs() {
        let body = shipped("tracker25").unwrap();
        let model = ShapeModel::new(&body);
        let with = |name: &str, value: f64| {
            let values: Vec<f64> = model.numbers.iter().map(|n| if n.name == name { value } else { 0.0 }).collect();
            let body = model.shaped(&values);
            let markers = body.markers(&body.link_frames(&body.zero_pose()));
            [Landmark::LeftAnkle, Landmark::RightAnkle].map(|ankle| markers[ankle as usize].unwrap())
        };
        let [left, right] = with("shank length", 0.0);
        let longer = with("shank length", 0.1);
        assert!((left.z - longer[0].z - 0.04305).abs() < 1e-9 && (right.z - longer[1].z - 0.04305).abs() < 1e-9);
        let wider = with("hip flexion joint outward", 0.01);
        assert!((wider[0].y - left.y - 0.01).abs() < 1e-12 && (right.y - wider[1].y - 0.01).abs() < 1e-12);
    }
}
