//! Access to a TOML document with spans: tables and values that know their key and line.

use super::error::RobotError;
use crate::robot::description::Bound;
use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

/// A table of the document, with its path and position.
pub(super) struct Section<'a> {
    pub(super) text: &'a str,
    pub(super) entries: &'a DeTable<'a>,
    pub(super) path: String,
    /// Byte at which the table starts.
    pub(super) start: usize,
}

impl<'a> Section<'a> {
    pub(super) fn key(&self, name: &str) -> String {
        if self.path.is_empty() {
            name.to_owned()
        } else {
            format!("{}.{name}", self.path)
        }
    }

    /// Refuse keys that are not in `known`. The error names the first one in the file.
    pub(super) fn only(&self, known: &[&str]) -> Result<(), RobotError> {
        let is_unknown = |key: &&Spanned<_>| !known.contains(&AsRef::<str>::as_ref(key.get_ref()));
        let unknown = self.entries.keys().filter(is_unknown);
        match unknown.min_by_key(|key| key.span().start) {
            None => Ok(()),
            Some(key) => Err(RobotError::UnknownKey {
                key: self.key(key.get_ref()),
                line: line_at(self.text, key.span().start),
                expected: known.join(", "),
            }),
        }
    }

    pub(super) fn find(&self, name: &str) -> Option<Entry<'a>> {
        let value = self.entries.get(name)?;
        Some(Entry::new(self.text, value, self.key(name)))
    }

    pub(super) fn missing(&self, name: &str, expected: &str) -> RobotError {
        RobotError::MissingKey {
            key: self.key(name),
            line: line_at(self.text, self.start),
            expected: expected.to_owned(),
        }
    }

    pub(super) fn require(&self, name: &str, expected: &str) -> Result<Entry<'a>, RobotError> {
        self.find(name).ok_or_else(|| self.missing(name, expected))
    }

    pub(super) fn number(&self, name: &str, bound: Bound, unit: &str) -> Result<f64, RobotError> {
        self.require(name, &bound.describe(unit))?
            .number(bound, unit)
    }

    /// A boolean value; `otherwise` if the key is missing.
    pub(super) fn flag(&self, name: &str, otherwise: bool) -> Result<bool, RobotError> {
        let Some(entry) = self.find(name) else {
            return Ok(otherwise);
        };
        let expected = || entry.refuse("true or false".to_owned());
        entry.value.as_bool().ok_or_else(expected)
    }

    /// One number per driven joint.
    pub(super) fn per_axis(
        &self,
        name: &str,
        n_axes: usize,
        unit: &str,
    ) -> Result<Vec<f64>, RobotError> {
        let expected = format!("{}, one per driven joint", array_of(n_axes, unit));
        self.require(name, &expected)?
            .numbers(n_axes, unit, expected)
    }
}

/// A value of the document, with its key and position.
pub(super) struct Entry<'a> {
    pub(super) text: &'a str,
    pub(super) value: &'a DeValue<'a>,
    pub(super) key: String,
    /// Byte at which the value starts.
    pub(super) start: usize,
}

impl<'a> Entry<'a> {
    pub(super) fn new(text: &'a str, value: &'a Spanned<DeValue<'a>>, key: String) -> Self {
        Self {
            text,
            start: value.span().start,
            value: value.get_ref(),
            key,
        }
    }

    pub(super) fn invalid(&self, expected: String, got: String) -> RobotError {
        RobotError::Invalid {
            key: self.key.clone(),
            line: line_at(self.text, self.start),
            expected,
            got,
        }
    }

    /// [`Entry::invalid`] with the value as it is in the file.
    pub(super) fn refuse(&self, expected: String) -> RobotError {
        self.invalid(expected, describe(self.value))
    }

    pub(super) fn string(&self) -> Result<&'a str, RobotError> {
        self.value
            .as_str()
            .ok_or_else(|| self.refuse("a string".to_owned()))
    }

    pub(super) fn choice<T: Copy>(&self, choices: &[(&str, T)]) -> Result<T, RobotError> {
        let text = self.value.as_str();
        let chosen = choices.iter().find(|(name, _)| text == Some(name));
        chosen
            .map(|(_, choice)| *choice)
            .ok_or_else(|| self.refuse(one_of(choices)))
    }

    pub(super) fn number(&self, bound: Bound, unit: &str) -> Result<f64, RobotError> {
        let number = match self.value {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(integer) => integer_value(integer),
            _ => None,
        };
        number
            .filter(|x| bound.allows(*x))
            .ok_or_else(|| self.refuse(bound.describe(unit)))
    }

    pub(super) fn vector<const N: usize>(&self, unit: &str) -> Result<[f64; N], RobotError> {
        let numbers = self.numbers(N, unit, array_of(N, unit))?;
        <[f64; N]>::try_from(numbers).map_err(|_| self.refuse(array_of(N, unit)))
    }

    pub(super) fn numbers(
        &self,
        n: usize,
        unit: &str,
        expected: String,
    ) -> Result<Vec<f64>, RobotError> {
        if self.value.as_array().is_none_or(|items| items.len() != n) {
            return Err(self.refuse(expected));
        }
        self.items(expected)?
            .iter()
            .map(|item| item.number(Bound::Any, unit))
            .collect()
    }

    pub(super) fn items(&self, expected: String) -> Result<Vec<Entry<'a>>, RobotError> {
        let items = self.value.as_array().ok_or_else(|| self.refuse(expected))?;
        let entry = |(i, value)| Entry::new(self.text, value, format!("{}[{}]", self.key, i + 1));
        Ok(items.iter().enumerate().map(entry).collect())
    }

    pub(super) fn section(&self) -> Result<Section<'a>, RobotError> {
        let entries = self
            .value
            .as_table()
            .ok_or_else(|| self.refuse("a table".to_owned()))?;
        Ok(Section {
            text: self.text,
            entries,
            path: self.key.clone(),
            start: self.start,
        })
    }

    pub(super) fn sections(&self) -> Result<Vec<Section<'a>>, RobotError> {
        let expected = format!("an array of tables, [[{}]]", self.key);
        self.items(expected)?.iter().map(Entry::section).collect()
    }
}

fn integer_value(integer: &DeInteger) -> Option<f64> {
    i128::from_str_radix(integer.as_str(), integer.radix())
        .ok()
        .map(|i| i as f64)
}

pub(super) fn array_of(n: usize, unit: &str) -> String {
    let plural = if n == 1 { "" } else { "s" };
    format!("an array of {n} number{plural} [{unit}]")
}

pub(super) fn one_of<T>(choices: &[(&str, T)]) -> String {
    let quoted: Vec<_> = choices
        .iter()
        .map(|(name, _)| format!("\"{name}\""))
        .collect();
    quoted.join(" or ")
}

fn describe(value: &DeValue) -> String {
    match value {
        DeValue::String(text) => format!("{text:?}"),
        DeValue::Integer(integer) => integer.to_string(),
        DeValue::Float(float) => float.to_string(),
        DeValue::Boolean(flag) => flag.to_string(),
        DeValue::Datetime(time) => time.to_string(),
        DeValue::Array(items) => format!("an array of {}", items.len()),
        DeValue::Table(_) => "a table".to_owned(),
    }
}

/// Line of a byte of the text, counted from 1.
pub(super) fn line_at(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|b| *b == b'\n').count()
}
