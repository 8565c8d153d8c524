//! Scripts for a scheduler, and what is made of its answers; the scheduler is a stand-in here.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::process::Command;

use crate::cli::support::{Bench, Ended};
use crate::study::support::SMALL;

/// A folder with programs of a scheduler that say what they are told to, and take down what they were asked.
fn scheduler(bench: &Bench, programs: &[(&str, &str)]) {
    let folder = bench.path("bin");
    fs::create_dir_all(&folder).unwrap();
    for (name, body) in programs {
        let path = folder.join(name);
        let log = bench.path("asked.txt");
        let text = format!("#!/bin/bash\necho \"{name} $*\" >> '{}'\n{body}\n", log.display());
        fs::write(&path, text).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }
}

fn command(bench: &Bench, args: &[&str]) -> Command {
    let mut command = bench.command(args);
    let path = std::env::var("PATH").unwrap_or_default();
    command.env("PATH", format!("{}:{path}", bench.path("bin").display()));
    command
}

fn expect(bench: &Bench, code: i32, args: &[&str]) -> Ended {
    let ended = Ended::of(&command(bench, args).output().unwrap());
    assert_eq!(ended.code, Some(code), "updraft {}\n{ended}", args.join(" "));
    ended
}

fn asked(bench: &Bench) -> Vec<String> {
    let text = fs::read_to_string(bench.path("asked.txt")).unwrap_or_default();
    text.lines().map(str::to_owned).collect()
}

/// Without what differs from run to run: the folder and the program.
fn plain(bench: &Bench, text: &str) -> String {
    let program = env!("CARGO_BIN_EXE_updraft");
    let folder = fs::canonicalize(bench.path("")).unwrap();
    let folder = folder.to_string_lossy();
    let text =
        text.replace(program, "/bin/updraft").replace(folder.trim_end_matches('/'), "/home/me");
    text.replace(concat!("updraft ", env!("CARGO_PKG_VERSION")), "updraft VERSION")
}

#[test]
fn a_script_has_all_that_a_person_would_write() {
    let bench = Bench::new();
    scheduler(&bench, &[("scontrol", "echo 'MaxArraySize            = 51'")]);
    let blind =
        ["cluster", "script", "blind", "--seed", "20270101", "--flights", "300", "-o", "my blind"];
    let resources = [
        "--shards",
        "50",
        "--time",
        "1:00:00",
        "--mem",
        "2G",
        "--partition",
        "long",
        "--cpus",
        "2",
    ];
    let script = expect(&bench, 0, &[&blind[..], &resources, &["--sbatch=--qos=low"]].concat());
    insta::assert_snapshot!("blind_script", plain(&bench, &script.out));
    let more = expect(&bench, 2, &[&blind[..], &["--shards", "51"]].concat());
    assert!(more.err.contains("MaxArraySize: up to 50"), "{more}");
    let shard = expect(&bench, 2, &[&blind[..], &["--shards", "5", "--shard", "1/2"]].concat());
    assert!(shard.err.contains("--shard=1/2 is given by the script itself"), "{shard}");
    // What the command itself would refuse is refused now, not by a thousand tasks.
    let seed = ["cluster", "script", "blind", "--seed", "5", "--shards", "5"];
    assert!(expect(&bench, 2, &seed).err.contains("seed 5 is for tuning"));
    assert!(!bench.path("my blind").exists(), "a script is only printed");
}

#[test]
fn one_item_is_measured_and_counts() {
    let bench = Bench::new();
    scheduler(&bench, &[("scontrol", "exit 1")]);
    fs::write(bench.path("small.toml"), SMALL).unwrap();
    let script = expect(&bench, 0, &["cluster", "script", "sweep", "small.toml", "-o", "study"]);
    assert!(script.err.contains("8 missing, shared out to 1 task"), "{script}");
    assert!(
        script.out.contains("--array=\"${1:-1-1}\"") && script.out.contains("#SBATCH --time=0:0"),
        "{script}"
    );
    assert_eq!(fs::read_dir(bench.path("study/cells")).unwrap().count(), 1);
    expect(&bench, 0, &["sweep", "small.toml", "-o", "study", "-q"]);
    let none = expect(&bench, 0, &["cluster", "submit", "sweep", "small.toml", "-o", "study"]);
    assert!(
        none.err.contains("All results are there")
            && asked(&bench).iter().all(|line| !line.starts_with("sbatch"))
    );
}

#[test]
fn a_job_is_submitted_watched_and_cancelled() {
    let bench = Bench::new();
    let sbatch = "cat > /dev/null\ncase \"$*\" in *afterany*) echo '43;c';; *) echo '42;c';; esac";
    let squeue =
        "echo '42_1|R|0:12|n1'\necho '42_3|PD|0:00|(Resources)'\necho '43|PD|0:00|(Dependency)'";
    scheduler(
        &bench,
        &[("sbatch", sbatch), ("squeue", squeue), ("scancel", "exit 0"), ("scontrol", "exit 1")],
    );
    fs::write(bench.path("small.toml"), SMALL).unwrap();
    let sweep = ["cluster", "submit", "sweep", "small.toml", "-o", "study", "--shards", "3"];
    let submitted = expect(&bench, 0, &sweep);
    assert!(submitted.err.contains("Submitted array 42 (3 tasks) and merge 43"), "{submitted}");
    assert_eq!(
        asked(&bench)[1..],
        ["sbatch --parsable --array=1-3", "sbatch --parsable --dependency=afterany:42"]
    );
    // One task has made its results and ended, one runs, one waits.
    bench.expect(0, &["sweep", "small.toml", "-o", "study", "--shard", "2/3"]);
    let status = expect(&bench, 0, &["cluster", "status", "study"]);
    // How fast it goes is another matter each time.
    let is_time = |line: &&str| line.starts_with("  rate") || line.starts_with("  left");
    let lines: Vec<&str> = status.out.lines().filter(|line| !is_time(line)).collect();
    insta::assert_snapshot!("status", plain(&bench, &lines.join("\n")));
    let again = expect(&bench, 2, &sweep);
    assert!(again.err.contains("job 42 for these results is still in the queue"), "{again}");
    expect(&bench, 0, &["cluster", "status", "study/cluster", "--json"])
        .json("updraft.cluster-status/1");
    let squeues = asked(&bench).iter().filter(|line| line.starts_with("squeue")).count();
    assert_eq!(squeues, 1, "the scheduler is asked once in half a minute");
    expect(&bench, 0, &["cluster", "cancel", "study"]);
    assert_eq!(asked(&bench).last().unwrap(), "scancel 42 43");
    expect(&bench, 5, &["cluster", "status", "."]);
}

#[test]
fn shards_that_ended_without_their_results_are_told() {
    let bench = Bench::new();
    scheduler(
        &bench,
        &[
            ("sbatch", "cat > /dev/null; echo 42"),
            ("squeue", "echo 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1"),
        ],
    );
    fs::write(bench.path("small.toml"), SMALL).unwrap();
    expect(
        &bench,
        0,
        &["cluster", "submit", "sweep", "small.toml", "-o", "study", "--shards", "2"],
    );
    let status = expect(&bench, 3, &["cluster", "status", "study"]);
    insta::assert_snapshot!("status_ended", plain(&bench, &status.out));
}

#[test]
fn a_script_runs_whatever_its_folder_is_called() {
    let bench = Bench::new();
    let run_now =
        "sed -n '/^exec /p' > job.$$; (SLURM_ARRAY_TASK_ID=1; . ./job.$$) >> ran.txt 2>&1; echo 7";
    scheduler(&bench, &[("sbatch", run_now)]);
    fs::write(bench.path("it's $HOME `x` 100%.toml"), SMALL).unwrap();
    let folder = "out $(touch evil) `touch evil` 'a' 5%";
    let sweep =
        ["cluster", "submit", "sweep", "it's $HOME `x` 100%.toml", "-o", folder, "--shards", "1"];
    expect(&bench, 0, &sweep);
    assert!(
        bench.path(folder).join("study.json").exists(),
        "{:?}",
        fs::read_to_string(bench.path("ran.txt"))
    );
    assert!(!bench.path("evil").exists());
    let record = fs::read_to_string(bench.path(folder).join("cluster/job.json")).unwrap();
    assert!(record.contains("touch evil"), "{record}");
    let quoted = expect(&bench, 2, &["cluster", "script", "sweep", "-o", "a\"b", "--shards", "1"]);
    assert!(quoted.err.contains("cannot have a quotation mark"), "{quoted}");
    let tab = expect(&bench, 2, &["cluster", "script", "sweep", "-o", "a\tb", "--shards", "1"]);
    assert!(tab.err.contains("a tab or another control character"), "{tab}");
}

fn submit<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["cluster", "submit"], more].concat()
}

#[test]
fn a_folder_of_other_work_gets_no_job() {
    let bench = Bench::new();
    scheduler(&bench, &[("sbatch", "cat > /dev/null; echo 42"), ("squeue", "exit 0")]);
    fs::write(bench.path("small.toml"), SMALL).unwrap();
    bench.expect(0, &["sweep", "small.toml", "-o", "study", "-q"]);
    let seed = expect(&bench, 2, &submit(&["sweep", "small.toml", "--seed", "9", "-o", "study"]));
    assert!(seed.err.contains("study has items of other settings"), "{seed}");
    let blind = ["blind", "--seed", "20270101", "--flights", "3", "-o", "study", "--shards", "2"];
    let blind = expect(&bench, 2, &submit(&blind));
    assert!(blind.err.contains("cells of a study, not blind flights"), "{blind}");
    // More tasks than items are as many as there are items.
    bench.expect(0, &["sweep", "small.toml", "-o", "more", "-q", "--shard", "1/9"]);
    let many = ["sweep", "small.toml", "-o", "more", "--shards", "99"];
    let many = expect(&bench, 0, &submit(&many));
    assert!(many.err.contains("There are 9 items: 9 tasks, not 99"), "{many}");
    // All results are there: they are not yet put together.
    bench.expect(0, &["sweep", "small.toml", "-o", "more", "-q", "--shard", "1/1"]);
    let status = expect(&bench, 0, &["cluster", "status", "more"]);
    assert!(status.out.contains("were not put together:"), "{status}");
    bench.expect(0, &["sweep", "small.toml", "-o", "more", "-q", "--no-fly"]);
    let status = expect(&bench, 0, &["cluster", "status", "more"]);
    assert!(status.out.contains("complete  all results are there"), "{status}");
    let nowhere = expect(&bench, 1, &["cluster", "status", "nowhere"]);
    assert!(nowhere.err.contains("nowhere"), "{nowhere}");
    // A look at results changes nothing, and makes no folder.
    let other = ["sweep", "small.toml", "-o", "more", "--seed", "3", "--no-fly"];
    assert!(bench.expect(2, &other).err.contains("other settings"));
    bench.expect(0, &["sweep", "small.toml", "-o", "more", "-q", "--shard", "1/3"]);
    bench.expect(1, &["sweep", "small.toml", "-o", "nowhere", "--no-fly"]);
    assert!(!bench.path("nowhere").exists());
}
