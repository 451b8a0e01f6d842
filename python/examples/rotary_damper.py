"""A damper measured by itself: its law named from force-displacement loops, and loops of other settings predicted.

The recordings (a banded rotary friction damper in a testing machine at three band tensions, sines of 0.5 and 1 Hz;
Coble et al. 2022, CC BY-SA 4.0) are not part of this project. The script looks for `data/rotary_damper` in the folder
FEMEND_SHARED, else in `../shared` beside the project:

python python/examples/rotary_damper.py

Laws are fitted to the 0.5 Hz recording of each tension. Recordings they have not seen: the 1 Hz one of that tension;
and the 1 Hz one of another tension, where only the force at which the law slips is read off its 0.5 Hz loops.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.element import ElementFit, fit_element, refit_element

SETTINGS = ("20lb", "35lb", "80lb")
# every fourth sample: 256 a second of a motion at 0.5 and 1 Hz
THIN = 4
# what the tension sets, in each law that slips: the slip force, or Bouc and Wen's yield displacement
SLIP = {"play_friction": "f", "coulomb_friction": "f", "bouc_wen": "beta"}

Record = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float]


def data_folder() -> Path:
    """The folder of the recordings; raises FileNotFoundError where they are not on this machine."""
    root = Path(os.environ.get("FEMEND_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    folder = root / "data" / "rotary_damper"
    if not folder.is_dir():
        raise FileNotFoundError(f"{folder} is not there; FEMEND_SHARED names the folder above data/rotary_damper")
    return folder


def read(folder: Path, rate: str, setting: str) -> Record:
    """Displacement (in), velocity (in/s), force (kip) and time step (s) of a recording."""
    content = json.loads((folder / f"{rate}{setting}tension.json").read_text(encoding="utf-8"))
    table = np.array(content["data"])[::THIN]
    d, f, v = (np.ascontiguousarray(table[:, column]) for column in (1, 2, 3))
    return d, v, f, THIN * float(content["dt"])


def named(folder: Path) -> dict[str, ElementFit]:
    """The laws of every setting, fitted to its 0.5 Hz recording with the whole catalogue."""
    return {setting: fit_element(*read(folder, "0.5Hz", setting)) for setting in SETTINGS}


def faster(folder: Path, fits: dict[str, ElementFit]) -> dict[str, dict[str, float]]:
    """{setting: {law: NRMSE}} at 1 Hz, nothing fitted there."""
    return {
        setting: {law.tried: law.nrmse(*read(folder, "1Hz", setting)) for law in fit.ranked}
        for setting, fit in fits.items()
    }


def transferred(folder: Path, fits: dict[str, ElementFit]) -> dict[tuple[str, str], dict[str, float]]:
    """{(setting fitted, predicted): {law: NRMSE}} at 1 Hz, with the slip of the predicted setting's 0.5 Hz loops."""
    out = {}
    for donor, fit in fits.items():
        for setting in (s for s in SETTINGS if s != donor):
            slow, fast = read(folder, "0.5Hz", setting), read(folder, "1Hz", setting)
            out[donor, setting] = {
                name: refit_element(fit[name], [slip], *slow).nrmse(*fast) for name, slip in SLIP.items()
            }
    return out


def main() -> None:
    """Prints the ranking at every setting and the two kinds of prediction."""
    folder = data_folder()
    fits = named(folder)
    for setting, fit in fits.items():
        verdict = "as good as a free form" if fit.adequate else "no law of the catalogue explains it"
        verdict += ", to the noise" if fit.to_noise else ", not to the noise"
        others = f"not told from {', '.join(fit.alike[1:])}" if len(fit.alike) > 1 else "told from all others"
        print(f"\n{setting}: {fit.best.name} ({verdict}; {others})\n{fit}")
        values = ", ".join(f"{name} = {value:.4g} ± {fit.best.sd[name]:.2g}" for name, value in fit.best.values.items())
        print(f"{values} (kip, in)")
    print("\nNRMSE at 1 Hz, fitted at 0.5 Hz")
    for setting, errors in faster(folder, fits).items():
        print(setting, ", ".join(f"{name} {errors[name]:.3f}" for name in (*SLIP, "spring and dashpot")))
    print("\nNRMSE at 1 Hz of another setting, its slip alone read off its 0.5 Hz loops")
    for (donor, setting), errors in transferred(folder, fits).items():
        print(f"{donor} -> {setting}", ", ".join(f"{name} {value:.3f}" for name, value in errors.items()))


if __name__ == "__main__":
    main()
