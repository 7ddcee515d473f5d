//! `[actor] shape` and `mismatch = "population"`: bodies of other people.

use std::collections::BTreeMap;

use super::mismatch_seed::mismatch_seed;
use crate::body::{BodyShape, Humanoid, Person, Sex, VARIED_GIRTHS, VARIED_LENGTHS};
use crate::common::{ExperimentError, scenario_error};
use crate::editing::carried_over;
use crate::retarget::{Physique, Retargeted, physique_shape};
use crate::rng::KeyedSeed;
use crate::scenario::{PopulationName, ScenarioFile, ShapeSettings};

/// Whom a draw is for: the same seed draws another person for the tracker than for the actor.
#[derive(Clone, Copy, Debug)]
enum DrawnFor {
    Actor = 0,
    Tracker = 1,
}

/// Gives a performance the person of `[actor] shape`: the motion's angles stay, its path grows with the legs.
///
/// # Errors
/// [`ExperimentError`] that names the key.
pub(crate) fn given_to_person(
    file: &ScenarioFile,
    template: &Humanoid,
    performed: &mut Retargeted,
) -> Result<(), ExperimentError> {
    let Some(settings) = &file.scenario.actor.shape else { return Ok(()) };
    let unmet = |detail: String| scenario_error(file, "actor.shape", detail);
    // who is drawn replaces the recorded subject; what is only said changes that subject
    let person = is_drawn(settings).then(|| drawn_actor(settings));
    let subject = if person.is_some() { BodyShape::identity(template) } else { performed.shape.clone() };
    let base = template.reshaped(&subject);
    let physique = physique_of(settings, person.as_ref(), base.total_mass());
    let shape = subject.then(&physique_shape(&base, &physique).map_err(unmet)?);
    let body = template.reshaped(&shape);
    performed.motion = carried_over(&performed.humanoid, &body, &performed.motion);
    performed.report.notes.push(in_words(settings, person.as_ref(), &body));
    performed.humanoid = body;
    performed.shape = shape;
    Ok(())
}

/// The tracker's body as another adult, or child of the same age, of the actor's stature.
///
/// # Errors
/// What cannot be met, in words.
pub(crate) fn another_adult(file: &ScenarioFile, template: &Humanoid, actor: &Humanoid) -> Result<Humanoid, String> {
    let shape = file.scenario.actor.shape.as_ref();
    let own = shape.filter(|shape| is_drawn(shape)).map(drawn_actor);
    let age_years = own.and_then(|person| person.age_years);
    let settings = ShapeSettings {
        population: Some(if age_years.is_some() { PopulationName::Children } else { PopulationName::Adults }),
        sex: shape.and_then(|shape| shape.sex),
        age_years,
        ..ShapeSettings::default()
    };
    let seed = mismatch_seed(file, actor);
    let person = drawn(&settings, seed, DrawnFor::Tracker, actor.stature());
    Ok(template.reshaped(&physique_shape(template, &Physique::from(&person))?))
}

/// `body`, another robot's of the actor's lengths, with the actor's mass.
///
/// # Errors
/// What cannot be met, in words.
pub(crate) fn of_its_mass(body: &Humanoid, actor: &Humanoid) -> Result<Humanoid, String> {
    let physique = Physique { mass_kg: Some(actor.total_mass()), ..Physique::default() };
    Ok(body.reshaped(&physique_shape(body, &physique)?))
}

/// Whether somebody else than the recorded subject is drawn.
fn is_drawn(settings: &ShapeSettings) -> bool {
    settings.population.is_some() || settings.age_years.is_some()
}

fn drawn_actor(settings: &ShapeSettings) -> Person {
    let seed = u64::from(settings.seed.unwrap_or(1));
    drawn(settings, seed.into(), DrawnFor::Actor, settings.stature_m)
}

fn drawn(settings: &ShapeSettings, seed: KeyedSeed, whose: DrawnFor, stature_m: Option<f64>) -> Person {
    let by_population = match settings.population {
        Some(PopulationName::Women) => Some(Sex::Female),
        Some(PopulationName::Men) => Some(Sex::Male),
        Some(PopulationName::Adults | PopulationName::Children) | None => None,
    };
    let sex = by_population.or(settings.sex);
    if settings.population == Some(PopulationName::Children) || settings.age_years.is_some() {
        return Person::drawn_child(seed, whose as u64, sex, settings.age_years, stature_m);
    }
    Person::drawn(seed, whose as u64, sex, stature_m)
}

/// What is drawn, with what is said in its place.
fn physique_of(settings: &ShapeSettings, person: Option<&Person>, mass_kg: f64) -> Physique {
    let mut physique = person.map(Physique::from).unwrap_or_default();
    if let (None, Some(sex)) = (person, settings.sex) {
        // girths of that sex at the same mass
        let (lengths, girths) = ([1.0; 9], [1.0; 8]);
        let even = Person { sex, age_years: None, stature_m: 1.0, mass_kg, lengths, girths };
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

/// A person as a note.
fn in_words(settings: &ShapeSettings, person: Option<&Person>, body: &Humanoid) -> String {
    let who = person.map_or("the recorded subject, changed".to_owned(), |person| {
        let who = match (person.age_years, person.sex) {
            (None, Sex::Female) => "a woman".to_owned(),
            (None, Sex::Male) => "a man".to_owned(),
            (Some(age), Sex::Female) => format!("a girl of {age:.1} years, in an adult's proportions"),
            (Some(age), Sex::Male) => format!("a boy of {age:.1} years, in an adult's proportions"),
        };
        format!("{who}, drawn with seed {}", settings.seed.unwrap_or(1))
    });
    let stature = body.stature().map_or(String::new(), |stature| format!(", {stature:.3} m"));
    let said = |map: &BTreeMap<String, f64>| map.keys().cloned().collect::<Vec<_>>();
    let said = [said(&settings.lengths_m), said(&settings.girths)].concat();
    let said = if said.is_empty() { String::new() } else { format!("; said: {}", said.join(", ")) };
    format!("actor.shape: {who}{stature}, {:.1} kg{said}", body.total_mass())
}
