//! How each example is tested that cannot be run as it is printed, and what must be there before.

/// How an example is tested.
#[derive(Clone, Copy, Debug)]
pub(crate) enum How {
    /// Run with these options in place of the printed values, or beside them, so that it takes a moment.
    With(&'static [&'static str]),
    /// Run with a word replaced, as it stands for something.
    Instead(&'static str, &'static str),
    /// Read by the program, with all its options and values, and not run, for this reason.
    Read(&'static str),
    /// A command of another program; this says what is known of it.
    Other(&'static str),
}

/// Rule for the examples of a document that begin so.
pub(crate) struct Rule {
    pub(crate) document: &'static str,
    pub(crate) begins: &'static str,
    pub(crate) how: How,
}

/// Step before an example.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// Command of this program, which must end with 0.
    Run(&'static str),
    /// Folder to be renamed: from, to.
    Move(&'static str, &'static str),
    /// File with the first block of this language that the document has.
    Block(&'static str, &'static str),
}

/// What must be there before an example that begins so.
pub(crate) struct Before {
    pub(crate) document: &'static str,
    pub(crate) begins: &'static str,
    pub(crate) steps: &'static [Step],
}

const fn rule(document: &'static str, begins: &'static str, how: How) -> Rule {
    Rule { document, begins, how }
}

const MANY: &str = "hundreds of flights";
const SLURM: &str = "needs Slurm: tests/it/cluster";
const DRONES: &str = "needs drones: tests/it/cli/fleet.rs flies virtual ones";
const GAME: &str = "searches for minutes in a debug build: .ci/run plays a game";
const TWO: &str = "needs two analysed campaigns: tests/it/cli/compare.rs";
const SERVES: &str = "serves until Ctrl-C";
const PYTHON: &str = "a query in DuckDB or pandas: tests/it/archive runs those of docs/archive.md";
const FIRMWARE: &str = "ArduPilot's own program";

use How::{Instead, Other, Read, With};

/// Exceptions: every other example is run as it is printed, and must end with 0.
pub(crate) const RULES: &[Rule] = &[
    rule(
        "README.md",
        "cargo run --release -- run",
        With(&[
            "--grid",
            "1x2",
            "--speeds",
            "1,2",
            "--leg",
            "6",
            "--hover",
            "4",
            "--baseline",
            "10",
            "--duration",
            "60",
            "--no-study",
        ]),
    ),
    rule("README.md", "cargo test", Other("the tests themselves")),
    rule(
        "README.md",
        "updraft plan templates/calibration.toml",
        With(&[
            "--grid",
            "1x2",
            "--speeds",
            "1,2",
            "--leg",
            "6",
            "--hover",
            "4",
            "--baseline",
            "10",
        ]),
    ),
    rule("README.md", "updraft gap my-campaign", Read(GAME)),
    rule("README.md", "updraft compare", Read(TWO)),
    rule("docs/compare.md", "updraft compare", Read(TWO)),
    rule("docs/mast.md", "updraft compare", Read("needs a mast's record: tests/it/mast")),
    rule(
        "docs/products.md",
        "updraft analyze my-campaign --mixed-layer-depth",
        Read("needs a campaign with a long hover: tests/it/turbulence"),
    ),
    rule(
        "docs/air.md",
        "updraft simulate my-campaign --flight hover --air les:",
        Read("needs the output of a model: tests/it/les makes one"),
    ),
    rule("docs/basemap.md", "updraft analyze", Read("needs a picture: tests/it/cli/basemap.rs")),
    rule("docs/report.md", "updraft analyze", Read("draws all figures: tests/it/cli/paper.rs")),
    rule("README.md", "updraft inspect FILE", Instead("FILE", "my-campaign/show.skyc")),
    rule("README.md", "updraft fly my-campaign", With(&["--dry-run"])),
    rule("README.md", "updraft logs pull", With(&["--dry-run"])),
    rule(
        "README.md",
        "cargo run --release -- sweep",
        Read("143 flights: tests/it/study flies some"),
    ),
    rule("README.md", "updraft blind --seed 20270101", Read(MANY)),
    rule("README.md", "updraft cluster submit", Read(SLURM)),
    rule(
        "README.md",
        "updraft run --air thermal-day",
        With(&[
            "--grid",
            "1x2",
            "--speeds",
            "1,2",
            "--leg",
            "6",
            "--hover",
            "4",
            "--baseline",
            "10",
            "--duration",
            "60",
            "--no-study",
            "--direct",
        ]),
    ),
    rule("README.md", "updraft physics", Read(SERVES)),
    rule("README.md", "updraft gap next", Read("needs a verdict: tests/it/cli/gap_next.rs")),
    rule(
        "README.md",
        "updraft plan my-campaign/gap/next.toml",
        Read("needs a verdict: tests/it/cli/gap_next.rs"),
    ),
    rule("README.md", "updraft run --hide", Read(GAME)),
    rule("README.md", "updraft blind --seed 7", Read("eight searches: .ci/run")),
    rule("README.md", "updraft blind hide", Read(GAME)),
    rule("README.md", "updraft gap game", Read(GAME)),
    rule("README.md", "updraft blind reveal", Read(GAME)),
    rule("README.md", "updraft blind verify", Read(GAME)),
    rule(
        "docs/air.md",
        "updraft run --air field-day",
        With(&[
            "--grid",
            "1x2",
            "--speeds",
            "1,2",
            "--leg",
            "6",
            "--hover",
            "4",
            "--baseline",
            "10",
            "--duration",
            "60",
            "--no-study",
            "--direct",
        ]),
    ),
    rule("docs/blind.md", "updraft ", Read(GAME)),
    rule("docs/cluster.md", "updraft blind", Read(MANY)),
    rule("docs/cluster.md", "updraft cluster", Read(SLURM)),
    rule("docs/cluster.md", "seq 40", Read(MANY)),
    rule("docs/cluster.md", "parallel", Read("needs GNU parallel and other machines")),
    rule(
        "docs/csv.md",
        "updraft analyze --csv",
        Read("needs the public data: tests/it/cli/masts.rs"),
    ),
    rule("docs/fields.md", "duckdb", Other(PYTHON)),
    rule("docs/fields.md", "python3", Other(PYTHON)),
    rule("docs/gap-next.md", "updraft ", Read("needs a verdict: tests/it/cli/gap_next.rs")),
    rule("docs/gap.md", "updraft fly", Read(DRONES)),
    rule("docs/gap.md", "updraft gap", Read(GAME)),
    rule("docs/gap.md", "updraft run", Read(GAME)),
    rule("docs/live.md", "updraft fly", Read(DRONES)),
    rule("docs/sitl.md", "updraft physics", Read(SERVES)),
    rule("docs/sitl.md", "arducopter", Other(FIRMWARE)),
    rule("docs/sitl.md", "sim_vehicle.py", Other(FIRMWARE)),
    rule("docs/study.md", "updraft sweep", Read(MANY)),
    rule("docs/study.md", "duckdb", Other(PYTHON)),
    rule("docs/study.md", "python", Other(PYTHON)),
];

/// A campaign of two drones with a short ladder and a short hover, planned but not flown.
const SMALL: Step = Step::Run(
    "plan campaign --grid 1x2 --speeds 1,2 --leg 6 --hover 4 --baseline 10 --duration 60 -o my-campaign",
);

/// What must be there before some examples.
pub(crate) const BEFORE: &[Before] = &[
    Before {
        document: "README.md",
        begins: "updraft archive seasons/",
        steps: &[Step::Move("my-campaign", "seasons/my-campaign")],
    },
    Before {
        document: "README.md",
        begins: "updraft inspect FILE",
        steps: &[Step::Move("seasons/my-campaign", "my-campaign")],
    },
    Before {
        document: "docs/air.md",
        begins: "updraft simulate my-campaign --flight hover",
        steps: &[SMALL],
    },
    Before {
        document: "docs/air.md",
        begins: "updraft simulate my-campaign --air my-air.toml",
        steps: &[
            Step::Run(
                "plan campaign --grid 1x2 --speeds 1,2 --leg 6 --hover 4 --baseline 10 --duration 60 -o other",
            ),
            Step::Move("my-campaign", "flown"),
            Step::Move("other", "my-campaign"),
            Step::Block("toml", "my-air.toml"),
        ],
    },
    Before {
        document: "docs/archive.md",
        begins: "updraft archive",
        steps: &[
            SMALL,
            Step::Run("simulate my-campaign"),
            Step::Run("analyze my-campaign"),
            Step::Move("my-campaign", "seasons/my-campaign"),
        ],
    },
];
