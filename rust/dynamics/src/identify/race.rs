//! Which of many minimisations go on.

/// Minimisations that are given up far behind others.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Race {
    /// After so many steps, in rising order, those go on whose cost is at most this multiple of the lowest in their group.
    pub heats: Vec<(usize, f64)>,
    /// Group of each; all race each other where it is empty.
    pub groups: Vec<usize>,
}

impl Race {
    /// Whether each of these goes on, from its cost where it has one.
    pub(super) fn going_on(&self, costs: &[Option<f64>], ratio: f64) -> Vec<bool> {
        let group = |i: usize| self.groups.get(i).copied().unwrap_or(0);
        let n_groups = self.groups.iter().max().map_or(1, |last| last + 1);
        let mut least = vec![f64::INFINITY; n_groups];
        for (i, cost) in costs.iter().enumerate() {
            least[group(i)] = cost.unwrap_or(f64::INFINITY).min(least[group(i)]);
        }
        let near = |(i, cost): (usize, &Option<f64>)| cost.is_some_and(|c| c <= ratio * least[group(i)]);
        costs.iter().enumerate().map(near).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Race;

    #[test]
    fn those_far_behind_the_best_of_their_group_are_given_up() {
        let race = Race { heats: Vec::new(), groups: vec![0, 0, 1, 1, 2] };
        let costs = [Some(1.0), Some(21.0), Some(50.0), Some(900.0), None];
        assert_eq!(race.going_on(&costs, 20.0), [true, false, true, true, false]);
        let alone = Race::default();
        assert_eq!(alone.going_on(&costs, 20.0), [true, false, false, false, false]);
    }
}
