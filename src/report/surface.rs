//! The vertical air speed as a surface over the places of the drones: linear on the triangles of a
//! Delaunay triangulation, nothing outside of their hull.

use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation as _};

/// Places are rounded to this before they are triangulated: where surveyed homes are a few
/// centimetres off a straight edge of the grid, no slivers grow along it, m.
const ROUNDED_M: f64 = 0.25;
/// How far outside of a triangle a point may lie by rounding, as a share of the triangle.
const SLACK: f64 = 1e-6;

/// Triangles between drones.
pub(super) struct Surface {
    places: Vec<Option<[f64; 2]>>,
    triangles: Vec<[usize; 3]>,
}

/// A corner that remembers whose it is.
struct Corner {
    at: Point2<f64>,
    drone: usize,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

impl Surface {
    /// Triangulates places, [forward, left] in m; drones at `None` are no corners.
    pub(super) fn over(places: Vec<Option<[f64; 2]>>) -> Self {
        let round = |v: f64| (v / ROUNDED_M).round() * ROUNDED_M;
        let mut triangulation = DelaunayTriangulation::<Corner>::new();
        for (drone, place) in places.iter().enumerate() {
            let Some([forward, left]) = place else { continue };
            let at = Point2::new(round(*forward), round(*left));
            // A place that cannot be triangulated is no corner; the drone is still drawn.
            let _ = triangulation.insert(Corner { at, drone });
        }
        let mut triangles: Vec<[usize; 3]> = triangulation
            .inner_faces()
            .map(|face| face.vertices().map(|vertex| vertex.data().drone))
            .collect();
        triangles.sort_unstable();
        Self { places, triangles }
    }

    /// The triangles, as indices of drones.
    pub(super) fn triangles(&self) -> &[[usize; 3]] {
        &self.triangles
    }

    /// Values on a raster of `columns` by `rows` points from the upper left (forward and left) to
    /// the lower right of a rectangle `[forward high, forward low], [left high, left low]`; `None`
    /// outside of the hull and where a corner has no value.
    pub(super) fn raster(
        &self,
        value: impl Fn(usize) -> Option<f64>,
        (columns, rows): (usize, usize),
        (forward, left): ([f64; 2], [f64; 2]),
    ) -> Vec<Option<f64>> {
        let mut raster = vec![None; columns * rows];
        let step = |[from, to]: [f64; 2], n: usize| (to - from) / n.max(1) as f64;
        let (down, across) = (step(forward, rows), step(left, columns));
        // Pixels whose middles may lie between two coordinates.
        let range = |start: f64, step: f64, n: usize, values: [f64; 3]| {
            let place = |v: f64| (v - start) / step - 0.5;
            let [a, b, c] = values.map(place);
            let low = (a.min(b).min(c) - 0.01).ceil().max(0.0);
            let high = (a.max(b).max(c) + 0.01).floor().min(n as f64 - 1.0);
            (low as usize)..(if high < low { low as usize } else { high as usize + 1 })
        };
        for triangle in &self.triangles {
            let [Some(a), Some(b), Some(c)] =
                triangle.map(|drone| self.places.get(drone).copied().flatten())
            else {
                continue;
            };
            let [Some(va), Some(vb), Some(vc)] = triangle.map(&value) else { continue };
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
            if area == 0.0 {
                continue;
            }
            for row in range(forward[0], down, rows, [a[0], b[0], c[0]]) {
                let x = forward[0] + (row as f64 + 0.5) * down - a[0];
                for column in range(left[0], across, columns, [a[1], b[1], c[1]]) {
                    let y = left[0] + (column as f64 + 0.5) * across - a[1];
                    let s = (x * (c[1] - a[1]) - (c[0] - a[0]) * y) / area;
                    let t = ((b[0] - a[0]) * y - x * (b[1] - a[1])) / area;
                    if s >= -SLACK
                        && t >= -SLACK
                        && s + t <= 1.0 + SLACK
                        && let Some(pixel) = raster.get_mut(row * columns + column)
                    {
                        *pixel = Some(va + s * (vb - va) + t * (vc - va));
                    }
                }
            }
        }
        raster
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: usize) -> Vec<Option<[f64; 2]>> {
        (0..n * n).map(|i| Some([(i / n) as f64 * 7.0, (i % n) as f64 * 7.0])).collect()
    }

    #[test]
    fn a_plane_is_met_exactly_and_nothing_is_beyond_the_hull() {
        let places = grid(4);
        let surface = Surface::over(places.clone());
        assert_eq!(surface.triangles().len(), 18);
        let plane = |[x, y]: [f64; 2]| 0.3 * x - 0.1 * y + 1.0;
        let value = |drone: usize| places[drone].map(plane);
        let raster = surface.raster(value, (30, 20), ([28.0, -7.0], [24.5, -3.5]));
        for (index, found) in raster.iter().enumerate() {
            let x = 28.0 - 35.0 * ((index / 30) as f64 + 0.5) / 20.0;
            let y = 24.5 - 28.0 * ((index % 30) as f64 + 0.5) / 30.0;
            let inside = (0.0..=21.0).contains(&x) && (0.0..=21.0).contains(&y);
            assert_eq!(found.is_some(), inside, "{x} {y}");
            if let Some(found) = found {
                assert!((found - plane([x, y])).abs() < 1e-9, "{x} {y}: {found}");
            }
        }
    }

    #[test]
    fn a_corner_without_a_value_takes_its_triangles_away() {
        let mut places = grid(3);
        let whole = ([14.0, 0.0], [14.0, 0.0]);
        let surface = Surface::over(places.clone());
        let gap = surface.raster(|drone| (drone != 4).then_some(1.0), (9, 9), whole);
        assert!(gap[40].is_none(), "the middle drone is silent");
        places[4] = None;
        let bridged = Surface::over(places).raster(|_| Some(1.0), (9, 9), whole);
        assert_eq!(bridged[40], Some(1.0), "a drone that is no corner is bridged");
    }

    #[test]
    fn too_few_or_in_a_row_is_no_surface() {
        for places in
            [vec![], vec![Some([0.0, 0.0])], (0..5).map(|i| Some([0.0, f64::from(i)])).collect()]
        {
            assert!(Surface::over(places).triangles().is_empty());
        }
        let nonsense = vec![Some([f64::NAN, 0.0]), Some([1e300, 0.0]), Some([0.0, f64::INFINITY])];
        assert!(Surface::over(nonsense).triangles().is_empty());
    }
}
