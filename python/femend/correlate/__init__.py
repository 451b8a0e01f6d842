"""Correlation: how far two sets of modes, FRFs or operating shapes agree, and where they do not."""

from __future__ import annotations

from femend.correlate.alignment import Alignment, align_points
from femend.correlate.assurance import automac, dac, mac, macx, msf, principal_cosines, subspace_mac
from femend.correlate.by_dof import DofElimination, comac, ecomac, eliminate_dofs, macco
from femend.correlate.clusters import align_cluster, close_groups
from femend.correlate.complexity import mcf, mcf_area, mean_phase, mpc, mpd
from femend.correlate.fault_pairs import fault_pairs
from femend.correlate.labelled import DofMatch, ModeComparison, compare_modes, mac_of_modes, match_dofs
from femend.correlate.labelled_frf import FrfComparison, MatchedFrf, compare_frfs, match_frfs
from femend.correlate.orthogonality import cross_orthogonality, orthogonality
from femend.correlate.pairing import ModePair, ModePairing, best_mates, pair_modes
from femend.correlate.responses import coherence_criterion, csac, csf, faac, fdac, frac, lac, rvac
from femend.correlate.scaled_sensors import ScaledSensor, scaled_sensors
from femend.correlate.sensor_faults import SensorFault, sensor_faults
from femend.correlate.tables import ModeRow, ModeTable, mode_table

__all__ = [
    "Alignment",
    "DofElimination",
    "DofMatch",
    "FrfComparison",
    "MatchedFrf",
    "ModeComparison",
    "ModePair",
    "ModePairing",
    "ModeRow",
    "ModeTable",
    "ScaledSensor",
    "SensorFault",
    "align_cluster",
    "align_points",
    "automac",
    "best_mates",
    "close_groups",
    "coherence_criterion",
    "comac",
    "compare_frfs",
    "compare_modes",
    "cross_orthogonality",
    "csac",
    "csf",
    "dac",
    "ecomac",
    "eliminate_dofs",
    "faac",
    "fault_pairs",
    "fdac",
    "frac",
    "lac",
    "mac",
    "mac_of_modes",
    "macco",
    "macx",
    "match_dofs",
    "match_frfs",
    "mcf",
    "mcf_area",
    "mean_phase",
    "mode_table",
    "mpc",
    "mpd",
    "msf",
    "orthogonality",
    "pair_modes",
    "principal_cosines",
    "rvac",
    "scaled_sensors",
    "sensor_faults",
    "subspace_mac",
]
