#!/usr/bin/env python3
"""The runner of the CLI cases accepts what happened and refuses everything else."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

RUNNER = pathlib.Path(__file__).resolve().parents[1] / "cli" / "run_case.py"


class Runner(unittest.TestCase):
    def run_case(self, text):
        with tempfile.TemporaryDirectory() as folder:
            case = pathlib.Path(folder, "a.cmd")
            case.write_text(text)
            done = subprocess.run([sys.executable, "-B", str(RUNNER), "/bin/echo", str(case)],
                                  capture_output=True, text=True, check=False)
            self.message = done.stdout + done.stderr
            return done.returncode == 0

    def test_good(self):
        self.assertTrue(self.run_case("# a case\n$ omentum hello 12 mm\nexit 0\nout ^hello \\d+ mm$\nno-err\n"),
                        self.message)
        self.assertTrue(self.run_case("write a/b.txt\n    one\n    two\n\n$ cat a/b.txt >&2; exit 3\nexit 3\n"
                                      "err ^two$\nno-out\nerr-lines 2\nfile a/b.txt\nno-file c\n"), self.message)
        self.assertTrue(self.run_case("copy a.cmd\n$ grep -c copy a.cmd\nexit 0\nout ^2$\n"), self.message)

    def test_bad(self):
        for text, why in [("$ omentum a\nexit 1\n", "exit code 0"),
                          ("$ omentum a\nexit 0\nout b\n", "no line of stdout"),
                          ("$ omentum a\nexit 0\nerr a\n", "no line of stderr"),
                          ("$ omentum a\nexit 0\nno-out\n", "something was printed"),
                          ("$ omentum a >&2\nexit 0\nerr-lines 2\n", "1 lines"),
                          ("$ omentum a\nexit 0\nfile b\n", "no such file"),
                          ("$ touch b\nexit 0\nfile b\n", "empty"),
                          ("$ touch b\nexit 0\nno-file b\n", "it is there"),
                          ("$ omentum a\nexit 0\nsays a\n", "unknown verb"),
                          ("$ omentum a\n", "without an exit line"),
                          ("$ omentum a\n$ omentum b\nexit 0\n", "no exit line"),
                          ("exit 0\n", "before any command"),
                          ("# nothing\n", "no command at all")]:
            self.assertFalse(self.run_case(text), text)
            self.assertIn(why, self.message)


if __name__ == "__main__":
    unittest.main()
