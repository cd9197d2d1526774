//! The mesh formats by name: what is read and written, and what is only recognised.

use std::path::Path;

/// A format that is read and written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Wavefront OBJ, text.
    Obj,
    /// Object File Format of Geomview, text.
    Off,
    /// Stanford polygon format; text and binary are read, binary is written.
    Ply,
    /// Stereolithography triangles; text and binary are read, binary is written.
    Stl,
    /// 3D Manufacturing Format: XML in a ZIP archive.
    ThreeMf,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 5] = [Self::Obj, Self::Off, Self::Ply, Self::Stl, Self::ThreeMf];

    /// The name people know it by.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Obj => "OBJ",
            Self::Off => "OFF",
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::ThreeMf => "3MF",
        }
    }

    /// The format that the extension of `path` names, whatever its case.
    #[must_use]
    pub fn from_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        Self::ALL.into_iter().find(|format| extension.eq_ignore_ascii_case(format.name()))
    }
}

/// A format that is recognised and refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refused {
    /// VTK unstructured grid: XML.
    Vtu,
    /// glTF in its binary container.
    Glb,
    /// The binary variant of [`Format::Off`].
    BinaryOff,
}

impl Refused {
    /// The name people know it by.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Vtu => "VTU",
            Self::Glb => "GLB",
            Self::BinaryOff => "binary OFF",
        }
    }

    /// The format that the extension of `path` names, whatever its case.
    #[must_use]
    pub fn from_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        [Self::Vtu, Self::Glb]
            .into_iter()
            .find(|format| extension.eq_ignore_ascii_case(format.name()))
    }
}

/// Whether the extension of `path` names a mesh format, a refused one included.
#[must_use]
pub fn is_mesh_path(path: &Path) -> bool {
    Format::from_path(path).is_some() || Refused::from_path(path).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_are_compared_without_case() {
        assert_eq!(Format::from_path(Path::new("a/b.PlY")), Some(Format::Ply));
        assert_eq!(Format::from_path(Path::new("x.y.STL")), Some(Format::Stl));
        assert_eq!(Format::from_path(Path::new("obj")), None);
        assert_eq!(Format::from_path(Path::new("x.3MF")), Some(Format::ThreeMf));
        assert_eq!(Refused::from_path(Path::new("x.VTU")), Some(Refused::Vtu));
        assert!(is_mesh_path(Path::new("part.Off")) && is_mesh_path(Path::new("part.vtu")));
        assert!(!is_mesh_path(Path::new("part.txt")) && !is_mesh_path(Path::new("2.5")));
    }
}
