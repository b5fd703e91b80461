#!/usr/bin/env python3
"""tools/draws.py pools three draws of one hash, and no fewer."""
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
import draws  # noqa: E402


def row(draw, result, digest="a1", cases="1001-1100", part="random"):
    return {"study": "retraction", "part": part, "hash": digest, "draw": str(draw), "commit": "-", "cases": cases, "result": result}


class Pool(unittest.TestCase):
    def pool(self, *rows):
        return draws.pool(rows, "retraction", "random", "a1")

    def test_three(self):
        """275 / 300; the deviation of 96, 89 and 90 is sqrt((13 ** 2 + 8 ** 2 + 5 ** 2) / 18) = 3.786."""
        code, line = self.pool(row(1, "96 of 100 exposed"), row(3, "90 of 100 exposed"), row(2, "1 of 100 exposed"), row(2, "89 of 100 exposed"),
                               row(1, "7 of 100 exposed", "b2"), row(1, "3 of 100 warned", part="alarms"))
        self.assertEqual((code, line), (0, "91.7 % (275 of 300; draws 96, 89, 90 of 100; standard deviation 3.8 points) of a1"))

    def test_two(self):
        code, line = self.pool(row(1, "96 of 100 exposed"), row(3, "90 of 100 exposed"))
        self.assertEqual(code, 1)
        self.assertIn("draws [1, 3]", line)

    def test_other_cases(self):
        for cases in ("1001-1050", "1001-1100 quick"):
            code, line = self.pool(row(1, "9 of 10 exposed"), row(2, "9 of 10 exposed"), row(3, "9 of 10 exposed", cases=cases))
            self.assertEqual(code, 1)
            self.assertIn("other cases", line)


if __name__ == "__main__":
    unittest.main()
