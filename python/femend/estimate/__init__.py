"""Responses, residuals, sensitivities and least squares."""
