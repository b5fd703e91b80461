#!/usr/bin/env python3
"""Run the tests of a build folder, as CTest does, and count their processor time, which CTest does not.

    run_tests.py build/release --not-label slow          the quick tests
    run_tests.py build/release --name '^test_match'      those of a room
    run_tests.py build/dev --not-label slow --whole 'room_base|parser'
                    tests with a label that fits run whole; of the others those with label `memory` run only their cases of
                    failing allocations (OM_TEST_CASES=memory, test_common.h); the rest is left out
    --targets       print what must be built for them, run nothing
    --limit 2 --allowed FILE
                    a test that takes more processor time fails, unless FILE names it: lines `NAME: reason`, at most ten
    --times FILE    write processor time and wall time of each test (JSON)
    --results FILE  write the findings, one a line, for tools/check.sh:
        fail NAME: reason                a test that failed, or that could not be started
        skip NAME: case: reason          a skipped case of a program whose other cases ran, or a skipped test
        count PASSED FAILED SKIPPED      a program with skipped cases counts as passed, and each such case as skipped

Each job has domains of DDS of its own (OM_TEST_DOMAIN and the two after it), so that no test meets the robot of another.
Tests that took longest the last time (BUILD/test_times.json) start first. Exit code 0: all passed; 1: a test failed; 2: no test.
"""
import argparse
import json
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time

import ctest_files

AGAIN = 3  # further runs of a test over the limit
SLACK = 1.5  # of the limit: a shared machine is slower by a quarter in some hours
MAX_ALLOWED = 10
FIRST_DOMAIN = 100  # domains of DDS are 0 to 232; below are those that users have, and those of test/cli
DOMAINS_A_JOB = 3
MAX_JOBS = (233 - FIRST_DOMAIN) // DOMAINS_A_JOB
running = set()  # process groups of the tests that run now


def end_all(number, _):
    """Ctrl-C and SIGTERM end the tests, too."""
    for group in list(running):
        try:
            os.killpg(group, signal.SIGKILL)
        except ProcessLookupError:
            pass
    os._exit(128 + number)


def skipped_cases(output):
    """(case, reason) of each case that a cmocka program skipped; the reason is the line `skip:` before it."""
    found, reason = [], ""
    for line in output.split("\n"):
        if line.startswith("skip: "):
            reason = line[6:].strip()
        case = re.match(r"\[  SKIPPED \] (\w+)$", line)
        if case and case.group(1) not in [name for name, _ in found]:
            found.append((case.group(1), reason or "no reason is given"))
            reason = ""
    return found


def is_fitting(labels, pattern):
    return any(re.fullmatch(pattern, label) for label in labels)


def select(tests, args):
    """(test, cases) of the options; cases is "memory" or None."""
    chosen = []
    for test in tests:
        if args.name and not re.search(args.name, test.name):
            continue
        if args.label and not is_fitting(test.labels, args.label):
            continue
        if args.not_label and is_fitting(test.labels, args.not_label):
            continue
        if args.whole is None or is_fitting(test.labels, args.whole):
            chosen.append((test, None))
        elif "memory" in test.labels:
            chosen.append((test, "memory"))
    return chosen


def read_allowed(path, tests):
    """Names of the tests that may take longer, and what is wrong with the list."""
    names, wrong = [], []
    with open(path, encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            line = line.strip()
            if not line or line.startswith("#"):
                continue
            name, colon, reason = line.partition(": ")
            if not colon or not reason:
                wrong.append(f"{path}:{number}: expected 'NAME: reason'")
            elif name not in [test.name for test in tests]:
                wrong.append(f"{path}:{number}: there is no test {name}")
            names.append(name)
    if len(names) > MAX_ALLOWED:
        wrong.append(f"{path}: {len(names)} tests may take longer, at most {MAX_ALLOWED} are allowed")
    return names, wrong


class Outcome:
    """What a run of a test came to."""

    def __init__(self, test, cases, job=0):
        environment = {**os.environ, **test.environment, **({"OM_TEST_CASES": cases} if cases else {})}
        if "OM_TEST_DOMAIN" not in environment:
            environment["OM_TEST_DOMAIN"] = str(FIRST_DOMAIN + DOMAINS_A_JOB * ((os.getpid() + job) % MAX_JOBS))
        self.test, self.why, self.seconds = test, "", 0.0
        start = time.monotonic()
        with tempfile.TemporaryFile() as log:
            try:
                process = subprocess.Popen(test.command, cwd=test.folder, env=environment, stdin=subprocess.DEVNULL,
                                           stdout=log, stderr=subprocess.STDOUT, start_new_session=True)
            except OSError as error:
                self.code, self.output, self.wall, self.why = -1, "", 0.0, f"cannot be started: {error.strerror}"
                return
            running.add(process.pid)
            timer = threading.Timer(test.timeout, os.killpg, (process.pid, signal.SIGKILL))
            timer.start()
            _, status, usage = os.wait4(process.pid, 0)
            running.discard(process.pid)
            process.returncode = self.code = os.waitstatus_to_exitcode(status)
            is_late = not timer.is_alive()
            timer.cancel()
            log.seek(0)
            self.output = log.read().decode(errors="replace")
        self.wall, self.seconds = time.monotonic() - start, usage.ru_utime + usage.ru_stime
        if is_late:
            self.why = f"took more than {test.timeout:.0f} s"
        elif self.code < 0:
            self.why = f"ended by signal {-self.code}"
        elif self.code not in (0, test.skip_code):
            self.why = f"exit code {self.code}"

    def lines(self):
        """The findings of --results, and (passed, failed, skipped)."""
        name = self.test.name
        if self.why:
            return [f"fail {name}: {self.why}"], (0, 1, 0)
        cases = [f"skip {name}: {case}: {reason}" for case, reason in skipped_cases(self.output)]
        if self.code == self.test.skip_code:
            return cases or [f"skip {name}"], (0, 0, max(1, len(cases)))
        return cases, (1, 0, len(cases))


def run_all(chosen, jobs, before):
    """Outcomes, in the order of `chosen`."""
    todo = sorted(chosen, key=lambda pair: -before.get(pair[0].name, {"wall": 1}).get("wall", 1))
    todo.reverse()
    done, lock = [], threading.Lock()

    def work(job):
        while True:
            with lock:
                if not todo:
                    return
                test, cases = todo.pop()
            outcome = Outcome(test, cases, job)
            with lock:
                done.append(outcome)
                word = "FAIL" if outcome.why else "skip" if outcome.code == test.skip_code else "ok"
                print(f"{word:4} {len(done):4}/{len(chosen)} {outcome.seconds:7.2f} s  {test.name}"
                      f"{' (memory)' if cases else ''}{': ' + outcome.why if outcome.why else ''}", flush=True)
                if outcome.why:
                    print("\n".join("    | " + line for line in outcome.output.split("\n")[-100:]), flush=True)

    workers = [threading.Thread(target=work, args=(job,)) for job in range(min(jobs, MAX_JOBS))]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    order = {test.name: index for index, (test, _) in enumerate(chosen)}
    return sorted(done, key=lambda outcome: order[outcome.test.name])


def hold_limit(outcomes, limit, allowed):
    """Tests over SLACK times the limit run up to three times more, alone; the least time counts, for the machine may be shared."""
    for outcome in outcomes:
        if outcome.why or outcome.seconds <= limit or outcome.test.name in allowed:
            continue
        for _ in range(AGAIN):
            if outcome.seconds > SLACK * limit:
                outcome.seconds = min(outcome.seconds, Outcome(outcome.test, None).seconds)
        if outcome.seconds > SLACK * limit:
            outcome.why = (f"took {outcome.seconds:.1f} s of processor time at least in each of {1 + AGAIN} runs; a quick "
                           f"test takes at most {limit:g} s: make its case smaller or give it the label slow")
            print(f"FAIL {outcome.test.name}: {outcome.why}", flush=True)
        elif outcome.seconds > limit:
            print(f"slow {outcome.test.name}: {outcome.seconds:.1f} s; a quick test takes at most {limit:g} s, {SLACK:g} times "
                  "that on a busy machine", flush=True)


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    for option in ("--name", "--label", "--not-label", "--whole"):
        parser.add_argument(option, metavar="REGEX")
    parser.add_argument("--targets", action="store_true")
    parser.add_argument("--limit", type=float, metavar="SECONDS")
    parser.add_argument("--allowed", metavar="FILE")
    parser.add_argument("--times", metavar="FILE")
    parser.add_argument("--results", metavar="FILE")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    args = parser.parse_args(arguments)
    tests = ctest_files.read(args.build)
    chosen = select(tests, args)
    if args.targets:
        print("\n".join(sorted({target for test, _ in chosen for target in ctest_files.targets(test, args.build)})))
        if any("python" in test.labels for test, _ in chosen):
            print("all")  # the package's module of declarations is made by the default target
        return 0
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, end_all)
    allowed, wrong = read_allowed(args.allowed, tests) if args.allowed else ([], [])

    last = os.path.join(args.build, "test_times.json")
    before = {}
    if os.path.isfile(last):
        with open(last, encoding="utf-8") as file:
            before = json.load(file)
    outcomes = run_all(chosen, args.jobs, before)
    if args.limit:
        hold_limit(outcomes, args.limit, allowed)
    times = {o.test.name: {"processor": round(o.seconds, 2), "wall": round(o.wall, 2)} for o in outcomes}
    for path, content in ((last, {**before, **times}), (args.times, times)):
        if path:
            with open(path, "w", encoding="utf-8") as file:
                json.dump(content, file, indent=0, sort_keys=True)

    findings, counts = [f"fail tests: {why}" for why in wrong], [0, len(wrong), 0]
    for outcome in outcomes:
        lines, count = outcome.lines()
        findings += lines
        counts = [a + b for a, b in zip(counts, count)]
    if not outcomes:
        findings.append("fail tests: no test was run")
        counts[1] += 1
    findings.append("count " + " ".join(str(count) for count in counts))
    if args.results:
        with open(args.results, "w", encoding="utf-8") as file:
            file.write("\n".join(findings) + "\n")
    own = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{len(outcomes)} tests, {own.ru_utime + own.ru_stime:.0f} s of processor time")
    return 2 if not outcomes else 1 if counts[1] else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
