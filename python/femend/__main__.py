"""`python -m femend` is the command `femend`."""

from __future__ import annotations

from femend.cli import main

if __name__ == "__main__":
    main(prog_name="femend")
