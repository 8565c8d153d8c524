//! A comparison of campaigns as aligned text for a terminal.

use std::fmt::Write as _;

use crate::base::layout;
use crate::compare::result::{Comparison, DroneChange, LawComparison, MapComparison, Quantity};

use super::compare_words as words;
use super::table::{Align, column, lines};
use super::text::{NONE, clean, unit};

/// Of more drones, those that changed most are shown; all are in the report.
const DRONE_LIMIT: usize = 24;

const BOLD: &str = "\u{1b}[1m";
const DIM: &str = "\u{1b}[2m";
const YELLOW: &str = "\u{1b}[33m";
const RESET: &str = "\u{1b}[0m";

/// Renders a comparison for a terminal of `width` characters, with ANSI colours if `color`: for each pair of flights
/// what changed of the fleet and of its drones, and of the air.
pub fn comparison_summary(comparison: &Comparison, width: usize, color: bool) -> String {
    let mut out = Output { text: String::new(), width, color };
    let ids: Vec<String> = comparison.campaigns.iter().map(|one| clean(&one.id)).collect();
    out.line(BOLD, &title(&ids));
    for law in &comparison.laws {
        out.law(law, words::other_vehicle(comparison, &law.pair).as_deref());
    }
    for map in &comparison.maps {
        out.map(map);
    }
    let equal = words::equal_sentences(comparison);
    if !equal.is_empty() {
        out.line("", "");
        out.line(BOLD, "All campaigns");
        for sentence in &equal {
            out.wrapped("", sentence);
        }
    }
    out.list("Not compared", &comparison.not_compared);
    out.list("Notes", &comparison.notes);
    out.text
}

/// The reference last: `tuesday and wednesday against monday`.
pub(super) fn title(ids: &[String]) -> String {
    match ids {
        [reference, others @ ..] if !others.is_empty() => {
            format!("{} against {reference}", others.join(", "))
        }
        _ => "Comparison".to_owned(),
    }
}

struct Output {
    text: String,
    width: usize,
    color: bool,
}

impl Output {
    fn line(&mut self, style: &str, content: &str) {
        if self.color && !style.is_empty() && !content.is_empty() {
            let _ = writeln!(self.text, "{style}{content}{RESET}");
        } else {
            let _ = writeln!(self.text, "{content}");
        }
    }

    fn wrapped(&mut self, style: &str, content: &str) {
        let options = layout::options(self.width).initial_indent("  ").subsequent_indent("  ");
        for line in layout::wrapped(content, options) {
            self.line(style, &line);
        }
    }

    fn list(&mut self, heading: &str, items: &[String]) {
        if items.is_empty() {
            return;
        }
        self.line("", "");
        self.line(YELLOW, &format!("{heading} ({})", items.len()));
        for item in items {
            self.wrapped("", &format!("- {}", clean(item)));
        }
    }

    fn law(&mut self, law: &LawComparison, vehicles: Option<&str>) {
        self.line("", "");
        self.line(BOLD, &words::pair(&law.pair));
        for sentence in &words::drone_sentences(law) {
            self.wrapped("", sentence);
        }
        for sentence in &words::fleet_sentences(law, vehicles) {
            self.wrapped("", sentence);
        }
        if let Some(sentence) = &words::errors_sentence(law) {
            self.wrapped(DIM, sentence);
        }
        self.line("", "");
        let columns = [
            column("fleet", Align::Left, 0),
            column("before", Align::Right, 1),
            column("now", Align::Right, 1),
            column("change", Align::Right, 0),
            column("p", Align::Right, 0),
            column("unit", Align::Left, 2),
        ];
        let rows: Vec<Vec<String>> = law
            .fleet
            .iter()
            .map(|one| {
                let [before, now] = words::before_and_now(one);
                vec![
                    words::quantity(one),
                    before,
                    now,
                    words::change(one.change),
                    words::probability_cell(one.p_value),
                    unit(&one.unit),
                ]
            })
            .collect();
        self.table(&columns, &rows);
        self.drones(law);
    }

    fn drones(&mut self, law: &LawComparison) {
        let shown = most_changed(law);
        let columns = [
            column("drone", Align::Left, 0),
            column("hover before", Align::Right, 2),
            column("now", Align::Right, 2),
            column("beyond fleet", Align::Right, 0),
            column("p", Align::Right, 3),
            column("p of all", Align::Right, 0),
            column("response", Align::Right, 1),
            column("p of all", Align::Right, 1),
        ];
        let rows: Vec<Vec<String>> = shown
            .iter()
            .map(|one| {
                let mut row = vec![words::drone(one, law.identity)];
                let of = |quantity| one.changes.iter().find(|change| change.quantity == quantity);
                let beyond = |quantity| {
                    let change = of(quantity).and_then(|change| change.beyond_fleet);
                    change.map_or_else(|| NONE.to_owned(), words::change)
                };
                let hover = of(Quantity::Hover);
                let value = |of: Option<_>| of.map_or_else(|| NONE.to_owned(), words::value);
                row.push(value(hover.map(|hover| hover.reference)));
                row.push(value(hover.map(|hover| hover.other)));
                row.push(beyond(Quantity::Hover));
                row.push(words::probability_cell(hover.and_then(|hover| hover.p_value)));
                row.push(words::probability_cell(hover.and_then(|hover| hover.p_holm)));
                row.push(beyond(Quantity::Response));
                let response = of(Quantity::Response).and_then(|change| change.p_holm);
                row.push(words::probability_cell(response));
                row
            })
            .collect();
        self.line("", "");
        self.table(&columns, &rows);
        if shown.len() < law.drones.len() {
            let left = law.drones.len() - shown.len();
            let words = if left == 1 {
                "drone, which changed less, is"
            } else {
                "drones, which changed less, are"
            };
            self.line(DIM, &format!("  {left} more {words} in the report"));
        }
    }

    fn map(&mut self, map: &MapComparison) {
        self.line("", "");
        self.line(BOLD, &words::pair(&map.pair));
        for sentence in &words::map_sentences(map) {
            self.wrapped("", sentence);
        }
        if map.scales.is_empty() {
            return;
        }
        self.line("", "");
        let columns = [
            column("of the air", Align::Left, 0),
            column("before (95 %)", Align::Right, 0),
            column("now (95 %)", Align::Right, 0),
            column("p", Align::Right, 1),
            column("p of all", Align::Right, 0),
            column("unit", Align::Left, 2),
        ];
        let rows: Vec<Vec<String>> = map
            .scales
            .iter()
            .map(|row| {
                vec![
                    clean(&row.name),
                    words::scale(row.reference, row.reference_interval),
                    words::scale(row.other, row.other_interval),
                    words::probability_cell(row.p_value),
                    words::probability_cell(row.p_holm),
                    unit(&row.unit),
                ]
            })
            .collect();
        self.table(&columns, &rows);
    }

    fn table(&mut self, columns: &[super::table::Column], rows: &[Vec<String>]) {
        for (index, row) in lines(columns, rows, self.width.saturating_sub(2)).iter().enumerate() {
            self.line(if index == 0 { DIM } else { "" }, &format!("  {row}"));
        }
    }
}

/// The drones in their order; of many, those that changed most.
fn most_changed(law: &LawComparison) -> Vec<&DroneChange> {
    let largest = |one: &DroneChange| {
        let tested = one.changes.iter().filter(|change| change.quantity.is_tested());
        tested.filter_map(|change| change.t).map(f64::abs).fold(0.0, f64::max)
    };
    let mut order: Vec<usize> = (0..law.drones.len()).collect();
    order.sort_by(|a, b| largest(&law.drones[*b]).total_cmp(&largest(&law.drones[*a])));
    order.truncate(DRONE_LIMIT);
    order.sort_unstable();
    order.into_iter().filter_map(|index| law.drones.get(index)).collect()
}
