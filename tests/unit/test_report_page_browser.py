"""The report page in a browser: no errors, no requests, and what the pointer does."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from femend.report.page import render

from .report_pages import content

# Errors and refused resources are noted where --dump-dom shows them.
WATCH = """<script>
const noted = (words) => { document.documentElement.dataset.errors = words; };
addEventListener("error", (e) => noted(e.message || "load"), true);
addEventListener("securitypolicyviolation", (e) => noted(e.blockedURI));
</script>"""
# A drag over the mesh, a pointer in the middle of it, and a pointer at a known place of the first figure.
TOUCH = """<script>setTimeout(() => {
  const seen = document.documentElement.dataset, canvas = document.getElementById("mesh-canvas");
  const box = canvas.getBoundingClientRect(), before = canvas.toDataURL();
  const fire = (type, x, y, buttons) => canvas.dispatchEvent(new PointerEvent(type,
    { clientX: box.left + x, clientY: box.top + y, pointerId: 1, buttons, bubbles: true }));
  canvas.setPointerCapture = () => {};
  fire("pointerdown", 100, 100, 1); fire("pointermove", 180, 130, 1); fire("pointerup", 180, 130, 0);
  setTimeout(() => {
    seen.turned = canvas.toDataURL() !== before;
    const tip = document.getElementById("mesh-tip");
    for (let x = 0; x < box.width && tip.hidden; x += 6)
      for (let y = 0; y < box.height && tip.hidden; y += 6) fire("pointermove", x, y, 0);
    seen.tip = tip.textContent;
    const plot = document.querySelector("svg[data-axes]"), at = plot.getBoundingClientRect(), scale = at.width / 520;
    plot.dispatchEvent(new PointerEvent("pointermove",
      { clientX: at.left + scale * (58 + 450 / 2), clientY: at.top + scale * 60, bubbles: true }));
    seen.read = plot.lastChild.textContent;
  }, 300);
}, 300);</script></body>"""


def browse(text: str, folder: Path) -> tuple[str, str]:
    """The document and the log after a headless browser has opened the page."""
    browser = next((b for b in ("chromium", "chromium-browser", "google-chrome") if shutil.which(b)), None)
    if browser is None:
        pytest.skip("no Chromium or Chrome on this machine")
    page = folder / "report.html"
    page.write_text(text.replace("<style>", WATCH + "<style>", 1), encoding="utf-8")
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=3000"]
    command += ["--enable-logging=stderr", f"--user-data-dir={folder / 'profile'}", "--dump-dom", page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert "</html>" in done.stdout, done.stderr[-2000:]
    return done.stdout, done.stderr


@pytest.mark.parametrize("verdict", ["missing-physics", "consistent"])
def test_a_browser_opens_the_page_without_errors_or_requests(verdict: str, tmp_path: Path) -> None:
    document, log = browse(render(content(verdict)), tmp_path)
    assert "data-errors" not in document[:400]
    assert [line for line in log.splitlines() if ":CONSOLE" in line] == []
    assert re.search(r'id="mesh-box" class="live"', document), "the viewer did not start"


def test_the_mesh_turns_and_values_are_read_under_the_pointer(tmp_path: Path) -> None:
    document, log = browse(render(content()).replace("</body>", TOUCH), tmp_path)
    assert [line for line in log.splitlines() if ":CONSOLE" in line] == []
    seen = dict(re.findall(r'data-(\w+)="([^"]*)"', document[:600]))
    assert seen["turned"] == "true"
    assert re.match(r"node \d+\n\(", seen["tip"])
    assert seen["read"].startswith("91 Hz,")  # the middle of 2 ... 180 Hz
