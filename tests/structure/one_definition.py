"""No two files define a class of one name in one namespace, which a linker would merge without a word.

    one_definition.py SOURCE_ROOT

Prints each such name with its files; exits with 1 if there is any. Names in unnamed namespaces, and of classes inside
functions or other classes, are free. A file of tests or of a program may be linked with any library, so all are compared.
"""

import collections
import pathlib
import re
import sys

TOKEN = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\''
                   r'|^[ \t]*#(?:[^\n\\]|\\\n|\\.)*|[A-Za-z_]\w*|::|\s+|.', re.DOTALL | re.MULTILINE)
NAMESPACE = re.compile(r"(?:inline )?namespace ?((?:\w+(?: :: )?)*) ?$")
CLASS = re.compile(r"(?:^|.* )(?:class|struct|union|enum class|enum struct|enum)(?: \[ \[ .*? \] \])?"
                   r" (\w+)(?: final)?(?: : .*)?$")


def tokens_of(text):
    return [t[0] for t in TOKEN.finditer(text)
            if not t[0].isspace() and not t[0].startswith(("//", "/*", '"', "'", 'R"')) and not t[0].lstrip().startswith("#")]


def classes_of(text):
    """The qualified names of the classes that a source defines in named namespaces."""
    found = []
    scopes = []  # of each open brace: a namespace's name, "" for an unnamed one, None for any other
    statement = []
    for token in tokens_of(text):
        if token in ";}":
            statement = []
            if token == "}" and scopes:
                scopes.pop()
        elif token == "{":
            opening = " ".join(statement)
            statement = []
            namespace = NAMESPACE.match(opening)
            defined = CLASS.match(opening)
            if namespace:
                scopes.append(namespace[1].replace(" ", ""))
                continue
            isTemplateCase = "template < >" in opening
            if defined and "(" not in opening and not isTemplateCase and all(scopes):
                found.append("::".join(scopes + [defined[1]]))
            scopes.append(None)
        else:
            statement.append(token)
    return found


def duplicates(root):
    places = collections.defaultdict(set)
    for top in ("surfel", "srf", "warp", "render", "apps", "tests", "bench"):
        for path in (root / top).rglob("*"):
            if path.suffix in (".h", ".cpp"):
                for name in classes_of(path.read_text()):
                    places[name].add(path.relative_to(root).as_posix())
    return [f"{name}: {', '.join(sorted(files))}" for name, files in sorted(places.items()) if len(files) > 1]


if __name__ == "__main__":
    found = duplicates(pathlib.Path(sys.argv[1]))
    print("\n".join(found) or "no class is defined twice")
    sys.exit(1 if found else 0)
