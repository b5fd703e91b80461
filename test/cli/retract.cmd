# omentum retract: five lines, a report, the same bytes again.
copy small.yaml
$ omentum retract small.yaml -q -o run
exit 0
out ^small, layout 1: \d+ % of the ROI exposed after \d+ actions
out ROI visible: 0 % at the start, \d+ % at the end \(in the truth \d+ %\); it counts as exposed from 80 % on
out ^  pull on the tissue: at most 0\.\d\d N as the robot estimates it, 0\.\d\d N in the simulated truth \(up to 0\.\d\d N above
out ^  limit: the arms stop pulling at 3\.00 N by the estimate, the scene's threshold; reached 0 times$
out a twin step \d+\.\d+ ms
out report: run/report\.html
no-err
file run/report.html
file run/run.json
file run/run.vtkhdf
file run/frames/000.png
file run/audit.jsonl
file run/scene.yaml
no-file run-unfinished
no-file run/observations.log

# The report names a margin only where the scene has one.
$ grep -o 'force threshold 3.00 N[;,][a-z ]*' run/report.html
exit 0
out ^force threshold 3\.00 N; exposed at

# Both forces, and how far they are apart.
$ grep -c force_world_above_twin_max_n run/run.json; grep -c '"force_world_n"' run/run.json; grep '"force_max_n"\|"force_world_max_n"' run/run.json | head -2 | sed 's/.*: *//' | sort -u | wc -l
exit 0
out ^1$
out ^\d\d+$
out ^2$

# The same bytes again, with one thread.
$ omentum retract small.yaml -q --workers 1 -o again && diff <(grep state_hash run/run.json) <(grep state_hash again/run.json) && cmp run/frames/003.png again/frames/003.png
exit 0

# Exposed: the report says so.
$ grep -o 'class="verdict [a-z]*"' run/report.html; grep '"status"\|"exposed"' run/run.json
exit 0
out ^class="verdict good"
out ^ *"exposed": true
out ^ *"status": "exposed"

# The printed scene has every default and gives the same run.
$ omentum retract small.yaml --print-scene > filled.yaml && $OMENTUM retract filled.yaml -q -o filled && diff <(grep state_hash run/run.json) <(grep state_hash filled/run.json) && grep -c "^  [a-z_]*: " filled.yaml
exit 0
out ^9[5-9]$
