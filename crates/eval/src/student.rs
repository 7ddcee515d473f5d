//! Student's t interval of a mean over clips of each clip's mean over seeds; `clips[c]` holds the values of clip `c`'s
//! runs.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::statistics::{mean, variance};

/// Limit of the variance of the logarithms of errors (a standard deviation of 1 is a factor of e between runs): without
/// it, one run with an error near zero would widen an interval of three runs over many powers of ten.
const GREATEST_LOG_VARIANCE: f64 = 1.0;

/// `m +- t se`.
pub(super) fn student(clips: &[Vec<f64>]) -> Option<[f64; 2]> {
    let centre = mean_of_means(clips)?;
    let half = half_width(clips, |runs| Some(variance(runs)? / runs.len() as f64))?;
    Some([centre - half, centre + half])
}

/// `m exp(+- t se / m)`. For one clip, `(se / m)^2` is the greater of `s^2 / (n m^2)`, as in Student's interval, and `v
/// / n + v^2 / (2 (n - 1))` (`[Olsson 2005]`), where `v` is the variance of the logarithms: the first is greater if a
/// few runs are far off, the second if all are skewed. For several clips, the `se^2` of the clips' means are added.
pub(super) fn student_on_logs(clips: &[Vec<f64>]) -> Option<[f64; 2]> {
    let centre = mean_of_means(clips)?;
    let half = half_width(clips, |runs| {
        let n = runs.len() as f64;
        let logs: Vec<f64> = runs.iter().map(|value| libm::log(*value)).collect();
        let v = variance(&logs)?.min(GREATEST_LOG_VARIANCE);
        let scale = mean(runs)?;
        let of_logs = scale * scale * (v / n + v * v / (2.0 * (n - 1.0)));
        Some(of_logs.max(variance(runs)? / n))
    })?;
    let factor = libm::exp(half / centre);
    Some([centre / factor, centre * factor])
}

/// `t sqrt(sum of e) / C`, where `e` is the squared standard error of the mean of each of the C clips.
fn half_width(clips: &[Vec<f64>], squared_error: impl Fn(&[f64]) -> Option<f64>) -> Option<f64> {
    let errors: Vec<f64> = clips.iter().map(|runs| squared_error(runs)).collect::<Option<_>>()?;
    let sum: f64 = errors.iter().sum();
    let t = student_quantile(freedom(&errors, clips))?;
    Some(t * sum.sqrt() / clips.len() as f64)
}

/// Degrees of freedom of a sum of squared standard errors (`[Welch 1938]`, `[Satterthwaite 1946]`).
fn freedom(squared_errors: &[f64], clips: &[Vec<f64>]) -> f64 {
    let sum: f64 = squared_errors.iter().sum();
    let parts = squared_errors.iter().zip(clips).map(|(e, runs)| (e / sum) * (e / sum) / (runs.len() - 1) as f64);
    1.0 / parts.sum::<f64>()
}

pub(super) fn freedom_of_mean(clips: &[Vec<f64>]) -> Option<f64> {
    let errors: Vec<f64> = clips.iter().map(|runs| Some(variance(runs)? / runs.len() as f64)).collect::<Option<_>>()?;
    Some(freedom(&errors, clips))
}

/// The 97.5 % quantile of Student's t.
pub(super) fn student_quantile(freedom: f64) -> Option<f64> {
    Some(StudentsT::new(0.0, 1.0, freedom).ok()?.inverse_cdf(0.975))
}

/// Mean over clips of each clip's mean; `None` without a value.
pub(super) fn mean_of_means(clips: &[Vec<f64>]) -> Option<f64> {
    mean(&clips.iter().filter_map(|runs| mean(runs)).collect::<Vec<_>>())
}
