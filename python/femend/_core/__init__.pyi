"""The compiled core, told by what it is for; all names are those of the one extension module `femend._core`."""

from femend._core.identify import (
    FreeForce as FreeForce,
    Hypothesis as Hypothesis,
    RecordLines as RecordLines,
    System as System,
    closing_sigma as closing_sigma,
    fitted_lines as fitted_lines,
    follow_free_force as follow_free_force,
    force_products as force_products,
    model_columns as model_columns,
    n_decaying as n_decaying,
    pair_costs as pair_costs,
    solve_hypotheses as solve_hypotheses,
)
from femend._core.linear import (
    ComplexProblem as ComplexProblem,
    Factor as Factor,
    Symbolic as Symbolic,
    frf_direct as frf_direct,
    frf_modal as frf_modal,
    frf_modal_scores as frf_modal_scores,
    frf_reduced as frf_reduced,
    modes as modes,
    residual_vectors as residual_vectors,
)
from femend._core.model import (
    Deck as Deck,
    FeModel as FeModel,
    MovedNodes as MovedNodes,
)
from femend._core.sensitivities import (
    eigen_sensitivities as eigen_sensitivities,
    frf_direct_sensitivities as frf_direct_sensitivities,
    frf_modal_sensitivities as frf_modal_sensitivities,
    modal_projections as modal_projections,
    ritz_basis as ritz_basis,
    shape_sensitivities as shape_sensitivities,
)
from femend._core.simulate import (
    forget_law as forget_law,
    harmonic_branches as harmonic_branches,
    law_dynamic_stiffness as law_dynamic_stiffness,
    law_force as law_force,
    law_library as law_library,
    law_slopes as law_slopes,
    register_law as register_law,
    simulate as simulate,
    simulate_batch as simulate_batch,
    simulate_tangents as simulate_tangents,
)

__version__: str
