//! One line of bulk data into cells: free, small and large fixed field, with tabs.

/// How a cell is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Format {
    /// Not on the line at all (behind its end); reads as blank.
    Absent,
    /// Eight columns.
    Small,
    /// Sixteen columns.
    Large,
    /// Between commas.
    Free,
}

/// Where the text of one field stands; the text itself stays in the file.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// Offset of the trimmed text in the file; of the cell when it is blank.
    pub start: u32,
    /// Length of the trimmed text.
    pub len: u8,
    /// Bytes between the start of the cell and its text.
    pub lead: u8,
    /// Bytes of the whole cell.
    pub width: u8,
    /// How it is written.
    pub format: Format,
}

impl Cell {
    /// A field that is not on the line.
    pub const ABSENT: Self = Self { start: 0, len: 0, lead: 0, width: 0, format: Format::Absent };
}

/// A card or continuation line, cut into cells. Reused from line to line.
#[derive(Debug, Default)]
pub struct Line {
    /// Card name in capitals without `*`, padded with zeros; all zeros on a continuation line.
    pub name: [u8; 8],
    /// Does the line continue the card before it?
    pub continues: bool,
    /// Sixteen-column fields, four per line?
    pub large: bool,
    /// Data cells; in free field a long line may carry several times eight (four).
    pub cells: Vec<Cell>,
    /// Continuation name at the head of the line, without `+` or `*`: (offset in the file, length).
    pub head: (u32, u8),
    /// Continuation name at the end of the line.
    pub tail: (u32, u8),
}

impl Line {
    /// Data cells per physical line.
    #[must_use]
    pub fn per_line(&self) -> usize {
        if self.large { 4 } else { 8 }
    }
}

fn trim(text: &[u8]) -> (usize, usize) {
    let start = text.iter().position(|c| !c.is_ascii_whitespace()).unwrap_or(text.len());
    let end = text.iter().rposition(|c| !c.is_ascii_whitespace()).map_or(start, |last| last + 1);
    (start, end)
}

fn cell(text: &[u8], offset: usize, format: Format) -> Option<Cell> {
    let (start, end) = trim(text);
    let (start, end) = if start == end { (0, 0) } else { (start, end) };
    let len = u8::try_from(end - start).ok()?;
    // a cell padded beyond what a byte can say is patched where its text stands
    let (lead, width) = match (u8::try_from(start), u8::try_from(text.len())) {
        (Ok(lead), Ok(width)) => (lead, width),
        _ => (0, len),
    };
    Some(Cell { start: u32::try_from(offset + start).ok()?, len, lead, width, format })
}

fn name_of_continuation(text: &[u8], offset: usize) -> (u32, u8) {
    let (start, end) = trim(text);
    let marked = start < end && matches!(text[start], b'+' | b'*');
    let start = start + usize::from(marked);
    (u32::try_from(offset + start).unwrap_or(0), u8::try_from(end - start).unwrap_or(0))
}

/// Cuts `text` (no comment, no line end, not blank) that stands at `offset` in its file. The error says what is wrong.
pub fn cut(text: &[u8], offset: usize, line: &mut Line) -> Result<(), String> {
    line.cells.clear();
    line.tail = (0, 0);
    if text.contains(&b',') {
        cut_free(text, offset, line)
    } else if text.contains(&b'\t') {
        cut_tabbed(text, offset, line)
    } else {
        cut_fixed(text, offset, line)
    }
}

fn read_name(text: &[u8], offset: usize, line: &mut Line) -> Result<(), String> {
    let (start, end) = trim(text);
    let name = &text[start..end];
    line.name = [0; 8];
    line.continues = name.is_empty() || matches!(name[0], b'+' | b'*');
    line.head = (0, 0);
    if line.continues {
        line.large = name.first() == Some(&b'*');
        line.head = name_of_continuation(text, offset);
        return Ok(());
    }
    if name[0] == b'=' {
        return Err(format!(
            "'{}' replicates the card before it; replication is not supported, write the cards out",
            String::from_utf8_lossy(name)
        ));
    }
    line.large = name.ends_with(b"*");
    let name = if line.large { name[..name.len() - 1].trim_ascii_end() } else { name };
    if name.len() > 8 || !name.iter().all(u8::is_ascii_alphanumeric) {
        return Err(format!(
            "'{}' is no card name; a line of bulk data begins with a card name, a continuation mark (blank, + or *) or $",
            String::from_utf8_lossy(&name[..name.len().min(40)])
        ));
    }
    for (to, from) in line.name.iter_mut().zip(name) {
        *to = from.to_ascii_uppercase();
    }
    Ok(())
}

fn too_long() -> String {
    "a field is longer than 255 characters; a number has at most 16, is a comma missing?".to_owned()
}

fn cut_fixed(text: &[u8], offset: usize, line: &mut Line) -> Result<(), String> {
    read_name(&text[..text.len().min(8)], offset, line)?;
    let (width, format) = if line.large { (16, Format::Large) } else { (8, Format::Small) };
    let mut column = 8;
    while column < text.len().min(72) {
        let end = (column + width).min(text.len());
        line.cells.push(cell(&text[column..end], offset + column, format).ok_or_else(too_long)?);
        column += width;
    }
    if text.len() > 72 {
        line.tail = name_of_continuation(&text[72..text.len().min(80)], offset + 72);
    }
    Ok(())
}

/// A tab goes on to the next multiple of eight columns, as in an editor.
fn cut_tabbed(text: &[u8], offset: usize, line: &mut Line) -> Result<(), String> {
    let first = span_of_columns(text, 0, 8);
    read_name(&text[first.0..first.1], offset, line)?;
    let (width, format) = if line.large { (16, Format::Large) } else { (8, Format::Small) };
    for k in 0..line.per_line() {
        let (start, end) = span_of_columns(text, 8 + k * width, 8 + (k + 1) * width);
        if start == text.len() {
            break;
        }
        line.cells.push(cell(&text[start..end], offset + start, format).ok_or_else(too_long)?);
    }
    let (start, end) = span_of_columns(text, 72, 80);
    line.tail = name_of_continuation(&text[start..end], offset + start);
    Ok(())
}

/// Bytes of `text` that stand in columns `from..to`, the tab that ends them left out.
fn span_of_columns(text: &[u8], from: usize, to: usize) -> (usize, usize) {
    let mut column = 0;
    let (mut start, mut end) = (text.len(), text.len());
    for (i, &c) in text.iter().enumerate() {
        if column >= to {
            end = i;
            break;
        }
        if column >= from && start == text.len() {
            start = i;
        }
        column = if c == b'\t' { (column / 8 + 1) * 8 } else { column + 1 };
    }
    if end > start && text[end - 1] == b'\t' {
        end -= 1;
    }
    (start, end.max(start))
}

/// Ten fields a line; a longer line goes on behind the `+` (or blank) in its tenth field as the next line would.
fn cut_free(text: &[u8], offset: usize, line: &mut Line) -> Result<(), String> {
    let mut start = 0;
    let mut k = 0; // 0 is the name, then data, then the continuation field
    loop {
        let end = text[start..].iter().position(|&c| c == b',').map_or(text.len(), |n| start + n);
        let piece = &text[start..end];
        let more = end < text.len();
        if k == 0 {
            read_name(piece, offset, line)?;
            k = 1;
        } else if k <= line.per_line() {
            line.cells.push(cell(piece, offset + start, Format::Free).ok_or_else(too_long)?);
            k += 1;
        } else {
            let (from, to) = trim(piece);
            let goes_on = from == to || piece[from] == b'+';
            if more && !goes_on {
                return Err(format!(
                    "'{}' stands in field {} of a free-field line, where only a continuation mark may; \
                     break the line after {} data fields",
                    String::from_utf8_lossy(&piece[from..to.min(from + 40)]),
                    k + 1,
                    line.per_line(),
                ));
            }
            if !more {
                line.tail = name_of_continuation(piece, offset + start);
            }
            k = 1;
        }
        if !more {
            return Ok(());
        }
        start = end + 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(text: &str) -> (String, bool, Vec<String>) {
        let mut line = Line::default();
        cut(text.as_bytes(), 0, &mut line).unwrap();
        let name = String::from_utf8_lossy(&line.name).trim_end_matches('\0').to_owned();
        let read = |c: &Cell| text[c.start as usize..c.start as usize + c.len as usize].to_owned();
        (name, line.continues, line.cells.iter().map(read).collect())
    }

    #[test]
    fn the_formats_give_the_same_fields() {
        let want = (
            "GRID".to_owned(),
            false,
            vec!["1".to_owned(), String::new(), "0.5".to_owned(), "-1.".to_owned()],
        );
        for text in [
            "GRID,1,,0.5,-1.",
            "grid , 1 ,\t, 0.5,-1.",
            "GRID           1             0.5     -1.",
            "GRID\t1\t\t0.5\t-1.",
            "GRID*                  1                             0.5             -1.",
        ] {
            assert_eq!(texts(text), want, "{text}");
        }
    }

    #[test]
    fn a_long_free_line_goes_on_as_the_next_line_would() {
        let (_, _, fields) = texts("SPC1,100,12456,1,2,3,4,5,6,+,7,8,9,10");
        assert_eq!(fields, ["100", "12456", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10"]);
        let mut line = Line::default();
        assert!(cut(b"SPC1,100,12456,1,2,3,4,5,6,7,8,9,10", 0, &mut line).unwrap_err().contains("field 10"));
    }

    #[test]
    fn continuation_names_are_found_at_both_ends() {
        let mut line = Line::default();
        let text = b"+ABC    1.0     2.0                                                     +DEF";
        cut(text, 100, &mut line).unwrap();
        assert!(line.continues);
        assert_eq!((line.head, line.tail), ((101, 3), (173, 3)));
    }

    #[test]
    fn replication_is_refused_in_words() {
        let mut line = Line::default();
        assert!(cut(b"=,*1,=,==", 0, &mut line).unwrap_err().contains("replication"));
    }
}
