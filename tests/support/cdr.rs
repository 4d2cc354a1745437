//! ROS 2 payloads in CDR: little-endian, aligned relative to the end of the four-byte header.

/// A payload being written.
pub struct Cdr(Vec<u8>);

impl Default for Cdr {
    fn default() -> Self {
        Self(vec![0, 1, 0, 0])
    }
}

impl Cdr {
    fn align(&mut self, to: usize) {
        while !(self.0.len() - 4).is_multiple_of(to) {
            self.0.push(0);
        }
    }

    pub fn u8(mut self, value: u8) -> Self {
        self.0.push(value);
        self
    }

    pub fn u32(mut self, value: u32) -> Self {
        self.align(4);
        self.0.extend(value.to_le_bytes());
        self
    }

    pub fn u64(mut self, value: u64) -> Self {
        self.align(8);
        self.0.extend(value.to_le_bytes());
        self
    }

    pub fn f32(self, value: f32) -> Self {
        self.u32(value.to_bits())
    }

    pub fn f64(self, value: f64) -> Self {
        self.u64(value.to_bits())
    }

    pub fn f32s(self, values: &[f32]) -> Self {
        let len = u32::try_from(values.len()).unwrap();
        values.iter().fold(self.u32(len), |cdr, v| cdr.f32(*v))
    }

    pub fn text(self, value: &str) -> Self {
        let mut cdr = self.u32(u32::try_from(value.len() + 1).unwrap());
        cdr.0.extend(value.bytes());
        cdr.0.push(0);
        cdr
    }

    /// Bytes as they are.
    pub fn raw(mut self, bytes: &[u8]) -> Self {
        self.0.extend(bytes);
        self
    }

    /// `builtin_interfaces/Time`.
    pub fn time(self, nanos: i64) -> Self {
        let seconds = u32::try_from(nanos / 1_000_000_000).unwrap();
        self.u32(seconds)
            .u32(u32::try_from(nanos % 1_000_000_000).unwrap())
    }

    /// `std_msgs/Header`.
    pub fn header(self, nanos: i64, frame: &str) -> Self {
        self.time(nanos).text(frame)
    }

    pub fn done(self) -> Vec<u8> {
        self.0
    }
}
