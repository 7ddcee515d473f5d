//! A deliberately mismatched body: random lengths and girths per segment.

use nalgebra::Vector3;
use rand::RngExt;

use super::{BodyShape, Humanoid, LinkShape};
use crate::rng::{KeyedSeed, Purpose};

impl BodyShape {
    /// Lengths and girths drawn for every segment, uniformly within `1 ± length_fraction` and `1 ± girth_fraction`.
    ///
    /// A segment is a link with mass or geometry; other links connect the axes of a compound joint and follow the
    /// segment below them. Links whose names differ only by left and right get the same values.
    pub fn random_mismatch(
        humanoid: &Humanoid,
        seed: impl Into<KeyedSeed>,
        length_fraction: f64,
        girth_fraction: f64,
    ) -> Self {
        Self::drawn(humanoid, (seed.into(), Purpose::BodyMismatch), length_fraction, girth_fraction)
    }

    /// The same from a separate random stream: corruption of observations is independent of a mismatch, even with the
    /// same seed.
    pub fn random_corruption(humanoid: &Humanoid, seed: impl Into<KeyedSeed>, fraction: f64) -> Self {
        Self::drawn(humanoid, (seed.into(), Purpose::BodyCorruption), fraction, fraction)
    }

    fn drawn(
        humanoid: &Humanoid,
        (seed, purpose): (KeyedSeed, Purpose),
        length_fraction: f64,
        girth_fraction: f64,
    ) -> Self {
        let mut shape = Self::identity(humanoid);
        let mut drawn: Vec<(String, LinkShape)> = Vec::new();
        for link in 0..humanoid.links.len() {
            let name = without_side(&humanoid.links[segment_of(humanoid, link)].name);
            if let Some((_, known)) = drawn.iter().find(|d| d.0 == name) {
                shape.links[link] = *known;
                continue;
            }
            let mut rng = seed.stream(purpose, 0, 0, drawn.len() as u64);
            let mut within = |fraction: f64| 1.0 + fraction * (2.0 * rng.random::<f64>() - 1.0);
            let length = Vector3::repeat(within(length_fraction));
            shape.links[link] = LinkShape { length, girth: within(girth_fraction) };
            drawn.push((name, shape.links[link]));
        }
        shape
    }
}

/// The link itself if it has mass or geometry, else the first link below it that has.
fn segment_of(humanoid: &Humanoid, link: usize) -> usize {
    let mut link = link;
    while humanoid.links[link].solids.is_empty() && humanoid.links[link].inertia.is_none() {
        match humanoid.joints.iter().position(|j| j.parent == link) {
            Some(joint) => link = joint + 1,
            None => break,
        }
    }
    link
}

/// The name of a link without its side: the same for `left_thigh` and `right_thigh`, `LeftFoot` and `RightFoot`,
/// `l_wrist` and `r_wrist`, `LLEG_LINK1` and `RLEG_LINK1`.
pub fn without_side(name: &str) -> String {
    for (left, right) in [("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT")] {
        for side in [left, right] {
            if name.contains(side) {
                return name.replacen(side, "", 1);
            }
        }
    }
    for side in ["l_", "r_", "L_", "R_"] {
        if let Some(rest) = name.strip_prefix(side) {
            return format!("_{rest}");
        }
    }
    for limb in ["ARM", "LEG"] {
        if name.strip_prefix(['L', 'R']).is_some_and(|rest| rest.starts_with(limb)) {
            return name[1..].to_owned();
        }
    }
    name.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;

    #[test]
    fn a_mismatch_stays_within_its_fractions_and_mirrors_left_and_right() {
        let body = shipped("actor").unwrap();
        let shape = BodyShape::random_mismatch(&body, 7, 0.03, 0.1);
        let mut distinct = Vec::new();
        for (index, link) in body.links.iter().enumerate() {
            let change = shape.links[index];
            assert!((change.length.x - 1.0).abs() <= 0.03 && (change.girth - 1.0).abs() <= 0.1);
            if let Some(rest) = link.name.strip_prefix("left_") {
                let right = body.find_link(&format!("right_{rest}")).unwrap();
                assert_eq!(change, shape.links[right], "{}", link.name);
            }
            if !distinct.contains(&change.girth) {
                distinct.push(change.girth);
            }
        }
        // Pelvis, abdomen, thorax, neck, head, clavicle, upper arm, forearm, hand, thigh, shank, foot, toes.
        assert_eq!(distinct.len(), 13);
        let knee = body.find_link("left_shank").unwrap();
        assert_ne!(shape.links[knee], shape.links[body.find_link("left_thigh").unwrap()]);
        let between = body.find_link("left_hip_flexion_link").unwrap();
        assert_eq!(shape.links[between], shape.links[body.find_link("left_thigh").unwrap()]);
    }

    #[test]
    fn the_same_seed_gives_the_same_body_and_other_seeds_give_others() {
        let body = shipped("tracker25").unwrap();
        let draw = |seed| BodyShape::random_mismatch(&body, seed, 0.03, 0.1);
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
        assert_eq!(BodyShape::random_mismatch(&body, 1, 0.0, 0.0), BodyShape::identity(&body));
        let (mismatch, corruption) =
            (BodyShape::random_mismatch(&body, 1, 0.1, 0.1), BodyShape::random_corruption(&body, 1, 0.1));
        let apart = mismatch.links.iter().zip(&corruption.links).all(|(a, b)| (a.length.x - b.length.x).abs() > 1e-4);
        assert!(apart, "draws with the same seed are independent: {mismatch:?} {corruption:?}");
    }
}
