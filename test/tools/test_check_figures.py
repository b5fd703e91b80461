#!/usr/bin/env python3
"""tools/check_figures.py on small histories: old, unchanged and unmarked figures, wrong markers, no git, a shallow clone."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import check_figures  # noqa: E402

ENV = dict(os.environ, GIT_AUTHOR_NAME="t", GIT_AUTHOR_EMAIL="t@t", GIT_COMMITTER_NAME="t", GIT_COMMITTER_EMAIL="t@t",
           GIT_CONFIG_GLOBAL=os.devnull, GIT_CONFIG_SYSTEM=os.devnull)
for name in ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE"):  # set where a hook of git runs the tests
    ENV.pop(name, None)
    os.environ.pop(name, None)


class Folder(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.root)
        for path in ("src/fem/a.c", "src/solve/b.c"):
            self.write(path, "1\n")

    def write(self, path, text):
        path = self.root / path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def check(self, text, is_all=False, root=None):
        """The errors and the list for a document."""
        figures = check_figures.Figures(root or self.root)
        (figures.root / "doc.md").write_text(text)
        figures.read("doc.md")
        lines = "\n".join(check_figures.report(figures, is_all))
        return figures.errors, lines


@unittest.skipUnless(shutil.which("git"), "git is not installed")
class History(Folder):
    def git(self, *args):
        run = subprocess.run(["git", "-C", self.root, *args], env=ENV, capture_output=True, text=True, check=True)
        return run.stdout.strip()

    def commit(self, subject):
        self.git("add", "-A")
        self.git("commit", "-q", "-m", subject)
        return self.git("rev-parse", "--short=7", "HEAD")

    def setUp(self):
        super().setUp()
        self.git("init", "-q")
        self.first = self.commit("first")
        self.write("src/fem/a.c", "2\n")
        self.second = self.commit("fem: faster")

    def marker(self, commit, code="src/fem"):
        return f"<!-- measured: {commit} by: bench fem --runs 3 code: {code} -->"

    def test_code_has_changed(self):
        errors, text = self.check(f"# Measured\n\n{self.marker(self.first)}\n\nA step takes 3 ms.\n")
        self.assertEqual(errors, [])
        self.assertIn(f"measured at {self.first} by: bench fem --runs 3", text)
        self.assertIn(f"src/fem: 1 commits since, the last {self.second} fem: faster", text)
        self.assertIn("1 markers, the code of 1 has changed; 0 blocks", text)

    def test_code_has_not_changed(self):
        for commit, code in ((self.second, "src/fem"), (self.first, "src/solve")):
            document = f"{self.marker(commit, code)}\n\nA step takes 3 ms.\n"
            errors, text = self.check(document)
            self.assertEqual((errors, text), ([], "1 markers, the code of 0 has changed; 0 blocks with figures but no "
                                              "marker; 0 errors"))
            self.assertIn("no change since", self.check(document, is_all=True)[1])

    def test_marker_of_several_lines(self):
        marker = self.marker(self.first).replace(" by:", "\n     by:").replace(" code:", "\n     code:")
        errors, text = self.check(f"# Measured\n\n{marker}\n\nA step takes 3 ms.\n")
        self.assertEqual(errors, [])
        self.assertIn(f"measured at {self.first} by: bench fem --runs 3\n", text)
        self.assertIn("1 markers, the code of 1 has changed; 0 blocks", text)
        errors, _ = self.check(f"\n{marker.replace('code:', 'kode:')}\n\nA step takes 3 ms.\n")
        self.assertEqual(len(errors), 1)
        self.assertIn("doc.md:2: ", errors[0])

    def test_copied_block(self):
        block = "<!-- figures: copied -->\n| a step | 3 ms |\n"
        self.assertIn("0 blocks with figures but no marker", self.check(f"# Measured\n\n{block}")[1])
        self.assertIn("1 blocks with figures but no marker", self.check(f"# Measured\n\n{block.split(chr(10), 1)[1]}")[1])

    def test_same_bytes_at_a_later_commit(self):
        document = f"<!-- measured: {self.first} same: {self.second} by: bench code: src/fem -->\n\n3 ms\n"
        errors, text = self.check(document, is_all=True)
        self.assertEqual(errors, [])
        self.assertIn(f"measured at {self.first}, the same bytes at {self.second}, by: bench", text)
        self.assertIn("no change since", text)
        errors, _ = self.check(document.replace(self.second, "0123abc"))
        self.assertEqual(errors, ["doc.md:1: commit 0123abc is not in the history"])

    def test_a_marker_ends_at_the_next_heading(self):
        _, text = self.check(f"{self.marker(self.second)}\n\n3 ms\n\n| a | 4 ms |\n\n# Next\n\n5 ms\n")
        self.assertIn("doc.md:9: no marker: 5 ms", text)
        self.assertIn("1 blocks with figures but no marker", text)

    def test_a_row_has_its_own(self):
        _, text = self.check("# Speed\n\n| a | 3 ms |\n" + f"| b | 4 ms {self.marker(self.first)} |\n| c | 5 |\n")
        self.assertIn("doc.md:4: b\n    measured at", text)
        self.assertIn("2 blocks with figures but no marker", text)

    def test_unknown_commit(self):
        self.git("checkout", "-q", "-b", "other", self.first)
        self.write("src/fem/a.c", "3\n")
        other = self.commit("never merged")
        self.git("checkout", "-q", "-")
        for commit in ("0123abc", other):
            errors, _ = self.check(self.marker(commit) + "\n\n3 ms\n")
            self.assertEqual(errors, [f"doc.md:1: commit {commit} is not in the history"])

    def test_shallow_clone(self):
        clone = self.root / "clone"
        self.git("clone", "-q", "--depth", "1", self.root.as_uri(), str(clone))
        errors, text = self.check(self.marker(self.first) + "\n\n3 ms\n", root=clone)
        self.assertEqual(errors, [])
        self.assertIn("the clone is shallow", text)


class Form(Folder):
    def assert_error(self, text, why):
        errors, _ = self.check(text)
        self.assertEqual(len(errors), 1, errors)
        self.assertIn(why, errors[0])

    def test_no_git(self):
        errors, text = self.check("<!-- measured: 0123abc by: bench code: src/fem src/solve/b.c -->\n\n3 ms\n")
        self.assertEqual(errors, [])
        self.assertIn("no git checkout", text)

    def test_malformed(self):
        for comment in ("measured 0123abc", "measured: x by: bench code: src/fem", "measured: 0123abc code: src/fem",
                        "measured: 0123abc by: bench", "measured: 0123abc by: bench code:", "not measured: 3"):
            self.assert_error(f"<!-- {comment} -->\n\n3 ms\n", "not of the form")
            self.assert_error(f"| 3 ms <!-- {comment} --> |\n", "not of the form")

    def test_unknown_path(self):
        self.assert_error("<!-- measured: 0123abc by: bench code: src/fem src/gone -->\n", "src/gone does not exist")

    def test_marker_inside_a_paragraph(self):
        self.assert_error("It takes 3 ms <!-- measured: 0123abc by: bench code: src/fem -->\n", "stands alone")

    def test_other_comments(self):
        self.assertEqual(self.check("<!-- a note -->\n\ntext\n")[0], [])

    def test_which_blocks_have_figures(self):
        for text, number in (("20 ms", 1), ("3.5 us", 1), ("5 times faster", 1), ("20 mm", 0), ("no number", 0),
                             ("# Measured\n\n20 mm", 1), ("# Measured\n\nno number", 0), ("# Use\n\n20 mm", 0),
                             ("Measured (by hand):\n\n| 20 mm | 3 |", 1), ("- 20 ms\n- 3 s\n- 30 ms", 2),
                             ("    code: 20 ms", 0), ("```\n20 ms\n```", 0), ("<!-- not measured -->\n\n20 ms", 0)):
            _, lines = self.check(text + "\n")
            self.assertIn(f"; {number} blocks with figures but no marker", lines, text)


class Tree(unittest.TestCase):
    def test_documents_of_this_checkout(self):
        """Markers of the documents are well-formed, and name commits and paths that exist."""
        run = subprocess.run([sys.executable, "-B", ROOT / "tools" / "check_figures.py"], capture_output=True, text=True,
                             check=False)
        self.assertEqual(run.returncode, 0, run.stderr)

    def test_usage(self):
        run = subprocess.run([sys.executable, "-B", ROOT / "tools" / "check_figures.py", "--what"], capture_output=True,
                             text=True, check=False)
        self.assertEqual(run.returncode, 2)
        self.assertIn("check_figures.py [--all] [FILE ...]", run.stderr)


if __name__ == "__main__":
    unittest.main()
