#!/usr/bin/env python3
"""The program under limits on its address space: it works, or ends with one sentence; never a signal, never a hang.

    test_space.py PROGRAM
"""
import resource
import subprocess
import sys

MB = 1 << 20
# What loads the libraries at all differs between systems; above this all must work.
ENOUGH = 700


def run(program, limit, words):
    def set_limit():
        resource.setrlimit(resource.RLIMIT_AS, (limit * MB, limit * MB))

    return subprocess.run([program, *words], preexec_fn=set_limit, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=120, check=False)


def main():
    program = sys.argv[1]
    wrong = []
    for limit in (60, 100, 130, 150, 158, 162, 166, 170, 180, 190, 200, 250, 300, 400, 500, 600, ENOUGH):
        for words in (["--help"], ["plan", "--roi", "2,2", "--grid", "3"]):
            result = run(program, limit, words)
            sentences = len(result.stderr.splitlines())
            is_fine = result.returncode == 0 and sentences == 0
            is_refused = result.returncode in (3, 127) and sentences == 1 and limit < ENOUGH
            print(f"{limit} MB, {words[0]}: {result.returncode} {result.stderr.strip()[:100]}")
            if not is_fine and not is_refused:
                wrong.append(f"{limit} MB: {' '.join(words)}: exit code {result.returncode}, {result.stderr}")
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
