"""Plain words for the names of result.json: verdicts, physics, parameters."""

from __future__ import annotations

__all__ = ["DIRECTIONS", "PARAMETERS", "PHYSICS", "STATUS", "VERDICTS"]

VERDICTS = {
    "consistent": "Consistent",
    "parameters-only": "Parameters only",
    "missing-physics": "Missing physics",
    "located-not-named": "Located, not named",
    "undetermined": "Undetermined",
}

# what a status means, and what to do
STATUS = {
    "stalled": "the last fit ended before it came to its minimum, so that values may be off by more than the "
    "deviations told: hold what is told against the errors of held-out recordings, and run the study again with "
    "fewer parameters, or a smaller prior_sd for those with the widest deviations",
}

PHYSICS = {
    "support_stiffness": "elastic support",
    "compliant_support": "compliant support (modelled as fixed)",
    "joint_stiffness": "flexible joint or weakened member",
    "spring_bending": "spring that carries moments",
    "added_mass": "added mass",
    "tuned_absorber": "attached oscillator (tuned absorber)",
    "viscous_damper": "viscous damper",
    "structural_damping": "structural (hysteretic) damping",
    "viscoelastic": "viscoelastic support",
    "quadratic_damping": "quadratic damping, force as v·|v|",
    "cubic_stiffness": "cubic stiffness",
    "clearance": "contact with a gap",
    "bilinear_stiffness": "bilinear stiffness",
    "coulomb_friction": "dry friction",
    "bouc_wen": "smooth hysteresis (Bouc-Wen)",
    "gyroscopic": "gyroscopic coupling",
    "speed_stiffness": "stiffness that changes with speed",
    "unmeasured_force": "force nobody recorded",
    "base_motion": "motion of the ground",
    "load_misplaced": "load at another place or direction than recorded",
    "unbalance_law": "other unbalance than assumed",
    "stiffness": "a stiffness",
    "inertia": "an inertia",
    "damping": "a damping",
    "nonlinear elastic": "a nonlinear elastic force",
    "hysteretic": "a hysteretic force",
    "speed": "an effect of speed",
    "load": "a load",
    "none": "nothing added",
    "untried": "something that was not tried",
}

PARAMETERS = {
    "k": "stiffness",
    "gap": "gap",
    "c": "damping coefficient",
    "m": "mass",
    "k3": "cubic stiffness",
    "f": "slip force",
    "kt": "stiffness before slip",
    "v0": "speed below which it creeps",
    "k0": "long-term stiffness",
    "k1": "relaxing stiffness",
    "tau": "relaxation time",
    "eta": "loss factor",
    "k_plus": "stiffness in tension",
    "k_minus": "stiffness in compression",
    "k_rot": "rotational stiffness",
    "factor": "factor",
    "frequency": "frequency",
    "amplitude": "amplitude",
    "level": "level",
    "Ip": "polar inertia",
    "coupling": "lateral motion to moment",
}


# k1..k6 of a support or joint are stiffnesses by direction; elsewhere k1 is the Zener branch and k3 the cubic factor.
DIRECTIONS = {"k1": "X", "k2": "Y", "k3": "Z", "k4": "RX", "k5": "RY", "k6": "RZ"}
