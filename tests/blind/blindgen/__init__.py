"""Generator of concealed-effect cases: virtual tests whose truth shares no code with the package under test."""

import hashlib
import os
import pathlib
import tempfile

# numba renews a compiled function when its own file changes, not when one it calls does: a folder per state of both
_HERE = pathlib.Path(__file__).parent
_STATE = hashlib.sha256(b"".join((_HERE / f).read_bytes() for f in ("laws.py", "integrate.py"))).hexdigest()[:12]
os.environ["NUMBA_CACHE_DIR"] = str(
    pathlib.Path(os.environ.get("NUMBA_CACHE_DIR", tempfile.gettempdir())) / f"blindgen-{_STATE}"
)
