//! The bulk-data cards this reader knows, and what it does with each.

/// What becomes of a card.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Read into the model.
    Used,
    /// Without influence on K, M and C of a modal analysis: counted, reported once.
    Ignored,
    /// Would change K, M or C and is not supported; the text says what to do.
    Refused(&'static str),
}

const USED: &str = "BAROR BEAMOR CBAR CBEAM CBUSH CDAMP1 CDAMP2 CDAMP3 CDAMP4 CELAS1 CELAS2 CELAS3 CELAS4 CHEXA CMASS1 CMASS2 CMASS3 CMASS4 CONM1 CONM2 CONROD \
    CORD1C CORD1R CORD1S CORD2C CORD2R CORD2S CPENTA CPYRAM CQUAD4 CROD CTETRA CTRIA3 DDVAL DMIG EIGR EIGRL GRDSET GRID MAT1 MAT2 MAT8 MAT9 MPC MPCADD \
    PARAM PBAR PBARL PBEAM PBEAML PBUSH PCOMP PCOMPG PDAMP PELAS PMASS PROD PSHELL PSOLID RBAR RBE2 RBE3 RGYRO ROTORD ROTORG RSPINR RSPINT SPC SPC1 SPCADD SPOINT";

const IGNORED: &str = "ACCEL ACCEL1 ACMODL AECOMP AEFACT AELINK AELIST AEPARM AERO AEROS AESTAT AESURF ASET ASET1 BCTSET BNDFIX \
    BNDFIX1 BNDFREE BNDFREE1 BSET BSET1 CAERO1 CAERO2 CAERO3 CAERO4 CAERO5 CBARAO CHBDYE CHBDYG CHBDYP CONV CSET CSET1 \
    DAREA DCONADD DCONSTR DEFORM DELAY DESVAR DLINK DLOAD DMI DOPTPRM DPHASE DRESP1 DRESP2 DRESP3 DSCREEN DTABLE \
    DTI DVCREL1 DVCREL2 DVGRID DVMREL1 DVMREL2 DVPREL1 DVPREL2 ECHOOFF ECHOON EIGB EIGC EIGP FLFACT FLUTTER FORCE FORCE1 \
    FORCE2 FREQ FREQ1 FREQ2 FREQ3 FREQ4 FREQ5 GRAV GUST LOAD LOADT LSEQ MAT4 MAT5 MATS1 MATT1 MDLPRM MKAERO1 MKAERO2 \
    MOMENT MOMENT1 MOMENT2 MONPNT1 NLPARM NLPCI NOLIN1 NOLIN2 NOLIN3 NOLIN4 OMIT OMIT1 PAERO1 PAERO2 PAERO3 PAERO4 PAERO5 \
    PBUSHT PCONV PDAMPT PELAST PHBDY PLOAD PLOAD1 PLOAD2 PLOAD4 PLOADX1 PLOTEL PLOTEL3 PLOTEL4 QBDY1 QBDY2 QBDY3 QSET QSET1 QVOL RADBC RADM RADSET VIEW VIEW3D \
    RANDPS RANDT1 REFROTR RFORCE RLOAD1 RLOAD2 ROTHYBD SESET SET1 SET2 SET3 SLOAD SPCD SPLINE1 SPLINE2 SPLINE4 SPLINE5 \
    SUPORT SUPORT1 TABDMP1 TABLED1 TABLED2 TABLED3 TABLED4 TABLEM1 TABLEM2 TABLEM3 TABLEM4 TABLES1 TABLEST TABRND1 TABRNDG \
    TEMP TEMPD TEMPP1 TEMPRB TF TIC TLOAD1 TLOAD2 TRIM TSTEP TSTEPNL UNBALNC USET USET1 UXVEC";

const REFUSED: &[(&str, &str)] = &[
    ("CSHEAR PSHEAR", "shear panels carry stiffness; model them with CQUAD4"),
    ("CQUADR CTRIAR", "use CQUAD4 or CTRIA3"),
    ("CQUAD8 CTRIA6 CQUAD CTRIAX CTRIAX6 CQUADX", "use CQUAD4 or CTRIA3"),
    ("PCOMPLS PBCOMP", "layered solids and beams are not read; use PSOLID (PBEAM) with equivalent values"),
    (
        "PBMSECT PBRSECT PTUBE CTUBE CBEND PBEND CBEAM3 PBEAM3",
        "use CBAR, CBEAM or CROD with PBAR, PBEAM or PROD",
    ),
    ("CDAMP5", "this dashpot is not read; use CDAMP4"),
    ("EPOINT", "extra points of control systems are not read; use SPOINT"),
    ("CVISC PVISC", "use CDAMP2 or CBUSH"),
    ("CBUSH1D PBUSH1D CBUSH2D PBUSH2D", "use CBUSH"),
    ("CGAP PGAP", "a gap has a stiffness that depends on contact; use CELAS2 for its linear part"),
    (
        "CFAST PFAST CWELD PWELD CSEAM PSEAM BGSET BGADD BSURFS BCTABLE BCONP BLSEG",
        "fasteners and glue tie parts together; use CBUSH or RBE2",
    ),
    ("MAT3 MAT10 MAT11 MATHP MATHE", "this material is not read; use MAT1, MAT2, MAT8 or MAT9"),
    ("RBAR1 RBE1 RROD RTRPLT RTRPLT1 RSPLINE RJOINT RSSCON", "use RBAR, RBE2, RBE3 or MPC"),
    ("DMIGROT DMIAX DMIJ DMIJI DMIK", "this direct matrix input is not read; use DMIG"),
    ("GENEL CDUM1", "this element is not read"),
    (
        "NSM NSM1 NSMADD NSML NSML1",
        "non-structural mass; write it in the NSM field of the property or as CONM2",
    ),
    ("MPCY SPCOFF SPCOFF1 SPCR", "use MPC, SPC or SPC1"),
    (
        "CSUPER CSUPEXT SEBULK SECONCT SEBNDRY SEELT SEEXCLD SELABEL SELOC SEMPLN SENQSET SETREE RELEASE EXTRN",
        "superelements are not read; femend op4-to-dmig puts their reduced matrices into a deck",
    ),
    ("PLSOLID PLPLANE PSHEARN PAABSF CAABSF CFLUID2 CFLUID3 CFLUID4", "this property or element is not read"),
    ("CORD3G CORD3R GMCORD", "use CORD2R, CORD2C or CORD2S"),
    (
        "CYAX CYJOIN CYSUP CYSYM LOADCYN",
        "a sector of a cyclic structure is not closed to the whole; model the whole, or tie its sides by MPC",
    ),
    (
        "ROTORAX ROTORSE ROTOR RSETID",
        "rotors of solids, of sectors and superelements are not read; use a line model with ROTORG",
    ),
    ("SNORM", "shell normals by card are not read"),
];

/// Index of a card name in [`Names`].
pub type NameId = u16;

/// The table, ordered by name.
pub struct Names {
    rows: Vec<([u8; 8], &'static str, Role)>,
}

impl Default for Names {
    fn default() -> Self {
        Self::new()
    }
}

impl Names {
    /// Builds the table.
    #[must_use]
    pub fn new() -> Self {
        let used = USED.split_whitespace().map(|name| (name, Role::Used));
        let ignored = IGNORED.split_whitespace().map(|name| (name, Role::Ignored));
        let refused = REFUSED
            .iter()
            .flat_map(|(names, why)| names.split_whitespace().map(move |name| (name, Role::Refused(why))));
        let mut rows: Vec<_> =
            used.chain(ignored).chain(refused).map(|(name, role)| (key(name), name, role)).collect();
        rows.sort_by_key(|row| row.0);
        Self { rows }
    }

    /// Number of names.
    #[must_use]
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// Finds a name in capitals, padded with zeros.
    #[must_use]
    pub fn find(&self, name: &[u8; 8]) -> Option<NameId> {
        self.rows.binary_search_by(|row| row.0.cmp(name)).ok().and_then(|i| u16::try_from(i).ok())
    }

    /// Finds a name in any case.
    #[must_use]
    pub fn find_text(&self, name: &str) -> Option<NameId> {
        (name.len() <= 8).then(|| self.find(&key(&name.to_ascii_uppercase()))).flatten()
    }

    /// The name as text.
    #[must_use]
    pub fn text(&self, id: NameId) -> &'static str {
        self.rows[usize::from(id)].1
    }

    /// What becomes of the card.
    #[must_use]
    pub fn role(&self, id: NameId) -> Role {
        self.rows[usize::from(id)].2
    }

    /// The known name that differs least from `name`, when it differs in one or two characters.
    #[must_use]
    pub fn nearest(&self, name: &str) -> Option<&'static str> {
        let distance = |known: &str| edit_distance(name.as_bytes(), known.as_bytes());
        let best = self.rows.iter().min_by_key(|row| (distance(row.1), row.2 != Role::Used))?;
        (distance(best.1) <= 1 + usize::from(name.len() > 4)).then_some(best.1)
    }
}

fn key(name: &str) -> [u8; 8] {
    let mut key = [0; 8];
    for (to, from) in key.iter_mut().zip(name.bytes()) {
        *to = from;
    }
    key
}

fn edit_distance(a: &[u8], b: &[u8]) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let next = (diagonal + usize::from(x != y)).min(row[j] + 1).min(row[j + 1] + 1);
            diagonal = row[j + 1];
            row[j + 1] = next;
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_stands_once_and_is_found() {
        let names = Names::new();
        for pair in names.rows.windows(2) {
            assert!(pair[0].0 < pair[1].0, "{} twice", pair[1].1);
        }
        for row in &names.rows {
            assert!(row.1.len() <= 8);
            assert_eq!(names.find_text(&row.1.to_lowercase()).map(|id| names.text(id)), Some(row.1));
        }
    }

    #[test]
    fn a_slip_of_the_pen_finds_its_name() {
        let names = Names::new();
        assert_eq!(names.nearest("CQAUD4"), Some("CQUAD4"));
        assert_eq!(names.nearest("ZZZZZZZZ"), None);
    }
}
