"""A recording: what was measured, under which circumstances, and what it may be used for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data.channel import Channel
from femend.data.frf import FRF
from femend.data.geometry import Geometry
from femend.data.spectra import Spectra
from femend.data.time_data import TimeData
from femend.errors import RecordingError

__all__ = ["EXCITATIONS", "RESPONSES", "ROLES", "Recording", "Rotating", "Test"]

ROLES = ("fit", "validate", "predict")
EXCITATIONS = ("measured", "unknown", "ambient", "rotating")
RESPONSES = ("displacement", "velocity", "acceleration", "strain")


@dataclass(frozen=True, slots=True)
class Rotating:
    """A rotor's excitation: tacho channel, pulses per revolution, bearing nodes and shaft axis X, Y or Z.

    `unbalance` is what is known of it: nodes, each with m r exp(i phase) in mass times length of the model, the phase
    that of its direction at the tacho's angle 0, ahead of the axis that follows the shaft's (Y after X, Z after Y, X
    after Z) in the sense of rotation. `sense` is +1 for rotation about +axis by the right hand, -1 against it, 0 where
    it is not known.
    """

    tacho: str
    nodes: tuple[int, ...]
    axis: str
    pulses_per_revolution: float = 1.0
    unbalance: tuple[tuple[int, complex], ...] = ()
    sense: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """One recording: `data` is TimeData, FRF or Spectra; `notes` say what the reader had to assume or repair,
    `warnings` what is wrong with single channels and when, `geometry` holds the test nodes where the file has them.

    `role` is fit, validate or predict; `excitation` measured, unknown, ambient or rotating; `configuration` names how
    the structure was held ("as modelled" where nothing is said). Raises RecordingError for time records of measured
    excitation without a force channel, and for a channel that is zero throughout.
    """

    name: str
    data: TimeData | FRF | Spectra
    role: str = "fit"
    excitation: str = "measured"
    configuration: str = "as modelled"
    rotating: Rotating | None = None
    file: str = ""
    notes: tuple[str, ...] = ()
    geometry: Geometry | None = None
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for value, allowed, key in ((self.role, ROLES, "role"), (self.excitation, EXCITATIONS, "excitation")):
            if value not in allowed:
                raise RecordingError(
                    f"recording {self.name!r}: {key} {value!r} is none of {', '.join(allowed)}", recording=self.name
                )
        if isinstance(self.data, TimeData):
            self._check_time(self.data)

    def _check_time(self, data: TimeData) -> None:
        if self.excitation == "measured" and not data.rows("force"):
            raise RecordingError(
                f'recording {self.name!r} says excitation = "measured" but none of its {len(data.channels)} channels '
                f"is a force ({', '.join(sorted({c.quantity for c in data.channels}))}); add the force channel or say "
                'excitation = "unknown" or "ambient"',
                recording=self.name,
            )
        if self.excitation == "rotating" and self.rotating is not None:
            data.index(self.rotating.tacho)
        forces = data.rows("force")
        for row, channel in enumerate(data.channels):
            if not data.values[row].any():
                if row in forces and any(data.values[other].any() for other in forces):
                    continue  # one of several shakers at rest
                raise RecordingError(
                    f"recording {self.name!r}: channel {channel.text} is 0 in all {data.n_samples} samples; "
                    "leave the dead channel out of the recording",
                    recording=self.name,
                    channel=channel.text,
                )

    @property
    def is_time(self) -> bool:
        """True where the data are time records."""
        return isinstance(self.data, TimeData)

    @property
    def time(self) -> TimeData:
        """The time records; raises RecordingError where the recording holds something else."""
        if not isinstance(self.data, TimeData):
            raise RecordingError(f"recording {self.name!r} holds no time records: {self.data!r}", recording=self.name)
        return self.data

    @property
    def frf(self) -> FRF:
        """The FRFs; raises RecordingError where the recording holds something else."""
        if not isinstance(self.data, FRF):
            raise RecordingError(f"recording {self.name!r} holds no FRFs: {self.data!r}", recording=self.name)
        return self.data

    @property
    def force(self) -> TimeData | None:
        """The force channels of the time records; None where there are none."""
        rows = self.time.rows("force")
        return self.time.select(rows) if rows else None

    @property
    def response(self) -> TimeData | None:
        """Displacements, velocities, accelerations and strains with a DOF; None where there are none."""
        data = self.time
        rows = [i for i in data.rows(*RESPONSES) if data.channels[i].dof is not None]
        return data.select(rows) if rows else None

    @property
    def sensors(self) -> tuple[Channel, ...]:
        """Response channels that have a DOF, whatever the kind of the data."""
        if isinstance(self.data, FRF):
            return self.data.outputs
        return tuple(c for c in self.data.channels if c.quantity in RESPONSES and c.dof is not None)

    @property
    def inputs(self) -> tuple[Channel, ...]:
        """Force channels that have a DOF, whatever the kind of the data."""
        if isinstance(self.data, FRF):
            return self.data.inputs
        return tuple(c for c in self.data.channels if c.quantity == "force" and c.dof is not None)

    @property
    def tacho(self) -> NDArray[np.float64] | None:
        """Samples of the tacho channel (n_samples,), or None."""
        if self.rotating is not None:
            return self.time.values[self.time.index(self.rotating.tacho)]
        rows = self.time.rows("tacho")
        return self.time.values[rows[0]] if rows else None

    def with_data(self, data: TimeData | FRF | Spectra) -> Recording:
        """The same recording with other data."""
        return replace(self, data=data)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "name": self.name,
            "role": self.role,
            "excitation": self.excitation,
            "configuration": self.configuration,
            "file": self.file,
            "notes": list(self.notes),
            "warnings": list(self.warnings),
            "data": self.data.to_dict(),
        }

    def __repr__(self) -> str:
        return f"Recording({self.name!r}, {self.role}, {self.excitation}, {self.configuration!r}: {self.data!r})"


@dataclass(frozen=True, slots=True, eq=False)
class Test:
    """All recordings of a structure. Raises RecordingError for two recordings of one name."""

    __test__ = False  # pytest collects classes of this name

    recordings: tuple[Recording, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "recordings", tuple(self.recordings))
        names = [r.name for r in self.recordings]
        for name in names:
            if names.count(name) > 1:
                raise RecordingError(f"two recordings are named {name!r}; names must differ", recording=name)

    def __iter__(self) -> Iterator[Recording]:
        return iter(self.recordings)

    def __len__(self) -> int:
        return len(self.recordings)

    def __getitem__(self, key: str | int) -> Recording:
        if isinstance(key, int):
            return self.recordings[key]
        for recording in self.recordings:
            if recording.name == key:
                return recording
        raise KeyError(f"no recording is named {key!r}; there are {', '.join(r.name for r in self.recordings)}")

    def role(self, *roles: str) -> Test:
        """The recordings with one of the roles."""
        return Test(tuple(r for r in self.recordings if r.role in roles))

    @property
    def sensors(self) -> tuple[Channel, ...]:
        """Response channels of all fit recordings, one per node, direction and quantity, in order of appearance."""
        seen: dict[tuple[str, str], Channel] = {}
        for recording in self.role("fit"):
            for channel in recording.sensors:
                seen.setdefault((str(channel.dof), channel.quantity), channel)
        return tuple(seen.values())

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {"recordings": [r.to_dict() for r in self.recordings]}

    def __repr__(self) -> str:
        return "Test(" + ", ".join(f"{r.name} [{r.role}]" for r in self.recordings) + ")"
