"""The paper's claims in its order, from claims.yaml, each with what tests it and with reasons, by verdict."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import yaml

from studies.paper import findings
from studies.paper.verdicts import Verdict


@dataclass(frozen=True)
class Finding:
    """What came out, and what it says of the claim; whether a person wrote it, from another page."""

    text: str
    verdict: Verdict
    is_typed: bool = False


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper.

    Attributes:
        sentence: in short.
        source: where its numbers are from, in Markdown.
        says: what came out, with the names of numbers in braces.
        check: name of the function of `findings`, and its argument; none of what another page shows.
        verdict: set by hand, where it is not clear what the paper says.
        reasons: verdict → why.
    """

    sentence: str
    source: str
    says: str
    check: str = ""
    verdict: str = ""
    reasons: Mapping[str, str] | None = None

    def finding(self, numbers: findings.Numbers) -> Finding:
        """What came out."""
        name, _, argument = self.check.partition(" ")
        found: Any = getattr(findings, name) if name else lambda _: (Verdict.OPEN, {})
        verdict, words = (found(argument) if argument else found)(numbers)
        given = Verdict(self.verdict) if self.verdict else verdict
        return Finding(self.says.format(**words), given, name in ("", "waves"))

    def reason(self, verdict: Verdict) -> str:
        """Why the verdict is what it is; the page admits it if no reason is known."""
        for verdicts, text in (self.reasons or {}).items():
            if verdict in verdicts.split(" | "):
                return text
        return {Verdict.OPEN: "The numbers are missing.", Verdict.AGREES: ""}.get(verdict, "No reason is known.")


CLAIMS: Final = tuple(
    Claim(**given) for given in yaml.safe_load(Path(__file__).with_name("claims.yaml").read_text(encoding="utf-8"))
)
