//! `[actor] shape` and `mismatch = "population"`: bodies of other people.

use super::mismatch_seed::mismatch_seed;
use crate::body::{BodyShape, Humanoid, Person, Sex, VARIED_GIRTHS, VARIED_LENGTHS};
use crate::common::{ExperimentError, scenario_error};
use crate::editing::carried_over;
use crate::retarget::{Physique, Retargeted, physique_shape};
use crate::rng::KeyedSeed;
use crate::scenario::{PopulationName, ScenarioFile, ShapeSettings};

/// Whom a person is drawn for: the same seed draws different persons for the actor and the tracker.
#[derive(Clone, Copy, Debug)]
enum DrawnFor {
    Actor = 0,
    Tracker = 1,
}

/// Gives a retargeted motion the body of `[actor] shape`: joint angles stay, the path is scaled with the legs.
///
/// # Errors
/// [`ExperimentError`] that names the key.
pub(crate) fn apply_shape(
    file: &ScenarioFile,
    template: &Humanoid,
    retargeted: &mut Retargeted,
) -> Result<(), ExperimentError> {
    let Some(settings) = &file.scenario.actor.shape else { return Ok(()) };
    let unmet = |detail: String| scenario_error(file, "actor.shape", detail);
    // a drawn person replaces the recorded subject; given values only change that subject
    let person = is_drawn(settings).then(|| drawn_actor(settings));
    let subject = if person.is_some() { BodyShape::identity(template) } else { retargeted.shape.clone() };
    let base = template.reshaped(&subject);
    let physique = physique_of(settings, person.as_ref(), base.total_mass());
    let shape = subject.then(&physique_shape(&base, &physique).map_err(unmet)?);
    let body = template.reshaped(&shape);
    retargeted.motion = carried_over(&retargeted.humanoid, &body, &retargeted.motion);
    retargeted.report.notes.push(describe(settings, person.as_ref(), &body));
    retargeted.humanoid = body;
    retargeted.shape = shape;
    Ok(())
}

/// The tracker's body as another adult, or child of the same age, of the actor's stature.
///
/// # Errors
/// A message about the requirement that cannot be met.
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

/// `body`, of another robot with the actor's lengths, with the actor's mass.
///
/// # Errors
/// A message about the requirement that cannot be met.
pub(crate) fn with_mass_of(body: &Humanoid, actor: &Humanoid) -> Result<Humanoid, String> {
    let physique = Physique { mass_kg: Some(actor.total_mass()), ..Physique::default() };
    Ok(body.reshaped(&physique_shape(body, &physique)?))
}

/// Whether a person is drawn instead of the recorded subject.
fn is_drawn(settings: &ShapeSettings) -> bool {
    settings.population.is_some() || settings.age_years.is_some()
}

fn drawn_actor(settings: &ShapeSettings) -> Person {
    let seed = u64::from(settings.seed.unwrap_or(1));
    drawn(settings, seed.into(), DrawnFor::Actor, settings.stature_m)
}

fn drawn(settings: &ShapeSettings, seed: KeyedSeed, drawn_for: DrawnFor, stature_m: Option<f64>) -> Person {
    let by_population = match settings.population {
        Some(PopulationName::Women) => Some(Sex::Female),
        Some(PopulationName::Men) => Some(Sex::Male),
        Some(PopulationName::Adults | PopulationName::Children) | None => None,
    };
    let sex = by_population.or(settings.sex);
    if settings.population == Some(PopulationName::Children) || settings.age_years.is_some() {
        return Person::drawn_child(seed, drawn_for as u64, sex, settings.age_years, stature_m);
    }
    Person::drawn(seed, drawn_for as u64, sex, stature_m)
}

/// The drawn values, replaced by given ones.
fn physique_of(settings: &ShapeSettings, person: Option<&Person>, mass_kg: f64) -> Physique {
    let mut physique = person.map(Physique::from).unwrap_or_default();
    if let (None, Some(sex)) = (person, settings.sex) {
        // the girths of that sex at the same mass
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

/// The note about a person.
fn describe(settings: &ShapeSettings, person: Option<&Person>, body: &Humanoid) -> String {
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
    let given: Vec<&str> = settings.lengths_m.keys().chain(settings.girths.keys()).map(String::as_str).collect();
    let given = if given.is_empty() { String::new() } else { format!("; given: {}", given.join(", ")) };
    format!("actor.shape: {who}{stature}, {:.1} kg{given}", body.total_mass())
}
