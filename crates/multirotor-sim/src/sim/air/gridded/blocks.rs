//! Blocks of a grid in memory: those used last, as many as fit.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{Component, GridSource, Points};

/// Cells of a block along each axis: with all three components and both times around a flight, a few MB.
const EDGE: usize = 32;
/// Memory for blocks, bytes. What does not fit is read again when it is needed.
const MOST_BYTES: usize = 256 << 20;

/// A part of a grid: numbers of its first points and how many there are, along z, y and x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Numbers of the first points, from 0.
    pub from: [usize; 3],
    /// Numbers of points.
    pub count: [usize; 3],
}

impl Block {
    /// Number of values.
    pub fn len(&self) -> usize {
        self.count.iter().product()
    }

    /// Whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Name of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    component: Component,
    time: usize,
    /// Number of the block along z, y and x.
    place: [usize; 3],
}

impl Key {
    /// The block that has the cell after these points.
    pub(super) fn around(component: Component, time: usize, points: [usize; 3]) -> Self {
        Self { component, time, place: points.map(|point| point / EDGE) }
    }
}

/// Values of a block, with the first points of the next blocks: a cell's corners are in one block.
pub(super) struct Values {
    from: [usize; 3],
    count: [usize; 3],
    mps: Vec<f32>,
}

impl Values {
    /// Value at a point; NaN outside.
    pub(super) fn at(&self, point: [usize; 3]) -> f32 {
        let mut index = 0;
        for ((point, from), count) in point.into_iter().zip(self.from).zip(self.count) {
            // The halo beyond the end of an axis that does not repeat is its last point.
            index = index * count + (point - from).min(count - 1);
        }
        self.mps.get(index).copied().unwrap_or(f32::NAN)
    }
}

/// A block that somebody holds, with its name.
pub(super) type HeldBlock = Option<(Key, Arc<Values>)>;

/// The blocks around a drone now and at the model's next time, for each component.
#[derive(Default)]
pub(super) struct Held([[HeldBlock; 2]; 3]);

impl Held {
    pub(super) fn of(&mut self, component: Component) -> &mut [HeldBlock; 2] {
        &mut self.0[component as usize]
    }
}

/// All blocks in memory.
#[derive(Default)]
pub(super) struct Blocks(Mutex<Inside>);

#[derive(Default)]
struct Inside {
    blocks: BTreeMap<Key, (u64, Arc<Values>)>,
    bytes: usize,
    /// Counts requests, to tell what was used last.
    clock: u64,
    failure: Option<String>,
}

impl Blocks {
    fn inside(&self) -> MutexGuard<'_, Inside> {
        // What a thread left that panicked is whole: blocks are put in at once.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn failure(&self) -> Option<String> {
        self.inside().failure.clone()
    }

    /// A block, from memory or from the source. What cannot be read has no air, and is a failure.
    pub(super) fn get(
        &self,
        source: &dyn GridSource,
        points: &Points,
        repeats: bool,
        key: Key,
    ) -> Arc<Values> {
        let mut inside = self.inside();
        inside.clock += 1;
        let now = inside.clock;
        if let Some((used, values)) = inside.blocks.get_mut(&key) {
            *used = now;
            return Arc::clone(values);
        }
        // Read while others wait: they mostly want the same block.
        let values = match assemble(source, points, repeats, key) {
            Ok(values) => Arc::new(values),
            Err(reason) => {
                inside.failure.get_or_insert(reason);
                return Arc::new(Values { from: [0; 3], count: [1; 3], mps: Vec::new() });
            }
        };
        inside.make_room(size_of_values(&values));
        inside.bytes += size_of_values(&values);
        inside.blocks.insert(key, (now, Arc::clone(&values)));
        values
    }
}

impl Inside {
    fn make_room(&mut self, bytes: usize) {
        while self.bytes + bytes > MOST_BYTES {
            let oldest = self.blocks.iter().min_by_key(|(_, (used, _))| *used);
            let Some(key) = oldest.map(|(key, _)| *key) else { return };
            if let Some((_, values)) = self.blocks.remove(&key) {
                self.bytes -= size_of_values(&values);
            }
        }
    }
}

fn size_of_values(values: &Values) -> usize {
    values.mps.len() * size_of::<f32>()
}

/// Numbers of points of a block along one axis: one that repeats goes on with its first point.
struct Span {
    from: usize,
    inner: usize,
    wraps: bool,
}

impl Span {
    fn of(block: usize, count: usize, repeats: bool) -> Self {
        let from = block * EDGE;
        let to = (from + EDGE + 1).min(count);
        Self { from, inner: to.saturating_sub(from), wraps: repeats && from + EDGE >= count }
    }

    fn count(&self) -> usize {
        self.inner + usize::from(self.wraps)
    }
}

fn assemble(
    source: &dyn GridSource,
    points: &Points,
    repeats: bool,
    key: Key,
) -> Result<Values, String> {
    let [bz, by, bx] = key.place;
    let z = Span::of(bz, points.z.all_m().len(), false);
    let y = Span::of(by, points.y.count, repeats);
    let x = Span::of(bx, points.x.count, repeats);
    let count = [z.count(), y.count(), x.count()];
    if count.contains(&0) {
        return Err("a place outside of the grid was asked for: this is a bug".to_owned());
    }
    let mut values = vec![f32::NAN; count.iter().product()];
    let parts = |span: &Span| {
        let wrapped = span.wraps.then_some((0, 1, span.inner));
        [Some((span.from, span.inner, 0)), wrapped].into_iter().flatten()
    };
    for (from_y, count_y, to_y) in parts(&y) {
        for (from_x, count_x, to_x) in parts(&x) {
            let block =
                Block { from: [z.from, from_y, from_x], count: [z.inner, count_y, count_x] };
            let read = source.read(key.component, key.time, &block)?;
            if read.len() != block.len() {
                return Err(format!("{} values were read instead of {}", read.len(), block.len()));
            }
            for (row, line) in read.chunks_exact(count_x).enumerate() {
                let (k, j) = (row / count_y, row % count_y);
                let start = (k * count[1] + to_y + j) * count[2] + to_x;
                if let Some(place) = values.get_mut(start..start + count_x) {
                    place.copy_from_slice(line);
                }
            }
        }
    }
    Ok(Values { from: [z.from, y.from, x.from], count, mps: values })
}
