//! Which modes' free decays a record's end cuts off so that its lines show it.

/// Time constants of a window exp(-σt) after which nothing of a record is left that its end could cut off.
const CLOSED: f64 = 7.0;

/// Modes up to this multiple of the highest line's frequency have free decays that the lines can tell from noise.
const DECAYS_ABOVE: f64 = 1.5;

/// Modes further above that a force reaches ring as well: so many of them decay by themselves at most. Together they are
/// smooth over the lines, of which few tell all that can be told.
const DRIVEN: usize = 12;

/// Decay σ, 1/s, above which a window exp(-σt) has closed at the end of a record of `duration` s: nothing is cut off then.
#[must_use]
pub fn closing_sigma(duration: f64) -> f64 {
    CLOSED / duration
}

/// How many modes of circular frequencies `omega`, in rising order, have free decays on lines up to `highest` (rad/s): the
/// `n_tuned` of the band, and those above the lines whose skirts reach into them, the first one wherever it is: a stiff law
/// brings it near. Where the lines end below what the forces excite (up to `driven`, rad/s; 0 where that is not known),
/// modes above them ring on too, and do not follow the force at once.
#[must_use]
pub fn n_decaying(omega: &[f64], highest: f64, n_tuned: usize, driven: f64) -> usize {
    let below = |limit: f64| omega.iter().take_while(|w| **w < limit).count();
    let ringing = below(DECAYS_ABOVE * driven).min(below(highest) + DRIVEN);
    n_tuned.max(below(DECAYS_ABOVE * highest)).max(below(highest) + 1).max(ringing).min(omega.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_of_the_band_and_the_first_above_it_decay() {
        let omega = [10.0, 50.0, 140.0, 160.0, 900.0];
        assert_eq!(n_decaying(&omega, 100.0, 1, 0.0), 3);
        assert_eq!(n_decaying(&omega, 100.0, 4, 0.0), 4);
        assert_eq!(n_decaying(&omega, 200.0, 1, 0.0), 5);
        assert_eq!(n_decaying(&omega, 1000.0, 1, 0.0), 5);
    }

    #[test]
    fn modes_above_the_lines_that_the_force_reaches_decay_but_for_the_many() {
        let omega = [10.0, 50.0, 140.0, 160.0, 900.0];
        assert_eq!(n_decaying(&omega, 100.0, 1, 80.0), 3);
        assert_eq!(n_decaying(&omega, 100.0, 1, 110.0), 4);
        assert_eq!(n_decaying(&omega, 100.0, 1, 1000.0), 5);
        let many: Vec<f64> = (1..100).map(|k| 10.0 * f64::from(k)).collect();
        assert_eq!(n_decaying(&many, 100.0, 1, 1e4), 9 + DRIVEN);
    }

    #[test]
    fn a_window_closes_the_sooner_the_longer_the_record() {
        // a thousandth is left
        assert!((-closing_sigma(2.0) * 2.0).exp() < 1e-3);
        assert!((closing_sigma(2.0) - 2.0 * closing_sigma(4.0)).abs() < 1e-12);
    }
}
