//! What can be wrong with a deck. Every message names file, line, card and what to do.

use std::fmt;

/// Result of reading or using a deck.
pub type Result<T> = std::result::Result<T, DeckError>;

/// A place in a deck.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Path of the file as it was opened.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file, self.line)
    }
}

/// A place together with the card that stands there, e.g. `MAT1 12`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct At {
    /// Place of the card, or of the wrong line inside it.
    pub place: Place,
    /// Card name and id, or the name alone.
    pub card: String,
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.card)
    }
}

/// Everything that can be wrong with a bulk-data deck.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DeckError {
    /// The main file cannot be opened.
    #[error("{file}: cannot be read: {reason}")]
    Open {
        /// Path as given.
        file: String,
        /// The system's reason.
        reason: String,
    },
    /// An included file cannot be opened.
    #[error(
        "{place}: INCLUDE '{file}' cannot be read: {reason}; the name is taken relative to the including file"
    )]
    Include {
        /// The INCLUDE line.
        place: Place,
        /// Name as written.
        file: String,
        /// The system's reason.
        reason: String,
    },
    /// A file that includes itself, directly or through others.
    #[error("{place}: INCLUDE '{file}' is circular: {chain}; remove this INCLUDE")]
    CircularInclude {
        /// The INCLUDE line.
        place: Place,
        /// Name as written.
        file: String,
        /// The files from the first occurrence to here.
        chain: String,
    },
    /// A line that is no card, continuation, comment or command.
    #[error("{place}: {what}")]
    Line {
        /// The line.
        place: Place,
        /// What is wrong with it and what to do.
        what: String,
    },
    /// A field that cannot be understood.
    #[error("{at}, field {field}: '{text}' is not {expected}")]
    Field {
        /// The card; the line is the field's own.
        at: Box<At>,
        /// Nastran field number.
        field: usize,
        /// Field as written.
        text: String,
        /// What was expected.
        expected: &'static str,
    },
    /// A required field that is blank.
    #[error("{at}, field {field}: blank, but {expected} is required ({what})")]
    MissingField {
        /// The card.
        at: Box<At>,
        /// Nastran field number.
        field: usize,
        /// Meaning of the field.
        what: &'static str,
        /// Kind of value.
        expected: &'static str,
    },
    /// Fields that are readable but do not make sense together.
    #[error("{at}: {what}")]
    Value {
        /// The card.
        at: Box<At>,
        /// Fact and remedy.
        what: String,
    },
    /// Two cards with the same id.
    #[error("{at}: id already used by {other}; ids must be unique, renumber or remove one of the two")]
    Duplicate {
        /// The second card.
        at: Box<At>,
        /// The first card, with its place.
        other: Box<At>,
    },
    /// A card that is not in the table of known cards.
    #[error("{at} is not a known bulk-data card{hint}")]
    UnknownCard {
        /// The card.
        at: Box<At>,
        /// `; did you mean ...?` or nothing.
        hint: String,
    },
    /// A card that changes K, M or C and is not supported.
    #[error("{at} is not supported: {why}{others}")]
    Unsupported {
        /// The first such card.
        at: Box<At>,
        /// What it would do.
        why: String,
        /// Other unsupported cards of the deck, or nothing.
        others: String,
    },
    /// A card that refers to something the deck does not define.
    #[error("{at}, field {field}: {kind} {id} is not defined in the deck")]
    MissingReference {
        /// The referring card.
        at: Box<At>,
        /// Nastran field number.
        field: usize,
        /// `GRID`, `material`, ...
        kind: &'static str,
        /// The id.
        id: u32,
    },
    /// A case-control selection or an argument that selects nothing.
    #[error("{file}: {what}")]
    Selection {
        /// Main file.
        file: String,
        /// Fact and remedy.
        what: String,
    },
    /// A change that cannot be written into the deck.
    #[error("{file}: {what}")]
    Patch {
        /// File of the field, or the main file.
        file: String,
        /// Fact and remedy.
        what: String,
    },
}

impl DeckError {
    fn at(&self) -> Option<&At> {
        match self {
            Self::Field { at, .. }
            | Self::MissingField { at, .. }
            | Self::Value { at, .. }
            | Self::Duplicate { at, .. }
            | Self::UnknownCard { at, .. }
            | Self::Unsupported { at, .. }
            | Self::MissingReference { at, .. } => Some(at),
            _ => None,
        }
    }

    fn place(&self) -> Option<&Place> {
        match self {
            Self::Include { place, .. } | Self::CircularInclude { place, .. } | Self::Line { place, .. } => {
                Some(place)
            }
            _ => self.at().map(|at| &at.place),
        }
    }

    /// File the message is about.
    #[must_use]
    pub fn file(&self) -> &str {
        match self {
            Self::Open { file, .. } | Self::Selection { file, .. } | Self::Patch { file, .. } => file,
            _ => self.place().map_or("", |place| &place.file),
        }
    }

    /// Line, from 1; `None` when the message is about the deck as a whole.
    #[must_use]
    pub fn line(&self) -> Option<usize> {
        self.place().map(|place| place.line)
    }

    /// Card name and id; `None` when no card is concerned.
    #[must_use]
    pub fn card(&self) -> Option<&str> {
        self.at().map(|at| at.card.as_str())
    }
}
