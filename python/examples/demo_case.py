"""The bundled case step by step: what is missing in the model, and what the updated one predicts.

python python/examples/demo_case.py [report.html]
"""

from __future__ import annotations

import sys

import femend as fe
from femend.demo import STUDY


def main(report: str | None = None) -> None:
    """Diagnoses the bundled case, checks it on the middle level, which took no part, and writes `report` if named."""
    folder = STUDY.parent
    model = fe.read_model(folder / "model.bdf", units="SI", parameters=["E:1", "E:2"])
    test = fe.read_recordings([folder / "low.uff", folder / "high.uff"])
    pairs = fe.pair(test, model)
    print(pairs)

    start = fe.update(model, test, pairs, damping=0.01)
    print(f"\nupdated parameters\n{start}")
    where = fe.locate(start)
    print(f"\nplaces where a free force explains most\n{where}")
    what = fe.name(start, where)
    print(f"\n{what}")

    check = fe.validate(what, fe.read_recordings(folder / "mid.uff", role="validate"))
    print(f"\nerror on a recording that took no part\n{check}")
    # a free force at the right place leaves no more than the noise
    assert where[0].place.nodes == (3,)
    assert where[0].fit.score < 1.0
    if report is not None:
        print(f"\nreport    {fe.write_report(what, check, report, title='Beam on the bench')}")


if __name__ == "__main__":
    main(*sys.argv[1:2])
