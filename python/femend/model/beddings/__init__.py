"""Elastic beddings as places: lines and areas of nodes that may stand on something."""
