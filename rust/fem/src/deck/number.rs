//! Numbers as bulk data writes them, and back into a field of given width.

/// Longest number that can stand in a field; longer text is refused.
const MAX: usize = 40;

/// Reads an integer: optional sign and digits, nothing else. `None` if it is not one or does not fit.
#[must_use]
pub fn parse_int(text: &[u8]) -> Option<i64> {
    let (negative, digits) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, text),
    };
    if digits.is_empty() || digits.len() > 18 || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let value = digits.iter().fold(0_i64, |value, digit| value * 10 + i64::from(digit - b'0'));
    Some(if negative { -value } else { value })
}

/// Reads a real: `1.`, `.5`, `1.5E3`, `1.5D+3`, `1.5-3`, `2.9+7`, and an integer, whose meaning is plain.
/// `None` for anything else and for what overflows.
#[must_use]
pub fn parse_real(text: &[u8]) -> Option<f64> {
    if text.len() > MAX {
        return None;
    }
    let mut plain = [0_u8; MAX + 1];
    let mut n = 0;
    let (mut digits, mut exponent, mut exponent_digits) = (0, false, 0);
    for (i, &c) in text.iter().enumerate() {
        let out = match c {
            b'0'..=b'9' => {
                if exponent {
                    exponent_digits += 1;
                } else {
                    digits += 1;
                }
                c
            }
            b'.' if !exponent => c,
            b'e' | b'E' | b'd' | b'D' if !exponent && digits > 0 => {
                exponent = true;
                b'e'
            }
            b'+' | b'-' if i == 0 || (exponent && matches!(text[i - 1], b'e' | b'E' | b'd' | b'D')) => c,
            b'+' | b'-' if !exponent && digits > 0 => {
                exponent = true;
                plain[n] = b'e';
                n += 1;
                c
            }
            _ => return None,
        };
        plain[n] = out;
        n += 1;
    }
    if digits == 0 || (exponent && exponent_digits == 0) {
        return None;
    }
    let value: f64 = std::str::from_utf8(&plain[..n]).ok()?.parse().ok()?;
    value.is_finite().then_some(value)
}

/// Writes `value` with a decimal point in at most `width` characters, as exactly as they allow.
/// `None` when not even one digit fits or the value is not finite.
#[must_use]
pub fn format_real(value: f64, width: usize) -> Option<String> {
    if !value.is_finite() {
        return None;
    }
    if value == 0.0 {
        return (width >= 2).then(|| "0.".to_owned());
    }
    let mut best: Option<(f64, String)> = None;
    for text in candidates(value, width) {
        if text.len() > width {
            continue;
        }
        let Some(read) = parse_real(text.as_bytes()) else { continue };
        let error = (read - value).abs();
        let better = match &best {
            None => true,
            Some((least, kept)) => error < *least || (error == *least && text.len() < kept.len()),
        };
        if better {
            best = Some((error, text));
        }
    }
    best.map(|(_, text)| text)
}

/// Plain and exponent forms of `value` with every useful number of digits, longest last.
fn candidates(value: f64, width: usize) -> Vec<String> {
    let mut all = Vec::new();
    let magnitude = value.abs().log10().floor() as i32;
    for digits in 0..17_usize.min(width + 1) {
        all.push(exponent_form(value, digits));
    }
    if (-4..17).contains(&magnitude) {
        let longest = if magnitude < 0 { 17 + (-magnitude) as usize } else { 17 };
        for decimals in 0..=longest.min(width) {
            all.push(plain_form(value, decimals));
        }
    }
    all
}

/// `1.25+7`: mantissa with point, signed exponent without letter (the shortest Nastran knows).
fn exponent_form(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let mantissa = if mantissa.contains('.') {
        mantissa.trim_end_matches('0').to_owned()
    } else {
        format!("{mantissa}.")
    };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{sign}{exponent}")
}

/// `-.0125`: no exponent, no zero before the point.
fn plain_form(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = if decimals == 0 { format!("{text}.") } else { text.trim_end_matches('0').to_owned() };
    if let Some(rest) = text.strip_prefix("0.").filter(|rest| !rest.is_empty()) {
        format!(".{rest}")
    } else if let Some(rest) = text.strip_prefix("-0.").filter(|rest| !rest.is_empty()) {
        format!("-.{rest}")
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn reals_of_every_spelling_are_read() {
        for (text, value) in [
            ("1.", 1.0),
            (".5", 0.5),
            ("-.5", -0.5),
            ("1.5-3", 1.5e-3),
            ("1.2+11", 1.2e11),
            ("2.9E7", 2.9e7),
            ("2.9d+7", 2.9e7),
            ("-1.D-2", -0.01),
            ("7", 7.0),
            ("+3.e0", 3.0),
        ] {
            assert_eq!(parse_real(text.as_bytes()), Some(value), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in
            ["", ".", "+", "1.5-", "1e", "e5", "1..2", "1.2.3", "--1", "1.5+-3", "abc", "1 2", "=", "1e999"]
        {
            assert_eq!(parse_real(text.as_bytes()), None, "{text}");
        }
        for text in ["", "1.", "-", "1a", "99999999999999999999"] {
            assert_eq!(parse_int(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn small_fields_are_used_to_the_last_column() {
        assert_eq!(format_real(2.1e11, 8).unwrap(), "2.1+11");
        assert_eq!(format_real(-0.012_345_678, 8).unwrap(), "-.012346");
        assert_eq!(format_real(1.234_567_89e-9, 8).unwrap(), "1.2346-9");
        assert_eq!(format_real(0.3, 8).unwrap(), ".3");
        assert_eq!(format_real(7850.0, 8).unwrap(), "7850.");
        assert_eq!(format_real(-1.5e-100, 5), None);
    }

    proptest! {
        #[test]
        fn a_wide_field_keeps_every_bit(value in prop::num::f64::NORMAL) {
            let text = format_real(value, 24).unwrap();
            prop_assert_eq!(parse_real(text.as_bytes()), Some(value));
        }

        #[test]
        fn a_small_field_keeps_what_fits(value in -1e12_f64..1e12) {
            prop_assume!(value.abs() > 1e-9);
            let text = format_real(value, 8).unwrap();
            prop_assert!(text.len() <= 8 && text.contains('.'));
            let read = parse_real(text.as_bytes()).unwrap();
            prop_assert!((read - value).abs() <= 5.1e-3 * value.abs(), "{} {}", value, text);
        }
    }
}
