"""Sums over one chain at one moment: centre of mass, energies, extent, speeds, area."""

import warp as wp

from warpchain.kernels.layout import COSINE, INERTIA, LEFT_X, LEFT_Y, MASS, OMEGA, RIGHT_X, RIGHT_Y, SINE, U, V, X, Y
from warpchain.kernels.physics.elementary import HALF, ZERO, from_order_key, order_key
from warpchain.kernels.types import Chain, Rows

wp.set_module_options({"enable_backward": False})


@wp.struct
class Summary:
    """Sums over one chain at one moment; see ``Record.samples`` in :mod:`types`."""

    center_x: wp.float64
    center_y: wp.float64
    center_u: wp.float64
    center_v: wp.float64
    kinetic: wp.float64
    gravitational: wp.float64
    spring: wp.float64
    lowest: wp.float64
    rms_speed: wp.float64
    height: wp.float64
    width: wp.float64
    loop_speed: wp.float64
    area: wp.float64


@wp.func
def summarise(K: Rows, chain: Chain) -> Summary:
    """Sums over the placed links.

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
    i = int(0)
    while i < n:
        m = K[MASS, i]
        speed = K[U, i] * K[U, i] + K[V, i] * K[V, i]
        mass += m
        mx += m * K[X, i]
        my += m * K[Y, i]
        mu += m * K[U, i]
        mv += m * K[V, i]
        kinetic += HALF * (m * speed + K[INERTIA, i] * K[OMEGA, i] * K[OMEGA, i])
        square += speed
        along += K[U, i] * K[COSINE, i] + K[V, i] * K[SINE, i]
        cx = K[LEFT_X, i + 1] - K[RIGHT_X, i]
        cy = K[LEFT_Y, i + 1] - K[RIGHT_Y, i]
        spring += HALF * chain.joint_stiffness * (cx * cx + cy * cy)
        area += K[LEFT_X, i] * K[RIGHT_Y, i] - K[RIGHT_X, i] * K[LEFT_Y, i]
        left = wp.min(left, order_key(K[RIGHT_X, i]))
        right = wp.max(right, order_key(K[RIGHT_X, i]))
        bottom = wp.min(bottom, wp.min(order_key(K[LEFT_Y, i]), order_key(K[RIGHT_Y, i])))
        top = wp.max(top, order_key(K[RIGHT_Y, i]))
        i += 1
    summary = Summary()
    summary.center_x = mx / mass
    summary.center_y = my / mass
    summary.center_u = mu / mass
    summary.center_v = mv / mass
    summary.kinetic = kinetic
    summary.gravitational = chain.gravity * my
    summary.spring = spring
    summary.lowest = from_order_key(bottom) - chain.circle_radius
    summary.rms_speed = wp.sqrt(square / wp.float64(n))
    summary.height = from_order_key(top) - from_order_key(bottom)
    summary.width = from_order_key(right) - from_order_key(left)
    summary.loop_speed = along / wp.float64(n)
    summary.area = HALF * area
    return summary
