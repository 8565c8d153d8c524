//! Building of a plan from a template and a vehicle.

use super::error::TemplateError;
use super::formation::{assign_groups, lay_out};
use super::plan::{Fence, Group, PLAN_SCHEMA, Plan, Site};
use super::source::Source;
use super::steps::{Offset, Timeline};
use super::template::{FlightTemplate, span_of};
use crate::base::number::plain;
use crate::vehicle::{Limits, Vehicle};

/// Makes the plan of one flight. `path` and `text` are the template's, for messages.
///
/// # Errors
///
/// [`TemplateError`], which points at the place in the template that gives no plan.
pub fn build_plan(
    path: &str,
    text: &str,
    template: &FlightTemplate,
    vehicle: &Vehicle,
) -> Result<Plan, TemplateError> {
    let source = Source { path, text, template };
    let name = template.name.get_ref();
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || name.len() > 60 || !name.chars().all(plain) {
        return Err(source
            .error(span_of(&template.name), "the name becomes a folder's name")
            .with_help("use letters, digits, `-` and `_`, at most 60"));
    }
    let site = site(&source)?;
    let site_name = site_name(&source)?;
    let offset = template.site.utc_offset_h.as_ref();
    let utc_offset_h = offset
        .map(|offset| source.in_range(offset, "local time less UTC", "h", -12.0..=14.0))
        .transpose()?;
    let (grid, mut slots) = lay_out(&source)?;
    assign_groups(&source, &mut slots)?;
    let groups = groups(&source)?;
    let duration_ms = groups
        .iter()
        .filter_map(|group| group.segments.last())
        .map(|segment| segment.end_ms)
        .max()
        .unwrap_or(0);
    let limits = limits(&source, vehicle.limits)?;
    let fence = fence(&source, &slots, &groups)?;
    Ok(Plan {
        schema: PLAN_SCHEMA.to_owned(),
        name: name.clone(),
        title: template.title.clone(),
        purpose: template.purpose,
        vehicle: vehicle.name.clone(),
        site,
        site_name,
        utc_offset_h,
        limits,
        fence,
        grid: Some(grid),
        slots,
        groups,
        duration_ms,
        briefing: template.briefing.clone(),
    })
}

/// Longest name of a place, characters.
const LONGEST_NAME: usize = 80;

fn site_name(source: &Source<'_>) -> Result<Option<String>, TemplateError> {
    let Some(name) = &source.template.site.name else { return Ok(None) };
    let text = name.get_ref().trim();
    if text.chars().count() > LONGEST_NAME {
        let what = format!("the place's name is longer than {LONGEST_NAME} characters");
        return Err(source.error(span_of(name), what).with_help("it stands in headings"));
    }
    Ok((!text.is_empty()).then(|| text.to_owned()))
}

fn site(source: &Source<'_>) -> Result<Site, TemplateError> {
    let site = &source.template.site;
    let [lat, lon] = *site.origin.get_ref();
    if !(-85.0..=85.0).contains(&lat) || !(-180.0..=180.0).contains(&lon) {
        return Err(source
            .error(
                span_of(&site.origin),
                format!("there is no place at {}, {}", plain(lat), plain(lon)),
            )
            .with_help("origin = [latitude, longitude] in degrees, latitude within 85"));
    }
    Ok(Site {
        origin_lat_deg: lat,
        origin_lon_deg: lon,
        ground_amsl_m: source.in_range(
            &site.ground_amsl_m,
            "ground height",
            "m",
            -500.0..=6000.0,
        )?,
        ground_assumed: site.ground_assumed,
        orientation_deg: source.in_range(
            &site.orientation_deg,
            "orientation",
            "deg",
            -360.0..=360.0,
        )?,
    })
}

fn groups(source: &Source<'_>) -> Result<Vec<Group>, TemplateError> {
    let templates = &source.template.groups;
    if templates.is_empty() {
        let segments = Timeline::expand(source, Offset::default())?;
        return Ok(vec![Group { name: "all".to_owned(), offset_ms: 0, segments }]);
    }
    let offsets_ms = templates
        .iter()
        .map(|group| {
            let offset_s = source.number(&group.offset_s, "time offset", "s", 0.0..=3600.0)?;
            Ok((offset_s * 1000.0).round() as u64)
        })
        .collect::<Result<Vec<_>, TemplateError>>()?;
    let largest_ms = offsets_ms.iter().copied().max().unwrap_or(0);
    templates
        .iter()
        .zip(offsets_ms)
        .map(|(group, own_ms)| {
            Ok(Group {
                name: group.name.get_ref().clone(),
                offset_ms: own_ms,
                segments: Timeline::expand(source, Offset { own_ms, largest_ms })?,
            })
        })
        .collect()
}

fn limits(source: &Source<'_>, mut limits: Limits) -> Result<Limits, TemplateError> {
    let own = &source.template.limits;
    let fields = [
        (&own.max_speed_xy_mps, &mut limits.max_speed_xy_mps, "m/s", 100.0),
        (&own.max_speed_up_mps, &mut limits.max_speed_up_mps, "m/s", 100.0),
        (&own.max_speed_down_mps, &mut limits.max_speed_down_mps, "m/s", 100.0),
        (&own.max_acceleration_mps2, &mut limits.max_acceleration_mps2, "m/s²", 100.0),
        (&own.max_velocity_step_mps, &mut limits.max_velocity_step_mps, "m/s", 100.0),
        (&own.max_altitude_m, &mut limits.max_altitude_m, "m", 4000.0),
        (&own.min_distance_m, &mut limits.min_distance_m, "m", 1000.0),
        (&own.endurance_s, &mut limits.endurance_s, "s", 36_000.0),
        (&own.endurance_reserve, &mut limits.endurance_reserve, "", 0.9),
    ];
    for (value, limit, unit, most) in fields {
        if let Some(value) = value {
            *limit = source.in_range(value, "this limit", unit, 0.0..=most)?;
        }
    }
    Ok(limits)
}

/// A box around every trajectory, with room for the wind to push a drone about.
fn fence(
    source: &Source<'_>,
    slots: &[super::plan::Slot],
    groups: &[Group],
) -> Result<Fence, TemplateError> {
    let fence = &source.template.fence;
    let room_m = source.in_range(&fence.room_m, "room to the fence", "m", 0.0..=1000.0)?;
    let margin_m = source.in_range(&fence.margin_m, "fence margin", "m", 0.0..=1000.0)?;
    if margin_m > room_m {
        return Err(source
            .error(span_of(&fence.margin_m), "the margin is larger than the room to the fence")
            .with_help(format!("room_m is {room_m} m")));
    }
    let (mut low, mut high, mut top_m) = ([f64::MAX; 2], [f64::MIN; 2], 0.0_f64);
    for slot in slots {
        let Some(group) = groups.get(usize::from(slot.group)) else { continue };
        for segment in &group.segments {
            for point in [segment.from_m, segment.to_m, segment.turn_m()] {
                for axis in 0..2 {
                    low[axis] = low[axis].min(slot.home_m[axis] + point[axis]);
                    high[axis] = high[axis].max(slot.home_m[axis] + point[axis]);
                }
                top_m = top_m.max(point[2]);
            }
        }
    }
    let [x0, y0] = low.map(|value| ((value - room_m) * 1000.0).round() / 1000.0);
    let [x1, y1] = high.map(|value| ((value + room_m) * 1000.0).round() / 1000.0);
    let max_altitude_m = match &fence.max_altitude_m {
        Some(value) => source.in_range(value, "fence altitude", "m", 10.0..=3000.0)?,
        None => ((top_m + room_m) * 10.0).ceil() / 10.0,
    };
    Ok(Fence { polygon_m: vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]], max_altitude_m, margin_m })
}
