"""The table of fields does not depend on what was imported before."""

import subprocess
import sys

from warpchain.inputs.fields import FIELDS, SECTION_OF


def test_the_table_of_fields_is_whole_wherever_it_is_imported() -> None:
    """In a process that imports nothing else it has the fields of all sections."""
    program = (
        "from warpchain.inputs.fields import FIELDS, by_section\nprint(*FIELDS, by_section({'links': 60})['scene'])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert (done.stdout, done.stderr) == (f"{' '.join(FIELDS)} {{'links': 60}}\n", "")
    assert FIELDS.keys() == SECTION_OF.keys() and len(FIELDS) > 70
