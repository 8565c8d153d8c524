//! The `updraft` command: see [`updraft::cli`].

fn main() -> std::process::ExitCode {
    updraft::cli::main()
}
