"""The paper's claims in its order, each with what tests it and with reasons, by verdict.

A reason is written by hand for the verdicts that were expected. For any other the page admits that none is known.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from studies.paper import findings, last_findings
from studies.paper.findings import Check, Finding, Numbers
from studies.paper.verdicts import Verdict

AGREES, PART, DIFFERS, OPEN = Verdict


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper.

    Attributes:
        sentence: what it says, in short.
        source: sweep or page whose numbers test it, in Markdown.
        check: what came out.
        reasons: verdict → why.
    """

    sentence: str
    source: str
    check: Check
    reasons: Mapping[Verdict, str] = field(default_factory=dict)

    def reason(self, verdict: Verdict) -> str:
        """Why the verdict is what it is."""
        if verdict is Verdict.OPEN and verdict not in self.reasons:
            return "The numbers are missing."
        if verdict in self.reasons:
            return self.reasons[verdict]
        return "" if verdict is Verdict.AGREES else "No reason is known."


def _left_open(check: Check) -> Check:
    """The same numbers without a verdict, because it is not clear what the paper says."""

    def left(numbers: Numbers) -> Finding:
        return Finding(check(numbers).text, Verdict.OPEN)

    return left


STARTS: Final = "`start`"
SHAPES: Final = "`paper_shapes`"
TOLERANCE: Final = "`paper_tolerance`"

SLOW: Final = "Slow loops, at 5 Hz and long ones at 10 Hz, collapse in their first impact and slide to rest."

CLAIMS: Final = (
    Claim(
        "The chain bounces along the floor; number and size of the bounces vary", STARTS, findings.bounces, {PART: SLOW}
    ),
    Claim(
        "The shape of the chain does not change significantly in the collision",
        SHAPES,
        findings.shape,
        {
            verdict: f"{SLOW} Of those that rise again area and height stay; the width of slow ones grows, for they "
            "[lose a greater share of their speed](#the-first-impact)."
            for verdict in (PART, DIFFERS)
        },
    ),
    Claim(
        "The rotational speed is slightly reduced in the collision",
        SHAPES,
        findings.speed,
        {
            verdict: "The floor's impulse follows from the fall rather than from the speed along the loop, so "
            "[slow loops lose a greater share](#the-first-impact)."
            for verdict in (PART, DIFFERS)
        },
    ),
    Claim(
        "Collisions take most of the chain's energy",
        STARTS,
        findings.losses,
        {
            verdict: "Friction of the joints takes half: it acts all the time, and most after an impact, when the loop "
            "swings. Damping of the joints follows impacts, too; with it collisions take about half, so the verdict "
            "hangs on whether that damping counts as collision."
            for verdict in (PART, DIFFERS)
        },
    ),
    Claim("Δx rises with ν (Figure 6, read off the picture)", STARTS, findings.faster),
    Claim("Δx falls with n (Figure 6, from rest, read off the picture)", STARTS, findings.longer),
    Claim("With n and ν constant Δx varies only moderately", STARTS, findings.moderate),
    Claim(
        "From rest, Δx of n = 150 and 180 is an underestimate; a wider ellipse walks further",
        STARTS,
        findings.underestimate,
    ),
    Claim(
        "From rest, long chains collide with themselves right after their second collision with the floor",
        "`paper_strands`",
        findings.self_collision,
        {
            verdict: "Slow loops, at 5 Hz, collapse in their first impact; 180 links at 10, 25 and 30 Hz meet "
            "themselves a bounce earlier more often, 150 links at 15 Hz later than the third "
            "([when](#when-the-loop-collides-with-itself))."
            for verdict in (PART, DIFFERS)
        },
    ),
    Claim(
        "… and that is why they walk less far",
        "`paper_through`, `paper_strands`",
        findings.cause,
        {
            verdict: "Collisions of the chain with itself do shorten these walks, by a quarter. The narrow loop on the "
            "sprocket [does the rest](#figure-6-distance-against-frequency). Links that pass through one another also "
            "crease and pile up without contact."
            for verdict in (AGREES, PART, DIFFERS)
        },
    ),
    Claim("The ellipse delays this collision (150 and 180 links)", "`paper_strands`", findings.delay),
    Claim(
        "Most simulated points lie within two standard deviations of the measured ones",
        "Figure 6",
        findings.stated("The measured points are published as a picture.", OPEN),
        {OPEN: "There is no table of them."},
    ),
    Claim(
        "A thousand times more precise, single walks differ by up to 10 %",
        TOLERANCE,
        findings.single_walks,
        {
            PART: "A walk amplifies any perturbation, so the greatest difference grows with the number of walks. "
            "48 walks from rest, with Table 1's joints, differ by up to 13 % "
            "([accuracy](../../docs/accuracy.md#tolerance)).",
            DIFFERS: "A walk amplifies any perturbation; the greatest difference grows with the number of walks.",
        },
    ),
    Claim(
        "… and means of 12 walks by less than a few per cent",
        TOLERANCE,
        findings.means,
        {
            PART: "Means of 12 chaotic walks differ by their own standard error, 2 to 4 %, whatever the tolerance.",
            DIFFERS: "Means of 12 chaotic walks differ by their own standard error, 2 to 4 %, whatever the tolerance.",
        },
    ),
    Claim("Δx has the same distribution at both tolerances", "`paper_distributions`", last_findings.same_distributions),
    Claim(
        "Δx depends highly nonlinearly on the parameters within a standard deviation (footnote 9)",
        "`paper_strands`",
        last_findings.nonlinear,
        {
            PART: "One linear formula with the same coefficients for all cells fails from rest. The cells' own "
            "coefficients differ, even in sign (friction of the floor), and were not fitted; squares and products with "
            "common coefficients predict no better. How much is curvature and how much chaos is not shown."
        },
    ),
    Claim(
        "For other n and ν height and velocity over time keep the shape of Figure 5",
        "[figure5.csv](results/figure5.csv)",
        last_findings.figure5_shape,
        {verdict: "Long slow chains collapse in their first impacts and slide." for verdict in (PART, DIFFERS)},
    ),
    Claim(
        "High-order explicit methods are 40 times faster than implicit ones",
        "[accuracy](../../docs/accuracy.md#error-against-cost), [methods](#further-remarks)",
        findings.stated(
            "a whole walk of 60 links: `rkf78` at 1e-6 takes 3.95 s, the implicit `rodas5p`, since removed, 16.7 s at "
            "1e-6 and 6.3 s at 1e-4, so 4.2 and 1.6 times as long; 150 links in free flight: `rodas5p` takes 7.4 times "
            "less, both at 1e-6",
            PART,
        ),
        {
            PART: "Impulses end the long steps that an implicit method takes in flight. Its matrix is cyclic "
            "block-tridiagonal and is solved in a time proportional to n, a general one in a time proportional to n³."
        },
    ),
    Claim(
        "… and 5 times faster than standard explicit methods, for the same error",
        "[methods](#further-remarks)",
        findings.stated(
            "a whole walk of 60 links, both at 1e-6: `dp5` 3.7 s, `rkf78` 3.95 s, so `dp5` is 1.06 times faster; in "
            "free flight 1.6 times, for errors of 4e-12 and 9e-12 m",
            DIFFERS,
        ),
        {
            DIFFERS: "The stiff joints bound the steps of both methods, so what counts is the number of stages: six "
            "against thirteen."
        },
    ),
    Claim(
        "Longer links ℓ make the chain rigid, and it loses its shape more easily",
        "`link_length`",
        findings.collapse,
        {
            verdict: "The number of links stays, so longer links also make a longer chain: stiffness and size are not "
            "told apart."
            for verdict in (PART, DIFFERS)
        },
    ),
    Claim(
        "Masses and moments of inertia varied over two orders of magnitude",
        "`inner_mass`, `outer_mass`",
        _left_open(findings.MASSES),
        {
            OPEN: "The sentence is garbled in the copy of the paper that was at hand; if it says that nothing depends "
            "on them, it differs. On the sprocket some such loops never become stationary, so all start as an ellipse."
        },
    ),
    Claim(
        "… moments of inertia", "`inner_inertia`, `outer_inertia`", _left_open(findings.INERTIAS), {OPEN: "As above."}
    ),
    Claim(
        "The floor's restitution e_fc, over two orders of magnitude: no dependence",
        "`floor_restitution`",
        findings.NO_RESTITUTION,
    ),
    Claim(
        "Less friction of the floor, μ_fc, lets the chain walk further",
        "`floor_friction`",
        findings.floor_friction,
        {
            verdict: "Friction turns rotation into walking: Δx rises with it until links at the floor stick. Then it "
            "falls for fast loops, the earlier the longer they are, which friction stops and "
            "[folds](#friction-of-the-floor); slow short loops still gain at 0.6."
            for verdict in (PART, DIFFERS)
        },
    ),
    Claim(
        "… for then less energy is dissipated",
        "`floor_friction`",
        findings.lost_on_floor,
        {
            verdict: "Below Table 1's value collisions with the floor do take less, and friction of the joints more. "
            "Above it they take less, too: there self-contacts and damping of the joints take more."
            for verdict in (PART, DIFFERS)
        },
    ),
    Claim(
        "The lower friction allowed longer sliding as well",
        "`paper_more`",
        last_findings.sliding,
        {
            verdict: "With much less friction the collapsed loop slides for longer, as it says. About Table 1's value "
            "the 24 walks of this trial tell no difference."
            for verdict in (PART, DIFFERS)
        },
    ),
    Claim("Greater gravity shortens Δx", "`gravity`", findings.falling("gravity")),
    Claim(
        "The adjusted parameters had little effect",
        "`paper_joints`, `tangential_restitution`, `sprocket_restitution`, `sprocket_friction`",
        findings.LITTLE_EFFECT,
    ),
    Claim("The motion depends unnoticeably on the damping b", "`joint_damping`", findings.UNNOTICED_DAMPING),
    Claim(
        "Besides Table 1's parameters, time and height of the release are drawn, which varies Δx further",
        "`gravity`, `release_only`, `parameters_only`",
        findings.spread,
        {
            verdict: "A walk amplifies any perturbation: either alone spreads Δx about as far as both, so drawing the "
            "release does not measurably vary Δx further than Table 1's parameters alone."
            for verdict in (PART, DIFFERS)
        },
    ),
    Claim(
        "A planar chain walks about as far as one that falls over",
        "[tilting plane](../tilting_plane/README.md)",
        findings.stated(
            "a tilt of 0.001 rad at the release lengthens Δx by 1.0 ± 0.2 %, 0.01 rad by 2.7 %, 0.1 rad by 8 %, "
            "harder taps by up to 17 %",
            AGREES,
        ),
        {
            AGREES: "Chains fall over, but after their loop has collapsed, unless they lean by 0.1 rad at the "
            "release or are pushed at 1 m/s."
        },
    ),
    Claim("A planar chain loses its shape gradually", "`paper_strands`, `paper_shapes`", last_findings.gradual),
    Claim(
        "A plane that tilts needs only six more degrees of freedom",
        "[tilting plane](../../docs/tilting-plane.md)",
        findings.stated("three: across the plane, tilt and heading", AGREES),
        {AGREES: "The other three, two of the centre of mass and the rotation in the plane, the links have already."},
    ),
    Claim(
        "The kink of the loop on its sprocket",
        "[stationary loop](../stationary_loop/README.md#the-shape-of-the-loop)",
        findings.stated(
            "a bending wave that stands still in the room: −11.2 1/m at 13.5 cm from the lowest point with 120 links "
            "at 20 Hz, theory −10.9 at 13.5 cm",
            AGREES,
        ),
    ),
    Claim(
        "A collision or a tap creates two disturbances, which spread in opposite directions",
        "[waves](../waves/README.md#the-picture)",
        findings.stated(
            "seen after an impact; packets on tapped rings at 20 Hz run both ways along the chain at 6.9 to 7.6 m/s, "
            "within 0.1 % of theory; "
            "in the room one nearly stands still, the other runs at 15 m/s",
            AGREES,
        ),
    ),
    Claim(
        "It is possible that these disturbances influence the distance",
        "[waves](../waves/README.md#do-they-matter)",
        findings.waves,
        {
            PART: "The verdict is set by hand: a gentle drag in flight changes little, but something; a strong one, or "
            "one in impacts, does more than damp waves ([waves](../waves/README.md#do-they-matter))."
        },
    ),
)
