# The same as scenes_again.cmd, of layouts and of a study.
copy small.yaml
$ mkdir out && $OMENTUM layouts small.yaml -q --count 1 -o out/many > /dev/null
exit 0

# The study writes its scene first.
$ omentum study sheet-calibration --quick --workers 1 -q -o out/study > /dev/null 2>&1 & pid=$!; for k in $(seq 200); do test -s out/study/sheet.yaml && break; sleep 0.02; done; kill -KILL $pid; wait $pid; test -s out/study/sheet.yaml
exit 0

$ mkdir other && cd other && bad=0; for f in $(cd ..; find out -name '*.yaml' | xargs grep -l '^tissue:' | sort); do $OMENTUM retract ../$f --dry-run -q > said 2>&1 && echo "$f yes" || { echo "$f no"; cat said; bad=1; }; done; exit $bad
exit 0
out ^out/many/layout-01/belief\.yaml yes$
out ^out/many/layout-01/scene\.yaml yes$
out ^out/study/sheet\.yaml yes$
no-err
