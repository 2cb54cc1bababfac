//! Which line a key of a TOML text is on, and which key a byte belongs to. Asked on failure only.

use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The one-based line of byte `offset`.
pub(super) fn line_at(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&b| b == b'\n').count()
}

/// The line of `key` (such as `light[1].radius`), or of the innermost table around it that is there.
pub(super) fn line_of(text: &str, key: &str) -> Option<usize> {
    let root = DeTable::parse(text).ok()?;
    let mut table = Some(root.get_ref());
    let mut found = None;
    for part in key.split('.') {
        let (name, index) = match part.strip_suffix(']').and_then(|p| p.split_once('[')) {
            Some((name, index)) => (name, index.parse::<usize>().ok()),
            None => (part, None),
        };
        let Some((key, value)) = table.and_then(|t| t.iter().find(|(k, _)| k.get_ref() == name))
        else {
            break;
        };
        let mut value: &Spanned<DeValue<'_>> = value;
        found = Some(key.span());
        if let Some(element) = index.and_then(|i| value.get_ref().get(i)) {
            value = element;
            found = Some(element.span());
        }
        table = value.get_ref().as_table();
    }
    found.map(|span| line_at(text, span.start))
}

/// The innermost key whose value holds the bytes of `span`.
pub(super) fn key_at(text: &str, span: &Range<usize>) -> Option<String> {
    let root = DeTable::parse(text).ok()?;
    let path = key_in_table(root.get_ref(), span);
    (!path.is_empty()).then_some(path)
}

fn holds(value: &Spanned<DeValue<'_>>, span: &Range<usize>) -> bool {
    value.span().start <= span.start && span.end <= value.span().end
}

fn key_in_table(table: &DeTable<'_>, span: &Range<usize>) -> String {
    for (name, value) in table.iter() {
        // The table of a `[header]` spans the header only, so its entries are tried regardless.
        let name = name.get_ref();
        let inner = match value.get_ref() {
            DeValue::Table(table) => key_in_table(table, span),
            DeValue::Array(array) => array
                .iter()
                .enumerate()
                .filter_map(|(i, element)| match element.get_ref() {
                    DeValue::Table(table) => match key_in_table(table, span) {
                        inner if !inner.is_empty() => Some(format!("[{i}].{inner}")),
                        _ => holds(element, span).then(|| format!("[{i}]")),
                    },
                    _ => None,
                })
                .next()
                .unwrap_or_default(),
            _ => String::new(),
        };
        if !inner.is_empty() {
            let dot = if inner.starts_with('[') { "" } else { "." };
            return format!("{name}{dot}{inner}");
        }
        if holds(value, span) {
            return name.to_string();
        }
    }
    String::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "name = 'x'\n[camera]\neye = [1, 2,\n 3]\n\n[[light]]\na = 1\n[[light]]\nb = { c = 2 }\n";

    #[test]
    fn keys_have_lines() {
        let lines = [
            ("name", Some(1)),
            ("camera", Some(2)),
            ("camera.eye", Some(3)),
            ("camera.fov_degrees", Some(2)),
            ("light[0].a", Some(7)),
            ("light[1].missing", Some(8)),
            ("light[1].b.c", Some(9)),
            ("size", None),
        ];
        for (key, line) in lines {
            assert_eq!(line_of(TEXT, key), line, "{key}");
        }
    }

    #[test]
    fn bytes_have_keys() {
        let key = |at: &str| {
            let start = TEXT.find(at).unwrap();
            key_at(TEXT, &(start..start + 1))
        };
        assert_eq!(key("'x'").unwrap(), "name");
        assert_eq!(key("2,").unwrap(), "camera.eye");
        assert_eq!(key("2 }").unwrap(), "light[1].b.c");
    }
}
