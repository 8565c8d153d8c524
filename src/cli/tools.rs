//! Completions and schemas, made from the definitions they describe.

use clap::{Args, ValueEnum};
use clap_complete::Shell;
use schemars::{JsonSchema, Schema, schema_for};
use serde::Serialize;

use super::DoneOutput;
use super::analyze::AnalyzeOutput;
use super::analyze_each::EachOutput;
use super::check::CheckOutput;
use super::cluster::output::{CancelOutput, ScriptOutput, SubmitOutput};
use super::context::Context;
use super::effects::EffectsOutput;
use super::exit::{CommandError, ErrorOutput, Exit};
use super::fleet::dry::DryOutput;
use super::fleet::tables::{EndOutput, FleetStatus, FleetUpload};
use super::gap::GapOutput;
use super::inspect::InspectDocument;
use super::logs::{ImportOutput, ListOutput, PullOutput, VerifyOutput};
use super::manual::ManOutput;
use super::physics::PhysicsOutput;
use super::plan::PlanOutput;
use super::sensitivity::SensitivityOutput;
use super::shard_args::ShardOutput;
use super::simulate::SimulateOutput;
use super::sweep::SweepOutput;
use crate::analysis::result::Analysis;
use crate::archive::index::ArchiveIndex;
use crate::blind::game::GameFile;
use crate::blind::record::BlindRecord;
use crate::blind::seal::Sealed;
use crate::blind::series::FlightResult;
use crate::blind::table::Table;
use crate::blind::told::HiddenRun;
use crate::campaign::items::ItemsRecord;
use crate::campaign::start::StartRecord;
use crate::campaign::{CampaignIndex, FlightRecord};
use crate::compare::result::Comparison;
use crate::fleet::changes::Changes;
use crate::fleet::logs::manifest::Manifest;
use crate::fleet::slots::FleetTable;
use crate::gap::Verdict;
use crate::gap::next::Next;
use crate::mast::MastComparison;
use crate::mission::Plan;
use crate::study::CellRecord;
use crate::study::result::StudyResult;
use crate::study::sensitivity::{ItemRecord, SensitivityResult};
use crate::vehicle::Vehicle;
use crate::workflow::analyze::each::AnalysisRecord;
use crate::workflow::archive::output::ArchiveOutput;
use crate::workflow::cluster::{ClusterRecord, Status};
use crate::workflow::fleet::output::FlyOutput;
use crate::workflow::fleet::preflight::PreflightOutput;
use crate::workflow::game::verify::Verification;

/// Arguments of `updraft completions`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft completions bash > ~/.local/share/bash-completion/completions/updraft
  updraft completions fish")]
pub(super) struct CompletionsArgs {
    /// Which shell
    shell: Shell,
}

/// What `updraft completions --json` prints.
#[derive(Serialize, JsonSchema)]
struct CompletionsOutput<'a> {
    /// Format name and version: `updraft.completions/1`.
    schema: &'static str,
    /// Name of the shell.
    shell: String,
    /// The script.
    script: &'a str,
}

/// Arguments of `updraft schema`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft schema plan
  updraft schema check                            (what `updraft check --json` prints)")]
pub(super) struct SchemaArgs {
    /// Which format
    #[arg(value_enum)]
    format: Format,
}

/// The JSON (and vehicle TOML) formats that have a schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// plan.json
    Plan,
    /// campaign.json
    Campaign,
    /// simulated/flight.json
    Flight,
    /// analysis.json
    Analysis,
    /// compare.json, and what `updraft compare --json` prints
    Compare,
    /// mast.json, and what `updraft compare --mast --json` prints
    Mast,
    /// study.json
    Study,
    /// a finished flight of a study
    Cell,
    /// sensitivity.json of a sensitivity study
    Sensitivity,
    /// a finished campaign of a sensitivity study
    SensitivityItem,
    /// vehicle files
    Vehicle,
    /// logs/manifest.json
    Logs,
    /// logs/start.json
    Start,
    /// fleet.json
    Fleet,
    /// fleet-changes.json
    Changes,
    /// what `updraft fleet preflight --json` prints
    Preflight,
    /// what `updraft fly --json` prints
    Fly,
    /// gap/verdict.json
    Verdict,
    /// table.json of `updraft blind`
    Blind,
    /// a finished flight of `updraft blind`
    BlindFlight,
    /// sealed/truth.json of a blind flight
    BlindTruth,
    /// game.json of `updraft blind hide`
    BlindGame,
    /// reveal.json of `updraft blind reveal`
    BlindRecord,
    /// what `updraft blind verify --json` prints
    BlindVerify,
    /// gap/next.json
    Next,
    /// hidden.json of `updraft run --hide`
    Hidden,
    /// items.json of a folder whose items can be shared out
    Items,
    /// analysis-record.json of `updraft analyze --each`
    AnalysisRecord,
    /// cluster/job.json of `updraft cluster submit`
    Cluster,
    /// what `updraft cluster script --json` prints
    ClusterScript,
    /// what `updraft cluster submit --json` prints
    ClusterSubmit,
    /// what `updraft cluster status --json` prints
    ClusterStatus,
    /// what `updraft cluster cancel --json` prints
    ClusterCancel,
    /// what a command with --shard and --json prints
    Shard,
    /// what `updraft analyze --each --json` prints
    AnalyzeEach,
    /// what `updraft archive --json` prints
    Archive,
    /// archive.json of an archive
    ArchiveIndex,
    /// what `updraft plan --json` prints
    PlanOutput,
    /// what `updraft check --json` prints
    Check,
    /// what `updraft simulate --json` prints
    Simulate,
    /// what `updraft analyze --json` and `updraft run --json` print
    Analyze,
    /// what `updraft inspect --json` prints
    Inspect,
    /// what `updraft effects --json` prints
    Effects,
    /// what `updraft gap --json` prints
    Gap,
    /// what `updraft sweep --json` prints
    Sweep,
    /// what `updraft sweep --json` prints of a sensitivity study
    SweepSensitivity,
    /// what `updraft physics --json` prints
    Physics,
    /// what `updraft fleet status --json` prints
    FleetStatus,
    /// what `updraft fleet upload --json` prints
    Upload,
    /// what `updraft fleet abort --json` and `fleet land --json` print
    Abort,
    /// what `--dry-run --json` prints of a command that sends something to drones
    DryRun,
    /// what `updraft logs list --json` prints
    LogList,
    /// what `updraft logs pull --json` prints
    Pull,
    /// what `updraft logs verify --json` prints
    Verify,
    /// what `updraft logs import --json` prints
    Import,
    /// what `updraft man --json` prints
    Man,
    /// what `updraft completions --json` prints
    Completions,
    /// what other commands print with --json when they have done their work
    Done,
    /// the last line on standard error of a command with --json that has failed
    Error,
}

impl Format {
    /// The JSON schema, pretty, with a final newline.
    pub fn schema(self) -> Result<String, serde_json::Error> {
        let mut text = serde_json::to_string_pretty(&self.made())?;
        text.push('\n');
        Ok(text)
    }

    fn made(self) -> Schema {
        match self {
            Self::Plan => schema_for!(Plan),
            Self::Campaign => schema_for!(CampaignIndex),
            Self::Flight => schema_for!(FlightRecord),
            Self::Start => schema_for!(StartRecord),
            Self::Analysis => schema_for!(Analysis),
            Self::Compare => schema_for!(Comparison),
            Self::Mast => schema_for!(MastComparison),
            Self::Study => schema_for!(StudyResult),
            Self::Cell => schema_for!(CellRecord),
            Self::Sensitivity => schema_for!(SensitivityResult),
            Self::SensitivityItem => schema_for!(ItemRecord),
            Self::Vehicle => schema_for!(Vehicle),
            Self::Logs => schema_for!(Manifest),
            Self::Fleet => schema_for!(FleetTable),
            Self::Changes => schema_for!(Changes),
            Self::Preflight => schema_for!(PreflightOutput),
            Self::Fly => schema_for!(FlyOutput),
            Self::Verdict => schema_for!(Verdict),
            Self::Blind => schema_for!(Table),
            Self::BlindFlight => schema_for!(FlightResult),
            Self::BlindTruth => schema_for!(Sealed),
            Self::BlindGame => schema_for!(GameFile),
            Self::BlindRecord => schema_for!(BlindRecord),
            Self::BlindVerify => schema_for!(Verification),
            Self::Next => schema_for!(Next),
            Self::Hidden => schema_for!(HiddenRun),
            Self::Items => schema_for!(ItemsRecord),
            Self::AnalysisRecord => schema_for!(AnalysisRecord),
            Self::Cluster => schema_for!(ClusterRecord),
            Self::ClusterScript => schema_for!(ScriptOutput),
            Self::ClusterSubmit => schema_for!(SubmitOutput),
            Self::ClusterStatus => schema_for!(Status),
            Self::ClusterCancel => schema_for!(CancelOutput),
            Self::Shard => schema_for!(ShardOutput<'_>),
            Self::AnalyzeEach => schema_for!(EachOutput),
            Self::Archive => schema_for!(ArchiveOutput),
            Self::ArchiveIndex => schema_for!(ArchiveIndex),
            Self::PlanOutput => schema_for!(PlanOutput<'_>),
            Self::Check => schema_for!(CheckOutput<'_>),
            Self::Simulate => schema_for!(SimulateOutput),
            Self::Analyze => schema_for!(AnalyzeOutput<'_>),
            Self::Inspect => schema_for!(InspectDocument<'_>),
            Self::Effects => schema_for!(EffectsOutput),
            Self::Gap => schema_for!(GapOutput<'_>),
            Self::Sweep => schema_for!(SweepOutput<'_>),
            Self::SweepSensitivity => schema_for!(SensitivityOutput<'_>),
            Self::Physics => schema_for!(PhysicsOutput),
            Self::FleetStatus => schema_for!(FleetStatus<'_>),
            Self::Upload => schema_for!(FleetUpload),
            Self::Abort => schema_for!(EndOutput),
            Self::DryRun => schema_for!(DryOutput),
            Self::LogList => schema_for!(ListOutput),
            Self::Pull => schema_for!(PullOutput),
            Self::Verify => schema_for!(VerifyOutput),
            Self::Import => schema_for!(ImportOutput),
            Self::Man => schema_for!(ManOutput),
            Self::Completions => schema_for!(CompletionsOutput<'_>),
            Self::Done => schema_for!(DoneOutput<'_>),
            Self::Error => schema_for!(ErrorOutput<'_>),
        }
    }
}

pub(super) fn completions(
    context: &Context,
    args: &CompletionsArgs,
    mut command: clap::Command,
) -> Result<Exit, CommandError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "updraft", &mut script);
    let script = String::from_utf8_lossy(&script);
    if context.json {
        let shell = args.shell.to_string();
        let schema = "updraft.completions/1";
        context.print_json(&CompletionsOutput { schema, shell, script: &script })?;
    } else {
        context.emit(&script)?;
    }
    Ok(Exit::Done)
}

pub(super) fn schema(context: &Context, args: &SchemaArgs) -> Result<Exit, CommandError> {
    if context.json {
        // It is an object, and is printed as every other one.
        context.print_json(&args.format.made())?;
    } else {
        let schema = args.format.schema();
        let failed = |error| CommandError::Failed(format!("failed to make the schema: {error}"));
        context.emit(&schema.map_err(failed)?)?;
    }
    Ok(Exit::Done)
}
