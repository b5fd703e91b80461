#!/usr/bin/env python3
"""What Doxygen reads in place of a header (doc/Doxyfile, FILTER_PATTERNS); writes to standard output.

The headers write the meaning of a field as a plain comment behind it. Here such comments become Doxygen's:

    double dt;  // s, > 0          ->  double dt;  ///< s, > 0
    // s, > 0                      ->  /// s, > 0, above a field
    typedef struct OmView {  // x  ->  the comment moves above the struct
    the first empty line           ->  @file: the comment at the top is the file's, not the first macro's

Lines are neither added nor removed, so that line numbers of warnings stay right.
"""
import re
import sys

FIELD = re.compile(r"^(.*(?:[;,]|#define\s+\w+\s+\S+|\w))\s+//(?!/)\s?(.*)$")
GOES_ON = re.compile(r"^\s*//(?!/)\s?(.*)$")
OPENS = re.compile(r"^(typedef (?:struct|enum|union)[^{]*|enum |struct \w+ ){\s*//\s?(.*)$")


def header(lines):
    has_file = False
    is_field = False  # the line before ended with the comment of a field
    for number, line in enumerate(lines):
        if number < 5 and line == "///" and not has_file:
            line, has_file = "/// @file", True
        opens, goes_on, field = OPENS.match(line), GOES_ON.match(line), FIELD.match(line)
        if opens:
            line = f"/** {opens.group(2)} */ {opens.group(1)}{{"
            is_field = False
        elif goes_on:
            if is_field:
                line = f"    ///< {goes_on.group(1)}"
            elif line.startswith("    "):  # above a field
                line = f"    /// {goes_on.group(1)}"
        elif field and not line.lstrip().startswith("//"):
            line = f"{field.group(1)} ///< {field.group(2)}"
            is_field = True
        else:
            is_field = False
        yield line


def main():
    path = sys.argv[1]
    with open(path, encoding="utf-8") as file:
        lines = file.read().split("\n")
    lines = header(lines)
    sys.stdout.write("\n".join(lines))


if __name__ == "__main__":
    main()
