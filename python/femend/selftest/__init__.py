"""Concealed cases on the user's own model and sensors: what would a diagnosis find, name, miss and claim falsely?"""

from __future__ import annotations

from femend.selftest.found import Selftest
from femend.selftest.report import as_dict, as_html, as_text
from femend.selftest.run import run_selftest
from femend.selftest.score import Outcome, Share, wilson

__all__ = ["Outcome", "Selftest", "Share", "as_dict", "as_html", "as_text", "run_selftest", "wilson"]
