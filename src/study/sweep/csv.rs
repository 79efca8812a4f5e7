//! CSV records and fields, with quoted cells (commas, quotes, line feeds).

/// The records of a text, each to be read by [`fields`]. A line feed between quotes belongs to a cell.
pub fn records(text: &str) -> impl Iterator<Item = &str> {
    let mut quoted = false;
    let ends = move |c: char| {
        quoted ^= c == '"';
        c == '\n' && !quoted
    };
    text.split_terminator(ends)
        .map(|record| record.strip_suffix('\r').unwrap_or(record))
}

/// The cells of a record.
pub fn fields(record: &str) -> Vec<String> {
    let (mut quoted, mut out) = (false, vec![String::new()]);
    let mut letters = record.chars().peekable();
    while let Some(c) = letters.next() {
        match (c, quoted) {
            ('"', true) if letters.peek() == Some(&'"') => {
                letters.next();
            }
            ('"', _) => {
                quoted = !quoted;
                continue;
            }
            (',', false) => {
                out.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(last) = out.last_mut() {
            last.push(c);
        }
    }
    out
}
