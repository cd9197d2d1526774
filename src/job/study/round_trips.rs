//! Round trips: write, read, contour, again and again.
//!
//! On one grid a mesh is a fixed point of a trip: a facet lies in one cell and meets the grid's edges in
//! its own corners alone, so the distance to the mesh has the same signs at the nodes and its roots on the
//! edges at the vertices. What moves is rounding.
//!
//! On other grids each trip cuts the mesh by planes that miss its vertices, and puts flat facets between the cuts: what is convex
//! loses, what is concave gains, a part of the spacing's square over the radius of the bend each time, and edges become rounder.
//! The grid of trip k is that of the first mesh grown by a cell and moved by a part of a cell along each
//! axis, the fractional parts of k times [`EVEN_STEPS`]: no two trips have the same, and the first few spread evenly.

use super::{Error, Numbers, Passage, diagonal};
use crate::contour::Grid;
use crate::geom::Aabb;
use crate::job::{self, Job, Report, Settings};
use crate::mesh::Mesh;
use crate::num::{EVEN_STEPS, Progress};
use glam::DVec3;

/// On which grids meshes are contoured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grids {
    /// All on that of the first.
    #[default]
    Same,
    /// Each on one of its own, moved by another part of a cell.
    Shifted,
}

/// A trip and the mesh at its end.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Trip {
    /// Its number; 0 is the mesh of the program itself.
    pub number: u32,
    /// The numbers of the mesh.
    #[serde(flatten)]
    pub numbers: Numbers,
    /// Farthest that a vertex is from where the first mesh has it, in spacings; `None` where the
    /// triangles are others than those of the first mesh.
    pub moved: Option<f64>,
    /// Whether the mesh is that of the trip before, to the bit.
    pub unchanged: bool,
}

/// What became of a solid.
#[derive(Clone, Debug, serde::Serialize)]
pub struct RoundTrips {
    /// Cells of the first grid along each axis.
    pub cells: [usize; 3],
    /// The box of the first grid, least corner then greatest, in model units.
    pub bounds: [[f64; 3]; 2],
    /// The length of the diagonal of the first grid, in model units.
    pub diagonal: f64,
    /// The trips in order, the mesh of the program first.
    pub trips: Vec<Trip>,
    /// The first trip from which on every mesh is the one before, to the bit.
    pub fixed_from: Option<u32>,
    /// What contouring the program did.
    #[serde(skip)]
    pub report: Report,
}

impl Job {
    /// Contours the solid, then `times` times writes the mesh by `passage`, reads it back and contours it.
    ///
    /// `progress` counts meshes.
    ///
    /// # Errors
    /// [`Error`] of the trip that failed.
    pub fn round_trips(
        &self,
        times: u32,
        grids: Grids,
        settings: &Settings,
        passage: &Passage,
        progress: &Progress,
    ) -> Result<RoundTrips, Error> {
        let grid = self.grid(settings)?;
        let bounds = grid.bounds();
        let spacing = settings.spacing.within(bounds);
        let reference = self.reference(&grid, settings)?;
        progress.expect(u64::from(times) + 1);
        let advance = || progress.advance(1).map_err(crate::contour::Error::from);
        let (first, report) = self.mesh_on(&grid, settings)?;
        let numbers = Numbers::new(&first, &reference)?;
        let mut trips = vec![Trip { number: 0, numbers, moved: Some(0.0), unchanged: false }];
        let mut last = first.clone();
        advance().map_err(job::Error::from)?;
        for number in 1..=times {
            let file = passage.write("trip", &last)?;
            let job = Job::new(&[file])?;
            let (mesh, _) = match grids {
                Grids::Same => job.mesh_on(&grid, settings)?,
                Grids::Shifted => job.mesh_on(&shifted(bounds, spacing, number)?, settings)?,
            };
            let unchanged = is_same(&mesh, &last);
            let numbers = match trips.last() {
                Some(before) if unchanged => before.numbers.clone(),
                Some(_) | None => Numbers::new(&mesh, &reference)?,
            };
            trips.push(Trip { number, numbers, moved: moved(&mesh, &first, spacing), unchanged });
            last = mesh;
            advance().map_err(job::Error::from)?;
        }
        let changing = trips.iter().rposition(|trip| !trip.unchanged).unwrap_or(0);
        let fixed_from = trips.get(changing + 1).map(|trip| trip.number);
        let (cells, bounds) = (report.cells, report.bounds);
        Ok(RoundTrips { cells, bounds, diagonal: diagonal(&grid), trips, fixed_from, report })
    }
}

/// The grid of trip `number` where each has one of its own.
fn shifted(bounds: Aabb, spacing: DVec3, number: u32) -> Result<Grid, job::Error> {
    let part = (f64::from(number) * DVec3::from_array(EVEN_STEPS)).fract();
    let Aabb { lo, hi } = bounds;
    let grown = Aabb::new(lo - part * spacing, hi + (DVec3::ONE - part) * spacing);
    Ok(Grid::new(grown, spacing)?)
}

/// Whether two meshes are the same to the bit.
fn is_same(a: &Mesh, b: &Mesh) -> bool {
    let bits =
        |mesh: &Mesh| mesh.positions.iter().flatten().map(|u| u.to_bits()).collect::<Vec<_>>();
    a.triangles == b.triangles && bits(a) == bits(b)
}

/// Farthest that a vertex of `mesh` is from where `first` has it, in spacings, if they have the same
/// triangles.
fn moved(mesh: &Mesh, first: &Mesh, spacing: DVec3) -> Option<f64> {
    let is_comparable =
        mesh.triangles == first.triangles && mesh.positions.len() == first.positions.len();
    is_comparable.then(|| {
        let way = |(a, b): (&[f64; 3], &[f64; 3])| {
            ((DVec3::from_array(*a) - DVec3::from_array(*b)) / spacing).length()
        };
        mesh.positions.iter().zip(&first.positions).map(way).fold(0.0, f64::max)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::io::{Format, Precision};

    fn trips(program: &str, times: u32, grids: Grids, precision: Precision) -> RoundTrips {
        let folder = tempfile::tempdir().unwrap();
        let passage = Passage { folder: folder.path().to_owned(), format: Format::Ply, precision };
        let (settings, progress) = (Settings::with_spacing(0.1), Progress::new());
        let job = Job::parse(program).unwrap();
        let found = job.round_trips(times, grids, &settings, &passage, &progress).unwrap();
        assert_eq!(progress.steps(), (u64::from(times) + 1, u64::from(times) + 1));
        assert!(found.trips.iter().all(|trip| trip.numbers.sound), "{found:?}");
        assert!(found.trips.iter().map(|trip| trip.number).eq(0..=times), "{found:?}");
        found
    }

    #[test]
    fn a_mesh_is_a_fixed_point_on_its_grid() {
        let found = trips("sphere box scale 0.9", 6, Grids::Same, Precision::Double);
        let [first, last] = [found.trips.first(), found.trips.last()].map(Option::unwrap);
        assert!(last.moved.unwrap() < 1e-10, "{last:?}");
        assert!((last.numbers.volume / first.numbers.volume - 1.0).abs() < 1e-12);
        assert_eq!(last.numbers.euler, 2);
        // Half of 1.8 from corner to corner.
        assert!((found.diagonal - 1.8 * 3.0_f64.sqrt()).abs() < 1e-12, "{}", found.diagonal);
    }

    #[test]
    fn a_box_is_fixed_to_the_bit_and_without_error() {
        let found = trips("box", 3, Grids::Same, Precision::Double);
        assert_eq!(found.fixed_from, Some(1));
        let numbers = &found.trips[3].numbers;
        assert_eq!(numbers.deviations.values.errors(), [0.0; 4]);
        assert!((numbers.volume - 8.0).abs() < 1e-11 && (numbers.area - 24.0).abs() < 1e-11);
    }

    #[test]
    fn files_of_single_precision_move_vertices_by_their_rounding() {
        let found = trips("sphere", 2, Grids::Same, Precision::Single);
        let moved = found.trips[1].moved.unwrap();
        assert!((1e-9..1e-5).contains(&moved), "{moved}");
    }

    #[test]
    fn on_other_grids_a_ball_shrinks_by_what_chords_cut_off() {
        let found = trips("sphere", 4, Grids::Shifted, Precision::Double);
        assert_eq!(found.fixed_from, None);
        for pair in found.trips.windows(2) {
            let [before, after] = [&pair[0].numbers, &pair[1].numbers];
            // A chord as long as a cell's diagonal is h^2 * 3 / 8r below; of the volume that is three times as much.
            let lost = 1.0 - after.volume / before.volume;
            assert!((1e-4..9.0 / 8.0 * 0.01).contains(&lost), "{lost}");
            assert!(pair[1].moved.is_none() && after.euler == 2, "{:?}", pair[1]);
        }
    }

    #[test]
    fn grids_of_trips_are_moved_by_parts_of_a_cell_and_hold_the_first() {
        let bounds = Aabb::new(DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.7, 3.0));
        let spacing = DVec3::new(0.1, 0.2, 0.3);
        for number in [1, 2, 77] {
            let grid = shifted(bounds, spacing, number).unwrap();
            assert_eq!(grid.cells(), [21, 5, 5], "one more than the first");
            let other = grid.bounds();
            assert!((bounds.lo - other.lo).cmpge(DVec3::ZERO).all());
            assert!((other.hi - bounds.hi).cmpge(DVec3::ZERO).all());
            assert!((other.size() - bounds.size() - spacing).abs().max_element() < 1e-12);
        }
    }
}
