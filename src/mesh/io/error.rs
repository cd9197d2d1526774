//! What can be wrong with a mesh file.

use super::{Format, Refused};
use crate::num::Cancelled;
use crate::num::memory::Shortage;
use std::fmt;
use std::io;

/// Why a file gives no mesh: where, what and how to cure it.
#[derive(Debug, thiserror::Error)]
#[error("{}", self.describe())]
pub struct ReadError {
    /// The name of the file.
    pub file: String,
    /// Where the reader stopped, if at one place.
    pub place: Option<Place>,
    /// What is wrong.
    pub fault: Fault,
}

impl ReadError {
    fn describe(&self) -> String {
        let place = self.place.map_or_else(String::new, |place| format!(", {place}"));
        format!("{}{place}: {}", self.file, self.cause_and_cure())
    }

    /// Place, cause and cure, for messages that name the file themselves.
    #[must_use]
    pub fn without_file(&self) -> String {
        // Those messages begin with the words that it can't be read.
        if let Fault::Unreadable(error) = &self.fault {
            return error.to_string();
        }
        let place = self.place.map_or_else(String::new, |place| format!("{place}: "));
        format!("{place}{}", self.cause_and_cure())
    }

    fn cause_and_cure(&self) -> String {
        let cure = self.fault.cure().map_or_else(String::new, |cure| format!("; {cure}"));
        format!("{}{cure}", self.fault)
    }
}

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of text, the first being 1.
    Line(u64),
    /// A word in a line of text.
    Word {
        /// The line, the first being 1.
        line: u64,
        /// Where the word begins, in letters, the first being 1.
        column: u64,
    },
    /// An offset in bytes from the start of a binary file.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(number) => write!(f, "line {number}"),
            Self::Word { line, column } => write!(f, "line {line}, column {column}"),
            Self::Byte(offset) => write!(f, "byte {offset}"),
        }
    }
}

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// The file can't be opened or read.
    #[error("can't be read: {0}")]
    Unreadable(#[from] io::Error),
    /// The format is known and not supported.
    #[error("{} files are not read", .0.name())]
    Refused(Refused),
    /// Neither content nor extension tell a mesh format.
    #[error("is not a mesh in a known format")]
    Unknown,
    /// The content is not what the extension says, nor another known format.
    #[error("is not {} inside", .0.name())]
    Not(Format),
    /// There is nothing in it.
    #[error("the file is empty")]
    Empty,
    /// The text takes two or four bytes a letter.
    #[error("is text in UTF-16 or UTF-32")]
    Wide,
    /// More items are announced than the rest of the file can hold.
    #[error("{count} {what} are announced, more than the rest of the file can hold")]
    Overstated {
        /// How many the file says there are.
        count: u64,
        /// What they are.
        what: String,
    },
    /// The file does not fit into memory.
    #[error(transparent)]
    Memory(#[from] Shortage),
    /// Something else stands where the format wants something.
    #[error("expected {expected}, found `{found}`")]
    Syntax {
        /// What the format wants.
        expected: &'static str,
        /// The beginning of what is there.
        found: String,
    },
    /// The file ends before its content does.
    #[error("the file ends before {before}")]
    Truncated {
        /// What should still come.
        before: &'static str,
    },
    /// There are no faces: a point cloud, lines, or nothing.
    #[error("there are no faces, only {vertices} vertices")]
    NoFaces {
        /// How many vertices there are.
        vertices: u64,
    },
    /// A face names a vertex that does not exist.
    #[error("a face has vertex {index}, but there are {vertices} vertices")]
    IndexOutOfRange {
        /// The index as the file has it.
        index: i64,
        /// How many vertices there are.
        vertices: u64,
    },
    /// A coordinate is infinite or no number.
    #[error("a vertex has a coordinate that is not finite")]
    NotFinite,
    /// The model requires what is not read.
    #[error("the model requires the extension `{name}`, which is not read")]
    Extension {
        /// The namespace of the extension, or its prefix.
        name: String,
    },
    /// A fault in one of the files that an archive consists of.
    #[error("{fault} (in the part `{part}`)")]
    Part {
        /// The name of the part.
        part: String,
        /// What is wrong with it.
        fault: Box<Fault>,
    },
    /// A count exceeds what the program holds.
    #[error("too large: {what}")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
    },
    /// The caller cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Fault {
    /// What the user can do about it.
    #[must_use]
    pub fn cure(&self) -> Option<&'static str> {
        match self {
            Self::Unreadable(_) | Self::Cancelled(_) => None,
            Self::Part { fault, .. } => fault.cure(),
            Self::Extension { .. } => Some("export it as plain meshes, without that extension"),
            Self::Refused(_) => Some("export it as PLY, STL, 3MF, OBJ or OFF"),
            Self::Unknown | Self::Not(_) => Some("give a PLY, STL, 3MF, OBJ or OFF file"),
            Self::Syntax { .. } | Self::IndexOutOfRange { .. } | Self::NotFinite => {
                Some("export it again, or repair it there")
            }
            Self::Truncated { .. } | Self::Empty | Self::Overstated { .. } => {
                Some("copy or export it again, in full")
            }
            Self::Wide => Some("save it as UTF-8 or ASCII"),
            Self::NoFaces { .. } => Some("give a surface mesh"),
            Self::TooLarge { .. } | Self::Memory(_) => Some("simplify the mesh"),
        }
    }

    /// The fault in line `number`.
    pub(super) const fn at_line(self, number: u64) -> Flaw {
        Flaw { place: Some(Place::Line(number)), fault: self }
    }

    /// The fault at an offset in bytes.
    pub(super) const fn at_byte(self, offset: usize) -> Flaw {
        Flaw { place: Some(Place::Byte(offset as u64)), fault: self }
    }
}

/// A fault whose file is not named yet.
#[derive(Debug)]
pub(super) struct Flaw {
    pub(super) place: Option<Place>,
    pub(super) fault: Fault,
}

impl<F: Into<Fault>> From<F> for Flaw {
    fn from(fault: F) -> Self {
        Self { place: None, fault: fault.into() }
    }
}

impl Flaw {
    pub(super) fn in_file(self, file: &str) -> ReadError {
        ReadError { file: file.to_owned(), place: self.place, fault: self.fault }
    }
}
