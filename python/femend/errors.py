"""Exceptions of femend: one class per kind of broken input, each under a built-in one.

A message says the fact with its numbers, the subject by name, and what to do. The attributes carry the same facts
for programs.
"""

from __future__ import annotations

__all__ = [
    "ArgumentError",
    "ConvergenceError",
    "CorrelationError",
    "DeckError",
    "ExpansionError",
    "ExternalSolverError",
    "FemendError",
    "FormatError",
    "GeometryError",
    "LawParameterError",
    "LoadError",
    "MemoryLimitError",
    "ModelError",
    "PairingError",
    "PretestError",
    "RecordingError",
    "RecordingTooShortError",
    "SignalError",
    "SingularModelError",
    "StudyError",
    "TimeLimitError",
    "TooFewModesError",
    "UnitError",
    "UpdatingError",
]


class FemendError(Exception):
    """Base of every exception femend raises on purpose."""


class ArgumentError(FemendError, TypeError):
    """An object of another kind than a step takes, as when two are exchanged; the message says what makes one."""

    @classmethod
    def given(cls, takes: str, value: object) -> ArgumentError:
        """What says that a step `takes` something, as a sentence, and that `value` is of another kind.

        >>> ArgumentError.given("`femend.update` takes a model", "model.bdf")
        ArgumentError('`femend.update` takes a model; a str was given')
        """
        kind = type(value).__name__
        return cls(f"{takes}; {'an' if kind[0] in 'AEIOUaeiou' else 'a'} {kind} was given")


class DeckError(FemendError, ValueError):
    """A bulk-data deck that cannot be read or used.

    Attributes: `file`, `line` (from 1), `card` (name and id) — None where they do not apply.
    """

    def __init__(
        self, message: str, *, file: str | None = None, line: int | None = None, card: str | None = None
    ) -> None:
        super().__init__(message)
        self.file = file
        self.line = line
        self.card = card


class ModelError(FemendError, ValueError):
    """A model that was read but cannot be used: zero-length beam, unknown parameter target, circular constraint."""


class SingularModelError(ModelError):
    """A stiffness without inverse where one is needed. `dofs` names DOFs that move without resistance, as text."""

    def __init__(self, message: str, *, dofs: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.dofs = dofs


class GeometryError(ModelError):
    """Nodes moved to where an element has no shape: turned inside out, without length.

    Attributes: `element` (card and id), and `limits`, the amplitudes by morph up to which all elements have a shape on
    the way there; empty where that was not looked for.
    """

    def __init__(self, message: str, *, element: str | None = None, limits: dict[str, float] | None = None) -> None:
        super().__init__(message)
        self.element = element
        self.limits = dict(limits or {})


class ConvergenceError(FemendError, ArithmeticError):
    """An eigensolution or factorisation that missed its accuracy; the message says by how much and what to do.

    Attributes: `converged`, how many modes or poles reached it; None where none were asked for.
    """

    def __init__(self, message: str, *, converged: int | None = None) -> None:
        super().__init__(message)
        self.converged = converged


class TooFewModesError(FemendError, ValueError):
    """More modes asked for than oscillate. `available` is how many do."""

    def __init__(self, message: str, *, available: int) -> None:
        super().__init__(message)
        self.available = available


class MemoryLimitError(FemendError, MemoryError):
    """A solution that would need more memory than is free, told before it begins.

    Attributes: `needed`, `free` in bytes; `free` is None where the system does not say.
    """

    def __init__(self, message: str, *, needed: int, free: int | None = None) -> None:
        super().__init__(message)
        self.needed = needed
        self.free = free


class StudyError(FemendError, ValueError):
    """A study file that breaks its contract. `key` is the path of the key inside the file."""

    def __init__(self, message: str, *, key: str | None = None) -> None:
        super().__init__(message)
        self.key = key


class TimeLimitError(FemendError, TimeoutError):
    """A study whose time was over before anything was settled. Attributes: `seconds` it had, the `step` it was in."""

    def __init__(self, message: str, *, seconds: float, step: str) -> None:
        super().__init__(message)
        self.seconds = seconds
        self.step = step


class RecordingError(FemendError, ValueError):
    """A recording that cannot be used: NaN, dead channel, unequal lengths, too slow sampling, no force channel."""

    def __init__(self, message: str, *, recording: str | None = None, channel: str | None = None) -> None:
        super().__init__(message)
        self.recording = recording
        self.channel = channel


class SignalError(RecordingError):
    """A record whose samples do not carry what is asked of them: no tacho pulses, clipped channel, record too short.

    Attributes: `recording`, `channel`, `time` (s) of the first bad sample — None where they do not apply.
    """

    def __init__(
        self, message: str, *, recording: str | None = None, channel: str | None = None, time: float | None = None
    ) -> None:
        super().__init__(message, recording=recording, channel=channel)
        self.time = time


class RecordingTooShortError(RecordingError):
    """A recording too short for its lowest mode. Attributes: `duration` and `needed` in s, `freq` of the mode in Hz."""

    def __init__(self, message: str, *, recording: str, duration: float, needed: float, freq: float) -> None:
        super().__init__(message, recording=recording)
        self.duration = duration
        self.needed = needed
        self.freq = freq


class FormatError(FemendError, ValueError):
    """A file that is not what its name or header says: truncated record, wrong byte order, unknown data set."""

    def __init__(self, message: str, *, file: str | None = None, record: int | None = None) -> None:
        super().__init__(message)
        self.file = file
        self.record = record


class PairingError(FemendError, ValueError):
    """A sensor that cannot be paired with a DOF of the model. `sensor` is its DOF as text, None for another node."""

    def __init__(self, message: str, *, sensor: str | None = None) -> None:
        super().__init__(message)
        self.sensor = sensor


class LoadError(FemendError, ValueError):
    """Loads that cannot be identified: fewer responses than loads, lines or sensors that do not match.

    Attributes: `n_responses`, `n_loads` — None where they do not apply; `channel`, `freq` (Hz) of the first that does
    not match, else None.
    """

    def __init__(
        self,
        message: str,
        *,
        n_responses: int | None = None,
        n_loads: int | None = None,
        channel: str | None = None,
        freq: float | None = None,
    ) -> None:
        super().__init__(message)
        self.n_responses = n_responses
        self.n_loads = n_loads
        self.channel = channel
        self.freq = freq


class CorrelationError(FemendError, ValueError):
    """Shapes, mass matrices or FRFs that cannot be compared: sizes that do not fit, values that are not finite."""


class ExpansionError(FemendError, ValueError):
    """Shapes that cannot be expanded, or matrices that cannot be reduced to the DOFs given."""


class PretestError(FemendError, ValueError):
    """A test that cannot be planned: fewer sensors than modes, no place left, modes that no place sees."""


class UpdatingError(FemendError, ValueError):
    """An updating problem that cannot be posed: fewer data than unknowns, no scatter, limits that exclude each
    other."""


class ExternalSolverError(FemendError, RuntimeError):
    """A run of the user's own solver without a usable answer.

    Attributes: `reason` ("missing", "crashed", "time limit" or "unreadable"), `folder` of the run, kept for a look.
    """

    def __init__(self, message: str, *, reason: str, folder: str | None = None) -> None:
        super().__init__(message)
        self.reason = reason
        self.folder = folder


class UnitError(FemendError, ValueError):
    """Units that are unknown or do not fit together."""


class LawParameterError(FemendError, ValueError):
    """A local law that cannot be used as given: unknown law or parameter, value outside its domain, wrong domain.

    Attributes: `law`, `parameter` — None where they do not apply.
    """

    def __init__(self, message: str, *, law: str | None = None, parameter: str | None = None) -> None:
        super().__init__(message)
        self.law = law
        self.parameter = parameter
