"""Recorder files that state their own sampling: WAV and TDMS."""

from __future__ import annotations

import warnings
from importlib import import_module
from pathlib import Path

import numpy as np

from femend.errors import FormatError
from femend.io.tables.table import Table, step_from

__all__ = ["read_tdms", "read_wav"]


def read_wav(path: Path) -> Table:
    """The channels of a WAV file `path`, named "0", "1", ...; integer samples are scaled to full scale 1.

    Raises FormatError for a damaged file.
    """
    from scipy.io import wavfile

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)  # chunks of recorders that scipy does not know
            rate, samples = wavfile.read(path)
    except (ValueError, EOFError, OSError) as error:
        raise FormatError(
            f"{path}: is no WAV file that can be read ({error}); copy or export it again", file=str(path)
        ) from error
    values = np.asarray(samples)
    scale = 1.0
    if values.dtype.kind == "u":  # 8 bit, silence at 128
        values, scale = values.astype(np.float64) - 128.0, 128.0
    elif values.dtype.kind == "i":
        scale = float(np.iinfo(values.dtype).max) + 1.0
    table = values.astype(np.float64).reshape(len(values), -1) / scale
    names = tuple(str(i) for i in range(table.shape[1]))
    return Table(str(path), names, tuple(np.ascontiguousarray(c) for c in table.T), 1.0 / rate)


def read_tdms(path: Path) -> Table:
    """The channels of a TDMS file `path`, named ``group/channel``; the step is the property wf_increment.

    Raises FormatError where the file is damaged or the optional package npTDMS is not installed.
    """
    try:
        nptdms = import_module("nptdms")
    except ImportError:
        raise FormatError(
            f"{path}: reading .tdms files needs the optional package npTDMS; install it (pip install npTDMS) or export "
            "the recording as .uff or .csv",
            file=str(path),
        ) from None
    names, columns, steps = [], [], set()
    try:
        file = nptdms.TdmsFile.read(path)
        for group in file.groups():
            for channel in group.channels():
                values = np.asarray(channel[:])
                if values.dtype.kind not in "biuf" or values.size == 0:
                    continue
                names.append(f"{group.name}/{channel.name}")
                columns.append(values.astype(np.float64))
                step = step_from("wf_increment", channel.properties.get("wf_increment"))
                if step is not None:
                    steps.add(step)
    except Exception as error:  # npTDMS raises many kinds for damaged files
        raise FormatError(
            f"{path}: is no TDMS file that can be read ({error}); copy or export it again", file=str(path)
        ) from error
    if not columns:
        raise FormatError(f"{path}: holds no numeric channel; check the file", file=str(path))
    if len(steps) > 1:
        raise FormatError(
            f"{path}: its channels have {len(steps)} sampling steps ({min(steps):g} to {max(steps):g} s); export "
            "channels of one rate to a file of their own",
            file=str(path),
        )
    return Table(str(path), tuple(names), tuple(columns), steps.pop() if steps else None)
