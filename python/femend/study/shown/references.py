"""The methods that a run used, as the report cites them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femend.study.result.study_run import StudyRun

__all__ = ["references"]

_ALWAYS = (
    "G. H. Golub and V. Pereyra, The differentiation of pseudo-inverses and nonlinear least squares problems whose "
    "variables separate, SIAM J. Numer. Anal. 10 (1973) 413-432: free forces and free decays are projected out.",
    "D. W. Marquardt, An algorithm for least-squares estimation of nonlinear parameters, J. SIAM 11 (1963) 431-441.",
    "R. Pintelon and J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., Wiley, 2012, ch. 7: "
    "noise from local polynomial models of the spectrum.",
    "E. Kausel and J. M. Roësset, Frequency domain analysis of undamped systems, J. Eng. Mech. 118 (1992) 721-734: "
    "responses from rest by an exponential window.",
    "R. R. Craig and A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley, 2006, ch. 17: modes and "
    "static responses as a basis.",
    "J. S. Bendat and A. G. Piersol, Random Data, 4th ed., Wiley, 2010, ch. 6: frequency responses H1 in the figures.",
)
_RECOVERED = (
    "S. F. Masri and T. K. Caughey, A nonparametric identification technique for nonlinear dynamic problems, J. Appl. "
    "Mech. 46 (1979) 433-447: force over displacement and velocity."
)
_OF_LAW = {
    "bouc_wen": "Y.-K. Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. 102 (1976) 249-263.",
    "coulomb_friction": "G. M. Jenkins, Analysis of the stress-strain relationships in reactor grade graphite, "
    "Brit. J. Appl. Phys. 13 (1962) 30-32.",
    "sliding_friction": "S. Andersson, A. Söderberg and S. Björklund, Friction models for sliding dry, boundary and "
    "mixed lubricated contacts, Tribol. Int. 40 (2007) 580-587: friction by a hyperbolic tangent of the speed.",
    "tuned_absorber": "J. Ormondroyd and J. P. Den Hartog, The theory of the dynamic vibration absorber, "
    "Trans. ASME 50 (1928) 9-22.",
}


def references(run: StudyRun) -> tuple[str, ...]:
    """Citations of the methods this run used."""
    found = list(_ALWAYS)
    if any(r.recovered is not None for r in run.diagnosis.ranked):
        found.append(_RECOVERED)
    best = run.diagnosis.best
    if best is not None:
        law = None if best.physics is None else best.physics.law
        found += [_OF_LAW[name] for name in (law, best.name) if name in _OF_LAW][:1]
    return tuple(found)
