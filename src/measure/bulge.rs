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

/// Least cosine between a piece's normal and those at its corners on a smooth surface: beyond, there
/// is a crease, or the surface bends too much for the piece.
const SMOOTH: f64 = 0.75;

/// Least cosine at a crease that is told apart: a steeper one is a part thinner than the cell.
const LEAST_COSINE: f64 = 0.2;

/// A flat piece of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) corners: [DVec3; 3],
    pub(super) normal: DVec3,
    pub(super) area: f64,
}

impl Piece {
    pub(super) fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let double = (b - a).cross(c - a);
        Self { corners, normal: double.normalize_or_zero(), area: 0.5 * double.length() }
    }
}

/// Volume and area beyond a flat piece.
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

/// What a crease under a piece may hide.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crease {
    pub(super) hides: Bulge,
    /// The mean over the corners of the sine of the angle between piece and surface.
    pub(super) sine: f64,
    /// The same of 1 / cosine - 1.
    pub(super) excess: f64,
}

impl Crease {
    /// By the unit `normals` at the corners; a corner whose normal is zero says nothing.
    pub(super) fn new(piece: &Piece, normals: [DVec3; 3]) -> Self {
        let Piece { corners: [a, b, c], normal, area } = *piece;
        let side = (b - a).length().max((c - b).length()).max((a - c).length());
        let (mut tangent, mut excess, mut sine) = (0.0, 0.0, 0.0);
        for own in normals {
            let cosine = if own == DVec3::ZERO { 1.0 } else { normal.dot(own) };
            let cosine = cosine.clamp(LEAST_COSINE, 1.0);
            let own_sine = (1.0 - cosine * cosine).sqrt();
            sine += own_sine / 3.0;
            tangent += own_sine / cosine / 3.0;
            excess += (1.0 / cosine - 1.0) / 3.0;
        }
        let hides = Bulge { volume: 0.25 * area * side * tangent, area: area * excess };
        Self { hides, sine, excess }
    }
}

/// What the surface has beyond `piece`, if it is smooth there, from its unit `normals` at the corners;
/// and how much of that is in doubt: a surface that is quadratic has slopes at both ends of a side
/// that add up to nothing.
pub(super) fn bulge(piece: &Piece, normals: [DVec3; 3]) -> Option<(Bulge, Bulge)> {
    let Piece { corners, normal, area } = *piece;
    let cosines = normals.map(|n| n.dot(normal));
    if cosines.iter().any(|cosine| *cosine < SMOOTH) {
        return None;
    }
    let tangents = [0, 1, 2].map(|i| normals[i] - cosines[i] * normal);
    let slopes = [0, 1, 2].map(|i| -tangents[i] / cosines[i]);
    let (mut bend, mut miss, mut lean, mut divergence) = (0.0, 0.0, 0.0, 0.0);
    let mut squares = 0.0;
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let side = corners[j] - corners[i];
        bend += (slopes[j] - slopes[i]).dot(side);
        let both = (slopes[j] + slopes[i]).dot(side).abs();
        miss += both;
        lean += both / side.length();
        // The gradient of the barycentric coordinate of corner k, times twice the area.
        divergence += tangents[k].dot(normal.cross(side));
        squares += tangents[i].length_squared() + tangents[i].dot(tangents[j]);
    }
    let curvature = divergence / (2.0 * area);
    let volume = -area / 24.0 * bend;
    let doubt = area / 24.0 * miss;
    let slope = (squares / 6.0).max(0.0);
    Some((
        Bulge { volume, area: curvature * volume - 0.5 * area * slope },
        Bulge { volume: doubt, area: curvature.abs() * doubt + area * slope.sqrt() * lean / 3.0 },
    ))
}

/// What the edge of `piece` from corner `i` to `j` leaves out of the outer plane of normal `plane`
/// that it lies in, and of the surface next to it.
pub(super) fn sliver(piece: &Piece, normals: [DVec3; 3], [i, j]: [usize; 2], plane: DVec3) -> f64 {
    let within = |v: DVec3| v - v.dot(plane) * plane;
    let side = piece.corners[j] - piece.corners[i];
    let (length, outward) = (side.length(), within(piece.normal).normalize_or_zero());
    let slope = |v: usize| {
        let rim = within(normals[v]).normalize_or_zero();
        let cosine = rim.dot(outward);
        (cosine >= SMOOTH).then(|| -rim.dot(side) / (length * cosine))
    };
    let (Some(first), Some(last)) = (slope(i), slope(j)) else { return 0.0 };
    let area = length * length * (first - last) / 12.0;
    let flux = (normals[i] + normals[j]).normalize_or_zero().dot(plane);
    area * (1.0 - flux)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The piece between three points of the unit sphere about a direction, `size` apart.
    fn on_sphere(direction: DVec3, size: f64) -> Piece {
        let (u, v) = direction.any_orthonormal_pair();
        let corner = |[a, b]: [f64; 2]| (direction + size * (a * u + b * v)).normalize();
        Piece::new([[0.6, -0.3], [0.1, 0.7], [-0.5, -0.4]].map(corner))
    }

    /// Solid angle of a piece, by Van Oosterom and Strackee 1983.
    fn angle([a, b, c]: [DVec3; 3]) -> f64 {
        let over = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
        2.0 * f64::atan2(a.dot(b.cross(c)), over)
    }

    #[test]
    fn what_lies_between_a_piece_and_a_sphere_is_found_to_fourth_order() {
        let direction = DVec3::new(0.3, -0.5, 0.7).normalize();
        let errors = [0.4, 0.2, 0.1].map(|size| {
            let piece = on_sphere(direction, size);
            let [a, b, c] = piece.corners;
            let (found, doubt) = bulge(&piece, piece.corners).unwrap();
            // A cone of the sphere, less the tetrahedron below the piece.
            let volume = angle(piece.corners) / 3.0 - a.dot(b.cross(c)) / 6.0;
            assert!(doubt.volume < 1e-3 * found.volume && doubt.area < 1e-2 * found.area);
            // Those of pieces side by side: prisms leave out what is between them.
            (found.volume / volume - 1.0).abs()
        });
        assert!(errors[2] < 2.5e-3, "{errors:?}");
    }

    #[test]
    fn a_crease_is_told_from_a_bend() {
        let piece = on_sphere(DVec3::Z, 0.2);
        let [a, b, _] = piece.corners;
        assert!(bulge(&piece, [a, b, DVec3::X]).is_none());
        assert!(bulge(&piece, [a, b, DVec3::ZERO]).is_none());
        let Crease { hides, sine, excess } = Crease::new(&piece, [piece.normal; 3]);
        assert_eq!((hides, sine, excess), (Bulge::default(), 0.0, 0.0));
    }
}
