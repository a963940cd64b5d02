"""What the paper says, tested: statistics, rules for verdicts, claims with their reasons, page and figures.

`python docs/paper_claims.py` is the command.
"""
