"""Totals over the links of one chain at one moment: centre of mass, energies, extent, speeds, area."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import COSINE, LEFT_X, LEFT_Y, OMEGA, RIGHT_X, RIGHT_Y, SINE, U, V, X, Y
from warpchain.kernels.physics.elementary import HALF, from_order_key, order_key
from warpchain.kernels.physics.geometry import two
from warpchain.kernels.types import Chain, Row, Rows

# Sums over the links, then the greatest of all links.
TOTAL_MASS, TOTAL_MX, TOTAL_MY, TOTAL_MU, TOTAL_MV = range(5)
TOTAL_KINETIC, TOTAL_SQUARE, TOTAL_ALONG, TOTAL_SPRING, TOTAL_AREA = range(5, 10)
RIGHTMOST, LEFTMOST, TOP, BOTTOM, LOWEST_CIRCLE = range(10, 15)
SUMS, TOTALS = 10, 15

Totals = wp.types.vector(length=TOTALS, dtype=wp.float64)


@wp.func
def share_of(K: Rows, chain: Chain, i: int) -> Totals:
    """What a placed link contributes to the totals; leftmost, bottom and lowest circle are negated."""
    m = K[layout.MASS, i]
    speed = K[U, i] * K[U, i] + K[V, i] * K[V, i]
    opening = two(K, LEFT_X, i + 1) - two(K, RIGHT_X, i)
    low = wp.min(K[LEFT_Y, i], K[RIGHT_Y, i])
    share = Totals()
    share[TOTAL_MASS] = m
    share[TOTAL_MX] = m * K[X, i]
    share[TOTAL_MY] = m * K[Y, i]
    share[TOTAL_MU] = m * K[U, i]
    share[TOTAL_MV] = m * K[V, i]
    share[TOTAL_KINETIC] = HALF * (m * speed + K[layout.INERTIA, i] * K[OMEGA, i] * K[OMEGA, i])
    share[TOTAL_SQUARE] = speed
    share[TOTAL_ALONG] = K[U, i] * K[COSINE, i] + K[V, i] * K[SINE, i]
    share[TOTAL_SPRING] = HALF * chain.joint_stiffness * (opening[0] * opening[0] + opening[1] * opening[1])
    share[TOTAL_AREA] = K[LEFT_X, i] * K[RIGHT_Y, i] - K[RIGHT_X, i] * K[LEFT_Y, i]
    share[RIGHTMOST] = K[RIGHT_X, i]
    share[LEFTMOST] = -K[RIGHT_X, i]
    share[TOP] = K[RIGHT_Y, i]
    share[BOTTOM] = -low
    share[LOWEST_CIRCLE] = K[layout.RADIUS, i] - low
    return share


@wp.func
def greater(a: wp.float64, b: wp.float64):
    """The greater of two numbers; a NaN is the greatest."""
    return from_order_key(wp.max(order_key(a), order_key(b)))


@wp.func
def write_summary(totals: Totals, chain: Chain, sample: Row):
    """Writes totals into a sample, all but its time; returns the area inside the loop.

    Loop speed: mean of v·u over links, positive from link i towards link i + 1. Area [m²] inside the loop, positive if
    it runs counter-clockwise: ½ Σ left end × right end.
    """
    links = wp.float64(chain.link_count)
    for k in range(4):  # CENTER_X … CENTER_V
        sample[layout.CENTER_X + k] = totals[TOTAL_MX + k] / totals[TOTAL_MASS]
    sample[layout.KINETIC] = totals[TOTAL_KINETIC]
    sample[layout.GRAVITATIONAL] = chain.gravity * totals[TOTAL_MY]
    sample[layout.SPRING] = totals[TOTAL_SPRING]
    sample[layout.LOWEST] = -totals[LOWEST_CIRCLE]
    sample[layout.RMS_SPEED] = wp.sqrt(totals[TOTAL_SQUARE] / links)
    sample[layout.HEIGHT] = totals[TOP] + totals[BOTTOM]
    sample[layout.WIDTH] = totals[RIGHTMOST] + totals[LEFTMOST]
    sample[layout.LOOP_SPEED] = totals[TOTAL_ALONG] / links
    return HALF * totals[TOTAL_AREA]


@wp.func
def summarise(K: Rows, chain: Chain, sample: Row):
    """Writes the totals over the placed links into a sample, see :func:`write_summary`; for one thread."""
    totals = share_of(K, chain, 0)
    i = int(1)
    while i < chain.link_count:
        share = share_of(K, chain, i)
        for k in range(SUMS):
            totals[k] += share[k]
        for k in range(SUMS, TOTALS):
            totals[k] = greater(totals[k], share[k])
        i += 1
    return write_summary(totals, chain, sample)
