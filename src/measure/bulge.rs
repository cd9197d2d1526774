//! What lies between a flat piece and the smooth surface through its corners.
//!
//! A triangle of area A and normal N has its corners p_i on a surface whose unit normals n_i there
//! are known. Over the triangle the surface is the height h, zero at the corners, with the slopes
//! g_i = -t_i / (n_i · N) of t_i = n_i - (n_i · N) N. A quadratic h that has them is
//! -½ Σ k_ij λ_i λ_j with k_ij = (g_j - g_i) · (p_j - p_i), λ the barycentric coordinates, and so
//!
//! > volume: ∫ h dA = -A / 24 Σ k_ij.
//!
//! Terms of third order either leave that integral alone or change sign with the triangle's
//! orientation. Let n be the normals continued off the surface, where their divergence is 2 H. By
//! Gauss' theorem on what lies between piece and surface
//!
//! > area: ∫ n · N dA + 2 H ∫ h dA, n · N = 1 - ½ |t|², 2 H = div t,
//!
//! t taken as linear. No height is compared across an edge, where prisms over the two pieces
//! overlap or gape by as much as the whole correction of the area.
//!
//! Where the solid is cut flat by the box, the rim is curved, too. Between it and a piece's edge of
//! length L lies a [`sliver`] of the plane, L² (s_i - s_j) / 12 with the slopes s of the rim at
//! the ends: the cut has it more, and the flux n · P through it (P the plane's normal) goes off the
//! surface.
//!
//! Both quantities are then wrong by a part h⁴ of the spacing h on smooth surfaces.

use glam::DVec3;
use pulp::NullaryFnOnce;

/// Least cosine between a piece's normal and those at its corners on a smooth surface: beyond, there
/// is a crease, or the surface bends too much for the piece.
const SMOOTH: f64 = 0.75;

/// Least cosine at a crease that is told apart: a steeper one is a part thinner than the cell.
const LEAST_COSINE: f64 = 0.2;

/// Pieces that are looked at side by side, so that the loop becomes vector code.
pub(super) const LANES: usize = 16;

/// A number a piece.
type Numbers = [f64; LANES];

/// Volume and area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Bulge {
    pub(super) volume: f64,
    pub(super) area: f64,
}

impl Bulge {
    pub(super) fn add(&mut self, other: Self) {
        self.volume += other.volume;
        self.area += other.area;
    }
}

/// What the surface is like over a flat piece.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Over {
    /// Of the piece itself.
    pub(super) area: f64,
    /// Whether the surface is smooth there.
    pub(super) is_smooth: bool,
    /// What it has beyond the piece; nothing at a crease.
    pub(super) bulge: Bulge,
    /// What may be hidden: a surface that is quadratic has slopes at both ends of a side that add up
    /// to nothing; at a crease, what a piece cuts off a right-angled one.
    pub(super) doubt: Bulge,
    /// The mean over the corners of the sine of the angle between piece and surface.
    pub(super) sine: f64,
    /// The same of 1 / cosine - 1.
    pub(super) excess: f64,
}

impl Over {
    /// From a piece's corners and the unit normals there, of which those that are zero say nothing.
    ///
    /// Without branches, for loops over pieces.
    #[inline(always)]
    pub(super) fn new(corners: [DVec3; 3], normals: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let sides = [b - a, c - b, a - c];
        let double = sides[0].cross(c - a);
        let length = double.length();
        let area = 0.5 * length;
        let normal = double * if length > 0.0 { 1.0 / length } else { 0.0 };
        let squared = sides.map(DVec3::length_squared);
        let longest = squared[0].max(squared[1]).max(squared[2]).sqrt();

        let (mut is_smooth, mut sine, mut tangent, mut excess) = (area > 0.0, 0.0, 0.0, 0.0);
        let (mut tangents, mut slopes) = ([DVec3::ZERO; 3], [DVec3::ZERO; 3]);
        for i in 0..3 {
            let cosine = normals[i].dot(normal);
            is_smooth &= cosine >= SMOOTH;
            tangents[i] = normals[i] - cosine * normal;
            let says_nothing = normals[i].length_squared() == 0.0;
            let cosine = cosine.clamp(LEAST_COSINE, 1.0);
            let cosine = if says_nothing { 1.0 } else { cosine };
            let per = 1.0 / cosine;
            slopes[i] = tangents[i] * -per;
            let own = (1.0 - cosine * cosine).sqrt();
            sine += own / 3.0;
            tangent += own * per / 3.0;
            excess += (per - 1.0) / 3.0;
        }

        let (mut bend, mut miss, mut lean, mut divergence, mut squares) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            bend += (slopes[j] - slopes[i]).dot(sides[i]);
            let both = (slopes[j] + slopes[i]).dot(sides[i]).abs();
            miss += both;
            lean += both / squared[i].sqrt();
            // The gradient of the barycentric coordinate of corner k, times twice the area.
            divergence += tangents[k].dot(normal.cross(sides[i]));
            squares += tangents[i].length_squared() + tangents[i].dot(tangents[j]);
        }
        let curvature = divergence / length;
        let slope = (squares / 6.0).max(0.0);
        let volume = -area / 24.0 * bend;
        let missed = area / 24.0 * miss;
        let pick = |smooth: f64, creased: f64| if is_smooth { smooth } else { creased };
        Self {
            area,
            is_smooth,
            bulge: Bulge {
                volume: pick(volume, 0.0),
                area: pick(curvature * volume - 0.5 * area * slope, 0.0),
            },
            doubt: Bulge {
                volume: pick(missed, 0.25 * area * longest * tangent),
                area: pick(
                    curvature.abs() * missed + area * slope.sqrt() * lean / 3.0,
                    area * excess,
                ),
            },
            sine,
            excess,
        }
    }
}

/// Corners of pieces and unit normals there, each by corner, axis and lane.
pub(super) type Pieces = [[[Numbers; 3]; 3]; 2];

/// What the surface is like over pieces: the fields of [`Over`], lane by lane.
#[derive(Default)]
pub(super) struct Found {
    areas: Numbers,
    /// One or zero.
    smooth: Numbers,
    /// Volumes and areas.
    bulges: [Numbers; 2],
    doubts: [Numbers; 2],
    sines: Numbers,
    excesses: Numbers,
}

impl Found {
    /// What was found in a lane.
    pub(super) fn over(&self, lane: usize) -> Over {
        let bulge = |of: &[Numbers; 2]| Bulge { volume: of[0][lane], area: of[1][lane] };
        Over {
            area: self.areas[lane],
            is_smooth: self.smooth[lane] != 0.0,
            bulge: bulge(&self.bulges),
            doubt: bulge(&self.doubts),
            sine: self.sines[lane],
            excess: self.excesses[lane],
        }
    }
}

/// Looks at pieces side by side; a task for [`Arch::dispatch`](pulp::Arch::dispatch).
pub(super) struct Looking<'a> {
    pub(super) pieces: &'a Pieces,
    pub(super) found: &'a mut Found,
}

impl NullaryFnOnce for Looking<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { pieces: [corners, normals], found } = self;
        let point = |of: &[[Numbers; 3]; 3], lane: usize| {
            [0, 1, 2].map(|i| DVec3::new(of[i][0][lane], of[i][1][lane], of[i][2][lane]))
        };
        let Found { areas, smooth, bulges, doubts, sines, excesses } = found;
        let ([volumes, more], [volume_doubts, area_doubts]) = (bulges, doubts);
        for lane in 0..LANES {
            let over = Over::new(point(corners, lane), point(normals, lane));
            areas[lane] = over.area;
            smooth[lane] = if over.is_smooth { 1.0 } else { 0.0 };
            (volumes[lane], more[lane]) = (over.bulge.volume, over.bulge.area);
            (volume_doubts[lane], area_doubts[lane]) = (over.doubt.volume, over.doubt.area);
            (sines[lane], excesses[lane]) = (over.sine, over.excess);
        }
    }
}

/// What the side of a piece of unit normal `normal` leaves out of the outer plane that it lies in, of
/// unit normal `plane`, less what it has of the surface next to it; from the side's `ends` and the
/// unit normals there.
pub(super) fn sliver(normal: DVec3, ends: [DVec3; 2], normals: [DVec3; 2], plane: DVec3) -> f64 {
    let within = |v: DVec3| (v - v.dot(plane) * plane).normalize_or_zero();
    let side = ends[1] - ends[0];
    let (length, outward) = (side.length(), within(normal));
    let slope = |normal: DVec3| {
        let rim = within(normal);
        let cosine = rim.dot(outward);
        (cosine >= SMOOTH).then(|| -rim.dot(side) / (length * cosine))
    };
    let (Some(first), Some(last)) = (slope(normals[0]), slope(normals[1])) else { return 0.0 };
    let area = length * length * (first - last) / 12.0;
    let flux = (normals[0] + normals[1]).normalize_or_zero().dot(plane);
    area * (1.0 - flux)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three points of the unit sphere about a direction, `size` apart, which are their own normals.
    fn on_sphere(direction: DVec3, size: f64) -> [DVec3; 3] {
        let (u, v) = direction.any_orthonormal_pair();
        let corner = |[a, b]: [f64; 2]| (direction + size * (a * u + b * v)).normalize();
        [[0.6, -0.3], [0.1, 0.7], [-0.5, -0.4]].map(corner)
    }

    /// Solid angle of a piece, by Van Oosterom and Strackee 1983.
    fn angle([a, b, c]: [DVec3; 3]) -> f64 {
        let over = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
        2.0 * f64::atan2(a.dot(b.cross(c)), over)
    }

    #[test]
    fn what_lies_between_a_piece_and_a_sphere_is_found() {
        let direction = DVec3::new(0.3, -0.5, 0.7).normalize();
        let errors = [0.4, 0.2, 0.1].map(|size| {
            let [a, b, c] = on_sphere(direction, size);
            let over = Over::new([a, b, c], [a, b, c]);
            // A cone of the sphere, less the tetrahedron below the piece; and the sphere's triangle. What
            // prisms of pieces side by side leave out is nothing of the volume and all of the area.
            let volume = angle([a, b, c]) / 3.0 - a.dot(b.cross(c)) / 6.0;
            let area = angle([a, b, c]) - over.area;
            assert!(over.is_smooth && over.doubt.volume < 1e-12 * over.bulge.volume);
            assert!(over.doubt.area < 1e-12 * over.bulge.area);
            [over.bulge.volume / volume - 1.0, over.bulge.area / area - 1.0]
        });
        // Both are of second order in themselves, and so make up for the fourth.
        for quantity in 0..2 {
            let [first, second, third] = errors.map(|error| error[quantity].abs());
            assert!(third < 0.01 && second / first < 0.3 && third / second < 0.3, "{errors:?}");
        }
    }

    #[test]
    fn a_crease_is_told_from_a_bend() {
        let corners = on_sphere(DVec3::Z, 0.2);
        let [a, b, c] = corners;
        // A normal that is zero says nothing of a crease.
        for (other, share) in [(DVec3::X, 1.0..1.5), (DVec3::ZERO, 1e-4..0.02)] {
            let over = Over::new(corners, [a, b, other]);
            assert!(!over.is_smooth && over.bulge == Bulge::default());
            assert!(share.contains(&(over.doubt.area / over.area)), "{over:?}");
        }
        let normal = (b - a).cross(c - a).normalize();
        let Over { bulge, doubt, sine, excess, .. } = Over::new(corners, [normal; 3]);
        for nothing in [bulge.volume, bulge.area, doubt.volume, doubt.area, sine, excess] {
            assert!(nothing.abs() < 1e-7, "{nothing}");
        }
        // Without area there is no surface.
        assert!(!Over::new([a; 3], [a; 3]).is_smooth);
    }

    #[test]
    fn the_rim_of_a_cylinder_leaves_its_slivers() {
        // A wall along z that ends at z = 0: the whole circle of 24 sides has the area of the disc.
        let side = std::f64::consts::TAU / 24.0;
        let at = |angle: f64| DVec3::new(angle.cos(), angle.sin(), 0.0);
        let one = sliver(at(0.5 * side), [at(0.0), at(side)], [at(0.0), at(side)], DVec3::NEG_Z);
        let missing = 0.5 * (side - side.sin());
        assert!((one / missing - 1.0).abs() < 0.01, "{one} of {missing}");
        // The wall of a cone leans over: through the sliver it loses what its normals let through.
        let lean = |angle: f64| (at(angle) + DVec3::NEG_Z).normalize();
        let normals = [lean(0.0), lean(side)];
        let leaning = sliver(lean(0.5 * side), [at(0.0), at(side)], normals, DVec3::NEG_Z);
        assert!((leaning / one - (1.0 - 0.5_f64.sqrt())).abs() < 0.01, "{leaning} of {one}");
    }
}
