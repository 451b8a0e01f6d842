//! Whatever the bytes, reading, building and patching end in a value or a typed error, never in a panic.

use std::path::PathBuf;

use femend_fem::deck::{Change, Deck, DeckError, Selection, build};
use proptest::prelude::*;

const SEED: &str = "SOL 103\nCEND\nSPC = 1\nMPC = 3\nBEGIN BULK\nGRID,1,,0.,0.,0.\nGRID           2       5     1.5     0.0     0.0       5     456\n\
GRID*                  3                            3.0             0.0\n*                    0.0\nGRID\t4\t\t1.\t1.\t0.\n\
CORD2C,5,,0.,0.,0.,0.,0.,1.\n+,1.,0.,0.\nCORD1R,6,1,3,4\nMAT1    1       2.1+11          .3      7850.\n\
PBAR,1,1,1.D-4,1.-9,1.-9,2.-9\nPBARL,2,1,,BOX\n+,4.,6.,.3,.2\nPBEAM,3,1,4.,8.,6.,,2.\n+,YES,1.,2.,4.,3.,,1.\n+,0.,0.\n+,.5,.6\n\
PBEAML,4,1,,BAR\n+,1.,2.,,YES,1.,1.,1.\nCBAR,1,1,1,2,0.,1.,0.,GOO\n+,4,5,.1,.2,.3\nCBEAM,2,3,1,3,4\nPSHELL,8,1,.1,1\nCQUAD4,3,8,1,2,3,4\n\
PSOLID,9,1\nCTETRA,4,9,1,2,3,4\nPBUSH,7,K,1.,2.\n+,,GE,.1\nCBUSH,5,7,1,,,,,0\nCONM2,9,3,,2.5\n+,1.\nCONM1,10,3,,1.\n\
RBE2,91,1,123,3\nRBE3,92,,4,123,1.,123,1,2\n+,UM,1,12\nMPC,3,1,1,1.,2,1,-1.\nSPC1,1,123456,1,THRU,3\nSPCADD,2,1\nPELAS,1,5.,,,2,6.\n\
CELAS1,20,2,1,1,2,1\nCELAS2,21,5.,1,1\nPDAMP,1,1.\nCDAMP1,22,1,1,1\nCDAMP2,23,1.,2,2\nCMASS2,24,1.,2,2\nPROD,30,1,1.,1.\nCROD,31,30,1,2\nENDDATA\n";

const TOKENS: [&str; 24] = [
    ",",
    ",,",
    "\n",
    "\r\n",
    "\t",
    "+",
    "*",
    "$",
    "=",
    "THRU",
    "-1",
    "0",
    "1",
    "2147483647",
    "99999999999",
    "1.",
    "1.+999",
    "-",
    "'",
    "INCLUDE '",
    "ENDDATA",
    "BEGIN BULK",
    "\u{fffd}",
    "        ",
];

fn run(text: &[u8], name: &str) -> Result<(), DeckError> {
    let path: PathBuf = std::env::temp_dir().join(format!("femend-fuzz-{}-{name}.bdf", std::process::id()));
    std::fs::write(&path, text).unwrap();
    let read = Deck::read(&path);
    let _ = std::fs::remove_file(&path);
    let deck = read?;
    let _ = deck.elements();
    let changes = [("MAT1", 3), ("CONM2", 5), ("GRID", 4), ("PELAS", 3)];
    let changes =
        changes.map(|(card, field)| Change { card: card.to_owned(), id: 1, field, value: -1.234_567_89e-7 });
    for change in changes {
        let _ = deck.patched(&[change], &["GRID,99".to_owned()]);
    }
    build(&deck, &Selection::default()).map(|_| ())
}

#[test]
fn the_seed_itself_is_a_whole_model() {
    run(SEED.as_bytes(), "seed").unwrap_or_else(|error| panic!("{error}"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_mutated_deck_never_panics(edits in prop::collection::vec((any::<prop::sample::Index>(), 0..8_usize, 0..TOKENS.len()), 1..6)) {
        let mut text = SEED.as_bytes().to_vec();
        for (at, cut, token) in edits {
            let start = at.index(text.len());
            let end = (start + cut).min(text.len());
            text.splice(start..end, TOKENS[token].bytes());
        }
        if let Err(error) = run(&text, "mutated") {
            prop_assert!(!error.to_string().is_empty() && !error.file().is_empty());
        }
    }

    #[test]
    fn swapped_lines_never_panic(seed in prop::collection::vec(any::<prop::sample::Index>(), 2..40)) {
        let lines: Vec<&str> = SEED.lines().collect();
        let text: String = seed.iter().map(|at| format!("{}\n", at.get(&lines))).collect();
        let _ = run(text.as_bytes(), "swapped");
    }

    #[test]
    fn arbitrary_bytes_never_panic(mut text in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = run(&text, "bytes");
        text.splice(0..0, b"BEGIN BULK\n".iter().copied());
        let _ = run(&text, "bulk");
    }
}
