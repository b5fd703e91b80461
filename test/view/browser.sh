#!/bin/sh
# browser.sh PROGRAM SCENES MODULES: the test of the page in a browser, or a skip with its reason.
command -v node > /dev/null || { echo "skip: node is not installed"; exit 77; }
NODE_PATH="$3${NODE_PATH:+:$NODE_PATH}" exec node "$(dirname "$0")/browser.js" "$1" "$2"
