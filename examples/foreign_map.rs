//! Analyses campaigns that were flown in foreign worlds, and holds their maps against the true air and against the best
//! linear estimate with the true covariances.
//!
//! ```text
//! cargo run --release --example foreign_campaign -- gusty 7 gusty-7
//! cargo run --release --example foreign_map -- gusty-7 [...]
//! ```
//!
//! With `--indicator=rotor-speed` (or `power`) before the folders the maps are of that indicator; with `--combine` the
//! errors of all three and of their combination follow each row; with `--scales` the scales that were found. A row for each
//! campaign, then means for each kind of air (the folder's name up to its last hyphen).

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "it prints its result")]

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use updraft::analysis::TruthSeries;
use updraft::analysis::budget::TruthCheck;
use updraft::analysis::combine::CombinedMap;
use updraft::analysis::result::{AirScales, PosteriorMap, PosteriorScale};
use updraft::analysis::statistics::result::TrueAir;
use updraft::flight::Indicator;
use updraft::workflow::analyze::{Analysing, Settings};
use updraft::workflow::find::{Work, find};
use updraft::workflow::host::Quiet;

fn main() {
    let mut kinds: BTreeMap<String, Vec<Row>> = BTreeMap::new();
    println!("{HEAD}");
    let (options, folders): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|word| word.starts_with("--"));
    let (mut settings, mut has_scales) = (Settings::default(), false);
    for option in &options {
        match option.as_str() {
            "--indicator=rotor-speed" => settings.options.indicator = Indicator::RotorSpeed,
            "--indicator=power" => settings.options.indicator = Indicator::Power,
            "--combine" => settings.combine = true,
            "--scales" => has_scales = true,
            _ => eprintln!("{option} is not known"),
        }
    }
    for folder in &folders {
        let folder = Path::new(folder);
        match row(folder, &settings) {
            Ok((row, combined, scales)) => {
                let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
                println!("{name:18} {}", row.words());
                let scales = scales.filter(|_| has_scales);
                for line in combined.into_iter().chain(scales) {
                    println!("{line}");
                }
                let kind = name.rsplit_once('-').map_or(name.as_str(), |(kind, _)| kind);
                kinds.entry(kind.to_owned()).or_default().push(row);
            }
            Err(error) => eprintln!("{}: {error}", folder.display()),
        }
    }
    println!("\nroot mean squares and means\n{HEAD}");
    for (kind, rows) in kinds {
        println!("{kind:18} {}", Row::mean(&rows).words());
    }
}

const HEAD: &str = "                     zero  plain inside | found   bias  rest inside width means filled  rms |  limit holds   at it ratio | length time";

/// What one campaign gave.
#[derive(Clone, Copy, Default)]
struct Row {
    zero: f64,
    plain: f64,
    plain_inside: f64,
    rms: f64,
    bias: f64,
    rest: f64,
    inside: f64,
    width: f64,
    means_inside: f64,
    filled_rms: f64,
    filled_inside: f64,
    limit: f64,
    /// Whether the best estimate's mean is within 1.96 of its own errors.
    limit_holds: f64,
    at_limit: f64,
    length_inside: f64,
    time_inside: f64,
    has_scales: f64,
}

impl Row {
    fn words(&self) -> String {
        let Self { zero, plain, rms, bias, rest, limit, at_limit, .. } = self;
        let [plain_inside, inside, means, filled, limit_holds, length, time, scales] = [
            self.plain_inside,
            self.inside,
            self.means_inside,
            self.filled_inside,
            self.limit_holds,
            self.length_inside,
            self.time_inside,
            self.has_scales,
        ]
        .map(|share| 100.0 * share);
        format!(
            "{zero:6.3} {plain:6.3} {plain_inside:5.1} | {rms:6.3} {bias:6.3} {rest:5.3} {inside:5.1} {:5.2} {means:5.1} {filled:5.1} {:5.3} | {limit:6.3} {limit_holds:5.1}  \
             {at_limit:6.3} {:5.2} | {length:4.0} {time:4.0} of {scales:3.0}",
            self.width,
            self.filled_rms,
            at_limit / limit,
        )
    }

    /// Root mean squares over campaigns of errors, means of shares.
    fn mean(rows: &[Self]) -> Self {
        let n = rows.len() as f64;
        let square =
            |of: fn(&Self) -> f64| (rows.iter().map(|row| of(row).powi(2)).sum::<f64>() / n).sqrt();
        let mean = |of: fn(&Self) -> f64| rows.iter().map(of).sum::<f64>() / n;
        let scales = rows.iter().map(|row| row.has_scales).sum::<f64>().max(1.0) / n;
        Self {
            zero: square(|row| row.zero),
            plain: square(|row| row.plain),
            plain_inside: mean(|row| row.plain_inside),
            rms: square(|row| row.rms),
            bias: square(|row| row.bias),
            rest: square(|row| row.rest),
            inside: mean(|row| row.inside),
            width: square(|row| row.width * row.rms) / square(|row| row.rms),
            means_inside: mean(|row| row.means_inside),
            filled_rms: square(|row| row.filled_rms),
            filled_inside: mean(|row| row.filled_inside),
            limit: square(|row| row.limit),
            limit_holds: mean(|row| row.limit_holds),
            at_limit: square(|row| row.at_limit),
            length_inside: mean(|row| row.length_inside) / scales,
            time_inside: mean(|row| row.time_inside) / scales,
            has_scales: mean(|row| row.has_scales),
        }
    }
}

/// Numbers of a campaign, its errors by each indicator, and the scales that were found.
type Seen = (Row, Option<String>, Option<String>);

fn row(folder: &Path, settings: &Settings) -> Result<Seen, Box<dyn Error>> {
    let host = Quiet::default();
    let mut work = Work::new(folder);
    find(folder, None, &mut work)?;
    let known: Option<TrueAir> = std::fs::read(folder.join("truth-air.json"))
        .ok()
        .map(|bytes| serde_json::from_slice(&bytes))
        .transpose()?;
    let hover = work.flights.last_mut().ok_or("no flight")?;
    hover.truth = truth(&std::fs::read_to_string(folder.join("truth.csv"))?)?;
    hover.true_air.clone_from(&known);
    let analysed = Analysing::begin(&host, &work, settings, None)?.run(false)?;
    let map =
        analysed.analysis.flights.last().and_then(|flight| flight.map.as_ref()).ok_or("no map")?;
    let plain = map.truth.unwrap_or_default();
    let posterior: &PosteriorMap = map.posterior.as_ref().ok_or("no posterior")?;
    let truth: TruthCheck = posterior.truth.ok_or("no truth")?;
    let sds: Vec<f64> = map
        .drones
        .iter()
        .flat_map(|drone| drone.posterior_sd_mps.iter().flatten().copied())
        .collect();
    let width =
        (sds.iter().map(|sd| sd * sd).sum::<f64>() / sds.len() as f64).sqrt() / truth.rms_mps;
    let mut filled: Vec<(f64, bool)> = Vec::new();
    for place in &posterior.filled {
        let Some(series) = work.flights.last().and_then(|flight| flight.truth.get(&place.slot))
        else {
            continue;
        };
        let values = place.posterior_mps.iter().zip(&place.posterior_sd_mps);
        for (time_s, (value, sd)) in map.time_s.iter().zip(values) {
            let Some(((value, sd), truth)) = value.zip(*sd).zip(series.at_second(*time_s as i64))
            else {
                continue;
            };
            filled.push((value - truth, (value - truth).abs() < 1.96 * sd));
        }
    }
    let scales = posterior.scales.as_ref();
    let field = known.and_then(|air| air.field);
    let holds = |interval: Option<[f64; 2]>, value: Option<f64>| {
        let held =
            interval.zip(value).is_some_and(|([low, high], value)| (low..=high).contains(&value));
        f64::from(u8::from(held))
    };
    let combined = map.combined.as_ref().map(combined_words);
    let row = Row {
        zero: truth.zero_rms_mps,
        plain: plain.rms_mps,
        plain_inside: plain.inside_share.unwrap_or(f64::NAN),
        rms: truth.rms_mps,
        bias: truth.bias_mps,
        rest: truth.rms_without_bias_mps,
        inside: truth.inside_share.unwrap_or(f64::NAN),
        width,
        means_inside: truth.means_inside_share.unwrap_or(f64::NAN),
        filled_rms: (filled.iter().map(|(error, _)| error * error).sum::<f64>()
            / filled.len() as f64)
            .sqrt(),
        filled_inside: filled.iter().filter(|(_, inside)| *inside).count() as f64
            / filled.len() as f64,
        limit: truth.limit_rms_mps.unwrap_or(f64::NAN),
        limit_holds: truth
            .limit_rms_mps
            .zip(truth.limit_se_mps)
            .map_or(f64::NAN, |(rms, se)| f64::from(u8::from(rms <= 1.96 * se))),
        at_limit: truth.at_limit_rms_mps.unwrap_or(f64::NAN),
        length_inside: holds(
            scales.map(|scales| scales.length_m.interval),
            field.map(|field| (field.lambda_m * field.lambda_y_m).sqrt()),
        ),
        time_inside: holds(
            scales.map(|scales| scales.time_s.interval),
            field.map(|field| field.tau_s),
        ),
        has_scales: f64::from(u8::from(scales.is_some())),
    };
    Ok((row, combined, scales.map(scales_words)))
}

fn scales_words(scales: &AirScales) -> String {
    let words = |scale: &PosteriorScale| {
        let [low, high] = scale.interval;
        format!("{:.0} ({low:.0} to {high:.0})", scale.value)
    };
    format!(
        "    {} sd {:.2} m/s, length {} m, time {} s, drift {:.1?} m/s, gusts {:.3} m/s {:.0} s, slow {:.3} m/s",
        scales.form,
        scales.sd_mps,
        words(&scales.length_m),
        words(&scales.time_s),
        scales.drift_mps,
        scales.gust_mps,
        scales.gust_s,
        scales.slow_mps,
    )
}

/// Errors of each second alone: by each indicator, and by all together.
fn combined_words(combined: &CombinedMap) -> String {
    let each: Vec<String> = combined
        .indicators
        .iter()
        .map(|one| {
            let rms_mps = one.rms_mps.unwrap_or(f64::NAN);
            format!("{rms_mps:.3} ({:.2}, {:.3})", one.weight, one.own_mps)
        })
        .collect();
    let (rms_mps, rest_mps) = combined
        .truth
        .map_or((f64::NAN, f64::NAN), |truth| (truth.rms_mps, truth.rms_without_bias_mps));
    format!("    combined {rms_mps:.3} (rest {rest_mps:.3}) of {}", each.join(", "))
}

/// The table beside a foreign campaign.
fn truth(text: &str) -> Result<BTreeMap<u16, TruthSeries>, Box<dyn Error>> {
    let mut found: BTreeMap<u16, TruthSeries> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let mut cells = line.split(',');
        let mut cell = || cells.next().ok_or("a line is short");
        let (slot, time_s, value) =
            (cell()?.parse::<u16>()?, cell()?.parse::<f64>()? as i64, cell()?.parse::<f64>()?);
        let series = found
            .entry(slot)
            .or_insert_with(|| TruthSeries { first_s: time_s, updraft_mps: Vec::new() });
        series.updraft_mps.push(value);
    }
    Ok(found)
}
