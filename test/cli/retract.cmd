# omentum retract and demo: five lines, a report, and one sentence for whatever goes wrong.
write small.yaml
    name: small
    tissue:
      source: sheet
      cells: [8, 8, 1]
      world_cells: [12, 12, 1]
    attachments:
      kind: box
      lo_mm: [10, -100, -1]
      hi_mm: [100, 100, 1]
    roi:
      random: false
      center_mm: [-40, -30, 0]
    endoscope: {distance_mm: 200, elevation_deg: 45, fov_deg: 60, width: 80, height: 60}
    task:
      force_threshold: 3
      grasp_radius_mm: 11
      speed_mm_s: 50
$ omentum retract small.yaml -q -o run
exit 0
out ^small, layout 1: \d+ % of the ROI exposed after \d+ actions
out ROI visible: 0 % at the start, \d+ % at the end \(in the truth \d+ %\); it counts as exposed from 80 % on
out ^  pull on the tissue: at most 0\.\d\d N as the twin estimates it, 0\.\d\d N in the simulated truth \(up to 0\.\d\d N above
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

# A ROI that the picture does not hold.
$ sed 's/fov_deg: 60/fov_deg: 18/' small.yaml > narrow.yaml && omentum retract narrow.yaml -q -o narrow
exit 3
err narrow\.yaml: endoscope: with the tissue removed it sees \d+ % of the ROI.*outside the picture.*fov_deg or distance_mm
err-lines 1
no-file narrow

# The same bytes again, with one thread.
$ omentum retract small.yaml -q --workers 1 -o again && diff <(grep state_hash run/run.json) <(grep state_hash again/run.json) && cmp run/frames/003.png again/frames/003.png
exit 0

# Reaches and pulls by a policy: another way of the tips, the same outcome. A policy of another task is refused.
$ omentum retract small.yaml -q --json -o lines | grep -o '"path_mm": [0-9.]*' > a; omentum retract small.yaml -q --acting $ROOT/weights/approach.safetensors --json -o policy | grep -o '"path_mm": [0-9.]*' > b; wc -l < a; wc -l < b; cmp -s a b || echo other
exit 0
out ^1$
out ^other$
$ omentum retract small.yaml -q --acting $ROOT/weights/retract_ppo.safetensors -o wrong
exit 3
err motions need a policy of `omentum rl train -t approach`: the policy is of task retract, not of approach
no-file wrong
$ omentum retract small.yaml -q --acting $ROOT/weights/approach.safetensors --record -o wrong
exit 3
err --acting: a run by a policy cannot be replayed; leave out --record
no-file wrong

# Recorded, decided again from the observations alone, and with a changed line.
$ omentum retract small.yaml -q --record -o recorded
exit 0
out ^  observations: recorded/observations\.log, 0\.\d MB; omentum retract --replay recorded decides again from them$
$ omentum retract -q --replay recorded -o recorded-again.jsonl && cmp recorded/audit.jsonl recorded-again.jsonl
exit 0
out ^recorded: decided again from its observations: all \d+ lines are the same, 1 plans in \d\.\d s$
no-err
$ sed -i '3s/psm1/psm2/' recorded/audit.jsonl && omentum retract -q --replay recorded
exit 1
out ^recorded: line 3 of the audit differs$
out ^\{"event": "begin".*"arm": "psm2"
out ^\{"event": "begin".*"arm": "psm1"
$ omentum retract -q --replay run
exit 3
err run has no observations\.log; record a run by omentum retract --record
err-lines 1

# Not exposed is an outcome, not an error: exit code 1 and a report.
$ sed 's/lo_mm:.*/lo_mm: [-100, -100, -1]/' small.yaml > held.yaml && omentum retract held.yaml -q -o held
exit 1
out no plan is left
file held/report.html

# Many pictures: nine are shown, and all 21 folded at half the size. A margin is named with what it is for.
$ sed -e 's/center_mm:.*/center_mm: [45, 30, 0]/' -e 's/task:/task:\n  max_actions: 20\n  force_margin: 0.5/' small.yaml > long.yaml && omentum retract long.yaml -q -o long
exit 1
out ^small, layout 1: gave up after 20 actions
out ^  limit: the arms stop pulling at 2\.50 N by the estimate, the scene's threshold of 3\.00 N less a margin of 0\.50 N for its error; reached

$ grep -o '<summary>All 21 pictures, smaller' long/report.html; grep -o 'width="80" height="60" loading="eager"' long/report.html | wc -l; grep -o 'width="40" height="30" loading="lazy"' long/report.html | wc -l
exit 0
out ^<summary>All 21 pictures, smaller
out ^9$
out ^21$

# A ROI in view before any action is no success: exit code 1, and the report's verdict is a bad one.
$ sed -e 's/center_mm:.*/center_mm: [-59, -59, 0]/' -e 's/task:/task:\n  visibility: 0.4/' small.yaml > seen.yaml && omentum retract seen.yaml -q -o seen
exit 1
out ^small, layout 1: nothing to do: \d+ % of the ROI is in view before any action
file seen/report.html

$ grep -o 'class="verdict [a-z]*"' seen/report.html run/report.html; grep '"status"\|"exposed"' seen/run.json run/run.json
exit 0
out ^seen/report.html:class="verdict bad"
out ^run/report.html:class="verdict good"
out ^seen/run.json: *"exposed": false
out ^seen/run.json: *"status": "in_view_at_start"
out ^run/run.json: *"exposed": true
out ^run/run.json: *"status": "exposed"

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

# The printed scene has every default and gives the same run; the example and the page of keys are those of the program.
$ omentum retract small.yaml --print-scene > filled.yaml && $OMENTUM retract filled.yaml -q -o filled && diff <(grep state_hash run/run.json) <(grep state_hash filled/run.json) && grep -c "^  [a-z_]*: " filled.yaml
exit 0
out ^1[0-4]\d$

$ omentum retract --keys | diff - $ROOT/doc/scene_keys.md
exit 0
no-out

$ omentum retract --example > example.yaml && $OMENTUM retract example.yaml --dry-run -q -o example
exit 0
out ^example, layout 1: the scene can be run
out twin: 882 vertices \(\d+ attached\), 2400 tetrahedra; truth: 2883 vertices
out memory: \d+ MB so far, and up to \d+ MB for the report
out time: \d+\.\d s to begin, then about \d+\.\d\d s for each second of operation
no-err
no-file example

$ omentum retract slid.yaml --dry-run -q
exit 0
out note: the ROI is already visible
out note: the tissue slides while it settles

$ omentum retract --example small.yaml
exit 2
err one argument too many

$ omentum retract small.yaml --dry-run -q -o small.yaml
exit 3
err small\.yaml
err-lines 1

# The report names the law that was used.
$ sed 's/  source: sheet/  source: sheet\n  law: neo-hookean/' small.yaml > law.yaml && omentum retract law.yaml -q -o law
exit 0
out ^small, layout 1: (8\d|9\d|100) % of the ROI exposed

$ grep -c 'Twin: .* finite elements, neo-hookean' law/report.html && ! grep -q 'finite elements, neo-hookean' run/report.html
exit 0
out ^1$

# Layouts in a row.
$ omentum retract small.yaml -q --layouts 2 -o many
exit 0
out ^ 1  exposed
out ^ 2  exposed
out 2 of 2 layouts exposed
file many/layout-01/report.html
file many/layout-02/report.html

# Layouts from another one on; what could expose the ROI at all.
$ omentum retract small.yaml -q --layouts 1 --first 18 -o later
exit 0
out ^18  exposed
file later/layout-18/report.html

$ omentum retract small.yaml -q --search --layout 2
exit 0
out ^small, layout 2: [1-9]\d* of [1-9]\d* sequences of \d+ grasps expose the ROI; largest visibility: \d+ %, block \(\d,\d\) lifted

$ omentum retract small.yaml -q --calibrate-force --layouts 1
exit 0
out largest pull of 25 grasps in 1 layouts
out ^force_threshold: \d
out ^force_margin: \d

# How much too stiffly the twin's mesh bends; in the scene the factor lowers the twin's modulus, and no other's.
$ omentum retract small.yaml -q --calibrate-mesh
exit 0
out ^small: under its own weight the twin's mesh of \d+ tetrahedra yields [1-9]\d % as much as the same mesh refined
out ^mesh_factor: 0\.[1-9]\d*  # under

$ sed -e 's/  source: sheet/  source: sheet\n  mesh_factor: 1.5/' small.yaml > factor.yaml && omentum retract factor.yaml -q --dry-run
exit 3
err mesh_factor.*1\.5.*0\.01 to 1

# A twin of particles has no forces in newtons: it is refused unless the scene does without them.
$ sed -e 's/  source: sheet/  source: sheet\n  engine: pbd/' small.yaml > blind.yaml && omentum retract blind.yaml -q -o blind
exit 3
err engine "pbd" has no forces in newtons.*watch_force: false.*fem, xpbd, springs
err-lines 1

$ omentum retract blind.yaml -q --calibrate-force --layouts 1
exit 3
err engine "pbd" has no forces in newtons to calibrate

$ sed -e 's/  source: sheet/  source: sheet\n  engine: pbd/' -e 's/task:/task:\n  watch_force: false/' -e 's/ cells: .*/ cells: [16, 16, 1]/' -e 's/world_cells: .*/world_cells: [24, 24, 1]/' small.yaml > pbd.yaml && omentum retract pbd.yaml -q -o pbd; test $? -le 1
exit 0
out ^small, layout 1: \d+ % of the ROI exposed after \d+ actions
out ^  pull on the tissue: not known to the twin, whose engine pbd has no forces, \d\.\d\d N in the simulated truth$
out ^  limit: none; the scene says watch_force: false$
file pbd/report.html

$ grep -c '"force_watched": false' pbd/run.json; grep -c '"force_max_n": null' pbd/run.json | grep -c -v '^0'; grep -c 'not watched: the arms do not stop for force' pbd/report.html
exit 0
out ^1$

$ grep -c 'Twin: .* particles in clusters.*Simulated truth: .* finite elements, stable-neo-hookean' pbd/report.html
exit 0

# A twin of springs, and one of links.
$ sed -e 's/  source: sheet/  source: sheet\n  engine: springs/' small.yaml > springs.yaml && omentum retract springs.yaml -q -o springs; test $? -le 1
exit 0
out ^small, layout 1: \d+ % of the ROI exposed after \d+ actions
file springs/report.html

$ sed -e 's/  source: sheet/  source: sheet\n  engine: chainmail/' -e 's/task:/task:\n  watch_force: false/' small.yaml > mail.yaml && omentum retract mail.yaml -q -o mail; test $? -le 1
exit 0
out ^small, layout 1: \d+ % of the ROI exposed after \d+ actions
file mail/report.html

$ sed 's/  source: sheet/  source: sheet\n  engine: xpdb/' small.yaml > xpdb.yaml && omentum retract xpdb.yaml -o xpdb
exit 3
err xpdb.yaml: tissue: engine "xpdb" is not known; did you mean "xpbd"\?; engines: fem, pbd, xpbd, springs, chainmail, umesh
err-lines 1

# The key's name of before.
$ sed 's/  source: sheet/  source: sheet\n  model: pbd/' small.yaml > old.yaml && omentum retract old.yaml -o old
exit 3
err tissue: key "model" is now "engine"
err-lines 1

# An engine that needs a file, and one that takes none; a file that is no network.
$ sed -e 's/  source: sheet/  source: sheet\n  engine: umesh/' -e 's/task:/task:\n  watch_force: false/' small.yaml > net.yaml && omentum retract net.yaml -o net
exit 3
err net.yaml: tissue: engine umesh needs a file; name it by the key weights
err-lines 1

$ sed 's/  source: sheet/  source: sheet\n  weights: net.yaml/' small.yaml > file.yaml && omentum retract file.yaml -o file
exit 3
err file.yaml: tissue: engine fem reads no file; remove the key weights
err-lines 1

$ sed -e 's/  source: sheet/  source: sheet\n  engine: umesh\n  weights: small.yaml/' -e 's/task:/task:\n  watch_force: false/' small.yaml > text.yaml && omentum retract text.yaml -q -o text
exit 3
err small.yaml
err-lines 1

# Wrong input.
$ omentum retract none.yaml -o out
exit 3
err none\.yaml: .*[Nn]o such file
err-lines 1

$ sed 's/force_threshold/force_treshold/' small.yaml > typo.yaml && omentum retract typo.yaml -o out
exit 3
err typo\.yaml:15: .*"force_treshold".*did you mean "force_threshold"
err-lines 1
no-file out

$ sed 's/grasp_radius_mm: 11/grasp_radius_mm: wide/' small.yaml > type.yaml && omentum retract type.yaml -o out
exit 3
err type\.yaml:16
err-lines 1

$ sed 's/center_mm:.*/center_mm: [-400, 0, 0]/' small.yaml > far.yaml && omentum retract far.yaml -q -o out
exit 3
err far\.yaml: roi: center_mm .* is not under the tissue
err-lines 1
no-file out

$ omentum retract $ROOT/scenes/kidney.yaml --data . -q -o out
exit 3
err ct_abdomen/labels\.nii\.gz: no such file.*--data
err-lines 1
no-file out

$ omentum retract small.yaml
exit 2
err add -o DIR

$ omentum retract small.yaml --search --update
exit 2
err --search has no updates; leave out --update

$ omentum retract -o out
exit 2
err no scene is given

$ omentum retract small.yaml -o out --layuot 3
exit 2
err did you mean --layout

$ omentum retract small.yaml -q -o out --program none.lp
exit 3
err none\.lp
no-file out

$ printf 'a :- b, .\n' > bad.lp; omentum retract small.yaml -q -o out --program bad.lp
exit 3
err bad\.lp:1
no-file out

$ touch taken && omentum retract small.yaml -q -o taken/out
exit 3
err taken
err-lines 1

# A full disk, as a limit on the size of files: one sentence, and the audit, since the operation took place.
$ mkdir full && (trap '' XFSZ; ulimit -f 300; omentum retract small.yaml -q -o full/out; code=$?; ls -A full; exit $code)
exit 3
err full/out.*cannot .*: File too large
err-lines 1
out ^out-unfinished$

# Ctrl-C, SIGTERM, SIGHUP: the record so far is kept, beside what stands there, and no temporary folder is left.
$ mkdir int && (timeout -s INT 1 omentum retract $ROOT/scenes/sheet.yaml -q -o int/out; code=$?; ls -A int; exit $code)
exit 124
out ^out$
err cancelled; the record so far is in int/out$
err-lines 1
file int/out/report.html
$ (timeout -s HUP 1 omentum retract $ROOT/scenes/sheet.yaml -q -o int/out; code=$?; ls -A int | tr '\n' ' '; exit $code)
exit 124
out ^out out\.new-[0-9a-f]{8} $
err cancelled; the record so far is in int/out\.new-[0-9a-f]{8}$

# The same wish sent twice, as timeout and shells do, is one wish.
$ mkdir twice && (omentum retract $ROOT/scenes/sheet.yaml -q -o twice/out 2> /dev/null & p=$!; sleep 1; kill -TERM $p; kill -TERM $p; sleep 0.01; kill -TERM $p; wait $p; code=$?; ls -A twice; exit $code)
exit 130
out ^out$
file twice/out/run.json

$ omentum demo --quick -q -o demo
exit 0
out ^CT: \d+ x \d+ x \d+ voxels; labels by thresholds, Dice: fat 0\.9\d+, organ 0\.9\d+, tumour 0\.[89]\d+$
out ^model: \d+ tetrahedra, held at \d+ vertices
out ^plan before the operation: point
out ^demo: \d+ % of the ROI exposed
out report: demo/report\.html
file demo/report.html
file demo/ct.nrrd
file demo/labels.nrrd
file demo/scene.yaml
file demo/plan.json
file demo/model/report.html
file demo/run/report.html

$ omentum demo --slow
exit 2
err-lines 1

$ omentum retract --help
exit 0
out Examples:
