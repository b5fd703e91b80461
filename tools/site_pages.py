#!/usr/bin/env python3
"""The pages of the site that `make doc` builds, written as Doxygen reads them.

    site_pages.py PROGRAM OUT     PROGRAM: build/release/bin/omentum; OUT: a new folder, build/doc/pages

The site has one page for each Markdown file of the documentation, and pages made here: a tutorial for each notebook of
python/notebooks with its outputs, the commands of the program from its help, the headers by room from their first
sentences, and a page for each file that a page links to. README.md is the start page. OUT also gets header.html, which is
doc/site/header.html with the list of all pages.

Every heading gets an id of its own (page_heading, as GitHub makes it, with _), so that links between pages keep their
anchors. A link to a file that is not there ends the program with the place.
"""
import base64
import html
import json
import pathlib
import re
import subprocess
import sys

from check_tree import slug

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Short titles in the list at the left, where the page has a longer one.
TITLE = {"index": "Start", "gallery": "Gallery", "commands": "Commands", "tutorials": "Tutorials", "api": "C headers", "doc": "All pages",
         "scene": "Patient models, scenes", "scene_keys": "Keys of a scene", "from_other_tools": "From other tools", "view": "Watch, pull, supervise",
         "defras": "A robot that retracts", "dvrk": "da Vinci Research Kit", "study": "Experiments of the thesis", "limits": "What it does not do",
         "gym": "Gymnasium", "cli": "Exit codes, JSON, files", "style": "How the code reads"}
# The list at the left: what is not named in a group here stands in "Rooms" or "Notes".
GROUPS = [
    ("", ["index", "gallery", "tutorials", "commands", "examples", "doc"]),
    ("Use it", ["scene", "scene_keys", "view", "defras", "dvrk", "study", "from_other_tools", "figures", "limits", "glossary"]),
    ("Program with it", ["python", "gym", "samples", "api", "cli", "libraries"]),
    ("Change it", ["contributing", "architecture", "style", "check_times", "security", "changelog"]),
]


def fail(place, why):
    sys.exit(f"{place.relative_to(ROOT)}: {why}")


def page_name(path):
    """The name of the page that a file of the repository becomes."""
    part = path.relative_to(ROOT).as_posix()
    known = {"README.md": "index", "doc/README.md": "doc", "samples/README.md": "samples", "weights/README.md": "weights",
             "python/README.md": "python_package", "test/mutants/results.md": "mutants"}
    if part in known:
        return known[part]
    name = re.sub(r"\W", "_", path.stem if path.suffix in (".md", ".ipynb") else path.name).strip("_").lower()
    return name if path.parent in (ROOT, ROOT / "doc") else f"{path.parent.name}_{name}"


class Site:
    def __init__(self, program, out):
        self.program, self.out = program, out
        self.titles, self.wanted, self.written = {}, [], {}

    def write(self, name, title, body):
        if name in self.written:
            sys.exit(f"two pages are called {name}")
        self.titles[name] = title
        self.written[name] = f"# {title} {{#{'mainpage' if name == 'index' else name}}}\n\n{body}\n"

    def want(self, path):
        """A page for this file, which another page links to."""
        if path not in self.wanted:
            self.wanted.append(path)
        return page_name(path)

    def link(self, source, target):
        """Where a link of a page leads on the site."""
        if re.match(r"[a-z]+:", target):
            return target
        file, _, anchor = target.partition("#")
        path = (source.parent / file).resolve() if file else source
        if not path.exists():
            fail(source, f"the link to {target} leads nowhere")
        if path.is_dir():
            path = path / "README.md"
            if not path.exists():
                return None
        name = self.want(path)
        return f"{name}.html" + (f"#{name}_{anchor.replace('-', '_')}" if anchor else "")

    def links(self, source, line):
        def change(found):
            image, words, target = found.groups()
            if image:
                return f"![{words}]({pathlib.Path(target).name})"
            to = self.link(source, target.split()[0])
            return f'<a href="{to}">{words}</a>' if to else words

        # a link inside `code` is none
        parts = re.split(r"(`[^`]*`)", line)
        return "".join(p if p.startswith("`") and not p.endswith(")") else re.sub(r"(!?)\[([^]]*)\]\(([^)]+)\)", change, p) for p in self.joined(parts))

    @staticmethod
    def joined(parts):
        """Code between brackets belongs to its link."""
        out = [""]
        for part in parts:
            is_code = part.startswith("`")
            if is_code and out[-1].count("[") <= out[-1].count("]"):
                out += [part, ""]
            else:
                out[-1] += part
        return out

    def markdown(self, path):
        """A Markdown file of the repository."""
        name, is_code, seen, title, body, depth = page_name(path), False, {}, None, [], 1
        for line in path.read_text(encoding="utf-8").split("\n"):
            heading = re.match(r"(#+) (.*)", line)
            if line.startswith("```"):
                is_code = not is_code
                body.append("```" + {"": "text", "c": "c"}.get(line[3:].strip(), line[3:].strip()) if is_code else line)
            elif is_code:
                body.append(line)
            elif heading and title is None:
                title = heading.group(2)
            elif heading:
                words, key = heading.group(2), slug(heading.group(2)).replace("-", "_")
                seen[key] = seen.get(key, -1) + 1
                depth = min(len(heading.group(1)), depth + 1)  # Doxygen takes no level below the next
                body.append(f"{'#' * depth} {words} {{#{name}_{key}{'_%d' % seen[key] if seen[key] else ''}}}")
            else:
                body.append(self.links(path, line))
        self.write(name, title or name, "\n".join(body))

    def text(self, path):
        """A file that is no page: shown whole."""
        kind = {".c": "c", ".h": "c", ".py": "python"}.get(path.suffix, "text")
        part = path.relative_to(ROOT).as_posix()
        self.write(page_name(path), part, f"```{kind}\n{path.read_text(encoding='utf-8')}\n```")

    def notebook(self, path):
        """A notebook with its outputs; pictures become files."""
        name, body, title = page_name(path), [], path.stem
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            source = "".join(cell["source"])
            if cell["cell_type"] == "code":
                body.append(f"```python\n{source}\n```\n")
                body += [self.output(name, output) for output in cell["outputs"]]
                continue
            for line in source.split("\n"):
                heading = re.match(r"(#+) (.*)", line)
                if heading and len(heading.group(1)) == 1:
                    title = heading.group(2)
                elif heading:
                    body.append(f"{heading.group(1)} {heading.group(2)} {{#{name}_{slug(heading.group(2)).replace('-', '_')}}}")
                else:
                    body.append(re.sub(r"`(\w+)\.ipynb`", lambda m: f'<a href="notebooks_{m.group(1)}.html">{m.group(1)}</a>', line))
            body.append("")
        part = path.relative_to(ROOT).as_posix()
        self.write(name, title, "\n".join(body) + f"\n\nThis page is the notebook `{part}` with its outputs. Run it in Jupyter, or by `python/notebooks/run.py {part}`.")

    def output(self, name, output):
        if output["output_type"] == "stream":
            return printed("".join(output["text"]))
        data, number = output["data"], len(list(self.out.glob(f"{name}_*")))
        for kind, suffix in (("image/png", "png"), ("image/svg+xml", "svg")):
            if kind in data:
                file, content = self.out / f"{name}_{number}.{suffix}", "".join(data[kind])
                file.write_bytes(base64.b64decode(content) if suffix == "png" else content.encode())
                return f'<img src="{file.name}" alt="output"/>\n'
        return printed("".join(data["text/plain"]))

    def tutorials(self):
        found, rows = sorted((ROOT / "python/notebooks").glob("*.ipynb")), []
        for path in found:
            self.notebook(path)
            cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
            first = "".join(cells[0]["source"]).split("\n\n")
            rows.append(f'- <a href="{page_name(path)}.html">{first[0].lstrip("# ")}</a>: {" ".join(first[1].split())}')
        self.write("tutorials", TITLE["tutorials"],
                   "Notebooks of the Python package, with what they print and draw. Each runs in less than a minute on two cores, with no file but omentum's own.\n\n" +
                   "\n".join(rows) + '\n\nIn C, <a href="samples.html">the samples</a> go the same way in twenty short programs.')

    def help(self, *words):
        done = subprocess.run([self.program, "help", *words], capture_output=True, text=True, check=True)
        return done.stdout

    def commands(self):
        """Every verb, with its options, from the program's own help."""
        body = ["The same text as `omentum help VERB` and `man omentum`. <a href=\"cli.html\">The program</a> has exit codes, `--json` and your files.\n"]
        top = self.help()
        for verb, what in re.findall(r"^  ([a-z][a-z-]*)  +(\S.*)", top, flags=re.M):
            if f"omentum {verb} " in top:
                continue
            page = self.help(verb)
            body.append(f"## {verb} {{#commands_{verb}}}\n\n{plain(what)}.\n")
            if "[options]" in page and re.search(r"^  omentum help " + verb + " ", page, flags=re.M):  # a group
                body += self.verb(page)
                for step, words in re.findall(r"^  ([a-z][a-z-]*)  +(\S.*)", page, flags=re.M):
                    if step != "omentum":
                        body.append(f"### {verb} {step} {{#commands_{verb}_{step}}}\n\n{plain(words)}.\n")
                        body += self.verb(self.help(verb, step))
            else:
                body += self.verb(page)
        self.write("commands", TITLE["commands"], "\n".join(body))

    @staticmethod
    def verb(page):
        """The help of a verb: usage, text, tables of options and figures, examples."""
        out = []
        for block in re.split(r"\n\n", page.strip())[1:]:
            first, _, rest = block.partition("\n")
            rows = re.findall(r"^  (\S.*?)(?:   *)(\S.*)$", rest, flags=re.M)
            if first.startswith("Usage:"):
                lines = [line.removeprefix("Usage:").strip() for line in block.split("\n")]
                out.append("```text\n" + "\n".join(lines) + "\n```\n")
            elif first in ("Examples:",):
                out.append("```text\n" + "\n".join(line.strip() for line in rest.split("\n")) + "\n```\n")
            elif first.startswith(("Options", "Figures")) and rows and len(rows) == rest.count("\n") + 1:
                head = "option" if first.startswith("Options") else "figure of --json"
                out.append(f"| {head} | |\n|---|---|\n" + "\n".join(f"| <code>{plain(a)}</code> | {plain(b)} |" for a, b in rows) + "\n")
            elif re.match(r"  [a-z][a-z-]*  +\S", block) or block.startswith("  omentum help"):
                continue  # members of a group: they have sections of their own
            else:
                out.append(plain(" ".join(block.split())) + "\n")
        return out

    def headers(self):
        """The public headers by room, as doc/README.md orders the rooms."""
        first = {}
        for path in sorted((ROOT / "include/omentum").glob("*.h")):
            lines = []
            for line in path.read_text(encoding="utf-8").split("\n"):
                if line.strip() == "///":
                    break
                lines.append(line.removeprefix("///").strip())
            first[path.stem] = re.sub(r"\s*\([^()]*floor \d+[^()]*\)", "", " ".join(lines).partition(": ")[2])
        room_of = {"vec": "math", "body": "world", "omentum": "all"}
        rows = re.findall(r"^\| (\S+) \| (?:\[(\w+)\]\S+|(\w+)) \| (.*) \|$", (ROOT / "doc/README.md").read_text(encoding="utf-8"), flags=re.M)
        body = ["Everything public, from the headers in `include/omentum`. `#include <omentum/omentum.h>` takes all of them. "
                "<a href=\"annotated.html\">All structs</a>, <a href=\"globals.html\">all names</a>.\n"]
        for _, a, b, what in rows:
            mine = [stem for stem in first if room_of.get(stem, stem.split("_")[0]) == (a or b)]
            if mine:
                body.append(f"## {a or b} {{#api_{a or b}}}\n")
                body.append("| header | |\n|---|---|\n" + "\n".join(f'| <a href="{stem.replace("_", "__")}_8h.html">{stem}.h</a> | {first.pop(stem)} |' for stem in mine) + "\n")
        first.pop("omentum")
        if first:
            sys.exit(f"headers of no room of doc/README.md: {', '.join(first)}")
        self.write("api", TITLE["api"], "\n".join(body))

    def start(self):
        """README with a way into the site behind its two commands."""
        text = self.written["index"]
        cards = (ROOT / "doc/site/cards.html").read_text(encoding="utf-8")
        before, mark, after = text.partition("## Three examples")
        head, words, rest = before.partition("A C library")
        picture = re.search(r"^!\[.*\n", rest, flags=re.M)
        if not mark or not words or not picture:
            sys.exit("README.md: the start page wants 'A C library', a picture, and the heading 'Three examples'")
        before = head + picture.group(0) + "\n" + words + rest.replace(picture.group(0), "")
        self.written["index"] = before + f"\\htmlonly\n{cards}\\endhtmlonly\n\n" + mark + after

    def navigation(self):
        named = {name for _, names in GROUPS for name in names}
        groups = GROUPS + [("Rooms", sorted(page_name(p) for p in (ROOT / "doc").glob("*.md") if page_name(p) not in named)),
                           ("Notes", sorted(page_name(p) for p in (ROOT / "doc/notes").glob("*.md")))]
        lines = []
        for title, names in groups:
            lines.append(f"<details{' open' if title in ('Use it', 'Program with it') else ''}><summary>{title}</summary><ul>" if title else "<ul>")
            for name in names:
                words = TITLE.get(name) or (name.removeprefix("notes_") if title in ("Rooms", "Notes") else self.titles[name].split(":")[0])
                lines.append(f'<li><a href="$relpath^{name}.html">{html.escape(words)}</a></li>')
                if name == "tutorials":
                    lines += [f'<li class="sub"><a href="$relpath^{n}.html">{html.escape(t)}</a></li>' for n, t in sorted(self.titles.items()) if n.startswith("notebooks_")]
            lines.append("</ul></details>" if title else "</ul>")
        head = (ROOT / "doc/site/header.html").read_text(encoding="utf-8")
        (self.out.parent / "header.html").write_text(head.replace("@NAVIGATION@", "\n".join(lines)), encoding="utf-8")

    def make(self):
        self.out.mkdir(parents=True)
        for folder in (".", "doc", "doc/notes", "samples"):
            for path in sorted((ROOT / folder).glob("*.md")):
                self.want(path)
        done = 0
        while done < len(self.wanted):  # a page may want others
            path = self.wanted[done]
            if path.suffix == ".ipynb":
                pass
            elif path.suffix == ".md":
                self.markdown(path)
            else:
                self.text(path)
            done += 1
        self.tutorials()
        self.commands()
        self.headers()
        self.start()
        for name, text in self.written.items():
            (self.out / f"{name}.md").write_text(text, encoding="utf-8")
        self.navigation()


def plain(text):
    """Words as Doxygen shows them unchanged."""
    return re.sub(r"([\\@%#*|]|--)", r"\\\1", html.escape(text, quote=False))


def printed(text):
    """What a cell printed."""
    return f'\\htmlonly\n<pre class="output">{html.escape(text.rstrip())}</pre>\n\\endhtmlonly\n'


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    Site(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()).make()


if __name__ == "__main__":
    main()
