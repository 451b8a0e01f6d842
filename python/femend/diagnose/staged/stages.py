"""The stages in the order of growing uncertainty, each with what it settles and what it leaves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, IdentifiedModes, Recording, Test
from femend.diagnose.staged.candidates import rivals
from femend.diagnose.staged.loads import RunResult, fit_run
from femend.diagnose.staged.narrow_runs import is_too_narrow, narrow_runs
from femend.diagnose.staged.other_orders import without_other_orders
from femend.diagnose.staged.places import elsewhere
from femend.diagnose.staged.prepare import FrfData, ModesData, RunData, frf_data, run_data, tacho_warnings
from femend.diagnose.staged.run_modes import run_modes, too_short_for_modes
from femend.diagnose.staged.run_terms import terms_of_run
from femend.diagnose.staged.select import Round, fit_terms, select_terms
from femend.diagnose.staged.setup import Setup
from femend.diagnose.staged.shaft import at_its_node, axis_doubt, shape_likeness
from femend.diagnose.staged.words import remark_on_frfs, remark_on_modes, remark_on_run, unseen_modes
from femend.dof import Dof
from femend.estimate.joint import FrfBlock, Posterior
from femend.modal import identify_modes
from femend.modal.output_only import identify_output_only
from femend.model.terms.configured import ConfiguredModel
from femend.model.terms.linear_terms import LinearTerm

__all__ = ["Flow", "Stage", "StagedData", "run_stages", "runs_at_their_nodes", "staged_data"]

FloatArray = NDArray[np.float64]

# lines on which rivals are compared; the one taken is fitted on all
FEW_LINES = 120


@dataclass(frozen=True, eq=False)
class StagedData:
    """Recordings as data, by configuration in the order in which they are used; `warnings` say what their preparation
    found doubtful: repaired tachos, modes, sensors. `left_out` are those of them about recordings that are not used."""

    frfs: dict[str, list[FrfData]]
    test_modes: dict[str, list[ModesData]]
    output_only: dict[str, list[ModesData]]
    runs: dict[str, list[RunData]]
    warnings: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()

    @property
    def configurations(self) -> tuple[str, ...]:
        """Those with measured forces first: what is known best comes first."""
        return tuple(dict.fromkeys([*self.frfs, *self.output_only, *self.runs]))


@dataclass(frozen=True, eq=False)
class Stage:
    """One stage: which recordings, in which configuration, its posterior, decisions and words.

    `unexplained` is the share (0 to 1) of the data, or for modes the median relative error of their frequencies, that
    the model leaves after the stage, `noise` what noise alone would leave.
    """

    name: str
    configuration: str
    recordings: tuple[str, ...]
    posterior: Posterior
    unexplained: float
    noise: float
    remarks: tuple[str, ...]
    rounds: tuple[Round, ...] = ()
    identified: IdentifiedModes | None = None
    run: RunResult | None = None
    table: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True, eq=False)
class Flow:
    """All stages with a set of terms: what was settled in the end, and `apart` what holds in a configuration that was
    tested before: its FRFs again, with the final posterior, widened by the drift, as their prior. `unseen` tells the
    modes that no FRF shows, with the frequencies of the final model; `beside` what is to be said beside: what was named
    and taken back, or lowers no error of recordings held out.
    """

    terms: tuple[LinearTerm, ...]
    posterior: Posterior
    stages: tuple[Stage, ...]
    named: tuple[tuple[LinearTerm, Round], ...] = field(default=())
    apart: dict[str, Posterior] = field(default_factory=dict)
    unseen: tuple[str, ...] = ()
    beside: str = ""

    def in_configuration(self, configuration: str) -> Posterior:
        """The posterior as the recordings of a configuration say it; the final one where they say nothing apart."""
        return self.apart.get(configuration, self.posterior)

    @property
    def runs(self) -> tuple[tuple[str, RunResult], ...]:
        """(configuration, result) of every run."""
        return tuple((s.configuration, s.run) for s in self.stages if s.run is not None)


def staged_data(test: Test) -> StagedData:
    """Fit recordings by what they are; raises what their preparation raises."""
    data = StagedData({}, {}, {}, {})
    told: list[str] = []
    narrow: list[RunData] = []
    for r in test:
        if r.role != "fit":
            continue
        if r.excitation == "measured":
            own = frf_data(r)
            data.frfs.setdefault(r.configuration, []).append(own)
            modes = _test_modes(r, own, told)
            if modes is not None:
                data.test_modes.setdefault(r.configuration, []).append(modes)
        elif r.excitation == "rotating":
            run = run_data(r)
            told += tacho_warnings(r, run.speed)
            if is_too_narrow(run):
                narrow.append(run)
            else:
                run, said = without_other_orders(run)
                told += [said] if said else []
                data.runs.setdefault(r.configuration, []).append(run)
        else:
            found = identify_output_only(r.time)
            if found.status != "ok":
                told += [f"recording {r.name!r}: {text}" for text in found.advice]
            if found.modes.n_modes:
                own_modes = ModesData(r.name, found.modes, found.shape_sd)
                data.output_only.setdefault(r.configuration, []).append(own_modes)
    for configuration, runs in data.runs.items():
        if configuration not in data.output_only:  # a run-up shows its structure's modes, too
            told += [text for text in map(too_short_for_modes, runs) if text]
            shown = [m for m in (run_modes(run) for run in runs) if m is not None]
            if shown:
                data.output_only[configuration] = shown
    left_out = narrow_runs(narrow)
    return replace(data, warnings=(*told, *left_out), left_out=tuple(left_out))


def _test_modes(recording: Recording, own: FrfData, told: list[str]) -> ModesData | None:
    frf = recording.data
    if not isinstance(frf, FRF):
        from femend.signal.suited import suited_frf

        frf, notes = suited_frf(recording.time)
        told += [f"recording {recording.name!r}: {text}" for text in notes]
    found = identify_modes(frf, (float(own.freq[0]), float(own.freq[-1])))
    wrong = [check.message for check in found.checks if check.verdict in ("reversed", "swapped", "differs")]
    doubts = found.advice if found.status != "ok" else ()
    told += [f"recording {recording.name!r}: {text}" for text in dict.fromkeys([*wrong, *doubts])]
    return ModesData(recording.name, found.modes) if found.modes.n_modes else None


def run_stages(
    setup: Setup,
    data: StagedData,
    *,
    naming: bool,
    iterations: int = 12,
    tell: Callable[[str], None] = lambda text: None,
) -> Flow:
    """Goes through the stages; with `naming` terms are added where a stage's recordings ask for them."""
    terms: list[LinearTerm] = list(setup.idealised)
    stages: list[Stage] = []
    named: list[tuple[LinearTerm, Round]] = []
    posterior: Posterior | None = None
    for configuration in data.configurations:
        for title, step in _STEPS:
            tell(f"{configuration}: {title}")
            for stage in step(_At(setup, configuration, data, terms, posterior, naming, iterations)):
                stages.append(stage)
                posterior = stage.posterior
                for decision in stage.rounds:
                    if decision.taken is not None and decision.taken.term is not None:
                        named.append((decision.taken.term, decision))
                        terms.append(decision.taken.term)
    if posterior is None:
        posterior = fit_terms(setup, next(iter(setup.configurations)), terms, None, lambda model: ())
    # what later stages found out (a mode that the first test could not see) goes back into the first configurations
    apart = {
        c: fit_terms(setup, c, terms, posterior, _blocks_of(setup, own))
        for c, own in data.frfs.items()
        if c != stages[-1].configuration
    }
    unseen = tuple(
        remark for c, own in data.frfs.items() for remark in unseen_modes(setup, c, terms, apart.get(c, posterior), own)
    )
    return Flow(tuple(terms), posterior, tuple(stages), tuple(named), apart, unseen)


@dataclass(frozen=True, eq=False)
class _At:
    """Where the stages have come to: the terms so far, and what the stage `before` left; with `naming` terms may be
    added, and fits of runs take as many `iterations`."""

    setup: Setup
    configuration: str
    data: StagedData
    terms: Sequence[LinearTerm]
    before: Posterior | None
    naming: bool
    iterations: int


def _measured(at: _At) -> list[Stage]:
    """Modal test, then the FRFs it came from: the second starts from the first and replaces it, being the same data."""
    setup, configuration, data, terms, before = at.setup, at.configuration, at.data, at.terms, at.before
    frfs = data.frfs.get(configuration, [])
    if not frfs:
        return []
    stages, start = [], before
    modes = data.test_modes.get(configuration, [])
    sensors = tuple(dict.fromkeys(d for f in frfs for d in (*f.inputs, *f.outputs)))
    if modes:
        start = fit_terms(setup, configuration, terms, before, lambda m: [d.block(setup, m) for d in modes])
        stages.append(_modes_stage("modal test", setup, configuration, modes, terms, start, ()))
        unseen = unseen_modes(setup, configuration, terms, start, frfs)
        stages[-1] = replace(stages[-1], remarks=(*stages[-1].remarks, *unseen))
    blocks = _blocks_of(setup, frfs)
    rounds: list[Round] = []
    chosen = list(terms)
    if at.naming:
        chosen, start, rounds = select_terms(
            setup, configuration, terms, before,
            _blocks_of(setup, frfs, max(int(1 / setup.settings.weight_frf), len(frfs[0].freq) // FEW_LINES)),
            lambda taken: rivals(setup, configuration, sensors, taken, only_here=before is not None),
            elsewhere=lambda taken: elsewhere(setup, configuration, sensors, taken, only_here=before is not None),
        )  # fmt: skip
    posterior = fit_terms(setup, configuration, chosen, before, blocks, from_p=start)
    model = setup.model(configuration, posterior.unknowns, chosen)
    made = [f.block(setup, model) for f in frfs]
    left, noise = _frf_error(made, frfs, posterior.p)
    remarks = (*remark_on_frfs(left, noise, rounds), *unseen_modes(setup, configuration, chosen, posterior, frfs))
    names = tuple(f.name for f in frfs)
    stages.append(Stage("FRFs", configuration, names, posterior, left, noise, remarks, tuple(rounds)))
    return stages


def _blocks_of(setup: Setup, frfs: Sequence[FrfData], thinning: int = 1) -> Callable[[ConfiguredModel], list[FrfBlock]]:
    return lambda model: [f.block(setup, model, thinning) for f in frfs]


def _frf_error(blocks: list[FrfBlock], frfs: list[FrfData], p: FloatArray) -> tuple[float, float]:
    top = sum(float((np.abs(b.predicted(p) - b.H) ** 2).sum()) for b in blocks)
    noise = sum(float((f.noise**2).sum()) for f in frfs)
    size = sum(float((np.abs(b.H) ** 2).sum()) for b in blocks)
    return float(np.sqrt(top / size)), float(np.sqrt(noise / size))


def _output_only(at: _At) -> list[Stage]:
    """The modes of responses alone."""
    setup, configuration, data, terms, before = at.setup, at.configuration, at.data, at.terms, at.before
    modes = data.output_only.get(configuration, [])
    if not modes:
        return []
    sensors: tuple[Dof, ...] = tuple(dict.fromkeys(d for m in modes for d in m.modes.dofs))
    blocks = lambda m: [d.block(setup, m) for d in modes]  # noqa: E731
    rounds: list[Round] = []
    chosen = list(terms)
    if at.naming:
        only_here = before is not None and configuration not in data.frfs
        chosen, posterior, rounds = select_terms(
            setup, configuration, terms, before, blocks,
            lambda taken: rivals(setup, configuration, sensors, taken, only_here=only_here),
            elsewhere=lambda taken: elsewhere(setup, configuration, sensors, taken, only_here=only_here),
            enough=setup.settings.enough,
        )  # fmt: skip
    else:
        posterior = fit_terms(setup, configuration, terms, before, blocks)
    return [_modes_stage("output-only modes", setup, configuration, modes, chosen, posterior, tuple(rounds))]


def _modes_stage(
    name: str,
    setup: Setup,
    configuration: str,
    modes: Sequence[ModesData],
    terms: Sequence[LinearTerm],
    posterior: Posterior,
    rounds: tuple[Round, ...],
) -> Stage:
    model = setup.model(configuration, posterior.unknowns, terms)
    rows = [row for d in modes for row in _mode_rows(setup, model, d, posterior.p)]
    noise = [float(sd) for d in modes for sd in np.broadcast_to(d.freq_sd, d.modes.n_modes)]
    # the median: a pole that came twice has no counterpart in the model
    left, level = float(np.median([abs(r[2] / r[0] - 1) for r in rows])), float(np.sqrt(np.mean(np.square(noise))))
    return Stage(
        name, configuration, tuple(d.name for d in modes), posterior, left, level,
        remark_on_modes(rows, left, rounds), rounds, modes[0].modes, table=tuple(rows),
    )  # fmt: skip


def _mode_rows(setup: Setup, model: ConfiguredModel, data: ModesData, p: FloatArray) -> list[tuple[float, ...]]:
    """Frequency and damping as identified and of the model, MAC, and the frequency's own deviation (Hz; 0 where it is
    not known), for every identified mode."""
    own, block = data.modes, data.block(setup, model)
    lam, _, mac = block.pairs(p)
    size = np.abs(lam)
    sd = np.broadcast_to(data.freq_sd, own.freq.shape) * own.freq
    columns = (own.freq, own.zeta, size / (2 * np.pi), -lam.real / size, mac, sd)
    return [tuple(float(v) for v in row) for row in zip(*columns, strict=True)]


def _runs(at: _At) -> list[Stage]:
    """Runs of a machine, one after the other: their operating shapes and loads."""
    setup, configuration, data, before = at.setup, at.configuration, at.data, at.before
    stages = []
    known, chosen = before, list(at.terms)
    checked = data.output_only.get(configuration, [])
    for run in data.runs.get(configuration, []):
        fit_in = partial(fit_run, configuration=configuration, before=before, checked=checked)
        fit_all = partial(fit_in, iterations=at.iterations, law=at.naming)
        result, doubt = _about_its_axis(setup, run, chosen, fit_in, fit_all)
        own, moved = setup, ""
        if result.other_law:
            own, run, result, moved = at_its_node(setup, chosen, run, result, partial(fit_all, terms=chosen))
        rounds: list[Round] = []
        if at.naming and not doubt:
            only_here = known is not None and configuration not in data.frfs
            fit = partial(fit_all, own, data=run)
            chosen, result, rounds = terms_of_run(own, configuration, result, chosen, before, fit, only_here=only_here)
        result = replace(result, moved=moved, doubt=doubt)
        before = result.posterior
        stages.append(_run_stage(own, configuration, run, result, rounds))
    return stages


def _about_its_axis(
    setup: Setup,
    run: RunData,
    terms: list[LinearTerm],
    fit_in: Callable[..., RunResult],
    fit_all: Callable[..., RunResult],
) -> tuple[RunResult, str]:
    """The result of a run; where it turns about another axis than its study says that of its unbalance alone, since
    the structure would have to follow what is not its own, and a sentence."""
    loads = partial(fit_in, setup, terms=terms, structure=False)
    alone = loads(data=run)
    doubt = axis_doubt(
        run.name,
        run.axis,
        lambda axis: shape_likeness(setup, alone if axis == run.axis else loads(data=replace(run, axis=axis))),
    )
    return (alone, doubt) if doubt else (fit_all(setup, data=run, terms=terms), "")


def _run_stage(setup: Setup, configuration: str, run: RunData, result: RunResult, rounds: Sequence[Round]) -> Stage:
    noise = float(np.sqrt((run.noise**2).sum() / (run.y**2).mean(axis=1).sum()))
    modes = run_modes(run)
    rows = () if modes is None else tuple(_mode_rows(setup, result.model, modes, result.posterior.p))
    said = [text for text in (result.doubt, result.moved) if text]
    return Stage(
        "operating shapes and loads", configuration, (run.name,), result.posterior, result.error, noise,
        (*said, *remark_on_run(result, rounds)), tuple(rounds), run=result,
        identified=None if modes is None else modes.modes, table=rows,
    )  # fmt: skip


def runs_at_their_nodes(data: StagedData, flow: Flow) -> StagedData:
    """The data with every run at the nodes where the flow found its unbalance."""
    found = {result.data.name: result.data.nodes for _, result in flow.runs}
    runs = {c: [replace(r, nodes=found.get(r.name, r.nodes)) for r in own] for c, own in data.runs.items()}
    return replace(data, runs=runs)


_STEPS: tuple[tuple[str, Callable[[_At], list[Stage]]], ...] = (
    ("modal test and FRFs", _measured),
    ("output-only modes", _output_only),
    ("operating shapes and loads", _runs),
)
