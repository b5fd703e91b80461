#!/usr/bin/env python3
"""tools/readme_figures.py on small pages, and on the pages of this checkout."""
import contextlib
import io
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import readme_figures  # noqa: E402

FIGURES = """# Measured

### A step

<!-- measured: 1dcd819 by: bench code: src -->
<!-- readme -->

- **omentum**: 3 ms on one
  core
- **compared with**: another program: 5 ms
- **command**: `make bench`

### A figure of this page alone

- **omentum**: 7 ms

### A long title of a plan

<!-- readme: A plan -->

- **omentum**: 9 ms
"""
README = "# a\n\n<!-- figures: begin; old -->\n| what |\n<!-- figures: end -->\n\nafter\n"


class Copies(unittest.TestCase):
    def run_tool(self, figures, readme, *args):
        """Exit code, messages and README.md afterwards."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "doc").mkdir()
            (root / "doc/figures.md").write_text(figures)
            (root / "README.md").write_text(readme)
            out = io.StringIO()
            with contextlib.redirect_stderr(out):
                code = readme_figures.main(list(args), root)
            return code, out.getvalue(), (root / "README.md").read_text()

    def test_rows(self):
        code, _, text = self.run_tool(FIGURES, README)
        self.assertEqual(code, 0)
        self.assertEqual(text, f"""# a

{readme_figures.NOTE}

| what | omentum | compared with |
|---|---|---|
| A step | 3 ms on one core | another program: 5 ms |
| A plan | 9 ms |  |

<!-- figures: end -->

after
""")
        self.assertEqual(self.run_tool(FIGURES, text, "--check"), (0, "", text))

    def test_check_notices_a_changed_figure(self):
        _, _, text = self.run_tool(FIGURES, README)
        code, message, after = self.run_tool(FIGURES.replace("9 ms", "8 ms"), text, "--check")
        self.assertEqual((code, after), (1, text))
        self.assertIn("run tools/readme_figures.py", message)

    def test_errors_leave_the_page(self):
        for figures, readme, why in ((FIGURES, "# a\n", "README.md: no"),
                                     (FIGURES, README.replace("end", "fin"), "README.md: no"),
                                     (FIGURES.replace("**omentum**: 9", "9"), README, '"A plan" has no item'),
                                     (FIGURES.replace("readme", "other"), README, "no section"),
                                     (FIGURES.replace("9 ms", "9 ms " * 50), README, "characters"),
                                     (FIGURES.replace("9 ms", "9 | 8 ms"), README, "or a |")):
            code, message, after = self.run_tool(figures, readme)
            self.assertEqual((code, after), (1, readme))
            self.assertIn(why, message)

    def test_usage(self):
        self.assertEqual(self.run_tool(FIGURES, README, "--chek")[0], 2)

    def test_this_checkout(self):
        self.assertEqual(readme_figures.main(["--check"]), 0)
        self.assertEqual(len(readme_figures.rows((ROOT / "doc/figures.md").read_text(encoding="utf-8"))), 10)


if __name__ == "__main__":
    unittest.main()
