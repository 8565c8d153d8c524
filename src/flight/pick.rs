//! Which flight of a log is meant: armed intervals and show stages.

use super::Series;
use super::channels::Messages;

/// Event ids of older firmware.
const EV_ARMED: f64 = 10.0;
const EV_DISARMED: f64 = 11.0;
/// The show's stage while it performs.
pub(super) const PERFORMING: u8 = 4;
/// An armed interval with less motor data than this is not a flight, s.
const SHORTEST_FLIGHT_S: f64 = 5.0;
/// Outputs that are not logged for so long were not logged because the vehicle was disarmed, s.
const SILENCE_S: f64 = 5.0;

/// Show stages at their changes, over board time.
pub(super) fn stages(messages: &Messages) -> Vec<(f64, u8)> {
    let Some(rows) = messages.rows("SHOW") else { return Vec::new() };
    let Some(column) = rows.column("Stage") else { return Vec::new() };
    let mut stages: Vec<(f64, u8)> = Vec::new();
    for (time, stage) in rows.time_s.iter().zip(column) {
        if !(0.0..=255.0).contains(stage) {
            continue;
        }
        let stage = *stage as u8;
        if stages.last().is_none_or(|(_, last)| *last != stage) {
            stages.push((*time, stage));
        }
    }
    stages
}

/// Armings (`true`) and disarmings, over board time.
fn events(messages: &Messages) -> Vec<(f64, bool)> {
    let mut events: Vec<(f64, bool)> = Vec::new();
    if let Some(rows) = messages.rows("ARM")
        && let Some(states) = rows.column("ArmState")
    {
        events.extend(rows.time_s.iter().zip(states).map(|(time, state)| (*time, *state != 0.0)));
    }
    if let Some(rows) = messages.rows("EV")
        && let Some(ids) = rows.column("Id")
    {
        let arming = |(time, id): (&f64, &f64)| match *id {
            EV_ARMED => Some((*time, true)),
            EV_DISARMED => Some((*time, false)),
            _ => None,
        };
        events.extend(rows.time_s.iter().zip(ids).filter_map(arming));
    }
    events.sort_by(|left, right| left.0.total_cmp(&right.0));
    events
}

/// Whether the last word of arming is that the motors are armed; `None`: there is none.
pub(super) fn last_event(messages: &Messages) -> Option<bool> {
    events(messages).last().map(|(_, is_armed)| *is_armed)
}

/// When the motors were armed, over board time: from ARM and EV rows. A log that begins or ends
/// armed has no row for it, so its ends stand in; without any rows the whole log counts as armed.
pub(super) fn armed(messages: &Messages, pulses: &Series) -> Vec<(f64, f64)> {
    let events = events(messages);
    let Some((first, last)) = pulses.span() else { return Vec::new() };
    let mut intervals = Vec::new();
    let mut since = events.first().is_none_or(|(_, armed)| !armed).then_some(first);
    let mut disarmed = f64::NEG_INFINITY;
    let resumed = resumptions(pulses);
    let resumed_after = |disarmed: f64, before: f64| {
        resumed.iter().copied().rfind(|time| (disarmed..before).contains(time))
    };
    for (time, armed) in events {
        match (since, armed) {
            (None, true) => since = Some(time),
            (Some(start), false) => {
                intervals.push((start, time));
                since = None;
                disarmed = time;
            }
            // Disarmed twice: it was armed when its log went on, before the word of it could be logged.
            (None, false) => {
                intervals.extend(resumed_after(disarmed, time).map(|start| (start, time)));
                disarmed = time;
            }
            (Some(_), true) => {}
        }
    }
    if since.is_none() && messages.logs_only_armed() {
        since = resumed_after(disarmed, last);
    }
    intervals.extend(since.filter(|start| *start < last).map(|start| (start, last)));
    intervals
}

/// Where outputs are logged again after a silence: a vehicle that logs only while it is armed goes on in
/// the same file when it is armed again.
fn resumptions(pulses: &Series) -> Vec<f64> {
    let pairs = pulses.time_s.windows(2);
    let resumes = pairs.filter_map(|pair| match *pair {
        [before, after] if after - before > SILENCE_S => Some(after),
        _ => None,
    });
    resumes.collect()
}

/// The armed intervals that are flights, in time order.
pub(super) fn flights(armed: &[(f64, f64)], pulses: &Series) -> Vec<(f64, f64)> {
    let flown = |(start, end): &(f64, f64)| {
        let times = pulses.times_between(*start, *end);
        times.first().zip(times.last()).is_some_and(|(a, b)| b - a >= SHORTEST_FLIGHT_S)
    };
    armed.iter().copied().filter(flown).collect()
}

/// The armed interval to analyse, and a warning when there was a choice.
pub(super) fn flight(
    armed: &[(f64, f64)],
    stages: &[(f64, u8)],
    pulses: &Series,
) -> Option<((f64, f64), Option<String>)> {
    let flown = flights(armed, pulses);
    let performs = |(start, end): &&(f64, f64)| {
        stages.iter().any(|(time, stage)| *stage == PERFORMING && (start..=end).contains(&time))
    };
    let shows: Vec<(f64, f64)> = flown.iter().filter(performs).copied().collect();
    let (chosen, kind) = match shows.last() {
        Some(show) => (*show, "performed a show"),
        None => (*flown.last()?, "was armed"),
    };
    let warning = (flown.len() > 1).then(|| {
        format!(
            "the log holds {} flights; the last one that {kind} is analysed (board time {:.0} to \
             {:.0} s)",
            flown.len(),
            chosen.0,
            chosen.1
        )
    });
    Some((chosen, warning))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pulses() -> Series {
        let time_s: Vec<f64> = (0..1000).map(|index| f64::from(index) * 0.1).collect();
        Series { value: vec![1500.0; time_s.len()], time_s }
    }

    #[test]
    fn the_flight_that_performed_the_show_is_taken() {
        let armed = [(0.0, 20.0), (30.0, 50.0), (60.0, 80.0)];
        let (chosen, warning) =
            flight(&armed, &[(5.0, 3), (35.0, PERFORMING), (45.0, 7)], &pulses()).unwrap();
        assert_eq!(chosen, (30.0, 50.0));
        assert!(warning.unwrap().contains("3 flights"));
        let (last, _) = flight(&armed, &[], &pulses()).unwrap();
        assert_eq!(last, (60.0, 80.0));
    }

    #[test]
    fn a_log_that_goes_on_when_it_is_armed_again_need_not_say_so() {
        let table = |name: &str, rows: &[(f64, f64)], column: &str| crate::log::Table {
            message: name.into(),
            rows: rows.len(),
            numbers: vec![
                ("TimeUS".into(), rows.iter().map(|(time, _)| time * 1e6).collect()),
                (column.into(), rows.iter().map(|(_, value)| *value).collect()),
            ],
            ..crate::log::Table::default()
        };
        let outputs = |spans: &[(f64, f64)]| {
            let mut pulses = Series::default();
            for (from, to) in spans {
                pulses
                    .time_s
                    .extend((0..((to - from) * 10.0) as i32).map(|i| from + f64::from(i) * 0.1));
            }
            pulses.value = vec![1500.0; pulses.time_s.len()];
            pulses
        };
        // Two shows of one boot, each 15 s longer in the log than armed.
        let spans = [(92.0, 175.0), (292.0, 375.0)];
        let events = [(160.0, 0.0), (160.0, 11.0), (360.0, 0.0), (360.0, 11.0)];
        let arms: Vec<(f64, f64)> = events.iter().copied().step_by(2).collect();
        let twice: Vec<(f64, f64)> = events.iter().copied().skip(1).step_by(2).collect();
        let tables = [table("ARM", &arms, "ArmState"), table("EV", &twice, "Id")];
        let messages = Messages::of_tables(tables);
        let armed_s = armed(&messages, &outputs(&spans));
        assert_eq!(armed_s, [(92.0, 160.0), (292.0, 360.0)]);
        // Cut in the second show.
        let tables = [
            table("ARM", &arms[..1], "ArmState"),
            crate::log::Table {
                message: "PARM".into(),
                rows: 1,
                numbers: vec![("Value".into(), vec![0.0])],
                texts: vec![("Name".into(), vec!["LOG_DISARMED".into()])],
                ..crate::log::Table::default()
            },
        ];
        let armed_s = armed(&Messages::of_tables(tables), &outputs(&[spans[0], (292.0, 300.0)]));
        assert_eq!(armed_s.len(), 2);
        assert_eq!(armed_s[0], (92.0, 160.0));
        assert!(armed_s[1].0 == 292.0 && armed_s[1].1 > 299.0, "{armed_s:?}");
    }

    #[test]
    fn an_armed_interval_without_motor_data_is_no_flight() {
        let (chosen, warning) = flight(&[(0.0, 50.0), (200.0, 300.0)], &[], &pulses()).unwrap();
        assert_eq!((chosen, warning), ((0.0, 50.0), None));
        assert!(flight(&[(200.0, 300.0)], &[], &pulses()).is_none());
    }
}
