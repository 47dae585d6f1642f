//! Entry point of the command-line program.

#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
