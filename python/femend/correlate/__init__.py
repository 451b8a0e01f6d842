"""Correlation: how far two sets of modes, FRFs or operating shapes agree, and where they do not."""

from __future__ import annotations

from femend.correlate.assurance import automac, dac, mac, macx, msf, principal_cosines, subspace_mac
from femend.correlate.by_dof import DofElimination, comac, ecomac, eliminate_dofs, macco
from femend.correlate.complexity import mcf, mcf_area, mean_phase, mpc, mpd
from femend.correlate.orthogonality import cross_orthogonality, orthogonality
from femend.correlate.responses import coherence_criterion, csac, csf, faac, fdac, frac, rvac

__all__ = [
    "DofElimination",
    "automac",
    "coherence_criterion",
    "comac",
    "cross_orthogonality",
    "csac",
    "csf",
    "dac",
    "ecomac",
    "eliminate_dofs",
    "faac",
    "fdac",
    "frac",
    "mac",
    "macco",
    "macx",
    "mcf",
    "mcf_area",
    "mean_phase",
    "mpc",
    "mpd",
    "msf",
    "orthogonality",
    "principal_cosines",
    "rvac",
    "subspace_mac",
]
