//! The backend grammar, one everywhere: `name[:key=value[,key=value...]]`.

use super::catalogue::{BACKENDS, BackendEntry};
use crate::{Error, Result};
use std::fmt;
use std::str::FromStr;

/// One value that a key may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// As typed.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
}

/// One key that a backend understands.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// As typed.
    pub name: &'static str,
    /// What it sets, in a line.
    pub about: &'static str,
    /// Its values, from the catalogue of whatever it names.
    pub choices: fn() -> Vec<Choice>,
    /// The value where the spec does not say.
    pub default: &'static str,
}

/// A backend and its settings, checked against the catalogue: it names something that exists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendSpec {
    name: &'static str,
    /// One value for each key of the entry, in the entry's order, and whether it was given.
    values: Vec<(&'static str, bool)>,
}

impl BackendSpec {
    /// The catalogue's entry.
    pub fn entry(&self) -> &'static BackendEntry {
        BACKENDS.iter().find(|e| e.name == self.name).expect("specs are made from the catalogue")
    }

    /// The backend's name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The value of `key`, given or default.
    ///
    /// # Panics
    /// If the backend has no such key: a slip in the backend's own code.
    pub fn value(&self, key: &str) -> &'static str {
        self.find_value(key).unwrap_or_else(|| panic!("{} has no key {key}", self.name))
    }

    /// The value of `key`, given or default; `None` if the backend has no such key.
    pub fn find_value(&self, key: &str) -> Option<&'static str> {
        let index = self.entry().all_keys().position(|k| k.name == key)?;
        Some(self.values[index].0)
    }

    /// The spec with every key written out; those of moving scenes only where given.
    pub fn full(&self) -> String {
        let still = self.entry().keys.len();
        self.written(|place, given| given || place < still)
    }

    fn written(&self, shown: impl Fn(usize, bool) -> bool) -> String {
        let keys: Vec<String> = self
            .entry()
            .all_keys()
            .zip(&self.values)
            .enumerate()
            .filter(|(place, (_, value))| shown(*place, value.1))
            .map(|(_, (key, value))| format!("{}={}", key.name, value.0))
            .collect();
        if keys.is_empty() {
            self.name.to_string()
        } else {
            format!("{}:{}", self.name, keys.join(","))
        }
    }
}

/// As given: keys left at their default are not written.
impl fmt::Display for BackendSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.written(|_, given| given))
    }
}

/// As printed.
impl serde::Serialize for BackendSpec {
    fn serialize<S: serde::Serializer>(
        &self,
        serializer: S,
    ) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl FromStr for BackendSpec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (name, settings) = match text.split_once(':') {
            Some((name, settings)) => (name, Some(settings)),
            None => (text, None),
        };
        let entry = BACKENDS.iter().find(|e| e.name == name).ok_or_else(|| {
            let names = BACKENDS.iter().map(|e| e.name);
            Error::Usage(format!("backend '{text}': no backend '{name}' ({})", one_of(names)))
        })?;
        let mut values: Vec<_> = entry.all_keys().map(|key| (key.default, false)).collect();
        for setting in settings.into_iter().flat_map(|s| s.split(',')) {
            let (key, value) = setting.split_once('=').ok_or_else(|| {
                Error::Usage(format!("backend '{text}': expected key=value, got '{setting}'"))
            })?;
            let index = entry.all_keys().position(|k| k.name == key).ok_or_else(|| {
                let keys = entry.all_keys().map(|k| k.name);
                let valid = if entry.all_keys().next().is_none() {
                    format!("{name} has no keys")
                } else {
                    one_of(keys)
                };
                Error::Usage(format!("backend '{text}': {name} has no key '{key}' ({valid})"))
            })?;
            if values[index].1 {
                return Err(Error::Usage(format!("backend '{text}': '{key}' is given twice")));
            }
            let key = entry.all_keys().nth(index).expect("found above");
            let choices = (key.choices)();
            let choice = choices.iter().find(|c| c.name == value).ok_or_else(|| {
                let valid = one_of(choices.iter().map(|c| c.name));
                Error::Usage(format!(
                    "backend '{text}': {} cannot be '{value}' ({valid})",
                    key.name
                ))
            })?;
            values[index] = (choice.name, true);
        }
        let spec = Self { name: entry.name, values };
        if let Some(check) = entry.check {
            check(&spec).map_err(|why| Error::Usage(format!("backend '{text}': {why}")))?;
        }
        Ok(spec)
    }
}

fn one_of<'a>(names: impl Iterator<Item = &'a str>) -> String {
    format!("one of: {}", names.collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        text.parse::<BackendSpec>().expect_err(text).to_string()
    }

    #[test]
    fn what_does_not_exist_is_refused_with_the_choices() {
        assert!(refused("bvh3").contains("one of: brute"));
        assert!(refused("").contains("one of: brute"));
        assert!(refused("bvh2:colour=red").contains("builder"));
        assert!(refused("bvh2:order=sideways").contains("node-sato"));
        assert!(refused("bvh2:order").contains("key=value"));
        assert!(refused("bvh2:").contains("key=value"));
        assert!(refused("bvh2:order=near,order=far").contains("twice"));
    }

    #[test]
    fn what_was_given_is_what_is_printed() {
        for text in ["bvh2", "bvh2:order=near", "brute"] {
            assert_eq!(text.parse::<BackendSpec>().unwrap().to_string(), text);
        }
        let full = "bvh2:order=near".parse::<BackendSpec>().unwrap().full();
        assert!(full.contains("builder=binned") && full.contains("order=near"), "{full}");
    }
}
