"""Branch-free double-precision elementary functions.

A library call or a branch in a loop over links keeps the CPU compiler from vectorising it (a factor of 3 to 4 in
speed), and on a GPU ``sin``, ``cos`` and ``tanh`` are the most expensive operations of a stage. All functions below are
polynomials with selections, the same source for both devices.

Coefficients of sine and cosine on [-π/4, π/4]: FreeBSD msun ``k_sin.c``, ``k_cos.c`` (Sun Microsystems, 1993).
"""

import math

import warp as wp

# A Python float inside a wp.func would be rounded to float32 first; wp.constant keeps all 53 bits.
ZERO = wp.constant(wp.float64(0.0))
HALF = wp.constant(wp.float64(0.5))
ONE = wp.constant(wp.float64(1.0))
TWO = wp.constant(wp.float64(2.0))

# Adding 1.5·2⁵² leaves the nearest integer in the low bits of the mantissa.
ROUNDER = wp.constant(wp.float64(6755399441055744.0))
ROUNDER_BITS = wp.constant(wp.int64(0x4338000000000000))
EXPONENT_BIAS = wp.constant(wp.int64(1023))
EXPONENT_SHIFT = wp.constant(wp.int64(52))
SIGN_SHIFT = wp.constant(wp.int64(63))
MAGNITUDE_BITS = wp.constant(wp.int64(0x7FFFFFFFFFFFFFFF))

TWO_OVER_PI = wp.constant(wp.float64(6.36619772367581382433e-01))
HALF_PI_1 = wp.constant(wp.float64(1.57079632673412561417e00))
HALF_PI_2 = wp.constant(wp.float64(6.07710050630396597660e-11))
HALF_PI_3 = wp.constant(wp.float64(2.02226624871116645580e-21))

S1 = wp.constant(wp.float64(-1.66666666666666324348e-01))
S2 = wp.constant(wp.float64(8.33333333332248946124e-03))
S3 = wp.constant(wp.float64(-1.98412698298579493134e-04))
S4 = wp.constant(wp.float64(2.75573137070700676789e-06))
S5 = wp.constant(wp.float64(-2.50507602534068634195e-08))
S6 = wp.constant(wp.float64(1.58969099521155010221e-10))
C1 = wp.constant(wp.float64(4.16666666666666019037e-02))
C2 = wp.constant(wp.float64(-1.38888888888741095749e-03))
C3 = wp.constant(wp.float64(2.48015872894767294178e-05))
C4 = wp.constant(wp.float64(-2.75573143513906633035e-07))
C5 = wp.constant(wp.float64(2.08757232129817482790e-09))
C6 = wp.constant(wp.float64(-1.13596475577881948265e-11))

# Taylor coefficients 1/k!, for the small turns within a step.
T2, T3, T4, T5, T6, T7, T8 = (wp.constant(wp.float64(1.0 / math.factorial(k))) for k in range(2, 9))

# Polynomial P with exp(2 r) = 1 + 2 r + r² P(r) for |r| ≤ ln2/4 to a relative error of 3e-16, by Remez's algorithm.
P0 = wp.constant(wp.float64(1.999999999999933))
P1 = wp.constant(wp.float64(1.333333333328921))
P2 = wp.constant(wp.float64(0.6666666666901995))
P3 = wp.constant(wp.float64(0.2666666678685354))
P4 = wp.constant(wp.float64(0.08888888650274396))
P5 = wp.constant(wp.float64(0.025396717060622142))
P6 = wp.constant(wp.float64(0.006349294542012403))
P7 = wp.constant(wp.float64(0.0014149122969306315))
P8 = wp.constant(wp.float64(0.0002813624154822916))

TWO_LOG2_E = wp.constant(wp.float64(2.88539008177792681472))
HALF_LN2 = wp.constant(wp.float64(3.46573590279972654709e-01))

LARGEST_TURN = wp.constant(wp.float64(0.05))
"""Largest turn of a link [rad] within one step for which :func:`small_turn` is exact to rounding."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    double y;
    asm("rcp.approx.ftz.f64 %0, %1;" : "=d"(y) : "d"(b));
    y = fma(y, fma(-b, y, 1.0), y);
    y = fma(y, fma(-b, y, 1.0), y);
    const double q = a * y;
    return fma(fma(-b, q, a), y, q);
#else
    return a / b;
#endif
""")
def quotient(a: wp.float64, b: wp.float64) -> wp.float64:
    """a / b for divisors that are neither zero nor infinite nor subnormal, to one unit in the last place.

    On a GPU the compiler's division takes 128 cycles and branches, so that several do not overlap; this takes 81.
    """


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    const double z = x < 1e-300 ? 1e-300 : x;
    double y;
    asm("rsqrt.approx.ftz.f64 %0, %1;" : "=d"(y) : "d"(z));
    double root = z * y;
    y *= 0.5;
    const double e = fma(-y, root, 0.5);
    root = fma(root, e, root);
    y = fma(y, e, y);
    return fma(fma(-root, root, z), y, root);
#else
    return ::wp::sqrt(x);
#endif
""")
def square_root(x: wp.float64) -> wp.float64:
    """√x of a number that is neither negative nor infinite, to one unit in the last place; on a GPU 1e-150 of 0.

    There the compiler's square root branches, as its division does.
    """


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    float y;
    asm("div.approx.ftz.f32 %0, %1, %2;" : "=f"(y) : "f"(a), "f"(b));
    return y;
#else
    return a / b;
#endif
""")
def quick_quotient(a: wp.float32, b: wp.float32) -> wp.float32:
    """a / b; on a GPU to two units in the last place, and 0 for b beyond 2¹²⁶."""


@wp.func
def cos_sin(angle: wp.float64):
    """Cosine and sine of an angle [rad], to about one unit in the last place for |angle| < 1e5."""
    shifted = angle * TWO_OVER_PI + ROUNDER
    quarter = shifted - ROUNDER
    turns = wp.cast(shifted, wp.int64)
    r = ((angle - quarter * HALF_PI_1) - quarter * HALF_PI_2) - quarter * HALF_PI_3
    z = r * r
    s = r + r * z * (S1 + z * (S2 + z * (S3 + z * (S4 + z * (S5 + z * S6)))))
    c = ONE - (HALF * z - z * z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * (C5 + z * C6))))))
    odd = (turns & wp.int64(1)) != wp.int64(0)
    cosine = wp.where(odd, s, c)
    sine = wp.where(odd, c, s)
    cosine_negative = ((turns + wp.int64(1)) & wp.int64(2)) != wp.int64(0)
    sine_negative = (turns & wp.int64(2)) != wp.int64(0)
    return wp.where(cosine_negative, -cosine, cosine), wp.where(sine_negative, -sine, sine)


@wp.func
def small_turn(turn: wp.float64):
    """1 − cos and sin of a small turn [rad]; exact to rounding up to ``LARGEST_TURN``."""
    z = turn * turn
    versine = z * (T2 - z * (T4 - z * (T6 - z * T8)))
    sine = turn - turn * z * (T3 - z * (T5 - z * T7))
    return versine, sine


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    double y;
    asm("rcp.approx.ftz.f64 %0, %1;" : "=d"(y) : "d"(b));
    const double e = fma(-b, y, 1.0);
    return fma(y, fma(e, e, e), y);
#else
    return 1.0 / b;
#endif
""")
def reciprocal(b: wp.float64) -> wp.float64:
    """1 / b as for :func:`quotient`, to two units in the last place; three dependent operations instead of seven."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __hiloint2double(min(__double2hiint(x) & 0x7fffffff, 0x40340000), __double2loint(x));
#else
    const double y = x < 0.0 ? -x : x;
    return y < 20.0 ? y : 20.0;
#endif
""")
def capped(x: wp.float64) -> wp.float64:
    """|x|, at most 20, where tanh is 1; a GPU compares upper halves of doubles only."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __hiloint2double(__double2hiint(value) | (__double2hiint(x) & 0x80000000), __double2loint(value));
#else
    return x < 0.0 ? -value : value;
#endif
""")
def with_sign(value: wp.float64, x: wp.float64) -> wp.float64:
    """A positive number with the sign of x."""


@wp.func
def tanh(x: wp.float64):
    """Hyperbolic tangent to 1e-15 absolute: 1 − 2/(exp(2|x|) + 1), with |x| capped where the result is 1.

    Every stage of a step waits for it, so its latency counts on a GPU. The polynomial's terms are summed in pairs.
    exp(2|x|) = 2ᵏ exp(2 r) is reduced by one product with a rounded ln2/2: the error grows as k, its weight as 2⁻ᵏ.
    """
    y = capped(x)
    shifted = y * TWO_LOG2_E + ROUNDER
    r = y - (shifted - ROUNDER) * HALF_LN2
    power = wp.cast((wp.cast(shifted, wp.int64) - ROUNDER_BITS + EXPONENT_BIAS) << EXPONENT_SHIFT, wp.float64)
    z = r * r
    series = ((P0 + r * P1) + z * (P2 + r * P3)) + (z * z) * (((P4 + r * P5) + z * (P6 + r * P7)) + (z * z) * P8)
    value = ONE - TWO * reciprocal(((ONE + TWO * r) + z * series) * power + ONE)
    return with_sign(value, x)


@wp.func
def order_bits(x: wp.float64):
    """Bits of a number ≥ 0 as an integer in the same order, NaN highest; maxima of these vectorise and keep a NaN."""
    return wp.cast(wp.abs(x), wp.int64)


@wp.func
def order_bits_single(x: wp.float32):
    """:func:`order_bits` for single precision. A NaN may be negative: without abs its bits would be the least."""
    return wp.cast(wp.abs(x), wp.int32)


@wp.func
def order_key(x: wp.float64):
    """A number of any sign as an integer that orders as the number does."""
    bits = wp.cast(x, wp.int64)
    return bits ^ ((bits >> SIGN_SHIFT) & MAGNITUDE_BITS)


@wp.func
def order_key_single(x: wp.float32):
    """:func:`order_key` for single precision."""
    bits = wp.cast(x, wp.int32)
    return bits ^ ((bits >> 31) & 0x7FFFFFFF)


@wp.func
def from_order_key_single(key: wp.int32):
    """Inverse of :func:`order_key_single`."""
    return wp.cast(key ^ ((key >> 31) & 0x7FFFFFFF), wp.float32)


@wp.func
def from_order_key(key: wp.int64):
    """Inverse of :func:`order_key`."""
    return wp.cast(key ^ ((key >> SIGN_SHIFT) & MAGNITUDE_BITS), wp.float64)
