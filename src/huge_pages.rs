//! Large arrays on large pages, where the operating system has them for the asking: fewer of its
//! interruptions while they are first filled, and fewer misses of address translation ever after.
#![allow(unsafe_code, reason = "a hint to the operating system about memory")]

/// Smaller arrays are left alone.
#[cfg(target_os = "linux")]
const LEAST_BYTES: usize = 8 << 20;

/// Asks for large pages for an array that nobody has touched yet and that will be filled.
#[cfg(target_os = "linux")]
pub(crate) fn ask_for<T>(array: &mut [T]) {
    const PAGE: usize = 4096;
    let bytes = size_of_val(array);
    if bytes < LEAST_BYTES {
        return;
    }
    let start = array.as_mut_ptr().cast::<u8>();
    let to_page = start.align_offset(PAGE);
    let length = (bytes - to_page) / PAGE * PAGE;
    // SAFETY: the pages from the first boundary in the array on, as far as they are in it, are the
    // array's own. The hint changes neither what they hold nor who may use them, and may fail.
    unsafe {
        libc::madvise(start.add(to_page).cast(), length, libc::MADV_HUGEPAGE);
    }
}

/// Asks for nothing: there is no such hint here.
#[cfg(not(target_os = "linux"))]
pub(crate) fn ask_for<T>(_: &mut [T]) {}

#[cfg(test)]
mod tests {
    #[test]
    fn the_array_stays_what_it_is() {
        for count in [0, 1, 1000, (8 << 20) + 17, (16 << 20) + 5] {
            let mut array = vec![0u8; count];
            super::ask_for(&mut array);
            assert!(array.iter().all(|byte| *byte == 0));
            array.iter_mut().zip(1..=255).for_each(|(byte, value)| *byte = value);
            super::ask_for(&mut array);
            assert!(array.iter().zip(1..=255).all(|(byte, value)| *byte == value));
        }
    }
}
