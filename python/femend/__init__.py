"""femend: locate and name the physics a finite-element model left out.

The public names are loaded on first use, so that ``import femend`` stays light.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from femend._core import __version__

# Public name -> module that defines it. One line per name.
_LAZY = {
    "Channel": "femend.data",
    "Dof": "femend.dof",
    "DofTable": "femend.dof",
    "FRF": "femend.data",
    "IdentifiedModes": "femend.data",
    "ModeSet": "femend.data",
    "Recording": "femend.data",
    "Spectra": "femend.data",
    "Test": "femend.data",
    "TimeData": "femend.data",
    "ChannelMap": "femend.io",
    "Campbell": "femend.data",
    "ComplexModes": "femend.data",
    "SpinningPart": "femend.model.terms.spinning",
    "TurningSystem": "femend.analysis.turning",
    "campbell": "femend.analysis.campbell",
    "complex_frf": "femend.analysis.complex_frf",
    "complex_modes": "femend.analysis.complex_modes",
    "direct_frf": "femend.analysis.direct_frf",
    "turning_system": "femend.analysis.turning",
    "identify_modes": "femend.modal",
    "load_study": "femend.study",
    "mesh_error": "femend.model",
    "modal_frf_scores": "femend.analysis.frf",
    "model_modes": "femend.analysis.model_modes",
    "read_recording": "femend.io",
    "read_recordings": "femend.io",
    "functions_of": "femend.io",
    "pair_sensors": "femend.model.pairing",
    "read_uff": "femend.io",
    "reduced_frf": "femend.analysis.direct_frf",
    "write_uff": "femend.io",
    "Parameter": "femend.model",
    "Settings": "femend.diagnose",
    "correlate_study": "femend.workflow",
    "diagnose_study": "femend.workflow",
    "locate": "femend.workflow",
    "name": "femend.workflow",
    "pair": "femend.workflow",
    "population_study": "femend.workflow",
    "pretest_study": "femend.workflow",
    "read_model": "femend.workflow",
    "update": "femend.workflow",
    "update_study": "femend.workflow",
    "validate": "femend.workflow",
    "write_report": "femend.workflow",
}

__all__ = ["__version__", *_LAZY]


def __getattr__(name: str) -> Any:
    module = _LAZY.get(name)
    if module is None:
        raise AttributeError(f"module 'femend' has no attribute {name!r}")
    value = getattr(import_module(module), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_LAZY})
