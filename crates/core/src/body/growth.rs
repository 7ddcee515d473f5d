//! Children and youths of 2 to 20 years: stature and mass by age.
//!
//! **Published**: the growth charts of the United States (`[Kuczmarski 2002]`) give stature and body mass index (mass
//! divided by the square of the stature) for each sex and month as `M (1 + L S z)^(1 / L)` of a standard normal `z`.
//! The tables here contain L, M and S of every twelfth month, with linear interpolation between them, which changes
//! median statures by less than 4 mm.
//!
//! **Assumed**: the two deviates of a child are independent. Segments' shares of the stature, and their spread, are
//! those of adults ([`super::population`]); a young child actually has a larger head and shorter legs.

use rand::RngExt;

use super::{Person, Sex};
use crate::rng::{KeyedSeed, Purpose, normal};

/// Ages of the growth charts, years.
pub const CHILD_YEARS: std::ops::RangeInclusive<f64> = 2.0..=20.0;

/// Deviates beyond this many standard deviations are redrawn: the charts end at the 3rd and 97th percentile.
const FARTHEST: f64 = 2.5;

/// Ages of the tables' rows, months.
const MONTHS: [f64; 20] = [
    24.0, 30.5, 36.5, 48.5, 60.5, 72.5, 84.5, 96.5, 108.5, 120.5, 132.5, 144.5, 156.5, 168.5, 180.5, 192.5, 204.5,
    216.5, 228.5, 240.0,
];

/// L, M and S of one month.
type Row = [f64; 3];

/// Stature, centimetres: girls and boys.
const STATURE: [[Row; 20]; 2] = [
    [
        [1.07244896, 84.97555512, 0.040791394],
        [0.81454413, 90.33341722, 0.04175368],
        [0.54198094, 94.21335709, 0.042017509],
        [0.225705996, 101.033927, 0.043259907],
        [-0.057729947, 107.9566031, 0.044276588],
        [-0.219069129, 115.0054978, 0.044963636],
        [-0.210210748, 121.7616844, 0.045460702],
        [-0.079283065, 127.8262759, 0.045968169],
        [0.08414848, 133.1303527, 0.04688401],
        [0.284748919, 138.2111552, 0.048704503],
        [0.744289752, 144.2609497, 0.050524236],
        [1.303044695, 151.4865636, 0.048599314],
        [1.242968236, 157.3436995, 0.043859135],
        [0.95657215, 160.4776996, 0.041022401],
        [0.895569834, 161.8979913, 0.040083845],
        [0.941145943, 162.5689958, 0.039820663],
        [0.999505539, 162.9238449, 0.039732048],
        [1.047571238, 163.1307866, 0.039687311],
        [1.083315329, 163.2590052, 0.039657339],
        [1.108046193, 163.338251, 0.039636316],
    ],
    [
        [0.941523967, 86.45220101, 0.040321528],
        [0.174489485, 91.33242379, 0.04096533],
        [-0.390918369, 95.27359106, 0.04053412],
        [0.827636736, 102.5104735, 0.041344257],
        [1.266367398, 109.1751441, 0.042593311],
        [1.137442868, 115.6608862, 0.043673359],
        [0.753244292, 122.0305342, 0.044403374],
        [0.455267507, 128.1237104, 0.045127088],
        [0.415687443, 133.7344759, 0.046217028],
        [0.505564115, 138.8234114, 0.047610108],
        [0.487939275, 143.7303663, 0.048937694],
        [0.420919142, 149.3088178, 0.049947823],
        [0.816239713, 156.4098858, 0.050333444],
        [1.670433444, 164.1418486, 0.04894519],
        [2.205180153, 170.139255, 0.045889585],
        [2.113023423, 173.6100518, 0.043085685],
        [1.724738292, 175.340954, 0.041408129],
        [1.399999187, 176.1850208, 0.04064364],
        [1.229163362, 176.6178621, 0.040391101],
        [1.167279219, 176.8492322, 0.040369574],
    ],
];

/// Body mass index, kg/m^2: girls and boys.
const MASS_INDEX: [[Row; 20]; 2] = [
    [
        [-0.98660853, 16.423396643, 0.085451785],
        [-1.53454192, 16.005930007, 0.0809324482],
        [-2.096828937, 15.699241878, 0.0786052551],
        [-3.018521987, 15.298548972, 0.0787133246],
        [-3.35007771, 15.15188405, 0.0843001394],
        [-3.225606516, 15.216902957, 0.0938030328],
        [-2.926186592, 15.453565452, 0.1053252892],
        [-2.617192204, 15.826995169, 0.1171586674],
        [-2.360920527, 16.306093162, 0.1280135154],
        [-2.171295888, 16.862313656, 0.1370570042],
        [-2.045235058, 17.469065845, 0.1438683412],
        [-1.975521156, 18.101488036, 0.1483614954],
        [-1.954977947, 18.736433381, 0.1507051384],
        [-1.977073595, 19.352572085, 0.1512557127],
        [-2.034893091, 19.930566203, 0.1505116446],
        [-2.119156972, 20.453256172, 0.14909006],
        [-2.215737645, 20.905758394, 0.1477233147],
        [-2.303687802, 21.275322389, 0.1472687698],
        [-2.355677743, 21.550821547, 0.1487235462],
        [-2.34495843, 21.716999342, 0.152974718],
    ],
    [
        [-2.01118107, 16.575027675, 0.080592465],
        [-1.642106779, 16.249723714, 0.0754991255],
        [-1.419991255, 16.000304012, 0.0726344323],
        [-1.714869347, 15.628172692, 0.0718892136],
        [-2.61516595, 15.419141631, 0.0759922501],
        [-3.21170511, 15.383532169, 0.0830481778],
        [-3.323188896, 15.512869363, 0.0921313054],
        [-3.18305795, 15.782310065, 0.1020911894],
        [-2.971148225, 16.167122344, 0.1117206908],
        [-2.765648008, 16.646138439, 0.1201124636],
        [-2.590560148, 17.200887318, 0.1267346133],
        [-2.447426113, 17.814633586, 0.1313890423],
        [-2.3294571, 18.471797059, 0.1341414703],
        [-2.227362173, 19.157586716, 0.1352510825],
        [-2.132344989, 19.857661209, 0.1351101588],
        [-2.039015385, 20.557647399, 0.1341983225],
        [-1.949134561, 21.242479819, 0.1330566901],
        [-1.874670324, 21.895868501, 0.1322863818],
        [-1.835138046, 22.500717781, 0.1325663592],
        [-1.84233016, 23.020294238, 0.134539365],
    ],
];

impl Person {
    /// A child or youth of the United States. `sex` is drawn with equal chances if `None`; `age_years` is clamped to
    /// [`CHILD_YEARS`], or drawn uniformly from it if `None`; if `stature_m` is given, the mass is drawn for that age
    /// and stature. The same seed and index give the same person.
    pub fn drawn_child(
        seed: impl Into<KeyedSeed>,
        index: u64,
        sex: Option<Sex>,
        age_years: Option<f64>,
        stature_m: Option<f64>,
    ) -> Self {
        let mut rng = seed.into().stream(Purpose::BodyShape, 1, 0, index);
        let (coin, share): (f64, f64) = (rng.random(), rng.random());
        let sex = sex.unwrap_or(if coin < 0.5 { Sex::Female } else { Sex::Male });
        let (youngest, oldest) = (*CHILD_YEARS.start(), *CHILD_YEARS.end());
        let age = age_years.unwrap_or(youngest + share * (oldest - youngest)).clamp(youngest, oldest);
        let mut deviate = || {
            let mut draws = (0..1000).map(|_| normal(&mut rng));
            draws.find(|deviate| deviate.abs() <= FARTHEST).unwrap_or(0.0)
        };
        let (tall, heavy) = (deviate(), deviate());
        let stature_m = stature_m.unwrap_or(0.01 * at(&STATURE, sex, age, tall));
        let mass_kg = at(&MASS_INDEX, sex, age, heavy) * stature_m * stature_m;
        let (lengths, girths) = Self::varied(&mut rng);
        Self { sex, age_years: Some(age), stature_m, mass_kg, lengths, girths }
    }
}

/// The value of a table this many standard deviations from the median.
fn at(table: &[[Row; 20]; 2], sex: Sex, age_years: f64, deviate: f64) -> f64 {
    let rows = &table[usize::from(sex == Sex::Male)];
    let months = 12.0 * age_years;
    let after = MONTHS.iter().position(|row| *row >= months).unwrap_or(MONTHS.len() - 1).max(1);
    let share = (months - MONTHS[after - 1]) / (MONTHS[after] - MONTHS[after - 1]);
    let [power, median, spread] =
        std::array::from_fn(|i| rows[after - 1][i] + share * (rows[after][i] - rows[after - 1][i]));
    if power.abs() < 1e-6 {
        median * libm::exp(spread * deviate)
    } else {
        median * libm::pow(1.0 + power * spread * deviate, 1.0 / power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_percentiles_are_met_at_the_rows_and_between_them() {
        // the charts' own percentiles: 3rd, 5th, 95th, 97th
        let (p3, p5) = (-1.880_793_608, -1.644_853_627);
        let cases = [
            (&STATURE, Sex::Male, 120.5, p3, 126.6677753),
            (&STATURE, Sex::Male, 120.5, -p3, 151.5294179),
            (&STATURE, Sex::Female, 156.5, -p3, 170.1979436),
            (&STATURE, Sex::Female, 60.5, p5, 100.3890853),
            (&MASS_INDEX, Sex::Female, 60.5, p5, 13.520910267),
            (&MASS_INDEX, Sex::Female, 60.5, -p5, 18.257381051),
            (&MASS_INDEX, Sex::Male, 204.5, -p3, 29.940973346),
            (&MASS_INDEX, Sex::Male, 24.0, p3, 14.520953329),
        ];
        for (table, sex, months, deviate, expected) in cases {
            let found = at(table, sex, months / 12.0, deviate);
            assert!((found / expected - 1.0).abs() < 1e-7, "{found} {expected}");
        }
        // months that are not in these tables
        let between = [
            (&STATURE, Sex::Male, 66.5, 112.4295761, 0.1),
            (&STATURE, Sex::Male, 162.5, 160.3493168, 0.1),
            (&STATURE, Sex::Female, 138.5, 147.8423918, 0.1),
            (&STATURE, Sex::Female, 150.5, 154.755501, 0.4),
            (&STATURE, Sex::Male, 174.5, 167.4641466, 0.4),
            (&STATURE, Sex::Female, 27.5, 87.9960184, 0.2),
            (&MASS_INDEX, Sex::Female, 150.5, 18.420022839, 0.01),
            (&MASS_INDEX, Sex::Male, 102.5, 15.961694805, 0.03),
        ];
        for (table, sex, months, expected, within) in between {
            let found = at(table, sex, months / 12.0, 0.0);
            assert!((found - expected).abs() < within, "{found} {expected} at {months} months");
        }
    }

    #[test]
    fn median_statures_grow_with_age_and_rows_are_consistent_with_their_neighbours() {
        for sex in [0, 1] {
            let medians = STATURE[sex].map(|row| row[1]);
            assert!(medians.windows(2).all(|pair| pair[1] > pair[0]));
            for table in [&STATURE[sex], &MASS_INDEX[sex]] {
                for (i, rows) in table.windows(3).enumerate() {
                    let off = (rows[1][1] / (0.5 * (rows[0][1] + rows[2][1])) - 1.0).abs();
                    assert!(off < 0.02 && (0.035..0.16).contains(&rows[1][2]), "row {i}: {rows:?}");
                }
            }
        }
    }

    #[test]
    fn drawn_children_have_the_published_median_and_spread() {
        let of = |age| (0..2001).map(move |seed| Person::drawn_child(seed, 0, Some(Sex::Male), Some(age), None));
        let age = 108.5 / 12.0;
        let mut statures: Vec<f64> = of(age).map(|person| 100.0 * person.stature_m).collect();
        statures.sort_by(f64::total_cmp);
        // published: 10th, 50th and 90th percentile; the tails beyond 2.5 deviates are cut off
        for (place, expected) in [(200, 125.9500588), (1000, 133.7344759), (1800, 141.793025)] {
            assert!((statures[place] - expected).abs() < 0.8, "{} {expected}", statures[place]);
        }
        let mut indices: Vec<f64> = of(age).map(|p| p.mass_kg / (p.stature_m * p.stature_m)).collect();
        indices.sort_by(f64::total_cmp);
        assert!((indices[1000] - 16.167122344).abs() < 0.2, "{}", indices[1000]);
    }

    #[test]
    fn a_seed_determines_a_child_and_given_values_are_kept() {
        let drawn = |seed| Person::drawn_child(seed, 0, None, None, None);
        assert_eq!(drawn(3), drawn(3));
        assert_ne!(drawn(3), drawn(4));
        let ages: Vec<f64> = (0..200).filter_map(|seed| drawn(seed).age_years).collect();
        assert!(ages.iter().all(|age| CHILD_YEARS.contains(age)));
        assert!(ages.iter().any(|age| *age < 5.0) && ages.iter().any(|age| *age > 17.0));
        let given = Person::drawn_child(5, 1, Some(Sex::Female), Some(7.0), Some(1.3));
        assert_eq!((given.sex, given.age_years, given.stature_m), (Sex::Female, Some(7.0), 1.3));
        assert!((18.0..40.0).contains(&given.mass_kg), "{}", given.mass_kg);
    }
}
