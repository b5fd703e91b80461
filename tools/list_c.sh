#!/bin/bash
# list_c.sh: every C file of the project, separated by zero bytes.
set -euo pipefail
cd "$(dirname "$0")/.."
find include src studies test bench fuzz samples -name '*.[ch]' -print0 2> /dev/null | sort -z || true
