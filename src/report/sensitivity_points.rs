//! Campaigns of a sensitivity study as points for figures.

use crate::study::sensitivity::{Drawn, Row, SensitivityPlan};

/// Most points of a figure: more are a blot, and a large file.
const MOST: usize = 1500;

/// Levels and outcomes of some campaigns, evenly chosen over the study.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// Levels as numbers, for one factor after the other.
    pub factors: Vec<Vec<f64>>,
    /// Outcomes in the order that the study asks for; `None`: could not be told.
    pub outcomes: Vec<Vec<Option<f64>>>,
    /// Campaigns that the points were chosen from.
    pub of: usize,
}

impl Points {
    /// Points of the campaigns that have an outcome.
    pub fn of(study: &SensitivityPlan, drawn: &Drawn<'_>, rows: &[Option<Row>]) -> Self {
        let finished = || {
            rows.iter()
                .enumerate()
                .filter_map(|(index, row)| Some((index, row.as_ref()?.result.as_ref().ok()?)))
        };
        let of = finished().count();
        let mut points = Self {
            factors: vec![Vec::new(); study.factors.len()],
            outcomes: vec![Vec::new(); study.outcomes.len()],
            of,
        };
        for (place, (index, outcome)) in finished().enumerate() {
            // Whenever another of the points is due.
            if of > MOST && place * MOST / of == (place + 1) * MOST / of {
                continue;
            }
            let item = drawn.item(index);
            for (list, (factor, level)) in
                points.factors.iter_mut().zip(study.factors.iter().zip(&item.levels))
            {
                list.push(factor.levels.score(level));
            }
            for (list, column) in points.outcomes.iter_mut().zip(&study.outcomes) {
                list.push((column.get)(outcome));
            }
        }
        points
    }
}
