#!/usr/bin/env python3
"""Do the tests notice a wrong line? Change one line of src/, studies/ or python/omentum/ at a time,
and run the tests of its room.

    tools/mutants.py                   run every mutant of test/mutants/*.txt, print a table
    tools/mutants.py --check           only read the lists: every text is still in its file, every test exists
    tools/mutants.py --sample 6        only 6 of each list, drawn at random; a larger sample has them, too
    tools/mutants.py --table FILE      write the table of the last results (Markdown), run nothing

A list is test/mutants/ROOM.txt. Blank lines and lines that begin with # are ignored. A mutant is

    scene_load.c: tool_noise_mm is read as metres
    - "tool_noise_mm", 1e-3
    + "tool_noise_mm", 1.0
    tests: test_scene_load cli_retract
    survives: why no test can notice it (only for those that no test kills)

The title says what is wrong after the change. The text of the `-` lines must occur once in the file (several lines are
joined; the indentation after `- ` counts from the first line on), and is replaced by the text of the `+` lines. `tests:`
names the tests that should notice; they run first, then the other quick tests of the room, then its slow tests, up to
the first that fails. Before all of them runs the test that killed the mutant in an earlier run (journal, results.md).
`limit: quick` leaves the slow tests of the room out. The room of python/omentum/*.py is python; its tests are python_*,
one for each python/tests/test_*.py.

Everything happens in a copy of the checkout, build/mutants/tree-N, with a build folder of its own. A result is kept in
build/mutants/journal.jsonl with hashes of the mutant, of its source file, and of the test that killed it (of all its
tests, if none did), so a run that was stopped goes on, and a later run repeats only what changed. A mutant whose object file is the same as before is equivalent and does not
count. Tests that fail without any mutant are reported and not used.

Exit code 1: a mutant is stale or does not build, a survivor has no reason, or less than 90 % are killed. 2: usage.
"""
import argparse
import collections
import hashlib
import json
import os
import pathlib
import queue
import re
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time

import ctest_files

ROOT = pathlib.Path(__file__).resolve().parents[1]
SHARE = 0.90  # of the mutants that count, killed
NICE = 10
SLACK = 20  # processor seconds a test may take beyond five times what it takes without a mutant
UNKNOWN_LIMIT = 600  # processor seconds of a test that was not timed before
ROOM_CLI = {  # tests of the program that belong to a room besides those with its name
    "calibrate": ["cli_calibrate"], "retract": ["cli_retract"], "plan": ["cli_plan"],
}
Mutant = collections.namedtuple("Mutant", "list line file title old new tests survives slow")


class BadList(Exception):
    pass


def read_list(path):
    """The mutants of one list; BadList with file and line where it is malformed."""
    mutants, entry = [], None

    def end():
        if entry is None:
            return
        where = f"{path.name}:{entry['line']}"
        if not entry["-"] or not entry["+"]:
            raise BadList(f"{where}: '{entry['title']}' needs lines that begin with '- ' and '+ '")
        old, new = "\n".join(entry["-"]), "\n".join(entry["+"])
        if old == new:
            raise BadList(f"{where}: '{entry['title']}' changes nothing")
        mutants.append(Mutant(path.stem, entry["line"], entry["file"], entry["title"], old, new,
                              tuple(entry["tests"]), entry["survives"], entry["slow"]))

    for number, line in enumerate(path.read_text().split("\n"), 1):
        if not line.strip() or line.startswith("#"):
            continue
        head = re.fullmatch(r"(\w+\.(?:c|h|py)): (.+)", line)
        if head:
            end()
            entry = {"line": number, "file": head[1], "title": head[2], "-": [], "+": [], "tests": [], "survives": "",
                     "slow": True}
        elif entry is None:
            raise BadList(f"{path.name}:{number}: expected 'file.c: what is wrong'")
        elif line[:2] in ("- ", "+ ") or line in ("-", "+"):
            entry[line[0]].append(line[2:])
        elif line.startswith("tests: "):
            entry["tests"] += line[7:].split()
        elif line.startswith("survives: "):
            entry["survives"] = line[10:].strip()
        elif line == "limit: quick":
            entry["slow"] = False
        else:
            raise BadList(f"{path.name}:{number}: expected '- ', '+ ', 'tests: ', 'survives: ' or 'limit: quick'")
    end()
    return mutants


def read_lists(root, rooms=None):
    """All lists, or those of some rooms, in that order."""
    paths = sorted((root / "test" / "mutants").glob("*.txt"))
    if rooms:
        paths = [root / "test" / "mutants" / f"{room}.txt" for room in rooms]
    mutants = []
    for path in paths:
        if not path.is_file():
            raise BadList(f"no mutants of room '{path.stem}': {path} is missing")
        mutants += read_list(path)
    if not mutants:
        raise BadList("no mutants in test/mutants/*.txt")
    return mutants


def source_files(root):
    """File name -> path; names are unique in the tree."""
    found = {path.name: path for pattern in ("*.c", "*.h") for folder in ("src", "studies")
             for path in (root / folder).rglob(pattern)}
    found.update((path.name, path) for path in (root / "python" / "omentum").glob("*.py"))
    return found


def room_of(path):
    """The room of a source file, as in the names of its tests."""
    return {"studies": "study", "omentum": "python"}.get(path.parent.name, path.parent.name)


def is_test_of(name, room):
    """Does a test belong to a room by its name?"""
    return re.match("python_" if room == "python" else rf"(test|cli)_{room}(_|$)", name) is not None


def file_test(name):
    """The test whose file a test runs: om_test adds NAME_2 ... (PARTS), NAME_all and NAME_allocations."""
    return re.sub(r"_(\d+|all|allocations)$", "", name)


def test_files(root):
    """Test name -> its own file, as the CMake files name them."""
    found = {f"cli_{path.stem}": path for path in (root / "test" / "cli").glob("*.cmd")}
    found.update((path.stem.replace("test_", "python_", 1), path) for path in (root / "python/tests").glob("test_*.py"))
    for lists in list((root / "test").glob("*/CMakeLists.txt")) + list((root / "samples").glob("CMakeLists.txt")):
        text = lists.read_text()
        for name, file in re.findall(r"om_test\((\w+) ([\w.]+)", text):
            found[name] = lists.parent / file
        for name in re.findall(r"add_test\(NAME (\w+) ", text):
            found.setdefault(name, lists)
    return found


def stale(mutant, files):
    """None, or why the mutant no longer fits its file."""
    path = files.get(mutant.file)
    if path is None:
        return f"no file {mutant.file} below src/, studies/ or python/omentum/"
    count = path.read_text().count(mutant.old)
    return None if count == 1 else f"its text occurs {count} times in {mutant.file}"


def check(root, mutants):
    """Lines of what is wrong with the lists."""
    files, tests, seen, wrong = source_files(root), test_files(root), {}, []
    for m in mutants:
        where = f"test/mutants/{m.list}.txt:{m.line}: '{m.title}'"
        why = stale(m, files)
        if why:
            wrong.append(f"{where}: {why}")
        if (m.file, m.old, m.new) in seen:
            wrong.append(f"{where}: the same change as line {seen[m.file, m.old, m.new]}")
        seen[m.file, m.old, m.new] = m.line
        wrong += [f"{where}: no test '{name}'" for name in m.tests if name not in tests]
    return wrong


def tracked(root):
    """Files of the checkout that a copy needs."""
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=root, check=True,
                            capture_output=True).stdout.decode().split("\0")
    return [name for name in listed if name and (root / name).is_file()]


class Tree:
    """A copy of the checkout with a build folder; applies mutants and runs tests."""

    def __init__(self, source, scratch, number, jobs):
        self.source, self.root = source, scratch / f"tree-{number}"
        self.build = self.root / "build" / "mutants"
        self.log, self.jobs, self.tests, self.objects, self.base = scratch / f"log-{number}.txt", jobs, {}, {}, {}
        self.environment = dict(os.environ, OMP_WAIT_POLICY="passive", TMPDIR=str(scratch / f"tmp-{number}"))
        (scratch / f"tmp-{number}").mkdir(parents=True, exist_ok=True)
        shared = scratch / "shared"  # some tests read ../shared
        if (source.parent / "shared").exists() and not shared.exists():
            shared.symlink_to(source.parent / "shared")
        packages = self.root / "build" / "python"  # of the Python tests, where tools/python_env.sh made it
        if (source / "build" / "python").exists() and not packages.exists():
            packages.parent.mkdir(parents=True, exist_ok=True)
            packages.symlink_to(source / "build" / "python")

    def copy(self):
        """Write what differs, remove what is gone: unchanged files keep their times, and their objects."""
        names = tracked(self.source)
        for name in names:
            source, target = self.source / name, self.root / name
            data = source.read_bytes()
            if not target.is_file() or target.read_bytes() != data:
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(data)
                shutil.copymode(source, target)
        wanted = set(names)
        for path in list(self.root.rglob("*")):
            name = str(path.relative_to(self.root))
            if path.is_file() and not name.startswith("build/") and name not in wanted:
                path.unlink()

    def call(self, command, **more):
        return subprocess.run(command, cwd=self.root, env=self.environment, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, errors="replace", check=False, **more)

    def prepare(self):
        """Copy and build the checkout; false, and printed, if that fails."""
        self.root.mkdir(parents=True, exist_ok=True)
        self.copy()
        # each mutant is archived and linked again: a thin archive and gold, where there is one, take 0.2 of 0.7 s
        quick = ["-DCMAKE_C_ARCHIVE_CREATE=<CMAKE_AR> qcT <TARGET> <LINK_FLAGS> <OBJECTS>"]
        if shutil.which("ld.gold"):  # for programs; it does not read the version script of the shared library
            quick += ["-DCMAKE_EXE_LINKER_FLAGS=-fuse-ld=gold"]
        done = self.call(["cmake", "-S", ".", "-B", str(self.build), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                          "-DOM_BENCH=OFF", *quick])
        if done.returncode == 0:
            done = self.call(["ninja", "-C", str(self.build), f"-j{self.jobs}", "libomentum_static.a", "bin/omentum"])
        if done.returncode != 0:
            print(f"the checkout does not build:\n{done.stdout[-4000:]}", flush=True)
            return False
        self.tests = {test.name: test for test in ctest_files.read(self.build)}
        for path in self.build.rglob("*.c.o"):
            if re.search("/omentum_(objects|studies|cli)\\.dir/", str(path)):
                self.objects[path.name[:-2]] = (path, path.read_bytes())
        return True

    def targets(self, name):
        """What ninja builds for a test."""
        made = ["omentum_python"] if name.startswith("python_") and (self.root / "python/CMakeLists.txt").is_file() else []
        return made + ctest_files.targets(self.tests[name], self.build)

    def make(self, targets):
        return self.call(["ninja", "-C", str(self.build), f"-j{self.jobs}", *targets])

    def run(self, name, limit):
        """(0 passed, 77 skipped or another number, processor seconds); `limit` in processor seconds."""
        test = self.tests[name]
        environment = {**self.environment, **test.environment}

        def restrain():
            os.setpgid(0, 0)  # no new session: there an autogroup of the scheduler begins, without the run's priority
            if limit:
                resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))

        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        process = subprocess.Popen(test.command, cwd=test.folder, env=environment,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   preexec_fn=restrain)
        try:
            text, _ = process.communicate(timeout=20 * limit + 300 if limit else 3600)
            code = process.returncode
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            text, code = process.communicate()[0], -signal.SIGKILL
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        with open(self.log, "ab") as out:
            out.write(f"--- {name}: exit {code}\n".encode() + (text[-4000:] if code not in (0, 77) else b""))
        return code, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def baseline(self, name):
        """Processor seconds of a test without a mutant, or None if it does not pass there."""
        if name not in self.base:
            built = self.make(self.targets(name)).returncode == 0
            code, seconds = self.run(name, 0) if built else (1, 0)
            self.base[name] = seconds if code == 0 else None
            if code not in (0, 77):
                print(f"note: {name} fails without any mutant and is not used", flush=True)
        return self.base[name]


def earlier_killers(root, rows):
    """(file, title) -> the test that killed it before: by the committed table, or by a later run of the journal."""
    table_file = root / "test" / "mutants" / "results.md"
    text = table_file.read_text() if table_file.is_file() else ""
    found = re.findall(r"^\| `([\w.]+)` \| (.+) \| `(\w+)`(?: \*)? \|$", text, re.M)
    killers = {(file, title): test for file, title, test in found}
    killers.update(((r["file"], r["title"]), r["detail"]) for r in rows.values() if r["outcome"] == "killed")
    return killers


def names_slow_tests(tree, mutant):
    """Does it name slow tests only?"""
    named = [tree.tests[name] for name in mutant.tests if name in tree.tests]
    return bool(named) and all("slow" in test.labels for test in named)


def room_tests(tree, mutant, room, scope, first=None):
    """The tests of a mutant, in the order in which they run; `first` is the first, if it is one of them."""
    def is_slow(name):
        return "slow" in tree.tests[name].labels

    own = [name for name in tree.tests if is_test_of(name, room) or name in ROOM_CLI.get(room, [])]
    if room == "cli":
        own = [name for name in tree.tests if name.startswith("cli_")]
    own.sort(key=lambda name: (is_slow(name), name.startswith("cli_")))
    own = [name for name in own if not is_slow(name) or (mutant.slow and scope == "all")]
    named = [name for name in mutant.tests if name in tree.tests and not (scope == "quick" and is_slow(name))]
    named += [name for name in tree.tests if name not in named and re.search(r"_\d+$", name) and file_test(name) in named]
    names = named + [name for name in own if name not in named and scope != "named"]
    return sorted(names, key=lambda name: name != first)


def draw(mutants, count, seed):
    """`count` mutants of each list, in the order of the lists; a larger count draws these, too."""
    by_list = collections.defaultdict(list)
    for m in mutants:
        by_list[m.list].append(m)
    drawn = {m for own in by_list.values()
             for m in sorted(own, key=lambda m: digest_of(str(seed), m.file, m.title))[:count]}
    return [m for m in mutants if m in drawn]


def digest_of(*parts):
    digest = hashlib.sha256()
    for part in parts:
        digest.update((part if isinstance(part, bytes) else part.encode()) + b"\0")
    return digest.hexdigest()[:16]


def key_of(mutant, files):
    """Hash of the change and of the file it is made in."""
    path = files.get(mutant.file)
    return digest_of(mutant.file, mutant.old, mutant.new, path.read_bytes() if path else b"")


def proof_of(mutant, row, files, tests):
    """Hash of the tests that a result rests on: the one that killed it, or all of its room and those it names."""
    named = ""
    if row["outcome"] == "killed":
        names = [row["detail"] if row["detail"] in tests else file_test(row["detail"])]
    elif row["outcome"] in ("survived", "untested") and mutant.file in files:
        room = room_of(files[mutant.file])
        names = sorted(set(mutant.tests) | {n for n in tests if is_test_of(n, room)})
        named = " ".join(mutant.tests)  # another list of these is another run
    else:
        return ""
    return digest_of(*(tests[name].read_bytes() for name in names if name in tests), *([named] if named else []))


def try_mutant(tree, mutant, scope, first=None):
    """(outcome, detail): killed by a test, survived, equivalent, untested, unbuildable or stale."""
    files = source_files(tree.root)
    why = stale(mutant, files)
    if why:
        return "stale", why
    path = files[mutant.file]
    text = path.read_text()
    changed = text.replace(mutant.old, mutant.new)
    if path.suffix == ".py":
        try:
            compile(changed, mutant.file, "exec")
        except SyntaxError:
            return "unbuildable", "Python refuses it"
    names = room_tests(tree, mutant, room_of(path), scope, first)
    compiled, before = tree.objects.get(mutant.file, (None, b""))
    count, missing = 0, []
    try:
        for name in names:
            is_named = bool({name, file_test(name)} & set(mutant.tests))
            if is_named and name not in tree.base:
                path.write_text(text)
                tree.baseline(name)
            if tree.base.get(name, 0) is None:
                missing += [name] if is_named else []
                continue
            if path.read_text() != changed:
                path.write_text(changed)
            # with the library's object: a test program may have the source among its own
            own = [str(compiled.relative_to(tree.build))] if compiled else []
            done = tree.make(own + tree.targets(name))
            if done.returncode != 0:
                with open(tree.log, "a") as out:
                    out.write(done.stdout[-4000:])
                return "unbuildable", "the compiler refuses it"
            if compiled and compiled.read_bytes() == before:
                return "equivalent", "the same object file"
            code, _ = tree.run(name, 5 * tree.base[name] + SLACK if name in tree.base else UNKNOWN_LIMIT)
            count += code != 77
            if code in (0, 77):
                continue
            if name not in tree.base:  # does it pass without the mutant?
                path.write_text(text)
                if tree.baseline(name) is None:
                    continue
            return "killed", name
        if missing:
            return "untested", f"skipped here, or fails without a mutant: {', '.join(missing)}"
        if not count:
            return "untested", "no test of its room runs"
        return "survived", f"{count} tests" + ("" if scope == "all" else f", {scope} ones only")
    finally:
        path.write_text(text)


def read_journal(path):
    rows = {}
    if path.is_file():
        for line in path.read_text().split("\n"):
            try:
                row = json.loads(line)
                rows[row["key"]] = row
            except (ValueError, KeyError):
                continue  # the last line of a run that was stopped
    return rows


def find_row(rows, mutant, files, tests, scope="named"):
    """The result of a mutant, if what it rests on is as it was; a survivor must have had the tests of `scope`."""
    row = rows.get(key_of(mutant, files))
    if row is None or row.get("proof") != proof_of(mutant, row, files, tests):
        return None
    order = ["named", "quick", "all"]
    if row["outcome"] in ("survived", "untested") and order.index(row.get("scope", "all")) < order.index(scope):
        return None
    return row


def run(mutants, args, scratch, journal):
    """Run what the journal does not have yet."""
    rows, files, tests = read_journal(journal), source_files(args.root), test_files(args.root)
    todo, lock, killers = queue.Queue(), threading.Lock(), earlier_killers(args.root, rows)
    for m in mutants:
        if args.again or find_row(rows, m, files, tests, args.scope) is None:
            todo.put(m)
    count, done, left_out = todo.qsize(), [0], [0]
    print(f"{len(mutants)} mutants, {count} to run", flush=True)

    def work(number):
        tree = Tree(args.root, scratch, number, max(1, (os.cpu_count() or 1) // args.jobs))
        tree.log.write_text("")
        if not tree.prepare():
            return
        while True:
            try:
                m = todo.get_nowait()
            except queue.Empty:
                return
            with open(tree.log, "a") as out:
                out.write(f"=== {m.list}:{m.line} {m.title}\n")
            start = time.monotonic()
            if args.scope == "quick" and names_slow_tests(tree, m):
                left_out[0] += 1  # not run: other tests are not expected to notice it
                continue
            outcome, detail = try_mutant(tree, m, args.scope, killers.get((m.file, m.title)))
            row = {"file": m.file, "title": m.title, "outcome": outcome, "detail": detail, "scope": args.scope}
            row["key"] = key_of(m, source_files(tree.root))  # of what was run, in the copy
            row["proof"] = proof_of(m, row, source_files(tree.root), test_files(tree.root))
            with lock:
                done[0] += 1
                with open(journal, "a") as out:
                    out.write(json.dumps(row) + "\n")
                print(f"[{done[0]}/{count}] {outcome:11} {m.file}: {m.title} ({detail}, {time.monotonic() - start:.0f} s)",
                      flush=True)

    if count:
        workers = [threading.Thread(target=work, args=(n,)) for n in range(min(args.jobs, count))]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        if left_out[0]:
            print(f"{left_out[0]} mutants were left out: the tests that they name are slow")
        if done[0] + left_out[0] < count:
            print(f"{count - done[0] - left_out[0]} mutants were not run")


def results(root, mutants, journal, has_earlier=False):
    """Each mutant with its result; `has_earlier`: else the last time that it was killed, by sources or tests of before."""
    rows, files, tests = read_journal(journal), source_files(root), test_files(root)
    before = {key: {"outcome": "killed", "detail": test, "is_earlier": True}
              for key, test in earlier_killers(root, rows).items()}
    found = []
    for m in mutants:
        row = find_row(rows, m, files, tests) or (before.get((m.file, m.title)) if has_earlier else None)
        found.append((m, row or {"outcome": "not run", "detail": ""}))
    return found


def summary(found):
    """Lines of the counts by room, killed and counted mutants."""
    rooms = collections.OrderedDict()
    for m, row in found:
        killed, counted = rooms.get(m.list, (0, 0))
        is_counted = row["outcome"] in ("killed", "survived")
        rooms[m.list] = (killed + (row["outcome"] == "killed"), counted + is_counted)
    killed, counted = (sum(pair[i] for pair in rooms.values()) for i in (0, 1))
    return rooms, killed, counted


def table(found):
    """The committed table: counts by room, each survivor with its reason."""
    rooms, killed, counted = summary(found)
    missing = [m for m, row in found if row["outcome"] == "not run"]
    lines = ["# Mutants and the tests that notice them", "",
             "Written by `tools/mutants.py --table`: not edited by hand. A mutant counts if it builds to another object file.",
             "A star marks an earlier result: the source or the test may have changed since. `make mutants` runs these again.",
             "", "| room | mutants | killed | of these with a star |", "|---|---|---|---|"]
    stars = collections.Counter(m.list for m, row in found if row.get("is_earlier"))
    lines += [f"| {room} | {c} | {k} | {stars[room]} |" for room, (k, c) in rooms.items()]
    lines += [f"| all | {counted} | {killed} ({100 * killed / max(counted, 1):.1f} %) | {stars.total()} |", ""]
    if missing:
        lines += [f"Without a result: {len(missing)}.", ""]
    none = {"all": "no test yet", "quick": "no quick test yet; slow ones were not run", "named": "none of those it names"}
    lines += ["| survivor | what is wrong | why no test notices |", "|---|---|---|"]
    lines += [f"| `{m.file}` | {m.title} | {m.survives or none[row.get('scope', 'all')]} |" for m, row in found
              if row["outcome"] == "survived"]
    lines += ["", "| killed | what is wrong | by |", "|---|---|---|"]
    lines += [f"| `{m.file}` | {m.title} | `{row['detail']}`{' *' if row.get('is_earlier') else ''} |" for m, row in found if row["outcome"] == "killed"]
    if missing:
        lines += ["", "| without a result | what is wrong |", "|---|---|"]
        lines += [f"| `{m.file}` | {m.title} |" for m in missing]
    return "\n".join(lines) + "\n"


def verdict(found):
    """Print the counts and what is wrong; the exit code."""
    rooms, killed, counted = summary(found)
    wrong = 0
    for room, (k, c) in rooms.items():
        print(f"{room:12} {k:4} of {c:4} killed")
    for m, row in found:
        where = f"test/mutants/{m.list}.txt:{m.line}: {m.file}: {m.title}"
        if row["outcome"] in ("stale", "unbuildable", "untested", "not run"):
            print(f"{where}: {row['outcome']} {row['detail']}")
            wrong += 1
        elif row["outcome"] == "survived":
            print(f"{where}: survived" + (f" ({m.survives})" if m.survives else ", and has no line 'survives: '"))
            wrong += not m.survives
        elif row["outcome"] == "killed" and m.survives:
            print(f"{where}: killed by {row['detail']}; remove its line 'survives: '")
    share = killed / max(counted, 1)
    print(f"{killed} of {counted} killed, {100 * share:.1f} % (at least {100 * SHARE:.0f} %)")
    return 1 if wrong or share < SHARE else 0


def main(arguments):
    parser = argparse.ArgumentParser(description="Change one line at a time and see which test notices.")
    parser.add_argument("--check", action="store_true", help="only check the lists against the sources")
    parser.add_argument("--room", action="append", help="only test/mutants/ROOM.txt; may be repeated")
    parser.add_argument("--only", metavar="TEXT", help="only mutants with TEXT in file: title")
    parser.add_argument("--sample", type=int, metavar="N", help="only N mutants of each list, drawn at random")
    parser.add_argument("--seed", type=int, default=1, help="of --sample (1)")
    parser.add_argument("--quick", dest="scope", action="store_const", const="quick", default="all",
                        help="leave the slow tests out, and the mutants that name only these")
    parser.add_argument("--named", dest="scope", action="store_const", const="named", help="only the tests a mutant names")
    parser.add_argument("--jobs", type=int, default=1, help="copies that work side by side (1)")
    parser.add_argument("--again", action="store_true", help="run also what the journal has")
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, help="the checkout (that of this file)")
    parser.add_argument("--scratch", type=pathlib.Path, help="folder of copies and journal (build/mutants)")
    parser.add_argument("--table", metavar="FILE", help="write the table of results, run nothing")
    args = parser.parse_args(arguments)
    try:
        mutants = read_lists(args.root, args.room)
    except BadList as error:
        print(error)
        return 1 if args.check else 2
    if args.only:
        mutants = [m for m in mutants if args.only in f"{m.file}: {m.title}"]
    if args.sample is not None:
        mutants = draw(mutants, args.sample, args.seed)
    if args.check:
        wrong = check(args.root, mutants)
        print("\n".join(wrong) if wrong else f"{len(mutants)} mutants fit their files")
        return 1 if wrong else 0
    if not 1 <= args.jobs <= 64 or not mutants:
        print("no mutant is left" if args.jobs >= 1 else "--jobs must be in 1..64")
        return 2
    args.root = args.root.resolve()
    scratch = (args.scratch or args.root / "build" / "mutants").resolve()
    journal = scratch / "journal.jsonl"
    if args.table:
        pathlib.Path(args.table).write_text(table(results(args.root, mutants, journal, True)))
        return 0
    scratch.mkdir(parents=True, exist_ok=True)
    os.nice(NICE)
    run(mutants, args, scratch, journal)
    return verdict(results(args.root, mutants, journal))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
