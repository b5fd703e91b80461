#!/usr/bin/env python3
"""The site of `make doc` without Doxygen: how pages are rewritten, and what the check of the finished pages finds."""
import base64
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import gallery  # noqa: E402
import site_finish  # noqa: E402
import site_pages  # noqa: E402


class Pages(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        site_pages.ROOT, root = pathlib.Path(self.folder.name).resolve(), site_pages.ROOT
        self.addCleanup(setattr, site_pages, "ROOT", root)
        self.site = site_pages.Site("none", site_pages.ROOT / "out")
        self.site.out.mkdir()

    def page(self, files, name):
        for path, text in files.items():
            path = site_pages.ROOT / path
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        self.site.markdown(site_pages.ROOT / next(iter(files)))
        return self.site.written[name]

    def test_links_lead_to_pages(self):
        text = self.page({"doc/a.md": "# A\n[b](notes/b.md#two-words), `[b](c)`, [`d`](d.c), [e](https://e.org/f)\n", "doc/notes/b.md": "", "doc/d.c": ""}, "a")
        self.assertIn('<a href="notes_b.html#notes_b_two_words">b</a>, `[b](c)`, <a href="d_c.html">`d`</a>, <a href="https://e.org/f">e</a>', text)
        self.assertEqual([p.name for p in self.site.wanted], ["b.md", "d.c"])

    def test_dead_link(self):
        with self.assertRaises(SystemExit) as stop:
            self.page({"doc/a.md": "# A\n[b](b.md)\n"}, "a")
        self.assertEqual(str(stop.exception), "doc/a.md: the link to b.md leads nowhere")

    def test_headings_have_anchors(self):
        text = self.page({"doc/a.md": "# A\n### One, two\n```\n# no\n```\n## One two\n![p](images/p.png)\n"}, "a")
        self.assertEqual(text, "# A {#a}\n\n## One, two {#a_one_two}\n```text\n# no\n```\n## One two {#a_one_two_1}\n![p](p.png)\n\n")

    def test_notebook(self):
        cells = [{"cell_type": "markdown", "source": ["# Lift\n", "see `other.ipynb`"]},
                 {"cell_type": "code", "source": ["print(1 < 2)"], "outputs": [{"output_type": "stream", "text": ["a < b\n"]},
                     {"output_type": "display_data", "data": {"image/png": "aGFsbG8=", "text/plain": ["x"]}}]}]
        path = site_pages.ROOT / "notebooks/lift.ipynb"
        path.parent.mkdir()
        path.write_text(json.dumps({"cells": cells}))
        self.site.notebook(path)
        text = self.site.written["notebooks_lift"]
        self.assertTrue(text.startswith("# Lift {#notebooks_lift}"))
        for part in ("```python\nprint(1 < 2)\n```", '<pre class="output">a &lt; b</pre>', 'src="notebooks_lift_0.png"', 'href="notebooks_other.html"'):
            self.assertIn(part, text)
        self.assertEqual((self.site.out / "notebooks_lift_0.png").read_bytes(), b"hallo")

    def test_help_loses_no_option(self):
        page = "omentum a: b\n\nUsage: omentum a X [options]\n\nWords of\ntwo lines.\n\nOptions (also --name=value):\n  --one, -o DIR    a|b, 5 % (default: 1)\n" \
            "  --two            c\n\nExamples:\n  omentum a x\n"
        text = "\n".join(self.site.verb(page))
        for part in ("omentum a X [options]", "Words of two lines.", "a\\|b, 5 \\% (default: 1)", "<code>\\--two</code> | c", "```text\nomentum a x\n```"):
            self.assertIn(part, text)


class Finish(unittest.TestCase):
    def run_on(self, files):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files.items():
                pathlib.Path(folder, name).write_text(text)
            done = subprocess.run([sys.executable, "-B", ROOT / "tools/site_finish.py", folder], capture_output=True, text=True)
            found = pathlib.Path(folder, "search.js")
            entries = json.loads(found.read_text().removeprefix("siteIndex=").rstrip(";\n"))
            return done, entries, sorted(p.name for p in pathlib.Path(folder).iterdir())

    def test_good_site(self):
        done, entries, files = self.run_on({
            "index.html": '<title>omentum: Start</title><nav>menu</nav><a href="b.html#place">b</a><img src="p.png"><p>hello</p>',
            "b.html": '<title>omentum: B</title><h1><a class="anchor" id="place"></a>\nHead</h1><p>words</p>', "p.png": "", "left_over.js": ""})
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertEqual(files, ["b.html", "index.html", "p.png", "search.js"])
        self.assertIn(["b.html#place", "B", "Head", "words"], entries)
        self.assertFalse(any("menu" in e[3] for e in entries))

    @unittest.skipUnless(shutil.which("node"), "node is missing")
    def test_search_orders_names_before_text(self):
        """The function of this name comes first, then others that begin so, fields of structs after pages."""
        script = (ROOT / "doc/site/site.js").read_text(encoding="utf-8")
        score = re.search(r"function score.*?\n}\n", script, flags=re.S).group(0)
        weights = re.search(r"      e\.low = .*?;\n      e\.weight = .*?;\n", script, flags=re.S).group(0)
        places = [["structA.html#x", "A", "step", ""], ["a_8h.html#y", "a.h", "step_with()", "a step"], ["a_8h.html#z", "a.h", "step()", ""],
                  ["fem.html", "fem", "", "a step"], ["fem.html#f", "fem", "A step is made", ""], ["b.html", "b", "", "none"]]
        code = f"{score}\nconst all = {json.dumps(places)};\nfor (const e of all) {{\n{weights}}}\n" \
            "console.log(all.map((e) => [score(e, ['step']), e[0]]).filter(([s]) => s).sort((a, b) => b[0] - a[0]).map(([, n]) => n).join(' '));"
        done = subprocess.run(["node", "-e", code], capture_output=True, text=True, check=True)
        found = done.stdout.split()
        self.assertEqual(found[0], "a_8h.html#z")
        self.assertEqual(found[-1], "fem.html")
        self.assertEqual(sorted(found), sorted(p[0] for p in places[:5]))

    def test_dead_links(self):
        for link in ("c.html", "b.html#nothing", "p.png"):
            done, _, _ = self.run_on({"index.html": f'<a href="b.html">b</a> <a href="{link}">c</a>', "b.html": '<h1 id="place">x</h1>'})
            self.assertEqual(done.returncode, 1, link)
            self.assertIn(link.split("#")[0], done.stdout.split("\n")[0])


class Gallery(unittest.TestCase):
    def test_twelve_pictures_each_with_its_commands(self):
        sections = re.split(r"^## ", gallery.PAGE.read_text(encoding="utf-8"), flags=re.M)[1:]
        self.assertEqual(len(sections), 12)
        for section in sections:
            shown = re.findall(r"^!\[[^]]{10,}\]\((images/\S+)\)$", section, flags=re.M)
            self.assertEqual(len(shown), 1, section)
            self.assertRegex(section, r"(?m)^```\n(\./omentum |tools/|cmake )")
            made = [f"images/gallery/{name}" for name, *_ in gallery.entries("## " + section)]
            self.assertEqual(made, shown if "gallery/" in shown[0] else [], "its comment names another picture")

    def test_pictures_are_small_and_used(self):
        names = {name for name, *_ in gallery.entries(gallery.PAGE.read_text(encoding="utf-8"))}
        files = list((gallery.ROOT / "doc/images/gallery").iterdir())
        self.assertEqual({f.name for f in files}, names)
        self.assertLessEqual(max(f.stat().st_size for f in files), gallery.MOST)
        self.assertLessEqual(sum(f.stat().st_size for f in files), 1200000)

    def test_entries(self):
        text = "# A\n## B\n```\nrun\n```\n<!-- picture: images/gallery/c.png from: out/d.html #2 #10 width: 300 -->\n## E\n"
        self.assertEqual(list(gallery.entries(text)), [("c.png", "out/d.html", [2, 10], 300, "run\n")])

    def test_pictures_of_pages_and_notebooks(self):
        with tempfile.TemporaryDirectory() as folder:
            page, notebook = pathlib.Path(folder, "a.html"), pathlib.Path(folder, "a.ipynb")
            data = base64.b64encode(b"one").decode()
            style = "<style>:root{--a:#000}p{x:y}svg text{fill:red}@media print{svg text{fill:blue}.a{b:c}}</style>"
            page.write_text(f'{style}<img src="data:image/png;base64,{data}"><svg viewBox="0 0 90 40" aria-label="x"><g/></svg>')
            notebook.write_text(json.dumps({"cells": [{"outputs": [{"data": {"image/png": data}}]}, {}]}))
            self.assertEqual(gallery.embedded(page), [b"one"])
            self.assertEqual(gallery.embedded(notebook), [b"one"])
            svg = gallery.drawing(page, 1)
            for part in ('viewBox="-10 -10 110 60"', ":root{--a:#000}svg text{fill:red}</style>", 'aria-label="x"', "<g/></svg>"):
                self.assertIn(part, svg)


if __name__ == "__main__":
    unittest.main()
