#!/usr/bin/env python3
"""tools/mutants.py: its lists, and a run over a small project where the outcome of each mutant is known. The lists of this
checkout must fit its sources."""
import contextlib
import io
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import mutants  # noqa: E402

for name in ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE"):  # set where a hook of git runs the tests
    os.environ.pop(name, None)

CMAKE = """cmake_minimum_required(VERSION 3.22)
project(small LANGUAGES C)
enable_testing()
add_library(omentum_objects OBJECT src/sum/sum_pair.c)
add_library(omentum_static STATIC $<TARGET_OBJECTS:omentum_objects>)
add_executable(omentum_cli main.c)
set_target_properties(omentum_cli PROPERTIES OUTPUT_NAME omentum RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
add_subdirectory(test/sum)
"""
TEST_CMAKE = """function(om_test name file)
    add_executable(${name} ${file})
    target_link_libraries(${name} PRIVATE omentum_static)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES LABELS "${ARGN}" ENVIRONMENT "WANTED=5;OTHER=1")
endfunction()
om_test(test_sum_pair test_sum_pair.c)
om_test(test_sum_slow test_sum_slow.c slow)
om_test(test_sum_broken test_sum_broken.c)
"""
SOURCE = """int sum_pair(int a, int b);
int sum_twice(int a);
int sum_thrice(int a);
int sum_pair(int a, int b) { return a + b; }
int sum_twice(int a) { return 2 * a; }
int sum_thrice(int a) { return 3 * a; }
"""
TEST = """#include <stdlib.h>
int sum_pair(int a, int b);
int main(void) { return sum_pair(2, 3) == atoi(getenv("WANTED")) ? 0 : 1; }
"""
SLOW = "int sum_twice(int a);\nint main(void) { return sum_twice(2) == 4 ? 0 : 1; }\n"
LIST = """# what is known of each
sum_pair.c: the difference
- return a + b;
+ return a - b;
tests: test_sum_pair

sum_pair.c: it never ends
- return a + b;
+ for (;;) a += b & 1 ? 1 : -1;
tests: test_sum_pair

sum_pair.c: only a slow test notices
- return 2 * a;
+ return 3 * a;

sum_pair.c: nobody notices
- return 3 * a;
+ return 4 * a;

sum_pair.c: the same
- return a + b;
+ return a + b + 0;

sum_pair.c: no C
- return a + b;
+ return a +;
"""


class Lists(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.root)

    def write(self, path, text):
        path = self.root / path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def main(self, *arguments):
        """Exit code and output."""
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            code = mutants.main(["--root", str(self.root), *arguments])
        return code, out.getvalue()

    def make(self, text):
        self.write("CMakeLists.txt", CMAKE)
        self.write("main.c", "int main(void) { return 0; }\n")
        self.write("src/sum/sum_pair.c", SOURCE)
        self.write("test/sum/CMakeLists.txt", TEST_CMAKE)
        self.write("test/sum/test_sum_pair.c", TEST)
        self.write("test/sum/test_sum_slow.c", SLOW)
        self.write("test/sum/test_sum_broken.c", "int main(void) { return 1; }\n")
        self.write("test/mutants/sum.txt", text)
        self.write(".gitignore", "/build/\n")

    def test_malformed_lists_name_their_line(self):
        for text, what in (("- a\n", "sum.txt:1: expected 'file.c: what is wrong'"),
                           ("a.c: x\n- a\n", "sum.txt:1: 'x' needs lines"),
                           ("a.c: x\n- a\n+ a\n", "sum.txt:1: 'x' changes nothing"),
                           ("a.c: x\n- a\n+ b\nwhy not\n", "sum.txt:4: expected '- '"), ("", "no mutants")):
            self.write("test/mutants/sum.txt", text)
            code, out = self.main("--check")
            self.assertEqual(code, 1)
            self.assertIn(what, out)

    def test_check_finds_what_is_stale(self):
        self.make(LIST)
        self.assertEqual(self.main("--check"), (0, "6 mutants fit their files\n"))
        self.write("src/sum/sum_pair.c", SOURCE.replace("3 * a", "a * 3"))
        code, out = self.main("--check")
        self.assertEqual((code, out.count("\n")), (1, 1))
        self.assertIn("'nobody notices': its text occurs 0 times", out)
        self.make(LIST.replace("- return a + b;", "- return").replace("test_sum_pair", "test_sum_gone"))
        code, out = self.main("--check")
        self.assertEqual(code, 1)
        self.assertIn("'the difference': its text occurs 3 times", out)
        self.assertIn("'the difference': no test 'test_sum_gone'", out)

    def test_run_over_a_small_project(self):
        self.make(LIST)
        subprocess.run(["git", "init", "-q", "."], cwd=self.root, check=True)
        before = (self.root / "src/sum/sum_pair.c").read_text()
        slack, mutants.SLACK = mutants.SLACK, 1
        self.addCleanup(setattr, mutants, "SLACK", slack)
        code, out = self.main()
        self.assertEqual(code, 1)
        for line in ("killed      sum_pair.c: the difference (test_sum_pair",
                     "killed      sum_pair.c: it never ends (test_sum_pair",
                     "killed      sum_pair.c: only a slow test notices (test_sum_slow",
                     "survived    sum_pair.c: nobody notices (2 tests", "equivalent  sum_pair.c: the same",
                     "unbuildable sum_pair.c: no C", "test_sum_broken fails without any mutant", "3 of 4 killed, 75.0 %",
                     "sum.txt:16: sum_pair.c: nobody notices: survived, and has no line 'survives: '"):
            self.assertIn(line, out)
        self.assertEqual((self.root / "src/sum/sum_pair.c").read_text(), before)
        self.assertFalse(list(self.root.glob("src/**/*.o")))

        # A second run finds all in its journal; a test that is new, or named now, runs what depends on it again.
        code, out = self.main()
        self.assertIn("6 mutants, 0 to run", out)
        self.write("test/mutants/sum.txt", LIST.replace("+ return 4 * a;\n", "+ return 4 * a;\ntests: test_sum_slow\n"))
        self.assertIn("1 mutants, 1 to run", self.main("--only", "nobody notices")[1])
        self.write("test/mutants/sum.txt", LIST)
        self.assertIn("1 mutants, 1 to run", self.main("--only", "nobody notices")[1])
        self.write("test/sum/test_sum_slow.c", SLOW.replace("== 4", "== 4 && 1"))
        code, out = self.main("--only", "slow test")
        self.assertIn("1 mutants, 1 to run", out)
        self.assertEqual(code, 0)
        self.assertEqual(self.main("--quick", "--only", "slow test", "--again")[0], 1)  # then nothing notices it
        self.assertEqual(self.main("--only", "slow test")[0], 0)  # and it is run with the slow ones again
        slow_named = LIST.replace("+ return 3 * a;\n", "+ return 3 * a;\ntests: test_sum_slow\n")
        self.write("test/mutants/sum.txt", slow_named)
        code, out = self.main("--quick", "--only", "slow test", "--again")
        self.assertIn("1 mutants were left out", out)
        self.assertNotIn("[1/1]", out)
        self.write("test/mutants/sum.txt", LIST)

        # A checkout that does not build is reported.
        self.write("main.c", "int main(void) { return nothing; }\n")
        code, out = self.main("--again")
        self.assertEqual(code, 1)
        self.assertIn("the checkout does not build", out)
        self.assertIn("6 mutants were not run", out)
        self.write("main.c", "int main(void) { return 0; }\n")

        # Python: the test of a package; a line that Python refuses.
        self.write("python/omentum/pair.py", "def twice(a):\n    return 2 * a\n\n\ndef thrice(a):\n    return 3 * a\n")
        self.write("python/tests/test_pair.py", "import sys\nsys.path.insert(0, 'python')\nfrom omentum import pair\n"
                   "sys.exit(pair.twice(2) != 4)\n")
        self.write("CMakeLists.txt", CMAKE + "add_test(NAME python_pair COMMAND python3 -B python/tests/test_pair.py\n"
                   "    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})\n")
        self.write("test/mutants/python.txt", "pair.py: a sum\n- 2 * a\n+ 3 * a\ntests: python_pair\n\n"
                   "pair.py: no product\n- 3 * a\n+ 4 * a\n\npair.py: no Python\n- return 3\n+ return return 3\n")
        self.assertEqual(self.main("--check"), (0, "9 mutants fit their files\n"))
        code, out = self.main("--room", "python")
        self.assertEqual(code, 1)
        for line in ("killed      pair.py: a sum (python_pair", "survived    pair.py: no product (1 tests",
                     "unbuildable pair.py: no Python (Python refuses it", "python          1 of    2 killed"):
            self.assertIn(line, out)
        self.assertIn("3 mutants, 0 to run", self.main("--room", "python")[1])
        self.write("python/tests/test_pair.py", "")  # the test of a result has changed
        self.assertIn("3 mutants, 2 to run", self.main("--room", "python")[1])
        self.write("python/tests/test_pair.py", "import sys\nsys.exit(77)\n")  # what it needs is missing
        self.assertIn("untested    pair.py: a sum (skipped here, or fails without a mutant: python_pair,", self.main("--room", "python")[1])
        (self.root / "test/mutants/python.txt").unlink()

        # A survivor with its reason is no fault; the table says it.
        self.write("test/sum/test_sum_slow.c", SLOW)
        self.assertIn("1 mutants, 1 to run", self.main("--only", "slow test")[1])
        text = LIST.replace("+ return 4 * a;", "+ return 4 * a;\nsurvives: nothing calls it")
        self.write("test/mutants/sum.txt", text[: text.index("sum_pair.c: no C")])
        self.assertEqual(self.main("--table", str(self.root / "table.md"))[0], 0)
        written = (self.root / "table.md").read_text()
        self.assertIn("| `sum_pair.c` | nobody notices | nothing calls it |", written)
        self.assertIn("| all | 4 | 3 (75.0 %) | 0 |", written)

        # Without the journal what the committed table has keeps its test, with a star.
        self.write("test/mutants/results.md", written)
        (self.root / "build/mutants/journal.jsonl").unlink()
        self.assertEqual(self.main("--table", str(self.root / "table.md"))[0], 0)
        written = (self.root / "table.md").read_text()
        self.assertIn("| sum | 3 | 3 | 3 |", written)
        self.assertIn("| `sum_pair.c` | the difference | `test_sum_pair` * |", written)
        self.assertIn("Without a result: 2.", written)


    def test_a_program_with_a_source_of_the_library(self):
        self.make("sum_pair.c: the difference\n- return a + b;\n+ return a - b;\ntests: test_sum_alone\n")
        self.write("test/sum/CMakeLists.txt",
                   "add_executable(test_sum_alone test_sum_pair.c ${PROJECT_SOURCE_DIR}/src/sum/sum_pair.c)\n"
                   "add_test(NAME test_sum_alone COMMAND test_sum_alone)\n"
                   "set_tests_properties(test_sum_alone PROPERTIES ENVIRONMENT WANTED=5)\n")
        subprocess.run(["git", "init", "-q", "."], cwd=self.root, check=True)
        code, out = self.main()
        self.assertIn("killed      sum_pair.c: the difference (test_sum_alone", out)
        self.assertEqual(code, 0)


class Checkout(unittest.TestCase):
    def test_a_part_of_a_file_is_a_test_of_that_file(self):
        class Tree:
            tests = dict.fromkeys(["test_sum_pair", "test_sum_pair_2", "test_sum_pair_all"], None)

        for name in Tree.tests:
            self.assertEqual(mutants.file_test(name), "test_sum_pair")
            Tree.tests[name] = type("Test", (), {"labels": {"slow"} if name.endswith("all") else set()})
        mutant = type("Mutant", (), {"tests": ("test_sum_pair",), "slow": True})
        self.assertEqual(mutants.room_tests(Tree, mutant, "sum", "named"), ["test_sum_pair", "test_sum_pair_2"])

    def test_the_test_that_killed_it_before_runs_first(self):
        class Tree:
            tests = {name: type("Test", (), {"labels": set()}) for name in ("test_sum_pair", "test_sum_all", "cli_sum")}

        mutant = type("Mutant", (), {"tests": ("test_sum_pair",), "slow": True})
        for first, names in (("cli_sum", ["cli_sum", "test_sum_pair", "test_sum_all"]),
                             ("test_gone", ["test_sum_pair", "test_sum_all", "cli_sum"])):
            self.assertEqual(mutants.room_tests(Tree, mutant, "sum", "quick", first), names)
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            self.assertEqual(mutants.earlier_killers(root, {}), {})
            lines = mutants.table([(mutants.Mutant("sum", 1, f"{c}.c", "is wrong", "1", "2", (), "", True),
                                    {"outcome": "killed", "detail": f"test_{c}", "is_earlier": c == "b"}) for c in "abc"])
            (root / "test/mutants").mkdir(parents=True)
            (root / "test/mutants/results.md").write_text(lines)
            rows = {"1": {"file": "a.c", "title": "is wrong", "outcome": "killed", "detail": "test_d"},
                    "2": {"file": "c.c", "title": "is wrong", "outcome": "survived", "detail": "3 tests"}}
            self.assertEqual(mutants.earlier_killers(root, rows), {("a.c", "is wrong"): "test_d",
                                                                   ("b.c", "is wrong"): "test_b",
                                                                   ("c.c", "is wrong"): "test_c"})

    def test_a_sample_has_the_smaller_one(self):
        every = [mutants.Mutant(room, 1, "a.c", str(i), "1", "2", (), "", True) for room, n in (("a", 40), ("b", 3))
                 for i in range(n)]
        few, more = mutants.draw(every, 5, 1), mutants.draw(every, 20, 1)
        self.assertEqual(([m.list for m in few], len(more)), (["a"] * 5 + ["b"] * 3, 23))
        self.assertLess(set(few), set(more))
        self.assertEqual(few, [m for m in every if m in few])
        self.assertNotEqual(few, mutants.draw(every, 5, 2))
        self.assertNotEqual(few[:5], every[:5])

    def test_the_lists_fit_the_sources(self):
        self.maxDiff = None
        self.assertEqual(mutants.check(ROOT, mutants.read_lists(ROOT)), [])


if __name__ == "__main__":
    unittest.main()
