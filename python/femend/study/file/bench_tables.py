"""Checking the tables of a study file that correlation, updating and the planning of a test read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

from femend.dof import Dof, parse_direction
from femend.study.file.bench_settings import (
    DAMPING_MODELS,
    METHODS,
    POSTERIORS,
    RESPONSES,
    RULES,
    CorrelationSettings,
    PretestSettings,
    UpdatingSettings,
)
from femend.study.file.candidate_tables import candidate_settings
from femend.study.file.check import Check, FileCheck
from femend.study.file.field_tables import field_settings
from femend.study.file.link_tables import link_settings
from femend.study.file.morph_tables import morph_settings
from femend.study.file.schema import CorrelationTable, PretestTable, UpdatingTable
from femend.study.file.structure_tables import structure_settings

__all__ = ["correlation_settings", "pretest_settings", "updating_settings"]

# of fewer draws no quantile of 2.5 % is to be had
FEWEST_DRAWS = 100


def correlation_settings(check: Check, table: CorrelationTable) -> CorrelationSettings:
    """``[correlation]``; raises StudyError, naming the key, for a band, a MAC or an order that is none."""
    if not 0 <= table.mac_min < 1:
        raise check.fail("correlation.mac_min", f"{table.mac_min:g} is not from 0 to below 1, as a MAC is")
    if not table.orders:
        raise check.fail("correlation.orders", "the list is empty; leave it out to compare order 1")
    for order in table.orders:
        if not (math.isfinite(order) and order > 0):
            raise check.fail("correlation.orders", f"{order:g} is no order of rotation; take numbers above 0")
        if table.orders.count(order) > 1:
            raise check.fail("correlation.orders", f"{order:g} stands twice")
    orders = tuple(float(order) for order in table.orders)
    return CorrelationSettings(_band(check, "correlation.band", table.band), table.mac_min, table.align, orders)


def updating_settings(
    check: FileCheck,
    table: UpdatingTable,
    parameters: Sequence[str],
    configurations: Sequence[str],
    roles: Mapping[str, str],
) -> UpdatingSettings:
    """``[updating]`` of a study with `parameters` and `configurations` of these names, and recordings of these `roles`
    by name; raises StudyError, naming the key, for an unknown response, a deviation that is not above 0, and a morph,
    field, link or structure that cannot be meant."""
    if not table.responses:
        raise check.fail("updating.responses", f"the list is empty; compare one of {', '.join(RESPONSES)}")
    for name in table.responses:
        check.one_of("updating.responses", name, RESPONSES)
        if table.responses.count(name) > 1:
            raise check.fail("updating.responses", f"{name!r} stands twice; it would count twice")
    check.one_of("updating.damping_model", table.damping_model, DAMPING_MODELS)
    for key in ("freq_sd", "freq_far", "shape_sd", "damping_sd", "frf_sd", "order_sd"):
        _above_0(check, f"updating.{key}", getattr(table, key))
    _below_1(check, "updating", table.freq_sd, table.shape_sd)
    check.one_of("updating.posterior", table.posterior, POSTERIORS)
    for key in ("frf_lines", "order_lines", "iterations", "starts"):
        _count(check, f"updating.{key}", getattr(table, key))
    if table.draws < FEWEST_DRAWS:
        raise check.fail("updating.draws", f"{table.draws} is less than {FEWEST_DRAWS}; so few tell no quantiles")
    if table.design_points is not None:
        _count(check, "updating.design_points", table.design_points)
        if not table.response_surface:
            raise check.fail("updating.design_points", "is given and nothing uses it; say response_surface = true too")
    if table.regularisation is not None:
        check.one_of("updating.regularisation", table.regularisation, tuple(RULES))
    _seed(check, "updating.seed", table.seed)
    morphs = [m.name for m in table.morph]
    checked: dict[str, Any] = {
        "responses": tuple(table.responses),
        "modes": _modes(check, "updating.modes", table.modes),
        "strengths": _strengths(check, table),
        "morph": morph_settings(check, table.morph, parameters),
        "field": field_settings(check, table.field, parameters, morphs),
        "structure": structure_settings(check, table.structure, roles),
        "link": link_settings(check, table.link, parameters, morphs, configurations),
    }
    for i, link in enumerate(checked["link"]):
        fields = [f.name for f in checked["field"] if link.parameter in f.parameters]
        if fields and not link.own:
            raise check.fail(
                f"updating.link[{i}].parameter",
                f"{link.parameter!r} is a part of field {fields[0]!r} too, which holds it near its neighbours; leave "
                "it out of the one or the other",
            )
    if table.field and table.posterior == "sampled":
        raise check.fail(
            "updating.posterior",
            "draws start from parameters that know nothing of each other, those of [[updating.field]] do; leave the "
            "one or the other out",
        )
    return UpdatingSettings(**_by_name(UpdatingSettings, table) | checked)


def pretest_settings(
    check: Check, table: PretestTable, configurations: Sequence[str], parameters: Mapping[str, float]
) -> PretestSettings:
    """``[pretest]`` of a study with `configurations` and `parameters` (prior deviations) by name; raises StudyError,
    naming the key, for what no test can be planned with."""
    if table.band is not None and table.modes is not None:
        raise check.fail("pretest.modes", "are given beside a band; name the target modes by the one or the other")
    if table.method is not None:
        check.one_of("pretest.method", table.method, METHODS)
    if table.configuration is not None:
        check.one_of("pretest.configuration", table.configuration, ("as modelled", *configurations))
    for key in ("sensors", "exciters"):
        _count(check, f"pretest.{key}", getattr(table, key))
    for key in ("freq_sd", "shape_sd", "damping_sd"):
        _above_0(check, f"pretest.{key}", getattr(table, key))
    _below_1(check, "pretest", table.freq_sd, table.shape_sd)
    for key in ("sensor_mass", "noise", "spacing"):
        value = getattr(table, key)
        if not (math.isfinite(value) and value >= 0):
            raise check.fail(f"pretest.{key}", f"{value:g} is below 0")
    _seed(check, "pretest.seed", table.seed)
    for key in ("nodes", "exciter_nodes"):
        if getattr(table, key) == []:
            raise check.fail(f"pretest.{key}", "the list is empty; leave it out to allow all nodes")
    given = table.exciter_directions
    checked = {
        "band": _band(check, "pretest.band", table.band),
        "modes": _modes(check, "pretest.modes", table.modes),
        "nodes": None if table.nodes is None else tuple(table.nodes),
        "leave_out": tuple(table.leave_out),
        "directions": _directions(check, "pretest.directions", table.directions),
        "placed": tuple(_dof(check, f"pretest.placed[{i}]", text) for i, text in enumerate(table.placed)),
        "exciter_nodes": None if table.exciter_nodes is None else tuple(table.exciter_nodes),
        "distinguish": candidate_settings(check, table.distinguish, parameters),
        "exciter_directions": None if given is None else _directions(check, "pretest.exciter_directions", given),
    }
    return PretestSettings(**_by_name(PretestSettings, table) | checked)


def _by_name(settings: type, table: PretestTable | UpdatingTable) -> dict[str, Any]:
    """The values of a table by the names of the settings."""
    return {field.name: getattr(table, field.name) for field in fields(settings)}


def _strengths(check: Check, table: UpdatingTable) -> tuple[float, ...] | None:
    """Strengths of the priors that are tried, from the largest on."""
    if table.strengths is None:
        return None
    if table.regularisation is None:
        rules = " or ".join(f'"{rule}"' for rule in RULES)
        raise check.fail(
            "updating.strengths", f"are given and nothing chooses among them; say regularisation = {rules}"
        )
    if not table.strengths or not all(math.isfinite(s) and s > 0 for s in table.strengths):
        raise check.fail(
            "updating.strengths", f"{table.strengths} are not numbers above 0; 1 is the priors as they are stated"
        )
    return tuple(sorted(set(map(float, table.strengths)), reverse=True))


def _band(check: Check, key: str, value: list[float] | None) -> tuple[float, float] | None:
    if value is None:
        return None
    if len(value) != 2 or not (math.isfinite(value[1]) and 0 <= value[0] < value[1]):
        raise check.fail(key, f"{value} is not [lower, upper] in Hz with 0 <= lower < upper")
    return value[0], value[1]


def _modes(check: Check, key: str, value: list[int] | None) -> tuple[int, ...] | None:
    if value is None:
        return None
    if not value or min(value) < 1 or len(set(value)) != len(value):
        raise check.fail(key, f"{value} are not numbers of modes, each once, from 1 on")
    return tuple(sorted(value))


def _above_0(check: Check, key: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise check.fail(key, f"{value:g} is not above 0 (1 % is 0.01)")


def _below_1(check: Check, table: str, freq_sd: float, shape_sd: float) -> None:
    """No frequency or shape that is as far off as it is large says anything: it was given in per cent."""
    for key, value in (("freq_sd", freq_sd), ("shape_sd", shape_sd)):
        if value >= 1:
            told = f"{value:g} is {100 * value:g} %, of which nothing can be told; it is a share, 1 % is 0.01"
            raise check.fail(f"{table}.{key}", told)


def _seed(check: Check, key: str, value: int) -> None:
    if value < 0:
        raise check.fail(key, f"{value} is below 0")


def _count(check: Check, key: str, value: int) -> None:
    if value < 1:
        raise check.fail(key, f"{value} is less than one")


def _directions(check: Check, key: str, value: Sequence[str]) -> tuple[int, ...]:
    if not value:
        raise check.fail(key, 'the list is empty; give one of "X", "Y", "Z"')
    found = []
    for text in value:
        try:
            component = parse_direction(text)[0]
        except ValueError as error:
            raise check.fail(key, str(error)) from None
        if component > 3:
            raise check.fail(key, f"{text!r} is a rotation; a plan is made of translations X, Y and Z")
        found.append(component)
    return tuple(sorted(set(found)))


def _dof(check: Check, key: str, text: str) -> Dof:
    try:
        return Dof.parse(text)
    except ValueError as error:
        raise check.fail(key, str(error)) from None
