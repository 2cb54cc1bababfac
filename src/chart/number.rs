//! Numbers as a chart prints them.

/// With a true minus sign, which is as wide as a plus.
fn with_minus(text: String) -> String {
    text.replace('-', "\u{2212}")
}

/// With so many decimals.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    // No "-0.00".
    let is_zero = text.chars().all(|c| "-0.".contains(c));
    with_minus(if is_zero { text.replace('-', "") } else { text })
}

/// As a power of ten: `2.5×10⁻⁷`, or `10⁶`.
fn scientific(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let raised = |c: char| match c.to_digit(10) {
        Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
        None => '⁻',
    };
    let power: String = exponent.chars().map(raised).collect();
    with_minus(if mantissa == "1" {
        format!("10{power}")
    } else {
        format!("{mantissa}×10{power}")
    })
}

/// Decimal exponent of the first digit.
fn exponent(value: f64) -> i32 {
    if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 }
}

/// To three digits.
pub(super) fn three_digits(value: f64) -> String {
    match exponent(value) {
        _ if value == 0.0 => "0".into(),
        e @ -3..=5 => fixed(value, (2 - e).max(0) as usize),
        _ => scientific(value, 2),
    }
}

/// A round value, without zeros at its end.
pub(super) fn round(value: f64) -> String {
    match exponent(value) {
        _ if value == 0.0 => "0".into(),
        e @ -4..=5 => {
            let text = fixed(value, (3 - e).max(0) as usize);
            if text.contains('.') {
                text.trim_end_matches('0').trim_end_matches('.').into()
            } else {
                text
            }
        }
        _ => {
            let short = scientific(value, 0);
            let exact =
                (format!("{value:.0e}").parse::<f64>().unwrap_or(value) / value - 1.0).abs();
            if exact < 1e-9 { short } else { scientific(value, 2) }
        }
    }
}

/// How values are printed: the decimals that were asked for, else such that the largest has three
/// digits, if they share an order of magnitude, or else three digits each.
pub(super) fn printer(
    asked: Option<usize>,
    values: impl Iterator<Item = f64>,
) -> impl Fn(f64) -> String {
    let (mut least, mut most) = (i32::MAX, i32::MIN);
    for exponent in values.filter(|v| v.is_finite() && *v != 0.0).map(exponent) {
        (least, most) = (least.min(exponent), most.max(exponent));
    }
    let shared = most.saturating_sub(least) <= 1 && (-2..=5).contains(&most);
    let decimals = asked.or_else(|| shared.then(|| (2 - most).max(0) as usize));
    move |value| match decimals {
        Some(decimals) if value.abs() < 1e9 => fixed(value, decimals),
        _ => three_digits(value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_exact() {
        let rounds = [0.0, 1.0, 0.05, 0.001, 1500.0, 200_000.0, 1e6, 2e-7, -0.5, 2.5e9];
        let texts = rounds.map(round);
        let wanted =
            ["0", "1", "0.05", "0.001", "1500", "200000", "10⁶", "2×10⁻⁷", "−0.5", "2.50×10⁹"];
        assert_eq!(texts, wanted);
        assert_eq!([0.612, 12.345, 1e-9].map(three_digits), ["0.612", "12.3", "1.00×10⁻⁹"]);
        assert_eq!(fixed(-0.001, 2), "0.00");
    }

    #[test]
    fn values_of_one_magnitude_share_decimals() {
        let ratios = printer(None, [0.6, 2.41, f64::NAN].into_iter());
        assert_eq!([ratios(0.6), ratios(2.41)], ["0.60", "2.41"]);
        let times = printer(None, [0.012, 812.0].into_iter());
        assert_eq!([times(0.012), times(812.0)], ["0.0120", "812"]);
        assert_eq!(printer(Some(1), [1e30].into_iter())(1e30), "1.00×10³⁰");
    }
}
