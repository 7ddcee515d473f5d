//! Adapts a body to a person's stature, mass, lengths and girths.

use super::{SegmentLengths, fit_shape};
use skiagraph_core::body::{BodyShape, Humanoid, Person, VARIED_GIRTHS, VARIED_LENGTHS, girth_segment};

/// Iterations over stature and mass, which affect each other slightly.
const ROUNDS: usize = 6;
/// Plausible factors on the template's girths.
const GIRTHS: std::ops::RangeInclusive<f64> = 0.5..=2.5;
/// Plausible factors on the body's lengths.
const LENGTHS: std::ops::RangeInclusive<f64> = 0.4..=2.5;
/// Segments whose girth depends on stature but not on mass: head, hands, feet.
const MASS_INDEPENDENT: [usize; 3] = [0, 4, 7];

/// Target proportions of a body; unset ones are scaled with the rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Physique {
    /// Height from sole to crown, metres.
    pub stature_m: Option<f64>,
    /// Mass, kilograms.
    pub mass_kg: Option<f64>,
    /// Factors on the lengths of [`VARIED_LENGTHS`], before scaling to the stature.
    pub lengths: Option<[f64; 9]>,
    /// Factors on the girths of [`VARIED_GIRTHS`], before scaling to the mass.
    pub girths: Option<[f64; 8]>,
    /// Absolute lengths of [`VARIED_LENGTHS`], metres.
    pub lengths_m: [Option<f64>; 9],
}

impl From<&Person> for Physique {
    fn from(person: &Person) -> Self {
        Self {
            stature_m: Some(person.stature_m),
            mass_kg: Some(person.mass_kg),
            lengths: Some(person.lengths),
            girths: Some(person.girths),
            lengths_m: [None; 9],
        }
    }
}

/// The shape that gives `body` a physique.
pub fn physique_shape(body: &Humanoid, physique: &Physique) -> Result<BodyShape, String> {
    let own = SegmentLengths::from_body(body);
    let stature = body.stature().ok_or("the stature is unknown, because the body has no head or soles")?;
    let wanted = physique.stature_m.unwrap_or(stature);
    let mut growth = wanted / stature;
    let mut shape = BodyShape::identity(body);
    for _ in 0..ROUNDS {
        let lengths = target_lengths(&own, physique, growth);
        shape = fit_shape(body, &lengths);
        set_girths(body, physique, &mut shape)?;
        let found = body.reshaped(&shape).stature().unwrap_or(wanted);
        // with given lengths only, the stature follows from them
        if physique.stature_m.is_none() && physique.lengths.is_none() {
            break;
        }
        growth *= wanted / found;
    }
    let factors = shape.links.iter().flat_map(|link| link.length.iter().copied());
    if let Some(far) = factors.into_iter().find(|factor| !LENGTHS.contains(factor)) {
        let expected = format!("expected a factor of {} to {}", LENGTHS.start(), LENGTHS.end());
        return Err(format!("a segment would be {far:.2} times as long as the body's, {expected}"));
    }
    Ok(shape)
}

/// Target lengths, where lengths without an absolute value are scaled by `growth`.
fn target_lengths(own: &SegmentLengths, physique: &Physique, growth: f64) -> SegmentLengths {
    let factors = physique.lengths.unwrap_or([1.0; 9]);
    let of = |index: usize, own: Option<f64>| {
        own.map(|own| physique.lengths_m[index].unwrap_or(own * factors[index] * growth))
    };
    let pair = |index: usize, own: [Option<f64>; 2]| own.map(|side| of(index, side));
    debug_assert_eq!(VARIED_LENGTHS.len(), factors.len());
    SegmentLengths {
        trunk: of(0, own.trunk),
        head: of(1, own.head),
        shoulder_width: of(2, own.shoulder_width),
        hip_width: of(3, own.hip_width),
        upper_arm: pair(4, own.upper_arm),
        forearm: pair(5, own.forearm),
        thigh: pair(6, own.thigh),
        shank: pair(7, own.shank),
        foot: pair(8, own.foot),
    }
}

/// Sets girths so that the body has its mass: head, hands and feet depend on the stature only, the others are scaled to
/// reach the mass.
fn set_girths(body: &Humanoid, physique: &Physique, shape: &mut BodyShape) -> Result<(), String> {
    let factors = physique.girths.unwrap_or([1.0; 8]);
    debug_assert_eq!(VARIED_GIRTHS.len(), factors.len());
    let segments: Vec<Option<usize>> = (0..body.links.len()).map(|link| segment_of(body, link)).collect();
    for (link, segment) in shape.links.iter_mut().zip(&segments) {
        link.girth *= segment.map_or(1.0, |segment| factors[segment]);
    }
    let Some(wanted) = physique.mass_kg else { return Ok(()) };
    // without the skin: the mass is that of the links
    let thin = Humanoid { skin: None, ..body.clone() }.reshaped(shape);
    let mass = |lean: bool| -> f64 {
        let own = thin.links.iter().zip(&segments);
        let own = own.filter(|(_, segment)| segment.is_some_and(|segment| MASS_INDEPENDENT.contains(&segment)) == lean);
        own.filter_map(|(link, _)| link.inertia.as_ref()).map(|inertia| inertia.mass).sum()
    };
    let (lean, rest) = (mass(true), mass(false));
    if rest <= 0.0 {
        return Err("a target mass cannot be reached, because the body's links have no mass".to_owned());
    }
    let growth = libm::sqrt(((wanted - lean) / rest).max(0.0));
    let girths = || shape.links.iter().zip(&segments);
    let is_plausible = girths().all(|(link, segment)| {
        segment.is_some_and(|segment| MASS_INDEPENDENT.contains(&segment)) || GIRTHS.contains(&(link.girth * growth))
    });
    if !is_plausible {
        return Err(format!(
            "{wanted:.1} kg would make its girths {growth:.2} times those of a body of that stature with {:.1} kg, expected a \
             factor of {} to {} on every girth",
            lean + rest,
            GIRTHS.start(),
            GIRTHS.end()
        ));
    }
    for (link, segment) in shape.links.iter_mut().zip(&segments) {
        if !segment.is_some_and(|segment| MASS_INDEPENDENT.contains(&segment)) {
            link.girth *= growth;
        }
    }
    Ok(())
}

/// The segment of a link, or of its first descendant with geometry or mass.
fn segment_of(body: &Humanoid, mut link: usize) -> Option<usize> {
    while body.links[link].solids.is_empty() && body.links[link].inertia.is_none() {
        link = 1 + body.joints.iter().position(|joint| joint.parent == link)?;
    }
    girth_segment(&body.links[link].name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::retarget::with_skin;
    use skiagraph_core::body::{Sex, shipped, shipped_skin};

    #[test]
    fn stature_and_mass_are_reached_to_a_millimetre_and_a_gram() {
        let body = shipped("actor").unwrap();
        for seed in 0..12 {
            let person = Person::drawn(seed, 0, None, None);
            let shape = physique_shape(&body, &Physique::from(&person)).unwrap();
            let found = body.reshaped(&shape);
            assert!((found.stature().unwrap() - person.stature_m).abs() < 1e-3, "{seed}: {:?}", found.stature());
            assert!((found.total_mass() - person.mass_kg).abs() < 1e-3, "{seed}: {}", found.total_mass());
        }
    }

    #[test]
    fn an_absolute_length_is_reached_and_others_are_unchanged() {
        let body = shipped("actor").unwrap();
        let mut physique = Physique::default();
        physique.lengths_m[6] = Some(0.50);
        let found = body.reshaped(&physique_shape(&body, &physique).unwrap());
        let (was, is) = (SegmentLengths::from_body(&body), SegmentLengths::from_body(&found));
        assert!((is.thigh[0].unwrap() - 0.50).abs() < 1e-3 && (is.thigh[1].unwrap() - 0.50).abs() < 1e-3);
        assert!((is.shank[0].unwrap() - was.shank[0].unwrap()).abs() < 1e-3);
        assert!((is.trunk.unwrap() - was.trunk.unwrap()).abs() < 1e-3);
    }

    #[test]
    fn skin_and_inertia_follow_the_mass() {
        let body = with_skin(&shipped("actor").unwrap(), &shipped_skin("person_coarse").unwrap()).unwrap();
        let litres = |body: &Humanoid| {
            let frames = body.link_frames(&body.zero_pose());
            1000.0 * body.skin.as_ref().unwrap().volume(&frames).unwrap().0
        };
        let physique = |mass| Physique { stature_m: body.stature(), mass_kg: Some(mass), ..Physique::default() };
        let (light, heavy) = (60.0, 110.0);
        let [light, heavy] = [light, heavy].map(|mass| body.reshaped(&physique_shape(&body, &physique(mass)).unwrap()));
        assert!(litres(&heavy) > 1.4 * litres(&light), "{} {}", litres(&heavy), litres(&light));
        let head = body.find_link("head").unwrap();
        let mass = |body: &Humanoid| body.links[head].inertia.as_ref().unwrap().mass;
        assert!((mass(&heavy) - mass(&light)).abs() < 1e-9, "heads do not depend on mass");
        let absurd = physique_shape(&body, &physique(12.0)).unwrap_err();
        assert!(absurd.contains("12.0 kg would make its girths"), "{absurd}");
    }

    #[test]
    fn a_woman_of_a_mans_mass_has_thicker_thighs_and_thinner_forearms() {
        let [woman, man] = [Sex::Female, Sex::Male].map(|sex| {
            let (lengths, girths) = ([1.0; 9], [1.0; 8]);
            let even = Person { sex, stature_m: 1.7, mass_kg: 68.0, lengths, girths };
            let body = shipped("actor").unwrap();
            body.reshaped(&physique_shape(&body, &Physique::from(&even.of_its_sex())).unwrap())
        });
        let mass =
            |body: &Humanoid, link: &str| body.links[body.find_link(link).unwrap()].inertia.as_ref().unwrap().mass;
        assert!(mass(&woman, "left_thigh") > 1.02 * mass(&man, "left_thigh"));
        assert!(mass(&woman, "left_forearm") < 0.9 * mass(&man, "left_forearm"));
    }
}
