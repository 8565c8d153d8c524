//! Options that do nothing through a server are refused: who gives one believes in it.

use crate::cli::exit::CommandError;
use crate::cli::fleet::connect::ConnectArgs;
use crate::cli::simulate::AirArgs;

/// Refuses the first of these options that was given, with what there is instead; and the options
/// of links that are always of no use.
pub(in crate::cli) fn refuse(
    connect: &ConnectArgs,
    options: &[(&str, bool, &str)],
) -> Result<(), CommandError> {
    let key = (
        "--key",
        connect.key.is_some(),
        "the drones' messages are signed by the server, with the key in its own configuration",
    );
    match [&key].into_iter().chain(options).find(|(_, is_given, _)| *is_given) {
        None => Ok(()),
        Some((option, _, instead)) => Err(CommandError::Usage(format!(
            "{option} has no effect through Skybrush Server: {instead}; nothing was sent"
        ))),
    }
}

/// The option for virtual drones that was given, if any.
pub(in crate::cli) fn of_air(air: &AirArgs, updraft_mps: f64) -> Option<&'static str> {
    let AirArgs { wind, wind_from, specs, truth, seed, full_logs, effects } = air;
    let given = [
        ("--updraft", updraft_mps != 0.0),
        ("--wind", *wind != 0.0),
        ("--wind-from", (*wind_from - 270.0).abs() > 0.0),
        ("--air", !specs.is_empty()),
        ("--truth", *truth),
        ("--seed", *seed != 1),
        ("--full-logs", *full_logs),
        ("--effect", !effects.is_empty()),
    ];
    given.into_iter().find(|(_, is_given)| *is_given).map(|(option, _)| option)
}
