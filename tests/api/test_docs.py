"""The pages stay true to the tree: every package and crate has its place, and every link leads somewhere."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from femend.physics import CATALOGUE, catalogue

PAGES = (
    "README.md",
    "CONTRIBUTING.md",
    "benches/README.md",
    *(
        f"python/docs/{name}.md"
        for name in ("architecture", "blind", "correlation", "diagnosis", "laws", "modal", "naming", "operating")
    ),
    *(f"python/docs/{name}.md" for name in ("elements", "output_only", "pretest", "recordings", "selftest", "signals")),
    "python/docs/blind_log.md",
    "python/docs/complex_modes.md",
    "python/docs/study.md",
    "python/docs/updating.md",
)


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(project_root: Path, page: str) -> None:
    path = project_root / page
    targets = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", path.read_text(encoding="utf-8"))
    local = [target for target in targets if "://" not in target]
    assert [target for target in local if not (path.parent / target).exists()] == []


def anchors(page: Path) -> set[str]:
    """What a link to a heading of a page ends in: its words in small letters, joined by hyphens."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES)
def test_links_to_headings_lead_somewhere(project_root: Path, page: str) -> None:
    path = project_root / page
    targets = re.findall(r"\]\(([^)#:]*)#([^)]*)\)", path.read_text(encoding="utf-8"))
    pages = [(path.parent / target if target else path, heading) for target, heading in targets]
    assert [heading for file, heading in pages if file.suffix == ".md" and heading not in anchors(file)] == []


def test_every_page_is_checked_and_told_of_in_the_readme(project_root: Path) -> None:
    pages = sorted(str(p.relative_to(project_root)) for p in (project_root / "python" / "docs").glob("*.md"))
    assert pages
    assert sorted(set(pages) - set(PAGES)) == []
    readme = (project_root / "README.md").read_text(encoding="utf-8")
    assert [page for page in pages if f"]({page})" not in readme] == []


def test_every_package_has_its_place(project_root: Path, package_root: Path) -> None:
    page = (project_root / "python" / "docs" / "architecture.md").read_text(encoding="utf-8")
    packages = [f"`{path.parent.name}/`" for path in package_root.glob("*/__init__.py")]
    modules = [f"`{path.stem}`" for path in package_root.glob("*.py") if not path.stem.startswith("__")]
    assert packages, "no package found: the search is broken"
    assert [name for name in packages + modules if name not in page] == []


def test_every_crate_has_its_place(project_root: Path) -> None:
    page = (project_root / "python" / "docs" / "architecture.md").read_text(encoding="utf-8")
    crates = [f"`rust/{path.parent.name}`" for path in (project_root / "rust").glob("*/Cargo.toml")]
    assert crates, "no crate found: the search is broken"
    assert [name for name in crates if name not in page] == []


def test_the_floors_in_the_page_are_the_enforced_ones(project_root: Path) -> None:
    from_page = {}
    page = (project_root / "python" / "docs" / "architecture.md").read_text(encoding="utf-8")
    for number, names in re.findall(r"^\| (\d) \| ([^|]*) \|", page, flags=re.MULTILINE):
        from_page[int(number)] = {name.rstrip("/") for name in re.findall(r"`([^`]+)`", names)}
    source = (Path(__file__).parent / "test_floors.py").read_text(encoding="utf-8")
    enforced = [set(re.findall(r'"(\w+)"', line)) for line in re.findall(r"frozenset\(\{(.*)\}\),", source)]
    assert [from_page[number] for number in sorted(from_page)] == [names - {"__main__"} for names in enforced]


def test_the_page_of_laws_lists_every_law_with_its_parameters(project_root: Path) -> None:
    page = (project_root / "python" / "docs" / "laws.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert rows
    for entry in catalogue(extended=True):
        if entry.name in known_own_laws():
            continue
        row = next((row for row in rows if f"`{entry.name}`" in row.split("|")[1]), None)
        assert row is not None, entry.name
        if entry.extended:
            told = entry.reported or "surrogate"
            assert told in row.split("|")[2], entry.name
            assert ("≈" in row.split("|")[2]) == entry.nearest, entry.name
        short = "the same with" in row or "to " in row.split("|")[3 if entry.extended else 2]
        for name in entry.parameter_names:
            assert short or re.search(rf"\b{name}\b", row), (entry.name, name)


def known_own_laws() -> set[str]:
    """Laws that other tests have registered."""
    return {entry.name for entry in CATALOGUE.values() if entry.parameters and np.isfinite(entry.parameters[0].typical)}
