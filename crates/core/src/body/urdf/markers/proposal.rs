//! Proposes the markers that a robot does not define.

use nalgebra::{Point3, Vector3};

use super::MarkerSet;
use super::limb::{Limb, LimbPoint, joints, named_end};
use super::names::{BodyPart, BodySide};
use super::rigid_part::RigidParts;
use crate::body::landmark::{ARMS, LEGS};
use crate::body::upright::nearest_axis;
use crate::body::{Humanoid, LANDMARKS, Landmark, LinkPoint};

/// Heights as shares of the distance from hips to shoulders: the seventh cervical vertebra above the shoulders, and
/// the crown above it (`[Drillis 1966]`: hip 0.530, shoulder 0.818 of the stature; C7 at 0.85).
const NECK_OVER_TRUNK: f64 = 0.11;
const CROWN_OVER_TRUNK: f64 = 0.52;

/// Landmarks at the upper, middle and lower joint of each limb.
const LIMBS: [(Limb, [[Landmark; 3]; 2]); 2] = [(Limb::Leg, LEGS), (Limb::Arm, ARMS)];

/// Adds the markers that a robot does not define, with a note.
pub(in crate::body::urdf) fn propose(body: &mut Humanoid) {
    if body.markers.iter().all(Option::is_some) {
        return;
    }
    let mut places = places(body);
    if let Some(why) = not_human(&places) {
        body.notes.push(format!("no markers are proposed: {why}; a fixed, empty link marker_NAME defines one"));
        places = [None; LANDMARKS.len()];
    }
    let (mut named, mut shaped) = (Vec::new(), Vec::new());
    let frames = body.link_frames(&body.zero_pose());
    let mut markers: MarkerSet = body.markers;
    for ((marker, place), landmark) in markers.iter_mut().zip(places).zip(LANDMARKS) {
        if let (None, Some(place)) = (*marker, place) {
            let point_in_link = frames[place.link].inverse_transform_point(&place.point);
            *marker = Some(LinkPoint { link: place.link, point_in_link });
            let list = if place.named { &mut named } else { &mut shaped };
            list.push(format!("{} on `{}`", landmark.name(), body.links[place.link].name));
        }
    }
    body.markers = markers;
    for (how, list) in [("names", named), ("shape and human proportions", shaped)] {
        if !list.is_empty() {
            let list = list.join(", ");
            body.notes
                .push(format!("markers proposed from {how}: {list}; a fixed, empty link marker_NAME overrides one"));
        }
    }
}

/// The proposed position of every landmark.
fn places(body: &Humanoid) -> [Option<LimbPoint>; LANDMARKS.len()] {
    let parts = RigidParts::new(body);
    let mut places = [None; LANDMARKS.len()];
    let Some(legs) = limb_ends(&parts, Limb::Leg, None) else { return places };
    let pelvis = parts.meeting(legs[0], legs[1]);
    let arms = limb_ends(&parts, Limb::Arm, Some(legs));
    for ((limb, landmarks), ends) in LIMBS.into_iter().zip([Some(legs), arms]) {
        let Some(ends) = ends else { continue };
        let meeting = parts.meeting(ends[0], ends[1]);
        for (end, landmarks) in ends.into_iter().zip(landmarks) {
            let path = parts.path(end);
            let own = path.iter().position(|&p| p == meeting).map_or(&path[..], |at| &path[at + 1..]);
            for (landmark, place) in landmarks.into_iter().zip(joints(&parts, limb, own).into_iter().flatten()) {
                places[landmark as usize] = Some(place);
            }
        }
    }
    let middle = |a: Landmark, b: Landmark, part: usize| {
        let (a, b): (LimbPoint, LimbPoint) = (places[a as usize]?, places[b as usize]?);
        let link = parts.parts[part].links[0];
        Some(LimbPoint { link, point: nalgebra::center(&a.point, &b.point), named: a.named && b.named })
    };
    let hips = middle(Landmark::LeftHip, Landmark::RightHip, pelvis);
    let shoulders =
        arms.and_then(|a| middle(Landmark::LeftShoulder, Landmark::RightShoulder, parts.meeting(a[0], a[1])));
    places[Landmark::Pelvis as usize] = hips;
    if let (Some(hips), Some(shoulders)) = (hips, shoulders) {
        let [thorax, crown] = neck_and_crown(&parts, &hips, &shoulders);
        places[Landmark::Thorax as usize] = Some(thorax);
        places[Landmark::HeadTop as usize] = Some(crown);
    }
    places
}

/// Lengths of the trunk, from hips to shoulders, over that of a leg: of people 0.5 to 0.7, of robots up to 1.
const TRUNK_TO_LEG: std::ops::RangeInclusive<f64> = 0.2..=1.6;
/// Least cosine between the trunk and the way up the legs: 45 degrees. A dog has 0.
const UPRIGHT: f64 = 0.7;

/// Why legs and arms at these places are no human body's, in a clause.
fn not_human(places: &[Option<LimbPoint>; LANDMARKS.len()]) -> Option<String> {
    let middle = |[a, b]: [Landmark; 2]| Some(nalgebra::center(&places[a as usize]?.point, &places[b as usize]?.point));
    let [hips, knees, ankles, shoulders] = [
        [Landmark::LeftHip, Landmark::RightHip],
        [Landmark::LeftKnee, Landmark::RightKnee],
        [Landmark::LeftAnkle, Landmark::RightAnkle],
        [Landmark::LeftShoulder, Landmark::RightShoulder],
    ]
    .map(middle);
    let (legs, trunk) = (hips? - ankles?, shoulders? - hips?);
    let ratio = trunk.norm() / ((hips? - knees?).norm() + (knees? - ankles?).norm());
    let (least, most) = (TRUNK_TO_LEG.start(), TRUNK_TO_LEG.end());
    if !TRUNK_TO_LEG.contains(&ratio) {
        return Some(format!("the trunk would be {ratio:.2} times as long as the legs (of humans {least} to {most})"));
    }
    if trunk.dot(&legs) <= UPRIGHT * trunk.norm() * legs.norm() {
        return Some("the trunk would not be above the legs, as of an animal".to_owned());
    }
    is_fourfold(places)?.then(|| "four equal limbs at one height: an animal or a machine".to_owned())
}

/// Differences of lengths and heights that are no differences, as a share of the width at the hips.
const EQUAL: f64 = 0.02;

/// Whether upper arms are as long as thighs, shoulders as wide as hips, and at their height.
fn is_fourfold(places: &[Option<LimbPoint>; LANDMARKS.len()]) -> Option<bool> {
    let at = |landmark: Landmark| places[landmark as usize].map(|place| place.point);
    let (mut lengths, mut widths, mut heights) = (Vec::new(), Vec::new(), Vec::new());
    for [left, right] in [LEGS, ARMS] {
        widths.push((at(left[0])? - at(right[0])?).norm());
        for [upper, middle, _] in [left, right] {
            lengths.push((at(middle)? - at(upper)?).norm());
            heights.push(at(upper)?.z);
        }
    }
    let is_equal = |values: &[f64]| values.iter().all(|value| (value - values[0]).abs() < EQUAL * widths[0]);
    Some([&lengths, &widths, &heights].into_iter().all(|values| is_equal(values)))
}

/// Ends of the left and the right limb: by names, else by shape. Legs are found before arms.
fn limb_ends(parts: &RigidParts<'_>, limb: Limb, legs: Option<[usize; 2]>) -> Option<[usize; 2]> {
    let named = [BodySide::Left, BodySide::Right].map(|side| named_end(parts, limb, side));
    let is_used = |end: usize| {
        legs.is_some_and(|legs| legs.iter().any(|&leg| parts.hangs_on(end, leg) || parts.hangs_on(leg, end)))
    };
    if let [Some(left), Some(right)] = named.map(|end| end.filter(|&end| !is_used(end))) {
        return Some([left, right]);
    }
    shaped_ends(parts, limb, legs)
}

/// The mirrored pair of chains of at least two joints that reaches lowest or, given the legs, farthest to the sides.
fn shaped_ends(parts: &RigidParts<'_>, limb: Limb, legs: Option<[usize; 2]>) -> Option<[usize; 2]> {
    let (up, left) = upright(parts, legs);
    let is_of_other = |part: usize| parts.parts[part].part.is_some_and(|part| limb.other().has(part));
    let is_free = |end: usize| {
        // arms are no legs, even if there are no others
        !parts.path(end).into_iter().any(is_of_other)
            && legs.is_none_or(|legs| legs.iter().all(|&leg| !parts.hangs_on(end, leg) && !parts.hangs_on(leg, end)))
    };
    let ends: Vec<usize> = parts.ends().filter(|&end| is_free(end)).collect();
    let at = |end: usize| parts.middle(&parts.parts[end].links).unwrap_or(parts.parts[end].origin).coords;
    let mut best: Option<(f64, [usize; 2])> = None;
    for (i, &a) in ends.iter().enumerate() {
        for &b in &ends[i + 1..] {
            let meeting = parts.parts[parts.meeting(a, b)].depth;
            let is_chain = [a, b].iter().all(|&end| parts.parts[end].depth >= meeting + 2);
            let (apart, middle) = (at(a) - at(b), 0.5 * (at(a) + at(b)));
            let sideways = apart.dot(&left);
            if !is_chain || sideways.abs() < 0.8 * apart.norm() || sideways.abs() < 1e-3 {
                continue;
            }
            let merit = if limb == Limb::Leg { -middle.dot(&up) } else { sideways.abs() };
            if best.is_none_or(|(most, _)| merit > most) {
                best = Some((merit, if sideways > 0.0 { [a, b] } else { [b, a] }));
            }
        }
    }
    best.map(|(_, ends)| ends)
}

/// The directions up and left by shape: from the legs if they are known, else Z up and Y left (ROS), or Y up and X
/// left if the body extends along Y.
fn upright(parts: &RigidParts<'_>, legs: Option<[usize; 2]>) -> (Vector3<f64>, Vector3<f64>) {
    if let Some(legs) = legs {
        let [left, right] = legs.map(|leg| parts.parts[leg].origin);
        let hips = parts.parts[parts.meeting(legs[0], legs[1])].origin;
        return (nearest_axis(&(hips - nalgebra::center(&left, &right))), nearest_axis(&(left - right)));
    }
    let extent = |axis: Vector3<f64>| {
        let heights = parts.frames.0.iter().map(|frame| frame.translation.vector.dot(&axis));
        heights.clone().fold(f64::NEG_INFINITY, f64::max) - heights.fold(f64::INFINITY, f64::min)
    };
    if extent(Vector3::z()) < 0.6 * extent(Vector3::y()) {
        return (Vector3::y(), Vector3::x());
    }
    (Vector3::z(), Vector3::y())
}

/// The base of the neck and the crown: from a named head at a plausible position, else by human proportions from the
/// distance between hips and shoulders.
fn neck_and_crown(parts: &RigidParts<'_>, hips: &LimbPoint, shoulders: &LimbPoint) -> [LimbPoint; 2] {
    let trunk = shoulders.point - hips.point;
    let length = trunk.norm();
    let up = trunk.try_normalize(1e-9).unwrap_or(Vector3::z());
    let above = |point: &Point3<f64>| (point - shoulders.point).dot(&up) / length;
    let head = FoundHead::find(parts);
    let neck = head.as_ref().map(|head| head.neck).filter(|neck| (-0.15..0.5).contains(&above(neck)));
    let guess = shoulders.point + up * (NECK_OVER_TRUNK * length);
    let thorax = LimbPoint { link: shoulders.link, point: neck.unwrap_or(guess), named: neck.is_some() };
    let base = head.as_ref().map(|head| head.origin).filter(|base| (-0.15..1.0).contains(&above(base)));
    let foot = base.unwrap_or(thorax.point);
    let crown = head.as_ref().and_then(|head| parts.reach(&head.links, &up));
    let crown = crown.map(|reach| foot + up * (reach - foot.coords.dot(&up)));
    let is_crown = |crown: &Point3<f64>| ((crown - thorax.point).dot(&up) / length - CROWN_OVER_TRUNK).abs() < 0.4;
    let crown = crown.filter(is_crown);
    let link = head.as_ref().map_or(shoulders.link, |head| head.link);
    let guess = thorax.point + up * (CROWN_OVER_TRUNK * length);
    [thorax, LimbPoint { link, point: crown.unwrap_or(guess), named: crown.is_some() }]
}

struct FoundHead {
    link: usize,
    /// The link and its descendants.
    links: Vec<usize>,
    origin: Point3<f64>,
    /// The first joint of the neck, or the base of a head without joints.
    neck: Point3<f64>,
}

impl FoundHead {
    fn find(parts: &RigidParts<'_>) -> Option<Self> {
        let is = |part: usize, name: BodyPart| parts.parts[part].part == Some(name);
        let all = || 0..parts.parts.len();
        let moving = all().filter(|&p| is(p, BodyPart::Head)).max_by_key(|&p| parts.parts[p].depth);
        let moving = moving.or_else(|| all().filter(|&p| is(p, BodyPart::Neck)).max_by_key(|&p| parts.parts[p].depth));
        if let Some(head) = moving {
            let above = all().filter(|&p| parts.hangs_on(p, head));
            let path = parts.path(head);
            let first = path.iter().copied().find(|&p| is(p, BodyPart::Neck) || is(p, BodyPart::Head)).unwrap_or(head);
            return Some(Self {
                link: parts.parts[head].links[0],
                links: above.flat_map(|p| parts.parts[p].links.iter().copied()).collect(),
                origin: parts.parts[head].origin,
                neck: parts.parts[first].origin,
            });
        }
        let fixed = |name: BodyPart| {
            let links = parts.parts.iter().flat_map(|part| part.fixed.iter());
            links.filter(move |(_, _, part)| *part == name).map(|(link, _, _)| *link).next()
        };
        let link = fixed(BodyPart::Head).or_else(|| fixed(BodyPart::Neck))?;
        let origin = |link: usize| Point3::from(parts.frames[link].translation.vector);
        let neck = fixed(BodyPart::Neck).unwrap_or(link);
        Some(Self { link, links: vec![link], origin: origin(link), neck: origin(neck) })
    }
}
