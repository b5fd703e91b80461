#!/usr/bin/env python3
"""Run one CLI case: a command line and what must come of it.

    run_case.py PROGRAM case.cmd

A case file has comments (#) and these lines; $TMP is a fresh folder, $ROOT the checkout,
$OMENTUM is PROGRAM:

    write FILE            the following lines indented by four spaces become $TMP/FILE
    copy FILE             the file beside the case, into $TMP
    $ omentum ARGS...     the command, in shell syntax, run in $TMP; "omentum" is PROGRAM
    exit N                its exit code (needed; one for each command)
    out REGEX             a line of standard output matches (search)
    err REGEX             a line of standard error matches
    no-out, no-err        nothing is printed there
    err-lines N           standard error has exactly N lines
    file PATH             the file is there, below $TMP, and not empty
    no-file PATH          it is not there (half-written output)
"""
import os
import pathlib
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def parse(text):
    """Lines of a case as (line number, verb, argument); the body of `write` is joined to it."""
    steps = []
    for number, line in enumerate(text.split("\n"), 1):
        if steps and steps[-1][1] == "write" and (line.startswith("    ") or not line.strip()):
            steps[-1][3].append(line[4:])
        elif line.strip() and not line.startswith("#"):
            verb, _, argument = line.partition(" ")
            steps.append((number, verb, argument.strip(), []))
    return steps


def tail(text):
    return "\n".join("    | " + line for line in text.split("\n")[-30:])


def limit_time():
    """The hang limit of each program of a command: OM_TEST_CPU_S seconds of processor time, whatever else runs."""
    seconds = int(os.environ.get("OM_TEST_CPU_S", "0"))
    if seconds > 0:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.getrlimit(resource.RLIMIT_CPU)[1]))


class Case:
    def __init__(self, program, folder, beside):
        self.program, self.folder, self.beside, self.run = program, folder, beside, None
        self.exit_checked = True

    def command(self, argument):
        if not self.exit_checked:
            return "the command before has no exit line"
        line = re.sub(r"\bomentum\b", lambda _: shlex.quote(self.program), argument, count=1)
        env = dict(os.environ, TMP=str(self.folder), ROOT=str(ROOT), OMENTUM=self.program)
        self.run = subprocess.run(["bash", "-c", line], cwd=self.folder, env=env, stdin=subprocess.DEVNULL,
                                  capture_output=True, text=True, errors="replace", check=False,
                                  preexec_fn=limit_time)
        self.exit_checked = False
        return None

    def expect(self, verb, argument):
        """None, or what is wrong."""
        out, err = self.run.stdout, self.run.stderr
        if verb == "exit":
            self.exit_checked = True
            return None if self.run.returncode == int(argument) else f"exit code {self.run.returncode}"
        if verb in ("out", "err"):
            text = out if verb == "out" else err
            return None if re.search(argument, text, re.M) else f"no line of std{verb} matches"
        if verb in ("no-out", "no-err"):
            return None if not (out if verb == "no-out" else err) else "something was printed"
        if verb == "err-lines":
            return None if len(err.splitlines()) == int(argument) else f"{len(err.splitlines())} lines"
        path = self.folder / argument
        if verb == "file":
            return None if path.is_file() and path.stat().st_size > 0 else "no such file, or it is empty"
        if verb == "no-file":
            return None if not path.exists() else "it is there"
        return "unknown verb"

    def step(self, verb, argument, body):
        if verb == "write":
            path = self.folder / argument
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("\n".join(body).rstrip("\n") + "\n")
            return None
        if verb == "copy":
            shutil.copy(self.beside / argument, self.folder)
            return None
        if verb == "$":
            return self.command(argument)
        return self.expect(verb, argument) if self.run else "before any command"


def main():
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup it is ignored, by the program as well
    program, case_file = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as folder:
        case = Case(program, pathlib.Path(folder), case_file.parent)
        for number, verb, argument, body in parse(case_file.read_text()):
            why = case.step(verb, argument, body)
            if why:
                print(f"{case_file.name}:{number}: {verb} {argument}: {why}")
                if case.run:
                    print(f"exit {case.run.returncode}\nstdout\n{tail(case.run.stdout)}"
                          f"\nstderr\n{tail(case.run.stderr)}")
                sys.exit(1)
        if case.run is None or not case.exit_checked:
            sys.exit(f"{case_file.name}: a command without an exit line, or no command at all")


if __name__ == "__main__":
    main()
