"""Responses to one force that nobody recorded."""
