"""Prints the tables of the page on theory and rings and draws their figure: waves in theory and in tapped rings."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import warpchain
from studies.common import BLUE, FAINT, GREEN, GROUND, INK, RED, save_figure, tidy
from studies.waves.dispersion import (
    LOWER_BACKWARD,
    LOWER_FORWARD,
    UPPER_BACKWARD,
    UPPER_FORWARD,
    Waves,
    band_gap,
    continuous_ring,
    equivalent_friction,
    long_wave_speed,
    ring_spin,
    ring_waves,
    straight_waves,
)
from studies.waves.mode_fit import find_packet, fit_rates, mode_amplitudes
from studies.waves.tapped_ring import tapped_ring
from warpchain import Parameters, preset

Array = NDArray[np.float64]

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
BOTH = [LOWER_BACKWARD, LOWER_FORWARD]
FIGURE = Path(__file__).parent / "figures" / "dispersion.png"
INTERVAL = 2e-4
"""Time between two instants of a tapped ring [s]."""


def speed_at(frequency: float) -> float:
    """Speed along the loop [m/s] of a chain on its sprocket."""
    half = np.arcsin(LENGTH / 2 / (CHAIN.sprocket_radius + CHAIN.circle_radius))  # links are chords of the sprocket
    return float(np.pi * frequency * LENGTH / half)


def tapped(links: int, speed: float, spins: Array, times: Array, chain: Parameters = CHAIN) -> Array:
    """Angles (t, n) [rad] of the links of a tapped ring, less those of the ring that turns on."""
    position, velocity = tapped_ring(links, chain, speed, spins)
    scene: Mapping[str, bool] = {"floor": False, "gravity": False, "self_contact": False}
    motion = warpchain.simulate(chain, position, velocity, float(times[-1]), times=times, tolerance=1e-8, **scene)
    if motion.status != warpchain.Status.FINISHED:
        raise RuntimeError(f"the tapped ring ended as {motion.status.label}")
    return motion.position[:, :, 2] - position[:, 2] - ring_spin(chain, links, speed) * times[:, None]


def from_tap(links: int) -> Array:
    """Number of each link, counted from link 0 in both directions, (n,)."""
    return (np.arange(links) + links / 2) % links - links / 2


def measured(angles: Array, waves: Waves, numbers: Array, columns: list[int]) -> NDArray[np.complex128]:
    """Rates of modes of a tapped ring, fitted to its motion; of the four that are found those nearest to theory."""
    found = []
    for number, rates in zip(numbers, waves.rate[:, columns], strict=True):
        alive = min(len(angles), int(6 / np.abs(rates.real).max() / INTERVAL))
        fitted = fit_rates(mode_amplitudes(angles, number)[:alive], INTERVAL, 4)
        found.append(fitted[np.argmin(np.abs(rates[:, None] - fitted), axis=1)])
    return np.array(found)


def show_bands() -> None:
    """The band gap, and the waves that friction keeps from swinging."""
    print("Bands of the straight chain under T = ρv²")
    phases = np.linspace(0.01, np.pi / 2, 500)
    for frequency in FREQUENCIES:
        speed = speed_at(frequency)
        tension = DENSITY * speed**2
        low, high = band_gap(CHAIN, tension)
        waves = straight_waves(CHAIN, tension, phases)
        edge = waves.damping[-1, [LOWER_FORWARD, UPPER_FORWARD]]
        swings = np.abs(waves.frequency[:, [LOWER_FORWARD, UPPER_FORWARD]]) > 1e-6
        extended = np.concatenate([phases, np.pi - phases[::-1]])[np.concatenate([swings[:, 0], swings[::-1, 1]])]
        print(
            f"  {frequency:4.0f} Hz: v {speed:6.3f} m/s, T {tension:6.2f} N, gap {low / 2 / np.pi:6.1f} to "
            f"{high / 2 / np.pi:6.1f} Hz ({100 * (high / low - 1):.1f} %), damping there {edge[0]:.0f} and "
            f"{edge[1]:.0f} 1/s ({edge.mean() / low:.2f} of ω); waves shorter than "
            f"{2 * np.pi / extended.max():.2f} links creep"
        )


def show_reach() -> None:
    """How far waves run, and how fast in the room."""
    print("Waves of the straight chain under T = ρv²: reach in links, decay, speeds in the room in m/s (packet; crest)")
    for frequency in FREQUENCIES:
        speed = speed_at(frequency)
        waves = straight_waves(CHAIN, DENSITY * speed**2, 2 * np.pi / WAVELENGTHS)
        for k, wavelength in enumerate(WAVELENGTHS):
            packets, crests = (speed + LENGTH * speeds[k, BOTH] for speeds in (waves.group_speed, waves.phase_speed))
            reach = waves.reach[k, LOWER_FORWARD]
            print(
                f"  {frequency:4.0f} Hz, {wavelength:3.0f} links: ω {waves.frequency[k, LOWER_FORWARD]:7.1f} 1/s, "
                f"γ {waves.damping[k, LOWER_FORWARD]:7.3f} 1/s, reach {reach:8.1f} links, of the loop "
                f"{reach / 60:6.2f} (60) {reach / 120:6.2f} (120); slow {packets[0]:5.2f} ({crests[0]:5.2f}), "
                f"fast {packets[1]:6.2f} ({crests[1]:6.2f})"
            )
        for pull in (1.0, 2.0):
            c = long_wave_speed(CHAIN, DENSITY * speed**2 + pull)
            print(f"  {frequency:4.0f} Hz, T = ρv² + {pull} N: long waves at {speed - c:5.2f} and {speed + c:6.2f} m/s")


def show_coulomb() -> None:
    """Coulomb friction as viscous friction of joints that swing about rest."""
    for name in ("soft", "paper"):
        chain = preset(name)
        frictions = (equivalent_friction(chain, spin) / chain.viscous_friction for spin in SPINS)
        pairs = ", ".join(f"{friction:.2f} at {spin:g} rad/s" for spin, friction in zip(SPINS, frictions, strict=True))
        print(f"Joint friction of {name} in units of β where joints swing about rest: {pairs}")


def show_ring(speed: float, angles: Array, numbers: Array) -> None:
    """Modes of the ring: exact, simulation, straight chain, continuous ring, string."""
    waves = ring_waves(CHAIN, LINKS, speed, numbers)
    straight = straight_waves(CHAIN, DENSITY * speed**2, waves.phase)
    found = measured(angles, waves, numbers, BOTH)
    continuous = continuous_ring(CHAIN, LINKS, speed, numbers)
    spin = ring_spin(CHAIN, LINKS, speed)
    print(f"Ring of {LINKS} links, v = {speed:.3f} m/s, T = {DENSITY * speed**2:.2f} N; ω and γ in 1/s, slow and fast")
    worst = []
    for k, number in enumerate(numbers):
        theory = waves.rate[k, BOTH]
        worst.append([np.abs(found[k].imag / theory.imag - 1), np.abs(found[k].real / theory.real - 1)])
        room = (number * spin + waves.frequency[k, BOTH]) / number / spin
        groups = 1 + waves.group_speed[k, BOTH] * LENGTH / speed
        n = float(number)
        string = -spin * n, spin * n * (n**2 - 3) / (n**2 + 1)
        print(
            f"  n {number:2d}: {LINKS / number:5.1f} links a wave\n"
            f"    exact      {row(theory)}; in the room crests {room[0]:6.3f} v, {room[1]:6.3f} v, packets "
            f"{groups[0]:6.3f} v, {groups[1]:6.3f} v\n"
            f"    simulated  {row(found[k])}\n"
            f"    straight   {row(straight.rate[k, BOTH])}\n"
            f"    continuous {row(continuous[k])}\n"
            f"    string     ω {string[0]:8.2f}             ω {string[1]:8.2f}"
        )
    greatest = 100 * np.array(worst).max(axis=(0, 2))
    print(f"  simulated against exact: ω within {greatest[0]:.3f} %, γ within {greatest[1]:.2f} %")


def row(rates: NDArray[np.complex128]) -> str:
    """Frequencies and damping of the slow and the fast wave."""
    return ", ".join(f"ω {-rate.imag:8.2f} γ {-rate.real:7.3f}" for rate in rates)


def packets(links: int, number: int, width: float, speed: float) -> list[tuple[float, float]]:
    """Prints speeds and damping of two packets; returns their mean phases and speeds in the room in units of v."""
    waves = ring_waves(CHAIN, links, speed, np.arange(2, links // 4 + 1))
    place, quickest = from_tap(links), waves.group_speed[number - 2, LOWER_FORWARD]
    times = np.linspace(0.17, 0.3, 41) * links / quickest
    envelope = np.exp(-(place**2) / (2 * width**2))
    angles = tapped(links, speed, 0.1 * np.cos(2 * np.pi * number * place / links) * envelope, times)
    in_room = []
    for name, column in (("slow", LOWER_BACKWARD), ("fast", LOWER_FORWARD)):
        speeds, damping = waves.group_speed[:, column], waves.damping[:, column]
        guess = speeds[number - 2] * times
        reach = np.minimum(np.abs(guess), links / 2 - np.abs(guess))
        found = [find_packet(*each) for each in zip(angles, guess, reach, strict=True)]
        measured_speed = np.polyfit(times, [packet.place for packet in found], 1)[0]
        expected = np.polyfit(times, [packet.mean(speeds) * t for packet, t in zip(found, times, strict=True)], 1)[0]
        falls = -np.polyfit(times, np.log([packet.amplitude for packet in found]), 1)[0]
        decay = float(np.mean([packet.mean(damping) for packet in found]))
        room = 1 + measured_speed * LENGTH / speed
        in_room.append((float(np.mean([packet.mean(waves.phase) for packet in found])), room))
        print(
            f"  {links} links, {links / number:.0f} a wave, {name}: {LENGTH * measured_speed:7.4f} m/s along the "
            f"chain, theory {LENGTH * expected:7.4f} ({100 * (measured_speed / expected - 1):+.2f} %; of n = {number} "
            f"{LENGTH * speeds[number - 2]:7.4f}); damping {falls:.3f} 1/s, theory {decay:.3f} "
            f"({100 * (falls / decay - 1):+.2f} %); in the room {speed * room:.3f} m/s = {room:.3f} v"
        )
    return in_room


def extended(waves: Waves, values: Array, column: int, upper: int) -> tuple[Array, Array]:
    """A function of the phase from 0 to π: the lower band up to π/2, from there the upper one."""
    phases = np.concatenate([waves.phase, [np.nan], np.pi - waves.phase[::-1]])
    return phases, np.concatenate([values[:, column], [np.nan], values[::-1, upper]])


def draw(speed: float, angles: Array, numbers: Array, room: list[tuple[float, float]]) -> Figure:
    """Frequency, damping and speed in the room against the phase per link."""
    tension = DENSITY * speed**2
    phases = np.linspace(0.02, np.pi / 2, 300)
    rubbing, smooth = (straight_waves(chain, tension, phases) for chain in (CHAIN, SMOOTH))
    figure = Figure(figsize=(11.0, 4.0), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    draw_bands(left, rubbing, smooth, band_gap(CHAIN, tension))
    for axes in (left, middle):
        axes.set_xlim(0, np.pi)
        axes.set_xticks([0, np.pi / 4, np.pi / 2, 3 * np.pi / 4, np.pi], ["0", "π/4", "π/2", "3π/4", "π"])
        axes.set_xlabel("phase per link $κ$ / rad")
    for pick in (np.minimum, np.maximum):  # of both directions, which creep at different rates
        values = pick(rubbing.damping, rubbing.damping[:, ::-1])
        middle.semilogy(*extended(rubbing, values, LOWER_FORWARD, UPPER_FORWARD), color=INK, linewidth=1.2)
    middle.set(ylabel="damping $γ$ / s$^{-1}$", ylim=(0.01, 3000))
    alone = np.zeros(LINKS)
    alone[0] = 0.1
    times, all_numbers = INTERVAL * np.arange(400), np.arange(2, LINKS // 4 + 1)
    for chain, motion, shown, columns, filled in (
        (CHAIN, angles, numbers, BOTH, True),
        (SMOOTH, tapped(LINKS, speed, alone, times, SMOOTH), all_numbers, list(range(4)), False),
    ):
        waves = ring_waves(chain, LINKS, speed, shown)
        rates = measured(motion, waves, shown, columns)
        for which, column in enumerate(columns):
            slow = column in (LOWER_BACKWARD, UPPER_BACKWARD)
            place = waves.phase if column in BOTH else np.pi - waves.phase
            colour = BLUE if slow else RED
            style = {"marker": "o", "linestyle": "none", "markersize": 4.0, "color": colour, "zorder": 4}
            style |= {} if filled else {"markerfacecolor": "none"}
            label = ("slow" if slow else "fast") + ("" if filled else ", β/100")
            left.plot(
                place, np.abs(rates[:, which].imag) / (2 * np.pi), label=label if column in BOTH else None, **style
            )
            if filled:
                middle.plot(place, -rates[:, which].real, **style)
    left.legend(
        frameon=False, fontsize="small", loc="upper left", title="modes of a tapped ring", title_fontsize="small"
    )
    for wavelength in WAVELENGTHS:
        phase = 2 * np.pi / wavelength
        one = straight_waves(CHAIN, tension, [phase])
        middle.annotate(
            f"{wavelength:.0f} links:\nreach {one.reach[0, LOWER_FORWARD]:.0f}",
            (phase, one.damping[0, LOWER_FORWARD]),
            xytext=(26, -6),
            textcoords="offset points",
            fontsize="small",
            arrowprops={"arrowstyle": "-", "color": FAINT},
        )
    draw_room(right, speed, room)
    for axes in (left, middle, right):
        tidy(axes, grid="y")
    return figure


def draw_bands(axes: Axes, rubbing: Waves, smooth: Waves, gap: tuple[float, float]) -> None:
    """Frequencies of the straight chain with its friction and hardly any, and the band gap."""
    axes.axhspan(gap[0] / 2 / np.pi, gap[1] / 2 / np.pi, color=GROUND, linewidth=0.0)
    for waves, style in ((rubbing, "-"), (smooth, ":")):
        line = extended(waves, np.abs(waves.frequency) / (2 * np.pi), LOWER_FORWARD, UPPER_FORWARD)
        axes.plot(*line, color=INK, linewidth=1.2, linestyle=style)
    axes.text(2.4, gap[1] / 2 / np.pi + 3, "band gap", fontsize="small", color=INK, va="bottom")
    axes.set(ylabel="frequency $|ω|/2π$ / Hz", ylim=(0, None))


def draw_room(axes: Axes, speed: float, room: list[tuple[float, float]]) -> None:
    """Speeds of packets in the room, of the ring of 180 links, the straight chain and measured."""
    numbers = np.arange(2, 46)
    ring = ring_waves(CHAIN, 180, speed, numbers)
    straight = straight_waves(CHAIN, DENSITY * speed**2, np.linspace(0.01, np.pi / 2, 300))
    for waves, style, label in ((ring, "-", "ring of 180 links"), (straight, ":", "straight chain")):
        for column, colour in ((LOWER_BACKWARD, BLUE), (LOWER_FORWARD, RED)):
            value = 1 + waves.group_speed[:, column] * LENGTH / speed
            axes.plot(waves.phase, value, color=colour, linestyle=style, linewidth=1.2, label=label)
            label = None
    axes.plot(*np.array(room).T, "o", color=GREEN, markersize=5.0, label="packets, simulated", zorder=4)
    axes.set(xlim=(0, np.pi / 2), ylim=(-0.2, 2.6), xlabel="phase per link $κ$ / rad", ylabel="speed in the room / $v$")
    axes.set_xticks([0, np.pi / 4, np.pi / 2], ["0", "π/4", "π/2"])
    axes.legend(frameon=False, fontsize="small", loc="center left")


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
    save_figure(draw(at_20, ring_angles, ring_numbers, places), FIGURE)
