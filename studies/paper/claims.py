"""The paper's claims in its order, from claims.yaml, each with what tests it and with reasons, by verdict."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import yaml

from studies.paper import findings, last_findings
from studies.paper.findings import Check, Finding, Numbers
from studies.paper.verdicts import Verdict


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, in short; where its numbers are from, in Markdown; what came out; verdict → why."""

    sentence: str
    source: str
    check: Check
    reasons: Mapping[Verdict, str]

    def reason(self, verdict: Verdict) -> str:
        """Why the verdict is what it is; the page admits it if no reason is known."""
        if verdict is Verdict.OPEN and verdict not in self.reasons:
            return "The numbers are missing."
        return self.reasons.get(verdict, "" if verdict is Verdict.AGREES else "No reason is known.")


def _check(given: Mapping[str, Any]) -> Check:
    """The function that tests a claim; `verdict` is set by hand where it is not clear what the paper says."""
    if "stated" in given:
        return findings.stated(given["stated"], Verdict(given["verdict"]))
    name, _, argument = given["check"].partition(" ")
    found = getattr(findings, name, None) or getattr(last_findings, name)
    check: Check = found(argument) if argument else found
    return (lambda numbers: _set(check, numbers, Verdict(given["verdict"]))) if "verdict" in given else check


def _set(check: Check, numbers: Numbers, verdict: Verdict) -> Finding:
    return Finding(check(numbers).text, verdict)


def _claim(given: Mapping[str, Any]) -> Claim:
    reasons = {
        Verdict(verdict): text
        for verdicts, text in given.get("reasons", {}).items()
        for verdict in verdicts.split(" | ")
    }
    return Claim(given["sentence"], given["source"], _check(given), reasons)


CLAIMS: Final = tuple(map(_claim, yaml.safe_load(Path(__file__).with_name("claims.yaml").read_text(encoding="utf-8"))))
