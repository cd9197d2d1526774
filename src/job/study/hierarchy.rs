//! A solid made in steps: through files, and at once.
//!
//! Each step is a program text that begins with what the steps before have made, as the first shape on
//! the stack. *Direct*, that is their program; *sequential*, it is the mesh that the step before wrote. So
//! `gyroid` is the intersection with a gyroid, `gyroid union` the union, `shell 0.1` a wall about what came before.
//!
//! Both meshes of a step are contoured on the grid of the direct solid, and compared with the direct field.
//! The first step names no file and is the same both ways.
//!
//! Source: the Cesogen paper, section 4.2 and figure 5. There the second step is still made from
//! formulas, so that a solid passes through one file less.

use super::{Error, Numbers, Passage};
use crate::contour;
use crate::job::convert::quoted;
use crate::job::{self, Job, Report, Settings};
use crate::lang;
use crate::measure::{Deviation, Norms};
use crate::num::Progress;

/// The word that joins what a step leaves on the stack, for the next one to begin with.
const JOIN: &str = "intersection";

/// A program in steps.
#[derive(Debug)]
pub struct Hierarchy {
    parameters: Vec<(String, f64)>,
    stages: Vec<Stage>,
}

/// A step and all before it.
#[derive(Debug)]
struct Stage {
    /// The step's own words.
    words: Vec<String>,
    /// Those of the program up to its end.
    whole: Vec<String>,
    job: Job,
}

/// A step, both ways.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Step {
    /// Its number, from 1 on.
    pub number: u32,
    /// The program up to its end.
    pub program: String,
    /// The length of the diagonal of its grid, in model units.
    pub diagonal: f64,
    /// The mesh of the program up to its end.
    pub direct: Numbers,
    /// The mesh of its own words after the file of the step before.
    pub sequential: Numbers,
    /// What contouring the program did.
    #[serde(skip)]
    pub report: Report,
}

impl Step {
    /// The errors of the sequential mesh over those of the direct one, by the values of the field; 1 where
    /// they are equal.
    #[must_use]
    pub fn ratio(&self) -> Deviation {
        let ratio = |a: f64, b: f64| if a == b { 1.0 } else { a / b };
        let norms = |a: Norms, b: Norms| Norms { l2: ratio(a.l2, b.l2), max: ratio(a.max, b.max) };
        let [a, b] = [&self.sequential, &self.direct].map(|numbers| numbers.deviations.values);
        Deviation { points: norms(a.points, b.points), centres: norms(a.centres, b.centres) }
    }
}

impl Hierarchy {
    /// The program that `steps` make, texts in order, whose equations may use `parameters`.
    ///
    /// # Errors
    /// [`job::Error::Program`] of the first step that is at fault, after those before it.
    pub fn new(steps: &[String], parameters: &[(String, f64)]) -> Result<Self, job::Error> {
        let mut stages: Vec<Stage> = Vec::with_capacity(steps.len());
        for text in steps {
            let words = lang::words::of(text)?;
            let mut whole = Vec::new();
            if let Some(before) = stages.last() {
                whole.clone_from(&before.whole);
                let joints = before.job.operands.len().saturating_sub(1);
                whole.extend(std::iter::repeat_n(JOIN.to_owned(), joints));
            }
            whole.extend_from_slice(&words);
            let job = Job::with_parameters(&whole, parameters)?;
            stages.push(Stage { words, whole, job });
        }
        Ok(Self { parameters: parameters.to_vec(), stages })
    }

    /// The job of all steps at once; none if there are no steps.
    #[must_use]
    pub fn whole(&self) -> Option<&Job> {
        self.stages.last().map(|stage| &stage.job)
    }

    /// Makes each step both ways; sequential meshes go by `passage` to the next step.
    ///
    /// `progress` counts steps.
    ///
    /// # Errors
    /// [`Error`] of the step that failed.
    pub fn run(
        &self,
        settings: &Settings,
        passage: &Passage,
        progress: &Progress,
    ) -> Result<Vec<Step>, Error> {
        progress.expect(self.stages.len() as u64);
        let mut file = None;
        let mut steps = Vec::with_capacity(self.stages.len());
        for (number, Stage { words, whole, job }) in (1..).zip(&self.stages) {
            let grid = job.grid(settings)?;
            let reference = job.reference(&grid, settings)?;
            let (mesh, report) = job.mesh_on(&grid, settings)?;
            let direct = Numbers::new(&mesh, &reference)?;
            let (mesh, sequential) = match file {
                None => (mesh, direct.clone()),
                Some(file) => {
                    let words: Vec<String> = std::iter::once(file).chain(words.clone()).collect();
                    let job = Job::with_parameters(&words, &self.parameters)?;
                    let (mesh, _) = job.mesh_on(&grid, settings)?;
                    let numbers = Numbers::new(&mesh, &reference)?;
                    (mesh, numbers)
                }
            };
            file = Some(passage.write(&format!("step{number}"), &mesh)?);
            let program = whole.iter().map(|word| quoted(word).unwrap_or_else(|| word.clone()));
            steps.push(Step {
                number,
                program: program.collect::<Vec<_>>().join(" "),
                diagonal: super::diagonal(&grid),
                direct,
                sequential,
                report,
            });
            progress.advance(1).map_err(contour::Error::from).map_err(job::Error::from)?;
        }
        Ok(steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::io::{Format, Precision};

    fn hierarchy(steps: &[&str], parameters: &[(&str, f64)]) -> Result<Hierarchy, job::Error> {
        let steps: Vec<_> = steps.iter().map(|&text| text.to_owned()).collect();
        let parameters: Vec<_> =
            parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Hierarchy::new(&steps, &parameters)
    }

    fn run(hierarchy: &Hierarchy) -> Vec<Step> {
        let folder = tempfile::tempdir().unwrap();
        let (format, precision) = (Format::Ply, Precision::Double);
        let passage = Passage { folder: folder.path().to_owned(), format, precision };
        hierarchy.run(&Settings::with_spacing(0.1), &passage, &Progress::new()).unwrap()
    }

    #[test]
    fn a_step_begins_with_all_that_the_steps_before_have_made() {
        let steps = ["box sphere scale r", "sphere scale 0.5 union", "translate 0.5,0,0", "'x+y'"];
        let steps = run(&hierarchy(&steps, &[("r", 1.2)]).unwrap());
        let programs: Vec<_> = steps.iter().map(|step| step.program.as_str()).collect();
        assert_eq!(programs[1], "box sphere scale r intersection sphere scale 0.5 union");
        assert_eq!(
            programs[2],
            "box sphere scale r intersection sphere scale 0.5 union translate 0.5,0,0"
        );
        assert!(programs[3].ends_with("translate 0.5,0,0 x+y"), "{}", programs[3]);
    }

    #[test]
    fn both_ways_make_the_same_solid() {
        let steps = ["sphere", "'x-0.31'", "box scale 0.4 translate 0,0.7,0 difference"];
        let steps = run(&hierarchy(&steps, &[]).unwrap());
        assert_eq!(steps[0].direct, steps[0].sequential);
        for Step { number, direct, sequential, .. } in &steps {
            assert!(direct.sound && sequential.sound, "{number}");
            assert_eq!(direct.euler, sequential.euler, "{number}");
            assert!((sequential.volume / direct.volume - 1.0).abs() < 1e-3, "{number}");
        }
        let ratio = steps[2].ratio();
        assert!(ratio.errors().iter().all(|ratio| (0.5..2.0).contains(ratio)), "{ratio:?}");
    }

    #[test]
    fn faults_of_any_step_are_found_before_the_work() {
        let fault = hierarchy(&["sphere", "gyrod"], &[]).unwrap_err();
        assert!(fault.to_string().contains("gyrod"), "{fault}");
        assert!(hierarchy(&[], &[]).unwrap().whole().is_none());
    }
}
