//! Writer of `.skyb` files.

use nalgebra::Vector3;

use super::units::{Axis, deviation, encode_axis, to_unit};
use super::{
    BlockKind, MAGIC, MAX_BODY, MAX_SCALE_MM, Quantisation, SkybError, TRAJECTORY_HEADER, yaw,
};
use crate::bezier::{self, Scalar};
use crate::{Segment, ShowDrone, Trajectory};
use untrusted_io::crc::ap_crc32;

/// Rule for choosing the size of the unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// The finest unit that holds all coordinates without rounding any; if none does, the finest
    /// one that holds them.
    #[default]
    Exact,
    /// The finest unit that holds all coordinates.
    Smallest,
    /// The finest unit of 1, 2, 5, 10, 20, 50 and 100 mm that holds all coordinates: round ones
    /// stay exact.
    Nice,
    /// A unit of this many millimetres, 1 to 127.
    Fixed(u8),
}

/// Options of [`write()`]: the scale, a comment, and how long a piece may be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SkybOptions {
    /// Size of the unit.
    pub scale: Scale,
    /// Text of the comment block, if there is to be one.
    pub comment: Option<String>,
    /// Duration above which a piece is cut into equal parts, ms.
    pub longest_piece_ms: u16,
}

impl Default for SkybOptions {
    fn default() -> Self {
        Self { scale: Scale::default(), comment: None, longest_piece_ms: 60_000 }
    }
}

/// A written file with its size and precision.
#[derive(Clone, Debug, PartialEq)]
pub struct SkybFile {
    /// Content of the file.
    pub bytes: Vec<u8>,
    /// Size of the unit, mm.
    pub scale_mm: u8,
    /// Pieces in the file, after cutting long ones.
    pub pieces: usize,
    /// Size of the trajectory block's body, of 65 535 bytes.
    pub trajectory_bytes: usize,
    /// Deviation from the trajectory caused by whole units.
    pub quantisation: Quantisation,
}

/// Size and precision of a trajectory in a `.skyb` file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkybCost {
    /// Size of the unit, mm.
    pub scale_mm: u8,
    /// Pieces in the file, after cutting long ones.
    pub pieces: usize,
    /// Size of the trajectory block's body, of 65 535 bytes.
    pub trajectory_bytes: usize,
    /// Deviation from the trajectory caused by whole units.
    pub quantisation: Quantisation,
}

/// Writes one drone's show as a version 2 file with checksum.
///
/// Coordinates are rounded to the nearest unit, piece by piece boundaries fall on the same
/// milliseconds as in the trajectory, and each axis takes its shortest exact form. Blocks:
/// trajectory, lights (if any), comment (if any), yaw (if any).
///
/// ```
/// use nalgebra::Vector3;
/// use skybrush_show::{SegmentPath, Segment, ShowDrone, Trajectory, skyb};
///
/// let climb = Segment { duration_ms: 10_000, path: SegmentPath::Line(Vector3::new(0.0, 0.0, 10.0)) };
/// let trajectory = Trajectory { start_m: Vector3::zeros(), segments: vec![climb] };
/// let drone = ShowDrone { trajectory, ..ShowDrone::default() };
/// let file = skyb::write(&drone, &skyb::SkybOptions::default())?;
/// assert_eq!(skyb::read(&file.bytes)?.drone.trajectory, drone.trajectory);
/// # Ok::<(), skyb::SkybError>(())
/// ```
///
/// # Errors
///
/// When the show does not fit the format; the error says what and by how much.
pub fn write(drone: &ShowDrone, options: &SkybOptions) -> Result<SkybFile, SkybError> {
    let (cost, body) = store(&drone.trajectory, options)?;
    let mut bytes = Vec::with_capacity(body.len() + drone.lights.len() + 64);
    bytes.extend(MAGIC);
    bytes.extend([2, 1, 0, 0, 0, 0]);
    push_block(&mut bytes, BlockKind::Trajectory, &body)?;
    if !drone.lights.is_empty() {
        push_block(&mut bytes, BlockKind::Lights, &drone.lights)?;
    }
    if let Some(comment) = &options.comment {
        push_block(&mut bytes, BlockKind::Comment, comment.as_bytes())?;
    }
    if let Some(program) = &drone.yaw {
        push_block(&mut bytes, BlockKind::Yaw, &yaw::encode(program)?)?;
    }
    let crc = ap_crc32(&bytes);
    bytes[6..10].copy_from_slice(&crc.to_le_bytes());
    let SkybCost { scale_mm, pieces, trajectory_bytes, quantisation } = cost;
    Ok(SkybFile { bytes, scale_mm, pieces, trajectory_bytes, quantisation })
}

/// Computes the cost of a trajectory in a file without making the file.
///
/// # Errors
///
/// As [`write()`].
pub fn measure(trajectory: &Trajectory, options: &SkybOptions) -> Result<SkybCost, SkybError> {
    store(trajectory, options).map(|(cost, _)| cost)
}

fn store(trajectory: &Trajectory, options: &SkybOptions) -> Result<(SkybCost, Vec<u8>), SkybError> {
    let pieces = cut(trajectory, u32::from(options.longest_piece_ms.max(1)))?;
    let scale_mm = choose_scale(trajectory.start_m, &pieces, options.scale)?;
    let block = trajectory_block(trajectory.start_m, &pieces, scale_mm)?;
    let cost = SkybCost {
        scale_mm,
        pieces: pieces.len(),
        trajectory_bytes: block.body.len(),
        quantisation: block.quantisation,
    };
    Ok((cost, block.body))
}

fn push_block(bytes: &mut Vec<u8>, kind: BlockKind, body: &[u8]) -> Result<(), SkybError> {
    let length = u16::try_from(body.len())
        .map_err(|_| SkybError::BlockTooLong { block: kind.name(), bytes: body.len() })?;
    bytes.push(kind.code());
    bytes.extend(length.to_le_bytes());
    bytes.extend(body);
    Ok(())
}

/// All pieces, none longer than `longest_ms`, checked for finite coordinates and durations.
fn cut(trajectory: &Trajectory, longest_ms: u32) -> Result<Vec<Segment>, SkybError> {
    if !trajectory.start_m.iter().all(|value| value.is_finite()) {
        return Err(SkybError::NotFinite { piece: 0 });
    }
    let mut parts = Vec::with_capacity(trajectory.segments.len());
    let pieces = trajectory.pieces().zip(&trajectory.segments);
    for (index, (piece, segment)) in pieces.enumerate() {
        if segment.duration_ms == 0 {
            let at_s = piece.start_ms as f64 / 1000.0;
            return Err(SkybError::TimeStandsStill { piece: index + 1, at_s });
        }
        let mut buffer = [Vector3::zeros(); 8];
        let points = piece.path.control_points(piece.from_m, &mut buffer);
        if !points.iter().flat_map(Vector3::iter).all(|value| value.is_finite()) {
            return Err(SkybError::NotFinite { piece: index + 1 });
        }
        if segment.duration_ms <= longest_ms {
            parts.push(segment.clone());
        } else {
            parts.extend(bezier::cut(piece.from_m, segment, longest_ms));
        }
    }
    Ok(parts)
}

fn choose_scale(start_m: Vector3<f64>, pieces: &[Segment], choice: Scale) -> Result<u8, SkybError> {
    let mut points = vec![start_m];
    let mut buffer = [Vector3::zeros(); 8];
    for piece in pieces {
        points.extend(piece.path.control_points(start_m, &mut buffer).iter().skip(1));
    }
    let value_m = points.iter().map(Vector3::amax).fold(0.0, f64::max);
    let fits = |scale_mm: &u8| to_unit(value_m, *scale_mm).is_some();
    let whole = |scale_mm: &u8| {
        let unit_m = f64::from(*scale_mm) / 1000.0;
        let is_whole = |value: &f64| (value / unit_m - (value / unit_m).round()).abs() < 1e-6;
        points.iter().all(|point| point.iter().all(is_whole))
    };
    let smallest = || (1..=MAX_SCALE_MM).find(fits);
    let (found, coarsest) = match choice {
        Scale::Exact => {
            let exact = (1..=MAX_SCALE_MM).filter(fits).find(whole);
            (exact.or_else(smallest), MAX_SCALE_MM)
        }
        Scale::Smallest => (smallest(), MAX_SCALE_MM),
        Scale::Nice => ([1, 2, 5, 10, 20, 50, 100].into_iter().find(fits), 100),
        Scale::Fixed(scale_mm @ 1..=MAX_SCALE_MM) => (Some(scale_mm).filter(fits), scale_mm),
        Scale::Fixed(other) => return Err(SkybError::BadScale(other)),
    };
    found.ok_or_else(|| out_of_range(value_m, coarsest))
}

fn out_of_range(value_m: f64, scale_mm: u8) -> SkybError {
    let reach_m = super::units::to_m(i16::MAX, scale_mm);
    SkybError::OutOfRange { value_m, scale_mm, reach_m }
}

struct TrajectoryBlock {
    body: Vec<u8>,
    quantisation: Quantisation,
}

fn trajectory_block(
    start_m: Vector3<f64>,
    pieces: &[Segment],
    scale_mm: u8,
) -> Result<TrajectoryBlock, SkybError> {
    let mut body = Vec::with_capacity(TRAJECTORY_HEADER + pieces.len() * 9);
    body.push(scale_mm);
    let mut starts = [0_i16; 3];
    for (start, value) in starts.iter_mut().zip(start_m.iter()) {
        *start = to_unit(*value, scale_mm).ok_or_else(|| out_of_range(*value, scale_mm))?;
        body.extend(start.to_le_bytes());
    }
    body.extend([0, 0]);

    let mut quantisation = Quantisation::default();
    let mut from_m = start_m;
    let (mut fit, mut fit_ms, mut at_ms) = (0, 0, 0_u64);
    for piece in pieces {
        let mut buffer = [Vector3::zeros(); 8];
        let points = piece.path.control_points(from_m, &mut buffer);
        let axis = |i: usize| -> Result<Axis, SkybError> {
            encode_axis(Scalar::new(points.iter().map(|point| point[i])), scale_mm).ok_or_else(
                || out_of_range(points.iter().map(|p| p[i].abs()).fold(0., f64::max), scale_mm),
            )
        };
        let axes = [axis(0)?, axis(1)?, axis(2)?];
        body.push(axes[0].code | axes[1].code << 2 | axes[2].code << 4);
        // `cut` made every piece shorter than 65 536 ms.
        body.extend((piece.duration_ms as u16).to_le_bytes());
        for axis in &axes {
            body.extend(axis.values().iter().flat_map(|value| value.to_le_bytes()));
        }
        quantisation =
            quantisation.max(deviation(points, &axes, starts, scale_mm, piece.duration_ms));
        for (start, axis) in starts.iter_mut().zip(&axes) {
            *start = axis.values().last().copied().unwrap_or(*start);
        }
        from_m = piece.path.end_m(from_m);
        at_ms += u64::from(piece.duration_ms);
        if body.len() <= MAX_BODY {
            (fit, fit_ms) = (fit + 1, at_ms);
        }
    }
    if body.len() > MAX_BODY {
        let fit_s = fit_ms as f64 / 1000.0;
        let (bytes, pieces) = (body.len(), pieces.len());
        return Err(SkybError::TooManyPieces { bytes, pieces, fit, fit_s });
    }
    Ok(TrajectoryBlock { body, quantisation })
}
