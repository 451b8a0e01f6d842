"""Reading OUTPUT4 files of either kind."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from femend.errors import FormatError
from femend.io.op4.binary import binary_layout, read_binary
from femend.io.op4.matrix import Op4Matrix, broken
from femend.io.op4.text import read_text

__all__ = ["read_op4"]


def read_op4(path: str | os.PathLike[str], names: Iterable[str] | None = None) -> tuple[Op4Matrix, ...]:
    """All matrices of a Nastran OUTPUT4 file, or those called `names`, in the order of the file.

    ASCII or binary (either byte order, words of 4 or 8 bytes), nonsparse or sparse with or without BIGMAT, real or
    complex, single or double precision: all is found from the file itself. Memory follows what the file holds, not
    what its headers claim. Values have the units of the model that made them.

    Raises FormatError with file, matrix and byte or line for what is cut off, damaged or not OUTPUT4, and for a name
    that is not in the file; OSError for a file that cannot be opened. Source: MSC Nastran DMAP Programmer's Guide,
    module OUTPUT4, remarks 1 to 11.

    >>> [m.name for m in read_op4("extse.op4")]  # doctest: +SKIP
    ['KAA', 'MAA']
    """
    file = Path(path)
    wanted = None if names is None else {name.upper() for name in names}
    with file.open("rb") as stream:
        start = stream.read(16)
    if not start:
        raise broken(str(file), "the file is empty", at="byte 0")
    layout = binary_layout(start)
    found = list(read_text(file, wanted) if layout is None else read_binary(file, layout, wanted))
    if wanted is not None:
        there = {matrix.name.upper() for matrix in found}
        for name in sorted(wanted - there):
            held = ", ".join(m.name for m in read_op4(file)) or "none"
            raise FormatError(
                f"{file}: there is no matrix {name} in the file; it holds {held}", file=str(file), record=None
            )
    return tuple(found)
