//! The `skiagraph` command.

use std::io::Write;
use std::process::ExitCode;

use skiagraph::cli;

fn main() -> ExitCode {
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map(|l| format!(" at {}:{}", l.file(), l.line())).unwrap_or_default();
        let payload = panic.payload();
        let message = payload.downcast_ref::<String>().map(String::as_str).or(payload.downcast_ref::<&str>().copied());
        let message = message.unwrap_or("no message");
        say(&format!(
            "skiagraph {}: a bug of ours{place}: {message}\n\
             Please report it, with the command and the scenario that led here.",
            env!("CARGO_PKG_VERSION"),
        ));
    }));
    match cli::run_command() {
        Ok(code) => code,
        Err(error) => {
            say(&format!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}

/// Tells the user; if nobody listens, there is nothing else to do.
fn say(message: &str) {
    writeln!(std::io::stderr(), "{message}").ok();
}
