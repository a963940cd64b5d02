"""Prints all numbers of studies/waves/README.md and draws its figures, in a minute.

    python -m studies.waves.run

The theory is in dispersion.py, what is computed of the frames of a walk in fields.py.
"""

from studies.waves import rings, walks

if __name__ == "__main__":
    rings.main()
    walks.main()
