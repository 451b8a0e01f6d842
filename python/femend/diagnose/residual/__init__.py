"""Where the linear model is wrong by the energy of its residual, and which parameters could remove it."""
