//! People: sex, stature, mass, and individual proportions of segments, drawn from a published population.
//!
//! **Published**: stature and the logarithm of mass are bivariate normal in men, and a mixture of two such
//! distributions in women, with means, standard deviations and correlations of adults of the United States (`[Brainard
//! 1992]`). Shares of mass of women's segments relative to men's, from which girths follow, are de Leva's (`[de Leva
//! 1996]`). Mean lengths are the template's: Drillis and Contini's for the built-in robots.
//!
//! **Assumed**, because no table of the spread around these means is available: a segment's share of the stature
//! varies by [`LENGTH_SPREAD`], its girth at a given mass by [`GIRTH_SPREAD`], independently of each other. Lengths
//! are then scaled to the stature.

use crate::rng::{KeyedSeed, Purpose, normal};
use rand::RngExt;

/// Standard deviation of a segment's share of the stature, relative; assumed.
const LENGTH_SPREAD: f64 = 0.03;
/// Standard deviation of a segment's girth at a given length and mass, relative; assumed.
const GIRTH_SPREAD: f64 = 0.04;

const METRES_PER_INCH: f64 = 0.0254;
const KILOGRAMS_PER_POUND: f64 = 0.453_592_37;

/// Draws outside these ranges are redrawn: metres and kilograms.
const STATURES: std::ops::RangeInclusive<f64> = 1.35..=2.15;
const MASSES: std::ops::RangeInclusive<f64> = 35.0..=180.0;

/// Segments whose lengths vary, in the order of [`Person::lengths`].
pub const VARIED_LENGTHS: [&str; 9] =
    ["trunk", "head", "shoulder_width", "hip_width", "upper_arm", "forearm", "thigh", "shank", "foot"];

/// Segments whose girths vary, in the order of [`Person::girths`].
pub const VARIED_GIRTHS: [&str; 8] = ["head", "trunk", "upper_arm", "forearm", "hand", "thigh", "shank", "foot"];

/// De Leva's shares of the body's mass, women's and men's, in that order. For limbs, those of one side.
const MASS_SHARES: [[f64; 8]; 2] = [
    [0.0668, 0.4257, 0.0255, 0.0138, 0.0056, 0.1478, 0.0481, 0.0129],
    [0.0694, 0.4346, 0.0271, 0.0162, 0.0061, 0.1416, 0.0433, 0.0137],
];

/// Stature in inches and the logarithm of mass in pounds: means, standard deviations, correlation, share of the sex.
struct Cluster {
    stature: [f64; 2],
    log_mass: [f64; 2],
    correlation: f64,
    share: f64,
}

const MEN: [Cluster; 1] = [Cluster { stature: [69.18, 2.87], log_mass: [5.14, 0.17], correlation: 0.42, share: 1.0 }];
const WOMEN: [Cluster; 2] = [
    Cluster { stature: [63.11, 2.76], log_mass: [5.06, 0.24], correlation: 0.41, share: 0.46 },
    Cluster { stature: [64.36, 2.49], log_mass: [4.86, 0.14], correlation: 0.44, share: 0.54 },
];

/// A person's sex, as in the tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sex {
    /// Women.
    Female,
    /// Men.
    Male,
}

/// A person.
#[derive(Clone, Debug, PartialEq)]
pub struct Person {
    /// Sex.
    pub sex: Sex,
    /// Height from sole to crown, metres.
    pub stature_m: f64,
    /// Mass, kilograms.
    pub mass_kg: f64,
    /// Factors on lengths at this stature, in the order of [`VARIED_LENGTHS`].
    pub lengths: [f64; 9],
    /// Factors on girths at this mass, in the order of [`VARIED_GIRTHS`].
    pub girths: [f64; 8],
}

impl Person {
    /// An adult of the United States. `sex` is drawn with equal chances if `None`; if `stature_m` is given, the mass
    /// is drawn for that stature. The same seed and index give the same person.
    pub fn drawn(seed: impl Into<KeyedSeed>, index: u64, sex: Option<Sex>, stature_m: Option<f64>) -> Self {
        let mut rng = seed.into().stream(Purpose::BodyShape, 0, 0, index);
        let coin: f64 = rng.random();
        let sex = sex.unwrap_or(if coin < 0.5 { Sex::Female } else { Sex::Male });
        let clusters: &[Cluster] = if sex == Sex::Female { &WOMEN } else { &MEN };
        let which: f64 = rng.random();
        let cluster = if which < clusters[0].share { &clusters[0] } else { &clusters[clusters.len() - 1] };
        let (mut stature, mut mass) = (0.0, 0.0);
        for _ in 0..1000 {
            let (first, second) = (normal(&mut rng), normal(&mut rng));
            let [mean, spread] = cluster.stature;
            let tall = stature_m.map_or(first, |stature| (stature / METRES_PER_INCH - mean) / spread);
            let share = cluster.correlation;
            let heavy = share * tall + libm::sqrt(1.0 - share * share) * second;
            stature = (mean + spread * tall) * METRES_PER_INCH;
            mass = libm::exp(cluster.log_mass[0] + cluster.log_mass[1] * heavy) * KILOGRAMS_PER_POUND;
            if (stature_m.is_some() || STATURES.contains(&stature)) && MASSES.contains(&mass) {
                break;
            }
        }
        let (lengths, girths) = Self::varied(&mut rng);
        Self { sex, stature_m: stature, mass_kg: mass, lengths, girths }.of_its_sex()
    }

    /// Random factors on lengths and girths.
    fn varied(rng: &mut rand_chacha::ChaCha8Rng) -> ([f64; 9], [f64; 8]) {
        let mut factors = |spread: f64| libm::exp(spread * normal(rng));
        (std::array::from_fn(|_| factors(LENGTH_SPREAD)), std::array::from_fn(|_| factors(GIRTH_SPREAD)))
    }

    /// Adapts girths to the masses of a woman's segments; a man is unchanged.
    #[must_use]
    pub fn of_its_sex(mut self) -> Self {
        if self.sex == Sex::Female {
            for (girth, (woman, man)) in self.girths.iter_mut().zip(MASS_SHARES[0].iter().zip(&MASS_SHARES[1])) {
                *girth *= libm::sqrt(woman / man);
            }
        }
        self
    }
}

/// The index into [`VARIED_GIRTHS`] of a link's segment, by its name.
pub fn girth_segment(link: &str) -> Option<usize> {
    let name = link.to_ascii_lowercase();
    let known = [
        ("upper_arm", 2),
        ("forearm", 3),
        ("hand", 4),
        ("thigh", 5),
        ("shank", 6),
        ("toes", 7),
        ("foot", 7),
        ("head", 0),
        ("neck", 0),
        ("pelvis", 1),
        ("abdomen", 1),
        ("thorax", 1),
        ("torso", 1),
        ("trunk", 1),
        ("clavicle", 1),
    ];
    known.iter().find(|(word, _)| name.contains(word)).map(|(_, segment)| *segment)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and standard deviation.
    fn moments(values: &[f64]) -> (f64, f64) {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64;
        (mean, square.sqrt())
    }

    #[test]
    fn drawn_men_and_women_have_the_published_statures_masses_and_correlation() {
        let of = |sex| (0..4000).map(|seed| Person::drawn(seed, 0, Some(sex), None)).collect::<Vec<_>>();
        let (men, women) = (of(Sex::Male), of(Sex::Female));
        let statures = |people: &[Person]| people.iter().map(|p| p.stature_m / METRES_PER_INCH).collect::<Vec<_>>();
        let logs =
            |people: &[Person]| people.iter().map(|p| (p.mass_kg / KILOGRAMS_PER_POUND).ln()).collect::<Vec<_>>();
        // four standard errors of a mean, and of a standard deviation
        let near = |(mean, spread): (f64, f64), (m, s): (f64, f64)| {
            assert!((mean - m).abs() < 4.0 * s / 63.0 && (spread - s).abs() < 4.0 * s / 89.0, "{mean} {spread}");
        };
        near(moments(&statures(&men)), (69.18, 2.87));
        near(moments(&logs(&men)), (5.14, 0.17));
        // of a mixture, by hand: 0.46 * 63.11 + 0.54 * 64.36, and its standard deviation
        let mean: f64 = 0.46 * 63.11 + 0.54 * 64.36;
        let square =
            0.46 * (2.76_f64.powi(2) + (63.11 - mean).powi(2)) + 0.54 * (2.49_f64.powi(2) + (64.36 - mean).powi(2));
        near(moments(&statures(&women)), (mean, square.sqrt()));
        let (a, b) = (statures(&men), logs(&men));
        let ((ma, sa), (mb, sb)) = (moments(&a), moments(&b));
        let products: f64 = a.iter().zip(&b).map(|(x, y)| (x - ma) * (y - mb)).sum();
        let correlation = products / (sa * sb * 3999.0);
        assert!((correlation - 0.42).abs() < 0.06, "{correlation}");
    }

    #[test]
    fn a_seed_determines_a_person_and_a_given_stature_is_kept() {
        assert_eq!(Person::drawn(3, 0, None, None), Person::drawn(3, 0, None, None));
        assert_ne!(Person::drawn(3, 0, None, None), Person::drawn(4, 0, None, None));
        let both = (0..40).map(|seed| Person::drawn(seed, 0, None, None).sex).collect::<Vec<_>>();
        assert!(both.contains(&Sex::Female) && both.contains(&Sex::Male));
        let tall: Vec<Person> = (0..400).map(|seed| Person::drawn(seed, 0, Some(Sex::Male), Some(1.95))).collect();
        assert!(tall.iter().all(|person| (person.stature_m - 1.95).abs() < 1e-12));
        let mean = moments(&tall.iter().map(|p| p.mass_kg).collect::<Vec<_>>()).0;
        let all = moments(&(0..400).map(|s| Person::drawn(s, 0, Some(Sex::Male), None).mass_kg).collect::<Vec<_>>()).0;
        assert!(mean > all + 5.0, "tall men are heavier: {mean} kg, {all} kg");
    }

    #[test]
    fn both_sexes_shares_of_mass_sum_to_one_and_the_links_of_the_actor_have_a_segment() {
        for shares in MASS_SHARES {
            let sum = shares[0] + shares[1] + 2.0 * shares[2..].iter().sum::<f64>();
            assert!((sum - 1.0).abs() < 0.0015, "{sum}");
        }
        let body = crate::body::shipped("actor").unwrap();
        for link in body.links.iter().filter(|link| !link.solids.is_empty()) {
            assert!(girth_segment(&link.name).is_some(), "{}", link.name);
        }
    }
}
