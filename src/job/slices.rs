//! Planar cuts of a job's solid, from its field, without a mesh.

use super::{Error, Job, Report, Settings};
use crate::contour::Grid;
use crate::contour::outlines::{MOST_PLANES, outlines};
use crate::geom::Axis;
use crate::measure::slice::Slice;
use crate::num::Progress;

impl Job {
    /// The cuts of the solid across `axis` at `heights`, in their order, on the planes of `grid`
    /// (see [`Job::grid`]); the report is that of the last few.
    ///
    /// A height beyond the grid's box is moved to its border. Nothing depends on the number of
    /// threads, nor on which heights are asked for together.
    ///
    /// # Errors
    /// [`Error::Compile`], [`Error::Contour`] or [`Error::Density`]; there is no error for a plane without solid.
    pub fn slices(
        &self,
        grid: &Grid,
        axis: Axis,
        heights: &[f64],
        settings: &Settings,
        progress: &Progress,
    ) -> Result<(Vec<Slice>, Option<Report>), Error> {
        let (values, densities) = self.solved(grid, settings, progress)?;
        let line = grid.placed(axis);
        let (lo, hi) = (line[0], line[line.len() - 1]);
        let within = |height: f64| height.max(lo).min(hi);
        let mut order: Vec<usize> = (0..heights.len()).collect();
        order.sort_by(|a, b| heights[*a].total_cmp(&heights[*b]));
        let empty = |height: &f64| Slice { axis, at: within(*height), outlines: Vec::new() };
        let mut slices: Vec<Slice> = heights.iter().map(empty).collect();
        let mut last = None;
        for group in order.chunks(MOST_PLANES) {
            let chosen: Vec<f64> = group.iter().map(|i| slices[*i].at).collect();
            let planes = grid.planes(axis, &chosen);
            let field = self.field_on(&planes, values.clone());
            let (found, report) = field.evaluate(settings, |bound, chosen| {
                outlines(bound, &planes, axis, chosen, progress)
            })?;
            for (i, outlines) in group.iter().zip(found) {
                slices[*i].outlines = outlines;
            }
            last = Some(Report { densities: densities.clone(), ..report });
        }
        Ok((slices, last))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    type Sides = BTreeSet<[[u64; 2]; 2]>;

    fn bits(p: [f64; 2]) -> [u64; 2] {
        // Zeros of either sign are one place.
        p.map(|u| (u + 0.0).to_bits())
    }

    /// The sides of a slice, in no order.
    fn sides_of(slice: &Slice) -> Sides {
        let mut all = Sides::new();
        for ring in &slice.outlines {
            for (i, p) in ring.iter().enumerate() {
                let mut side = [bits(*p), bits(ring[(i + 1) % ring.len()])];
                side.sort_unstable();
                assert!(all.insert(side), "a side comes twice");
            }
        }
        all
    }

    #[test]
    fn a_slice_in_a_plane_of_nodes_is_the_cut_of_the_mesh() {
        for program in ["gyroid dilate 0.35 box", "torus", "d-surface shell 0.5 sphere"] {
            let job = Job::parse(program).unwrap();
            let settings = Settings::with_spacing(0.0613);
            let mesh = job.mesh(&settings).unwrap();
            let grid = job.grid(&settings).unwrap();
            for axis in Axis::ALL {
                let (line, cells) = (grid.placed(axis), grid.cells()[axis.index()]);
                // Node i is at position i + 1.
                let nodes = [1, 3, 5].map(|part| line[1 + cells * part / 6]);
                let (slices, _) =
                    job.slices(&grid, axis, &nodes, &settings, &Progress::new()).unwrap();
                for slice in slices {
                    let a = axis.index();
                    let across = [0, 1, 2].into_iter().filter(|b| *b != a).collect::<Vec<_>>();
                    let mut cut = Sides::new();
                    for triangle in &mesh.triangles {
                        for k in 0..3 {
                            let ends = [triangle[k], triangle[(k + 1) % 3]]
                                .map(|v| mesh.positions[v as usize]);
                            if ends.iter().all(|p| p[a] == slice.at) {
                                let mut side = ends.map(|p| bits([p[across[0]], p[across[1]]]));
                                side.sort_unstable();
                                cut.insert(side);
                            }
                        }
                    }
                    assert!(!cut.is_empty());
                    assert_eq!(sides_of(&slice), cut, "{program} {axis:?} {}", slice.at);
                }
            }
        }
    }

    #[test]
    fn slices_add_up_to_the_volume_and_depend_on_nothing_else() {
        let job = Job::parse("gyroid dilate 0.35 box").unwrap();
        let settings = Settings::with_spacing(0.04);
        let grid = job.grid(&settings).unwrap();
        let heights: Vec<f64> = (0..50).map(|k| -0.98 + 0.04 * f64::from(k)).collect();
        let cut = |heights: &[f64]| {
            job.slices(&grid, Axis::Z, heights, &settings, &Progress::new()).unwrap().0
        };
        let all = cut(&heights);
        let volume: f64 = all.iter().map(|slice| 0.04 * slice.area()).sum();
        // The fraction below 0.35 is 0.612925 (tests/convergence.rs); a spacing of 1/25 of a cell is good
        // for some parts in a thousand.
        assert!((volume / (8.0 * 0.612_925) - 1.0).abs() < 2e-3, "{volume}");
        // One at a time, in another order, on one thread: the same.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        pool.install(|| {
            let turned: Vec<f64> = heights.iter().rev().copied().collect();
            let turned = cut(&turned);
            assert!(turned.iter().rev().eq(&all));
            assert_eq!(cut(&heights[3..4]), all[3..4]);
        });
    }

    #[test]
    fn planes_beyond_the_box_are_moved_to_it_and_empty_ones_are_empty() {
        let job = Job::parse("sphere box scale 1.5").unwrap();
        let settings = Settings::with_spacing(0.1);
        let grid = job.grid(&settings).unwrap();
        let cut = |at| {
            let found = job.slices(&grid, Axis::X, &[at], &settings, &Progress::new());
            found.unwrap().0.remove(0)
        };
        // Sampled a little further in, as the mesh is, where there is a speck.
        let top = cut(5.0);
        assert!(top.at == 1.0 && top.area() < 1e-5, "{top:?}");
        let circle = cut(0.6).area();
        assert!((circle / (std::f64::consts::PI * 0.64) - 1.0).abs() < 0.01, "{circle}");
    }
}
