"""The tests of a build folder, as CMake writes them for CTest. `ctest --show-only` leaves out the commands of tests that are
not built yet, and CTest does not count processor time: tools/run_tests.py and tools/mutants.py read the files themselves."""
import collections
import os
import re

# name; command (list); labels (set); folder it runs in; environment (dict); seconds of the wall clock; exit code "skipped"
Test = collections.namedtuple("Test", "name command labels folder environment timeout skip_code")
WORD = r'"((?:[^"\\]|\\.)*)"'


def read_text(text, folder):
    """The tests of one CTestTestfile.cmake of `folder`, in its order."""
    commands, properties = {}, collections.defaultdict(dict)
    for kind, name, rest in re.findall(r"^(add_test|set_tests_properties)\(\[=\[(.*?)\]=\](.*)\)$", text, re.M):
        if kind == "add_test":
            commands[name] = [re.sub(r"\\(.)", r"\1", word) for word in re.findall(WORD, rest)]
        else:
            properties[name].update(re.findall(rf"(\w+) {WORD}", rest))
    tests = []
    for name, command in commands.items():
        own = properties[name]
        environment = dict(item.partition("=")[::2] for item in own.get("ENVIRONMENT", "").split(";") if item)
        labels = frozenset(label for label in own.get("LABELS", "").split(";") if label)
        tests.append(Test(name, command, labels, own.get("WORKING_DIRECTORY", folder), environment,
                          float(own.get("TIMEOUT", 1500)), int(own.get("SKIP_RETURN_CODE", -1))))
    return tests


def read(build):
    """All tests of a build folder, in CTest's order."""
    tests, build = [], os.path.abspath(build)

    def visit(folder):
        path = os.path.join(folder, "CTestTestfile.cmake")
        if not os.path.isfile(path):
            return
        with open(path, encoding="utf-8") as file:
            text = file.read()
        tests.extend(read_text(text, folder))
        for sub in re.findall(r'^subdirs\("(.*)"\)$', text, re.M):
            visit(os.path.join(folder, sub))

    visit(build)
    return tests


def targets(test, build):
    """What must be built for a test: the files of its command and its environment that lie in the build folder."""
    inside = os.path.abspath(build) + "/"
    words = list(test.command) + list(test.environment.values())
    return [word[len(inside):] for word in words if word.startswith(inside) and not os.path.isdir(word)]
