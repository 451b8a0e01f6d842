"""femend: locate and name the physics a finite-element model left out.

The public names are loaded on first use, so that ``import femend`` stays light.
"""

from __future__ import annotations

from femend._core import __version__

__all__ = ["__version__"]
