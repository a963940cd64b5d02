"""Waves in theory and in tapped rings: their tables and their figure.

A ring of links that turns like a rigid body is tapped; `warpchain.simulate` moves it on. Its motion is taken apart into
modes, the decaying oscillations that they are made of, and packets.
"""

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import hilbert

import warpchain
from studies.common import BLUE, GREEN, INK, RED, Array, minus, show, table, tidy
from studies.waves import dispersion
from studies.waves.dispersion import LOWER_BACKWARD, LOWER_FORWARD, Waves
from warpchain import Parameters, preset

CHAIN = preset("soft").with_values({"coulomb_friction": 0.0})  # Joints softened, Coulomb friction left out
LENGTH = CHAIN.link_length
DENSITY = (CHAIN.inner_mass + CHAIN.outer_mass) / 2 / LENGTH
LINKS = 60
FREQUENCIES = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0)
WAVELENGTHS = np.array([6.0, 12.0, 24.0])  # In links
NUMBERS = np.arange(2, 13)  # Of waves around the ring of `LINKS`
PACKETS = ((160, 20, 12.0), (180, 15, 10.0), (360, 15, 20.0))  # Links of a ring, waves around it, width of a packet
BOTH = [LOWER_BACKWARD, LOWER_FORWARD]  # Slow and fast family
INTERVAL = 2e-4  # Time between two instants of a tapped ring [s]


def speed_at(frequency: float) -> float:
    """Speed along the loop [m/s] of a chain on its sprocket."""
    half = np.arcsin(LENGTH / 2 / (CHAIN.sprocket_radius + CHAIN.circle_radius))  # links are chords of the sprocket
    return float(np.pi * frequency * LENGTH / half)


def tapped_ring(links: int, parameters: Parameters, speed: float, spins: Array) -> tuple[Array, Array]:
    """A turning ring whose springs are in equilibrium, with further angular velocities of its links by a tap.

    With α = π/n the ring turns at Ω = speed · 2 sin α/ℓ. All links are tangential, inner ones at the distance ρ₁ from
    the centre and outer ones at ρ₂; the springs supply the centripetal forces (without damping b) if

        (m₁Ω²/k − 2) ρ₁ + 2 cos 2α ρ₂ = −ℓ sin 2α,    2 cos 2α ρ₁ + (m₂Ω²/k − 2) ρ₂ = −ℓ sin 2α.

    The tap opens no joint: velocities of joints are sums of those across the links, less their mean. That closes the
    ring only if the spins have no part ∝ exp(±2πij/n), so this part, which moves the ring without bending it, is left
    out.

    Joints of the closed ring move at `speed` [m/s] before the tap, anticlockwise if positive; `spins` are the further
    angular velocities [rad/s], (n,). Returns position and velocity (n, 3): x, y [m], θ [rad] and their rates.
    """
    alpha, length = np.pi / links, parameters.link_length
    spin, coupling = speed * 2 * np.sin(alpha) / length, 2 * np.cos(2 * alpha)
    inner, outer = (m * spin**2 / parameters.joint_stiffness for m in (parameters.inner_mass, parameters.outer_mass))
    balance = np.array([[inner - 2, coupling], [coupling, outer - 2]])
    distance = np.tile(np.linalg.solve(balance, np.full(2, -length * np.sin(2 * alpha))), links // 2)
    angle = 2 * np.pi * np.arange(links) / links
    outwards, ahead = (np.stack([np.cos(each), np.sin(each)], axis=1) for each in (angle, angle + np.pi / 2))
    first = np.exp(1j * angle)
    kept = spins - 2 / links * np.real(np.sum(spins * first.conj()) * first)
    turning = -length * kept[:, None] * outwards  # velocity of a link's end relative to its beginning
    joints = np.cumsum(turning, axis=0)
    joints -= joints.mean(axis=0)
    position = np.column_stack([distance[:, None] * outwards, angle + np.pi / 2])
    across = spin * distance[:, None] * ahead + joints - turning / 2
    return position, np.column_stack([across, spin + kept])


def tapped(links: int, speed: float, spins: Array, times: Array) -> Array:
    """Angles (t, n) [rad] of the links of a tapped ring, less those of the ring that turns on."""
    position, velocity = tapped_ring(links, CHAIN, speed, spins)
    scene = {"floor": False, "gravity": False, "self_contact": False, "tolerance": 1e-8, "times": times}
    motion = warpchain.simulate(CHAIN, position, velocity, float(times[-1]), **scene)
    if motion.status != warpchain.Status.FINISHED:
        raise RuntimeError(f"the tapped ring ended as {motion.status.label}")
    return motion.position[:, :, 2] - position[:, 2] - dispersion.ring_spin(CHAIN, links, speed) * times[:, None]


def from_tap(links: int) -> Array:
    """Number of each link, counted from link 0 in both directions, (n,)."""
    return (np.arange(links) + links / 2) % links - links / 2


def mode_amplitudes(angles: Array, number: int) -> Array:
    """2/n Σ ϑ_j exp(−2πi · number · j/n) of links' angles (t, n) [rad], over even and over odd j, shape (t, 2)."""
    links = angles.shape[1]
    wave = 2 / links * np.exp(-2j * np.pi * number * np.arange(links) / links)
    return np.stack([angles[:, part::2] @ wave[part::2] for part in (0, 1)], axis=1)


def fit_rates(signals: Array, interval: float, count: int) -> Array:
    """Rates λ [1/s] of `count` exponentials exp(λt) that complex signals (t, s) are sums of.

    ESPRIT (Roy and Kailath, IEEE Trans. ASSP 37 (1989) 984): stretches of the signals span a space that is the same one
    sample later but for the factors exp(λ · interval), which are the eigenvalues of the map between both.
    """
    stretch = 2 * len(signals) // 3
    rows = np.concatenate([np.lib.stride_tricks.sliding_window_view(column, stretch) for column in signals.T])
    space = np.linalg.svd(rows, full_matrices=False)[2][:count].T
    shift = np.linalg.lstsq(space[:-1], space[1:], rcond=None)[0]
    return np.log(np.linalg.eigvals(shift)) / interval


def find_packet(angles: Array, link: float, width: float) -> tuple[float, float, Array]:
    """The packet of a ring's angles (n,) at most `width` links from the place `link`, on an endless count of links.

    Returns the centre of its squared envelope [links], the root of that envelope's sum [rad], and the shares of the
    modes from 2 to n/4 in it.
    """
    links = len(angles)
    offset = (np.arange(links) - link + links / 2) % links - links / 2
    signal = np.where(np.abs(offset) <= width, hilbert(angles - angles.mean()), 0.0)
    energy = np.abs(signal) ** 2
    shares = np.abs(np.fft.fft(signal))[2 : links // 4 + 1] ** 2
    return link + float(energy @ offset) / energy.sum(), energy.sum() ** 0.5, shares / shares.sum()


def measured(angles: Array, waves: Waves) -> Array:
    """Rates of both families of a tapped ring, fitted to its motion: of four that are found those nearest to theory."""
    found = []
    for number, rates in zip(NUMBERS, waves.rate[:, BOTH], strict=True):
        alive = min(len(angles), int(6 / np.abs(rates.real).max() / INTERVAL))
        fitted = fit_rates(mode_amplitudes(angles, number)[:alive], INTERVAL, 4)
        found.append(fitted[np.argmin(np.abs(rates[:, None] - fitted), axis=1)])
    return np.array(found)


def reach_table() -> str:
    """How far waves of the straight chain under T = ρv² run [links]; speeds of those of 12 links in the room [m/s]."""
    rows = []
    for frequency in FREQUENCIES:
        speed = speed_at(frequency)
        waves = dispersion.straight_waves(CHAIN, DENSITY * speed**2, 2 * np.pi / WAVELENGTHS)
        room = speed + LENGTH * waves.group_speed[1, BOTH]
        rows.append((frequency, speed, *waves.reach[:, LOWER_FORWARD], *room))
    head = "Hz | v | reach of 6 links | of 12 | of 24 | slow | fast"
    return table(head, rows, "g .2f .1f .0f .0f .2f .2f")


def ring_table(speed: float, waves: Waves, found: Array) -> str:
    """Modes of the ring: exact, in simulation, and of the straight chain."""
    exact = waves.rate[:, BOTH]
    straight = dispersion.straight_waves(CHAIN, DENSITY * speed**2, waves.phase).rate[:, LOWER_FORWARD]
    both = np.stack([exact, found], axis=2).reshape(len(exact), 4)  # slow and fast, exact and simulated
    columns = *(-both.imag).T, -straight.imag, *(-both.real).T, -straight.real
    head = "n | links a wave | slow ω: exact | simulated | fast ω: exact | simulated | both, straight chain"
    head += " | slow γ: exact | simulated | fast γ: exact | simulated | straight chain"
    rows = zip(NUMBERS, LINKS / NUMBERS, *columns, strict=True)
    return minus(table(head, rows, "d .1f" + 5 * " .2f" + 5 * " .3f"))


def ring_text(speed: float, waves: Waves, found: Array) -> str:
    """How far simulated modes of the ring are from theory, and how fast crests are in the room."""
    spin, exact = dispersion.ring_spin(CHAIN, LINKS, speed), waves.rate[:, BOTH]
    off = [100 * np.abs(part(found) / part(exact) - 1).max() for part in (np.imag, np.real)]
    crests = 1 + waves.frequency[:, BOTH] / NUMBERS[:, None] / spin
    slow, fast = (f"{each.min():.2g} to {each.max():.2g} v" for each in crests.T)
    return (
        f"Simulated and exact frequencies differ by at most {off[0]:.3f} %, damping rates by at most {off[1]:.2f} %. "
        f"In the laboratory frame slow crests move at {slow}, fast ones at {fast}."
    )


def packets(links: int, number: int, width: float, speed: float) -> list[tuple[object, ...]]:
    """Rows of the table of packets, slow and fast, of one ring; behind them mean phase and speed in the room in v."""
    waves = dispersion.ring_waves(CHAIN, links, speed, np.arange(2, links // 4 + 1))
    place, quickest = from_tap(links), waves.group_speed[number - 2, LOWER_FORWARD]
    times = np.linspace(0.17, 0.3, 41) * links / quickest
    envelope = np.exp(-(place**2) / (2 * width**2))
    angles = tapped(links, speed, 0.1 * np.cos(2 * np.pi * number * place / links) * envelope, times)
    rows: list[tuple[object, ...]] = []
    for name, column in (("slow", LOWER_BACKWARD), ("fast", LOWER_FORWARD)):
        speeds, damping = waves.group_speed[:, column], waves.damping[:, column]
        guess = speeds[number - 2] * times
        reach = np.minimum(np.abs(guess), links / 2 - np.abs(guess))
        places, amplitudes, shares = map(np.array, zip(*map(find_packet, angles, guess, reach), strict=True))
        along, expected = (LENGTH * np.polyfit(times, way, 1)[0] for way in (places, shares @ speeds * times))
        falls, decay = -np.polyfit(times, np.log(amplitudes), 1)[0], np.mean(shares @ damping)
        row = links, links / number, name, along, expected, speed + along, falls, decay
        rows.append((*row, np.mean(shares @ waves.phase), 1 + along / speed))
    return rows


def draw(speed: float, waves: Waves, found: Array, room: Array) -> Figure:
    """Frequency, damping and speed in the room against the phase per link."""
    straight = dispersion.straight_waves(CHAIN, DENSITY * speed**2, np.linspace(0.02, np.pi / 2, 300))
    ring = dispersion.ring_waves(CHAIN, 180, speed, np.arange(2, 46))
    figure = Figure(figsize=(11.0, 4.0), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    left.plot(straight.phase, straight.frequency[:, LOWER_FORWARD] / (2 * np.pi), color=INK, linewidth=1.2)
    middle.semilogy(straight.phase, straight.damping[:, LOWER_FORWARD], color=INK, linewidth=1.2)
    for rates, column, colour, name in zip(found.T, BOTH, (BLUE, RED), ("slow", "fast"), strict=True):
        style = {"color": colour, "markersize": 4.0, "label": f"{name}, tapped ring"}
        left.plot(waves.phase, np.abs(rates.imag) / (2 * np.pi), "o", **style)
        middle.plot(waves.phase, -rates.real, "o", **style)
        for many, dashes in ((ring, "-"), (straight, ":")):
            value = 1 + many.group_speed[:, column] * LENGTH / speed
            right.plot(many.phase, value, color=colour, linestyle=dashes, linewidth=1.2)
    right.plot(*room.T, "o", color=GREEN, markersize=5.0, label="packets, simulated", zorder=4)
    for axes, label, limits in (
        (left, "frequency $|ω|/2π$ / Hz", (0, None)),
        (middle, "damping $γ$ / s$^{-1}$", (0.01, 1000)),
        (right, "speed in the room / $v$", (-0.2, 2.6)),
    ):
        axes.legend(frameon=False, fontsize="small")
        axes.set_xticks(np.arange(3) * np.pi / 4, ["0", "π/4", "π/2"])
        tidy(axes, grid="y", xlabel="phase per link $κ$ / rad", xlim=(0, np.pi / 2), ylabel=label, ylim=limits)
    return figure


def tables_and_figure() -> tuple[dict[str, str], Figure, list[dict[str, object]]]:
    """All tables by their markers, the figure, and rows of a file: rates of each mode in theory and found [1/s]."""
    speed, offset = speed_at(20.0), from_tap(LINKS)
    angles = tapped(LINKS, speed, 0.1 * offset * np.exp(-(offset**2) / 4.5), INTERVAL * np.arange(400))
    waves = dispersion.ring_waves(CHAIN, LINKS, speed, NUMBERS)
    found, rows = measured(angles, waves), [row for packet in PACKETS for row in packets(*packet, speed)]
    head = "links | links per wave |  | along the chain, m/s | theory | laboratory frame, m/s | γ, 1/s | theory"
    texts = minus(table(head, (row[:-2] for row in rows), "d .0f s .3f .3f .2f .3g .3g"))
    show({"modes of the ring": ring_table(speed, waves, found), "packets": texts})
    tables = {"reach": reach_table(), "ring": ring_text(speed, waves, found)}
    rates = {"slow": (waves.rate[:, BOTH[0]], found[:, 0]), "fast": (waves.rate[:, BOTH[1]], found[:, 1])}
    modes: list[dict[str, object]] = [
        {"family": family, "waves": number, "frequency": -one.imag, "damping": -one.real}
        | {"frequency_found": -other.imag, "damping_found": -other.real}
        for family, both in rates.items()
        for number, one, other in zip(NUMBERS, *both, strict=True)
    ]
    return tables, draw(speed, waves, found, np.array([row[-2:] for row in rows])), modes
