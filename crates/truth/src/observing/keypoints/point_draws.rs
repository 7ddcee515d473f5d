//! The errors and the confidence of one point in one camera, frame by frame.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Beta, Distribution};

use super::stretches::Stretches;
use super::{KeypointDraw, KeypointSettings, draws};
use skiagraph_core::body::Keypoint;
use skiagraph_core::rng::{KeyedSeed, normal};

/// Area of a person in the image as a share of its squared height, for COCO's similarity.
const AREA: f64 = 0.2;
/// Similarities nearer than this to 0 or 1 get no noise of the confidence.
const CERTAIN: f64 = 1e-6;

/// What decides the size of a point's errors in a frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PointConditions {
    /// Height of the person in the image, pixels.
    pub(super) height_px: f64,
    /// Whether the point is hidden by the body, by a prop or by another person.
    pub(super) is_hidden: bool,
}

/// What a detector says of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PointError {
    /// Slow, white and gross error, pixels.
    pub(super) offset_px: [f64; 2],
    /// From 0 to 1.
    pub(super) confidence: f64,
    pub(super) is_gross: bool,
    pub(super) is_missed: bool,
}

/// The streams and states of one point in one camera.
pub(super) struct PointDraws {
    point: Keypoint,
    /// The deviation of its annotations divided by the mean of COCO's points.
    relative_deviation: f64,
    slow: SlowError,
    white: ChaCha8Rng,
    gross: Stretches,
    offsets: ChaCha8Rng,
    /// The offset of the present stretch, in units of its scale.
    gross_offset: Option<[f64; 2]>,
    missing: Stretches,
    confidence: ChaCha8Rng,
}

/// A stationary normal process of variance 1 in two coordinates (autoregressive of order 1).
struct SlowError {
    random: ChaCha8Rng,
    value: Option<[f64; 2]>,
}

impl SlowError {
    /// The next value, whose correlation with the last one is `memory`.
    fn step(&mut self, memory: f64) -> [f64; 2] {
        let fresh = two_normals(&mut self.random);
        let share = (1.0 - memory * memory).sqrt();
        let value = match self.value {
            None => fresh,
            Some(last) => [0, 1].map(|i| memory * last[i] + share * fresh[i]),
        };
        self.value = Some(value);
        value
    }
}

impl PointDraws {
    pub(super) fn new(seed: KeyedSeed, camera: usize, point: Keypoint) -> Self {
        let stream = |draw| draws(seed, draw, camera, point as u64);
        Self {
            point,
            relative_deviation: point.relative_deviation(),
            slow: SlowError { random: stream(KeypointDraw::Slow), value: None },
            white: stream(KeypointDraw::White),
            gross: Stretches::new(stream(KeypointDraw::Gross)),
            offsets: stream(KeypointDraw::GrossOffset),
            gross_offset: None,
            missing: Stretches::new(stream(KeypointDraw::Missing)),
            confidence: stream(KeypointDraw::Confidence),
        }
    }

    /// The errors of the next frame, `step_s` seconds after the last.
    pub(super) fn draw(&mut self, settings: &KeypointSettings, of: PointConditions, step_s: f64) -> PointError {
        let (error, rate) = match of.is_hidden {
            true => (1.0 + settings.occluded_error, 1.0 + settings.occluded_rate),
            false => (1.0, 1.0),
        };
        let unit_px = 0.01 * error * of.height_px;
        let mut offset_px = [0.0; 2];
        let mut add = |scale: f64, by: [f64; 2]| offset_px = [0, 1].map(|i| offset_px[i] + scale * by[i]);
        if settings.slow_percent != 0.0 {
            let memory = libm::exp(-step_s / settings.slow_s);
            add(settings.slow_percent * self.relative_deviation * unit_px, self.slow.step(memory));
        }
        if settings.white_percent != 0.0 {
            add(settings.white_percent * self.relative_deviation * unit_px, two_normals(&mut self.white));
        }
        let is_gross = self.gross.step((settings.gross * rate).min(1.0), settings.stretch_s, step_s);
        let kept = self.gross_offset.filter(|_| settings.stretch_s > 0.0);
        self.gross_offset = is_gross.then(|| kept.unwrap_or_else(|| student_offset(&mut self.offsets)));
        if let Some(offset) = self.gross_offset {
            add(settings.gross_percent * unit_px, offset);
        }
        let is_missed = self.missing.step((settings.missing * rate).min(1.0), settings.stretch_s, step_s);
        let similar = similarity(self.point, offset_px, of.height_px);
        let confidence = noisy(similar, settings.confidence_noise, &mut self.confidence);
        PointError { offset_px, confidence, is_gross, is_missed }
    }
}

fn two_normals(random: &mut ChaCha8Rng) -> [f64; 2] {
    [normal(random), normal(random)]
}

/// A deviate of the round Student t distribution with 3 degrees of freedom.
fn student_offset(random: &mut ChaCha8Rng) -> [f64; 2] {
    let [x, y] = two_normals(random);
    let squares: f64 = (0..3).map(|_| normal(random)).map(|z| z * z).sum();
    let length = (squares / 3.0).sqrt();
    [x / length, y / length]
}

/// COCO's similarity of a point with this error: 1 without one.
fn similarity(point: Keypoint, offset_px: [f64; 2], height_px: f64) -> f64 {
    let squared: f64 = offset_px.iter().map(|x| x * x).sum();
    if squared == 0.0 {
        return 1.0;
    }
    let width = 2.0 * point.annotation_deviation() * height_px;
    libm::exp(-squared / (2.0 * AREA * width * width))
}

/// A number from 0 to 1 with mean `similarity` and standard deviation `noise` sqrt(`similarity` (1 - `similarity`)).
fn noisy(similarity: f64, noise: f64, random: &mut ChaCha8Rng) -> f64 {
    if noise == 0.0 || !(CERTAIN..=1.0 - CERTAIN).contains(&similarity) {
        return similarity;
    }
    // a beta distribution with parameters k n, (1 - k) n has variance k (1 - k) / (n + 1)
    let size = (1.0 / (noise * noise) - 1.0).max(CERTAIN);
    Beta::new(similarity * size, (1.0 - similarity) * size).map_or(similarity, |beta| beta.sample(random))
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::KeypointLayout;
    use skiagraph_core::rng::{Purpose, stream};

    const DRAWS: usize = 100_000;
    const STEP_S: f64 = 0.02;

    fn drawn(settings: KeypointSettings, of: PointConditions) -> Vec<PointError> {
        let mut draws = PointDraws::new(5.into(), 1, Keypoint::LeftKnee);
        (0..DRAWS).map(|_| draws.draw(&settings, of, STEP_S)).collect()
    }

    fn exact() -> KeypointSettings {
        KeypointSettings::exact(KeypointLayout::Coco17)
    }

    const SEEN: PointConditions = PointConditions { height_px: 400.0, is_hidden: false };
    const HIDDEN: PointConditions = PointConditions { is_hidden: true, ..SEEN };

    fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
        let count = values.len() as f64;
        values.sum::<f64>() / count
    }

    fn deviation(drawn: &[PointError]) -> f64 {
        mean(drawn.iter().map(|d| 0.5 * (d.offset_px[0].powi(2) + d.offset_px[1].powi(2)))).sqrt()
    }

    #[test]
    fn without_strengths_points_are_exact_and_certain() {
        let certain = PointError { confidence: 1.0, ..PointError::default() };
        assert!(drawn(exact(), HIDDEN).iter().all(|drawn| *drawn == certain));
    }

    #[test]
    fn the_slow_error_has_its_variance_and_its_correlation_at_every_lag() {
        let settings = KeypointSettings { slow_percent: 1.0, slow_s: 0.1, ..exact() };
        let found = drawn(settings, SEEN);
        // 1 % of 400 px, times 0.087 over the mean deviation of COCO's points, 1.138 / 17
        let expected = 4.0 * 0.087 / (1.138 / 17.0);
        // 100,000 frames of 0.02 s with a memory of 0.1 s in two coordinates are some 20,000 independent ones
        assert!((deviation(&found) - expected).abs() < 0.02 * expected, "{}", deviation(&found));
        for lag in [1, 5, 20] {
            let along = found.windows(lag + 1);
            let product = mean(along.map(|w| w[0].offset_px[0] * w[lag].offset_px[0])) / (expected * expected);
            let memory = (-STEP_S * lag as f64 / 0.1).exp();
            assert!((product - memory).abs() < 0.03, "lag {lag}: {product}, expected {memory}");
        }
        let across = mean(found.iter().map(|d| d.offset_px[0] * d.offset_px[1])) / (expected * expected);
        assert!(across.abs() < 0.03, "{across}");
    }

    #[test]
    fn the_white_error_has_its_variance_is_independent_and_grows_where_hidden() {
        let settings = KeypointSettings { white_percent: 0.5, occluded_error: 1.5, ..exact() };
        let (seen, hidden) = (drawn(settings, SEEN), drawn(settings, HIDDEN));
        let expected = 2.0 * 0.087 / (1.138 / 17.0);
        assert!((deviation(&seen) - expected).abs() < 0.01 * expected, "{}", deviation(&seen));
        assert!((deviation(&hidden) - 2.5 * expected).abs() < 0.025 * expected);
        let product = mean(seen.windows(2).map(|w| w[0].offset_px[0] * w[1].offset_px[0])) / (expected * expected);
        assert!(product.abs() < 0.015, "{product}");
    }

    #[test]
    fn gross_errors_have_the_tail_of_student_t() {
        let settings = KeypointSettings { gross: 0.4, stretch_s: 0.0, gross_percent: 5.0, ..exact() };
        let found = drawn(settings, SEEN);
        let gross: Vec<&PointError> = found.iter().filter(|d| d.is_gross).collect();
        assert!((gross.len() as f64 / DRAWS as f64 - 0.4).abs() < 0.007);
        assert!(found.iter().all(|d| d.is_gross != (d.offset_px == [0.0; 2])));
        // exceeded by |t| with 3 degrees of freedom: tables give 2.353, 3.182 and 5.841 for 10, 5 and 1 %
        for (bound, share) in [(2.353, 0.10), (3.182, 0.05), (5.841, 0.01)] {
            let beyond = gross.iter().filter(|d| (d.offset_px[0] / 20.0).abs() > bound).count() as f64;
            let found = beyond / gross.len() as f64;
            assert!((found - share).abs() < 6.0 * (share / gross.len() as f64).sqrt(), "{bound}: {found}");
        }
    }

    #[test]
    fn misses_have_their_share_and_more_where_hidden() {
        let settings = KeypointSettings { missing: 0.05, occluded_rate: 3.0, ..exact() };
        let share = |of| mean(drawn(settings, of).iter().map(|d| f64::from(u8::from(d.is_missed))));
        let (seen, hidden) = (share(SEEN), share(HIDDEN));
        assert!((seen - 0.05).abs() < 0.008 && (hidden - 0.2).abs() < 0.02, "{seen} {hidden}");
        let always = KeypointSettings { missing: 0.05, occluded_rate: 1000.0, ..exact() };
        assert!(drawn(always, HIDDEN).iter().all(|d| d.is_missed));
    }

    #[test]
    fn the_mean_confidence_of_points_is_their_similarity_at_any_noise() {
        for noise in [0.2, 0.5, 1.0] {
            for similar in [0.1, 0.5, 0.9] {
                let mut random = stream(9, Purpose::Keypoints, 0, 0, 0);
                let found: Vec<f64> = (0..DRAWS).map(|_| noisy(similar, noise, &mut random)).collect();
                assert!(found.iter().all(|c| (0.0..=1.0).contains(c)));
                let average = mean(found.iter().copied());
                let spread = mean(found.iter().map(|c| (c - average).powi(2))).sqrt();
                assert!((average - similar).abs() < 0.008, "{noise} {similar}: {average}");
                let expected = noise * (similar * (1.0 - similar)).sqrt();
                assert!((spread - expected).abs() < 0.02 * expected + 1e-3, "{noise} {similar}: {spread} {expected}");
            }
        }
    }

    #[test]
    fn confidence_falls_with_the_error_drawn_and_is_calibrated_over_all_errors() {
        let settings = KeypointSettings { slow_percent: 6.0, slow_s: 0.1, confidence_noise: 0.3, ..exact() };
        let found = drawn(settings, SEEN);
        let of = |d: &PointError| similarity(Keypoint::LeftKnee, d.offset_px, SEEN.height_px);
        for tenth in 2..10 {
            let least = 0.1 * f64::from(tenth);
            let own: Vec<&PointError> = found.iter().filter(|d| (least..least + 0.1).contains(&of(d))).collect();
            let (similar, told) = (mean(own.iter().map(|d| of(d))), mean(own.iter().map(|d| d.confidence)));
            assert!(own.len() > 500 && (similar - told).abs() < 0.03, "{least}: {similar} {told} of {}", own.len());
        }
        let exact = drawn(KeypointSettings { confidence_noise: 0.0, ..settings }, SEEN);
        assert!(exact.iter().all(|d| d.confidence == of(d)), "without noise it is the similarity");
    }
}
