"""One element measured by itself, with no structure around it."""

from femend.diagnose.element.element import ElementFit, fit_element, refit_element

__all__ = ["ElementFit", "fit_element", "refit_element"]
