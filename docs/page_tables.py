"""Tables that scripts write into pages of the documentation."""

from collections.abc import Mapping


def with_tables(text: str, tables: Mapping[str, str]) -> str:
    """A page with these tables between its markers ``<!-- NAME -->`` and ``<!-- end of NAME -->``.

    Raises:
        ValueError: the page lacks a marker.
    """
    for name, table in tables.items():
        begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        if text.count(begin) != 1 or text.count(end) != 1:
            raise ValueError(f"the page needs {begin} and {end} once each")
        before, rest = text.split(begin)
        text = f"{before}{begin}\n\n{table}\n\n{end}{rest.split(end)[1]}"
    return text
