#!/usr/bin/env python3
"""The rules of the source tree that a compiler does not know.

    tools/check_tree.py [ROOT]     exit 0 and a line of counts, or one line per violation and exit 1

Layers: each room has a floor; a file includes headers of lower floors only, besides the few arrows
inside a floor listed below. The studies are no room of the library: they include its public headers and their own,
and the program alone includes theirs. Third-party headers, threads, the allocator and standard output each have
their one place. Sizes: functions, files, public headers, samples. Names: unique, and they say the room.
Public functions that may fail document their statuses. Links of the documentation lead to files and headings. No trailing comment
splits its declaration, and comments and pages avoid phrases that need a second reading (PHRASES). The head of a .c
file is short, comments name no case of a study, lines of pages are below 200 characters, and an unreleased version has
a short change log.
Ballast: no file of the repository is above 1 MB outside weights/, and none lies in a cache folder.
"""
import collections
import json
import os
import pathlib
import re
import subprocess
import sys

FLOORS = [
    ["base", "math"],
    ["image", "shape", "solve"],
    ["tissue", "fem", "pbd", "heuristic", "robot", "nn", "report"],
    ["contact", "sense", "scan"],
    ["scene", "world"],
    ["match", "umesh", "calibrate", "plan", "view", "dds"],
    ["banet", "act"],
    ["belief", "rl"],
    ["trial"],
    ["loop"],
    ["record"],
    ["retract"],
    ["studies"],
    ["cli"],
]
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}

# Arrows inside a floor, each with its reason. There is no way back along any of them.
SIDEWAYS = {
    ("math", "base"): "everything reports errors and allocates through base",
    ("shape", "image"): "a surface or a mesh is made from a volume",
    ("fem", "tissue"): "an engine implements the interface",
    ("pbd", "tissue"): "an engine implements the interface",
    ("heuristic", "tissue"): "an engine implements the interface",
    ("world", "scene"): "a world is built from a scene",
    ("scan", "sense"): "a scan is made from the pictures of a camera",
}

PUBLIC_ROOM = {"vec": "math", "body": "world"}  # headers whose name does not begin with the room
EVERYWHERE = "omentum/vec.h"  # the inline vector types, which every room speaks
WITHIN = {"base/base_blas.h", "base/base_grow.h", "base/base_multiversion.h", "base/base_rng.h", "base/base_simd.h", "base/base_slots.h", "base/base_union.h"}  # for the library's own files, not for users
# The state of the arms, the belief, a trial, the loop and a record: read by the rooms of the loop above it, not by users.
DELIBERATION = {"act/act_state.h", "belief/belief_state.h", "belief/belief_updater.h", "trial/trial_attempt.h", "loop/loop_state.h",
                "record/record_internal.h"}
ENGINE = "tissue/tissue_internal.h"  # private to tissue, but for the engines of its floor

C_HEADERS = set("""assert.h complex.h ctype.h errno.h fenv.h float.h inttypes.h iso646.h limits.h locale.h
math.h setjmp.h signal.h stdalign.h stdarg.h stdatomic.h stdbool.h stddef.h stdint.h stdio.h stdlib.h
stdnoreturn.h string.h tgmath.h threads.h time.h uchar.h wchar.h wctype.h
dirent.h dlfcn.h fcntl.h fnmatch.h glob.h libgen.h poll.h pthread.h sched.h strings.h termios.h unistd.h
sys/file.h sys/ioctl.h sys/mman.h sys/random.h sys/resource.h sys/stat.h sys/statvfs.h sys/time.h sys/types.h sys/wait.h
immintrin.h arm_neon.h""".split())

MAX_FUNCTION, LONG_FUNCTION, MAX_C_FILE, MAX_PUBLIC_HEADER, MAX_SAMPLE = 150, 100, 1000, 600, 150
MAX_COLUMN = 120  # the formatter holds code to 100; this catches comments it does not wrap
MAX_HEAD = 25  # lines of the comment at the top of a .c file; measurements and trials stand in doc/notes
# A case of a study in a comment: what was chosen on one case is a matter of doc/notes.
CASE = re.compile(r"\b(pairs?|layouts?|alarms?|scenario) \d{2,}\b", re.I)
MAX_TEXT = 199  # characters of a line of Markdown
MAX_CHANGELOG = 40  # lines of a version that is not released
# The first line of a declaration or assignment that the formatter broke.
SPLIT = re.compile(r"\s*(((static|const|unsigned|struct|enum|typedef|_Atomic)\s+)*[A-Za-z_]\w*\s*\**(\s*\w+,)?|.*[^=!<>]=)")
PHRASES = re.compile(r"\b(asked for|in its own time|by way of|goes on|go on with|gone on with|what holds|whoever|nobody|"
                     r"those (that|who)|(is|are|was|were) told|and its like|at home|half way|held against|"
                     r"tried and left|at hand|lets? go of|as (it|they) (is|was|are|were|stands?|lies?)\b(?! (said|meant)))\b", re.I)

MAX_TRACKED = 1000000  # bytes of a file outside weights/
# Folders that a tool fills as it runs: ignored by git, never committed.
CACHE = re.compile(r"(^|/)(\.mypy_cache|\.pytest_cache|\.ruff_cache|\.ipynb_checkpoints|\.ccache|\.cache|__pycache__|node_modules|"
                   r"[^/]*\.egg-info)/")

# What a library must not do, and the files that may.
ONLY_IN = [
    (r"#\s*pragma\s+omp\b|\bpthread_create\s*\(", "threads", {"base_parallel.c", "base_job.c"}),
    (r"\b(?:malloc|calloc|realloc|aligned_alloc|posix_memalign|strdup|strndup)\s*\(", "allocation",
     {"base_alloc.c"}),
    (r"\b(?:printf|vprintf|puts|putchar)\s*\(|\bf(?:printf|puts|write)\s*\([^;]*\bstd(?:out|err)\b",
     "printing", {"base_status.c", "base_log.c"}),
    (r"\b(?:exit|_exit|_Exit|abort)\s*\(", "ending the program", {"base_status.c"}),
    (r"\blongjmp\s*\(", "longjmp", {"image_png.c"}),  # libpng's way of reporting; it stays in that file
]


def blank(match):
    """Replace a comment by nothing and a literal by an empty one; keep the line count."""
    text = match.group(0)
    if text.startswith("/"):
        return " " + "\n" * text.count("\n")
    return text[0] + text[0]


def strip_comments(text):
    pattern = r"//(?:\\\n|[^\n])*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'"
    return re.sub(pattern, blank, text, flags=re.S)


def slug(heading):
    """The anchor of a heading, as GitHub makes it."""
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def page_anchors(text):
    """The anchors of a page; a heading that comes again has -1, -2, ..."""
    found, seen = set(), collections.Counter()
    for heading in re.findall(r"^#+ (.*)$", re.sub(r"```.*?```", "", text, flags=re.S), flags=re.M):
        name = slug(heading)
        found.add(f"{name}-{seen[name]}" if seen[name] else name)
        seen[name] += 1
    return found


def functions(stripped):
    """Yield (name, first line, last line) of every function definition."""
    depth, head, head_line, current = 0, "", 0, None
    continued = False
    for number, line in enumerate(stripped.split("\n"), 1):
        directive = continued or line.lstrip().startswith("#")
        continued = directive and line.endswith("\\")
        if directive or line.strip() in ('extern "" {', "extern '' {"):
            continue
        for char in line:
            if depth == 0 and char in ";}":
                head = ""
            elif char == "{":
                if depth == 0:
                    name = re.search(r"(\w+)\s*\(", head)
                    is_type = re.match(r"\s*(typedef|struct|enum|union)\b[^(]*$", head)
                    current = name and not is_type and "=" not in head and (name.group(1), head_line)
                depth += 1
            elif char == "}":
                depth = max(0, depth - 1)
                if depth == 0:
                    if current:
                        yield current[0], current[1], number
                    head, current = "", None
            elif depth == 0:
                if not head.strip() and not char.isspace():
                    head_line = number
                head += char
        head += "\n" if depth == 0 else ""


class Tree:
    def __init__(self, root):
        self.root = pathlib.Path(root)
        self.errors, self.warnings = [], []
        folders = ("include", "src", "studies", "test", "bench", "fuzz", "samples")
        self.files = sorted(p for f in folders for p in (self.root / f).rglob("*.[ch]"))
        self.text = {p: p.read_text(encoding="utf-8") for p in self.files}
        self.stripped = {p: strip_comments(t) for p, t in self.text.items()}

    def pages(self):
        """Every page of Markdown but what a build or a tool wrote."""
        folders = (".", "doc", "doc/notes", "samples", "weights", "python", "studies", "test/mutants")
        return [p for f in folders for p in sorted((self.root / f).glob("*.md")) if p.name not in ("results.md", "scene_keys.md")]

    def error(self, path, line, why):
        where = f"{path.relative_to(self.root)}:{line}" if line else f"{path.relative_to(self.root)}"
        self.errors.append(f"{where}: {why}")

    def room_of(self, path):
        """The room a file belongs to, or None outside the library and the program."""
        part = path.relative_to(self.root).parts
        if part[0] == "src":
            return part[1]
        if part[0] == "studies":
            return "studies"
        return self.header_room(path.name) if part[0] == "include" else None

    @staticmethod
    def header_room(name):
        """omentum/shape_sdf.h belongs to shape; PUBLIC_ROOM lists headers named after what they declare."""
        stem = name[:-2]
        return PUBLIC_ROOM.get(stem, stem.split("_")[0])

    def includes(self, path):
        for number, line in enumerate(self.text[path].split("\n"), 1):
            found = re.match(r'\s*#\s*include\s+(["<])([^">]+)[">]', line)
            if found:
                yield number, found.group(1) == "<", found.group(2)

    def check_layers(self):
        third_party = collections.defaultdict(set)
        for path in self.files:
            room = self.room_of(path)
            if room is None or path.name == "omentum.h":
                continue
            if room not in FLOOR:
                self.error(path, 0, f"room {room} has no floor: add it to FLOORS in tools/check_tree.py")
                continue
            for number, angled, name in self.includes(path):
                if angled:
                    if name not in C_HEADERS:
                        third_party[room, name].add(path)
                else:
                    self.check_arrow(path, number, room, name)
        for (room, name), paths in sorted(third_party.items()):
            for path in sorted(paths):
                if path.suffix == ".h":
                    self.error(path, 0, f"<{name}> in a header: bind it in one .c file")
            if len(paths) > 1:
                names = ", ".join(sorted(p.name for p in paths))
                self.error(min(paths), 0, f"<{name}> is included by {len(paths)} files of room {room}: {names}")

    def check_arrow(self, path, number, room, name):
        public = name.startswith("omentum/")
        used = self.header_room(name.split("/")[-1]) if public else name.split("/")[0]
        if "/" not in name and (path.parent / name).is_file():
            pass  # beside it, in the same room
        elif "/" not in name:
            self.error(path, number, f'"{name}": write the folder too, as "{room}/{name}"')
        elif room == "studies" and not public and used != "studies":
            self.error(path, number, f"the studies use public headers only, not {name}")
        elif used == "omentum" and room != "cli":
            self.error(path, number, "omentum.h is for users; include the headers that are needed")
        elif used == "omentum" or name == EVERYWHERE or name in WITHIN:
            pass
        elif used not in FLOOR:
            self.error(path, number, f'"{name}" belongs to no room')
        elif room == "cli" and used == "studies" and not public:
            pass  # the command lines of the studies
        elif room == "cli" and not public and used != "cli":
            self.error(path, number, f"the program uses public headers only, not {name}")
        elif used == room:
            pass
        elif not public and name not in DELIBERATION and not (name == ENGINE and (room, used) in SIDEWAYS):
            self.error(path, number, f"{name} is private to room {used}")
        elif FLOOR[used] > FLOOR[room]:
            self.error(path, number, f"{room} (floor {FLOOR[room]}) uses {used} (floor {FLOOR[used]}): "
                       "an arrow that runs up")
        elif FLOOR[used] == FLOOR[room] and (room, used) not in SIDEWAYS:
            self.error(path, number, f"{room} uses {used} of the same floor {FLOOR[room]}")

    def check_room_order(self):
        """OM_ROOMS of the root CMakeLists.txt never goes down a floor, and names every room there is."""
        path = self.root / "CMakeLists.txt"
        found = re.search(r"set\(OM_ROOMS\s+([^)]*)\)", path.read_text(encoding="utf-8"))
        if not found:
            self.error(path, 0, "no set(OM_ROOMS ...)")
            return
        rooms = found.group(1).split()
        for below, above in zip(rooms, rooms[1:]):
            if FLOOR.get(below, 0) > FLOOR.get(above, 99):
                self.error(path, 0, f"OM_ROOMS has {below} before {above}, which is on a lower floor")
        for folder in sorted(p for p in (self.root / "src").iterdir() if p.is_dir()):
            if folder.name not in rooms + ["cli"]:
                self.error(folder, 0, "this room is not in OM_ROOMS")

    def check_everything_header(self):
        """omentum.h includes every other public header."""
        path = self.root / "include/omentum/omentum.h"
        if path in self.text:
            named = {name.split("/")[-1] for _, _, name in self.includes(path)}
            for header in sorted(p.name for p in self.files if p.parent == path.parent and p != path):
                if header not in named:
                    self.error(path, 0, f"{header} is missing")

    def check_places(self):
        for path in self.files:
            room = self.room_of(path)
            if room in (None, "cli") or path.suffix == ".h" and "include" in path.parts:
                continue
            for number, line in enumerate(self.stripped[path].split("\n"), 1):
                for pattern, what, allowed in ONLY_IN:
                    if path.name not in allowed and re.search(pattern, line):
                        self.error(path, number, f"{what} belongs to {', '.join(sorted(allowed))}: {line.strip()}")

    def check_sizes(self):
        for path in self.files:
            lines = self.text[path].count("\n")
            part = path.relative_to(self.root).parts
            limit = MAX_SAMPLE if part[0] == "samples" else MAX_C_FILE if path.suffix == ".c" else \
                MAX_PUBLIC_HEADER if part[0] == "include" else MAX_C_FILE
            if lines > limit:
                self.error(path, 0, f"{lines} lines, the limit is {limit}")
            for number, line in enumerate(self.text[path].split("\n"), 1):
                if len(line) > MAX_COLUMN:
                    self.error(path, number, f"{len(line)} columns, the limit is {MAX_COLUMN}")
            for name, first, last in functions(self.stripped[path]):
                length = last - first + 1
                where = f"{path.relative_to(self.root)}:{first}"
                if length > MAX_FUNCTION:
                    self.error(path, first, f"{name} has {length} lines, the limit is {MAX_FUNCTION}")
                elif length > LONG_FUNCTION:
                    self.warnings.append(f"{where}: {name} has {length} lines; over {LONG_FUNCTION} needs a reason")

    def check_heads(self):
        """The head of a .c file is no diary: method, layout, reference, rejected ideas."""
        for path in self.files:
            lines = self.text[path].split("\n")
            head = next((n for n, line in enumerate(lines) if not line.startswith("//")), 0)
            if path.suffix == ".c" and head > MAX_HEAD:
                self.error(path, 1, f"the head has {head} lines, the limit is {MAX_HEAD}: measurements belong to doc/notes")

    def check_cases(self):
        """No comment of the library or the studies names a single case."""
        for path in self.files:
            if path.relative_to(self.root).parts[0] not in ("include", "src", "studies"):
                continue
            for number, line in enumerate(self.text[path].split("\n"), 1):
                found = CASE.search(line[line.find("//"):]) if "//" in line else None
                if found:
                    self.error(path, number, f'"{found.group(0)}": a comment knows no case; doc/notes may')

    def check_text(self):
        """Lines of pages are short enough to be read in an editor and compared in a diff."""
        for path in self.pages():
            for number, line in enumerate(path.read_text(encoding="utf-8").split("\n"), 1):
                if len(line) > MAX_TEXT:
                    self.error(path, number, f"{len(line)} characters, the limit is {MAX_TEXT}")

    def check_changelog(self):
        """What is not released has no history: a user needs one short list."""
        path = self.root / "CHANGELOG.md"
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        for section in re.finditer(r"^## .*not yet released.*\n((?:(?!## ).*\n?)*)", text, flags=re.M):
            lines = section.group(1).strip("\n").count("\n") + 1
            if lines > MAX_CHANGELOG:
                self.error(path, 0, f"{lines} lines of an unreleased version, the limit is {MAX_CHANGELOG}: merge or shorten")

    def check_names(self):
        by_name = collections.defaultdict(list)
        for path in self.files:
            by_name[path.name].append(path)
            part = path.relative_to(self.root).parts
            stem = path.stem
            if part[0] == "src" and stem != part[1] and not stem.startswith(part[1] + "_"):
                self.error(path, 0, f"a file of room {part[1]} is called {part[1]}_topic")
            if part[0] == "studies" and not re.match("study(_|$)", stem):
                self.error(path, 0, "a file of the studies is called study_topic")
            if part[0] == "test" and len(part) == 3 and path.suffix == ".c" and part[1] in [*FLOOR, "study"] and \
                    not stem.startswith(f"test_{part[1]}"):
                self.error(path, 0, f"a test of room {part[1]} is called test_{part[1]}_topic.c")
        for name, paths in sorted(by_name.items()):
            if len(paths) > 1:
                where = ", ".join(str(p.relative_to(self.root)) for p in paths)
                self.errors.append(f"{where}: file names are unique in the tree")

    def check_links(self):
        """What a page or a notebook points to is there: files, pictures, and headings of pages."""
        tracked = [self.root / name for name in self.tracked() if name.endswith((".md", ".ipynb"))]
        anchors = {}
        for path in tracked:
            text = path.read_text(encoding="utf-8")
            if path.suffix == ".ipynb":
                cells = [c for c in json.loads(text)["cells"] if c["cell_type"] == "markdown"]
                text = "\n".join("".join(c["source"]) for c in cells)
            text = re.sub(r"```.*?```", lambda m: "\n" * m.group(0).count("\n"), text, flags=re.S)
            for number, line in enumerate(text.split("\n"), 1):
                for target in re.findall(r"\]\(([^)\s]+)[^)]*\)", re.sub(r"`[^`]*`", "", line)):
                    file, _, anchor = target.partition("#")
                    to = path.parent / file if file else path
                    if "://" in target or target.startswith("mailto:"):
                        continue
                    if not to.exists():
                        self.error(path, number, f"the link to {file} leads nowhere")
                    elif anchor and to.suffix == ".md":
                        if to not in anchors:
                            anchors[to] = page_anchors(to.read_text(encoding="utf-8"))
                        if anchor not in anchors[to]:
                            self.error(path, number, f"the link to {target} leads to no heading")

    def check_returns(self):
        """The comment of a public function that may fail names its statuses after @return."""
        for path in self.files:
            if path.relative_to(self.root).parts[0] != "include":
                continue
            lines = self.text[path].split("\n")
            for number, line in enumerate(lines):
                match = re.match(r"OM_API OmStatus (\w+)\(", line)
                if not match:
                    continue
                first = number
                while first and lines[first - 1].startswith("///"):
                    first -= 1
                if not any("@return" in comment for comment in lines[first:number]):
                    self.error(path, number + 1, f"the comment of {match.group(1)} has no @return with its statuses")

    def check_splits(self):
        """A comment that is too long for its line stands above it: else the formatter breaks the declaration."""
        for path in self.files:
            lines = self.text[path].split("\n")
            for number, (first, second) in enumerate(zip(lines, lines[1:]), 1):
                rest = re.match(r"(\s+)(\S.*?[;,])\s+//", second)
                if not rest or "//" in first or first.strip() in ("else", "return"):
                    continue
                is_deeper = len(rest.group(1)) > len(first) - len(first.lstrip())
                if is_deeper and SPLIT.fullmatch(first) and len(first) + 1 + len(rest.group(2)) <= 100:
                    self.error(path, number, "the trailing comment splits this declaration: put it above the line")

    def check_words(self):
        """Comments and pages avoid the phrases of PHRASES, which need a second reading."""
        texts = {**self.text, **{p: p.read_text(encoding="utf-8") for p in self.pages()}}
        for path, text in texts.items():
            for number, line in enumerate(text.split("\n"), 1):
                part = line if path.suffix == ".md" else line[line.find("//"):] if "//" in line else ""
                found = PHRASES.search(part)
                if found:
                    self.error(path, number, f'"{found.group(0)}": write it plainly (doc/style.md)')

    def tracked(self):
        """Paths of the files that git tracks; without git, of all files outside build/ and out/."""
        if (self.root / ".git").exists():
            done = subprocess.run(["git", "-C", str(self.root), "ls-files", "-z"], capture_output=True, check=True)
            return [name for name in os.fsdecode(done.stdout).split("\0") if name]
        files = [p.relative_to(self.root).as_posix() for p in sorted(self.root.rglob("*")) if p.is_file()]
        return [name for name in files if not name.startswith(("build/", "out/"))]

    def check_ballast(self):
        for name in self.tracked():
            path = self.root / name
            if CACHE.search(name):
                self.error(path, 0, "a tool's cache is tracked: git rm --cached it, and list its folder in .gitignore")
            elif not name.startswith("weights/") and path.is_file() and path.stat().st_size > MAX_TRACKED:
                self.error(path, 0, f"{path.stat().st_size} bytes; the limit is {MAX_TRACKED} outside weights/")

    def check(self):
        self.check_ballast()
        self.check_splits()
        self.check_words()
        self.check_heads()
        self.check_cases()
        self.check_text()
        self.check_changelog()
        self.check_links()
        self.check_layers()
        self.check_room_order()
        self.check_everything_header()
        self.check_places()
        self.check_sizes()
        self.check_names()
        self.check_returns()
        return not self.errors


def main():
    root = sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parent.parent
    tree = Tree(root)
    good = tree.check()
    for line in tree.warnings:
        print(f"note: {line}")
    for line in tree.errors:
        print(line)
    print(f"{len(tree.files)} C files, {len(tree.errors)} violations")
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
