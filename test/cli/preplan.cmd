# omentum preplan: a map of the grid, a plan file, a report.
copy small.yaml
$ echo '  grid: 2' >> small.yaml
exit 0
$ omentum preplan small.yaml -q -o plan
exit 0
out ^small, layout 1: point \(\d,\d\), PSM\d: \d pulls? .*exposes? \d+ % of the ROI in \d+ actions, 0\.\d\d N$
out ^visibility of the ROI, %$
out ^largest pull, N$
out ^actions$
out ^ +y  2 +\d+[*<]? +held
out \d+ of 4 grasping points tried, \d+ expose the ROI
out report: plan/report\.html
no-err
file plan/report.html
file plan/plan.json

# The first screen of the page: what was asked, what came out.
$ grep -cE 'Asked: a grasping point from which at least 80 % of the ROI .* Came out: [0-4] of the 4 grasping points' plan/report.html
exit 0
out ^1$

# Any number of workers writes the same plan.
$ omentum preplan small.yaml -q --workers 1 -o one > /dev/null; cmp plan/plan.json one/plan.json
exit 0

# No point exposes: the best one, a warning, exit code 1.
$ (cat small.yaml; echo '  max_height_mm: 10'; echo '  retract_mm: 10') > low.yaml; omentum preplan low.yaml -q -o low
exit 1
out warning: none of \d points exposes 80 % of the ROI; the best is

$ omentum preplan low.yaml -q --json -o low
exit 1
out "exposing": 0

$ omentum preplan small.yaml
exit 2
err add -o DIR

$ omentum preplan
exit 2
err no scene is given

$ mkdir mine && touch mine/file && omentum preplan small.yaml -q -o mine
exit 3
err mine

$ omentum preplan --help
exit 0
out Examples:
