//! `[actor] shape` and `mismatch = "population"`: bodies of other people.

use super::mismatch_seed::mismatch_seed;
use crate::scenario::{KeyError, PopulationName, Scenario, ShapeSettings};
use skiagraph_core::body::{BodyShape, Humanoid, Person, Sex, VARIED_GIRTHS, VARIED_LENGTHS};
use skiagraph_core::rng::KeyedSeed;
use skiagraph_truth::editing::carried_over;
use skiagraph_truth::retarget::{Physique, Retargeted, physique_shape};

/// Whom a person is drawn for: the same seed draws different persons for the actor and the tracker.
#[derive(Clone, Copy, Debug)]
enum DrawnFor {
    Actor = 0,
    Tracker = 1,
}

/// Gives a retargeted motion the body of `[actor] shape`: joint angles stay, the path is scaled with the legs.
pub(crate) fn apply_shape(
    settings: &ShapeSettings,
    template: &Humanoid,
    retargeted: &mut Retargeted,
) -> Result<(), KeyError> {
    // a drawn person replaces the recorded subject; given values only change that subject
    let person = settings.population.is_some().then(|| drawn_actor(settings));
    let subject = if person.is_some() { BodyShape::identity(template) } else { retargeted.shape.clone() };
    let base = template.reshaped(&subject);
    let physique = physique_of(settings, person.as_ref(), base.total_mass());
    let shape = subject.then(&physique_shape(&base, &physique).map_err(|detail| KeyError::new("actor.shape", detail))?);
    let body = template.reshaped(&shape);
    retargeted.motion = carried_over(&retargeted.humanoid, &body, &retargeted.motion);
    retargeted.report.notes.push(describe(settings, person.as_ref(), &body));
    retargeted.humanoid = body;
    retargeted.shape = shape;
    Ok(())
}

/// The tracker's body as another adult of the actor's stature.
pub(crate) fn another_adult(scenario: &Scenario, template: &Humanoid, actor: &Humanoid) -> Result<Humanoid, String> {
    let shape = scenario.actor.shape.as_ref();
    let settings = ShapeSettings { sex: shape.and_then(|shape| shape.sex), ..ShapeSettings::default() };
    let seed = mismatch_seed(scenario, actor);
    let person = drawn(&settings, seed, DrawnFor::Tracker, actor.stature());
    Ok(template.reshaped(&physique_shape(template, &Physique::from(&person))?))
}

/// `body`, of another robot with the actor's lengths, with the actor's mass.
pub(crate) fn with_mass_of(body: &Humanoid, actor: &Humanoid) -> Result<Humanoid, String> {
    let physique = Physique { mass_kg: Some(actor.total_mass()), ..Physique::default() };
    Ok(body.reshaped(&physique_shape(body, &physique)?))
}

fn drawn_actor(settings: &ShapeSettings) -> Person {
    let seed = u64::from(settings.seed.unwrap_or(1));
    drawn(settings, seed.into(), DrawnFor::Actor, settings.stature_m)
}

fn drawn(settings: &ShapeSettings, seed: KeyedSeed, drawn_for: DrawnFor, stature_m: Option<f64>) -> Person {
    let by_population = match settings.population {
        Some(PopulationName::Women) => Some(Sex::Female),
        Some(PopulationName::Men) => Some(Sex::Male),
        Some(PopulationName::Adults) | None => None,
    };
    Person::drawn(seed, drawn_for as u64, by_population.or(settings.sex), stature_m)
}

/// The drawn values, replaced by given ones.
fn physique_of(settings: &ShapeSettings, person: Option<&Person>, mass_kg: f64) -> Physique {
    let mut physique = person.map(Physique::from).unwrap_or_default();
    if let (None, Some(sex)) = (person, settings.sex) {
        // the girths of that sex at the same mass
        let (lengths, girths) = ([1.0; 9], [1.0; 8]);
        let even = Person { sex, stature_m: 1.0, mass_kg, lengths, girths };
        physique.girths = Some(even.of_its_sex().girths);
        physique.mass_kg = Some(mass_kg);
    }
    physique.stature_m = settings.stature_m.or(physique.stature_m);
    physique.mass_kg = settings.mass_kg.or(physique.mass_kg);
    for (length, name) in physique.lengths_m.iter_mut().zip(VARIED_LENGTHS) {
        *length = settings.lengths_m.get(name).copied();
    }
    if !settings.girths.is_empty() {
        let mut girths = physique.girths.unwrap_or([1.0; 8]);
        for (girth, name) in girths.iter_mut().zip(VARIED_GIRTHS) {
            *girth *= settings.girths.get(name).copied().unwrap_or(1.0);
        }
        physique.girths = Some(girths);
    }
    physique
}

fn describe(settings: &ShapeSettings, person: Option<&Person>, body: &Humanoid) -> String {
    let who = person.map_or("the recorded subject, changed".to_owned(), |person| {
        let who = if person.sex == Sex::Female { "a woman" } else { "a man" };
        format!("{who}, drawn with seed {}", settings.seed.unwrap_or(1))
    });
    let stature = body.stature().map_or(String::new(), |stature| format!(", {stature:.3} m"));
    let given: Vec<&str> = settings.lengths_m.keys().chain(settings.girths.keys()).map(String::as_str).collect();
    let given = if given.is_empty() { String::new() } else { format!("; given: {}", given.join(", ")) };
    format!("actor.shape: {who}{stature}, {:.1} kg{given}", body.total_mass())
}
