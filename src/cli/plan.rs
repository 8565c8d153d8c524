//! `updraft plan`: a mission template becomes a campaign folder, if it is safe.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::check::{Origin, allowed, checked, few, is_safe, known, say_findings, verdict};
use super::clock::Stopwatch;
use super::context::Context;
use super::exit::{CommandError, Exit};
use super::mission_args::MissionArgs;
use super::{timetable, words};
use crate::base::file::read_whole;
use crate::base::plain::Shown as _;
use crate::campaign::write::{FlightFiles, folders, write_index};
use crate::campaign::{self, CampaignError, FlightFolder};
use crate::check::CheckReport;
use crate::mission::Plan;
use crate::mission::resolve::Mission;
use crate::show::Show;

/// Arguments of `updraft plan`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft plan templates/calibration.toml --grid 7x7 --spacing 7 --origin 47.4733,19.0621 -o my-campaign
  updraft plan hover --drones 12 --set height_m=60 -o hover-60
  updraft plan calibration-counterphase --dry-run

Templates are files or built-in names: calibration, calibration-counterphase, hover, campaign.
The grammar is in docs/templates.md.")]
pub(super) struct PlanArgs {
    /// Template: a file or a built-in name
    template: String,
    /// Campaign folder [default: the template's name]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Replace another plan in the folder
    ///
    /// Overwrites template.toml, vehicle.toml, plan.json, show.skyc, show.csv.zip and skyb/NN.skyb
    /// (in a campaign also campaign.toml and campaign.json), and deletes skyb/NN.skyb of slots that
    /// the new plan does not have. Everything else stays as it is. A folder with logs of another plan
    /// is refused: logs are never deleted or overwritten.
    #[arg(long)]
    force: bool,
    /// Plan and check, write nothing
    #[arg(long)]
    dry_run: bool,
    /// List every finding, not only the first few of each kind (--json always does)
    #[arg(short, long)]
    verbose: bool,
    /// Write the show although this check fails (by its name; may be repeated)
    #[arg(long, value_name = "CHECK")]
    allow: Vec<String>,
    #[command(flatten)]
    mission: MissionArgs,
}

/// What `--json` prints.
#[derive(Serialize)]
struct PlanOutput<'a> {
    schema: &'static str,
    folder: Option<&'a Path>,
    flights: Vec<FlightOutput<'a>>,
}

#[derive(Serialize)]
struct FlightOutput<'a> {
    plan: &'a Plan,
    check: &'a CheckReport,
}

pub(super) fn run(context: &Context, args: &PlanArgs) -> Result<Exit, CommandError> {
    let watch = Stopwatch::start();
    known(&args.allow)?;
    let few = few(context, args.verbose);
    let mission = args.mission.resolve(&args.template)?;
    let folder = args.output.clone().unwrap_or_else(|| PathBuf::from(&mission.name));
    let mut reports = Vec::new();
    let mut safe = true;
    // Who reads only the beginning of the timetable gets the whole campaign.
    let mut read = Ok(());
    for flight in &mission.flights {
        let show = flight.plan.to_show();
        let report = checked(&show, &flight.plan, &flight.vehicle, &Origin::Plan, few);
        if !context.json && read.is_ok() {
            let is_example = args.mission.is_example(&flight.plan.site)?;
            let told = timetable::describe(&flight.plan, context.width, is_example);
            read = context.print(&format!("{}\n", words::wrap(&told, context.width)));
            if !matches!(read, Ok(()) | Err(CommandError::BrokenPipe)) {
                return read.map(|()| Exit::Done);
            }
        }
        say_findings(context, &report, &args.allow);
        safe &= is_safe(&report, &args.allow);
        reports.push((show, report));
    }
    let written = safe && !args.dry_run;
    if written {
        let _lock = context.lock(&folder)?;
        write(context, &mission, &reports, &folder, args.force)?;
    }
    read?;
    if context.json {
        context.print_json(&PlanOutput {
            schema: "updraft.plan-output/1",
            folder: written.then_some(folder.as_path()),
            flights: mission
                .flights
                .iter()
                .zip(&reports)
                .map(|(flight, (_, check))| FlightOutput { plan: &flight.plan, check })
                .collect(),
        })?;
    }
    if !safe {
        context.insist("Nothing was written: the show is not safe as it is");
        return Ok(Exit::Unsafe);
    }
    let allowed = allowed(reports.iter().map(|(_, report)| report), &args.allow);
    if !allowed.is_empty() {
        context.insist(&format!("{}: written as asked for", verdict(true, &allowed)));
    }
    if args.dry_run {
        context.say(&format!("Would write {}", folder.shown()));
    } else {
        context.result(&folder)?;
        context.say(&format!(
            "Planned {} in {watch} -> {}",
            what_for_whom(&mission),
            folder.shown()
        ));
    }
    Ok(Exit::Done)
}

/// `calibration and hover for 49 drones`.
pub(super) fn what_for_whom(mission: &Mission) -> String {
    let names: Vec<_> = mission.flights.iter().map(|flight| flight.plan.name.as_str()).collect();
    let drones = mission.flights.first().map_or(0, |flight| flight.plan.slots.len());
    format!("{} for {}", words::list(&names), words::count(drones, "drone"))
}

/// Writes the campaign folder, unless something else is there.
pub(super) fn write(
    context: &Context,
    mission: &Mission,
    shows: &[(Show, CheckReport)],
    root: &Path,
    force: bool,
) -> Result<(), CommandError> {
    let folders = folders(root, mission);
    let mut files = Vec::with_capacity(folders.len());
    for ((flight, folder), (show, _)) in mission.flights.iter().zip(&folders).zip(shows) {
        context.check_stop()?;
        let made = FlightFiles::of(flight, show)?;
        refuse_occupied(root, folder, made.plan(), force)?;
        files.push(made);
    }
    for (files, folder) in files.iter().zip(&folders) {
        context.check_stop()?;
        files.write(folder)?;
    }
    Ok(write_index(root, mission)?)
}

/// The same plan may be written again; another one only with `--force`, and never over logs.
fn refuse_occupied(
    root: &Path,
    folder: &FlightFolder,
    plan: &[u8],
    force: bool,
) -> Result<(), CommandError> {
    let occupied = |what: &str| {
        Err(CampaignError::Occupied { path: folder.0.clone(), what: what.to_owned() }.into())
    };
    if folder.0.as_path() != root && FlightFolder(root.to_owned()).plan().exists() {
        return occupied("a plan of one flight");
    }
    if folder.0.as_path() == root && campaign::index_path(root).exists() {
        return occupied("a campaign of several flights");
    }
    // One more is another plan already.
    let existing = match read_whole(&folder.plan(), plan.len() as u64) {
        Ok(existing) => Some(existing),
        Err(error) => match error.source.kind() {
            std::io::ErrorKind::NotFound => return Ok(()),
            std::io::ErrorKind::FileTooLarge => None,
            _ => return Err(error.into()),
        },
    };
    if existing.is_some_and(|existing| existing == plan) {
        return Ok(());
    }
    if folder.simulated().is_dir() || folder.logs().is_dir() {
        return Err(CommandError::Usage(format!(
            "{} holds the logs of another plan, which are never overwritten; choose another folder, \
             or move its folders logs and simulated away and give --force",
            folder.0.shown()
        )));
    }
    if force { Ok(()) } else { occupied("another plan") }
}
