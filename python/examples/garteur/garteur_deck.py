"""Writes `model.bdf`: the GARTEUR SM-AG19 testbed as beams, from its published drawing.

python python/examples/garteur/garteur_deck.py

No number here was fitted: dimensions are those of the drawing, materials what a handbook gives, joints an order of
magnitude, and the mass that the drawing does not account for is what is missing to the weighed 44 kg. Sources are named
in the deck and in `garteur.py`. They differ about the damping treatment: 0.05 mm of tape below a sheet of 1.1 mm, as
here (a tape of this thickness is sold), or a layer of 1.1 mm below one of 1 mm (`deck(THICK_LAYER)`). What kind of
assumption stands for joints, plate and layer was settled with the published frequencies in view, its values were not.
"""

from __future__ import annotations

from itertools import pairwise
from math import pi, sqrt
from pathlib import Path

# aluminium, as in the testbed's first models (GARTEUR TP-115); steel of the wing plate and the angles on the fin
E, NU, RHO, STEEL, STEEL_E = 72.0e9, 0.3, 2700.0, 7850.0, 210.0e9
WEIGHED = 44.0
# m: places of the drawing, x forward from the wing's middle, y left, z up from the axis of the fuselage
NOSE, TAIL, FIN_X, COLLAR_X = 0.6, -0.9, -0.85, -0.29
FUSELAGE = (0.05, 0.15)  # width, height
CHORD, THICK = 0.1, 0.01  # of wing, drums, fin and tailplane
PLATE = (0.13, 0.07, 0.016)  # steel plate between fuselage and wing, along x, y, z
SPAN, DRUM_Y, DRUM_X, FIN_Z, TAILPLANE = 1.0, 0.95, 0.2, 0.3, 0.2  # half lengths, but for the fin's height
ANGLE = (0.015, 0.015, 0.1)  # two of them hold the tailplane on the fin
LAYER_Y, LAYER_B, LAYER_RHO = 0.85, 0.0762, 1000.0
# thickness of damping layer and constraining sheet: two readings of the sources
TAPE, THICK_LAYER = (5.0e-5, 1.1e-3), (1.1e-3, 1.0e-3)
LAYER_X = -CHORD / 2 + LAYER_B / 2  # flush with the trailing edge
G_LAYER = 0.5e6  # 3M ISD 112 at room temperature, between 5 and 60 Hz: of this order
DRUM_MASS = 0.2  # one on the inner front corner of each drum
HEAVE = 2.3  # Hz on the bungees

TOP = FUSELAGE[1] / 2
Z_WING = TOP + PLATE[2] + THICK / 2
N_FREE = 24  # bars of a wing half between plate and end of the layer
RIGHT = 40  # nodes of the right half: those of the left plus this
TIGHT = 1.0e9  # N/m: joints do not slide or open


def rectangle(width: float, height: float) -> str:
    """A, I1, I2, J of a section; I1 bends it along its height."""
    I1, I2 = width * height**3 / 12, height * width**3 / 12
    return f"{width * height:.4E},{I1:.4E},{I2:.4E},{torsion(width, height):.4E}"


def torsion(width: float, height: float) -> float:
    """J of a rectangle, as in Roark's table 10.7."""
    a, b = max(width, height), min(width, height)
    return a * b**3 * (1 / 3 - 0.21 * b / a * (1 - b**4 / (12 * a**4)))


def over_plate() -> str:
    """A, I1, I2, J of the wing on its steel plate: the geometric mean of two bounds, the wing alone and both glued
    together (in aluminium). A is the wing's, since the plate's mass is a CONM2."""
    n = STEEL_E / E
    wing, plate = CHORD * THICK, n * PLATE[0] * PLATE[2]
    apart = (THICK + PLATE[2]) / 2
    glued = (
        (CHORD * THICK**3 + n * PLATE[0] * PLATE[2] ** 3) / 12 + wing * plate / (wing + plate) * apart**2,
        (THICK * CHORD**3 + n * PLATE[2] * PLATE[0] ** 3) / 12,
        torsion(CHORD, THICK + PLATE[2]),
    )
    alone = (CHORD * THICK**3 / 12, THICK * CHORD**3 / 12, torsion(CHORD, THICK))
    return f"{wing:.4E}," + ",".join(f"{sqrt(x * y):.4E}" for x, y in zip(alone, glued, strict=True))


def joint(x: str, y: str, z: str) -> str:
    """K1 to K6 of a bolted joint that gives about each axis like the plate it holds over a length of its thickness: in
    "bending", "torsion" or its own "plane"."""
    k = {
        "bending": E * CHORD * THICK**3 / 12 / THICK,
        "torsion": E / (2 + 2 * NU) * torsion(CHORD, THICK) / THICK,
        "plane": E * THICK * CHORD**3 / 12 / THICK,
    }
    return ",".join(f"{v:.3E}" for v in (TIGHT, TIGHT, TIGHT, k[x], k[y], k[z]))


class Deck:
    """Cards in the order they are written, with counted elements."""

    def __init__(self) -> None:
        self.cards: list[str] = []
        self.eid = 0

    def note(self, text: str) -> None:
        """A comment above what follows."""
        self.cards.append(f"$ {text}")

    def grid(self, node: int, x: float, y: float, z: float) -> int:
        """A node."""
        self.cards.append(f"GRID,{node},,{x:.5f},{y:.5f},{z:.5f}")
        return node

    def bars(self, prop: int, nodes: list[int], up: str) -> None:
        """Bars from node to node; `up` is the direction of plane 1."""
        for a, b in pairwise(nodes):
            self.eid += 1
            self.cards.append(f"CBAR,{self.eid},{prop},{a},{b},{up}")

    def add(self, card: str, rest: str) -> None:
        """An element of its own number."""
        self.eid += 1
        self.cards.append(f"{card},{self.eid},{rest}")


def stations() -> list[float]:
    """y of the nodes of a wing half: middle, edge of the plate, to the end of the layer, drum."""
    y0 = PLATE[1] / 2
    free = [y0 + (LAYER_Y - y0) * k / N_FREE for k in range(1, N_FREE + 1)]
    return [0.0, y0, *free, SPAN - CHORD, DRUM_Y, SPAN]


def wing_nodes(base: int, last: int) -> list[int]:
    """Nodes from the right tip to the left one: `base` in the middle, +1.. to the left, +1+RIGHT.. to the right."""
    return [*range(base + RIGHT + last, base + RIGHT, -1), base, *range(base + 1, base + last + 1)]


def fuselage(d: Deck) -> None:
    """Nodes 101 to 114 from nose to tail, and the two faces on which wing and fin are bolted."""
    d.note("fuselage, 1500 x 150 x 50 mm; 107 is below the wing, 109 at the suspension collar, 113 below the fin")
    places = [NOSE, 0.525, 0.45, 0.3, 0.15, 0.065, 0.0, -0.145, COLLAR_X, -0.45, -0.6, -0.75, FIN_X, TAIL]
    nodes = [d.grid(101 + i, x, 0.0, 0.0) for i, x in enumerate(places)]
    d.bars(1, nodes, "0.,0.,1.")
    d.grid(150, 0.0, 0.0, TOP)
    d.add("RBE2", "107,123456,150")
    d.grid(160, FIN_X, 0.0, TOP)
    d.add("RBE2", "113,123456,160")


def wing(d: Deck) -> None:
    """Wing nodes 200 to 236, rigid on the plate, and the joint to the fuselage."""
    d.note("wing, 2000 x 100 x 10 mm; 200 in the middle, 201 to 216 left, 221 to 236 right")
    y = stations()
    for i, s in enumerate(y):
        d.grid(200 + i, 0.0, s, Z_WING)
        if i:
            d.grid(200 + RIGHT + i, 0.0, -s, Z_WING)
    nodes = wing_nodes(200, len(y) - 1)
    middle = nodes.index(200)
    d.bars(2, nodes[:middle], "0.,0.,1.")
    d.bars(2, nodes[middle + 1 :], "0.,0.,1.")
    d.note("steel plate 130 x 70 x 16 mm under the wing: section 7 is both")
    d.bars(7, nodes[middle - 1 : middle + 2], "0.,0.,1.")
    d.grid(151, 0.0, 0.0, TOP)
    d.add("RBE2", "151,123456,200")
    d.cards.append(f"CONM2,901,151,,{STEEL * PLATE[0] * PLATE[1] * PLATE[2]:.4f},0.,0.,{PLATE[2] / 2}")
    d.add("CBUSH", "11,150,151,,,,0")


def layer(d: Deck, h: float, sheet: float) -> None:
    """The constraining sheet, nodes 300 to 333, on shear springs."""
    y = stations()[: N_FREE + 2]
    above = THICK / 2 + h + sheet / 2
    d.note(f"constraining sheet on the damping layer, {above:.4f} m above the middle of the wing, flush")
    d.note("with the trailing edge; every CBUSH is the shear of the layer between half-ways to the next nodes")
    for i, s in enumerate(y):
        d.grid(300 + i, LAYER_X, s, Z_WING + above)
        if i:
            d.grid(300 + RIGHT + i, LAYER_X, -s, Z_WING + above)
    d.bars(3, wing_nodes(300, len(y) - 1), "0.,0.,1.")
    where = (THICK + h) / 2 / above
    for i in range(len(y)):
        prop = {0: 41, 1: 42, len(y) - 1: 44}.get(i, 43)
        for side in (0, RIGHT) if i else (0,):
            d.add("CBUSH", f"{prop},{200 + side + i},{300 + side + i},,,,0,+")
            d.cards.append(f"+,{where:.4f}")


def drums(d: Deck) -> None:
    """Drums, nodes 401 to 407 and 411 to 417, each bolted on a tip that it keeps flat."""
    d.note("wing-tip drums, 400 x 100 x 10 mm on top of the tips, each bolted; 401 and 411 in front")
    places = [DRUM_X, 0.125, CHORD / 2, 0.0, -CHORD / 2, -0.125, -DRUM_X]
    last = len(stations()) - 1
    for base, sign, side in ((401, 1, 0), (411, -1, RIGHT)):
        tips = ",".join(str(200 + side + i) for i in range(last - 2, last + 1))
        nodes = [d.grid(base + i, x, sign * DRUM_Y, Z_WING + THICK) for i, x in enumerate(places)]
        d.bars(4, nodes, "0.,0.,1.")
        lower, upper = base + 49, base + 50
        d.grid(lower, 0.0, sign * DRUM_Y, Z_WING + THICK / 2)
        d.grid(upper, 0.0, sign * DRUM_Y, Z_WING + THICK / 2)
        d.add("RBE2", f"{lower},123456,{tips}")
        d.add("RBE2", f"{upper},123456,{nodes[2]},{nodes[3]},{nodes[4]}")
        d.add("CBUSH", f"12,{lower},{upper},,,,0")
    d.note("the added masses, on the inner front corners")
    for i, (base, sign) in enumerate(((401, 1), (411, -1))):
        d.cards.append(f"CONM2,{902 + i},{base},,{DRUM_MASS},-0.02,{-0.03 * sign:.2f},0.")


def tail(d: Deck) -> None:
    """Fin, nodes 501 to 505, and tailplane, 600 to 624."""
    d.note("fin, 300 mm high and 100 x 10 mm, bolted through the end of the fuselage")
    fin = [d.grid(501 + k, FIN_X, 0.0, TOP + FIN_Z * k / 4) for k in range(5)]
    d.bars(5, fin, "0.,1.,0.")
    d.add("CBUSH", "13,160,501,,,,0")
    d.note("tailplane, 400 x 100 x 10 mm on the fin, held by two steel angles of 15 x 15 x 100 mm")
    y = [0.0, ANGLE[0] + THICK / 2, 0.08, 0.14, TAILPLANE]
    for i, s in enumerate(y):
        d.grid(600 + i, FIN_X, s, TOP + FIN_Z + THICK / 2)
        if i:
            d.grid(600 + RIGHT + i, FIN_X, -s, TOP + FIN_Z + THICK / 2)
    d.bars(6, wing_nodes(600, len(y) - 1), "0.,0.,1.")
    d.grid(610, FIN_X, 0.0, TOP + FIN_Z)
    d.add("RBE2", f"610,123456,600,601,{601 + RIGHT}")
    d.cards.append(f"CONM2,904,505,,{2 * STEEL * ANGLE[0] * ANGLE[1] * ANGLE[2]:.4f},0.,0.,{-ANGLE[1] / 2}")
    d.add("CBUSH", "14,505,610,,,,0")


def missing_mass(h: float, sheet: float) -> float:
    """What the parts of the drawing lack to the weighed mass, kg."""
    drawn = RHO * (
        (NOSE - TAIL) * FUSELAGE[0] * FUSELAGE[1]
        + CHORD * THICK * (2 * SPAN + 4 * DRUM_X + FIN_Z + 2 * TAILPLANE)
        + 2 * LAYER_Y * LAYER_B * sheet
    )
    drawn += LAYER_RHO * 2 * LAYER_Y * LAYER_B * h + 2 * DRUM_MASS
    drawn += STEEL * (PLATE[0] * PLATE[1] * PLATE[2] + 2 * ANGLE[0] * ANGLE[1] * ANGLE[2])
    return WEIGHED - drawn


def bar(pid: int, mid: int, section: str, nsm: float = 0.0) -> list[str]:
    """A PBAR with the shear factors of a rectangle."""
    return [f"PBAR,{pid},{mid},{section},{nsm:.4f}", "+", "+,0.8333,0.8333"]


def properties(h: float, sheet: float) -> list[str]:
    """Materials, sections and joints."""
    flat = rectangle(CHORD, THICK)
    y = stations()
    step = (LAYER_Y - y[1]) / N_FREE
    lines = [
        "$ aluminium, of the structure (1) and of the constraining sheet (2)",
        f"MAT1,1,{E:.3E},,{NU},{RHO}",
        f"MAT1,2,{E:.3E},,{NU},{RHO}",
        "$ fuselage; its non-structural mass is what the drawing lacks to the weighed 44 kg (collars, bolts, cables)",
        *bar(1, 1, rectangle(*FUSELAGE), missing_mass(h, sheet) / (NOSE - TAIL)),
        "$ wing, drums, fin and tailplane: 100 x 10 mm",
        *bar(2, 1, flat),
        *bar(4, 1, flat),
        *bar(5, 1, flat),
        *bar(6, 1, flat),
        "$ wing above the steel plate: geometric mean of the wing alone and of both glued together; bolts lie between",
        *bar(7, 1, over_plate()),
        f"$ constraining sheet 76.2 x {1000 * sheet:.1f} mm; its non-structural mass is the damping layer below it",
        *bar(3, 2, rectangle(LAYER_B, sheet), LAYER_RHO * LAYER_B * h),
        f"$ damping layer, {1000 * h:.2f} mm of 3M ISD 112, smeared over width and span: k = G b s / h for s of it.",
        "$ Smeared into the wing's section it would be right for one mode only: how much of the sheet works along",
        "$ depends on the wave length. G is that at room temperature between 5 and 60 Hz, to a factor of 3.",
        "$ K1 shear along the chord, K2 along the span, K3 and K5 keep the sheet on the wing, K6 in-plane rotation",
    ]
    for prop, s in ((41, y[1]), (42, (y[1] + step) / 2), (43, step), (44, step / 2)):
        k = G_LAYER * LAYER_B * s / h
        turn = k * (LAYER_B**2 + s**2) / 12
        lines.append(f"PBUSH,{prop},K,{k:.4E},{k:.4E},1.0E+08,0.,1.0E+05,{turn:.4E}")
    lines += [
        "$ bolted joints: about each axis each gives like the plate it holds over a length of its thickness, 10 mm",
        "$ (K4 to K6 = EI1/t, GJ/t or EI2/t): an order of magnitude, hence parameters",
        "$ 11 wing on fuselage, 12 drums on tips, 13 fin in fuselage, 14 tailplane on fin",
        f"PBUSH,11,K,{joint('bending', 'torsion', 'plane')}",
        f"PBUSH,12,K,{joint('bending', 'bending', 'plane')}",
        f"PBUSH,13,K,{joint('bending', 'plane', 'torsion')}",
        f"PBUSH,14,K,{joint('bending', 'torsion', 'plane')}",
    ]
    return lines


def suspension(d: Deck) -> None:
    """Bungees: vertical springs above the wing's middle and at the collar."""
    k = WEIGHED * (2 * pi * HEAVE) ** 2 / 2
    d.note(f"bungees at the wing and at the collar: {WEIGHED:.0f} kg heave at {HEAVE} Hz")
    for node in (107, 109):
        d.add("CELAS2", f"{k:.1f},{node},3")


def deck(treatment: tuple[float, float] = TAPE) -> str:
    """The deck as text, with layer and sheet of a `treatment`."""
    d = Deck()
    fuselage(d)
    wing(d)
    layer(d, *treatment)
    drums(d)
    tail(d)
    suspension(d)
    head = [
        "$ GARTEUR SM-AG19 testbed, SI units (m, kg, s, N); written by garteur_deck.py from the published drawing:",
        "$ Balmes, Wright: GARTEUR group on ground vibration testing, results from the test of a single structure by",
        "$ 12 laboratories in Europe, ASME DETC 1997; Gravelle (ed.): GARTEUR TP-115, 1999; Link, Friswell: Generation",
        "$ of validated structural dynamic models, Mech. Syst. Signal Process. 17 (2003) 9-20.",
        "$ x forward, y left, z up; the origin is in the axis of the fuselage below the middle of the wing.",
        "SOL 103",
        "CEND",
        "METHOD = 1",
        "BEGIN BULK",
        "PARAM,COUPMASS,1",
        "EIGRL,1,,,24",
    ]
    return "\n".join([*head, *properties(*treatment), *d.cards, "ENDDATA", ""])


if __name__ == "__main__":
    Path(__file__).with_name("model.bdf").write_text(deck(), encoding="ascii")
