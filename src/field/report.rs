//! What was made of a mesh, for people to read.

use super::surface::Repairs;
use serde::Serialize;
use std::fmt;

/// How the inside is told from the outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SignMethod {
    /// By the normal at the closest point: exact for clean meshes.
    Pseudonormals,
    /// By how often the surface encloses the point: more than one half is inside.
    WindingNumbers,
}

/// Why the method was chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "is", rename_all = "snake_case")]
pub enum Reason {
    /// The surface is closed and oriented, and both methods agree.
    Clean {
        /// Points at which they were compared.
        points: usize,
    },
    /// Two faces run along an edge in the same sense, and turning faces over does not help.
    OneSided {
        /// Number of such edges.
        edges: usize,
    },
    /// More than two faces meet at an edge.
    Crowded {
        /// Number of such edges.
        edges: usize,
    },
    /// Edges with a face on one side only.
    Open {
        /// Number of such edges.
        edges: usize,
    },
    /// The surface is closed and oriented but the methods disagree, as where bodies overlap.
    Contradiction {
        /// Points at which they disagree.
        wrong: usize,
        /// Points at which they were compared.
        points: usize,
    },
}

/// What was made of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Report {
    /// How the inside is told from the outside.
    pub method: SignMethod,
    /// Why.
    pub reason: Reason,
    /// Faces in use.
    pub faces: usize,
    /// What was mended.
    pub repairs: Repairs,
}

impl fmt::Display for SignMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pseudonormals => "pseudonormals",
            Self::WindingNumbers => "winding numbers",
        })
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Clean { points } => write!(f, "closed and oriented, checked at {points} points"),
            Self::OneSided { edges } => write!(f, "{edges} edges of faces that can't be oriented"),
            Self::Crowded { edges } => write!(f, "{edges} edges with more than two faces"),
            Self::Open { edges } => write!(f, "{edges} open edges"),
            Self::Contradiction { wrong, points } => {
                write!(f, "contradictions at {wrong} of {points} points: bodies may overlap")
            }
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { method, reason, faces, repairs } = self;
        let Repairs { degenerate_faces, repeated_faces, turned_faces, inverted } = repairs;
        write!(f, "{faces} faces, sides told by {method} ({reason})")?;
        for (count, what) in [
            (degenerate_faces, "degenerate faces left out"),
            (repeated_faces, "repeated faces left out"),
            (turned_faces, "faces turned over"),
        ] {
            if *count > 0 {
                write!(f, ", {count} {what}")?;
            }
        }
        if *inverted { f.write_str(", turned inside out") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_read_as_sentences() {
        let repairs = Repairs { repeated_faces: 2, inverted: true, ..Repairs::default() };
        let reason = Reason::Open { edges: 3 };
        let report = Report { method: SignMethod::WindingNumbers, reason, faces: 9, repairs };
        assert_eq!(
            report.to_string(),
            "9 faces, sides told by winding numbers (3 open edges), 2 repeated faces left out, \
             turned inside out"
        );
    }
}
