"""Where a chain's numbers lie in its scratch: rows are quantities, columns links or joints.

One array of static shape per chain lets the CPU compiler vectorise; with run-time strides or several arrays it would
have to allow for aliasing. Joint i joins the right end of link i to the left end of link i + 1.
"""

from itertools import accumulate

# State at the start of the step.
X, Y, THETA, U, V, OMEGA = range(6)
COSINE, SINE = 6, 7
# Constants of the links, under their present loads; friction of the joints, β [N m s] and τ_c [N m]; radius of the
# links' circles [m].
MASS, INERTIA, INVERSE_MASS, INVERSE_INERTIA, VISCOUS, COULOMB, RADIUS = range(8, 15)
# Link ends. Rows of left ends are padded: column n repeats column 0.
LEFT_X, LEFT_Y, RIGHT_X, RIGHT_Y = range(15, 19)
# Energy [J] lost so far: per joint to friction and damping, per link to floor or sprocket.
LOST_FRICTION, LOST_DAMPING, LOST_FIXED = range(19, 22)
# Joint positions when the neighbour list was built.
LISTED_X, LISTED_Y = 22, 23
# Of links: gap to the floor or sprocket [m]; terms of sums, if the plane of the chain tilts.
GAP, SUMS = 24, 25
SCRATCH_ROWS = 30
"""Rows of a chain's scratch on a CPU, without those of stages, see :mod:`cpu.stage_rows`, and of flights."""

# Model.links: what links and joints have of their own, one after the other as in a chain's parameters.
OWN_MASS, OWN_INERTIA, OWN_VISCOUS, OWN_COULOMB, OWN_RADIUS = range(5)
LINK_ROWS = 5

# On a GPU the first 19 rows above and the following ones lie on a board that all threads of a block share. Between
# launches the scratch keeps the rows from BOARD_LOST_SELF up to BOARD_VALUES, the directions, and from the row MASS on
# the start of the next step, see gpu.increments. Every row less leaves a multiprocessor
# more cache for register spills.
BOARD_LOST_SELF, BOARD_LOST_FRICTION, BOARD_LOST_DAMPING, BOARD_LOST_FIXED = range(19, 23)
BOARD_LISTED_X, BOARD_LISTED_Y = 23, 24
# Values of the whole chain, in the first columns of one more row; behind them its constants, see gpu.stage.constants.
BOARD_VALUES = 25
VALUE_OPENING, VALUE_FIXED_DEPTH, VALUE_STOP_TIME, VALUE_NEXT_SAMPLE, VALUE_DEADLINE = range(5)
VALUE_CONTACT_STEP, VALUE_INVERSE_TOLERANCE = 5, 6
# What a sample finds: totals over the links, see events.summary, and what drag leaves of their velocities across the
# path of the loop.
VALUE_TOTALS, VALUE_DRAG = 7, 22
VALUES = 23
BOARD_ROWS = 26

# Worlds.watch. Of each watched quantity of a loop on its sprocket, in the order of WATCHED_COLUMNS: the sum over the
# samples of a window, and the least and the greatest mean of a window.
WINDOW_START, WINDOW_COUNT, WINDOW_SUMS, STEADY_SINCE, RANGES = 0, 1, 2, 7, 8
LOOP_HEIGHT, LOOP_WIDTH, LOOP_X, LOOP_Y, LOOP_ALONG = range(5)
HOLD_LOAD, LOADED_SINCE, UNLOADED_SINCE, DRIFT = range(18, 22)
REST_SINCE, LAST_FLOOR_IMPULSE = 22, 23
SOFTENED_AT = 24
FELL_AT, GREATEST_LEAN = 25, 26
# The first sample after the first self-contact, after that between strands of the loop, and that after which the loop
# encloses less than half of its area at the release: time, bounces begun, time since the last impulse on the floor.
SELF_CONTACT_AT, SELF_CONTACT_BOUNCES, SELF_CONTACT_FLIGHT = 27, 28, 29
COLLAPSED_AT, COLLAPSE_BOUNCES, COLLAPSE_FLIGHT = 30, 31, 32
STRANDS_MET_AT, STRANDS_MET_BOUNCES, STRANDS_MET_FLIGHT = 33, 34, 35
WATCH_ROWS = 36

# Worlds.plane. First the plane itself: lateral speed u [m/s], rates ω1, ω2 [rad/s] about e1 and e2, the components of
# the room's X and Y axes along e1, e2, e3, and the room's coordinates of the plane's origin [m].
PLANE_SPEED, PLANE_TURN_X, PLANE_TURN_Y = 0, 1, 2
AHEAD, UP, ORIGIN = 3, 6, 9
PLANE_VALUES = 12
# The plane in the middle of the step, as the links feel it, and in its first stage.
PLANE_MID = 12
# Sums over the links in one state, see physics.plane, their mass, and the inverse of the mass matrix, rows of its upper
# triangle.
PLANE_SUMS, MOTION_SUMS = 24, 29
SUM_MX, SUM_MY, SUM_XX, SUM_XY, SUM_YY, SUM_MU, SUM_MV, SUM_MOMENT, SUM_MASS = range(24, 33)
SUMS_OF_PLACES, SUMS_OF_MOTION = 5, 3
INVERSE_00, INVERSE_01, INVERSE_02, INVERSE_11, INVERSE_12, INVERSE_22 = range(33, 39)
# The plane's momenta after the first half of the step; of SUM_XX … SUM_YY the values at its start, the rates that are
# expected in it, and the mean rates in the step before.
MOMENTUM, START_XX, RATE_XX, MEAN_RATE_XX = 39, 42, 45, 48
PLANE_ROWS = 51

# Worlds.counts
ACCEPTED, REJECTED, FLOOR_IMPULSES, SPROCKET_IMPULSES, SELF_IMPULSES, BOUNCES, LIST_BUILDS, STRAND_IMPULSES = range(8)
COUNT_ROWS = 8

# Links at least so far apart along the chain that touch are strands of the loop, and no crease of one of them: from
# 12 to 20 the first touch of long chains comes at the same time.
STRANDS_APART = 16

# Worlds.extremes
OPENING, FLOOR_DEPTH, SPROCKET_DEPTH, SELF_DEPTH = range(4)
EXTREME_ROWS = 4

# Worlds.losses
LOSS_FRICTION, LOSS_DAMPING, LOSS_FLOOR, LOSS_SPROCKET, LOSS_SELF, LOSS_SOFTENING, LOSS_JOINT_SWITCH = range(7)
LOSS_ROWS = 7

# Record.samples, Worlds.first_sample, Worlds.last_sample
TIME, CENTER_X, CENTER_Y, CENTER_U, CENTER_V = range(5)
KINETIC, GRAVITATIONAL, SPRING, LOWEST, RMS_SPEED = range(5, 10)
HEIGHT, WIDTH, LOOP_SPEED = 10, 11, 12
SAMPLE_COLUMNS = 13
WATCHED_COLUMNS = (HEIGHT, WIDTH, CENTER_X, CENTER_Y, LOOP_SPEED)
# Further columns if the plane tilts: the plane, then place and speed of the centre of mass along the room's Z axis.
PLANE_COLUMN = 13
CENTER_Z, CENTER_W = 25, 26
ALL_COLUMNS = 27

# Model.faces: where a face begins, the unit vector along it, that along the face before it if the corner between them
# is convex and 0 otherwise, and where along it it begins and ends: infinite for the first and the last face; e and μ.
FACE_X, FACE_Y, ALONG_X, ALONG_Y, BEFORE_X, BEFORE_Y, FACE_BEGIN, FACE_END, FACE_RESTITUTION, FACE_FRICTION = range(10)
FACE_VALUES = 10
# Drive.motion: time [s], place x, y [m] of the sprocket, its velocity u, v [m/s], angular velocity [rad/s].
MOTION_TIME, MOTION_X, MOTION_Y, MOTION_U, MOTION_V, MOTION_TURNING = range(6)
MOTION_VALUES, MOTION_ROWS = 6, 17

# Model.cells: the first and the last face near a cell, and the height that they stay below. The last row: x of the
# first cell, cells per metre, and how far beyond a link faces are near.
FIRST_FACE, LAST_FACE, TOP = range(3)
CELLS_LEFT, CELLS_PER_LENGTH, GROUND_MARGIN = range(3)
CELL_VALUES = 3
GROUND_CELLS = 128

# Capacity of the neighbour list, in pairs of joints per column.
PAIRS_PER_LINK = 8


def consecutive_offsets(start: int = 0, /, **sizes: int) -> dict[str, int]:
    """Offsets of fields that lie one behind the other from ``start`` on, and as ``size`` the end of the last."""
    offsets = dict(zip(sizes, accumulate(sizes.values(), initial=start), strict=False))
    return offsets | {"size": start + sum(sizes.values())}


LANES = 8
"""Doubles that a CPU's vector holds, and half as many as of its single-precision numbers.

Loops over links go to the end of the last vector, and read a column beyond it.
"""


def padded_width(link_count: int) -> int:
    """Static number of columns for a chain of this many links.

    200 columns serve every chain of the paper's range without a row stride that maps rows onto the same cache sets
    (powers of two are 1.3 to 2 times slower); longer chains get the next odd multiple of 200 that fits.
    """
    blocks = -(-(-(-link_count // LANES) * LANES + 1) // 200)
    return 200 * (blocks + 1 - blocks % 2)
