//! The programs of late requests, parsed and compiled.

use super::reply::ErrorReply;
use crate::job::{Access, Files, Job, Stamp};
use std::collections::BTreeMap;

/// Programs that are kept.
const KEPT: usize = 32;
/// Nodes of their expressions, the latest program's aside: a program with its compiled code takes
/// some hundred bytes a node.
const NODES: usize = 4_000_000;

/// The programs that were asked for last, by their words and names of parameters.
#[derive(Debug)]
pub(super) struct Programs {
    access: Access,
    /// The latest is last.
    kept: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    words: Vec<String>,
    names: Vec<String>,
    job: Job,
}

impl Programs {
    /// No programs; those to come may read what `access` allows.
    pub(super) fn new(access: Access) -> Self {
        Self { access, kept: Vec::new() }
    }

    /// The job of these words, with these values of its parameters.
    pub(super) fn job(
        &mut self,
        words: &[String],
        parameters: &BTreeMap<String, f64>,
    ) -> Result<&Job, ErrorReply> {
        let is_it =
            |entry: &Entry| entry.words == words && entry.names.iter().eq(parameters.keys());
        let found = self.kept.iter().position(is_it).map(|place| self.kept.remove(place));
        let entry = match found.filter(Entry::is_fresh) {
            Some(mut entry) => {
                let changes: Vec<_> =
                    parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
                let changed = entry.job.set_parameters(&changes);
                if let Err(error) = changed {
                    self.kept.push(entry);
                    return Err(error.into());
                }
                entry
            }
            None => self.entry(words, parameters)?,
        };
        self.make_room(NODES);
        self.kept.push(entry);
        Ok(&self.kept[self.kept.len() - 1].job)
    }

    /// Forgets the earliest programs until there are fewer than [`KEPT`], of `most` nodes at most.
    fn make_room(&mut self, most: usize) {
        let nodes = |entry: &Entry| entry.job.field().0.len();
        let mut total: usize = self.kept.iter().map(nodes).sum();
        while !self.kept.is_empty() && (self.kept.len() >= KEPT || total > most) {
            total -= nodes(&self.kept.remove(0));
        }
    }

    fn entry(
        &self,
        words: &[String],
        parameters: &BTreeMap<String, f64>,
    ) -> Result<Entry, ErrorReply> {
        let given: Vec<_> = parameters.iter().map(|(name, value)| (name.clone(), *value)).collect();
        let job = Job::read(words, &given, Files::with(self.access))?;
        Ok(Entry { words: words.to_vec(), names: parameters.keys().cloned().collect(), job })
    }
}

impl Entry {
    /// Whether its files are still what they were.
    fn is_fresh(&self) -> bool {
        let mut files = self.job.files().iter().zip(self.job.stamps());
        files.all(|(file, known)| known.is_some() && Stamp::of(file) == *known)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn parameters(value: f64) -> BTreeMap<String, f64> {
        BTreeMap::from([("t".to_owned(), value)])
    }

    #[test]
    fn a_program_is_kept_while_it_is_among_the_last() {
        let mut programs = Programs::new(Access::Nothing);
        let words = |i: usize| vec!["box".to_owned(), "dilate".to_owned(), format!("t+{i}")];
        for i in 0..2 * KEPT {
            let job = programs.job(&words(i), &parameters(0.5)).unwrap();
            assert_eq!(job.bounds().unwrap().hi.x, 1.5 + i as f64);
            programs.job(&words(0), &parameters(0.25)).unwrap();
        }
        assert_eq!(programs.kept.len(), KEPT);
        let kept = |programs: &Programs, i| programs.kept.iter().any(|e| e.words == words(i));
        assert!(kept(&programs, 0) && kept(&programs, 2 * KEPT - 1) && !kept(&programs, 1));
    }

    #[test]
    fn large_programs_are_forgotten_sooner() {
        let mut programs = Programs::new(Access::Nothing);
        for i in 0..10 {
            let words = ["gyroid", "dilate", &format!("t+{i}"), "box"].map(str::to_owned);
            programs.job(&words, &parameters(0.5)).unwrap();
        }
        let nodes = programs.kept[0].job.field().0.len();
        programs.make_room(4 * nodes + nodes / 2);
        assert_eq!(programs.kept.len(), 4);
        assert_eq!(programs.kept[3].words[2], "t+9");
        programs.make_room(0);
        assert!(programs.kept.is_empty());
    }

    #[test]
    fn other_names_make_another_program_and_refused_values_keep_it() {
        let mut programs = Programs::new(Access::Nothing);
        let words = ["box", "scale", "t"].map(str::to_owned);
        programs.job(&words, &parameters(2.0)).unwrap();
        assert!(programs.job(&words, &parameters(0.0)).is_err());
        assert!(programs.job(&words, &BTreeMap::new()).is_err());
        assert_eq!(programs.kept.len(), 1);
        let more = BTreeMap::from([("t".to_owned(), 3.0), ("u".to_owned(), 0.0)]);
        assert_eq!(programs.job(&words, &more).unwrap().unused_parameters(), ["u"]);
        assert_eq!(programs.kept.len(), 2);
    }

    #[test]
    fn a_changed_file_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("program");
        let words = [format!("@{}", file.display())];
        let mut programs = Programs::new(Access::Regular);
        let mut reach = || programs.job(&words, &BTreeMap::new()).unwrap().bounds().unwrap().hi.x;
        fs::write(&file, "box").unwrap();
        assert_eq!((reach(), reach()), (1.0, 1.0));
        fs::write(&file, "box scale 2").unwrap();
        assert_eq!(reach(), 2.0);
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_is_replaced_while_others_are_read_is_not_taken_for_what_was_read() {
        let folder = tempfile::tempdir().unwrap();
        let [file, pipe] = ["file", "pipe"].map(|name| folder.path().join(name));
        fs::write(&file, "box").unwrap();
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let words = [&file, &pipe].map(|path| format!("@{}", path.display()));
        let other = std::thread::spawn({
            let (file, pipe) = (file.clone(), pipe.clone());
            move || {
                // The pipe can be opened once the program waits for it, which is after the file.
                let mut pipe = fs::File::options().write(true).open(pipe).unwrap();
                fs::write(file, "box scale 2").unwrap();
                std::io::Write::write_all(&mut pipe, b"dilate 0").unwrap();
            }
        });
        let programs = Programs::new(Access::Everything);
        let entry = programs.entry(&words, &BTreeMap::new()).unwrap();
        other.join().unwrap();
        assert_eq!(entry.job.bounds().unwrap().hi.x, 1.0);
        assert!(!entry.is_fresh());
        assert_ne!(entry.job.stamps()[0], Stamp::of(&file.to_string_lossy()));
    }
}
