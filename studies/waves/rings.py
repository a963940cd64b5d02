"""Waves in theory and in tapped rings: their tables, printed, and their figure.

A ring of links that turns like a rigid body is tapped; `warpchain.simulate` moves it on. Its motion is taken apart into
modes, the decaying oscillations that they are made of, and packets.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import hilbert

import warpchain
from studies.common import BLUE, FAINT, GREEN, GROUND, INK, RED, Array, publish, table, tidy
from studies.waves import dispersion
from studies.waves.dispersion import LOWER_BACKWARD, LOWER_FORWARD, UPPER_BACKWARD, UPPER_FORWARD, Waves
from warpchain import Parameters, preset

CHAIN = preset("soft").with_values({"coulomb_friction": 0.0})  # Joints softened, Coulomb friction left out
SMOOTH = CHAIN.with_values({"viscous_friction": CHAIN.viscous_friction / 100})  # With a hundredth of β
LENGTH = CHAIN.link_length
DENSITY = (CHAIN.inner_mass + CHAIN.outer_mass) / 2 / LENGTH
LINKS = 60
FREQUENCIES = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0)
SPINS = (0.01, 0.1, 1.0, 10.0, 60.0)  # Amplitudes of a joint's angular velocity [rad/s]; 60 where a loop bends
WAVELENGTHS = np.array([6.0, 12.0, 24.0])
BOTH, FORWARD = [LOWER_BACKWARD, LOWER_FORWARD], [LOWER_FORWARD, UPPER_FORWARD]
FOLDER = Path(__file__).parent
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


def tapped(links: int, speed: float, spins: Array, times: Array, chain: Parameters = CHAIN) -> Array:
    """Angles (t, n) [rad] of the links of a tapped ring, less those of the ring that turns on."""
    position, velocity = tapped_ring(links, chain, speed, spins)
    scene = {"floor": False, "gravity": False, "self_contact": False, "tolerance": 1e-8, "times": times}
    motion = warpchain.simulate(chain, position, velocity, float(times[-1]), **scene)
    if motion.status != warpchain.Status.FINISHED:
        raise RuntimeError(f"the tapped ring ended as {motion.status.label}")
    return motion.position[:, :, 2] - position[:, 2] - dispersion.ring_spin(chain, links, speed) * times[:, None]


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


def measured(angles: Array, waves: Waves, numbers: Array, columns: list[int]) -> Array:
    """Rates of modes of a tapped ring, fitted to its motion; of the four that are found those nearest to theory."""
    found = []
    for number, rates in zip(numbers, waves.rate[:, columns], strict=True):
        alive = min(len(angles), int(6 / np.abs(rates.real).max() / INTERVAL))
        fitted = fit_rates(mode_amplitudes(angles, number)[:alive], INTERVAL, 4)
        found.append(fitted[np.argmin(np.abs(rates[:, None] - fitted), axis=1)])
    return np.array(found)


def show_bands() -> None:
    """The band gap, and the waves that friction keeps from swinging."""
    rows, phases = [], np.linspace(0.01, np.pi / 2, 500)
    for frequency in FREQUENCIES:
        speed = speed_at(frequency)
        tension = DENSITY * speed**2
        low, high = dispersion.band_gap(CHAIN, tension)
        waves = dispersion.straight_waves(CHAIN, tension, phases)
        edge = waves.damping[-1, FORWARD]
        every, swings = extended(waves, np.abs(waves.frequency) > 1e-6, *FORWARD)
        gap = f"{low / 2 / np.pi:.1f} to {high / 2 / np.pi:.1f} ({100 * (high / low - 1):.1f} %)"
        damping = f"{edge[0]:.0f} and {edge[1]:.0f} ({edge.mean() / low:.2f} of ω)"
        rows.append((frequency, speed, tension, gap, damping, 2 * np.pi / every[swings == 1].max()))
    print("Bands of the straight chain under T = ρv²")
    head = "Hz | v, m/s | T, N | gap, Hz | damping there, 1/s | links of a wave below which it creeps"
    print(table(head, rows, "g .3f .2f s s .2f"))


def show_reach() -> None:
    """How far waves run, and how fast in the room."""
    rows = []
    for frequency in FREQUENCIES:
        speed = speed_at(frequency)
        waves = dispersion.straight_waves(CHAIN, DENSITY * speed**2, 2 * np.pi / WAVELENGTHS)
        for k, wavelength in enumerate(WAVELENGTHS):
            rate, damping, reach = (each[k, LOWER_FORWARD] for each in (waves.frequency, waves.damping, waves.reach))
            room = speed + LENGTH * waves.group_speed[k, BOTH]
            rows.append((frequency, f"{wavelength:g}", rate, damping, reach, reach / 60, reach / 120, *room))
        c = dispersion.long_wave_speed(CHAIN, DENSITY * speed**2 + 1)
        rows.append((frequency, "long, T = ρv² + 1 N", *[""] * 5, speed - c, speed + c))
    print("Waves of the straight chain under T = ρv²; speeds of packets in the room in m/s")
    head = "Hz | links | ω, 1/s | γ, 1/s | reach, links | of 60 | of 120 | slow | fast"
    print(table(head, rows, "g s .1f .3f .1f .2f .2f .2f .2f"))


def show_coulomb() -> None:
    """Coulomb friction as viscous friction of joints that swing about rest."""
    rows = []
    for name in ("soft", "paper"):
        chain = preset(name)
        rows.append([name, *(dispersion.equivalent_friction(chain, w) / chain.viscous_friction for w in SPINS)])
    print("Joint friction in units of β where joints swing about rest")
    print(table(["", *(f"{spin:g} rad/s" for spin in SPINS)], rows, "s" + len(SPINS) * " .2f"))


def show_ring(speed: float, angles: Array, numbers: Array) -> None:
    """Modes of the ring: exact, simulation, straight chain, continuous ring."""
    waves = dispersion.ring_waves(CHAIN, LINKS, speed, numbers)
    spin = dispersion.ring_spin(CHAIN, LINKS, speed)
    exact, found = waves.rate[:, BOTH], measured(angles, waves, numbers, BOTH)
    known = {
        "exact": exact,
        "simulated": found,
        "straight": dispersion.straight_waves(CHAIN, DENSITY * speed**2, waves.phase).rate[:, BOTH],
        "continuous": dispersion.continuous_ring(CHAIN, LINKS, speed, numbers),
    }
    rows = []
    for k, number in enumerate(numbers):
        crests = (number * spin + waves.frequency[k, BOTH]) / number / spin
        for name, rates in known.items():
            numbers_of = (part for rate in rates[k] for part in (-rate.imag, -rate.real))
            rows.append((number, LINKS / number, name, *numbers_of, *(crests if name == "exact" else ("", ""))))
    print(f"Ring of {LINKS} links, v = {speed:.3f} m/s, T = {DENSITY * speed**2:.2f} N; 1/s, in the room in v")
    head = "n | links a wave |  | slow ω | γ | fast ω | γ | slow crests | fast"
    print(table(head, rows, "d .1f s .2f .3f .2f .3f .3f .3f"))
    off = [100 * np.abs(one / other - 1).max() for one, other in ((found.imag, exact.imag), (found.real, exact.real))]
    print(f"simulated against exact: ω within {off[0]:.3f} %, γ within {off[1]:.2f} %")


def packets(links: int, number: int, width: float, speed: float) -> list[tuple[float, float]]:
    """Prints speeds and damping of two packets; returns their mean phases and speeds in the room in units of v."""
    waves = dispersion.ring_waves(CHAIN, links, speed, np.arange(2, links // 4 + 1))
    place, quickest = from_tap(links), waves.group_speed[number - 2, LOWER_FORWARD]
    times = np.linspace(0.17, 0.3, 41) * links / quickest
    envelope = np.exp(-(place**2) / (2 * width**2))
    angles = tapped(links, speed, 0.1 * np.cos(2 * np.pi * number * place / links) * envelope, times)
    in_room, rows = [], []
    for name, column in (("slow", LOWER_BACKWARD), ("fast", LOWER_FORWARD)):
        speeds, damping = waves.group_speed[:, column], waves.damping[:, column]
        guess = speeds[number - 2] * times
        reach = np.minimum(np.abs(guess), links / 2 - np.abs(guess))
        places, amplitudes, shares = map(np.array, zip(*map(find_packet, angles, guess, reach), strict=True))
        along, expected = (np.polyfit(times, way, 1)[0] for way in (places, shares @ speeds * times))
        falls, decay = -np.polyfit(times, np.log(amplitudes), 1)[0], np.mean(shares @ damping)
        room = 1 + along * LENGTH / speed
        in_room.append((np.mean(shares @ waves.phase), room))
        rows.append((links, links / number, name, LENGTH * along, LENGTH * expected, speed * room, falls, decay))
    head = "links | a wave |  | along the chain, m/s | theory | in the room, m/s | damping, 1/s | theory"
    print(table(head, rows, "d .0f s .3f .3f .2f .3f .3f"))
    return in_room


def extended(waves: Waves, values: Array, column: int, upper: int) -> tuple[Array, Array]:
    """A function of the phase from 0 to π: the lower band up to π/2, from there the upper one."""
    phases = np.concatenate([waves.phase, [np.nan], np.pi - waves.phase[::-1]])
    return phases, np.concatenate([values[:, column], [np.nan], values[::-1, upper]])


def draw(speed: float, angles: Array, numbers: Array, room: list[tuple[float, float]]) -> Figure:
    """Frequency, damping and speed in the room against the phase per link."""
    tension = DENSITY * speed**2
    phases = np.linspace(0.02, np.pi / 2, 300)
    rubbing, smooth = (dispersion.straight_waves(chain, tension, phases) for chain in (CHAIN, SMOOTH))
    gap = [edge / 2 / np.pi for edge in dispersion.band_gap(CHAIN, tension)]
    figure = Figure(figsize=(11.0, 4.0), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    left.axhspan(*gap, color=GROUND, linewidth=0.0)
    left.text(2.4, gap[1] + 3, "band gap", fontsize="small", color=INK, va="bottom")
    for straight, dashes in ((rubbing, "-"), (smooth, ":")):
        line = extended(straight, np.abs(straight.frequency) / (2 * np.pi), *FORWARD)
        left.plot(*line, color=INK, linewidth=1.2, linestyle=dashes)
    for pick in (np.minimum, np.maximum):  # of both directions, which creep at different rates
        values = pick(rubbing.damping, rubbing.damping[:, ::-1])
        middle.semilogy(*extended(rubbing, values, *FORWARD), color=INK, linewidth=1.2)
    alone = 0.1 * np.eye(LINKS)[0]
    rung = tapped(LINKS, speed, alone, INTERVAL * np.arange(400), SMOOTH)
    for chain, motion, shown, columns, more, face in (
        (CHAIN, angles, numbers, BOTH, "", None),
        (SMOOTH, rung, np.arange(2, LINKS // 4 + 1), list(range(4)), ", β/100", "none"),
    ):
        waves = dispersion.ring_waves(chain, LINKS, speed, shown)
        for rates, column in zip(measured(motion, waves, shown, columns).T, columns, strict=True):
            slow, lower = column in (LOWER_BACKWARD, UPPER_BACKWARD), column in BOTH
            place = waves.phase if lower else np.pi - waves.phase
            label = ("slow" if slow else "fast") + more if lower else None
            style = {"color": BLUE if slow else RED, "markerfacecolor": face, "label": label}
            style |= {"marker": "o", "linestyle": "none", "markersize": 4.0, "zorder": 4}
            left.plot(place, np.abs(rates.imag) / (2 * np.pi), **style)
            if face is None:
                middle.plot(place, -rates.real, **style)
    title = {"title": "modes of a tapped ring", "title_fontsize": "small"}
    left.legend(frameon=False, fontsize="small", loc="upper left", **title)
    for wavelength in WAVELENGTHS:
        phase = 2 * np.pi / wavelength
        one = dispersion.straight_waves(CHAIN, tension, [phase])
        text = f"{wavelength:.0f} links:\nreach {one.reach[0, LOWER_FORWARD]:.0f}"
        way = {"xytext": (26, -6), "textcoords": "offset points", "arrowprops": {"arrowstyle": "-", "color": FAINT}}
        middle.annotate(text, (phase, one.damping[0, LOWER_FORWARD]), fontsize="small", **way)
    ring = dispersion.ring_waves(CHAIN, 180, speed, np.arange(2, 46))
    for waves, dashes, label in ((ring, "-", "ring of 180 links"), (rubbing, ":", "straight chain")):
        for column, colour in zip(BOTH, (BLUE, RED), strict=True):
            value = 1 + waves.group_speed[:, column] * LENGTH / speed
            right.plot(waves.phase, value, color=colour, linestyle=dashes, linewidth=1.2, label=label)
            label = None
    right.plot(*np.array(room).T, "o", color=GREEN, markersize=5.0, label="packets, simulated", zorder=4)
    right.legend(frameon=False, fontsize="small", loc="center left")
    ticks = ["0", "π/4", "π/2", "3π/4", "π"]
    for axes, quarters, label, limits in (
        (left, 4, "frequency $|ω|/2π$ / Hz", (0, None)),
        (middle, 4, "damping $γ$ / s$^{-1}$", (0.01, 3000)),
        (right, 2, "speed in the room / $v$", (-0.2, 2.6)),
    ):
        axes.set_xticks(np.arange(quarters + 1) * np.pi / 4, ticks[: quarters + 1])
        end = quarters * np.pi / 4
        tidy(axes, grid="y", xlabel="phase per link $κ$ / rad", xlim=(0, end), ylabel=label, ylim=limits)
    return figure


def main() -> None:
    """Print all tables and draw the figure."""
    show_bands()
    show_reach()
    show_coulomb()
    speed, offset, numbers, places = speed_at(20.0), from_tap(LINKS), np.arange(2, 13), []
    angles = tapped(LINKS, speed, 0.1 * offset * np.exp(-(offset**2) / 4.5), INTERVAL * np.arange(400))
    show_ring(speed, angles, numbers)
    print("Packets on larger rings")
    for links, number, width in ((160, 20, 12.0), (180, 15, 10.0), (360, 15, 20.0)):
        places += packets(links, number, width, speed)
    publish(FOLDER, {}, {"dispersion": draw(speed, angles, numbers, places)})
