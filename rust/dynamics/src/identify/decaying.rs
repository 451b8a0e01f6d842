//! Which modes' free decays a record's end cuts off so that its lines show it.

/// Time constants of a window exp(-σt) after which nothing of a record is left that its end could cut off.
const CLOSED: f64 = 7.0;

/// Modes up to this multiple of the highest line's frequency have free decays that the lines can tell from noise.
const DECAYS_ABOVE: f64 = 1.5;

/// Decay σ, 1/s, above which a window exp(-σt) has closed at the end of a record of `duration` s: nothing is cut off then.
#[must_use]
pub fn closing_sigma(duration: f64) -> f64 {
    CLOSED / duration
}

/// How many modes of circular frequencies `omega`, in rising order, have free decays on lines up to `highest` (rad/s): the
/// `n_tuned` of the band, and those above the lines whose skirts reach into them, the first one wherever it is: a stiff law
/// brings it near.
#[must_use]
pub fn n_decaying(omega: &[f64], highest: f64, n_tuned: usize) -> usize {
    let below = |limit: f64| omega.iter().take_while(|w| **w < limit).count();
    n_tuned.max(below(DECAYS_ABOVE * highest)).max(below(highest) + 1).min(omega.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_of_the_band_and_the_first_above_it_decay() {
        let omega = [10.0, 50.0, 140.0, 160.0, 900.0];
        assert_eq!(n_decaying(&omega, 100.0, 1), 3);
        assert_eq!(n_decaying(&omega, 100.0, 4), 4);
        assert_eq!(n_decaying(&omega, 200.0, 1), 5);
        assert_eq!(n_decaying(&omega, 1000.0, 1), 5);
    }

    #[test]
    fn a_window_closes_the_sooner_the_longer_the_record() {
        // a thousandth is left
        assert!((-closing_sigma(2.0) * 2.0).exp() < 1e-3);
        assert!((closing_sigma(2.0) - 2.0 * closing_sigma(4.0)).abs() < 1e-12);
    }
}
