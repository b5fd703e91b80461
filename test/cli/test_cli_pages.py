#!/usr/bin/env python3
"""Help, man page, completion, parser and --json of the program come from one table of options: none may drift.

    test_cli_pages.py PROGRAM

Options and result keys are read from `omentum help VERB`. Each must be taken by the parser, be in the verb's section of
the man page and in the completion of bash (which is run), zsh and fish, and nothing else may be there.
"""
import json
import os
import re
import subprocess
import sys
import tempfile

PROGRAM = os.path.abspath(sys.argv[1])
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
    """Every verb, and the groups."""
    verbs, groups = [], []
    for name in members(run("--help").stdout):
        page = run("help", name).stdout
        if "Options (" in page:
            verbs.append(name)
        else:
            groups.append(name)
            verbs += [name + " " + sub for sub in members(page)]
    return verbs, groups


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


def complete_bash(script, line):
    words = line.split(" ")
    code = script + "\nCOMP_WORDS=(" + " ".join("'%s'" % w for w in words) + ")\nCOMP_CWORD=%d\n_omentum\n" % (
        len(words) - 1) + 'printf "%s\\n" "${COMPREPLY[@]}"\n'
    with tempfile.TemporaryDirectory() as empty:
        out = subprocess.run(["bash", "-c", code], capture_output=True, text=True, cwd=empty)
    check(out.returncode == 0 and not out.stderr, "bash: " + out.stderr)
    return set(out.stdout.split())


def check_verb(verb, man, bash, zsh, fish):
    words = verb.split(" ")
    page = run("help", *words)
    check(page.returncode == 0 and not page.stderr, "help " + verb)
    check(page.stdout == run(*words, "--help").stdout == run(*words, "-h").stdout, verb + " --help")
    options = options_of(page.stdout)
    names = {n for o in options for n in o[:2] if n}
    check({"--help", "--json"} <= names, verb + ": common options")
    check(len(options) == len({o[0] for o in options}), verb + ": an option twice")
    # the man page
    section = man.split(".SS omentum %s\n" % verb.replace("-", "\\-"))[1]
    section = re.split(r"^\.S[SH] ", section, flags=re.M)[0].replace("\\-", "-")
    in_man = set(re.findall(r"(?<![\w-])(--?[\w-]+)", "\n".join(
        line.split("\\fI")[0] for line in re.findall(r"^\.B (.*)$", section, re.M))))
    check(in_man == names, "%s: man page %s" % (verb, in_man ^ names))
    keys = re.search(r"(?:Figures|Keys) of --json:\n(.*?)\n\n", page.stdout, re.S)
    check(keys, verb + ": result keys")
    for key in re.findall(r"^  (\S+)", keys.group(1), re.M):
        check(key.rstrip(",") in section, "%s: key %s in the man page" % (verb, key))
    # completion
    check(complete_bash(bash, "omentum %s --" % verb) == {n for n in names if n.startswith("--")}, verb + ": bash")
    check(complete_bash(bash, "omentum help %s --" % verb) >= {"--help"}, verb + ": bash, help")
    part = zsh.split("    '%s')" % verb)[1].split("; return ;;")[0]
    check(set(re.findall(r"^\s+'\*(--?[\w-]+)", part, re.M)) == names, verb + ": zsh")
    given = "; and ".join("__fish_seen_subcommand_from " + w for w in words)
    lines = [line for line in fish.split("\n") if line.startswith("complete -c omentum -n '%s' -l" % given)]
    long = {"--" + n for line in lines for n in re.findall(r" -l ([\w-]+)", line.split(" -d ")[0])}
    short = {"-" + n for line in lines for n in re.findall(r" -s (\w)", line.split(" -d ")[0])}
    check(long | short == names, verb + ": fish")
    # the parser: an option that needs a value says so, as --name=value it is known; a flag takes no value
    for name, alias, arg in options:
        if name in ("--help", "--json"):
            continue
        for n in filter(None, (name, alias)):
            out = run(*words, n) if arg else run(*words, n + "=1") if n.startswith("--") else None
            if out is None:
                continue
            wanted = "needs " if arg else "takes no value"
            check(out.returncode == 2 and wanted in out.stderr, "%s %s: %s" % (verb, n, out.stderr))
    out = run(*words, "--jsom")
    check(out.returncode == 2 and "did you mean --json?" in out.stderr, verb + ": nearest option")
    out = run(*words, "--jsom", "--json")
    check(out.returncode == 2, verb + ": --json with a wrong option")
    try:
        result = json.loads(out.stdout)
        check(result["exit_code"] == 2 and result["verb"] == verb and "--jsom" in result["message"], verb + ": object")
    except (ValueError, KeyError) as error:
        check(False, "%s: --json: %s" % (verb, error))


def check_results():
    """Objects of verbs that end soon; their keys are those of the help."""
    with tempfile.TemporaryDirectory() as folder:
        out = run("umesh", "predict", "--at=-3,0,72", "--press=10", "--workers=1", "--json", "--point=-3,0,50",
                  cwd=folder)
        result = json.loads(out.stdout)
        figures = result["figures"]
        check(out.returncode == result["exit_code"] and result["outcome"] in ("done", "negative"), "predict: outcome")
        check(figures["nodes"] == 2866 and figures["prediction_ms"] > 0, "predict: figures")
        check(-10 < figures["point.0.z"] < 0, "predict: the point goes down")
        check("a prediction:" in out.stderr, "predict: text for people")
        out = run("plan", "--roi=3,3", "--json")
        check(json.loads(out.stdout)["outcome"] == "plan", "plan --json")
        out = run("retract", "nothing.yaml", "-o", "out", "--json", cwd=folder)
        result = json.loads(out.stdout)
        check(out.returncode == result["exit_code"] == 3 and "nothing.yaml" in result["message"], "retract --json")
        out = run("umesh", "predict", "--at=20,0,7x")
        check(out.returncode in (2, 3) and "20,0,7x" in out.stderr, "--at=value is read")


def main():
    verbs, groups = list_verbs()
    check(len(verbs) >= 13 and groups == ["banet", "rl", "study", "umesh"], "verbs %s, groups %s" % (verbs, groups))
    man = run("man").stdout
    bash, zsh, fish = (run("completion", s).stdout for s in ("bash", "zsh", "fish"))
    sections = re.findall(r"^\.SS omentum (.*)$", man, re.M)
    check(sorted(s.replace("\\-", "-") for s in sections) == sorted(verbs + groups), "sections of the man page")
    for code in (0, 1, 2, 3, 4, 130):
        check(".B %d\n" % code in man, "exit code %d in the man page" % code)
    for verb in verbs:
        check_verb(verb, man, bash, zsh, fish)
    for verb in ("model", "retract", "demo", "calibrate", "umesh train", "study methods"):
        check("--workers" in run("help", *verb.split(" ")).stdout, verb + ": --workers")
    check(complete_bash(bash, "omentum ") >= {"model", "umesh", "help", "completion"}, "bash: verbs")
    check(complete_bash(bash, "omentum umesh ") == {"eval", "generate", "predict", "train"}, "bash: umesh")
    check(complete_bash(bash, "omentum completion ") == {"bash", "zsh", "fish"}, "bash: shells")
    check(run("completion", "tcsh").returncode == 2, "completion of an unknown shell")
    check_results()
    print("%d verbs, %d failures" % (len(verbs), len(failures)))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
