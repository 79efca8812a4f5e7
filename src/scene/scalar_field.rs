//! A number in the text of a scene, and the scene as a function of that number.

use super::{Faults, Scene, read};
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// The text of a scene with its overrides.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneText {
    text: String,
    set: Vec<String>,
    directory: PathBuf,
}

impl SceneText {
    /// A text in which `set` replaces or adds fields, each `path=value`.
    pub fn new(text: impl Into<String>, set: &[String]) -> Self {
        Self {
            text: text.into(),
            set: set.to_vec(),
            directory: PathBuf::new(),
        }
    }

    /// Sets the directory from which the names of files in the text count.
    #[must_use]
    pub fn in_directory(self, directory: &Path) -> Self {
        let directory = directory.to_owned();
        Self { directory, ..self }
    }

    fn read<T>(&self, more: Option<&str>, by: impl FnOnce(&read::Sources) -> T) -> T {
        let set: Vec<&str> = self.set.iter().map(String::as_str).chain(more).collect();
        by(&read::Sources::new(&self.text, &set).in_directory(&self.directory))
    }

    /// The scene.
    ///
    /// # Errors
    /// Every fault of the text.
    pub fn scene(&self) -> std::result::Result<Scene, Faults> {
        self.read(None, read::scene)
    }

    /// The number at a dotted path, as `rod.length` or `end.force.2`.
    ///
    /// # Errors
    /// A path without a number in the text.
    pub fn field(&self, path: &str) -> Result<ScalarField> {
        let path = path.trim();
        let value = self.read(None, |sources| read::number_at(sources, path));
        let value = value.filter(|value| value.is_finite()).ok_or_else(|| {
            Error::domain(format!(
                "{path}: the text of the scene has no number there; write the path of one that it has, such as rod.length or end.force.2, or \
                 add the number by --set {path}=VALUE"
            ))
        })?;
        if read::is_count(path) {
            return Err(Error::domain(format!(
                "{path}: is a whole number, which nothing has a derivative by; name a field with real values"
            )));
        }
        Ok(ScalarField {
            of: self.clone(),
            path: path.to_owned(),
            value,
        })
    }
}

/// A number in the text of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarField {
    of: SceneText,
    /// Dotted path of the number, as written.
    pub path: String,
    /// Value of the number in the scene.
    pub value: f64,
}

impl ScalarField {
    /// The scene with another value of the number, read with every check.
    ///
    /// # Errors
    /// A value that the scene does not allow.
    pub fn scene(&self, value: f64) -> Result<Scene> {
        let set = format!("{}={value:?}", self.path);
        let scene = self.of.read(Some(&set), read::scene);
        scene.map_err(|faults| Error::domain(faults.to_string()))
    }
}
