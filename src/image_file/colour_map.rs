//! Colours for numbers.

/// Colour of `value` in `[0, 1]` (forced into it; NaN counts as 0), dark violet to yellow, as sRGB:
/// the map `viridis` by Smith and van der Walt (2015), of even perceived steps, legible to the
/// colour-blind; here as the polynomial of degree six by Zucker (2019).
pub fn viridis(value: f32) -> [u8; 3] {
    const COEFFICIENTS: [[f32; 3]; 7] = [
        [0.277_727_33, 0.005_407_344_5, 0.334_099_8],
        [0.105_093_04, 1.404_613_5, 1.384_590_2],
        [-0.330_861_83, 0.214_847_56, 0.095_095_16],
        [-4.634_230_5, -5.799_101, -19.332_441],
        [6.228_27, 14.179_934, 56.690_55],
        [4.776_385, -13.745_145, -65.353_03],
        [-5.435_456, 4.645_852_6, 26.312_435],
    ];
    let t = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
    [0, 1, 2].map(|axis| {
        let level = COEFFICIENTS.iter().rev().fold(0.0, |sum, c| sum * t + c[axis]);
        (level.clamp(0.0, 1.0) * 255.0).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_are_those_of_the_table() {
        let table = [(0.0, [68, 1, 84]), (0.5, [33, 145, 140]), (1.0, [253, 231, 37])];
        for (value, expected) in table {
            let colour = viridis(value);
            let near = colour.iter().zip(expected).all(|(&a, b): (_, u8)| a.abs_diff(b) <= 5);
            assert!(near, "{value}: {colour:?} is not {expected:?}");
        }
        assert_eq!(viridis(f32::NAN), viridis(-1.0));
        assert_eq!(viridis(f32::INFINITY), viridis(1.0));
    }

    #[test]
    fn brightness_rises() {
        let brightness = |value: f32| {
            let [r, g, b] = viridis(value).map(u32::from);
            2126 * r + 7152 * g + 722 * b
        };
        for step in 0..32u8 {
            let value = f32::from(step) / 32.0;
            assert!(brightness(value) < brightness(value + 1.0 / 32.0), "at {value}");
        }
    }
}
