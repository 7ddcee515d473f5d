//! Processor time of the calling thread: unlike the clock's it does not depend on what else the machine does.

/// Seconds that the calling thread has kept a processor busy.
#[cfg(unix)]
pub(super) fn of_this_thread() -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Seconds since the first call: elsewhere the clock has to do.
#[cfg(not(unix))]
pub(super) fn of_this_thread() -> f64 {
    static FIRST: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    FIRST.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
}

#[cfg(test)]
mod tests {
    #[test]
    fn work_costs_processor_time_and_sleep_does_not() {
        let begin = super::of_this_thread();
        std::thread::sleep(std::time::Duration::from_millis(120));
        let slept = super::of_this_thread();
        let mut sum = 0_u64;
        while super::of_this_thread() < slept + 0.02 {
            (0..1000).for_each(|n| sum = std::hint::black_box(sum.wrapping_mul(31).wrapping_add(n)));
        }
        if cfg!(unix) {
            assert!(slept - begin < 0.06, "{}", slept - begin);
        }
    }
}
