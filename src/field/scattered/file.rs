//! Files of points: a line `x,y,z,value` for each, without a header.
//!
//! The value is a number, or the name of a type. Blank lines don't count. A point that is given
//! twice with the same value counts once. No text makes a reader panic, and none takes more than the
//! time and memory that [`MOST`] points need.
//!
//! Source: ASLI's `.tap`, `.sap` and `.fap` files (types, sizes and features at points).

use super::Data;
use crate::text::{Place, shortened};
use rustc_hash::FxHashMap;

/// The longest file that is read, in bytes.
pub const LONGEST: usize = 4 << 20;
/// The most points: interpolation takes time as their cube.
pub const MOST: usize = 8192;
/// The most types.
pub const MOST_TYPES: usize = 16;

/// Types at points.
#[derive(Clone, Debug, PartialEq)]
pub struct Types {
    /// The points, all different, finite.
    pub at: Vec<[f64; 3]>,
    /// The place in `names` of the type of each.
    pub types: Vec<usize>,
    /// The types, in the order of the file.
    pub names: Vec<String>,
}

/// Which numbers make sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// All that are finite.
    Any,
    /// Those above zero.
    Positive,
}

/// What is wrong with a file, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}{cause}")]
pub struct Fault {
    /// Where.
    pub place: Place,
    /// What.
    pub cause: Cause,
}

/// Why a file holds no numbers or types at points.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Cause {
    /// It is too long.
    #[error("it is longer than {LONGEST} bytes")]
    TooLong,
    /// It has too many points.
    #[error("it has more than {MOST} points; thin them out")]
    TooMany,
    /// It has too many types.
    #[error("it has more than {MOST_TYPES} types")]
    TooManyTypes,
    /// It has no points.
    #[error("it has no points; write a line `x,y,z,value` for each")]
    Empty,
    /// A line has too few or too many parts.
    #[error("the line has {found} parts where it needs four: write `x,y,z,value`")]
    Columns {
        /// How many it has.
        found: usize,
    },
    /// A part is no finite number.
    #[error("`{word}` is not a finite number")]
    NotANumber {
        /// The part.
        word: String,
    },
    /// A number must be positive.
    #[error("`{word}` is not above zero, as a size must be")]
    NotPositive {
        /// The number.
        word: String,
    },
    /// A type has no name.
    #[error("the type has no name")]
    NoType,
    /// A point has two values.
    #[error("the point has another value in line {earlier}; leave one of them out")]
    Twice {
        /// The line that gave it first.
        earlier: usize,
    },
}

/// The numbers at points in `text`.
///
/// # Errors
/// [`Fault`], with its place.
pub fn numbers(text: &str, sign: Sign) -> Result<Data, Fault> {
    let mut values: Vec<f64> = Vec::new();
    let at = points(text, |word, place| {
        let value = number(word, place)?;
        if sign == Sign::Positive && value <= 0.0 {
            return Err(Fault { place, cause: Cause::NotPositive { word: shortened(word) } });
        }
        values.push(value);
        Ok(value.to_bits())
    })?;
    Ok(Data { values: at.kept.iter().map(|entry| values[*entry]).collect(), at: at.points })
}

/// The types at points in `text`.
///
/// # Errors
/// [`Fault`], with its place.
pub fn types(text: &str) -> Result<Types, Fault> {
    let (mut names, mut types): (Vec<String>, Vec<usize>) = (Vec::new(), Vec::new());
    let at = points(text, |word, place| {
        if word.is_empty() {
            return Err(Fault { place, cause: Cause::NoType });
        }
        let known = names.iter().position(|name| name == word).unwrap_or_else(|| {
            names.push(shortened(word));
            names.len() - 1
        });
        if names.len() > MOST_TYPES {
            return Err(Fault { place, cause: Cause::TooManyTypes });
        }
        types.push(known);
        Ok(known as u64)
    })?;
    let kept = at.kept.iter().map(|entry| types[*entry]).collect();
    Ok(Types { at: at.points, types: kept, names })
}

/// Points, and which entries of the file gave them.
struct Points {
    points: Vec<[f64; 3]>,
    kept: Vec<usize>,
}

/// The points of `text`, each once; `value` takes the value of each line and says what it is.
fn points(
    text: &str,
    mut value: impl FnMut(&str, Place) -> Result<u64, Fault>,
) -> Result<Points, Fault> {
    if text.len() > LONGEST {
        return Err(Fault { place: Place::Whole, cause: Cause::TooLong });
    }
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut known: FxHashMap<[u64; 3], (usize, u64)> = FxHashMap::default();
    let mut found = Points { points: Vec::new(), kept: Vec::new() };
    let mut entries = 0;
    for (line, row) in text.split('\n').enumerate().map(|(i, row)| (i + 1, row)) {
        if row.trim().is_empty() {
            continue;
        }
        let parts: Vec<&str> = row.splitn(6, ',').collect();
        let place = |part: &str| {
            let start = part.as_ptr() as usize - row.as_ptr() as usize;
            let blanks = part.len() - part.trim_start().len();
            Place::At { line, column: row[..start + blanks].chars().count() + 1 }
        };
        let &[x, y, z, last] = parts.as_slice() else {
            let found = row.split(',').count();
            return Err(Fault { place: place(row), cause: Cause::Columns { found } });
        };
        let mut point = [0.0; 3];
        for (coordinate, part) in point.iter_mut().zip([x, y, z]) {
            // Adding zero makes the two zeros one.
            *coordinate = number(part.trim(), place(part))? + 0.0;
        }
        let value = value(last.trim(), place(last))?;
        match known.get(&point.map(f64::to_bits)) {
            Some((earlier, other)) if *other != value => {
                let cause = Cause::Twice { earlier: *earlier };
                return Err(Fault { place: place(row), cause });
            }
            Some(_) => {}
            None => {
                known.insert(point.map(f64::to_bits), (line, value));
                found.points.push(point);
                found.kept.push(entries);
            }
        }
        entries += 1;
        if found.points.len() > MOST {
            return Err(Fault { place: Place::Whole, cause: Cause::TooMany });
        }
    }
    if found.points.is_empty() {
        return Err(Fault { place: Place::Whole, cause: Cause::Empty });
    }
    Ok(found)
}

fn number(word: &str, place: Place) -> Result<f64, Fault> {
    // The largest lengths that are still far from overflowing when they are squared.
    const LARGEST: f64 = 1e100;
    let value = word.parse().ok().filter(|value: &f64| value.abs() < LARGEST);
    value.ok_or_else(|| Fault { place, cause: Cause::NotANumber { word: shortened(word) } })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_points_and_values() {
        let text = "\u{feff}0,0,0,1\r\n\n 1 , -2.5,3e1, 0.25\n0,0,-0,1\n";
        let data = numbers(text, Sign::Positive).unwrap();
        assert_eq!(data.at, [[0.0; 3], [1.0, -2.5, 30.0]]);
        assert_eq!(data.values, [1.0, 0.25]);
        let found = types("0,0,0,b\n0,0,1,a\n0,0,0,b\n0,1,0,b").unwrap();
        assert_eq!((found.names, found.types), (vec!["b".into(), "a".into()], vec![0, 1, 0]));
    }

    #[track_caller]
    fn check(text: &str, expected: &str) {
        assert_eq!(numbers(text, Sign::Positive).unwrap_err().to_string(), expected);
    }

    #[test]
    fn faults_have_their_place() {
        check("", "it has no points; write a line `x,y,z,value` for each");
        check("x,y,z,size\n0,0,0,1", "line 1, column 1: `x` is not a finite number");
        check(
            "0,0,0,1\n 0,0,0",
            "line 2, column 2: the line has 3 parts where it needs four: write `x,y,z,value`",
        );
        check(
            "0;0;0;1",
            "line 1, column 1: the line has 1 parts where it needs four: write `x,y,z,value`",
        );
        check("0,é,0,1", "line 1, column 3: `é` is not a finite number");
        check("0,0,0,gyroid", "line 1, column 7: `gyroid` is not a finite number");
        check("0,0,inf,1", "line 1, column 5: `inf` is not a finite number");
        check("0,0,0,-1", "line 1, column 7: `-1` is not above zero, as a size must be");
        check(
            "0,0,0,1\n0,0,1,1\n0,0,-0,2",
            "line 3, column 1: the point has another value in line 1; leave one of them out",
        );
        let many: String = (0..=MOST).map(|i| format!("{i},0,0,1\n")).collect();
        check(&many, "it has more than 8192 points; thin them out");
        check(&" ".repeat(LONGEST + 1), "it is longer than 4194304 bytes");
        assert_eq!(types("0,0,0, ").unwrap_err().cause, Cause::NoType);
        let many: String = (0..=MOST_TYPES).map(|i| format!("{i},0,0,t{i}\n")).collect();
        assert_eq!(types(&many).unwrap_err().cause, Cause::TooManyTypes);
    }
}
