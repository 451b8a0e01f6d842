"""A study that was read and checked: paths resolved, defaults filled in."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from femend.data import Recording, Rotating, Test
from femend.errors import FemendError, StudyError
from femend.io.channel_map import ChannelMap
from femend.io.recordings import read_recording
from femend.model import Parameter
from femend.study.file.bench_settings import CorrelationSettings, PretestSettings, UpdatingSettings
from femend.study.file.channels_sound import with_warnings
from femend.study.file.solver_settings import SolverSettings

__all__ = ["AS_MODELLED", "Configuration", "Study", "StudyRecording"]

AS_MODELLED = "as modelled"


@dataclass(frozen=True, slots=True)
class Configuration:
    """How the structure was held: SPC set (None = the deck's own choice), (node, mass) pairs added, a note."""

    name: str
    spc: int | None = None
    added_mass: tuple[tuple[int, float], ...] = ()
    note: str = ""


@dataclass(frozen=True, slots=True)
class StudyRecording:
    """A recording as the study names it, not yet read."""

    name: str
    file: Path
    role: str = "fit"
    excitation: str = "measured"
    configuration: str = AS_MODELLED
    rotating: Rotating | None = None
    channels: tuple[ChannelMap, ...] = ()

    def read(self, units: str = "SI") -> Recording:
        """Reads the file and converts it to the unit system `units`; errors as of `femend.read_recording`."""
        return read_recording(
            self.file,
            self.channels or None,
            name=self.name,
            role=self.role,
            excitation=self.excitation,
            configuration=self.configuration,
            rotating=self.rotating,
            units=units,
        )


@dataclass(frozen=True, slots=True)
class Study:
    """A study file read and checked: every path is absolute and exists, every name is unique.

    `correlation`, `updating` and `pretest` are what the commands of these names read, `solver` what an update reads; a
    diagnosis does not.
    """

    file: Path
    title: str
    model_file: Path
    units: str
    damping_ratio: float
    parameters: tuple[Parameter, ...]
    configurations: tuple[Configuration, ...]
    recordings: tuple[StudyRecording, ...]
    correlation: CorrelationSettings = field(default_factory=CorrelationSettings)
    updating: UpdatingSettings = field(default_factory=UpdatingSettings)
    pretest: PretestSettings = field(default_factory=PretestSettings)
    solver: SolverSettings | None = None

    def configuration(self, name: str) -> Configuration:
        """The configuration of that name ("as modelled" always exists); raises StudyError for another."""
        for configuration in self.configurations:
            if configuration.name == name:
                return configuration
        if name == AS_MODELLED:
            return Configuration(AS_MODELLED)
        raise StudyError(f"{self.file}: no [[configuration]] is named {name!r}", key="configuration")

    def read_recordings(self) -> Test:
        """Reads all recordings in the model's unit system, with warnings about their channels.

        Raises what `femend.read_recording` raises, and SignalError for a dead response.
        """
        found = []
        for recording in self.recordings:
            try:
                found.append(with_warnings(recording.read(self.units)))
            except FemendError as error:
                error.add_note(f"while reading [[recording]] {recording.name!r} of {self.file}")
                raise
        return Test(tuple(found))

    def __repr__(self) -> str:
        return (
            f"Study({self.title!r}: {self.model_file.name} [{self.units}], {len(self.parameters)} parameters, "
            f"{len(self.recordings)} recordings)"
        )
