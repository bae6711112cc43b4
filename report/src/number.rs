//! Numbers as text for people: three significant digits, thousands separators, fractions in percent.

/// Three significant digits; with an exponent only for very small or large values: `0.0123`, `1.23e-7`, `12,300`.
#[must_use]
pub fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return "unknown".to_owned();
    }
    let exponent = decimal_exponent(value);
    if !(-3..9).contains(&exponent) {
        return format!("{value:.2e}");
    }
    let decimals = (2 - exponent).max(0) as usize;
    let rounded = if exponent > 2 {
        let unit = 10_f64.powi(exponent - 2);
        (value / unit).round() * unit
    } else {
        value
    };
    let text = format!("{rounded:.decimals$}");
    let (whole, rest) = text.split_once('.').unwrap_or((&text, ""));
    if rest.is_empty() {
        thousands(whole)
    } else {
        format!("{}.{rest}", thousands(whole))
    }
}

/// Exponent of the leading digit of a finite number other than zero.
#[expect(
    clippy::cast_possible_truncation,
    reason = "log10 of a finite number lies between -324 and 309"
)]
fn decimal_exponent(value: f64) -> i32 {
    value.abs().log10().floor() as i32
}

/// A count with thousands separators: `12,345`.
#[must_use]
pub fn counted(value: u64) -> String {
    thousands(&value.to_string())
}

/// A fraction in percent: `48.3 %`.
#[must_use]
pub fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share))
}

fn thousands(digits: &str) -> String {
    let (sign, digits) = digits.strip_prefix('-').map_or(("", digits), |rest| ("-", rest));
    let mut text = String::from(sign);
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place) % 3 == 0 {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{counted, percent, significant};

    #[test]
    fn numbers_read_well() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1.00"),
            (0.012_345, "0.0123"),
            (12_345.0, "12,300"),
            (123.4, "123"),
            (1.2e-7, "1.20e-7"),
            (-45.67, "-45.7"),
            (f64::NAN, "unknown"),
        ] {
            assert_eq!(significant(value), text);
        }
        assert_eq!(counted(1_234_567), "1,234,567");
        assert_eq!(percent(0.4832), "48.3 %");
    }
}
