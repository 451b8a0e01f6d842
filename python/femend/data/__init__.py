"""Recordings, spectra, FRFs and modes: immutable, labelled by DOF and unit."""
