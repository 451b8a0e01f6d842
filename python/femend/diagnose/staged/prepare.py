"""Recordings as data of the stages: FRFs with their noise, modes with their deviations, runs with their tacho."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from femend.data import FRF, Channel, IdentifiedModes, Recording, Speed, TimeData
from femend.data.bands import within_band
from femend.diagnose.staged.setup import Setup
from femend.dof import Dof
from femend.errors import RecordingError
from femend.estimate.frf import coherent_band, frf_lines_of, useful_band
from femend.estimate.joint import DataChoice, FrfBlock, ModesBlock, Run, RunBlock, Unbalance, run_of
from femend.model.terms.configured import ConfiguredModel
from femend.numerals import plain
from femend.signal import tacho_speed, to_quantity
from femend.signal.suited import suited_frf
from femend.signal.tacho_doubts import counted_otherwise, sampled_too_slowly

__all__ = [
    "FrfData",
    "ModesData",
    "RunData",
    "envelope_of",
    "excited_band",
    "frf_data",
    "run_data",
    "tacho_warnings",
    "unbalance_of",
]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# lines that are left of FRFs at least where a band is cut to what the force explains
FEWEST_LINES = 16
# a run is compared up to this multiple of its highest speed, and sampled this often per cycle of that
ABOVE, PER_CYCLE = 1.3, 2.4
# seconds at both ends of a run that do not count: filters and the state it started from
START, END = 1.0, 0.8
# a stretch of a run that is this much worse explained than the median one holds a disturbance: the tacho slipped
SLIP, STRETCH = 3.0, 0.5
# by how much the deviation of a sensor grows in a band where it is not to be believed
DOUBT = 1e3


@dataclass(frozen=True, eq=False)
class FrfData:
    """Accelerances (K, n_out, n_in) with the deviation `noise` of every value."""

    name: str
    freq: FloatArray
    H: ComplexArray
    noise: FloatArray
    outputs: tuple[Dof, ...]
    inputs: tuple[Dof, ...]

    def block(self, setup: Setup, model: ConfiguredModel, thinning: int = 1) -> FrfBlock:
        """Residuals against a configuration, on every `thinning`-th line, which counts for those left out as far as
        lines count at all."""
        s, few = setup.settings, slice(None, None, thinning)
        sd = np.sqrt(self.noise**2 + (s.model_frf * np.abs(self.H)) ** 2)
        out, into = setup.rows(model, self.outputs), setup.rows(model, self.inputs)
        weight = min(1.0, s.weight_frf * thinning)
        return FrfBlock(self.name, model, self.freq[few], self.H[few], sd[few], out, into, weight)


def frf_data(recording: Recording) -> FrfData:
    """FRFs of a recording, or those estimated from its forces and responses, in the band clear of noise in which
    the force explains the responses, as far as a coherence tells."""
    frf = recording.data if isinstance(recording.data, FRF) else suited_frf(recording.time)[0]
    lines = [frf_lines_of(frf, j) for j in range(len(frf.inputs))]
    bands = np.array([useful_band(line) for line in lines])
    freq = lines[0].freq
    inside = within_band(freq, (bands[:, 0].min(), bands[:, 1].max()))
    excited = excited_band(frf)
    if excited is not None:
        both = inside & within_band(freq, excited)
        inside = both if both.sum() >= FEWEST_LINES else inside
    H, noise = (np.stack([getattr(line, key) for line in lines], axis=2)[inside] for key in ("H", "noise"))
    return FrfData(recording.name, freq[inside], H, noise, _dofs(frf.outputs), _dofs(frf.inputs))


def excited_band(frf: FRF) -> tuple[float, float] | None:
    """First and last line (Hz) where the forces explain the responses; None where no coherence tells."""
    keep = frf.freq > 0
    if frf.coherence is None:
        return None
    bands = [coherent_band(frf.freq[keep], frf.coherence[keep, :, j]) for j in range(len(frf.inputs))]
    found = [band for band in bands if band is not None]
    return (min(b[0] for b in found), max(b[1] for b in found)) if found else None


def _dofs(channels: tuple[Channel, ...]) -> tuple[Dof, ...]:
    return tuple(c.dof for c in channels if c.dof is not None)


def _known(deviation: FloatArray | None) -> FloatArray:
    """Deviations with 0 where they are not known."""
    return np.zeros(1) if deviation is None else np.nan_to_num(deviation)


@dataclass(frozen=True, eq=False)
class ModesData:
    """Identified modes of a recording; `shape_sd` (n_dof, n_modes) or None where it is not known."""

    name: str
    modes: IdentifiedModes
    shape_sd: FloatArray | None = None

    @property
    def freq_sd(self) -> FloatArray:
        """Relative deviations of the frequencies, 0 where they are not known."""
        return np.asarray(_known(self.modes.freq_sd) / self.modes.freq)

    def block(self, setup: Setup, model: ConfiguredModel) -> ModesBlock:
        """Residuals against a configuration."""
        s, m = setup.settings, self.modes
        largest = np.abs(m.shapes).max(axis=0)
        shape = np.zeros(m.shapes.shape) if self.shape_sd is None else self.shape_sd / largest
        return ModesBlock(
            self.name,
            model,
            m.poles,
            m.shapes,
            np.hypot(self.freq_sd, s.model_freq),
            np.hypot(_known(m.zeta_sd) / m.zeta, s.model_zeta),
            np.hypot(np.nan_to_num(shape), s.model_shape),
            setup.rows(model, m.dofs),
            s.weight_modes,
        )


@dataclass(frozen=True, eq=False)
class RunData:
    """A run: low-passed accelerations `y` (n_out, n) at `dt` s with their `noise` (n_out,) and `envelope` (n_out, n).

    `speed` counts its time from the first sample. `slips` (n,) multiplies the deviation: large at the ends and where
    the tacho is not to be trusted; so does `doubt` (n_out, n), where a sensor's band is noise or another structure's
    (None: nowhere). The forces grow with `power` (n, reference) as Omega^n, and are those of Omega^2 at the reference
    in rev/s; `run` is that of Omega^2. Of another `order` than 1, speeds and angles are so many times the rotor's.
    """

    name: str
    y: FloatArray
    dt: float
    noise: FloatArray
    envelope: FloatArray
    slips: FloatArray
    speed: Speed
    rev_per_s: FloatArray
    run: Run
    sensors: tuple[Dof, ...]
    nodes: tuple[int, ...]
    axis: int
    step: float
    f_max: float
    doubt: FloatArray | None = None
    power: tuple[float, float] = (2.0, 1.0)
    driven: Run | None = None
    order: float = 1.0

    @property
    def loaded(self) -> Run:
        """The run as the forces drive it: by their own power of the speed, else by its square."""
        return self.run if self.driven is None else self.driven

    def with_power(self, power: tuple[float, float], *, steady: float = 0.0, onset: float = 0.0) -> RunData:
        """The run of forces that grow with Omega^n, `power` (n, reference in rev/s); `steady`, `onset` as in
        `run_data`."""
        if power[0] == 2.0:
            return self
        driven = run_of(self.speed, self.y.shape[1], self.dt, steady=steady, onset=onset, power=power)
        return replace(self, power=power, driven=driven)

    def growth(self, freq: FloatArray) -> FloatArray:
        """Forces over Omega^2 (K,) at speeds `freq` (K,) in rev/s, 1 at the reference."""
        return np.asarray((freq / self.power[1]) ** (self.power[0] - 2.0))

    def block(self, setup: Setup, model: ConfiguredModel, unbalance: Unbalance) -> RunBlock:
        """Residuals against a configuration."""
        s = setup.settings
        sd = np.sqrt(self.noise[:, None] ** 2 + (s.model_run * self.envelope) ** 2) * self.slips
        sd = sd if self.doubt is None else sd * self.doubt
        out, bearings = setup.rows(model, self.sensors), self.bearings(setup, model)
        return RunBlock(
            self.name, model, self.loaded, self.y, sd, out, bearings, unbalance, 1.05 * self.f_max, s.weight_run
        )

    def bearings(self, setup: Setup, model: ConfiguredModel) -> FloatArray:
        """Rows (n_bearings, 3, r) of the basis at the bearings."""
        rows = [[setup.free.row(Dof(n, c)) for c in (1, 2, 3)] for n in self.nodes]
        return np.array([model.rows(r) for r in rows])

    def without_parts(self, choice: DataChoice) -> RunData:
        """The same run with sensors counting little while the speed goes through bands that `choice` finds to be noise
        or not the model's; parts that only repeat others stay, they cost nothing here."""
        doubt = np.ones(self.y.shape)
        for part in choice.left_out:
            if part.reason != "adds nothing":
                doubt[part.rows[0], within_band(self.rev_per_s, part.band)] = DOUBT
        return replace(self, doubt=doubt)

    def without_slips(self, predicted: FloatArray) -> RunData:
        """The same run with stretches that `predicted` (n_out, n) explains far worse than the rest counting little.

        A tacho whose pulses fall on the same place between samples for a while loses its angle there.
        """
        sd = np.sqrt(self.noise[:, None] ** 2 + (0.02 * self.envelope) ** 2)
        z = np.sqrt((((predicted - self.y) / sd) ** 2).mean(axis=0))
        width = max(3, int(round(STRETCH / self.dt)))
        local = np.sqrt(np.convolve(np.pad(z**2, width // 2, "edge"), np.ones(width) / width, "same"))
        local = local[width // 2 : width // 2 + len(z)]
        around = signal.medfilt(local, 2 * min(int(round(3.0 / self.dt)), (len(local) - 1) // 2) + 1)
        excess = local / np.maximum(around, np.median(local))
        slips = self.slips * np.where(excess > SLIP, excess**2, 1.0)
        return replace(self, slips=slips)


def unbalance_of(data: RunData, sense: int) -> Unbalance:
    """The unbalance of a run's shaft, turning in a sense."""
    return Unbalance(data.nodes, data.axis, sense)


def run_data(
    recording: Recording,
    *,
    steady: float = 0.0,
    onset: float = 0.0,
    f_max: float | None = None,
    order: float = 1.0,
) -> RunData:
    """A recording of a rotor's run, compared up to `f_max` Hz (1.3 times its highest speed).

    Speed, angle and course are those of `order`: of a shaft that turns so many times while the rotor turns once.

    For `steady` seconds before its first sample the shaft turned at the speed it begins with; without, the force set in
    with the record over `onset` seconds. Raises
    RecordingError where bearings and shaft are not stated.
    """
    rotating = recording.rotating
    response = _accelerations(recording)
    if rotating is None:
        raise RecordingError(
            f'recording {recording.name!r} has excitation = "rotating" but no [recording.rotating] table; state tacho, '
            "bearing nodes and shaft axis",
            recording=recording.name,
        )
    time = recording.time
    speed = tacho_speed(time, rotating.tacho, pulses_per_revolution=int(rotating.pulses_per_revolution))
    # samples of a run count from its first one, whatever time the recorder gives that
    speed = replace(speed, t=speed.t - time.t0)
    speed = speed if order == 1.0 else speed.of_order(order)
    f_max = f_max or ABOVE * float(speed.rev_per_s.max())
    keep = max(1, int(time.rate / (PER_CYCLE * f_max)))
    dt, n = keep * time.dt, -(-time.n_samples // keep)
    values = np.zeros((0, time.n_samples)) if response is None else response.values
    taps = 2 * int(4.0 * time.rate / f_max) + 1
    low = signal.firwin(taps, min(f_max, 0.45 * time.rate), fs=time.rate)
    y = signal.fftconvolve(values, low[None], axes=1, mode="same")[:, ::keep] if len(values) else np.zeros((0, n))
    t = dt * np.arange(n)
    slips = 1 + 1e3 * ((t < START) | (t > t[-1] - END))
    return RunData(
        recording.name,
        np.asarray(y),
        dt,
        _noise(values, time.dt, f_max),
        envelope_of(y, dt),
        slips,
        speed,
        speed.at(np.clip(t, speed.t[0], speed.t[-1]))[0],
        run_of(speed, n, dt, steady=steady, onset=onset),
        () if response is None else _dofs(response.channels),
        tuple(rotating.nodes),
        "XYZ".index(rotating.axis.lstrip("+-").upper()),
        time.dt,
        f_max,
        order=order,
    )


def envelope_of(y: FloatArray, dt: float) -> FloatArray:
    """Root mean square (n_ch, n) of records y (n_ch, n) at `dt` s over the second around every sample."""
    width = max(3, int(round(1.0 / dt)))
    mean = signal.fftconvolve(y**2, np.full((1, width), 1 / width), mode="same", axes=1)
    return np.sqrt(np.maximum(mean, 0.0))


def _accelerations(recording: Recording) -> TimeData | None:
    """Responses as accelerations; strains are refused, since a run is compared as accelerations."""
    response = recording.response
    strains = [] if response is None else response.rows("strain")
    if response is None or not strains:
        return None if response is None else to_quantity(response, "acceleration")
    name = response.channels[strains[0]].text
    raise RecordingError(
        f"recording {recording.name!r}: channel {name} measures strain; a run is compared as accelerations: leave the "
        "channel out",
        recording=recording.name,
        channel=name,
    )


def tacho_warnings(recording: Recording, speed: Speed, order: float = 1.0) -> tuple[str, ...]:
    """What is doubtful about a run's tacho: pulses that had to be repaired, with the sampling where that is why, and
    another number of them to a turn than the responses follow. `speed` is that of an `order`, its time that of
    `RunData`."""
    if recording.rotating is None:
        return ()
    speed = speed if order == 1.0 else speed.of_order(1.0 / order)
    speed = replace(speed, t=speed.t + recording.time.t0)
    told = (_repaired(recording, speed), _wrong_count(recording, speed))
    return tuple(f"recording {recording.name!r}: {text}" for text in told if text)


def _repaired(recording: Recording, speed: Speed) -> str:
    """What had to be repaired in the pulses, in one sentence; nothing where nothing was."""
    rotating, time = recording.rotating, recording.time
    if not speed.missed + speed.doubled or rotating is None:
        return ""
    what = [f"{n} {text}" for n, text in ((speed.missed, "lost pulses put in"), (speed.doubled, "bounces thrown out"))]
    done = " and ".join(text for text in what if not text.startswith("0 "))
    top = float(speed.rev_per_s.max())
    x = time.values[time.index(rotating.tacho)]
    slow = sampled_too_slowly(x, time.dt, top * rotating.pulses_per_revolution, top)
    why = f"; {slow}" if slow else ""
    return f"channel {speed.source}: {done}, beside {speed.n_pulses} pulses used; the first: {speed.notes[0]}{why}"


def _wrong_count(recording: Recording, speed: Speed) -> str:
    """That the responses follow another number of pulses to a turn; nothing where they do not."""
    rotating = recording.rotating
    if rotating is None:
        return ""
    stated = int(rotating.pulses_per_revolution)
    found = counted_otherwise(recording.time, speed, stated)
    if found is None:
        return ""
    return (
        f"its channels hold {plain(100 * found.share, 2)} % of their power at order {found.order:.2f} of the tacho's "
        f"speed and next to nothing ({plain(100 * found.first, 2)} %) at order 1, where unbalance acts: is "
        f"pulses_per_revolution = {found.pulses} instead of {stated}?"
    )


def _noise(values: FloatArray, dt: float, f_max: float) -> FloatArray:
    """Deviation (n_ch,) of white noise below `f_max`, read off the spectrum well above it."""
    if not len(values):
        return np.zeros(0)
    freq = np.fft.rfftfreq(values.shape[1], dt)
    above = (freq > min(1.6 * f_max, 0.7 / (2 * dt))) & (freq < 0.95 / (2 * dt))
    power = np.median(np.abs(np.fft.rfft(values, axis=1)[:, above]) ** 2, axis=1) / np.log(2.0)
    level = np.sqrt(power / values.shape[1] * min(1.0, f_max * 2 * dt))
    return np.asarray(np.maximum(level, 1e-4 * values.std(axis=1)))
