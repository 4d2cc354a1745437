//! Conversions of floating-point numbers. To integers: the fraction is dropped, values out of range become the nearest
//! one of the type, and NaN becomes 0. To 32 bits: the nearest one.

macro_rules! casts {
    ($($name:ident: $to:ty),*) => {
        $(#[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the module documents the result for every number"
        )]
        pub(crate) fn $name(value: f64) -> $to {
            value as $to
        })*
    };
}

casts! { to_i64: i64, to_u64: u64, to_usize: usize, to_u32: u32, to_u8: u8, to_f32: f32 }
