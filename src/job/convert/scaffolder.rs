//! Scaffolder's line `surface[,coff,isolevel,grid_size,k_slice,k_polygon]`, as a program.
//!
//! A word of a program is such a line after `scaffolder:`, as in `part.stl
//! scaffolder:gyroid,0.6283,0.61`. Conventions that are converted:
//!
//! * `coff` is an angular frequency, 2π by the length of a cell; it is pi where none is given.
//! * The solid is where f + isolevel is less than zero, the opposite of a dilation.
//! * Its gyroid sin x cos y + ... is the mirror image of our `gyroid`: x and y are exchanged.
//! * Formulas are Scaffolder's own: its `schoen_iwp`, `lidinoid`, `double-*` and `tubular_*` differ from what
//!   is called so elsewhere, and `rectlinear` and `tubular_*` take no isolevel.
//!
//! What is not the same: Scaffolder smooths and cleans its mesh and cuts the part by its voxels.
//!
//! Source: Scaffolder 1.5, `include/implicit_function.h` and `docs/cmd.md`.

use super::Converted;
use super::formula::Number;
use crate::lang::names;
use std::f64::consts::PI;
use std::ops::Range;

/// How words begin that hold a line of Scaffolder.
pub const PREFIX: &str = "scaffolder:";

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// What, in lower case.
    pub message: String,
    /// Which bytes of the line are at fault.
    pub place: Range<usize>,
    /// What to do about it.
    pub cure: String,
}

/// A surface of Scaffolder.
struct Surface {
    names: &'static [&'static str],
    form: Form,
}

/// How a surface is said.
enum Form {
    /// By words of ours for the same formula.
    Word(&'static str),
    /// By an equation in the phases X, Y and Z, and the isolevel.
    Formula(&'static str),
    /// By an equation in the phases alone.
    Fixed(&'static str),
}

const SURFACES: [Surface; 13] = [
    Surface {
        names: &["rectlinear"],
        form: Form::Fixed("(cos(X)+cos(Y)-1.2)*(cos(Y+pi)+cos(Z+pi)-1.2)-0.05"),
    },
    Surface { names: &["schwarzp"], form: Form::Word("p-surface") },
    Surface {
        names: &["double-p"],
        form: Form::Formula(
            "cos(X)*cos(Y)+cos(Y)*cos(Z)+cos(X)*cos(Z)+0.35*(cos(2*X)+cos(2*Y)+cos(2*Z))",
        ),
    },
    Surface { names: &["schwarzd"], form: Form::Word("d-surface") },
    Surface {
        names: &["double-d"],
        form: Form::Formula("-(cos(X)*cos(Y)+cos(Y)*cos(Z)+cos(X)*cos(Z))-sin(X)*sin(Y)*sin(Z)"),
    },
    Surface { names: &["gyroid"], form: Form::Word("gyroid conform y,x,z") },
    Surface {
        // The second spelling is that of its help.
        names: &["double-gyroid", "double-gyroiod"],
        form: Form::Formula(
            "-(2.75*(sin(2*X)*sin(Z)*cos(Y)+sin(2*Y)*sin(X)*cos(Z)+sin(2*Z)*sin(Y)*cos(X))\
             -(cos(2*X)*cos(2*Y)+cos(2*Y)*cos(2*Z)+cos(2*X)*cos(2*Z)))",
        ),
    },
    Surface {
        names: &["lidinoid"],
        form: Form::Formula(
            "sin(2*X)*cos(Y)*sin(Z)+sin(2*Y)*cos(Z)*sin(X)+sin(2*Z)*cos(X)*sin(Y)\
             +cos(2*X)*cos(2*Y)+cos(2*Y)*cos(2*Z)+cos(2*Z)*cos(2*X)",
        ),
    },
    Surface { names: &["neovius"], form: Form::Word("neovius") },
    Surface {
        names: &["schoen_iwp"],
        form: Form::Formula("cos(X)*cos(Y)+cos(Y)*cos(Z)+cos(Z)*cos(X)"),
    },
    Surface {
        names: &["bcc"],
        form: Form::Formula(
            "cos(X)+cos(Y)+cos(Z)\
             -2*(cos(0.5*X)*cos(0.5*Y)+cos(0.5*Y)*cos(0.5*Z)+cos(0.5*X)*cos(0.5*Z))",
        ),
    },
    Surface {
        names: &["tubular_g_ab"],
        form: Form::Fixed(
            "20*(cos(X)*sin(Y)+cos(Y)*sin(Z)+cos(Z)*sin(X))\
             -0.5*(cos(2*X)*cos(2*Y)+cos(2*Y)*cos(2*Z)+cos(2*Z)*cos(2*X))-4",
        ),
    },
    Surface {
        names: &["tubular_g_c"],
        form: Form::Fixed(
            "-(10*(cos(X)*sin(Y)+cos(Y)*sin(Z)+cos(Z)*sin(X))\
             -2*(cos(2*X)*cos(2*Y)+cos(2*Y)*cos(2*Z)+cos(2*Z)*cos(2*X))-12)",
        ),
    },
];

/// What stands at each place of the line.
const PLACES: [&str; 6] = ["surface", "coff", "isolevel", "grid_size", "k_slice", "k_polygon"];

/// The program of `line`, which makes the lattice alone.
///
/// # Errors
/// [`Fault`], with its place and cure.
pub fn convert(line: &str) -> Result<Converted, Fault> {
    let parts: Vec<&str> = line.split(',').collect();
    let place = |part: &str| {
        let start = part.as_ptr() as usize - line.as_ptr() as usize;
        start..start + part.len()
    };
    if let Some(extra) = parts.get(PLACES.len()) {
        return Err(Fault {
            message: "the line of Scaffolder has too many parts".to_owned(),
            place: place(extra),
            cure: format!("write `{}`", PLACES.join(",")),
        });
    }
    let name = parts.first().copied().unwrap_or_default();
    let surface = surface(name.trim()).map_err(|(message, cure)| Fault {
        message,
        place: place(name),
        cure,
    })?;
    let number = |index: usize, default: f64| -> Result<f64, Fault> {
        let Some(part) = parts.get(index) else { return Ok(default) };
        let number = part.trim().parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| Fault {
            message: format!("the `{}` of Scaffolder must be a finite number", PLACES[index]),
            place: place(part),
            cure: "write the surface, coff and isolevel with commas between: `gyroid,3.14,0`"
                .to_owned(),
        })
    };
    let (frequency, level) = (number(1, PI)?, number(2, 0.0)?);
    if frequency == 0.0 {
        return Err(Fault {
            message: "the `coff` of Scaffolder must not be zero".to_owned(),
            place: parts.get(1).map_or(0..0, |part| place(part)),
            cure: "write 2*pi by the length of a cell".to_owned(),
        });
    }
    let mut remarks = Vec::new();
    for index in 3..PLACES.len() {
        number(index, 0.0)?;
    }
    if parts.len() > 3 {
        let unused = PLACES[3..parts.len()].join(", ");
        remarks.push(format!("without effect here, where -s chooses the grid: {unused}"));
    }
    let text = match surface.form {
        Form::Word(word) => {
            let offset = if level == 0.0 { String::new() } else { format!(" erode {level}") };
            format!("{word}{offset} scale tau/{}\n", Number::Fixed(frequency).text())
        }
        Form::Formula(formula) => {
            let level = Number::Fixed(level).text();
            format!("'{}+{level}'\n", in_space(formula, frequency))
        }
        Form::Fixed(formula) => {
            if parts.len() > 2 {
                remarks.push(format!("the surface `{}` takes no isolevel", surface.names[0]));
            }
            format!("'{}'\n", in_space(formula, frequency))
        }
    };
    Ok(Converted { text, remarks })
}

fn surface(name: &str) -> Result<&'static Surface, (String, String)> {
    let lower = name.to_lowercase();
    if let Some(surface) = SURFACES.iter().find(|surface| surface.names.contains(&lower.as_str())) {
        return Ok(surface);
    }
    if lower.ends_with(".lua") {
        let cure = "write what it computes as an equation, with the sign changed: `'sin(x)+y'`";
        return Err(("programs in Lua are not run here".to_owned(), cure.to_owned()));
    }
    let all = || SURFACES.iter().flat_map(|surface| surface.names.iter().take(1).copied());
    let near = names::nearest(&lower, all());
    let cure = names::suggestion(&near)
        .unwrap_or_else(|| format!("its surfaces are {}", all().collect::<Vec<_>>().join(", ")));
    Err(("Scaffolder has no surface of this name".to_owned(), cure))
}

/// `formula` with the phases written out.
fn in_space(formula: &str, frequency: f64) -> String {
    let frequency = Number::Fixed(frequency).text();
    ["x", "y", "z"].into_iter().fold(formula.to_owned(), |text, axis| {
        text.replace(&axis.to_uppercase(), &format!("{frequency}*{axis}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Job;
    use crate::solid::walk::value;

    /// The field at a point, by the words of the language.
    fn at(line: &str, point: [f64; 3]) -> f64 {
        let job = Job::parse(&convert(line).unwrap().text).unwrap();
        let (graph, field) = job.field();
        value(graph, field, point)
    }

    #[test]
    fn lines_are_scaffolder_s_formulas_with_its_sign() {
        let (x, y, z) = (0.3, -1.1, 2.2);
        let point = [x, y, z];
        let (w, t) = (0.7_f64, 0.25);
        let [(sx, cx), (sy, cy), (sz, cz)] = [x, y, z].map(|c| (w * c).sin_cos());
        let [(s2x, c2x), (s2y, c2y), (s2z, c2z)] = [x, y, z].map(|c| (2.0 * w * c).sin_cos());
        let [hx, hy, hz] = [x, y, z].map(|c| (0.5 * w * c).cos());
        // Levels of words are scaled with the length of a cell.
        let cell = 2.0 * PI / w;
        let pairs = c2x * c2y + c2y * c2z + c2z * c2x;
        let spins = s2x * cy * sz + s2y * cz * sx + s2z * cx * sy;
        let turns = cx * sy + cy * sz + cz * sx;
        for (name, expected) in [
            ("gyroid", cell * (sx * cy + sy * cz + sz * cx + t)),
            ("schwarzp", cell * (cx + cy + cz + t)),
            ("schwarzd", cell * (sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz + t)),
            ("neovius", cell * (3.0 * (cx + cy + cz) + 4.0 * cx * cy * cz + t)),
            ("double-p", cx * cy + cy * cz + cx * cz + 0.35 * (c2x + c2y + c2z) + t),
            ("double-d", -(cx * cy + cy * cz + cx * cz) - sx * sy * sz + t),
            (
                "double-gyroid",
                -(2.75 * (s2x * sz * cy + s2y * sx * cz + s2z * sy * cx) - pairs) + t,
            ),
            ("lidinoid", spins + pairs + t),
            ("schoen_iwp", cx * cy + cy * cz + cz * cx + t),
            ("bcc", cx + cy + cz - 2.0 * (hx * hy + hy * hz + hx * hz) + t),
            ("tubular_g_ab", 20.0 * turns - 0.5 * pairs - 4.0),
            ("Tubular_G_C", -(10.0 * turns - 2.0 * pairs - 12.0)),
            ("rectlinear", (cx + cy - 1.2) * (-cy - cz - 1.2) - 0.05),
        ] {
            let found = at(&format!("{name},{w},{t}"), point);
            assert!((found - expected).abs() < 1e-12, "{name}: {found} is not {expected}");
        }
    }

    #[test]
    fn defaults_are_scaffolder_s() {
        let expected = "gyroid conform y,x,z scale tau/3.141592653589793\n";
        assert_eq!(convert("gyroid").unwrap().text, expected);
        let found = convert("schwarzp,-2,-0.5,100,4").unwrap();
        assert_eq!(found.text, "p-surface erode -0.5 scale tau/(-2)\n");
        let remark = "without effect here, where -s chooses the grid: grid_size, k_slice";
        assert_eq!(found.remarks, [remark]);
        assert_eq!(convert("bcc, 1").unwrap().text.matches("0.5*1*x").count(), 2);
    }

    #[test]
    fn faults_point_into_the_line() {
        let check = |line: &str, place: Range<usize>, message: &str| {
            let fault = convert(line).unwrap_err();
            assert_eq!((fault.place, fault.message.as_str()), (place, message), "{line}");
            assert!(!fault.cure.is_empty());
        };
        check("giroid,1,0", 0..6, "Scaffolder has no surface of this name");
        check("", 0..0, "Scaffolder has no surface of this name");
        check("a.lua,1", 0..5, "programs in Lua are not run here");
        check("gyroid,one", 7..10, "the `coff` of Scaffolder must be a finite number");
        check("gyroid,0", 7..8, "the `coff` of Scaffolder must not be zero");
        check("gyroid,1,inf", 9..12, "the `isolevel` of Scaffolder must be a finite number");
        check("gyroid,1,0,1,1,1,9", 17..18, "the line of Scaffolder has too many parts");
    }
}
