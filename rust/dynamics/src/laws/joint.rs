//! The sum of several laws on one coordinate.

use super::law::Slopes;
use super::{Law, LawError, MANY, MAX_STATE, Motion, PreparedLaw, State};

/// Laws that act in parallel on the same coordinate, prepared for a step length.
#[derive(Clone, Debug)]
pub struct Joint {
    laws: Vec<PreparedLaw>,
    /// Whether some law has a state.
    remembers: bool,
    /// Whether every law is linear.
    linear: bool,
}

/// A joint's force at the end of a step, linearised; parameters are those of its laws one after the other.
#[derive(Clone, Debug, Default)]
pub struct Linearised {
    /// Slopes over d, v, a at the end of the step.
    pub df: [f64; 3],
    /// Per law: slopes of its force over (d, v, a), its old state, its parameters.
    force: Vec<Slopes>,
    /// Slopes over the parameters.
    pub df_dp: Vec<f64>,
    /// Per law and new state variable in use: slopes over (d, v, a), old state, own parameters.
    ds: Vec<Slopes>,
}

impl Joint {
    /// Prepares laws for steps of `dt` seconds.
    ///
    /// # Errors
    /// [`LawError::FrequencyOnly`].
    pub fn new(laws: &[Law], dt: f64) -> Result<Self, LawError> {
        let laws: Vec<_> = laws.iter().map(|law| law.prepare(dt)).collect::<Result<_, _>>()?;
        let remembers = laws.iter().any(|law| law.n_state() > 0);
        let linear = laws.iter().all(|law| law.kind().is_linear());
        Ok(Self { laws, remembers, linear })
    }

    /// Its laws.
    pub fn laws(&self) -> &[PreparedLaw] {
        &self.laws
    }

    /// Number of parameters of all laws together.
    pub fn n_parameters(&self) -> usize {
        self.laws.iter().map(PreparedLaw::n_parameters).sum()
    }

    /// Whether the force depends on what was before, so that some law has a state.
    pub fn remembers(&self) -> bool {
        self.remembers
    }

    /// Whether every law is linear.
    pub fn is_linear(&self) -> bool {
        self.linear
    }

    /// Whether some law depends on the acceleration.
    pub fn is_inertial(&self) -> bool {
        self.laws.iter().any(|law| law.kind().is_inertial())
    }

    /// Whether the force really changes with the acceleration: a linear companion without mass does not.
    pub fn uses_acceleration(&self) -> bool {
        self.laws.iter().any(PreparedLaw::uses_acceleration)
    }

    /// A state at rest.
    pub fn rest(&self) -> Vec<State<f64>> {
        vec![[0.0; MAX_STATE]; self.laws.len()]
    }

    /// Force (N), slopes over (d, v, a), and the new states written to `new`.
    #[inline]
    pub fn tangent(&self, x: Motion<f64>, state: &[State<f64>], new: &mut [State<f64>]) -> (f64, [f64; 3]) {
        let (mut f, mut df) = (0.0, [0.0; 3]);
        for ((law, s), s_new) in self.laws.iter().zip(state).zip(new) {
            let (force, slope) = law.tangent(x, s, s_new);
            f += force;
            for (sum, part) in df.iter_mut().zip(slope) {
                *sum += part;
            }
        }
        (f, df)
    }

    /// All derivatives at a motion reached from `state`.
    pub fn linearise(&self, x: Motion<f64>, state: &[State<f64>], out: &mut Linearised) {
        out.df = [0.0; 3];
        out.df_dp.clear();
        if out.force.len() != self.laws.len() {
            out.force.resize(self.laws.len(), [0.0; MANY]);
            out.ds.resize(self.laws.iter().map(PreparedLaw::n_state).sum(), [0.0; MANY]);
        }
        let mut row = 0;
        for ((law, s), force) in self.laws.iter().zip(state).zip(&mut out.force) {
            let n = law.n_state();
            law.linearise(x, s, force, &mut out.ds[row..row + n]);
            for (sum, part) in out.df.iter_mut().zip(&*force) {
                *sum += part;
            }
            out.df_dp.extend_from_slice(&force[3 + n..3 + n + law.n_parameters()]);
            row += n;
        }
    }

    /// Changes of the force by `L` changes of the states before the step.
    #[inline(always)]
    pub fn from_states<const L: usize>(&self, at: &Linearised, ds: &[[[f64; L]; MAX_STATE]]) -> [f64; L] {
        let mut sum = [0.0; L];
        if !self.remembers {
            return sum;
        }
        for ((law, slopes), ds) in self.laws.iter().zip(&at.force).zip(ds) {
            for k in 0..law.n_state() {
                for l in 0..L {
                    sum[l] += slopes[3 + k] * ds[k][l];
                }
            }
        }
        sum
    }

    /// Advances `L` derivatives of the states, at the coordinate `here`.
    ///
    /// `dx` are the derivatives of the motion at the end of the step; of those that are over a parameter `owner` has its
    /// coordinate and its index there.
    #[inline(always)]
    pub fn advance_states<const L: usize>(
        &self,
        at: &Linearised,
        dx: &[[f64; L]; 3],
        (here, owner): (usize, &[Option<(usize, usize)>; L]),
        ds: &mut [[[f64; L]; MAX_STATE]],
    ) {
        if !self.remembers {
            return;
        }
        let (mut first, mut row) = (0, 0);
        for (law, state) in self.laws.iter().zip(ds) {
            let (n, own) = (law.n_state(), first..first + law.n_parameters());
            let mut old = [[0.0; L]; MAX_STATE];
            old[..n].copy_from_slice(&state[..n]);
            for (new, slope) in state.iter_mut().zip(&at.ds[row..row + n]) {
                *new = [0.0; L];
                for q in 0..3 {
                    for l in 0..L {
                        new[l] += slope[q] * dx[q][l];
                    }
                }
                for k in 0..n {
                    for l in 0..L {
                        new[l] += slope[3 + k] * old[k][l];
                    }
                }
                for l in 0..L {
                    if let Some((i, j)) = owner[l]
                        && i == here
                        && own.contains(&j)
                    {
                        new[l] += slope[3 + n + j - first];
                    }
                }
            }
            first = own.end;
            row += n;
        }
    }
}
