#!/usr/bin/env python3
"""Each rule of tools/check_tree.py meets a tree that breaks it, and a tree that keeps it."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import check_tree  # noqa: E402

CLEAN = {
    "CMakeLists.txt": "set(OM_ROOMS base math shape tissue fem scene)\n",
    "include/omentum/base.h": "#include <stdio.h>\nint om_base(void);\n",
    "include/omentum/vec.h": '#include "omentum/base.h"\n',
    "include/omentum/shape_sdf.h": '#include "omentum/base.h"\n',
    "src/base/base_alloc.c": "void* om_alloc(int n) {\n    return malloc(n);\n}\n",
    "src/shape/shape_sdf.c": '#include <yaml.h>\n#include "omentum/shape_sdf.h"\n',
    "src/fem/fem_internal.h": '#include "omentum/tissue.h"\n',
    "src/fem/fem_step.c": '#include "fem/fem_internal.h"\n#include "omentum/shape_sdf.h"\n',
    "src/cli/cli_main.c": '#include "omentum/omentum.h"\nint main(void) {\n    printf("x");\n}\n',
    "test/fem/test_fem_step.c": "int main(void) {\n    return 0;\n}\n",
}


class Rules(unittest.TestCase):
    def check(self, changes):
        """The errors of the clean tree with some files changed, added, or (None) left out."""
        with tempfile.TemporaryDirectory() as root:
            for name, text in {**CLEAN, **changes}.items():
                path = pathlib.Path(root, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            self.tree = check_tree.Tree(root)
            self.tree.check()
            return self.tree.errors

    def assert_breaks(self, changes, where, why):
        errors = self.check(changes)
        self.assertEqual(len(errors), 1, errors)
        self.assertIn(where, errors[0])
        self.assertIn(why, errors[0])

    def test_clean(self):
        self.assertEqual(self.check({}), [])

    def test_head(self):
        for name, lines in (("src/fem/fem_a.c", 25), ("src/fem/fem_a.h", 26)):
            self.assertEqual(self.check({name: "// a\n" * lines + "int a;\n"}), [])
        self.assert_breaks({"src/fem/fem_a.c": "// a\n" * 26 + "int a;\n"}, "fem_a.c:1", "the head has 26 lines")
        self.assert_breaks({"test/fem/test_fem_a.c": "// a\n" * 26}, "test_fem_a.c:1", "the head has 26 lines")

    def test_case_in_a_comment(self):
        self.assert_breaks({"src/fem/fem_a.c": "int a;\n// held in pair 1057\n"}, "fem_a.c:2", "pair 1057")
        self.assert_breaks({"include/omentum/fem.h": "int a;  // as on layout 11\n"}, "fem.h:1", "layout 11")
        self.assertEqual(self.check({"src/fem/fem_a.c": "int pair(int a);  // a pair of 2 layouts\n",
                                     "test/fem/test_fem_a.c": "// pair 1057\n"}), [])

    def test_changelog(self):
        head = "# Changelog\n\n## 0.2.0, not yet released\n\n"
        self.assertEqual(self.check({"CHANGELOG.md": head + "- a\n" * 40 + "\n## 0.1.0\n\n" + "- b\n" * 50}), [])
        self.assert_breaks({"CHANGELOG.md": head + "- a\n" * 41}, "CHANGELOG.md", "41 lines")

    def test_long_line_of_a_page(self):
        for page in ("README.md", "doc/fem.md", "doc/notes/fem.md", "weights/README.md"):
            self.assert_breaks({page: "a\n" + "b" * 200 + "\n"}, f"{page}:2", "200 characters")
        self.assertEqual(self.check({"doc/fem.md": "b" * 199 + "\n", "test/mutants/results.md": "b" * 300}), [])

    def test_arrow_up(self):
        self.assert_breaks({"src/shape/shape_a.c": 'int a;\n#include "omentum/scene_yaml.h"\n'},
                           "src/shape/shape_a.c:2", "shape (floor 1) uses scene (floor 4)")

    def test_arrow_up_in_a_public_header(self):
        self.assert_breaks({"include/omentum/shape_a.h": '#include "omentum/tissue.h"\n'},
                           "include/omentum/shape_a.h:1", "runs up")

    def test_same_floor(self):
        self.assert_breaks({"src/fem/fem_a.c": '#include "omentum/robot.h"\n'}, "fem_a.c:1", "same floor 2")
        self.assert_breaks({"src/tissue/tissue_a.c": '#include "omentum/fem.h"\n'}, "tissue_a.c:1", "same floor 2")

    def test_private_header_of_another_room(self):
        self.assert_breaks({"src/scene/scene_a.c": '#include "fem/fem_internal.h"\n'}, "scene_a.c:1", "private")

    def test_engines_see_their_interface(self):
        engine = '#include "tissue/tissue_internal.h"\n'
        self.assert_breaks({"src/scene/scene_a.c": engine}, "scene_a.c:1", "private")
        self.assertEqual(self.check({"src/fem/fem_a.c": engine}), [])

    def test_program_uses_public_headers(self):
        self.assert_breaks({"src/cli/cli_a.c": '#include "fem/fem_internal.h"\n'}, "cli_a.c:1", "public headers only")

    def test_studies_use_public_headers(self):
        own = {"studies/study_a.h": "", "studies/study_a.c": '#include "studies/study_a.h"\n#include "omentum/shape_sdf.h"\n',
               "src/cli/cli_a.c": '#include "studies/study_a.h"\n'}
        self.assertEqual(self.check(own), [])
        for name in ("fem/fem_internal.h", "base/base_rng.h"):
            self.assert_breaks({"studies/study_a.c": f'#include "{name}"\n'}, "study_a.c:1", "public headers only")
        self.assert_breaks({"studies/study_a.c": '#include "omentum/omentum.h"\n'}, "study_a.c:1", "for users")

    def test_studies_are_for_the_program(self):
        for path in ("src/fem/fem_a.c", "include/omentum/fem.h"):
            self.assert_breaks({path: '#include "studies/study_a.h"\n'}, f"{path}:1", "private to room studies")

    def test_names_of_studies(self):
        self.assert_breaks({"studies/contact.c": ""}, "studies/contact.c", "study_topic")
        self.assert_breaks({"test/study/test_fem_b.c": ""}, "test_fem_b.c", "test_study")

    def test_everything_at_once_is_for_users(self):
        self.assert_breaks({"src/fem/fem_a.c": '#include "omentum/omentum.h"\n'}, "fem_a.c:1", "for users")

    def test_everything_header_has_everything(self):
        three = ["base.h", "vec.h", "shape_sdf.h"]
        page = "".join(f'#include "omentum/{name}"\n' for name in three)
        self.assertEqual(self.check({"include/omentum/omentum.h": page}), [])
        self.assert_breaks({"include/omentum/omentum.h": page, "include/omentum/tissue.h": ""},
                           "omentum.h", "tissue.h is missing")

    def test_statuses_are_documented(self):
        good = "/// Open it.\n/// @return OM_OK\nOM_API OmStatus om_fem_open(int a,\n    int b);\n"
        self.assertEqual(self.check({"include/omentum/fem.h": good}), [])
        self.assert_breaks({"include/omentum/fem.h": good.replace("@return", "gives")}, "fem.h:3", "om_fem_open has no @return")
        self.assert_breaks({"include/omentum/fem.h": good + "OM_API OmStatus om_fem_shut(void);\n"}, "fem.h:5", "om_fem_shut")

    def test_include_without_its_folder(self):
        self.assert_breaks({"src/fem/fem_a.c": '#include "shape_internal.h"\n'}, "fem_a.c:1", "write the folder")
        self.assertEqual(self.check({"src/fem/fem_a.c": '#include "fem_internal.h"\n'}), [])

    def test_unknown_room(self):
        errors = self.check({"src/magic/magic_a.c": "int a;\n"})
        self.assertTrue(any("no floor" in e for e in errors), errors)
        self.assertTrue(any("not in OM_ROOMS" in e for e in errors), errors)

    def test_third_party_header_twice(self):
        self.assert_breaks({"src/shape/shape_a.c": "#include <yaml.h>\n"}, "shape_a.c", "included by 2 files")

    def test_third_party_header_in_a_header(self):
        self.assert_breaks({"include/omentum/fem.h": "#include <cholmod.h>\n"}, "fem.h", "bind it in one .c file")

    def test_third_party_header_once_in_each_room(self):
        self.assertEqual(self.check({"src/scene/scene_a.c": "#include <yaml.h>\n"}), [])

    def test_order_of_rooms(self):
        self.assert_breaks({"CMakeLists.txt": "set(OM_ROOMS base shape math tissue fem scene)\n"},
                           "CMakeLists.txt", "shape before math")

    def test_places(self):
        for text, what in [("int a(void) {\n    printf(\"x\");\n}\n", "printing"),
                           ("int a(void) {\n    fprintf(stderr, \"x\");\n}\n", "printing"),
                           ("int a(void) {\n    exit(1);\n}\n", "ending"),
                           ("int a(void) {\n    longjmp(b, 1);\n}\n", "longjmp"),
                           ("void* a(void) {\n    return malloc(1);\n}\n", "allocation"),
                           ("int a(void) {\n#pragma omp parallel\n}\n", "threads")]:
            self.assert_breaks({"src/fem/fem_a.c": text}, "fem_a.c:2", what)

    def test_places_in_comments_and_strings(self):
        text = "// printf(\"x\")\n/* exit(1);\n malloc(2) */\nconst char* a = \"abort()\";\n" \
               "int b(void) {\n    return snprintf(0, 0, \"x\");\n}\n"
        self.assertEqual(self.check({"src/fem/fem_a.c": text}), [])

    def test_function_length(self):
        def function(lines):
            return "static int a;\n\nint long_one(int x,\n             int y) {\n" + \
                "    a = '{';\n" * (lines - 3) + "}\n\nint next(void) {\n}\n"
        self.assertEqual(self.check({"src/fem/fem_a.c": function(100)}), [])
        self.assertEqual(self.tree.warnings, [])
        self.assertEqual(self.check({"src/fem/fem_a.c": function(150)}), [])
        self.assertIn("src/fem/fem_a.c:3: long_one has 150 lines", self.tree.warnings[0])
        self.assert_breaks({"src/fem/fem_a.c": function(151)}, "fem_a.c:3", "long_one has 151 lines")

    def test_tables_are_not_functions(self):
        text = "static const struct {\n    int a;\n} table[] = {\n" + "    {1},\n" * 300 + "};\n" \
               "typedef struct A {\n" + "    int (*f)(int);\n" * 200 + "} A;\n"
        self.assertEqual(self.check({"src/fem/fem_a.c": text}), [])

    def test_file_length(self):
        self.assert_breaks({"src/fem/fem_a.c": "\n" * 1001}, "fem_a.c", "1001 lines")
        self.assert_breaks({"include/omentum/fem.h": "\n" * 601}, "fem.h", "601 lines")
        self.assert_breaks({"samples/01_box.c": "\n" * 151}, "01_box.c", "151 lines")

    def test_width(self):
        self.assert_breaks({"src/fem/fem_a.c": "// " + "x" * 118 + "\n"}, "fem_a.c:1", "121 columns")

    def test_links(self):
        page = "[a](doc/a.md), [b](https://x.org/y), [c](d)\n```\n[e](f.md)\n```\n"
        self.assertEqual(self.check({"README.md": "[a](doc/a.md#the-top), `[b](c)`\n", "doc/a.md": "## The top!\n[up](../README.md)\n"}), [])
        self.assert_breaks({"README.md": "\n[a](doc/b.md)\n", "doc/a.md": ""}, "README.md:2", "leads nowhere")
        self.assert_breaks({"README.md": page, "doc/a.md": ""}, "README.md:1", "the link to d leads nowhere")
        self.assert_breaks({"doc/notes/a.md": "![a](b.png)\n"}, "doc/notes/a.md:1", "b.png leads nowhere")

    def test_links_to_headings(self):
        page = "# One\n## Two `a_b`, [c](#one)\n## One\n```\n# three\n```\n"
        links = "[a](doc/a.md#one) [b](doc/a.md#one-1) [c](doc/a.md#two-a_b-c)\n"
        self.assertEqual(self.check({"README.md": links, "doc/a.md": page}), [])
        for wrong in ("three", "one-2", "Two"):
            self.assert_breaks({"README.md": f"[a](doc/a.md#{wrong})\n", "doc/a.md": page}, "README.md:1", "leads to no heading")

    def test_links_of_notebooks(self):
        cell = '{"cells": [{"cell_type": "KIND", "source": ["a\\n", "[b](c.ipynb)"]}]}'
        self.assert_breaks({"python/notebooks/a.ipynb": cell.replace("KIND", "markdown")}, "a.ipynb:2", "c.ipynb leads nowhere")
        self.assertEqual(self.check({"python/notebooks/a.ipynb": cell.replace("KIND", "code")}), [])

    def test_comments_do_not_split_declarations(self):
        self.assert_breaks({"src/fem/fem_a.c": "int a;\ndouble\n    b;  // long\n"}, "fem_a.c:2", "splits this declaration")
        self.assert_breaks({"src/fem/fem_a.c": "int a,\n    b;  // long\n"}, "fem_a.c:1", "splits this declaration")
        self.assert_breaks({"src/fem/fem_a.c": "a =\n    2;  // long\n"}, "fem_a.c:1", "splits this declaration")
        self.assertEqual(self.check({"src/fem/fem_a.c": "// above\ndouble b;\nelse\n    f();  // short\ng(a,\n  b);  // c\n"}), [])

    def test_plain_words(self):
        self.assert_breaks({"src/fem/fem_a.c": "int a;  // whoever reads it\n"}, "fem_a.c:1", '"whoever"')
        self.assert_breaks({"doc/a.md": "\nThe step goes on.\n"}, "doc/a.md:2", '"goes on"')
        self.assert_breaks({"test/fem/test_fem_a.c": "// left as it was\n"}, "test_fem_a.c:1", '"as it was"')
        self.assertEqual(self.check({"src/fem/fem_a.c": 'int nobody;  // the step continues\n'}), [])

    def test_large_files(self):
        self.assert_breaks({"doc/a.bin": "x" * 1000001}, "doc/a.bin", "1000001 bytes")
        self.assertEqual(self.check({"doc/a.bin": "x" * 1000000, "weights/a.bin": "x" * 1000001, "build/a.bin": "x" * 1000001}), [])

    def test_caches(self):
        for folder in ("python/.mypy_cache/3.11", ".pytest_cache", "tools/__pycache__", "python/omentum.egg-info"):
            self.assert_breaks({f"{folder}/a": ""}, f"{folder}/a", "cache is tracked")
        self.assertEqual(self.check({"doc/cache.md": "", "test/cache/a.txt": ""}), [])

    def test_git_says_what_is_tracked(self):
        with tempfile.TemporaryDirectory() as root:
            for name in ("kept", "left"):
                pathlib.Path(root, name).write_text("x" * 1000001)
            pathlib.Path(root, "__pycache__").mkdir()
            pathlib.Path(root, "__pycache__/a.pyc").touch()
            git = ["git", "-C", root]
            subprocess.run([*git, "init", "-q"], check=True)
            subprocess.run([*git, "add", "kept"], check=True)
            tree = check_tree.Tree(root)
            tree.check_ballast()
            self.assertEqual(tree.errors, ["kept: 1000001 bytes; the limit is 1000000 outside weights/"])

    def test_unique_names(self):
        self.assert_breaks({"bench/fem_step.c": ""}, "fem_step.c", "unique")

    def test_names_say_the_room(self):
        self.assert_breaks({"src/fem/energy.c": ""}, "src/fem/energy.c", "fem_topic")
        self.assert_breaks({"test/fem/test_energy.c": ""}, "test/fem/test_energy.c", "test_fem_topic")


if __name__ == "__main__":
    unittest.main()
