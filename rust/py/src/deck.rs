//! Nastran decks.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use femend_fem::deck::{CardRef, Change, Deck, DeckError, Space};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

mod errors {
    pyo3::import_exception!(femend.errors, DeckError);
}

/// A deck error as `femend.errors.DeckError` with its file, line and card.
pub(crate) fn deck_error(py: Python<'_>, error: &DeckError) -> PyErr {
    let make = || -> PyResult<PyErr> {
        let keywords = PyDict::new(py);
        keywords.set_item("file", error.file())?;
        keywords.set_item("line", error.line())?;
        keywords.set_item("card", error.card())?;
        let class = py.get_type::<errors::DeckError>();
        Ok(PyErr::from_value(class.call((error.to_string(),), Some(&keywords))?))
    };
    make().unwrap_or_else(|other| other)
}

/// A Nastran bulk-data deck: cards, case control, and where everything stands.
#[pyclass(name = "Deck", module = "femend._core", frozen)]
pub(crate) struct PyDeck {
    pub(crate) deck: Arc<Deck>,
}

type Element<'py> = (u32, &'static str, Option<u32>, Bound<'py, PyTuple>);

impl PyDeck {
    fn points(&self, scalar: bool) -> Vec<i64> {
        let entries = self.deck.ids(Space::Node).iter().filter(|entry| entry.scalar == scalar);
        entries.map(|entry| i64::from(entry.id)).collect()
    }

    fn space(kind: &str) -> Option<Space> {
        Some(match kind {
            "node" => Space::Node,
            "coord" => Space::Coord,
            "element" => Space::Element,
            "mass" => Space::Mass,
            "rigid" => Space::Rigid,
            "property" => Space::Property,
            "bush" => Space::Bush,
            "spring" => Space::Spring,
            "damper" => Space::Damper,
            "material" => Space::Material,
            _ => return None,
        })
    }
}

#[pymethods]
impl PyDeck {
    /// Reads a deck and the files it includes. Raises `DeckError`.
    #[staticmethod]
    #[pyo3(signature = (path))]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let deck = py.detach(|| Deck::read(&path)).map_err(|error| deck_error(py, &error))?;
        Ok(Self { deck: Arc::new(deck) })
    }

    /// Path of the main file.
    #[getter]
    fn path(&self) -> String {
        self.deck.path()
    }

    /// Paths of all files, the main one first.
    #[getter]
    fn files(&self) -> Vec<String> {
        self.deck.files().iter().map(|path| path.display().to_string()).collect()
    }

    /// Number of cards of each name that was read.
    #[pyo3(signature = ())]
    fn card_counts(&self) -> BTreeMap<&'static str, usize> {
        self.deck.card_counts()
    }

    /// Number of cards of each name that has no influence on a modal analysis and was left out.
    #[pyo3(signature = ())]
    fn ignored(&self) -> BTreeMap<&'static str, usize> {
        self.deck.ignored()
    }

    /// Executive and case control of the first subcase, names in capitals.
    #[pyo3(signature = ())]
    fn case_control(&self) -> BTreeMap<String, String> {
        self.deck.case_control().clone()
    }

    /// Case control of the subcases behind the first, in order, which have no part in the model.
    #[pyo3(signature = ())]
    fn later_subcases(&self) -> Vec<(String, String)> {
        self.deck.later_subcases().to_vec()
    }

    /// PARAM values as written, names in capitals.
    #[pyo3(signature = ())]
    fn params(&self) -> BTreeMap<String, String> {
        self.deck.params()
    }

    /// Ids of all GRIDs, ascending, (n,).
    #[getter]
    fn node_ids<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.points(false).into_pyarray(py)
    }

    /// Ids of all scalar points, ascending, (n,).
    #[getter]
    fn scalar_points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.points(true).into_pyarray(py)
    }

    /// Positions of the nodes in basic coordinates, (n, 3). Raises `DeckError`.
    #[getter]
    fn xyz<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let xyz = py.detach(|| self.deck.positions()).map_err(|error| deck_error(py, &error))?;
        let flat = ndarray::Array2::from_shape_fn((xyz.len(), 3), |(i, j)| xyz[i][j]);
        Ok(flat.into_pyarray(py))
    }

    /// Coordinates (n, 3) of basic points `xyz` (n, 3) as fields 4 to 6 of the GRIDs `ids` (n,) have them, in the system
    /// each is given in, angles in degrees. Raises `DeckError`.
    #[pyo3(signature = (ids, xyz))]
    fn grid_coordinates<'py>(
        &self,
        py: Python<'py>,
        ids: Vec<u32>,
        xyz: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points: Vec<[f64; 3]> = xyz.as_array().rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect();
        let found = py.detach(|| self.deck.grid_coordinates(&ids, &points));
        let found = found.map_err(|error| deck_error(py, &error))?;
        Ok(ndarray::Array2::from_shape_fn((found.len(), 3), |(i, j)| found[i][j]).into_pyarray(py))
    }

    /// (id, card, property id or None, node ids) of every element. Raises `DeckError`.
    #[pyo3(signature = ())]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Vec<Element<'py>>> {
        let rows = py.detach(|| self.deck.elements()).map_err(|error| deck_error(py, &error))?;
        rows.into_iter()
            .map(|row| Ok((row.id, row.card, row.property, PyTuple::new(py, row.nodes)?)))
            .collect()
    }

    /// File and line of a card. Raises `DeckError` if it is not there.
    #[pyo3(signature = (card, id))]
    fn find(&self, py: Python<'_>, card: &str, id: u32) -> PyResult<(String, usize)> {
        let (found, _) = self.deck.find(card, id).map_err(|error| deck_error(py, &error))?;
        let place = found.place();
        Ok((place.file, place.line))
    }

    /// Text of a field, by Nastran's field number; empty when blank. Raises `DeckError` if the card is not there.
    #[pyo3(signature = (card, id, field))]
    fn field_text(&self, py: Python<'_>, card: &str, id: u32, field: usize) -> PyResult<String> {
        let (found, shift) = self.deck.find(card, id).map_err(|error| deck_error(py, &error))?;
        Ok(String::from_utf8_lossy(found.text(field.saturating_add(shift))).into_owned())
    }

    /// Text of the fields behind the name of every card `name`, in the order of the deck, continuation marks left out; empty
    /// when blank. Cards that are only counted (`ignored`) are not there.
    #[pyo3(signature = (name))]
    fn cards(&self, name: &str) -> Vec<Vec<String>> {
        let texts = |card: CardRef<'_>| {
            card.fields_from(2).map(|field| String::from_utf8_lossy(card.text(field)).into_owned()).collect()
        };
        self.deck.cards(name).map(texts).collect()
    }

    /// Third axis, basic coordinates, of the coordinate system that `field` of the `number`th card `card` (from 0) names; of
    /// the basic one where it is blank. Raises `DeckError`, `IndexError` where there is no such card.
    #[pyo3(signature = (card, number, field))]
    fn third_axis(&self, py: Python<'_>, card: &str, number: usize, field: usize) -> PyResult<[f64; 3]> {
        let Some(found) = self.deck.cards(card).nth(number) else {
            let what = format!("the deck has no {card} number {number}");
            return Err(pyo3::exceptions::PyIndexError::new_err(what));
        };
        self.deck.third_axis(found, field).map_err(|error| deck_error(py, &error))
    }

    /// Largest id of a kind plus one.
    #[pyo3(signature = (kind))]
    fn next_id(&self, kind: &str) -> PyResult<u32> {
        let space = Self::space(kind).ok_or_else(|| {
            let known = "node, coord, element, mass, rigid, property, bush, spring, damper or material";
            pyo3::exceptions::PyValueError::new_err(format!("kind '{kind}' is none of {known}"))
        })?;
        Ok(self.deck.next_id(space))
    }

    /// Files that differ once the changes (card, id, field, value) are made and the lines are added. Raises `DeckError`.
    #[pyo3(signature = (changes, additions))]
    fn patched<'py>(
        &self,
        py: Python<'py>,
        changes: Vec<(String, u32, usize, f64)>,
        additions: Vec<String>,
    ) -> PyResult<BTreeMap<String, Bound<'py, PyBytes>>> {
        let change = |(card, id, field, value)| Change { card, id, field, value };
        let changes: Vec<Change> = changes.into_iter().map(change).collect();
        let files =
            py.detach(|| self.deck.patched(&changes, &additions)).map_err(|error| deck_error(py, &error))?;
        Ok(files
            .into_iter()
            .map(|(path, text)| (path.display().to_string(), PyBytes::new(py, &text)))
            .collect())
    }

    fn __repr__(&self) -> String {
        let cards: usize = self.deck.card_counts().values().sum();
        format!("Deck('{}', {} nodes, {cards} cards)", self.deck.path(), self.points(false).len())
    }
}

/// Adds this file's classes and functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyDeck>()
}
