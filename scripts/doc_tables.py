"""Tables of docs/, which stand between the comments <!-- NAME --> and <!-- end --> of a page.

Programs write complete tables, most of them into docs/results/. A page shows a part: a summary, which summarize() makes of
the complete table alone.
"""
import pathlib
import re
import sys

DOCS = pathlib.Path(__file__).resolve().parent.parent / "docs"


def place(name):
    """Matches a table with its comments; group 2 is the table."""
    return re.compile(rf"(<!-- {re.escape(name)} -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def page_of(name, docs=DOCS):
    """The one page that has a comment <!-- NAME -->."""
    pages = [page for page in sorted(docs.rglob("*.md")) if place(name).search(page.read_text())]
    if len(pages) != 1:
        sys.exit(f"docs/: {len(pages)} pages have <!-- {name} --> and <!-- end -->, expected 1")
    return pages[0]


def replace(name, content, docs=DOCS):
    """Replaces what stands between the comments of a page."""
    page = page_of(name, docs)
    page.write_text(place(name).sub(lambda match: match[1] + content + match[3], page.read_text()))


def table(head, rows):
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "".join("| " + " | ".join(map(str, line)) + " |\n" for line in lines)


def cells(line):
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def read(name, docs=DOCS):
    """Head and rows of a table of the pages."""
    lines = [line for line in place(name).search(page_of(name, docs).read_text())[2].splitlines() if line.startswith("|")]
    return cells(lines[0]), [cells(line) for line in lines[2:]]


def first(cell):
    """The first figure of a cell that holds several."""
    return cell.split(",")[0]


def columns(head, rows, kept):
    """The table with the columns `kept` alone, in their order."""
    return [head[i] for i in kept], [[row[i] for i in kept] for row in rows]


def pivot(rows, row, column, cell):
    """A table with a row for each value of row(r) and a column for each of column(r), in the order of their first ones."""
    found = {}
    for r in rows:
        found.setdefault(row(r), {})[column(r)] = cell(r)
    across = list(dict.fromkeys(name for line in found.values() for name in line))
    return across, [[name, *(line.get(other, "") for other in across)] for name, line in found.items()]


def summarize(summaries, docs=DOCS):
    """Writes each <!-- NAME summary --> from the table NAME; summaries: functions from head and rows to head and rows."""
    for name, summary in summaries.items():
        replace(f"{name} summary", table(*summary(*read(name, docs))), docs)
