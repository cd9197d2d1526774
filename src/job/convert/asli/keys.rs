//! The keys of ASLI's configurations.
//!
//! Source: ASLI, `src/ASLI.cpp` and `config.yml` at the states of 2022, 2023 and 2024, and the keys that
//! `QASLI` writes.

use super::super::fits::Release;
use super::super::yaml::Entry;

/// What a key is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// It says something of the solid.
    Solid,
    /// It says how to mesh, or where to write.
    Meshing,
}

/// A key.
#[derive(Clone, Copy, Debug)]
pub(super) struct Key {
    name: &'static str,
    pub(super) role: Role,
    /// The ASLI that alone has it.
    pub(super) release: Option<Release>,
}

/// The keys below `files`; those for results are told apart by their name.
const FILES: [&str; 6] = ["stl", "internalGeometry", "tap", "sap", "fap", "output"];
const SOLID: [&str; 8] = [
    "lt_type",
    "lt_type_filterRadius",
    "lt_type_correctionFactor",
    "lt_size",
    "lt_feature",
    "lt_feature_val",
    "lt_feature_mode",
    "files",
];
const MESHING: [&str; 10] = [
    "me_mesher",
    "me_volumeMesh",
    "me_nThreads",
    "udf_userDefinedFeature",
    "udf_A",
    "udf_B",
    "udf_C",
    "udf_D",
    "udf_E",
    "output",
];
const OLD_MESHING: [&str; 21] = [
    "me_STLFormat",
    "me_facetAngle",
    "me_facetSize",
    "me_facetDistance",
    "me_cellRadiusEdgeRatio",
    "me_cellSize",
    "me_preserveEdges",
    "me_edgesProtectionAngle",
    "me_poissonOffset",
    "me_hvol",
    "me_hinitial",
    "me_hmin",
    "me_hmax",
    "me_hausd",
    "me_hgrad",
    "mp_materialModel",
    "mp_solid",
    "mp_C",
    "mp_n",
    "mp_C1",
    "mp_n1",
];
const NEW_MESHING: [&str; 23] = [
    "udf_feature",
    "me_elementSize",
    "me_elementSizeSolid",
    "me_edgeProtectionAngle",
    "me_threshold",
    "STLFormat",
    "CGAL_facetDistance",
    "CGAL_relativeErrorBound",
    "CGAL_facetAngle",
    "CGAL_cellRadiusEdgeRatio",
    "CGAL_facetSize",
    "CGAL_edgeSize",
    "CGAL_minEdgeSize",
    "CGAL_poissonOffset",
    "CGAL_hinitial",
    "CGAL_hausd",
    "MMG_hausd",
    "MMG_hgrad",
    "MMG_hinitial",
    "MMG_memory",
    "MMG_exportLS",
    "MMG_facetDistance",
    "verbosity",
];

/// Every key, those below `files` among them.
pub(super) fn all() -> impl Iterator<Item = &'static str> {
    keys().map(|key| key.name).chain(FILES)
}

/// What is known of the key of `entry`.
pub(super) fn of(entry: &Entry) -> Option<Key> {
    match entry.above.as_deref() {
        None => keys().find(|key| key.name == entry.key),
        Some("files") => FILES.into_iter().find(|name| *name == entry.key).map(|name| Key {
            name,
            role: Role::Solid,
            release: of_file(name),
        }),
        Some(_) => None,
    }
}

fn of_file(name: &str) -> Option<Release> {
    (name == "internalGeometry").then_some(Release::New)
}

fn keys() -> impl Iterator<Item = Key> {
    let of = |role: Role, release: Option<Release>| move |name| Key { name, role, release };
    (SOLID.into_iter().map(of(Role::Solid, None)))
        .chain(["me_side"].map(of(Role::Solid, Some(Release::Old))))
        .chain(["lt_type_side"].map(of(Role::Solid, Some(Release::New))))
        .chain(MESHING.map(of(Role::Meshing, None)))
        .chain(OLD_MESHING.map(of(Role::Meshing, Some(Release::Old))))
        .chain(NEW_MESHING.map(of(Role::Meshing, Some(Release::New))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_is_listed_twice() {
        let mut names: Vec<_> = keys().map(|key| key.name).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
