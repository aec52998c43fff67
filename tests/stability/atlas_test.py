"""Runs the failure atlas, and compares its entries with those of docs/results/stability.md.

    atlas_test.py STABILITY PAGE

Inputs, expectations and bounds must be those of the page; figures may differ between machines. Prints what differs; exits
with 1 if anything does or if an entry is out of bounds.
"""

import pathlib
import subprocess
import sys


def entries(text):
    """Input, expectation, figure's name and bound of each row."""
    rows = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in text.splitlines() if line.startswith("| ")]
    return [(row[0], row[1], row[2], row[-1]) for row in rows if len(row) == 6 and row[0] != "input"]


def main(stability, page):
    run = subprocess.run([stability, "--markdown"], stdout=subprocess.PIPE, text=True)
    if run.returncode != 0:
        subprocess.run([stability])
        return 1
    ours = entries(run.stdout)
    text = pathlib.Path(page).read_text()
    theirs = entries(text[text.index("<!-- atlas -->"):text.index("<!-- end -->")])
    for mark, rows in (("only in the program", set(ours) - set(theirs)), ("only on the page", set(theirs) - set(ours))):
        for row in sorted(rows):
            print(f"{mark}: {' | '.join(row)}")
    if ours != theirs or not ours:
        print(f"{page}: run scripts/stability --frames 0")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
