"""A floor of straight faces: an endless slope, or a profile of heights.

Each face is one-sided: solid lies to the right of its direction, which is that of rising x, or upright. A convex corner
belongs to the face that begins there. A circle that is deeper than r below a face lies before another one, and is far
from it. A circle in a concave corner overlaps two faces, and gets an impulse from each.

*Sides of links.* Circles of adjacent joints leave a gap of ℓ − 2r, into which a convex corner may sink: at an edge of
90° a link of circles alone lies ℓ/2 − (√2 − 1) r = 4.6 mm too deep, and at a bend by the angle δ up to ℓδ/4. So a
corner also meets the straight sides of a link, at the distance r from its axis.

*Cells.* Each cell along x knows which faces are near the links whose centres lie in it, and a height above which
nothing is near them: there their gap counts as the margin of the cells.
"""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.physics.elementary import ONE, ZERO, quotient, square_root
from warpchain.kernels.types import Chain, Ground

SMALLEST = wp.constant(wp.float64(1e-300))
FAR = wp.constant(wp.float64(1e30))
LAST_CELL = wp.constant(wp.float64(layout.GROUND_CELLS - 1))


@wp.struct
class Face:
    """What a body is at this moment besides the chain's constants: a face of a floor, or the motion of a sprocket."""

    x: wp.float64  # where it begins [m]
    y: wp.float64
    along_x: wp.float64  # unit vector to its end
    along_y: wp.float64
    before_x: wp.float64  # that of the face before, if the corner between them is convex, else 0
    before_y: wp.float64
    begin: wp.float64  # from its place to its ends [m]
    end: wp.float64
    restitution: wp.float64  # e
    friction: wp.float64  # μ
    u: wp.float64  # velocity of the sprocket's centre [m/s]
    v: wp.float64
    turning: wp.float64  # angular velocity of the sprocket [rad/s]
    push_rate: wp.float64  # speed at which it pushes out sunken circles, per depth [1/s]


@wp.func
def read_face(ground: Ground, k: int) -> Face:
    """One face of the floor."""
    face = Face()
    face.x = ground.faces[k, layout.FACE_X]
    face.y = ground.faces[k, layout.FACE_Y]
    face.along_x = ground.faces[k, layout.ALONG_X]
    face.along_y = ground.faces[k, layout.ALONG_Y]
    face.before_x = ground.faces[k, layout.BEFORE_X]
    face.before_y = ground.faces[k, layout.BEFORE_Y]
    face.begin = ground.faces[k, layout.FACE_BEGIN]
    face.end = ground.faces[k, layout.FACE_END]
    face.restitution = ground.faces[k, layout.FACE_RESTITUTION]
    face.friction = ground.faces[k, layout.FACE_FRICTION]
    return face


@wp.func
def first_face(ground: Ground) -> Face:
    """The only face of a slope."""
    return read_face(ground, 0)


@wp.func
def cell_at(ground: Ground, x: wp.float64):
    """The cell at x; beyond the first and the last one, these."""
    left = ground.cells[layout.GROUND_CELLS, layout.CELLS_LEFT]
    place = (x - left) * ground.cells[layout.GROUND_CELLS, layout.CELLS_PER_LENGTH]
    return int(wp.where(place > ZERO, wp.min(place, LAST_CELL), ZERO))


@wp.func
def slope_surface(chain: Chain, face: Face, circle_x: wp.float64, circle_y: wp.float64):
    """An endless slope; at a depth d it moves outwards at ``chain.push_rate`` d."""
    gap = face.along_x * (circle_y - face.y) - face.along_y * (circle_x - face.x) - chain.circle_radius
    push = chain.push_rate * wp.max(ZERO, -gap)
    nx = -face.along_y
    ny = face.along_x
    return gap, nx, ny, push * nx, push * ny, face.restitution, face.friction


@wp.func
def terrain_surface(chain: Chain, face: Face, circle_x: wp.float64, circle_y: wp.float64):
    """A face of a profile with the convex corner at its beginning; it pushes as a slope does."""
    r = chain.circle_radius
    to_x = circle_x - face.x
    to_y = circle_y - face.y
    along = face.along_x * to_x + face.along_y * to_y
    height = face.along_x * to_y - face.along_y * to_x
    past = face.before_x * to_x + face.before_y * to_y
    over = along >= face.begin and along <= face.end and height > -r
    at_corner = along < ZERO and past > ZERO
    distance = wp.max(square_root(to_x * to_x + to_y * to_y), SMALLEST)
    gap = wp.where(over, height, wp.where(at_corner, distance, FAR)) - r
    nx = wp.where(over, -face.along_y, quotient(to_x, distance))
    ny = wp.where(over, face.along_x, quotient(to_y, distance))
    push = chain.push_rate * wp.max(ZERO, -gap)
    return gap, nx, ny, push * nx, push * ny, face.restitution, face.friction


@wp.func
def corner_and_side(chain: Chain, face: Face, x: wp.float64, y: wp.float64, cosine: wp.float64, sine: wp.float64):
    """Gap [m] and normal of the convex corner at the beginning of a face and the straight sides of a link."""
    to_x = face.x - x
    to_y = face.y - y
    along = cosine * to_x + sine * to_y
    across = cosine * to_y - sine * to_x
    is_convex = face.before_x * face.before_x + face.before_y * face.before_y > ZERO
    beside = is_convex and wp.abs(along) < chain.half_length
    side = wp.where(across > ZERO, -ONE, ONE)
    return wp.where(beside, wp.abs(across), FAR) - chain.circle_radius, -side * sine, side * cosine
