//! The files of a deck, kept whole: every value points into them.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use super::error::Place;

/// One file, read once.
#[derive(Debug)]
pub struct SourceFile {
    /// Path as opened.
    pub path: PathBuf,
    /// Path with links resolved; two names of one file are one file.
    pub canonical: PathBuf,
    /// The bytes as they stand on disk.
    pub text: Arc<Vec<u8>>,
    line_starts: OnceLock<Vec<u32>>,
}

impl SourceFile {
    /// Reads `path`. Files of 4 GiB and more are refused, since places are kept in 32 bits.
    pub fn open(path: &Path) -> Result<Self, String> {
        let text = std::fs::read(path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => "no such file".to_owned(),
            std::io::ErrorKind::PermissionDenied => "no permission to read it".to_owned(),
            std::io::ErrorKind::IsADirectory => "it is a folder".to_owned(),
            _ => error.to_string(),
        })?;
        if u32::try_from(text.len()).is_err() {
            return Err("larger than 4 GiB; split it with INCLUDE".to_owned());
        }
        let canonical = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        Ok(Self { path: path.to_owned(), canonical, text: Arc::new(text), line_starts: OnceLock::new() })
    }

    /// Line (from 1) on which byte `offset` stands.
    #[must_use]
    pub fn line_of(&self, offset: usize) -> usize {
        let starts = self.line_starts.get_or_init(|| {
            let breaks = self.text.iter().enumerate().filter(|(_, c)| **c == b'\n');
            // the file is smaller than 4 GiB
            std::iter::once(0).chain(breaks.map(|(i, _)| i as u32 + 1)).collect()
        });
        starts.partition_point(|&start| start as usize <= offset)
    }

    /// File and line of byte `offset`.
    #[must_use]
    pub fn place(&self, offset: usize) -> Place {
        Place { file: self.path.display().to_string(), line: self.line_of(offset) }
    }
}

/// Tries `name` beside the including file, then beside the main file; backslashes count as separators too.
pub fn open_included(name: &str, including: &Path, main: &Path) -> Result<SourceFile, String> {
    let mut names = vec![name.to_owned()];
    if name.contains('\\') {
        names.push(name.replace('\\', "/"));
    }
    let mut first_error = None;
    for base in [including, main] {
        for name in &names {
            let path = base.parent().unwrap_or(Path::new("")).join(name);
            match SourceFile::open(&path) {
                Ok(file) => return Ok(file),
                Err(reason) => first_error.get_or_insert(format!("{}: {reason}", path.display())),
            };
        }
    }
    Err(first_error.unwrap_or_default())
}

/// File name of the INCLUDE that begins `text`, and the number of bytes the statement takes.
/// `None` if it is not an INCLUDE; an error if its quotes never close.
pub fn include_name(text: &[u8]) -> Option<Result<(String, usize), String>> {
    let lead = text.iter().take_while(|c| matches!(c, b' ' | b'\t')).count();
    let word = text.get(lead..lead + 7)?;
    let mark = *text.get(lead + 7).unwrap_or(&b'\n');
    if !word.eq_ignore_ascii_case(b"INCLUDE")
        || !matches!(mark, b' ' | b'\t' | b'\'' | b'"' | b'=' | b'\r' | b'\n')
    {
        return None;
    }
    let mut i = lead + 7;
    while matches!(text.get(i), Some(b' ' | b'\t' | b'=')) {
        i += 1;
    }
    Some(match text.get(i) {
        Some(&quote @ (b'\'' | b'"')) => quoted_name(text, i + 1, quote),
        _ => bare_name(text, i),
    })
}

fn quoted_name(text: &[u8], start: usize, quote: u8) -> Result<(String, usize), String> {
    // a name broken over lines goes on behind the blanks that begin the next one; it never takes more than a few lines
    let limit = text.len().min(start + 4096);
    let Some(end) = text[start..limit].iter().position(|&c| c == quote) else {
        return Err("INCLUDE: the quote that opens the file name is never closed".to_owned());
    };
    let name = text[start..start + end]
        .split(|&c| c == b'\n')
        .map(|part| String::from_utf8_lossy(part.trim_ascii()));
    let rest = text[start + end..].iter().position(|&c| c == b'\n').unwrap_or(text.len() - start - end);
    finish(name.collect(), start + end + rest)
}

fn bare_name(text: &[u8], start: usize) -> Result<(String, usize), String> {
    let end = text[start..].iter().position(|&c| c == b'\n').map_or(text.len(), |n| start + n);
    let name = text[start..end].split(|&c| c == b'$').next().unwrap_or_default();
    finish(String::from_utf8_lossy(name.trim_ascii()).into_owned(), end)
}

fn finish(name: String, end: usize) -> Result<(String, usize), String> {
    if name.is_empty() { Err("INCLUDE without a file name".to_owned()) } else { Ok((name, end)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn include_names_are_read_in_every_spelling() {
        for (text, name) in [
            ("INCLUDE 'a.bdf'\nGRID", "a.bdf"),
            ("include \"a b.bdf\" $ comment\n", "a b.bdf"),
            ("INCLUDE a.bdf $ comment", "a.bdf"),
            ("INCLUDE'a.bdf'", "a.bdf"),
            ("INCLUDE 'dir/\n         a.bdf'\n", "dir/a.bdf"),
            ("INCLUDE 'dir/\r\n  a.bdf'\r\n", "dir/a.bdf"),
        ] {
            assert_eq!(include_name(text.as_bytes()).unwrap().unwrap().0, name, "{text}");
        }
        assert!(include_name(b"INCLUDED 3").is_none());
        assert!(include_name(b"INCLUDE 'a.bdf").unwrap().is_err());
        assert!(include_name(b"INCLUDE").unwrap().is_err());
    }

    #[test]
    fn lines_are_counted_from_one() {
        let file = SourceFile {
            path: "x".into(),
            canonical: "x".into(),
            text: Arc::new(b"a\nb\n\nc".to_vec()),
            line_starts: OnceLock::new(),
        };
        assert_eq!([0, 1, 2, 4, 5].map(|i| file.line_of(i)), [1, 1, 2, 3, 4]);
    }
}
