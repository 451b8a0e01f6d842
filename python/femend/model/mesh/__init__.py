"""How far a mesh can be trusted: refined once, its error mode by mode, its resolution, errors of form."""
