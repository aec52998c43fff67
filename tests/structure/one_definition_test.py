"""Classes that two files define in one namespace are found; classes that only look alike are not."""

import pathlib
import tempfile
import unittest

from one_definition import classes_of, duplicates


class OneDefinition(unittest.TestCase):
    def test_classes_of_named_namespaces_are_listed(self):
        text = """namespace surflect::hull {
        struct Ball { double radius; struct Inner {}; };
        template <class T> class Grid final : public Base<T> {};
        enum class Region { outside, inside };
        namespace { struct Hidden {}; }
        struct Grid<int>::Scene {};
        class Later;
        void f() { struct Local {}; }
        } // namespace surflect::hull
        """
        self.assertEqual(classes_of(text), ["surflect::hull::Ball", "surflect::hull::Grid", "surflect::hull::Region"])

    def test_comments_and_strings_are_not_code(self):
        self.assertEqual(classes_of('namespace a {\n// struct B {\nconst char* c = "struct D {";\n}'), [])

    def test_only_equal_names_in_equal_namespaces_are_duplicates(self):
        sources = {"surfel/a.h": "namespace s { struct A {}; }", "warp/a.h": "namespace s { struct A {}; }",
                   "warp/b.h": "namespace s::w { struct A {}; }", "apps/c.cpp": "namespace s { namespace { struct A {}; } }"}
        with tempfile.TemporaryDirectory() as folder:
            for name, text in sources.items():
                path = pathlib.Path(folder, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            self.assertEqual(duplicates(pathlib.Path(folder)), ["s::A: surfel/a.h, warp/a.h"])


if __name__ == "__main__":
    unittest.main()
