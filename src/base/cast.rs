//! Numbers with a fraction as whole ones, without the fraction: one too large or too small becomes the nearest that the
//! type has, and one that is no number becomes 0.

macro_rules! casts {
    ($($name:ident: $whole:ty),*) => {
        $(#[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "what becomes of any number is said above"
        )]
        pub(crate) fn $name(value: f64) -> $whole {
            value as $whole
        })*
    };
}

casts! { to_i64: i64, to_u64: u64, to_usize: usize, to_u32: u32, to_u8: u8 }
