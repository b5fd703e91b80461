#!/usr/bin/env python3
"""Help, man page, completion, parser and --json of the program come from one table of options: none may drift.

    test_cli_pages.py PROGRAM [parser [K/N]]

Options and result keys are read from `omentum VERB --help`. Each must be in the verb's section of the man page and in the
completion of bash (which is run), zsh and fish, and nothing else may be there. With `parser`: the parser of each verb takes
them; K/N: of every N-th verb from the K-th. A start of the program takes 30 ms of processor time: verbs share the forms of
help and of an option between them.
"""
import json
import os
import re
import subprocess
import sys
import tempfile

PROGRAM = os.path.abspath(sys.argv[1])
GROUPS = ["banet", "rl", "study", "umesh"]
failures = []


def run(*words, cwd=None):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, timeout=300, cwd=cwd)


def check(is_true, what):
    if not is_true:
        failures.append(what)
        print("FAILED:", what)


def members(text):
    return re.findall(r"^  ([a-z][a-z-]*)  +\S", text, re.M)


def list_verbs():
    """The help page of every verb by its name, and the groups."""
    pages, groups = {}, []
    for name in members(run("--help").stdout):
        page = run(name, "--help").stdout
        if "Options (" in page:
            pages[name] = page
        else:
            groups.append(name)
            for sub in members(page):
                pages[name + " " + sub] = run(name, sub, "--help").stdout
    return pages, groups


def options_of(page):
    """(name, alias, argument) of each option of a help page."""
    part = page.split("Options (also --name=value):\n")[1].split("\n\n")[0]
    found = []
    for line in part.split("\n"):
        m = re.match(r"  (--[\w-]+)(?:, (-{1,2}[\w-]+))?(?: (\S+))? +\S", line)
        check(m, "option line: " + line)
        left = line[2:].split("  ")[0].split(" ")
        arg = left[-1] if not left[-1].startswith("-") else None
        found.append((m.group(1), m.group(2), arg))
    return found


def complete_bash(script, lines):
    """What bash completes at the end of each line, by one bash."""
    code = script
    for line in lines:
        words = line.split(" ")
        code += "\nCOMP_WORDS=(" + " ".join("'%s'" % w for w in words) + ")\nCOMP_CWORD=%d\nCOMPREPLY=()\n_omentum\n" % (
            len(words) - 1) + 'echo "${COMPREPLY[*]}"\n'
    with tempfile.TemporaryDirectory() as empty:
        out = subprocess.run(["bash", "-c", code], capture_output=True, text=True, cwd=empty)
    check(out.returncode == 0 and not out.stderr, "bash: " + out.stderr)
    found = [set(line.split()) for line in out.stdout.split("\n")]
    check(len(found) == len(lines) + 1, "bash: a line for each completion")
    return dict(zip(lines, found))


def check_verb(verb, page, man, completed, zsh, fish):
    words = verb.split(" ")
    options = options_of(page)
    names = {n for o in options for n in o[:2] if n}
    check({"--help", "--json"} <= names, verb + ": common options")
    check(len(options) == len({o[0] for o in options}), verb + ": an option twice")
    # the man page
    section = man.split(".SS omentum %s\n" % verb.replace("-", "\\-"))[1]
    section = re.split(r"^\.S[SH] ", section, flags=re.M)[0].replace("\\-", "-")
    in_man = set(re.findall(r"(?<![\w-])(--?[\w-]+)", "\n".join(
        line.split("\\fI")[0] for line in re.findall(r"^\.B (.*)$", section, re.M))))
    check(in_man == names, "%s: man page %s" % (verb, in_man ^ names))
    keys = re.search(r"(?:Figures|Keys) of --json:\n(.*?)\n\n", page, re.S)
    check(keys, verb + ": result keys")
    for key in re.findall(r"^  (\S+)", keys.group(1), re.M):
        check(key.rstrip(",") in section, "%s: key %s in the man page" % (verb, key))
    # completion
    check(completed["omentum %s --" % verb] == {n for n in names if n.startswith("--")}, verb + ": bash")
    check(completed["omentum help %s --" % verb] >= {"--help"}, verb + ": bash, help")
    part = zsh.split("    '%s')" % verb)[1].split("; return ;;")[0]
    check(set(re.findall(r"^\s+'\*(--?[\w-]+)", part, re.M)) == names, verb + ": zsh")
    given = "; and ".join("__fish_seen_subcommand_from " + w for w in words)
    lines = [line for line in fish.split("\n") if line.startswith("complete -c omentum -n '%s' -l" % given)]
    long = {"--" + n for line in lines for n in re.findall(r" -l ([\w-]+)", line.split(" -d ")[0])}
    short = {"-" + n for line in lines for n in re.findall(r" -s (\w)", line.split(" -d ")[0])}
    check(long | short == names, verb + ": fish")


def check_parser(index, verb, page):
    """An option that needs a value says so, by both of its names; a flag takes no value: one option a verb, of all kinds in
    turn. A wrong option is a JSON object, and the nearest one is named."""
    words = verb.split(" ")
    options = [o for o in options_of(page) if o[0] not in ("--help", "--json")]
    asked = [(n, arg) for name, alias, arg in options for n in (name, alias) if n and (arg or n.startswith("--"))]
    name, arg = asked[index % len(asked)]
    out = run(*words, name) if arg else run(*words, name + "=1")
    wanted = "needs " if arg else "takes no value"
    check(out.returncode == 2 and wanted in out.stderr, "%s %s: %s" % (verb, name, out.stderr))
    out = run(*words, "--jsom", "--json")
    check(out.returncode == 2 and "did you mean --json?" in out.stderr, verb + ": nearest option")
    try:
        result = json.loads(out.stdout)
        check(result["exit_code"] == 2 and result["verb"] == verb and "--jsom" in result["message"], verb + ": object")
    except (ValueError, KeyError) as error:
        check(False, "%s: --json: %s" % (verb, error))


def check_results():
    """Objects of verbs that end soon (umesh predict: umesh_net.cmd); --name=value."""
    with tempfile.TemporaryDirectory() as folder:
        out = run("plan", "--roi=3,3", "--json")
        check(json.loads(out.stdout)["outcome"] == "plan", "plan --json")
        out = run("retract", "nothing.yaml", "-o", "out", "--json", cwd=folder)
        result = json.loads(out.stdout)
        check(out.returncode == result["exit_code"] == 3 and "nothing.yaml" in result["message"], "retract --json")


def check_pages(pages, groups):
    check(len(pages) >= 13 and groups == GROUPS, "verbs %s, groups %s" % (list(pages), groups))
    man = run("man").stdout
    bash, zsh, fish = (run("completion", s).stdout for s in ("bash", "zsh", "fish"))
    sections = re.findall(r"^\.SS omentum (.*)$", man, re.M)
    check(sorted(s.replace("\\-", "-") for s in sections) == sorted([*pages, *groups]), "sections of the man page")
    for code in (0, 1, 2, 3, 4, 130):
        check(".B %d\n" % code in man, "exit code %d in the man page" % code)
    for verb in ("plan", "umesh train"):
        words = verb.split(" ")
        check(run("help", *words).stdout == run(*words, "-h").stdout == pages[verb], verb + ": forms of help")
    lines = [form % verb for verb in pages for form in ("omentum %s --", "omentum help %s --")]
    completed = complete_bash(bash, lines + ["omentum ", "omentum umesh ", "omentum completion "])
    for verb, page in pages.items():
        check_verb(verb, page, man, completed, zsh, fish)
    for verb in ("model", "retract", "demo", "calibrate", "umesh train", "study methods"):
        check("--workers" in pages[verb], verb + ": --workers")
    check(completed["omentum "] >= {"model", "umesh", "help", "completion"}, "bash: verbs")
    check(completed["omentum umesh "] == {"eval", "generate", "predict", "train"}, "bash: umesh")
    check(completed["omentum completion "] == {"bash", "zsh", "fish"}, "bash: shells")
    check(run("completion", "tcsh").returncode == 2, "completion of an unknown shell")


def main():
    if sys.argv[2:3] == ["parser"]:
        first, stride = (int(n) for n in (sys.argv[3:] or ["1/1"])[0].split("/"))
        sections = re.findall(r"^\.SS omentum (.*)$", run("man").stdout, re.M)  # check_pages compares them with the pages
        names = sorted(name.replace("\\-", "-") for name in sections)
        asked = list(enumerate(name for name in names if name not in GROUPS))[first - 1::stride]
        pages = {verb: run(*verb.split(), "--help").stdout for _, verb in asked}
        for index, verb in asked:
            check_parser(index, verb, pages[verb])
        if first == 1:
            check_results()
    else:
        pages, groups = list_verbs()
        check_pages(pages, groups)
    print("%d verbs, %d failures" % (len(pages), len(failures)))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
