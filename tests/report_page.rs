//! The report from a synthetic campaign: whole, self-contained, safe, repeatable.

mod report_synthetic;

use std::path::Path;

use report_synthetic::{campaign, provenance, updraft_series};
use updraft::report::{render, write};

#[test]
fn is_written_with_all_figures() {
    for (name, analysis) in [("campaign", campaign()), ("series", updraft_series())] {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report").join(name);
        let report = render(&analysis, &provenance()).unwrap();
        write(&report, &folder).unwrap();
        assert!(std::fs::read_to_string(folder.join("index.html")).unwrap() == report.html);
        for (name, svg) in &report.figures {
            let path = folder.join("figures").join(format!("{name}.svg"));
            assert!(&std::fs::read_to_string(&path).unwrap() == svg, "{path:?} is not its figure");
        }
    }
}
