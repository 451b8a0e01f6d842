"""A modal test from its FRFs in one call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel, Geometry, IdentifiedModes, Recording
from femend.data.bands import within_band
from femend.dof import Dof
from femend.errors import RecordingError
from femend.modal.advice import advice_on
from femend.modal.checks import SensorCheck, driving_point_checks, reciprocity_checks, rigid_body_check, swap_check
from femend.modal.choose import pole_deviations
from femend.modal.indicators import contributions, mpc, mpd
from femend.modal.lsfd import RESIDUALS, ModalFit, derivative_power, synthesise
from femend.modal.parts import FEWEST_LINES, find_modes
from femend.modal.refine import RefinedModes
from femend.modal.result import ModalTest
from femend.modal.scaling import DrivingPoint, driving_points, modal_masses, scale_by_driving_points
from femend.modal.stabilisation import Stabilisation
from femend.threads import one_blas_thread

__all__ = ["identify_modes", "line_noise", "no_dof_twice"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@one_blas_thread
def identify_modes(
    frf: FRF | Recording,
    band: tuple[float, float] | None = None,
    *,
    max_order: int | None = None,
    residuals: str = "both",
    max_zeta: float = 0.2,
    geometry: Geometry | None = None,
) -> ModalTest:
    """Identifies the modes in `band` (low, high) in Hz, or in the whole of `frf`, and says how well they are known.

    `frf` is an FRF of any kind, or a recording of one; every channel needs a DOF. The smaller side is taken as the
    references: with one output and many inputs (roving hammer) the shapes live on the inputs, by reciprocity. Steps:
    pLSCF up to `max_order` (None: 60, fewer for few lines, and in parts of a band that holds too many modes for it),
    clusters of stable poles, fit of the modal model with `residuals` ("both", "upper", "lower", "none" of the terms for
    modes outside the band), choice of the modes with damping up to `max_zeta`, scaling by the driving points, sensor
    checks. `geometry` (default: the recording's) lets the rigid-body check look for sensors that are upside down or
    swapped.

    Deviations of frequency and damping are the square root of the fit's variance (from its residual, which counts
    neighbouring lines that go together as one) plus the squared scatter of pLSCF over the orders.

    Raises RecordingError for what holds no FRFs, a band without lines, channels without DOF, a DOF twice among the
    responses, an unknown `residuals`; finding nothing is the status "no modes".

    >>> from femend.data import Channel
    >>> f, p = np.linspace(1.0, 20.0, 191), -0.6 + 60j
    >>> s = 2j * np.pi * f
    >>> H = (1 / (s - p) / 120j - 1 / (s - p.conjugate()) / 120j)[:, None, None]  # unit mass on a spring
    >>> at = (Channel(Dof(1, 3), "displacement", "m"),), (Channel(Dof(1, 3), "force", "N"),)
    >>> test = identify_modes(FRF("bench", f, H, *at, "receptance", "m/N"))
    >>> test.modes.freq.round(4), test.modal_mass.round(4)
    (array([9.5498]), array([1.]))
    """
    if isinstance(frf, Recording):
        geometry = frf.geometry if geometry is None else geometry
        frf = frf.frf
    if not isinstance(frf, FRF):
        raise RecordingError(
            f"modal test: a {type(frf).__name__} was given; it takes FRFs or one recording of them, as "
            "`femend.read_recording(file)` gives it"
        )
    if residuals not in RESIDUALS:
        raise RecordingError(f"modal test: residuals {residuals!r} is none of {', '.join(RESIDUALS)}")
    used = _used_lines(frf, band)
    roved = "outputs" if len(used.inputs) <= len(used.outputs) else "inputs"
    responses, references = _dofs(used, roved)
    H = used.H if roved == "outputs" else used.H.transpose(0, 2, 1)
    noise = line_noise(H)
    found = find_modes(used.freq, H, derivative_power(used.kind), noise, max_order, residuals, max_zeta)
    diagram, fitted = found.diagram, found.fitted
    points = driving_points(responses, references)
    fit = _scaled(fitted.fit, points)
    modes = _modes(replace(fitted, fit=fit), diagram, responses, references, bool(points))
    test = _assembled(used, H, noise, modes, fit, roved, diagram, points)
    test = replace(test, shape_sd=_shape_sd(fitted, fit))
    test = replace(test, dropped=found.dropped, checks=_checks(used, modes, geometry))
    conjugate = 0 if modes.n_modes else _conjugate_modes(used, H, noise, max_order, residuals, max_zeta)
    status, advice = advice_on(test, fitted.converged, fitted.correlation, conjugate)
    return replace(test, status=status, advice=advice)


def _conjugate_modes(used: FRF, H: Complex, noise: Real, max_order: int | None, residuals: str, max_zeta: float) -> int:
    """How many modes the conjugates of H (n_freq, n_out, n_ref) show: poles of FRFs of exp(-i omega t) grow, so that
    these show none."""
    other = find_modes(used.freq, H.conj(), derivative_power(used.kind), noise, max_order, residuals, max_zeta)
    return int(other.fitted.fit.poles.size)


def line_noise(H: Complex) -> Real:
    """Standard deviation (n_out,) of the scatter from line to line of H (n_freq, n_out, n_ref), at least 0.1 % of rms.

    The median of |H_k - (H_k-1 + H_k+1) / 2|, which resonances of few lines do not move; complex noise of deviation
    sigma gives it sigma sqrt(1.5 ln 2). Raises nothing.
    """
    floor = 1e-3 * np.sqrt(np.mean(np.abs(H) ** 2, axis=(0, 2)))
    floor = np.maximum(floor, 1e-6 * max(float(floor.max()), 1e-300))
    if H.shape[0] < 5:
        return floor
    apart = np.abs(H[1:-1] - 0.5 * (H[:-2] + H[2:]))
    return np.maximum(np.median(apart, axis=0).mean(axis=1) / np.sqrt(1.5 * np.log(2.0)), floor)


def _used_lines(frf: FRF, band: tuple[float, float] | None) -> FRF:
    """The lines of the band without 0 Hz, where a residual term of the receptance has no value."""
    low, high = (float(frf.freq[0]), float(frf.freq[-1])) if band is None else band
    keep = within_band(frf.freq, (low, high)) & (frf.freq > 0)
    if int(keep.sum()) < FEWEST_LINES:
        raise RecordingError(
            f"recording {frf.name!r}: {int(keep.sum())} lines lie in the band {low:.6g} to {high:.6g} Hz (the FRFs "
            f"have {frf.n_freq} from {frf.freq[0]:.6g} to {frf.freq[-1]:.6g} Hz); a modal test needs at least "
            f"{FEWEST_LINES}; widen the band or take finer lines",
            recording=frf.name,
        )
    return frf.band(float(frf.freq[keep][0]), high)


def _dofs(frf: FRF, roved: str) -> tuple[tuple[Dof, ...], tuple[Dof, ...]]:
    for channel in (*frf.outputs, *frf.inputs):
        if channel.dof is None:
            raise RecordingError(
                f"recording {frf.name!r}: channel {channel.text} has no DOF; give its node and direction",
                recording=frf.name,
                channel=channel.text,
            )
    outputs = tuple(c.dof for c in frf.outputs if c.dof is not None)
    inputs = tuple(c.dof for c in frf.inputs if c.dof is not None)
    responses, references = (outputs, inputs) if roved == "outputs" else (inputs, outputs)
    no_dof_twice(frf.name, frf.outputs if roved == "outputs" else frf.inputs, roved)
    return responses, references


def no_dof_twice(recording: str, channels: Sequence[Channel], what: str) -> None:
    """Raises RecordingError with both names where two of the `channels` of a `recording`, its `what` (in the plural),
    are said to be at one DOF: a shape has one value there."""
    seen: dict[Dof, int] = {}
    for i, channel in enumerate(channels):
        if channel.dof is None:
            continue
        first = seen.setdefault(channel.dof.unsigned, i)
        if first != i:
            raise RecordingError(
                f"recording {recording!r}: DOF {channel.dof.unsigned} stands twice among the {len(channels)} {what}, "
                f"as channel {first + 1}, {channels[first].text}, and channel {i + 1}, {channel.text}: correct the "
                "node or the direction of one of them, or leave one out",
                recording=recording,
                channel=channel.text,
            )


def _shape_sd(fitted: RefinedModes, scaled: ModalFit) -> Real:
    """Deviations of the shapes of the fit in the size that they are `scaled` to, (n_dof, n_modes)."""
    assert fitted.shape_sd is not None
    size = np.linalg.norm(scaled.shapes, axis=0) / np.maximum(np.linalg.norm(fitted.fit.shapes, axis=0), 1e-300)
    return np.asarray(fitted.shape_sd * size)


def _scaled(fit: ModalFit, points: tuple[DrivingPoint, ...]) -> ModalFit:
    """By the driving points; else participation of unit length, so that shapes carry the size of the residues."""
    if points:
        shapes, participation = scale_by_driving_points(fit.shapes, fit.participation, points)
    else:
        size = np.linalg.norm(fit.participation, axis=1)
        shapes, participation = fit.shapes * size, fit.participation / size[:, None]
    return replace(fit, shapes=shapes, participation=participation)


def _modes(
    fitted: RefinedModes, diagram: Stabilisation, responses: tuple[Dof, ...], references: tuple[Dof, ...], scaled: bool
) -> IdentifiedModes:
    fit = fitted.fit
    freq_sd, zeta_sd = pole_deviations(fit.poles, fitted.pole_cov)
    if fit.poles.size:
        centre = np.array([c.pole for c in diagram.chosen])
        near = np.argmin(np.abs(fit.poles[:, None] - centre[None, :]), axis=1)
        freq_sd = np.hypot(freq_sd, [diagram.chosen[i].freq_sd for i in near])
        zeta_sd = np.hypot(zeta_sd, [diagram.chosen[i].zeta_sd for i in near])
    return IdentifiedModes(
        responses,
        fit.poles,
        fit.shapes,
        fit.participation,
        references,
        freq_sd,
        zeta_sd,
        "modal A" if scaled else "unscaled",
    )


def _checks(frf: FRF, modes: IdentifiedModes, geometry: Geometry | None) -> tuple[SensorCheck, ...]:
    swapped = swap_check(frf)
    checks = driving_point_checks(frf) + reciprocity_checks(frf) + (() if swapped is None else (swapped,))
    # where a sensor's node has no coordinates, whoever places the sensors says so
    if geometry is not None and modes.n_modes and {d.node for d in modes.dofs} <= set(geometry.ids.tolist()):
        checks += (rigid_body_check(modes.shapes, modes.dofs, geometry),)
    return checks


def _assembled(
    frf: FRF,
    H: Complex,
    noise: Real,
    modes: IdentifiedModes,
    fit: ModalFit,
    roved: str,
    diagram: Stabilisation,
    points: tuple[DrivingPoint, ...],
) -> ModalTest:
    model = synthesise(frf.freq, derivative_power(frf.kind), fit)
    apart, size = np.abs(H - model) ** 2, np.abs(H) ** 2
    whole = max(float(size.sum()), 1e-300)
    by_frf = np.sqrt(apart.sum(axis=0) / np.maximum(size.sum(axis=0), 1e-300))
    mass, mass_sd = modal_masses(frf.freq, derivative_power(frf.kind), fit, noise, points)
    back = model if roved == "outputs" else model.transpose(0, 2, 1)
    return ModalTest(
        modes=modes,
        measured=frf,
        resynthesised=replace(frf, H=back, coherence=None),
        error=float(np.sqrt(apart.sum() / whole)),
        frf_error=by_frf if roved == "outputs" else by_frf.T,
        line_error=np.sqrt(apart.sum(axis=(1, 2)) / np.maximum(size.sum(axis=(1, 2)), 1e-300)),
        noise_share=float(np.sqrt(np.sum(noise**2) * H.shape[0] * H.shape[2] / whole)),
        roved=roved,
        lower=fit.lower,
        upper=fit.upper,
        modal_mass=mass,
        mass_sd_share=mass_sd,
        mpc=mpc(fit.shapes),
        mpd=mpd(fit.shapes),
        contribution=contributions(frf.freq, derivative_power(frf.kind), fit, H),
        shape_sd=np.zeros(fit.shapes.shape),
        stabilisation=diagram,
        dropped=(),
        driving_points=points,
        checks=(),
        status="ok",
        advice=(),
    )
