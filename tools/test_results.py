#!/usr/bin/env python3
"""Read what `ctest --output-junit FILE` wrote and its exit code: count the tests, name what failed and was skipped.

    test_results.py FILE EXIT_CODE

One line for each finding, then the counts:

    fail NAME: reason                a test that failed, or that could not be started
    skip NAME: case: reason          a skipped case of a program whose other cases ran, or a skipped test
    count PASSED FAILED SKIPPED      a program with skipped cases counts as passed, and each such case as skipped

A test program returns 77 if every case was skipped; every other test that did not run (no executable, a required
file missing, disabled) counts as failed, and so does a run whose exit code is not explained by a failed test.
"""
import re
import sys
import xml.etree.ElementTree


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


def read(path, code):
    """The lines to print."""
    lines, passed, failed, skipped = [], 0, 0, 0

    def fail(name, why):
        nonlocal failed
        failed += 1
        lines.append(f"fail {name}: {why}")

    try:
        suite = xml.etree.ElementTree.parse(path).getroot()
    except (OSError, xml.etree.ElementTree.ParseError) as error:
        return [f"fail ctest: wrote no result ({error})", "count 0 1 0"]
    for test in suite.iter("testcase"):
        name, status = test.get("name"), test.get("status")
        why = test.find("skipped")
        why = why.get("message", "") if why is not None else ""
        cases = skipped_cases(test.findtext("system-out") or "")
        if status == "fail":
            fail(name, "failed")
        elif status == "notrun" and why == "SKIP_RETURN_CODE=77":
            skipped += max(1, len(cases))
            lines += [f"skip {name}: {case}: {reason}" for case, reason in cases] or [f"skip {name}"]
        elif status == "run":
            passed += 1
            skipped += len(cases)
            lines += [f"skip {name}: {case}: {reason}" for case, reason in cases]
        else:
            fail(name, why or status or "no status")
    if passed + failed + skipped == 0:
        fail("ctest", "ran no test")
    if code != 0 and failed == 0:
        fail("ctest", f"exit code {code}, and no test failed")
    return lines + [f"count {passed} {failed} {skipped}"]


if __name__ == "__main__":
    print("\n".join(read(sys.argv[1], int(sys.argv[2]))))
