#!/usr/bin/env python3
"""The warnings of the second compiler: clang reads every file that build/release compiles, and writes nothing.

    tools/clang_syntax.py [BUILD]     exit 1 and the messages where there are some
"""
import json
import multiprocessing.dummy
import os
import re
import shlex
import subprocess
import sys

GCC_ONLY = r"-O\d|-fopenmp|-fno-gcse-after-reload|-fno-tree-pre|-fira-region"


def read(entry):
    """What clang says of one file."""
    words, command = shlex.split(entry["command"]), []
    skip = 0
    for word in words[1:]:
        if skip:
            skip -= 1
        elif word in ("-o", "-MF", "-MT"):
            skip = 1
        elif word not in ("-c", "-MD") and not re.match(GCC_ONLY, word):
            command.append(word)
    done = subprocess.run(["clang", *command, "-UOM_WITH_OPENMP", "-fsyntax-only", "-Werror", "-Wno-double-promotion"],
                          cwd=entry["directory"], capture_output=True, text=True, check=False)
    return done.stderr if done.returncode else ""


def main():
    build = sys.argv[1] if len(sys.argv) > 1 else "build/release"
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
        entries = {entry["file"]: entry for entry in json.load(file)}
    with multiprocessing.dummy.Pool(os.cpu_count()) as pool:
        messages = [text for text in pool.map(read, entries.values()) if text]
    print("".join(messages), end="")
    print(f"clang read {len(entries)} files, {len(messages)} with messages")
    return 1 if messages or not entries else 0


if __name__ == "__main__":
    sys.exit(main())
