"""Sums over one chain at one moment: centre of mass, energies, extent, speeds, area."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import COSINE, LEFT_X, LEFT_Y, MASS, OMEGA, RADIUS, RIGHT_X, RIGHT_Y, SINE, U, V, X, Y
from warpchain.kernels.physics.elementary import HALF, ZERO, from_order_key, order_key
from warpchain.kernels.physics.geometry import two
from warpchain.kernels.types import Chain, Row, Rows


@wp.func
def summarise(K: Rows, chain: Chain, sample: Row):
    """Writes the sums over the placed links into a sample, all but its time; returns the area inside the loop.

    Loop speed: mean of v·u over links, positive from link i towards link i + 1. Area [m²] inside the loop, positive if
    it runs counter-clockwise: ½ Σ left end × right end.
    """
    n = chain.link_count
    mass = ZERO
    mx = ZERO
    my = ZERO
    mu = ZERO
    mv = ZERO
    kinetic = ZERO
    spring = ZERO
    along = ZERO
    square = ZERO
    area = ZERO
    left = order_key(K[RIGHT_X, 0])
    right = left
    bottom = order_key(K[RIGHT_Y, 0])
    top = bottom
    lowest = order_key(wp.float64(wp.inf))
    i = int(0)
    while i < n:
        m = K[MASS, i]
        speed = K[U, i] * K[U, i] + K[V, i] * K[V, i]
        mass += m
        mx += m * K[X, i]
        my += m * K[Y, i]
        mu += m * K[U, i]
        mv += m * K[V, i]
        kinetic += HALF * (m * speed + K[layout.INERTIA, i] * K[OMEGA, i] * K[OMEGA, i])
        square += speed
        along += K[U, i] * K[COSINE, i] + K[V, i] * K[SINE, i]
        opening = two(K, LEFT_X, i + 1) - two(K, RIGHT_X, i)
        spring += HALF * chain.joint_stiffness * (opening[0] * opening[0] + opening[1] * opening[1])
        area += K[LEFT_X, i] * K[RIGHT_Y, i] - K[RIGHT_X, i] * K[LEFT_Y, i]
        left = wp.min(left, order_key(K[RIGHT_X, i]))
        right = wp.max(right, order_key(K[RIGHT_X, i]))
        low = wp.min(K[LEFT_Y, i], K[RIGHT_Y, i])
        bottom = wp.min(bottom, order_key(low))
        lowest = wp.min(lowest, order_key(low - K[RADIUS, i]))
        top = wp.max(top, order_key(K[RIGHT_Y, i]))
        i += 1
    sample[layout.CENTER_X] = mx / mass
    sample[layout.CENTER_Y] = my / mass
    sample[layout.CENTER_U] = mu / mass
    sample[layout.CENTER_V] = mv / mass
    sample[layout.KINETIC] = kinetic
    sample[layout.GRAVITATIONAL] = chain.gravity * my
    sample[layout.SPRING] = spring
    sample[layout.LOWEST] = from_order_key(lowest)
    sample[layout.RMS_SPEED] = wp.sqrt(square / wp.float64(n))
    sample[layout.HEIGHT] = from_order_key(top) - from_order_key(bottom)
    sample[layout.WIDTH] = from_order_key(right) - from_order_key(left)
    sample[layout.LOOP_SPEED] = along / wp.float64(n)
    return HALF * area
