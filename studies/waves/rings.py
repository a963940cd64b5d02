"""Waves in theory and in tapped rings: their tables, printed, and their figure.

A ring of links that turns like a rigid body is tapped; `warpchain.simulate` moves it on. Its motion is taken apart into
modes, the decaying oscillations that they are made of, and packets.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import warpchain
from studies.common import BLUE, FAINT, GREEN, GROUND, INK, RED, Array, publish, table, tidy
from studies.waves import dispersion
from studies.waves.dispersion import LOWER_BACKWARD, LOWER_FORWARD, UPPER_BACKWARD, UPPER_FORWARD, Waves
from warpchain import Parameters, preset

CHAIN = preset("soft").with_values({"coulomb_friction": 0.0})
"""Table 1's chain with softened joints, without Coulomb friction."""
SMOOTH = CHAIN.with_values({"viscous_friction": CHAIN.viscous_friction / 100})
"""The same, with a hundredth of the viscous friction."""
LENGTH = CHAIN.link_length
DENSITY = (CHAIN.inner_mass + CHAIN.outer_mass) / 2 / LENGTH
LINKS = 60
FREQUENCIES = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0)
SPINS = (0.01, 0.1, 1.0, 10.0, 60.0)
"""Amplitudes of a joint's angular velocity [rad/s]; joints turn at 60 rad/s where a loop bends."""
WAVELENGTHS = np.array([6.0, 12.0, 24.0])
BOTH, FORWARD = [LOWER_BACKWARD, LOWER_FORWARD], [LOWER_FORWARD, UPPER_FORWARD]
FOLDER = Path(__file__).parent
INTERVAL = 2e-4
"""Time between two instants of a tapped ring [s]."""


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

    `speed` [m/s] is that of the joints of the closed ring before the tap, anticlockwise if positive; `spins` are
    further angular velocities [rad/s], (n,). Returns position and velocity (n, 3): x, y [m], θ [rad] and their rates.
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
    scene: dict[str, Any] = {"floor": False, "gravity": False, "self_contact": False, "tolerance": 1e-8}
    motion = warpchain.simulate(chain, position, velocity, float(times[-1]), times=times, **scene)
    if motion.status != warpchain.Status.FINISHED:
        raise RuntimeError(f"the tapped ring ended as {motion.status.label}")
    return motion.position[:, :, 2] - position[:, 2] - dispersion.ring_spin(chain, links, speed) * times[:, None]


def from_tap(links: int) -> Array:
    """Number of each link, counted from link 0 in both directions, (n,)."""
    return (np.arange(links) + links / 2) % links - links / 2


def mode_amplitudes(angles: Array, number: int) -> Array:
    """Fourier components of links' angles [rad], shape (t, n), of inner and outer links apart.

    Returns:
        2/n Σ ϑ_j exp(−2πi · number · j/n) over even and over odd j [rad], shape (t, 2).
    """
    links = angles.shape[1]
    wave = 2 / links * np.exp(-2j * np.pi * number * np.arange(links) / links)
    return np.stack([angles[:, part::2] @ wave[part::2] for part in (0, 1)], axis=1)


def fit_rates(signals: Array, interval: float, count: int) -> Array:
    """Rates λ of the sum of `count` exponentials Σ a exp(λt) that signals, shape (t, s), have in common.

    ESPRIT (Roy and Kailath, IEEE Trans. ASSP 37 (1989) 984): stretches of the signals span a space that is the same one
    sample later but for the factors exp(λ · interval), which are the eigenvalues of the map between both.

    Returns:
        λ [1/s], by falling imaginary part, shape (count,).

    Raises:
        ValueError: there are too few instants.
    """
    instants = len(signals)
    stretch = 2 * instants // 3
    if instants < 3 * count:
        raise ValueError(f"{instants} instants do not tell {count} exponentials apart; give at least {3 * count}")
    rows = np.concatenate([np.lib.stride_tricks.sliding_window_view(column, stretch) for column in signals.T])
    space = np.linalg.svd(rows, full_matrices=False)[2][:count].T
    shift = np.linalg.lstsq(space[:-1], space[1:], rcond=None)[0]
    rates = np.log(np.linalg.eigvals(shift).astype(np.complex128)) / interval
    return np.asarray(rates[np.argsort(-rates.imag)])


@dataclass(frozen=True, eq=False, kw_only=True)
class Packet:
    """A packet of waves at one instant.

    Attributes:
        place: centre of its squared envelope [links].
        amplitude: root of the sum of its squared envelope [rad].
        shares: of the modes 0, 1, … in the sum of its squared spectrum, shape (n/2,).
    """

    place: float
    amplitude: float
    shares: Array

    def mean(self, values: Array) -> float:
        """The mean of values of the modes from 2 on, as many as are given, by their shares."""
        shares = self.shares[2 : 2 + len(values)]
        return float(shares @ values / shares.sum())


def find_packet(angles: Array, link: float, width: float) -> Packet:
    """The packet of a ring's angles (n,) at most `width` links from the place `link`, on an endless count of links.

    The envelope is that of the waves with n > 0 in exp(2πinj/N), twice their absolute value.
    """
    links = len(angles)
    spectrum = np.fft.fft(angles)
    spectrum[0] = 0.0
    spectrum[links // 2 :] = 0.0
    offset = (np.arange(links) - link + links / 2) % links - links / 2
    signal = np.where(np.abs(offset) <= width, 2 * np.fft.ifft(spectrum), 0.0)
    energy = np.abs(signal) ** 2
    total = float(energy.sum())
    shares = np.abs(np.fft.fft(signal))[: links // 2] ** 2
    return Packet(place=link + float(energy @ offset) / total, amplitude=total**0.5, shares=shares / shares.sum())


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
        swings = np.abs(waves.frequency[:, FORWARD]) > 1e-6
        swinging = np.concatenate([phases, np.pi - phases[::-1]])[np.concatenate([swings[:, 0], swings[::-1, 1]])]
        gap = f"{low / 2 / np.pi:.1f} to {high / 2 / np.pi:.1f} ({100 * (high / low - 1):.1f} %)"
        damping = f"{edge[0]:.0f} and {edge[1]:.0f} ({edge.mean() / low:.2f} of ω)"
        shortest = f"{2 * np.pi / swinging.max():.2f}"
        rows.append((f"{frequency:g}", f"{speed:.3f}", f"{tension:.2f}", gap, damping, shortest))
    print("Bands of the straight chain under T = ρv²")
    print(table("Hz | v, m/s | T, N | gap, Hz | damping there, 1/s | links of a wave below which it creeps", rows))


def show_reach() -> None:
    """How far waves run, and how fast in the room."""
    rows = []
    for frequency in FREQUENCIES:
        speed = speed_at(frequency)
        waves = dispersion.straight_waves(CHAIN, DENSITY * speed**2, 2 * np.pi / WAVELENGTHS)
        for k, wavelength in enumerate(WAVELENGTHS):
            packets, crests = (speed + LENGTH * speeds[k, BOTH] for speeds in (waves.group_speed, waves.phase_speed))
            rate = f"{waves.frequency[k, LOWER_FORWARD]:.1f}", f"{waves.damping[k, LOWER_FORWARD]:.3f}"
            reach = waves.reach[k, LOWER_FORWARD]
            loops = f"{reach:.1f}", f"{reach / 60:.2f}", f"{reach / 120:.2f}"
            both = (f"{packet:.2f} ({crest:.2f})" for packet, crest in zip(packets, crests, strict=True))
            rows.append((f"{frequency:g}", f"{wavelength:.0f}", *rate, *loops, *both))
        for pull in (1.0, 2.0):
            c = dispersion.long_wave_speed(CHAIN, DENSITY * speed**2 + pull)
            rows.append(
                (f"{frequency:g}", f"long, T = ρv² + {pull} N", *[""] * 5, *(f"{speed + v:.2f}" for v in (-c, c)))
            )
    print("Waves of the straight chain under T = ρv²; speeds in the room in m/s: packet (crest)")
    print(table("Hz | links | ω, 1/s | γ, 1/s | reach, links | of 60 | of 120 | slow | fast", rows))


def show_coulomb() -> None:
    """Coulomb friction as viscous friction of joints that swing about rest."""
    rows = []
    for name in ("soft", "paper"):
        chain = preset(name)
        rows.append(
            [name, *(f"{dispersion.equivalent_friction(chain, spin) / chain.viscous_friction:.2f}" for spin in SPINS)]
        )
    print("Joint friction in units of β where joints swing about rest")
    print(table(["", *(f"{spin:g} rad/s" for spin in SPINS)], rows))


def show_ring(speed: float, angles: Array, numbers: Array) -> None:
    """Modes of the ring: exact, simulation, straight chain, continuous ring, string."""
    waves = dispersion.ring_waves(CHAIN, LINKS, speed, numbers)
    spin = dispersion.ring_spin(CHAIN, LINKS, speed)
    exact, found = waves.rate[:, BOTH], measured(angles, waves, numbers, BOTH)
    string = 1j * spin * np.stack([numbers, -numbers * (numbers**2 - 3.0) / (numbers**2 + 1)], axis=1)
    known = {
        "exact": exact,
        "simulated": found,
        "straight": dispersion.straight_waves(CHAIN, DENSITY * speed**2, waves.phase).rate[:, BOTH],
        "continuous": dispersion.continuous_ring(CHAIN, LINKS, speed, numbers),
        "string": string,
    }
    rows = []
    for k, number in enumerate(numbers):
        crests = (number * spin + waves.frequency[k, BOTH]) / number / spin
        packets = 1 + waves.group_speed[k, BOTH] * LENGTH / speed
        for name, rates in known.items():
            texts = (text for rate in rates[k] for text in (f"{-rate.imag:.2f}", f"{-rate.real:.3f}"))
            room = (f"{each:.3f}" for each in (*crests, *packets)) if name == "exact" else [""] * 4
            rows.append((number, f"{LINKS / number:.1f}", name, *texts, *room))
    print(f"Ring of {LINKS} links, v = {speed:.3f} m/s, T = {DENSITY * speed**2:.2f} N; 1/s, in the room in v")
    head = "n | links a wave |  | slow ω | γ | fast ω | γ | slow crests | fast | slow packets | fast"
    print(table(head, rows))
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
        found = [find_packet(*each) for each in zip(angles, guess, reach, strict=True)]
        along = np.polyfit(times, [packet.place for packet in found], 1)[0]
        expected = np.polyfit(times, [packet.mean(speeds) * t for packet, t in zip(found, times, strict=True)], 1)[0]
        falls = -np.polyfit(times, np.log([packet.amplitude for packet in found]), 1)[0]
        decay = float(np.mean([packet.mean(damping) for packet in found]))
        room = 1 + along * LENGTH / speed
        in_room.append((float(np.mean([packet.mean(waves.phase) for packet in found])), room))
        of_n = f"{LENGTH * speeds[number - 2]:.4f}"
        one = f"{LENGTH * along:.4f}", f"{LENGTH * expected:.4f} ({100 * (along / expected - 1):+.2f} %)", of_n
        other = f"{falls:.3f}", f"{decay:.3f} ({100 * (falls / decay - 1):+.2f} %)"
        rows.append((f"{links}", f"{links / number:.0f}", name, *one, *other, f"{speed * room:.3f} m/s = {room:.3f} v"))
    print(table("links | a wave |  | along the chain, m/s | theory | of n | damping, 1/s | theory | in the room", rows))
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
            style: dict[str, Any] = {"marker": "o", "linestyle": "none", "markersize": 4.0, "zorder": 4}
            style |= {"color": BLUE if slow else RED, "markerfacecolor": face, "label": label}
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
    at_20 = speed_at(20.0)
    offset = from_tap(LINKS)
    ring_angles = tapped(LINKS, at_20, 0.1 * offset * np.exp(-(offset**2) / 4.5), INTERVAL * np.arange(400))
    ring_numbers = np.arange(2, 13)
    show_ring(at_20, ring_angles, ring_numbers)
    print("Packets on larger rings")
    places = []
    for how_many, wave_number, spread in ((160, 20, 12.0), (180, 15, 10.0), (360, 15, 20.0)):
        places += packets(how_many, wave_number, spread, at_20)
    publish(FOLDER, {}, {"dispersion": draw(at_20, ring_angles, ring_numbers, places)})
