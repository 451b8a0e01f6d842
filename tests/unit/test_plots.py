"""What the pictures hold: data of lines and images, labels with units, marks; and that nothing opens or stays set."""

from __future__ import annotations

import io
import re
import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection, QuadMesh
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from femend.data import Campbell, CriticalSpeed, StabilityLimit
from femend.dof import Dof
from femend.model import read_model
from femend.report import plots
from femend.report.content import MeshPicture
from femend.report.mesh_view import start_view, view_basis

RNG = np.random.default_rng(11)


def axes(rows: int = 1):
    return plots.figure("column", 60, rows, 1).axes


def line(ax, label: str) -> tuple[NDArray, NDArray]:
    found = [one for one in ax.lines if one.get_label() == label]
    assert len(found) == 1, f"{label!r} among {[one.get_label() for one in ax.lines]}"
    return np.asarray(found[0].get_xdata()), np.asarray(found[0].get_ydata())


def rendered(ax) -> bytes:
    file = io.BytesIO()
    ax.figure.savefig(file, format="png", dpi=60)
    return file.getvalue()


def contrast(first: str, second: str) -> float:
    """Ratio of luminances (WCAG 2)."""

    def luminance(colour: str) -> float:
        rgb = np.array(mpl.colors.to_rgb(colour))
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    a, b = sorted((luminance(first), luminance(second)))
    return (b + 0.05) / (a + 0.05)


# --- MAC, DAC, sensitivities


def test_mac_matrix_holds_the_values_the_pairs_and_the_names() -> None:
    values = np.array([[0.98, 0.02, 0.1], [0.03, 0.4, 0.955]])
    (ax,) = axes()
    plots.draw_mac(ax, values, [5.0, 7.25], [5.1, 6.0, 7.2], pairs=[(0, 0), (1, 2)])
    image = ax.images[0]
    assert np.asarray(image.get_array()).tolist() == values.tolist()
    assert image.get_clim() == (0.0, 1.0)
    assert image.origin == "lower"
    assert [t.get_text() for t in ax.texts] == ["98", "2", "10", "3", "40", "96"]
    assert [t.get_text() for t in ax.get_yticklabels()] == ["1  5.000", "2  7.250"]
    assert (ax.get_ylabel(), ax.get_xlabel()) == ("test mode, Hz", "model mode, Hz")
    assert [p.get_xy() for p in ax.patches if isinstance(p, Rectangle)] == [(-0.5, -0.5), (1.5, 0.5)]
    assert ax.figure.axes[-1].get_ylabel() == "MAC"


def test_numbers_in_cells_can_be_read() -> None:
    (ax,) = axes()
    plots.draw_mac(ax, np.linspace(0, 1, 14).reshape(2, 7))
    image = ax.images[0]
    for text in ax.texts:
        column, row = (int(v) for v in text.get_position())
        cell = mpl.colors.to_hex(image.cmap(image.norm(np.asarray(image.get_array())[row, column])))
        assert contrast(text.get_color(), cell) > 3.0, f"cell {text.get_text()}"  # WCAG 2 for graphics


def test_large_matrices_carry_no_numbers_and_few_ticks() -> None:
    (ax,) = axes()
    plots.draw_mac(ax, np.eye(60), criterion="AutoMAC", colorbar=False)
    assert len(ax.texts) == 0
    assert len(ax.get_xticks()) == 15
    assert len(ax.figure.axes) == 1


def test_dac_is_drawn_over_both_speeds() -> None:
    values = RNG.random((3, 4))
    (ax,) = axes()
    plots.draw_dac(ax, values, [600, 900, 1200], [600, 800, 1000, 1300])
    mesh = next(c for c in ax.collections if isinstance(c, QuadMesh))
    assert np.asarray(mesh.get_array()).reshape(3, 4).tolist() == values.tolist()
    corners = mesh.get_coordinates()
    assert corners[0, :, 0].tolist() == [500.0, 700.0, 900.0, 1150.0, 1450.0]
    assert corners[:, 0, 1].tolist() == [450.0, 750.0, 1050.0, 1350.0]
    assert line(ax, "equal")[0].tolist() == [600.0, 1200.0]
    assert ax.get_ylabel() == "test: speed, 1/min"


def test_a_posterior_has_its_density_with_the_bell_and_the_prior() -> None:
    (ax,) = axes()
    draws = 1.0 + 0.1 * np.random.default_rng(0).standard_normal(400)
    plots.draw_posterior(ax, [*draws, np.nan], name="E", laplace=(1.0, 0.1), prior=(1.0, 0.5))
    assert sum(p.get_height() * p.get_width() for p in ax.patches) == pytest.approx(1.0)
    x, bell = line(ax, "Laplace")
    assert bell.max() == pytest.approx(1 / (0.1 * np.sqrt(2 * np.pi)), rel=1e-3)
    assert line(ax, "prior")[1].max() == pytest.approx(1 / (0.5 * np.sqrt(2 * np.pi)), rel=1e-3)
    assert ax.get_xlim() == (x[0], x[-1])
    assert ax.get_xlabel() == "E"


def test_rounding_is_written_as_nothing() -> None:
    (ax,) = axes()
    plots.draw_sensitivity(ax, np.array([[2.0, -1e-31]]), ["f"], ["a", "b"])
    assert [text.get_text() for text in ax.texts] == ["2", "0"]


def test_sensitivities_are_white_at_zero_and_symmetric() -> None:
    S = np.array([[0.5, -0.1, 0.0], [0.2, np.nan, -0.4]])
    (ax,) = axes()
    plots.draw_sensitivity(ax, S, ["f1", "f2"], ["E:1", "E:2", "t:3"])
    image = ax.images[0]
    assert image.get_clim() == (-0.5, 0.5)
    assert np.asarray(image.get_array(), dtype=float)[0].tolist() == S[0].tolist()
    assert min(image.cmap(image.norm(0.0))[:3]) > 0.95
    assert [t.get_text() for t in ax.get_xticklabels()] == ["E:1", "E:2", "t:3"]
    assert [t.get_text() for t in ax.texts] == ["0.5", "-0.1", "0", "0.2", "-0.4"]
    assert ax.figure.axes[-1].get_ylabel() == "d ln(response) / d ln(parameter)"


# --- poles and run-ups


def test_stabilisation_diagram_draws_each_pole_by_its_status() -> None:
    freq, order = np.array([5.0, 5.1, 9.0, 9.05, 12.0]), np.array([4, 6, 6, 8, 8])
    (ax,) = axes()
    x = np.linspace(1, 20, 50)
    plots.draw_stabilisation(
        ax, freq, order, ["new", "stable", "freq", "zeta", "new"], chosen=[5.1], background=(x, [x, 2 * x])
    )
    points = {c.get_label(): np.asarray(c.get_offsets()).tolist() for c in ax.collections}
    assert points == {
        "new": [[5.0, 4.0], [12.0, 8.0]],
        "f": [[9.0, 6.0]],
        "f, ζ": [[9.05, 8.0]],
        "f, ζ, shape": [[5.1, 6.0]],
    }
    assert ax.lines[0].get_xdata() == [5.1, 5.1]
    right = ax.figure.axes[-1]
    assert right.get_yscale() == "log"
    assert [np.asarray(one.get_ydata())[-1] for one in right.lines] == [20.0, 40.0]
    assert right.get_ylabel() == "CMIF"
    assert ax.get_zorder() > right.get_zorder()
    assert len({look["marker"] for look in plots.STATUSES.values()}) == 4, "forms differ, not colours alone"


def test_campbell_holds_the_map_and_the_orders() -> None:
    rpm, freq = np.linspace(600, 1800, 5), np.linspace(0, 60, 7)
    size = RNG.random((5, 7)) + 1e-9
    (ax,) = axes()
    plots.draw_campbell(ax, rpm, freq, size, unit="m/s²", orders=[0.5, 1, 3], modes=[20.0], decades=2)
    mesh = next(c for c in ax.collections if isinstance(c, QuadMesh))
    floor = size.max() / 100
    assert np.asarray(mesh.get_array()).reshape(7, 5) == pytest.approx(np.maximum(size.T, floor))
    assert line(ax, "order 1")[1].tolist() == [10.0, 30.0]
    # order 3 leaves the picture at its top, 60 Hz, at 1200 1/min
    assert line(ax, "order 3") == (pytest.approx([600.0, 1200.0]), pytest.approx([30.0, 60.0]))
    assert [t.get_text() for t in ax.texts] == ["0.5", "1", "3"]
    assert ax.figure.axes[-1].get_ylabel() == "magnitude, m/s²"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("speed, 1/min", "frequency, Hz")


def test_order_lines_that_never_enter_are_left_out() -> None:
    (ax,) = axes()
    plots.draw_campbell(ax, [600, 1200], [20.0, 30.0, 40.0], np.ones((2, 3)), unit="g", orders=[0.5, 100, 2])
    assert [one.get_label() for one in ax.lines] == ["order 2"]


def test_waterfall_lifts_each_spectrum_from_its_speed() -> None:
    rpm, freq = np.array([600.0, 700.0, 800.0]), np.linspace(0, 50, 11)
    size = np.zeros((3, 11))
    size[1, 4] = 5.0
    (ax,) = axes()
    plots.draw_waterfall(ax, rpm, freq, size, unit="mm/s", orders=[2], height=1.5)
    black = [np.asarray(one.get_ydata()) for one in ax.lines if len(one.get_xdata()) == 11]
    assert [y[0] for y in black] == [800.0, 700.0, 600.0]
    assert black[1][4] == pytest.approx(700 + 1.5 * 100)
    assert line(ax, "order 2")[0].tolist() == pytest.approx([20.0, 23.333333, 26.666667])
    assert "5 mm/s" in [t.get_text() for t in ax.texts]


# --- curves


def test_frf_overlay_has_magnitude_and_phase_with_gaps_at_wraps() -> None:
    freq = np.linspace(1, 10, 5)
    H = np.array([1.0, 10j, -1.0 + 1e-3j, -1.0 - 1e-3j, np.nan])
    upper, lower = axes(2)
    plots.draw_frf(upper, lower, freq, {"measured": H, "final": 2 * H}, unit="m/s²/N", quantity="accelerance")
    assert line(upper, "measured")[1][:2].tolist() == [1.0, 10.0]
    assert line(upper, "final")[1][0] == 2.0
    phase = np.asarray(lower.lines[0].get_ydata())
    assert phase[:2].tolist() == [0.0, 90.0]
    assert np.isnan(phase[3]), "from +180 to -180 no line is drawn"
    assert upper.get_yscale() == "log"
    assert (upper.get_ylabel(), lower.get_ylabel(), lower.get_xlabel()) == (
        "|accelerance|, m/s²/N",
        "phase, °",
        "frequency, Hz",
    )
    assert [t.get_text() for t in upper.get_legend().get_texts()] == ["measured", "final"]


def test_frf_overlay_linear_without_phase() -> None:
    (ax,) = axes()
    plots.draw_frf(ax, None, [1.0, 2.0], {"a": [1, 2], "b": [0, 1]}, unit="mm", quantity="ODS-FRF", scale="linear")
    assert (ax.get_yscale(), ax.get_ylim()[0], ax.get_xlabel()) == ("linear", 0.0, "frequency, Hz")
    assert line(ax, "b")[1].tolist() == [0.0, 1.0]


def test_curves_differ_in_more_than_colour() -> None:
    (ax,) = axes()
    plots.draw_frf(ax, None, [1.0, 2.0], {c: [1, 2] for c in "abcde"}, unit="m")
    assert len({str(one._dash_pattern) for one in ax.lines}) == 5
    for one in ax.lines:
        assert contrast(one.get_color(), "white") > 3.0


def test_signature_curves_bands_and_target() -> None:
    (ax,) = axes()
    plots.draw_signature(
        ax, [1.0, 2.0, 3.0], {"nominal": [0.1, 0.5, np.nan], "final": [1, 1, 1]}, target=0.95, bands=[(1.0, 2.0)]
    )
    assert line(ax, "nominal")[1][:2].tolist() == [0.1, 0.5]
    assert line(ax, "target 0.95")[1].tolist() == [0.95, 0.95]
    assert (ax.patches[0].get_x(), ax.patches[0].get_width()) == (1.0, 1.0)
    assert ax.get_ylim() == (0.0, 1.03)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("frequency, Hz", "CSAC")


def test_bearing_forces_carry_their_law() -> None:
    rpm = np.linspace(300, 1500, 13)
    omega = rpm * np.pi / 30
    force = 2e-3 * omega**2 * np.exp(0.3j)
    wrong = force.copy()
    wrong[4:6] *= 10
    trusted = np.ones(13, bool)
    trusted[4:6] = False
    (ax,) = axes()
    laws = plots.draw_force_spectra(ax, rpm, {"drive end": wrong, "other end": 0.5 * omega**1.0}, reliable=trusted)
    assert laws["drive end"].unbalance == pytest.approx(2e-3, rel=1e-12)
    assert laws["drive end"].exponent == pytest.approx(2.0, abs=1e-12)
    assert laws["other end"].exponent == pytest.approx(1.0, abs=1e-12)
    x, y = line(ax, "drive end, exponent 2.00")
    assert x.size == 11
    assert y == pytest.approx(np.abs(force[trusted]))
    law = ax.lines[0]
    assert np.asarray(law.get_ydata())[-1] == pytest.approx(2e-3 * omega[-1] ** 2)
    hollow = [one for one in ax.lines if one.get_markerfacecolor() == "none" and len(one.get_xdata())]
    assert [len(one.get_xdata()) for one in hollow] == [2, 2]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("speed, 1/min", "force, N")


def test_forces_on_log_axes_name_plain_speeds() -> None:
    (ax,) = axes()
    plots.draw_force_spectra(ax, [300, 1500], {"a": [1.0, 25.0]}, scale="log")
    rendered(ax)
    assert {"300", "500", "1000"} <= {t.get_text() for t in ax.get_xticklabels()}


# --- shapes on the geometry

BOX = MeshPicture(
    np.array([1, 2, 3, 4, 9]),
    np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1.0]], float),
    np.array([[0, 4]]),
    np.array([[0, 1, 2, 3]]),
)


def test_shape_is_drawn_deformed_over_the_undeformed_mesh() -> None:
    motion = np.zeros((5, 3))
    motion[4] = [3.0, 0.0, 0.0]
    motion[1] = [0.0, 0.0, 1.5]
    (ax,) = axes()
    plots.draw_shape(ax, BOX, motion, scale=0.2, measured={9: [3.0, 0.0, 0.0]}, title="mode 1, 5.0 Hz")
    basis = view_basis(start_view(BOX.xyz))
    diagonal = np.sqrt(3.0)
    moved = (BOX.xyz + motion * (0.2 * diagonal / 3.0)) @ basis.T
    skin, faces = (c for c in ax.collections if type(c) is PolyCollection)
    assert skin.get_paths()[0].vertices[:4] == pytest.approx((BOX.xyz @ basis.T)[:4, :2])
    assert faces.get_paths()[0].vertices[:4] == pytest.approx(moved[:4, :2])
    assert np.asarray(faces.get_array()) == pytest.approx([0.5 / 4])  # one corner of four at half the largest motion
    wires = [c for c in ax.collections if isinstance(c, LineCollection)][-1]
    assert wires.get_paths()[0].vertices == pytest.approx(moved[[0, 4], :2])
    assert wires.get_clim() == (0.0, 1.0)
    arrow = next(c for c in ax.collections if type(c).__name__ == "Quiver")
    assert np.column_stack([arrow.U, arrow.V])[0] == pytest.approx((moved[4] - BOX.xyz[4] @ basis.T)[:2])
    assert ax.get_title() == "mode 1, 5.0 Hz"
    assert ax.get_aspect() == 1.0


def test_complex_shape_is_drawn_at_its_largest_or_at_the_phase_asked_for() -> None:
    motion = np.zeros((5, 3), complex)
    motion[4] = [0.0, 0.0, 2.0 * np.exp(0.7j)]

    def height(**how) -> float:
        (ax,) = axes()
        plots.draw_shape(ax, BOX, motion, **how)
        wires = [c for c in ax.collections if isinstance(c, LineCollection)][-1]
        return float(wires.get_paths()[0].vertices[1, 1])

    still = float((BOX.xyz @ view_basis(start_view(BOX.xyz)).T)[4, 1])
    assert abs(height() - still) > 0.1
    # at 0.7 rad earlier it stands as drawn by default, half a period later on the other side
    assert height(phase=np.degrees(-0.7)) - still == pytest.approx(height() - still, rel=1e-12)
    assert height(phase=np.degrees(np.pi - 0.7)) - still == pytest.approx(-(height() - still), rel=1e-12)
    (ax,) = axes()
    with pytest.raises(ValueError, match="motion is zero"):
        plots.draw_shape(ax, BOX, motion.real * 0)


def test_nodes_of_no_element_are_dots() -> None:
    alone = MeshPicture(BOX.node_ids, BOX.xyz, np.zeros((0, 2), int), BOX.faces)
    (ax,) = axes()
    plots.draw_shape(ax, alone, np.ones((5, 3)))
    dots = ax.collections[-1]
    assert len(dots.get_offsets()) == 1
    assert np.asarray(dots.get_array()).tolist() == [1.0]


def test_motion_of_nodes_applies_signs_and_refuses_strangers() -> None:
    dofs = [Dof(4, 1, -1), Dof(9, 3), Dof(9, 5), Dof(77, 1)]
    motion = plots.motion_of_nodes([1.0, 2.0, 3.0, 4.0], dofs, BOX.node_ids)
    assert motion[3].tolist() == [-1.0, 0.0, 0.0]
    assert motion[4].tolist() == [0.0, 0.0, 2.0]
    with pytest.raises(ValueError, match="none of the 1 DOFs"):
        plots.motion_of_nodes([1.0], [Dof(77, 1)], BOX.node_ids)


# --- all of them


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (lambda ax: plots.draw_mac(ax, np.eye(2), [1.0]), "1 frequencies for 2 modes"),
        (lambda ax: plots.draw_dac(ax, np.eye(2), [1, 2], [2, 1]), "does not rise"),
        (lambda ax: plots.draw_dac(ax, np.eye(2), [1, 2], [1, 2, 3]), "shape (2, 2), not (2, 3)"),
        (lambda ax: plots.draw_stabilisation(ax, [1.0], [2], ["good"]), "'good' is none of new, freq, zeta, stable"),
        (lambda ax: plots.draw_stabilisation(ax, [1.0], [2], []), "0 statuses for 1 poles"),
        (lambda ax: plots.draw_campbell(ax, [1, 2], [1, 2], np.zeros((2, 2)), unit="m"), "nowhere positive"),
        (lambda ax: plots.draw_waterfall(ax, [2, 1], [1, 2], np.ones((2, 2)), unit="m"), "rising speeds"),
        (lambda ax: plots.draw_frf(ax, None, [1.0], {}, unit="m"), "no curve"),
        (lambda ax: plots.draw_frf(ax, None, [1.0], {"a": [1.0]}, unit="m", scale="dB"), "'dB' is neither"),
        (lambda ax: plots.draw_signature(ax, [1.0, 2.0], {"a": [1.0]}), "shape (1,), not (2)"),
        (lambda ax: plots.draw_force_spectra(ax, [1.0, 2.0], {"a": [1.0]}), "has shape (1,) for 2 speeds"),
        (lambda ax: plots.draw_force_spectra(ax, [1.0, 2.0], {"a": [1.0, 0.0]}), "1 speeds with a force"),
        (lambda ax: plots.draw_sensitivity(ax, np.eye(2), ["f1"], ["E"]), "shape (2, 2), not (1, 1)"),
        (lambda ax: plots.draw_shape(ax, BOX, np.ones((4, 3))), "shape (4, 3) for 5 nodes"),
        (lambda ax: plots.draw_posterior(ax, [1.0, np.nan], name="E"), "1 finite draws of 'E'"),
        (lambda ax: plots.draw_shape(ax, BOX, np.ones((5, 3)), measured={8: [1, 0, 0]}), "measured node 8"),
        (lambda ax: plots.figure("poster"), "'poster' is none of column, page"),
    ],
)
def test_what_cannot_be_drawn_is_refused(draw, words: str) -> None:
    (ax,) = axes()
    with pytest.raises(ValueError, match=re.escape(words)):
        draw(ax)


def test_style_holds_inside_the_with_alone() -> None:
    before = dict(mpl.rcParams)
    with plots.paper_style():
        assert mpl.rcParams["font.size"] == 8
        (ax,) = axes()
        plots.draw_mac(ax, np.eye(3))
        assert rendered(ax).startswith(b"\x89PNG")
    assert dict(mpl.rcParams) == before


def test_nothing_of_matplotlib_is_imported_before_something_is_drawn() -> None:
    code = "import sys, femend.report.plots, femend.correlate; print('matplotlib' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.strip() == "False"


def test_drawing_opens_no_window() -> None:
    code = (
        "import sys, numpy as np; from femend.report import plots; f = plots.figure(); "
        "plots.draw_mac(f.axes[0], np.eye(2)); print('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.strip() == "False"


def test_motion_of_a_model_reaches_tied_and_turned_nodes(tmp_path) -> None:
    # Node 2 moves on springs, node 3 is tied to it a metre above, node 4's axes are turned by 90 degrees about Z.
    cards = ["GRID,1", "GRID,2", "GRID,3,,0.,0.,1.", "CORD2R,5,,0.,0.,0.,0.,0.,1.", "+,0.,1.,0."]
    cards += ["GRID,4,,2.,0.,0.,5", "RBE2,10,2,123456,3", "CONM2,20,2,,3.", "CONM2,21,4,,1."]
    cards += ["PBUSH,1,K,1.+3,1.+3,1.+3,1.+3,1.+3,1.+3", "CBUSH,1,1,2,1,,,,0", "CBUSH,2,1,4,1,,,,0"]
    cards += ["SPC1,1,123456,1", "CONM2,22,3,,1.,,,,", "+,1.,,1.,,,1."]
    text = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", *cards, "ENDDATA", ""]
    file = tmp_path / "model.bdf"
    file.write_text("\n".join(text))
    model = read_model(file)
    row = {
        (int(n), int(c)): i for i, (n, c) in enumerate(zip(model.fe.dof_nodes, model.fe.dof_components, strict=True))
    }
    shape = np.zeros(model.fe.n_a)
    shape[row[2, 1]], shape[row[2, 5]], shape[row[4, 1]] = 1.0, 0.5, 2.0
    motion = dict(zip(model.node_ids.tolist(), plots.motion_of_model(model, shape).tolist(), strict=True))
    assert motion[2] == pytest.approx([1.0, 0.0, 0.0])
    assert motion[3] == pytest.approx([1.5, 0.0, 0.0]), "1 m above, turned by 0.5 about Y"
    assert motion[4] == pytest.approx([0.0, 2.0, 0.0]), "its X axis is the basic Y axis"
    assert plots.motion_of_model(model, 1j * shape)[model.index(2)] == pytest.approx([1j, 0, 0])
    with pytest.raises(ValueError, match="free DOFs; give one column"):
        plots.motion_of_model(model, shape[:-1])


def test_whirl_tells_senses_critical_speeds_and_growth() -> None:
    speed = np.array([0.0, 50.0, 100.0])
    poles = np.array([[-1 + 90j, -1 + 110j], [-1 + 80j, 0 + 120j], [-1 + 70j, 2 + 130j]])
    whirl = np.array([[-1.0, 1.0]] * 3)
    critical = (CriticalSpeed(1.0, 0, 75.0, 75.0 / (2 * np.pi), -1.0, 0.01, 1e-12),)
    limits = (StabilityLimit(1, 50.0, 120 / (2 * np.pi), True),)
    ones = np.ones((3, 2))
    data = Campbell(speed, np.full(3, True), poles, whirl, 1e-9 * ones, ones, critical, limits, np.zeros(3, dtype=int))
    (ax,) = axes()
    plots.draw_whirl(ax, data, orders=[1.0])
    assert line(ax, "critical") == (pytest.approx([75 * 30 / np.pi]), pytest.approx([75 / (2 * np.pi)]))
    assert line(ax, "unstable") == (pytest.approx([3000 / np.pi]), pytest.approx([130 / (2 * np.pi)]))
    assert {"forward", "backward"} <= {str(one.get_label()) for one in ax.lines}
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("speed, 1/min", "damped frequency, Hz")
    nothing = Campbell(speed, np.full(3, True), poles * np.nan, whirl, ones, ones, (), (), np.zeros(3, dtype=int))
    with pytest.raises(ValueError, match="no branch"):
        plots.draw_whirl(ax, nothing)
