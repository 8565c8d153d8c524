//! The window rule: the part of each segment that the analysis looks at.

use super::plan::{SegmentKind, Window};

/// The window rule: the last `length_ms` of a leg without its last `trim_ms`, never before
/// `settle_ms` into a segment; hovers are used whole between settling and trim.
///
/// The defaults are the paper's (section II-B.2: of a 20 s leg the last 10 s, less the last second)
/// and 3 s of settling for hovers, the measured length of the autopilot's transient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WindowRule {
    /// Time of a leg that is used, counted back from its end, ms.
    pub length_ms: u64,
    /// Time left out at the end of a segment, ms.
    pub trim_ms: u64,
    /// Time left out at the start of any segment, ms.
    pub settle_ms: u64,
}

/// Shortest window worth analysing, ms.
const MIN_WINDOW_MS: u64 = 2_000;

impl Default for WindowRule {
    fn default() -> Self {
        Self { length_ms: 10_000, trim_ms: 1_000, settle_ms: 3_000 }
    }
}

impl WindowRule {
    /// Window of a segment; `None` for kinds that are not analysed, and where it would be shorter
    /// than 2 s.
    pub fn of(self, kind: SegmentKind, start_ms: u64, end_ms: u64) -> Option<Window> {
        let earliest = start_ms + self.settle_ms;
        let start_ms = match kind {
            SegmentKind::LegUp | SegmentKind::LegDown | SegmentKind::Horizontal => {
                end_ms.saturating_sub(self.length_ms).max(earliest)
            }
            SegmentKind::Hover => earliest,
            _ => return None,
        };
        let end_ms = end_ms.saturating_sub(self.trim_ms);
        (end_ms >= start_ms + MIN_WINDOW_MS).then_some(Window { start_ms, end_ms })
    }
}
