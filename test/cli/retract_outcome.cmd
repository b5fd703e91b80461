# omentum retract: what is no success, and what the program and the report say of it.
copy small.yaml

# Not exposed is an outcome, not an error: exit code 1 and a report.
$ sed 's/lo_mm:.*/lo_mm: [-100, -100, -1]/' small.yaml > held.yaml && omentum retract held.yaml -q -o held
exit 1
out no plan is left
file held/report.html

# Many pictures: nine are shown, and all 13 folded at half the size. A margin is named with what it is for.
$ sed -e 's/center_mm:.*/center_mm: [45, 30, 0]/' -e 's/task:/task:\n  max_actions: 12\n  force_margin: 0.5/' small.yaml > long.yaml && omentum retract long.yaml -q -o long
exit 1
out ^small, layout 1: gave up after 12 actions
out ^  limit: the arms stop pulling at 2\.50 N by the estimate, the scene's threshold of 3\.00 N less a margin of 0\.50 N for its error; reached

$ grep -o '<summary>All 13 pictures, smaller' long/report.html; grep -o 'width="80" height="60" loading="eager"' long/report.html | wc -l; grep -o 'width="40" height="30" loading="lazy"' long/report.html | wc -l
exit 0
out ^<summary>All 13 pictures, smaller
out ^9$
out ^13$

# A ROI in view before any action is no success: exit code 1, and the report's verdict is a bad one.
$ sed -e 's/center_mm:.*/center_mm: [-59, -59, 0]/' -e 's/task:/task:\n  visibility: 0.4/' small.yaml > seen.yaml && omentum retract seen.yaml -q -o seen
exit 1
out ^small, layout 1: nothing to do: \d+ % of the ROI is in view before any action
file seen/report.html

$ grep -o 'class="verdict [a-z]*"' seen/report.html; grep '"status"\|"exposed"' seen/run.json
exit 0
out ^class="verdict bad"
out ^ *"exposed": false
out ^ *"status": "in_view_at_start"

# The same because the tissue fell while it settled, before any action: the program and the report say so.
$ sed -e 's/lo_mm:.*/lo_mm: [40, -100, -1]/' -e 's/  source: sheet/  source: sheet\n  board: false/' small.yaml > slid.yaml && omentum retract slid.yaml -q -o slid
exit 1
out ^small, layout 1: nothing to do: .* the tissue slid off by \d+ mm while it settled
out note: the tissue still moved when the operation began
out note: the tissue slid while it settled, before any action: by \d+\.\d mm in the twin

$ grep -c 'Warning: the tissue slid while it settled\|Warning: the tissue still moved' slid/report.html; grep '_at_start"' slid/run.json
exit 0
out ^2$
out "settled_at_start": false
out "slid_at_start": true
