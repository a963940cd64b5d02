"""Step control: the error ratio of an attempt, and the controllers that derive the next step from it."""

import functools
from typing import Any

import warp as wp

from warpchain.kernels.physics.elementary import ONE, order_bits

GREATEST_GROWTH = 5.0
SAFETY = 0.9
LEAST_SHRINKAGE = wp.constant(wp.float64(0.2))


@wp.func
def error_bits(error: wp.float64, value: wp.float64, rate: wp.float64, h: wp.float64):
    """Error ratio of one component times the tolerance, odeint's norm |e| / (1 + |y| + h |ẏ|), as ordered bits."""
    return order_bits(wp.abs(error) / (ONE + wp.abs(value) + h * wp.abs(rate)))


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    float power;
    asm("lg2.approx.ftz.f32 %0, %1;" : "=f"(power) : "f"(x));
    asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(power) : "f"(y * power));
    return power;
#else
    return ::powf(x, y);
#endif
""")
def quick_power(x: wp.float32, y: wp.float32) -> wp.float32:
    """x to the power of y; on a GPU to about 1e-6, in a sixth of the time of ``wp.pow``."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    float y;
    asm("sqrt.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(x));
    return y;
#else
    return ::sqrt(x);
#endif
""")
def quick_root(x: wp.float32) -> wp.float32:
    """Square root; on a GPU to a few units in the last place."""


@wp.func
def next_step(step: Any, h: Any, factor: Any):
    """Step [s] to propose after an accepted one of h. A shortened step must not lower the proposal it was cut from."""
    proposal = h * factor
    return wp.where(h < step, wp.max(step, proposal), proposal)


@functools.cache
def step_controller(order: int, error_order: int, real: type = wp.float64):
    """Warp functions (growth, shrinkage): factors of the step after acceptance and after rejection.

    Standard: Boost odeint's ``default_step_adjuster`` (K. Ahnert, M. Mulansky, AIP Conf. Proc. 1389 (2011) 1586), which
    lets steps grow only if the error is below half of the tolerance. Proportional-integral: K. Gustafsson, ACM TOMS 17
    (1991) 533, with the exponents 0.7/k and 0.4/k of E. Hairer and G. Wanner, Solving ODEs II, section IV.2. ``order``
    is of the propagated solution, ``error_order`` of the embedded one; ``real`` is ``wp.float32`` on a GPU. odeint's
    rule has no exponent for an embedded solution of order 1, which takes that of order 2.
    """
    least_error = 5.0**-order
    least_shrinkage = float(LEAST_SHRINKAGE)
    power = quick_power if real is wp.float32 else wp.pow

    @wp.func
    def growth(error: real, last_error: real, proportional: wp.int32):
        bounded = wp.max(error, wp.static(real(least_error)))
        if proportional != 0:
            factor = wp.static(real(SAFETY)) * power(bounded, wp.static(real(-0.7 / (error_order + 1))))
            before = wp.max(last_error, wp.static(real(least_error)))
            factor = factor * power(before, wp.static(real(0.4 / (error_order + 1))))
            return wp.clamp(factor, wp.static(real(least_shrinkage)), wp.static(real(GREATEST_GROWTH)))
        if error < wp.static(real(0.5)):
            factor = wp.static(real(SAFETY)) * power(bounded, wp.static(real(-1.0 / order)))
            return wp.min(factor, wp.static(real(GREATEST_GROWTH)))
        return wp.static(real(1.0))

    @wp.func
    def shrinkage(error: real):
        factor = wp.static(real(SAFETY)) * power(error, wp.static(real(-1.0 / max(error_order - 1, 1))))
        return wp.max(factor, wp.static(real(least_shrinkage)))

    return growth, shrinkage


@functools.cache
def classical_controller(error_order: int):
    """(growth, shrinkage) of flights: the next step is SAFETY times that whose error would be the tolerance.

    The error goes as h^(error_order + 1): E. Hairer, S. P. Nørsett, G. Wanner, Solving ODEs I, section II.4. odeint's
    rule shrinks steps by the first power of the error if the embedded solution is of order 2, which costs too many
    attempts: those of flights, see :mod:`cpu.implicit.rigid_flight`, are expensive.
    """

    @wp.func
    def factor(error: wp.float64):
        bounded = wp.max(error, wp.static(wp.float64(1e-4)))
        return wp.static(wp.float64(SAFETY)) * wp.pow(bounded, wp.static(wp.float64(-1.0 / (error_order + 1))))

    @wp.func
    def growth(error: wp.float64, last_error: wp.float64, proportional: wp.int32):
        return wp.clamp(factor(error), LEAST_SHRINKAGE, wp.static(wp.float64(GREATEST_GROWTH)))

    @wp.func
    def shrinkage(error: wp.float64):
        return wp.max(factor(error), LEAST_SHRINKAGE)

    return growth, shrinkage
