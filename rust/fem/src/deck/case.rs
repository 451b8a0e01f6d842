//! Executive and case control: what a modal analysis needs of it.

use std::collections::BTreeMap;

/// Commands in force for the first subcase, names in capitals without options, e.g. `SPC` = `1`, `SOL` = `103`.
#[derive(Debug, Clone, Default)]
pub struct CaseControl {
    commands: BTreeMap<String, String>,
    params: Vec<(String, String)>,
    subcases: usize,
    continued: bool,
    later: Vec<(String, String)>,
}

impl CaseControl {
    /// Takes a line of the executive section (comment and line end removed).
    pub fn executive(&mut self, line: &str) {
        let mut words =
            line.split(|c: char| c.is_whitespace() || c == '=' || c == ',').filter(|word| !word.is_empty());
        if words.next().is_some_and(|word| word.eq_ignore_ascii_case("SOL"))
            && let Some(solution) = words.next()
        {
            self.commands.insert("SOL".to_owned(), solution.to_ascii_uppercase());
        }
    }

    /// Takes a line of the case-control section. Of several subcases the first counts; what stands above it holds too.
    pub fn case(&mut self, line: &str) {
        let line = line.trim();
        let continues = std::mem::replace(&mut self.continued, line.ends_with(','));
        if continues || line.is_empty() {
            return;
        }
        let end = line.find(|c: char| c.is_whitespace() || "=(,".contains(c)).unwrap_or(line.len());
        let name = line[..end].to_ascii_uppercase();
        if matches!(name.as_str(), "SUBCASE" | "SUBCOM" | "SYM" | "REPCASE") {
            self.subcases += 1;
        }
        let mut rest = line[end..].trim_start();
        if name == "PARAM" && self.subcases < 2 {
            let mut words = rest.split(',').map(str::trim).filter(|word| !word.is_empty());
            if let (Some(key), Some(value)) = (words.next(), words.next()) {
                self.params.push((key.to_ascii_uppercase(), value.to_owned()));
            }
            return;
        }
        if rest.starts_with('(') {
            rest = rest.find(')').map_or("", |close| rest[close + 1..].trim_start());
        }
        let value = rest.strip_prefix('=').unwrap_or(rest).trim();
        if self.subcases > 1 {
            self.later.push((name, value.to_owned()));
        } else if name != "SET" {
            self.commands.insert(name, value.to_owned());
        }
    }

    /// Commands of the subcases behind the first, in order: they have no part in the model.
    #[must_use]
    pub fn later(&self) -> &[(String, String)] {
        &self.later
    }

    /// Name to value, as written.
    #[must_use]
    pub fn commands(&self) -> &BTreeMap<String, String> {
        &self.commands
    }

    /// PARAM commands, in order.
    #[must_use]
    pub fn params(&self) -> &[(String, String)] {
        &self.params
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_subcase_wins_over_the_rest() {
        let mut case = CaseControl::default();
        case.executive("SOL 103");
        for line in [
            "SPC = 1",
            "SET 2 = 1,2,",
            "SPC = 99",
            "METHOD(STRUCTURE) = 7",
            "SUBCASE 1",
            "  MPC=4",
            "  SPC = 2",
            "SUBCASE 2",
            "  SPC = 3",
        ] {
            case.case(line);
        }
        let value = |name: &str| case.commands().get(name).map(String::as_str);
        assert_eq!(value("SOL"), Some("103"));
        assert_eq!(value("SPC"), Some("2"));
        assert_eq!(value("MPC"), Some("4"));
        assert_eq!(value("METHOD"), Some("7"));
        let later = [("SUBCASE", "2"), ("SPC", "3")];
        assert_eq!(case.later(), later.map(|(name, value)| (name.to_owned(), value.to_owned())));
    }
}
