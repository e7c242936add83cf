//! Soft constraints: a contact as an implicit, strongly damped spring, independent of mass.
//!
//! Source: E. Catto, "Soft Constraints", GDC 2011, and Box2D v3's solver. For angular frequency w, damping ratio z and
//! substep h, the implicit Euler step of the spring gives the three coefficients below.

use crate::model::params::Params;

/// The coefficients of a soft constraint over one substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Softness {
    /// Overlap to velocity, 1/s, already scaled by `mass_scale`.
    pub(crate) bias_rate: f32,
    /// Part of the effective mass that acts.
    pub(crate) mass_scale: f32,
    /// Part of the accumulated impulse that is taken back.
    pub(crate) impulse_scale: f32,
}

impl Softness {
    fn new(hertz: f32, damping_ratio: f32, h: f32) -> Self {
        let omega = 2.0 * std::f32::consts::PI * hertz;
        let a1 = 2.0 * damping_ratio + h * omega;
        let a2 = h * omega * a1;
        let a3 = 1.0 / (1.0 + a2);
        let mass_scale = a2 * a3;
        Self { bias_rate: mass_scale * (omega / a1), mass_scale, impulse_scale: a3 }
    }

    /// Between two dynamic bodies.
    pub(crate) fn contact(params: &Params) -> Self {
        Self::new(Self::hertz(params), params.contact_damping_ratio, params.substep())
    }

    /// Against a static: twice as stiff, so that nothing is pressed through the ground.
    pub(crate) fn static_contact(params: &Params) -> Self {
        Self::new(2.0 * Self::hertz(params), params.contact_damping_ratio, params.substep())
    }

    /// A spring faster than a quarter of the substep rate cannot be followed.
    fn hertz(params: &Params) -> f32 {
        crate::model::math::min(params.contact_hertz, 0.25 / params.substep())
    }
}
