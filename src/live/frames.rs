//! Differences between a page's last look and the present one.

use schemars::JsonSchema;
use serde::Serialize;

use super::view::{AirView, DroneView, PreflightView, Question, Replay, Said, Step, View};

/// A view, with the number of the look at which each part was last another.
#[derive(Clone, Debug, Default)]
pub struct Looks {
    /// Number of this look, from 1; 0: nobody has looked yet.
    pub number: u64,
    view: View,
    drones: Vec<u64>,
    preflight: u64,
    air: u64,
}

/// What a page is sent: only what is new to it.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Frame<'a> {
    /// Number of the look.
    pub number: u64,
    /// Whether everything is here, so that the page forgets what it had.
    pub whole: bool,
    /// Time of the station, ms since 1970.
    pub now_ms: u64,
    /// Time of the show, s.
    pub show_s: Option<f64>,
    /// Step that the station is at.
    pub step: Step,
    /// What the station waits for.
    pub waits: &'a str,
    /// Question that is open.
    pub question: Option<&'a Question>,
    /// Where a replay stands.
    pub replay: Option<Replay>,
    /// Drones that have changed, each with its place in the list.
    pub drones: Vec<(usize, &'a DroneView)>,
    /// Number of drones.
    pub count: usize,
    /// What was said since.
    pub said: Vec<&'a Said>,
    /// Table before a start, if it has changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preflight: Option<&'a Option<PreflightView>>,
    /// Air, if it has changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub air: Option<&'a Option<AirView>>,
}

impl Looks {
    /// The next look.
    #[must_use]
    pub fn next(&self, view: View) -> Self {
        let number = self.number + 1;
        let is_new = view.drones.len() != self.view.drones.len();
        let drones = view.drones.iter().enumerate().map(|(index, drone)| {
            let same = !is_new && self.view.drones.get(index) == Some(drone);
            if same { self.drones[index] } else { number }
        });
        let drones = drones.collect();
        let since = |same: bool, before: u64| if same { before } else { number };
        Self {
            number,
            drones,
            preflight: since(view.preflight == self.view.preflight, self.preflight),
            air: since(view.air == self.view.air, self.air),
            view,
        }
    }

    /// News since a look, for a page that knows of that look, of so many drones and of words up to a number; `None`: it knows
    /// nothing.
    pub fn since(&self, seen: Option<(u64, usize, u64)>) -> Frame<'_> {
        let view = &self.view;
        let (seen, listed, word) = seen.unwrap_or((0, 0, 0));
        let whole = seen == 0 || listed != view.drones.len();
        // A page that begins anew forgets the words, too.
        let (seen, word) = if whole { (0, 0) } else { (seen, word) };
        let drones = view.drones.iter().enumerate();
        Frame {
            number: self.number,
            whole,
            now_ms: view.now_ms,
            show_s: view.show_s,
            step: view.step,
            waits: &view.waits,
            question: view.question.as_ref(),
            replay: view.replay,
            drones: drones.filter(|(index, _)| self.drones[*index] > seen).collect(),
            count: view.drones.len(),
            said: view.said.iter().filter(|said| said.number > word).collect(),
            preflight: (self.preflight > seen).then_some(&view.preflight),
            air: (self.air > seen).then_some(&view.air),
        }
    }

    /// Knowledge of a page that has been sent this look: its number, the drones, and the last word.
    pub fn sent(&self, before: Option<(u64, usize, u64)>) -> (u64, usize, u64) {
        let word = before.map_or(0, |(.., word)| word);
        let last = self.view.said.last().map_or(word, |said| said.number.max(word));
        (self.number, self.view.drones.len(), last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(places: &[f64], said: u64) -> View {
        let drones = places
            .iter()
            .map(|x| DroneView { place_m: Some([*x, 0.0, 0.0]), ..DroneView::default() });
        let said = (1..=said).map(|number| Said {
            number,
            at_ms: 0,
            level: super::super::view::Level::Good,
            text: String::new(),
        });
        View { drones: drones.collect(), said: said.collect(), ..View::default() }
    }

    #[test]
    fn a_page_is_sent_what_is_new_to_it_and_no_more() {
        let first = Looks::default().next(view(&[1.0, 2.0], 1));
        let frame = first.since(None);
        assert!(frame.whole && frame.drones.len() == 2 && frame.said.len() == 1);
        let seen = first.sent(None);
        let second = first.next(view(&[1.0, 3.0], 3));
        let frame = second.since(Some(seen));
        assert!(!frame.whole && frame.air.is_none());
        assert_eq!(frame.drones.iter().map(|(index, _)| *index).collect::<Vec<_>>(), [1]);
        assert_eq!(frame.said.iter().map(|said| said.number).collect::<Vec<_>>(), [2, 3]);
        // Who has missed a look is sent both.
        let third = second.next(view(&[5.0, 3.0], 3));
        assert_eq!(third.since(Some(seen)).drones.len(), 2);
        assert_eq!(third.since(Some(second.sent(Some(seen)))).drones.len(), 1);
        // Another drone: the list is another.
        let fourth = third.next(view(&[5.0, 3.0, 1.0], 3));
        let frame = fourth.since(Some(third.sent(None)));
        assert!(frame.whole && frame.said.len() == 3, "a page that begins anew is told all of it");
    }

    #[test]
    fn air_that_goes_is_told() {
        let with = View { air: Some(AirView::default()), ..View::default() };
        let first = Looks::default().next(with);
        let second = first.next(View::default());
        let frame = second.since(Some(first.sent(None)));
        assert_eq!(frame.air, Some(&None));
    }
}
