//! Small mathematics with the same bits on every machine: IEEE operations in a fixed order, no fused multiply-add, no
//! host `sin`, and no `f32::max` (its result for -0.0 and 0.0 differs between build profiles).

use bytemuck::{Pod, Zeroable};
use glam::Vec2;

/// A rotation in the plane: the cosine and the sine of its angle.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Rot {
    /// Cosine of the angle.
    pub c: f32,
    /// Sine of the angle.
    pub s: f32,
}

impl Default for Rot {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Rot {
    /// No rotation.
    pub const IDENTITY: Self = Self { c: 1.0, s: 0.0 };

    /// The rotation by `angle` radians, counter-clockwise.
    pub fn from_angle(angle: f32) -> Self {
        Self { c: libm::cosf(angle), s: libm::sinf(angle) }
    }

    /// The angle in radians, in [-pi, pi].
    pub fn angle(self) -> f32 {
        libm::atan2f(self.s, self.c)
    }

    /// Turns a vector from the rotated frame to the world.
    #[inline(always)]
    pub fn rotate(self, v: Vec2) -> Vec2 {
        Vec2::new(self.c * v.x - self.s * v.y, self.s * v.x + self.c * v.y)
    }

    /// Turns a vector from the world to the rotated frame.
    #[inline(always)]
    pub fn unrotate(self, v: Vec2) -> Vec2 {
        Vec2::new(self.c * v.x + self.s * v.y, self.c * v.y - self.s * v.x)
    }

    /// First `other`, then `self`.
    #[inline(always)]
    pub fn after(self, other: Self) -> Self {
        Self { c: self.c * other.c - self.s * other.s, s: self.s * other.c + self.c * other.s }
    }

    /// The rotation that leads from `self` to `other`.
    #[inline(always)]
    pub fn to(self, other: Self) -> Self {
        Self { c: self.c * other.c + self.s * other.s, s: self.c * other.s - self.s * other.c }
    }

    pub(crate) fn is_finite(self) -> bool {
        self.c.is_finite() && self.s.is_finite()
    }

    /// The same direction at length one.
    #[inline(always)]
    pub fn normalized(self) -> Self {
        let scale = 1.0 / (self.c * self.c + self.s * self.s).sqrt();
        Self { c: self.c * scale, s: self.s * scale }
    }
}

/// The tangent of an angle of up to one radian, in rad: to a hundredth of it there, and to 1e-5 up to a quarter (the first three terms of
/// its series).
#[inline(always)]
pub(crate) fn tangent(angle: f32) -> f32 {
    let square = angle * angle;
    angle + angle * (square * (TANGENT[0] + TANGENT[1] * square))
}

/// The second and third coefficients of the tangent's series.
pub(crate) const TANGENT: [f32; 2] = [1.0 / 3.0, 2.0 / 15.0];

/// Whether this thread computes as IEEE 754 has it by default: subnormal numbers kept, rounding to nearest. A library
/// loaded into the process may have changed that.
pub(crate) fn float_mode_is_default() -> bool {
    let hide = std::hint::black_box::<f32>;
    let keeps_subnormals = hide(f32::MIN_POSITIVE) * hide(0.5) > 0.0;
    // A quarter of the last place of one vanishes, three quarters of it round up: in no direction but to nearest.
    let ulp = f32::EPSILON;
    keeps_subnormals && hide(1.0) + hide(0.25 * ulp) == 1.0 && hide(1.0) + hide(0.75 * ulp) == 1.0 + ulp
}

/// The z component of the cross product of two vectors.
#[inline(always)]
pub(crate) fn cross(a: Vec2, b: Vec2) -> f32 {
    a.x * b.y - a.y * b.x
}

/// The inner product.
#[inline(always)]
pub(crate) fn dot(a: Vec2, b: Vec2) -> f32 {
    a.x * b.x + a.y * b.y
}

/// The velocity of a point at `r` from the center of a body that turns with `omega`.
#[inline(always)]
pub(crate) fn turn(omega: f32, r: Vec2) -> Vec2 {
    Vec2::new(-omega * r.y, omega * r.x)
}

/// `v` turned by a quarter clockwise: the tangent that belongs to a normal.
#[inline(always)]
pub(crate) fn right_perp(v: Vec2) -> Vec2 {
    Vec2::new(v.y, -v.x)
}

/// The greater of two; the second where they compare equal or not at all.
#[inline(always)]
pub(crate) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The lesser of two; the second where they compare equal or not at all.
#[inline(always)]
pub(crate) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// `x` held within `[low, high]`.
#[inline(always)]
pub(crate) fn clamp(x: f32, low: f32, high: f32) -> f32 {
    min(max(x, low), high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_float_mode_is_told_from_others() {
        assert!(float_mode_is_default());
        #[cfg(target_arch = "x86_64")]
        for changed in [0x1F80 | 1 << 15, 0x1F80 | 1 << 13, 0x1F80 | 1 << 14, 0x1F80 | 3 << 13] {
            // Flush to zero; rounding down, up, towards zero.
            assert!(!with_mxcsr(changed, float_mode_is_default));
        }
        assert!(float_mode_is_default());
    }

    /// Runs `f` under another control word of the SSE unit.
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    fn with_mxcsr<R>(changed: u32, f: impl Fn() -> R) -> R {
        let set = |word: u32| {
            // SAFETY: loads a valid control word, all exceptions masked; the caller puts the default back.
            unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &word) };
        };
        set(changed);
        let result = f();
        set(0x1F80);
        result
    }
}
