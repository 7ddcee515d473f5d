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
        print_error(&format!(
            "skiagraph {}: internal error{place}: {message}\n\
             This is a bug: please report it with the command and the scenario that caused it.",
            env!("CARGO_PKG_VERSION"),
        ));
    }));
    match cli::run_command() {
        Ok(code) => code,
        Err(error) => {
            cli::print_failure(&error);
            print_error(&format!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}

/// Prints to standard error; a failure to write could not be reported anywhere.
fn print_error(message: &str) {
    writeln!(std::io::stderr(), "{message}").ok();
}
